"""Declarations of all values that a walk file may contain besides those of the device, and the layout of the file."""

import functools
from collections.abc import Iterable, Mapping
from typing import Annotated, Any

from pydantic import BaseModel, Field

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.walking.catalog import WALKING_CONTROLLERS, load_walking_controller, walking_controllers
from ppafo.documents.models import REFERENCE, make_schema, one_of, optional, table
from ppafo.documents.problems import quote
from ppafo.errors import KindError, ScenarioError, refused_as
from ppafo.model.declaration import Quantity
from ppafo.plugins import nearest_kind
from ppafo.simulation.declaration import PERIOD, RATE, SENSORS, TEXTS, THERMAL, THERMAL_GAS, DeclaredContent, line_paths
from ppafo.simulation.document import kind_at
from ppafo.simulation.motion_kind import MOTIONS, VANE_MOTIONS, WALK, MotionKind, is_walk
from ppafo.simulation.scenario import LARGEST_SEED
from ppafo.simulation.schema import controller_table, file_model, kind_field, model_name, number_type, quantity_fields
from ppafo.walking.bottle.supply import BOTTLE, BOTTLE_NAME, BOTTLE_NUMBERS, BOTTLE_OVERRIDES
from ppafo.walking.wearer import WEARER

SUMMARY = "the device on a leg that walks along a prescribed gait"
"""Description of the motion of a walk."""

SEED = Quantity("seed", "", "seed of noise and lost samples, a whole number", 1.0, 0.0, float(LARGEST_SEED))
STEP = Quantity("step", "s", "largest step; 1 ms unless given", 1.0e-3, 1.0e-6, 0.01)

DURATION = Quantity("duration", "s", "duration of the walk; default: 1 min, on a bottle 10 min", None, 1.0, 3600.0)

WALK_SENSORS = (
    *(quantity for quantity in SENSORS if quantity.name != "delay"),
    Quantity("force_bandwidth", "Hz", "bandwidth of the force sensors", 30.0, 0.1, 1.0e4),
    Quantity("force_noise", "N", "standard deviation of the measured forces", 0.0, 0.0, 1.0e4),
    Quantity("force_resolution", "N", "resolution of the measured forces", 0.0, 0.0, 1.0e3),
    Quantity("lost_share", "1", "fraction of the force samples that are lost", 0.0, 0.0, 1.0),
    Quantity("angle_lost_share", "1", "fraction of the angle samples that are lost", 0.0, 0.0, 1.0),
    Quantity("pressure_lost_share", "1", "fraction of the pressure samples that are lost", 0.0, 0.0, 1.0),
)
FORCES = tuple(quantity.name for quantity in WALK_SENSORS if quantity not in SENSORS)
"""Sensor settings that exist in a walk only: force sensors."""


def sections(controller: str, gas: str) -> dict[str, tuple[Quantity, ...]]:
    """Return the declarations of a walk's numbers by section, for a named controller."""
    laws = walking_controllers()
    return {
        "wearer": WEARER,
        "controller": (RATE, PERIOD, *(laws[controller].quantities if controller in laws else ())),
        "sensors": (*WALK_SENSORS, SEED),
        "run": (DURATION, STEP),
        "gas_model": THERMAL_GAS if gas == THERMAL else (),
    }


def by_path(declared: Mapping[str, Iterable[Quantity]]) -> dict[str, Quantity]:
    """Return declarations grouped by section as a flat mapping, keyed by dotted path."""
    return {f"{section}.{quantity.name}": quantity for section, items in declared.items() for quantity in items}


def find_kinds(document: Mapping[str, Any], file: str) -> None:
    """Load the plugin that defines the controller named in a document.

    Raises ScenarioError if loading fails.
    """
    motion = kind_at(document, "motion")
    _check_motion(motion, f"{file}: motion.kind = {quote(motion)}")
    with refused_as(ScenarioError, f"{file}: controller.kind", KindError):
        load_walking_controller(kind_at(document, "controller"))


def _check_motion(kind: object, place: str) -> None:
    """Raise ScenarioError for an unknown motion, or a motion that is no walk; the message starts with ``place``."""
    if kind in VANE_MOTIONS:
        raise ScenarioError(
            f"{place}: a walk file needs motion.kind = '{WALK}'; simulate other scenarios with 'ppafo simulate' and, "
            "for OpenSim, give 'ppafo export opensim' the result folder"
        )
    with refused_as(ScenarioError, place, KindError):
        is_known = not kind or is_walk(str(kind))
    if not is_known:
        # The motions of a vane are named too: the file may be meant for one.
        known = tuple(MOTIONS)
        hint = nearest_kind(str(kind), known, MotionKind)
        raise ScenarioError(f"{place} is not known{hint}; allowed: {', '.join(known)}")


def _texts(_document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the paths of all text values that a document may contain."""
    return (*TEXTS, "motion.kind", "gait", BOTTLE_NAME, "controller.kind", "gas_model.kind")


def _quantities(document: Mapping[str, Any]) -> dict[str, Quantity]:
    """Return the declaration of every number that a document with its controller may contain, by path."""
    find_kinds(document, "the file of a walk")
    controller, gas = kind_at(document, "controller"), kind_at(document, "gas_model")
    declared = by_path(sections(controller, gas) | {BOTTLE: BOTTLE_NUMBERS})
    return declared | line_paths()


OF_A_WALK = DeclaredContent(
    find_kinds,
    _texts,
    _quantities,
    same={"motion.gait": "gait"},
    appended={path: (BOTTLE, own) for path, own in BOTTLE_OVERRIDES.items()},
    check_motion=_check_motion,
)
"""Possible content of a walk file. The gait is at top level or in the table [motion]."""


def walk_file(document: Mapping[str, Any]) -> type[BaseModel]:
    """Return the Pydantic model of a walk file, for the controllers that are loaded."""
    return _walk_file(tuple(walking_controllers().items()), (kind_at(document, "motion") or WALK,))


@functools.lru_cache(maxsize=8)
def _walk_file(_controllers: Any, motions: tuple[str, ...]) -> type[BaseModel]:
    """Return the Pydantic model of a walk file; ``motions`` are the names of the available motions."""
    sensors = quantity_fields(WALK_SENSORS)
    sensors["seed"] = (Annotated[int, Field(ge=0, le=LARGEST_SEED)], Field(1, description=SEED.summary))
    run = {"duration": optional(number_type(DURATION), DURATION.summary)} | quantity_fields((STEP,))
    led_by = {
        "gait": optional(
            str, "name of a gait, or the path of a gait file; its subject walks; the built-in one unless given"
        ),
    }
    bottle = {
        "name": optional(str, "name of a bottle, or the path of its file"),
        **_optional_numbers(BOTTLE_NUMBERS),
        "overrides": (list[str], Field(default_factory=list, description="such as 'room.temperature=5 degC'")),
    }
    motion = one_of([table(f"{model_name(name)}Motion", kind_field(name, SUMMARY) | led_by) for name in motions])
    sections: dict[str, Any] = {
        "run": optional(table("WalkRun", run), "duration and settings of the computation"),
        "motion": optional(motion, "kind of motion; the gait may be given here"),
        **led_by,
        "controller": (
            controller_table(walking_controllers(), "Walking"),
            Field(description="controller of the valve"),
        ),
        "wearer": optional(
            table("Wearer", quantity_fields(WEARER)),
            "wearer; default: the subject of the named gait, else the paper's subject",
        ),
        "sensors": optional(table("WalkSensors", sensors), "sensors of the controller; ideal unless given"),
        BOTTLE: optional(table("WalkBottle", bottle), "bottle that supplies the device; unlimited supply unless given"),
    }
    return file_model("WalkFile", sections)


def _optional_numbers(quantities: Iterable[Quantity]) -> dict[str, Any]:
    """Return optional Pydantic number fields for declared quantities."""
    return {quantity.name: optional(number_type(quantity), quantity.summary) for quantity in quantities}


def json_schema(reference: str = REFERENCE) -> dict[str, Any]:
    """Return the JSON Schema of a walk file; ``reference`` is the template of references to its definitions."""
    WALKING_CONTROLLERS.load_all()
    CONTROLLERS.load_all()
    MOTIONS.load_all()
    motions = tuple(name for name in MOTIONS if is_walk(name))
    return make_schema(_walk_file(tuple(walking_controllers().items()), motions), "ppafo walk", reference)
