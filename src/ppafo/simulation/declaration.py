"""Declaration of every value of a scenario: section, name, SI unit, range, default and meaning.

``declared(document)`` is the only list of what a scenario file may contain: checks, schema, overrides and messages read
it. The settings of controllers and profiles come from their own catalogues. The ranges are wide: they exclude typing
errors and values that no solver could handle.
"""

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import fields, replace
from importlib import resources
from typing import Any

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.kind import ControllerKind
from ppafo.errors import KindError, refused_as
from ppafo.kinds import Kinds
from ppafo.model.controlled import CONTROLLED, TORQUE
from ppafo.model.declaration import Quantity, quantities_of
from ppafo.model.effects.bandwidth import EFFECT as BANDWIDTH
from ppafo.parameters.declared import (
    ANY_KEY,
    SHORT_NAME,
    Content,
    Field,
    InnerTable,
    Many,
    Words,
    kind_at,
    numbers,
    quantities_in,
)
from ppafo.parameters.parameter_set import Entry
from ppafo.simulation.document import controlled_in
from ppafo.simulation.motion_kind import MOTIONS, VANE_MOTIONS, MotionSection, is_walk
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
AT_REST = "atmosphere"

_DELAY, *_OF_SIGNALS, SEED = quantities_of(Sensors)
SENSORS = (_DELAY, *BANDWIDTH.quantities, *_OF_SIGNALS)

THERMAL = "thermal"
ISOTHERMAL = "isothermal"
THERMAL_GAS = quantities_of(GasModel)
WALL_AREA = "gas_model.wall_area_per_volume"

RATE = Quantity("rate", "Hz", "samples per second; or give the period", None, 1.0e-6, 1.0e8, optional=True)
PERIOD = Quantity("period", "s", "time between two samples; or give the rate", None, 1.0e-8, 1.0e6, optional=True)
SAMPLING = (RATE, PERIOD)

PURPOSE = "reference.beyond_reach"
"""Key of a file with the reason why its reference lies beyond the reach of the device."""
ANGLE_LEVEL = Quantity("level", "rad", "", None, -10.0, 10.0)

SUPPLY_LINE = "supply_line"
SUPPLY_LINES = tuple(line.name for line in fields(SupplyLine))
_REGULATED = quantities_of(RegulatedLine)

HEAD: dict[str, Field] = {
    "schema_version": Words("version of this layout", True, (1,)),
    "name": Words(required=True, pattern=SHORT_NAME),
    "description": Words("purpose of this file"),
    "device": InnerTable("the hardware", True),
    "device.set": Words("name of a parameter set, or a path relative to this file", True),
    "device.valve": Words("name of one of the set's valves; its default valve unless given"),
    "device.overrides": Many(Words(), "such as 'valve.area=12.6mm^2'"),
}
"""Fields at the beginning of the files of scenarios and walks."""


def tail(document: Mapping[str, Any]) -> dict[str, Field]:
    """Return the fields at the end of the files of scenarios and walks: gas, supply lines, assumptions."""
    return {
        "gas_model": InnerTable("how the gas in the chambers behaves; isothermal unless given"),
        "gas_model.kind": Words("", True, (ISOTHERMAL, THERMAL)),
        **numbers("gas_model", THERMAL_GAS if kind_at(document, "gas_model") == THERMAL else ()),
        SUPPLY_LINE: InnerTable("regulators and lines of the gas; constant pressures unless given"),
        **line_paths(),
        "assumed": Many(Words(""), "assumed values without a source, with the reason for each", keys=ANY_KEY),
    }


def declared(document: Mapping[str, Any], motion: MotionSection | None = None) -> dict[str, Field]:
    """Return every field that a scenario file with the kinds of a document may have, by path.

    ``motion`` is the section of a motion that the document does not name. Raises KindError for a component that cannot
    be loaded, and for a walk.
    """
    controlled = controlled_in(document)
    profile = kind_at(document, "reference")
    motion = motion or section_of(document)
    law = named(CONTROLLERS, document, "controller")
    named(PROFILES, document, "reference")
    # Loaded motions of other packages move a vane alone, too.
    others = (name for name, kind in MOTIONS.loaded().items() if kind.section is not None)
    return {
        **HEAD,
        "run": InnerTable("times of the run, and its accuracy", True),
        **numbers("run", (*RUN, ACCURACY)),
        "motion": InnerTable("motion of the vane", True),
        "motion.kind": Words("", True, tuple(dict.fromkeys((*VANE_MOTIONS, *others)))),
        **({} if motion is None else motion_fields(motion, document)),
        "initial": InnerTable("state of the gas at the start; atmosphere unless given"),
        **numbers("initial", INITIAL),
        "controller": InnerTable("controller of the valve", True),
        "controller.kind": Words("", True, CONTROLLERS),
        **numbers("controller", (*SAMPLING, *(() if law is None else law_settings(law, controlled)))),
        "reference": InnerTable("reference of the controller, a torque unless 'of' names another quantity"),
        "reference.kind": Words("", True, PROFILES),
        "reference.of": Words("controlled quantity; torque unless given", allowed=CONTROLLED),
        PURPOSE: Words("reason for a reference intentionally beyond the reach of the device"),
        **numbers("reference", reference_settings(profile, controlled)),
        "sensors": InnerTable("sensors of the controller; ideal unless given"),
        **numbers("sensors", (*SENSORS, SEED)),
        **tail(document),
    }


def named(catalogue: Kinds[Any], document: Mapping[str, Any], section: str) -> Any:
    """Return the component that a section names; None for an unknown name. KindError if it cannot be loaded."""
    with refused_as(KindError, f"{section}.kind", KindError):
        return catalogue.get(kind_at(document, section))


def motion_fields(section: MotionSection, document: Mapping[str, Any]) -> dict[str, Field]:
    """Return the fields of the motion of a document."""
    found: dict[str, Field] = {**numbers("motion", section.numbers)}
    profile = section.profile
    if profile is None:
        return found
    path = f"motion.{profile.name}"
    kind = kind_at(document, path)
    if kind not in profile.own:
        named(PROFILES, document, path)
    found |= {
        path: InnerTable(profile.summary, True),
        f"{path}.kind": Words("", True, (*PROFILES, *profile.own)),
        **{f"{path}.{name}": Words(text, True) for name, text in profile.own.get(kind, {}).items()},
    }
    return found | numbers(path, profile.settings(kind))


def quantities(document: Mapping[str, Any], motion: MotionSection | None = None) -> dict[str, Quantity]:
    """Return the declaration of every number that a document with its components has, keyed by path."""
    lines = () if SUPPLY_LINE in document else line_paths()
    return {path: item for path, item in quantities_in(declared(document, motion)).items() if path not in lines}


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
    profile = PROFILES[kind]
    span = followed.level.maximum - followed.level.minimum
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
        lowest = max(quantity.minimum, prescribed.minimum)
        highest = min(quantity.maximum, prescribed.maximum)
        # A level is a torque in a reference and an angle in a motion, so that it has no unit of its own.
        is_level = not quantity.unit
        settings.append(
            replace(quantity, unit=prescribed.unit, minimum=lowest, maximum=highest) if is_level else quantity
        )
    return tuple(settings)


def shank_settings(kind: str) -> tuple[Quantity, ...]:
    """Return the settings of the shank of a leg: settings of its profile, or the initial stride phase of its gait."""
    return (GAIT_START,) if kind == GAIT_SHANK else profile_settings(kind, SHANK_LEVEL)


def section_of(document: Mapping[str, Any]) -> MotionSection | None:
    """Return the ``[motion]`` section of the motion that a document names; None for an unknown motion.

    Raises KindError for a walk.
    """
    kind = kind_at(document, "motion")
    with refused_as(KindError, "motion.kind", KindError):
        if is_walk(kind):
            raise KindError("a walk needs a walk file, not a scenario file; 'ppafo new walk' writes a walk file")
    motion = named(MOTIONS, document, "motion")
    return None if motion is None else motion.section


@functools.cache
def line_entries() -> dict[str, Entry]:
    """Return the defaults of values that ``[supply_line]`` omits, keyed by path such as ``dorsiflexion.droop``."""
    document = tomllib.loads((resources.files("ppafo.simulation") / "supply_line.toml").read_text(encoding="utf-8"))
    return {
        f"{line}.{quantity.name}": Entry(**document[line][quantity.name])
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


@functools.cache
def line_paths() -> dict[str, Quantity]:
    """Return the declarations of all numbers of both lines, by path such as ``supply_line.dorsiflexion.droop``."""
    return {
        path: quantity
        for line in SUPPLY_LINES
        for path, quantity in numbers(f"{SUPPLY_LINE}.{line}", line_quantities(line)).items()
    }


OF_A_VANE = Content(declared)
"""Possible content of the file of a vane alone; a file without supply lines can be given some."""
