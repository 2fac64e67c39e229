"""The controllers and profiles that a scenario can name. To add one here: a module and one line."""

from ppafo.control import profiles
from ppafo.control.controllers import feedback, model_based, switching
from ppafo.control.kind import ControllerKind, ProfileKind
from ppafo.control.profiles import CONSTANT, RAMP_HOLD, SINE
from ppafo.kinds import Kinds

CONTROLLERS: Kinds[ControllerKind] = Kinds(
    "ppafo.controllers",
    "controller",
    ControllerKind,
    (
        switching.CONSTANT,
        switching.ON_OFF,
        switching.ON_OFF_DEAD_ZONE,
        feedback.PID,
        model_based.PID_FEEDFORWARD,
        feedback.SLIDING_MODE,
        feedback.DAMPED_PROPORTIONAL,
        model_based.FEEDBACK_LINEARISATION,
    ),
)

PROFILES: Kinds[ProfileKind] = Kinds(
    "ppafo.profiles",
    "profile",
    ProfileKind,
    (CONSTANT, RAMP_HOLD, SINE, profiles.TABLE, profiles.SMOOTH),
)
