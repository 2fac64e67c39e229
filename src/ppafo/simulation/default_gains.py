"""Default controller gains of a device: rules of ``control.torque_loop`` and ``angle_loop`` for its loop and joint."""

from collections.abc import Callable, Iterable
from dataclasses import replace

from ppafo.control import angle_loop, torque_loop
from ppafo.control.angle_loop import Joint
from ppafo.control.kind import ControllerKind
from ppafo.control.torque_loop import TorqueLoop
from ppafo.model.catalog import VALVES
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.model.declaration import Quantity
from ppafo.parameters.graph import Link
from ppafo.simulation.nominal import nominal_links
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.torque_loop import LoopLink, LoopParts

_OF_LOOP: dict[str, Callable[[TorqueLoop], float]] = {
    torque_loop.PROPORTIONAL_GAIN: torque_loop.proportional_gain,
    torque_loop.INTEGRAL_RATE: torque_loop.integral_rate,
    torque_loop.BOUNDARY: torque_loop.boundary_layer,
    torque_loop.CONVERGENCE: torque_loop.convergence_rate,
}
"""Rule for each number that depends on the torque loop alone."""
_OF_REACH: dict[str, Callable[[float], float]] = {
    torque_loop.DEAD_ZONE: torque_loop.dead_zone,
    torque_loop.RELEASE: torque_loop.release,
    torque_loop.REACH: torque_loop.whole_reach,
}
"""Rule for each number that depends on the torque reach of a device."""
_OF_JOINT: dict[str, Callable[[TorqueLoop, Joint], float]] = {
    angle_loop.ANGLE_STIFFNESS: angle_loop.angle_stiffness,
    angle_loop.ANGLE_DAMPING: angle_loop.angle_damping,
    angle_loop.RATE_FILTER: angle_loop.rate_filter,
    angle_loop.INNER_GAIN: angle_loop.inner_gain,
    angle_loop.GRAVITY: angle_loop.gravity,
    angle_loop.INERTIA: angle_loop.inertia,
    angle_loop.FRICTION: angle_loop.friction,
    angle_loop.STATIC_FRICTION: angle_loop.static_friction,
    angle_loop.LOAD_TIME: angle_loop.load_time,
    angle_loop.TORQUE_LAG: angle_loop.torque_lag,
    angle_loop.TOLERANCE: angle_loop.tolerance,
    angle_loop.REST_DISTANCE: angle_loop.rest_distance,
}
"""Rule for each number that depends on torque loop and joint."""
GAIN_TERMS = frozenset((*_OF_LOOP, *_OF_REACH, *_OF_JOINT, torque_loop.OPENING, torque_loop.INTEGRAL_GAIN)) - {
    torque_loop.REACH
}
"""Names of the numbers that are gains of a controller, and not numbers of the device."""
SLOPE_GAINS = ("derivative_gain", "damping")
"""Gains on the rate of the error, which are 0 by default for every device."""


def opening_beyond_band(loop: TorqueLoop, dead_zone: float, dead_band: float) -> float:
    """Command [-] that opens a valve with a dead band by the opening for a dead zone."""
    return dead_band + (1.0 - dead_band) * torque_loop.dead_zone_opening(loop, dead_zone)


def gain_links(parts: LoopParts, law: ControllerKind) -> dict[str, Link]:
    """Return the links of default gains, by the names of ``control.torque_loop`` and ``angle_loop``."""

    def of_groups(rule: Callable[..., float], *groups: str, direct: tuple[str, ...] = ()) -> Link:
        return LoopLink(direct, rule, groups=groups, parts=parts)

    links = {name: of_groups(rule, "loop") for name, rule in _OF_LOOP.items()}
    if not parts.controls_torque:
        links |= {name: of_groups(rule, "loop", "joint") for name, rule in _OF_JOINT.items()}
    # The reach in an angle is not known: the dead zone of a law of the angle is to be given.
    if parts.controlled != ANGLE:
        links |= {name: of_groups(rule, "reach") for name, rule in _OF_REACH.items()}
    has_dead_band = any(quantity.name == "dead_band" for quantity in VALVES[parts.device.valve.kind].quantities)
    opening = opening_beyond_band if has_dead_band else torque_loop.dead_zone_opening
    direct = ("controller.dead_zone", *(("valve.dead_band",) if has_dead_band else ()))
    links[torque_loop.OPENING] = of_groups(opening, "loop", direct=direct)
    # An integral goes with the proportional gain, also where that one is given.
    gain = next((quantity.name for quantity in law.quantities if quantity.follows == torque_loop.PROPORTIONAL_GAIN), "")
    links[torque_loop.INTEGRAL_GAIN] = of_groups(torque_loop.integral_gain, "loop", direct=(f"controller.{gain}",))
    return links


def loop_parts(scenario: Scenario, law: ControllerKind) -> LoopParts:
    """Return what decides the loop of a law in a scenario besides numbers."""
    seen = scenario.motion.motion_kind.sees(scenario)
    return LoopParts(scenario.device, seen, scenario.controlled, TORQUE in law.controls)


def default_links(scenario: Scenario, settings: Iterable[Quantity]) -> dict[str, tuple[Link, ...]]:
    """Return the links of those controller settings that numbers of the device decide unless given, by path."""
    following = [setting for setting in settings if setting.follows]
    if not following:
        return {}
    law = scenario.motion.motion_kind.law(scenario)
    parts = loop_parts(scenario, law)
    links = nominal_links(parts) | gain_links(parts, law)
    return {
        f"controller.{item.name}": (replace(links[item.follows], gap=item.default or 0.0),)
        for item in following
        if item.follows in links
    }
