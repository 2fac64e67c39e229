"""Declaration of every value of a scenario: section, name, SI unit, range, default and meaning.

The schema, the conversion to SI, the messages and the overrides all read these lists; the settings of controllers and
profiles come from their own catalogues. The ranges are wide: they exclude typing errors and values that no solver
could handle.
"""

import functools
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from importlib import resources
from typing import Any

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.kind import ControllerKind
from ppafo.documents.problems import quote
from ppafo.errors import KindError, ScenarioError, refused_as
from ppafo.kinds import Kinds
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.model.declaration import Quantity, quantities_of
from ppafo.model.effects.bandwidth import EFFECT as BANDWIDTH
from ppafo.parameters.parameter_set import Entry
from ppafo.plugins import nearest_kind
from ppafo.simulation.document import REFERENCE_OF, controlled_in, kind_at
from ppafo.simulation.motion_kind import MOTIONS, MotionKind, MotionSection, is_walk
from ppafo.simulation.scenario import (
    FreeMotion,
    GasModel,
    Initial,
    Leg,
    RegulatedLine,
    RunSettings,
    Sensors,
    SupplyLine,
)
from ppafo.units import to_si

*RUN, ACCURACY = quantities_of(RunSettings)
FREE = quantities_of(FreeMotion)
ANGLE = FREE[0]
LOCKED_ANGLE = "motion.angle"
# Without the external torque: with a leg it follows from equation (11).
LEG = (*FREE[:2], *quantities_of(Leg))
FOOT = {quantity.name: quantity for quantity in quantities_of(Leg)}
SHANK_LEVEL = Quantity("level", "rad", "", None, -10.0, 10.0)
GAIT_SHANK = "gait"
GAIT_START = Quantity("start", "1", "phase in strides at time 0, from heel strike", 0.0, 0.0, 1.0)
INITIAL = quantities_of(Initial)
PRESSURE_WORDS = {
    "supply": "pressure",
    "dorsiflexion_supply": "dorsiflexion_pressure",
    "atmosphere": "atmospheric_pressure",
}
"""Words for the pressures of the device, mapped to the names of these pressures in its supply."""
AT_REST = "atmosphere"

_DELAY, *_OF_SIGNALS, SEED = quantities_of(Sensors)
SENSORS = (_DELAY, *BANDWIDTH.quantities, *_OF_SIGNALS)

THERMAL = "thermal"
ISOTHERMAL = "isothermal"
THERMAL_GAS = quantities_of(GasModel)
WALL_AREA = "gas_model.wall_area_per_volume"

RATE = Quantity("rate", "Hz", "samples per second; or give the period", None, 1.0e-6, 1.0e8)
PERIOD = Quantity("period", "s", "time between two samples; or give the rate", None, 1.0e-8, 1.0e6)
SAMPLING = (RATE, PERIOD)

PURPOSE = "reference.beyond_reach"
"""Key of a file with the reason why its reference lies beyond the reach of the device."""
_OF_REACH = ("reference.", "supply.", "actuator.", "motion.", "device.")
"""Prefixes of paths that belong to a reference or affect the reach of the device."""
ANGLE_LEVEL = Quantity("level", "rad", "", None, -10.0, 10.0)

SUPPLY_LINE = "supply_line"
SUPPLY_LINES = tuple(line.name for line in fields(SupplyLine))

_REGULATED = quantities_of(RegulatedLine)

SECTIONS = (
    "device",
    "run",
    "motion",
    "initial",
    "controller",
    "reference",
    "sensors",
    "gas_model",
    SUPPLY_LINE,
    "assumed",
)
TEXTS = ("name", "description", "device.set", "device.valve")


@dataclass(frozen=True, slots=True)
class DeclaredContent:
    """Possible content of the files of one scenario type, as functions of a document and the components it names.

    ``find_kinds`` loads components (controller, profile, motion) of other packages. ``texts`` gives the paths of texts,
    ``quantities`` the declarations of numbers by path. ``same`` maps a path to an equivalent path under which the
    document keeps the value. ``appended`` maps a path to the section in whose own list of overrides the value belongs,
    and to the path within that section. ``check_motion`` raises an error for a motion that these files cannot have;
    its second argument is the start of the message.
    """

    find_kinds: Callable[[Mapping[str, Any], str], None]
    texts: Callable[[Mapping[str, Any]], tuple[str, ...]]
    quantities: Callable[[Mapping[str, Any]], dict[str, Quantity]]
    same: Mapping[str, str] = field(default_factory=dict)
    appended: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    check_motion: Callable[[object, str], None] = lambda _kind, _place: None

    def paths(self, document: Mapping[str, Any]) -> tuple[str, ...]:
        """Return every path that an override can set, apart from the paths of the device."""
        return (*self.texts(document), *self.quantities(document), *self.appended)


def changes_reach(paths: Iterable[str]) -> bool:
    """True if any path belongs to a reference or affects the reach of the device."""
    return any(path.startswith(_OF_REACH) for path in paths)


def controller_settings(kind: str, controlled: str = TORQUE) -> tuple[Quantity, ...]:
    """Return the settings of the named controller, in units of the controlled quantity; empty for an unknown name."""
    return law_settings(CONTROLLERS[kind], controlled) if kind in CONTROLLERS else ()


def law_settings(law: ControllerKind, controlled: str) -> tuple[Quantity, ...]:
    """Return the settings of a controller, in units of the controlled quantity."""
    # A law that knows no torque has its settings in units of its own.
    is_of_any = controlled in law.controls and TORQUE in law.controls
    return (
        tuple(CONTROLLED[controlled].setting(quantity) for quantity in law.quantities) if is_of_any else law.quantities
    )


def reference_settings(kind: str, controlled: str) -> tuple[Quantity, ...]:
    """Return the settings of a reference profile; unless the reference is a torque, its levels have no default."""
    followed = CONTROLLED[controlled]
    settings = profile_settings(kind, followed.level)
    if controlled == TORQUE or kind not in PROFILES:
        return settings
    profile, span = PROFILES[kind], followed.level.maximum - followed.level.minimum
    levels = {quantity.name for quantity in profile.quantities if not quantity.unit}

    def of_reference(quantity: Quantity) -> Quantity:
        if quantity.name not in levels:
            return quantity
        if quantity.name in profile.differences:
            return replace(quantity, unit=followed.difference, minimum=-span, maximum=span)
        return replace(quantity, default=None)

    return tuple(map(of_reference, settings))


def profile_settings(kind: str, prescribed: Quantity) -> tuple[Quantity, ...]:
    """Return the settings of a profile; levels, which have no unit of their own, get the prescribed quantity's unit."""
    settings = []
    for quantity in PROFILES[kind].quantities if kind in PROFILES else ():
        lowest, highest = max(quantity.minimum, prescribed.minimum), min(quantity.maximum, prescribed.maximum)
        # A level is a torque in a reference and an angle in a motion, so that it has no unit of its own.
        is_level = not quantity.unit
        settings.append(
            replace(quantity, unit=prescribed.unit, minimum=lowest, maximum=highest) if is_level else quantity
        )
    return tuple(settings)


def shank_settings(kind: str) -> tuple[Quantity, ...]:
    """Return the settings of the shank of a leg: settings of its profile, or the initial stride phase of its gait."""
    return (GAIT_START,) if kind == GAIT_SHANK else profile_settings(kind, SHANK_LEVEL)


def by_path(section: str, items: Iterable[Quantity]) -> dict[str, Quantity]:
    """Return the declarations of a section, keyed by path."""
    return {f"{section}.{quantity.name}": quantity for quantity in items}


def section_of(document: Mapping[str, Any]) -> MotionSection | None:
    """Return the ``[motion]`` section of the motion that a document names; None for an unknown motion and a walk."""
    kind = MOTIONS.get(kind_at(document, "motion"))
    return None if kind is None else kind.section


def motion_quantities(section: MotionSection | None, profile_kind: str) -> dict[str, Quantity]:
    """Return the declarations of the numbers of a motion with the named profile, keyed by path."""
    if section is None:
        return {}
    profile = section.profile
    inner = {} if profile is None else by_path(f"motion.{profile.name}", profile.settings(profile_kind))
    return by_path("motion", section.numbers) | inner


def quantities(document: Mapping[str, Any], of_motion: Mapping[str, Quantity] | None = None) -> dict[str, Quantity]:
    """Return the declaration of every number that a document with its components can contain, keyed by path.

    ``of_motion`` are declarations of the motion, if the document does not name it.
    """
    if of_motion is None:
        section = section_of(document)
        of_motion = motion_quantities(section, kind_at(document, profile_path(section)))
    controlled = controlled_in(document)
    declared = {
        **by_path("run", (*RUN, ACCURACY)),
        **of_motion,
        **by_path("initial", INITIAL),
        **by_path("controller", SAMPLING + controller_settings(kind_at(document, "controller"), controlled)),
        **by_path("reference", reference_settings(kind_at(document, "reference"), controlled)),
        **by_path("sensors", (*SENSORS, SEED)),
        **by_path("gas_model", THERMAL_GAS if kind_at(document, "gas_model") == THERMAL else ()),
    }
    return declared | line_paths() if SUPPLY_LINE in document else declared


def profile_path(section: MotionSection | None) -> str:
    """Return the path of the profile in a motion's section; "" for a motion without a profile."""
    return "" if section is None or section.profile is None else f"motion.{section.profile.name}"


def texts(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the path of every text that a document can contain."""
    kinds = ("motion.kind", "controller.kind", "reference.kind", REFERENCE_OF, PURPOSE, "gas_model.kind")
    section = section_of(document)
    if section is None or section.profile is None:
        return (*TEXTS, *kinds)
    path = profile_path(section)
    own = section.profile.own.get(kind_at(document, path), ())
    return (*TEXTS, *kinds, f"{path}.kind", *(f"{path}.{name}" for name in own))


def find_kinds(document: Mapping[str, Any], file: str) -> None:
    """Load the motion, controller and profiles that a document names, from other packages too.

    ``file`` is the document's name in messages. Raises ScenarioError if a component cannot be loaded.
    """
    check_motion_kind(kind_at(document, "motion"), f"{file}: motion.kind")
    kind = kind_at(document, "motion")
    # A kind that is missing is refused by the layout, which says what it may be.
    with refused_as(ScenarioError, f"{file}: motion.kind", KindError):
        is_known = not kind or kind in MOTIONS
    if not is_known:
        known = tuple(MOTIONS)
        hint = nearest_kind(kind, known, MotionKind)
        raise ScenarioError(f"{file}: motion.kind = {quote(kind)} is not known{hint}; allowed: {', '.join(known)}")
    sections: dict[str, Kinds[Any]] = {"controller": CONTROLLERS, "reference": PROFILES}
    motion = section_of(document)
    path = profile_path(motion)
    # A kind of the table's own, such as the gait of a shank, is no profile.
    if motion is not None and motion.profile is not None and kind_at(document, path) not in motion.profile.own:
        sections[path] = PROFILES
    for section, kinds in sections.items():
        with refused_as(ScenarioError, f"{file}: {section}.kind", KindError):
            kinds.get(kind_at(document, section))


def check_motion_kind(kind: object, place: str) -> None:
    """Raise ScenarioError if the motion is a walk; the message starts with ``place``."""
    with refused_as(ScenarioError, place, KindError):
        walks = isinstance(kind, str) and is_walk(kind)
    if walks:
        raise ScenarioError(
            f"{place}: a walk needs a walk file, not a scenario file, which moves the vane only; 'ppafo new walk' "
            f"writes a walk file"
        )


@functools.cache
def line_entries() -> dict[str, Entry]:
    """Return the defaults of values that ``[supply_line]`` omits, keyed by path such as ``dorsiflexion.droop``."""
    document = tomllib.loads((resources.files("ppafo.simulation") / "supply_line.toml").read_text(encoding="utf-8"))
    return {
        f"{line}.{quantity.name}": Entry.model_validate(document[line][quantity.name])
        for line in SUPPLY_LINES
        for quantity in _REGULATED
    }


@functools.cache
def line_quantities(line: str) -> tuple[Quantity, ...]:
    """Return the quantities that a file may give for one line, with defaults in SI."""
    entries = ((quantity, line_entries()[f"{line}.{quantity.name}"]) for quantity in _REGULATED)
    return tuple(
        replace(quantity, default=to_si(entry.value, entry.unit, quantity.unit)) for quantity, entry in entries
    )


def line_paths() -> dict[str, Quantity]:
    """Return the declarations of all numbers of both lines, by path such as ``supply_line.dorsiflexion.droop``."""
    return {
        f"{SUPPLY_LINE}.{line}.{quantity.name}": quantity for line in SUPPLY_LINES for quantity in line_quantities(line)
    }


OF_A_VANE = DeclaredContent(
    find_kinds, texts, lambda document: quantities(document) | line_paths(), check_motion=check_motion_kind
)
"""Possible content of the file of a vane alone; a file without supply lines can be given some."""
