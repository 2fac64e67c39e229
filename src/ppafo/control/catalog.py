"""The controllers and profiles that a scenario can name. To add one here: a module and one line."""

from ppafo.control import tabulated
from ppafo.control.controllers import (
    constant,
    damped_proportional,
    feedback_linearisation,
    on_off,
    on_off_dead_zone,
    pid,
    pid_feedforward,
    sliding_mode,
)
from ppafo.control.kind import ControllerKind, ProfileKind
from ppafo.control.profiles import CONSTANT, RAMP_HOLD, SINE
from ppafo.kinds import Kinds

CONTROLLERS: Kinds[ControllerKind] = Kinds(
    "ppafo.controllers",
    "controller",
    ControllerKind,
    (
        constant.KIND,
        on_off.KIND,
        on_off_dead_zone.KIND,
        pid.KIND,
        pid_feedforward.KIND,
        sliding_mode.KIND,
        damped_proportional.KIND,
        feedback_linearisation.KIND,
    ),
)

PROFILES: Kinds[ProfileKind] = Kinds(
    "ppafo.profiles",
    "profile",
    ProfileKind,
    (CONSTANT, RAMP_HOLD, SINE, tabulated.KIND),
)
