"""Default controller gains of a device: rules of ``control.torque_loop`` and ``angle_loop`` for its loop and joint."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from ppafo.control import angle_loop, torque_loop
from ppafo.control.angle_loop import Joint
from ppafo.control.kind import ControllerKind
from ppafo.control.torque_loop import TorqueLoop
from ppafo.model.actuators.kind import Range
from ppafo.model.binding import made_of
from ppafo.model.catalog import VALVES
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.model.declaration import PlainFunction, Quantity
from ppafo.parameters.device import Device
from ppafo.parameters.graph import LinkedDefault, LinkFunction
from ppafo.simulation.mean_chambers import Surroundings
from ppafo.simulation.motion_kind import LawSignals
from ppafo.simulation.nominal import nominal_terms
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.torque_loop import FlowNumbers, JointGainParts, loop_functions

RATE, DEAD_TIME = "torque rate at full opening", "dead time of the torque loop"
"""Names of the loop parameters from which gains are computed."""

_OF_LOOP: dict[str, Callable[[TorqueLoop], float]] = {
    torque_loop.PROPORTIONAL_GAIN: torque_loop.proportional_gain,
    torque_loop.INTEGRAL_RATE: torque_loop.integral_rate,
    torque_loop.BOUNDARY: torque_loop.boundary_layer,
    torque_loop.CONVERGENCE: torque_loop.convergence_rate,
    RATE: torque_loop.torque_rate,
    DEAD_TIME: torque_loop.dead_time,
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
    torque_loop.REACH,
    RATE,
    DEAD_TIME,
}
"""Names of the numbers that are gains of a controller, and not numbers of the device."""
SLOPE_GAINS = ("derivative_gain", "damping")
"""Gains on the rate of the error, which are 0 by default for every device."""


class _GainParts(NamedTuple):
    """Functions behind a gain: torque loop or torque reach of a device, and gain rule of ``control.torque_loop``."""

    number_of: Callable[..., Any]
    rule: Callable[..., float]


class _LoopAndJoint(NamedTuple):
    """Functions that compute the torque loop and the joint of a device."""

    torque_loop_of: Callable[..., TorqueLoop]
    joint_of: Callable[..., Joint]


def gain_of_device(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    *,
    parts: _GainParts,
) -> float:
    """Default gain of a device, from its torque loop or torque reach by the rule ``parts.rule``."""
    return parts.rule(parts.number_of(settings, stops, around, numbers, valve, signals))


def gain_with_setting(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    setting: float,
    *,
    parts: _GainParts,
) -> float:
    """Default gain of a device, from its torque loop and another controller setting by the rule ``parts.rule``."""
    return parts.rule(parts.number_of(settings, stops, around, numbers, valve, signals), setting)


def opening_beyond_band(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    setting: float,
    *,
    parts: _GainParts,
) -> float:
    """Command [-] that opens a valve with a dead band by the opening from ``parts.rule``."""
    opening = parts.rule(parts.number_of(settings, stops, around, numbers, valve, signals), setting)
    return float(valve.dead_band + (1.0 - valve.dead_band) * opening)


def gain_of_joint(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    travel: float,
    *,
    parts: JointGainParts,
) -> float:
    """Default gain of a device, from torque loop, joint and ``travel`` [rad] per move by the rule ``parts.rule``."""
    loop = parts.torque_loop_of(settings, stops, around, numbers, valve, signals)
    return float(parts.rule(loop, parts.joint_of(settings, stops, around, signals, travel)))


def loop_and_joint(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    travel: float,
    *,
    parts: _LoopAndJoint,
) -> tuple[TorqueLoop, Joint]:
    """Torque loop and joint of a device, from which ``gain_of_joint`` computes each gain."""
    loop = parts.torque_loop_of(settings, stops, around, numbers, valve, signals)
    return loop, parts.joint_of(settings, stops, around, signals, travel)


def default_gain_terms(
    device: Device, law: ControllerKind, seen: LawSignals, controlled: str = TORQUE
) -> dict[str, LinkFunction]:
    """Return the functions for default gains, by the names of ``control.torque_loop`` and ``angle_loop``.

    ``controlled`` is the controlled quantity, ``seen`` the signals of the controller.
    """
    controls_torque = TORQUE in law.controls
    loops = loop_functions(device, seen, controlled)

    def term(gain: PlainFunction, rule: PlainFunction, *settings: str) -> LinkFunction:
        parts: _GainParts | JointGainParts
        stages = None
        if gain is gain_of_joint:
            assert loops.joint is not None, "an angle controller has a joint"
            parts = JointGainParts(loops.torque_loop, loops.joint, rule)
            # In a study the loop costs more than the run: all gains of the joint have one.
            shared = made_of(loop_and_joint, "loop_and_joint_of_device", _LoopAndJoint(loops.torque_loop, loops.joint))
            stages = (shared, rule)
        elif rule in _OF_REACH.values():
            parts = _GainParts(loops.reach, rule)
        else:
            # A law of the angle alone has the torque loop inside it.
            parts = _GainParts(loops.loop if controls_torque else loops.torque_loop, rule)
        function = made_of(gain, f"{rule.__name__}_of_device", parts)
        return LinkFunction((*loops.sources, *settings), function, loops.rows, stages=stages)

    terms = {name: term(gain_of_device, rule) for name, rule in _OF_LOOP.items()}
    if not controls_torque:
        terms |= {name: term(gain_of_joint, rule, "controller.error_limit") for name, rule in _OF_JOINT.items()}
    # The reach in an angle is not known: the dead zone of a law of the angle is to be given.
    if controlled != ANGLE:
        terms |= {name: term(gain_of_device, rule) for name, rule in _OF_REACH.items()}
    has_dead_band = any(quantity.name == "dead_band" for quantity in VALVES[device.valve.kind].quantities)
    opening = opening_beyond_band if has_dead_band else gain_with_setting
    terms[torque_loop.OPENING] = term(opening, torque_loop.dead_zone_opening, "controller.dead_zone")
    # An integral goes with the proportional gain, also where that one is given.
    gain = next((quantity.name for quantity in law.quantities if torque_loop.PROPORTIONAL_GAIN in quantity.follows), "")
    terms[torque_loop.INTEGRAL_GAIN] = term(gain_with_setting, torque_loop.integral_gain, f"controller.{gain}")
    return terms


def default_links(scenario: Scenario, settings: Iterable[Quantity]) -> dict[str, tuple[LinkedDefault, ...]]:
    """Return the links of those controller settings that numbers of the device decide unless given, by path."""
    following = [setting for setting in settings if setting.follows]
    if not following:
        return {}
    device, kind = scenario.device, scenario.motion.motion_kind
    gains = default_gain_terms(device, kind.law(scenario), kind.sees(scenario), scenario.controlled)
    terms = nominal_terms(device) | gains
    return {
        f"controller.{item.name}": (LinkedDefault(tuple(terms[name] for name in item.follows), item.default or 0.0),)
        for item in following
        if terms.keys() >= set(item.follows)
    }
