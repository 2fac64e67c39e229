"""Controllers and profiles that a scenario can name. To add one: a module, and one line in this table."""

from ppafo.control import profiles
from ppafo.control.kind import ControllerKind, ProfileKind
from ppafo.kinds import Kinds

FIXED_POINT = "_fixed_point"
"""Suffix of the names of fixed-point controllers."""

CONTROLLERS: Kinds[ControllerKind] = Kinds(
    "ppafo.controllers",
    "controller",
    ControllerKind,
    {
        "constant": "ppafo.control.controllers.switching:CONSTANT",
        "on_off": "ppafo.control.controllers.switching:ON_OFF",
        "on_off_dead_zone": "ppafo.control.controllers.switching:ON_OFF_DEAD_ZONE",
        "pid": "ppafo.control.controllers.pid:PID",
        "pid_feedforward": "ppafo.control.controllers.model_based:PID_FEEDFORWARD",
        "sliding_mode": "ppafo.control.controllers.switching:SLIDING_MODE",
        "damped_proportional": "ppafo.control.controllers.damped_proportional:DAMPED_PROPORTIONAL",
        "feedback_linearisation": "ppafo.control.controllers.model_based:FEEDBACK_LINEARISATION",
        "cascade": "ppafo.control.controllers.cascade:CASCADE",
        "pid_fixed_point": "ppafo.processor.torque_laws.pid:PID_FIXED_POINT",
        "on_off_fixed_point": "ppafo.processor.torque_laws.on_off:ON_OFF_FIXED_POINT",
        "on_off_dead_zone_fixed_point": "ppafo.processor.torque_laws.on_off:DEAD_ZONE_FIXED_POINT",
    },
)

PROFILES: Kinds[ProfileKind] = Kinds(
    "ppafo.profiles",
    "profile",
    ProfileKind,
    {
        kind.name: kind
        for kind in (profiles.CONSTANT, profiles.RAMP_HOLD, profiles.SINE, profiles.TABLE, profiles.SMOOTH)
    },
)


def switching_remedy(name: str) -> str:
    """Return the remedy for a user's own on/off law that does not declare to be one; empty for laws of this package."""
    declaration = " (only_switches=True in its ControllerKind, if it commands only 1, 0 and -1)"
    return "" if CONTROLLERS.is_own(name) else declaration
