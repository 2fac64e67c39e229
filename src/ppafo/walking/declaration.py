"""Declaration of every value of a walk file besides those of the device."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.walking.catalog import WALKING_CONTROLLERS, load_walking_controller, walking_controllers
from ppafo.documents.toml_text import quote
from ppafo.errors import KindError, refused_as
from ppafo.model.declaration import Quantity
from ppafo.parameters.declared import Content, Field, InnerTable, Many, Words, kind_at, numbers, schema_of
from ppafo.plugins import nearest_kind
from ppafo.simulation.declaration import HEAD, SAMPLING, SENSORS, tail
from ppafo.simulation.motion_kind import MOTIONS, VANE_MOTIONS, WALK, MotionKind, is_walk
from ppafo.simulation.scenario import LARGEST_SEED
from ppafo.walking.bottle.supply import BOTTLE, BOTTLE_NAME, BOTTLE_NUMBERS, BOTTLE_OVERRIDES
from ppafo.walking.wearer import WEARER

SUMMARY = "the device on a leg that walks along a prescribed gait"
"""Description of the motion of a walk."""

SEED = Quantity("seed", "", "seed of noise and lost samples, a whole number", 1.0, 0.0, float(LARGEST_SEED), whole=True)
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


def declared(document: Mapping[str, Any]) -> dict[str, Field]:
    """Return every field that a walk file with the kinds of a document may have, by path.

    Raises KindError for a controller that cannot be loaded, and for a motion that is no walk.
    """
    motion = kind_at(document, "motion")
    if motion in VANE_MOTIONS:
        raise KindError(
            f"motion.kind = {quote(motion)}: a walk file needs motion.kind = '{WALK}'; simulate other scenarios with "
            "'ppafo simulate' and, for OpenSim, give 'ppafo export opensim' the result folder"
        )
    with refused_as(KindError, f"motion.kind = {quote(motion)}", KindError):
        is_known = not motion or is_walk(motion)
    if not is_known:
        # The motions of a vane are named too: the file may be meant for one.
        hint = nearest_kind(motion, tuple(MOTIONS), MotionKind)
        raise KindError(f"motion.kind = {quote(motion)} is not known{hint}; allowed: {', '.join(MOTIONS)}")
    with refused_as(KindError, "controller.kind", KindError):
        load_walking_controller(kind_at(document, "controller"))
    laws = walking_controllers()
    law = laws.get(kind_at(document, "controller"))
    gait = Words("name of a gait, or the path of a gait file; its subject walks; the built-in one unless given")
    return {
        **HEAD,
        "run": InnerTable("duration and settings of the computation"),
        **_optional("run", (DURATION,)),
        "run.step": STEP,
        "motion": InnerTable("kind of motion; the gait may be given here"),
        "motion.kind": Words(SUMMARY, True, tuple(name for name in MOTIONS if is_walk(name))),
        "motion.gait": gait,
        "gait": gait,
        "controller": InnerTable("controller of the valve", True),
        "controller.kind": Words("", True, laws),
        **numbers("controller", (*SAMPLING, *(() if law is None else law.quantities))),
        "wearer": InnerTable("wearer; default: the subject of the named gait, else the paper's subject"),
        **numbers("wearer", WEARER),
        "sensors": InnerTable("sensors of the controller; ideal unless given"),
        **numbers("sensors", (*WALK_SENSORS, SEED)),
        BOTTLE: InnerTable("bottle that supplies the device; unlimited supply unless given"),
        BOTTLE_NAME: Words("name of a bottle, or the path of its file"),
        **_optional(BOTTLE, BOTTLE_NUMBERS),
        f"{BOTTLE}.overrides": Many(Words(), "such as 'room.temperature=5 degC'"),
        **tail(document),
    }


def _optional(section: str, quantities: Iterable[Quantity]) -> dict[str, Quantity]:
    """Return numbers that a file may omit."""
    return numbers(section, (replace(quantity, optional=True) for quantity in quantities))


OF_A_WALK = Content(
    declared,
    same={"motion.gait": "gait"},
    appended={path: (BOTTLE, own) for path, own in BOTTLE_OVERRIDES.items()},
)
"""Possible content of a walk file. The gait is at top level or in the table [motion]."""


def load_kinds() -> None:
    """Load the components of all packages that a scenario or a walk may name."""
    for catalogue in (CONTROLLERS, PROFILES, WALKING_CONTROLLERS, MOTIONS):
        catalogue.load_all()


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a walk file."""
    load_kinds()
    return schema_of("ppafo walk", declared)
