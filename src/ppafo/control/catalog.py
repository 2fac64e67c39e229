"""The controllers and profiles that a scenario can name. To add one: a module and one line here."""

from ppafo.control.controllers import constant, on_off, pid
from ppafo.control.kind import ControllerKind, ProfileKind
from ppafo.control.profiles import constant as constant_profile
from ppafo.control.profiles import ramp_hold, sine, tabulated

CONTROLLERS: dict[str, ControllerKind] = {kind.name: kind for kind in (constant.KIND, on_off.KIND, pid.KIND)}

PROFILES: dict[str, ProfileKind] = {
    kind.name: kind for kind in (constant_profile.KIND, ramp_hold.KIND, sine.KIND, tabulated.KIND)
}
