"""Numbers of a device from which default controller gains are computed; the rules are in ``control.torque_loop``.

A gain is a generic function here: functions for the actuator's chambers, the valve's flow and the delays are inserted,
so that one function of floats gives the gain in a file, in a study and in an exported library.
"""

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

from ppafo.control import angle_loop, torque_loop
from ppafo.control.angle_loop import Joint
from ppafo.control.kind import ControllerKind
from ppafo.control.torque_loop import SAMPLES_LATE, TorqueLoop
from ppafo.model.actuators.kind import Range
from ppafo.model.binding import made_of
from ppafo.model.catalog import VALVES
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.model.declaration import Number, PlainFunction
from ppafo.parameters.device import Device
from ppafo.parameters.graph import LinkFunction
from ppafo.parameters.plant import valve_settings
from ppafo.simulation.mean_chambers import MeanChambers, Surroundings, chambers_of
from ppafo.simulation.motion_kind import LawSignals
from ppafo.simulation.nominal import AREA_PATHS, SONIC_PATHS, VALVE, flow_of_area, flow_of_sonic, in_its_form

RATE, DEAD_TIME = "torque rate at full opening", "dead time of the torque loop"
"""Names of the loop parameters from which gains are computed."""


class FlowNumbers(NamedTuple):
    """Gas properties, and the two numbers of the valve's orifice in its form."""

    molar_mass: Annotated[float, Number("kg/mol", "")]
    heat_capacity_ratio: Annotated[float, Number("", "")]
    temperature: Annotated[float, Number("K", "")]
    orifice_1: Annotated[float, Number("", "area or sonic conductance")]
    orifice_2: Annotated[float, Number("", "discharge coefficient or critical ratio")]


class SpoolParts(NamedTuple):
    """Function for the time [s] that a spool takes to follow a command."""

    follow_time: Callable[[Any], float]


class LoopParts(NamedTuple):
    """Functions for the torque loop; each takes the rows that it needs.

    ``chambers_at`` gives the chambers at an angle [rad]; ``places`` the lowest and highest joint angle [rad];
    ``valve_flow`` R T times the conductance of the valve [m^3/s]; ``time_of_valve`` the delay of the valve [s] for a
    sample period [s]; ``time_of_signals`` the delay of the measurements [s]; ``per_pressure`` the derivative of the
    controlled quantity with respect to the pressure of each chamber.
    """

    chambers_at: Callable[[Any, Range, Surroundings, float], MeanChambers]
    places: Callable[[Range, Any], tuple[float, float]]
    valve_flow: Callable[[FlowNumbers], float]
    time_of_valve: Callable[[Any, float], float]
    time_of_signals: Callable[[Any], float]
    per_pressure_1: Callable[[MeanChambers], float]
    per_pressure_2: Callable[[MeanChambers], float]


class JointParts(NamedTuple):
    """Functions for the joint: mean chambers of the actuator; inertia [kg m^2] and gravity torque [N m]."""

    mean_chambers: Callable[[Any, Range, Surroundings], MeanChambers]
    turning: Callable[[Any], tuple[float, float]]


class AngleParts(NamedTuple):
    """Functions for the angle loop: torque loop of a device, and joint."""

    torque_loop_of: Callable[..., TorqueLoop]
    joint_of: Callable[..., Joint]


class GainParts(NamedTuple):
    """Functions for a gain: torque loop of a device, and rule of ``control.torque_loop``."""

    loop_of: Callable[..., TorqueLoop]
    rule: Callable[..., float]


class ReachParts(NamedTuple):
    """Functions for a number from the torque reach: reach of a device, and rule of ``control.torque_loop``."""

    reach_of: Callable[..., float]
    rule: Callable[[float], float]


class GainOfJointParts(NamedTuple):
    """Functions for a gain from torque loop and joint, with a rule of ``control.angle_loop``."""

    torque_loop_of: Callable[..., TorqueLoop]
    joint_of: Callable[..., Joint]
    rule: Callable[[TorqueLoop, Joint], float]


def area_flow(numbers: FlowNumbers) -> float:
    """Flow coefficient of an orifice area: R T times its conductance [m^3/s]."""
    return flow_of_area(
        numbers.molar_mass, numbers.heat_capacity_ratio, numbers.temperature, numbers.orifice_1, numbers.orifice_2
    )


def sonic_flow(numbers: FlowNumbers) -> float:
    """Flow coefficient of a sonic orifice: R T times its conductance [m^3/s]."""
    return flow_of_sonic(numbers.molar_mass, numbers.temperature, numbers.orifice_1)


def time_of_spool(valve: Any, period: float, *, parts: SpoolParts) -> float:
    """Delay [s] from a sample to the flow of a proportional valve: time of the spool, plus sample delay."""
    return parts.follow_time(valve) + SAMPLES_LATE * period


def time_of_pair(valve: Any, period: float) -> float:
    """Delay [s] from a sample to the flow of a pair of on/off valves: switching delay, plus wait for the switching."""
    delay: float = max(valve.opening_delay, valve.closing_delay)
    wait: float = max(SAMPLES_LATE * period, valve.switching_interval)
    return delay + wait


def torque_by_pressure_1(mean: MeanChambers) -> float:
    """Derivative of the torque with respect to the pressure in chamber 1 [m^3], positive."""
    return mean.torque_per_pressure_1


def torque_by_pressure_2(mean: MeanChambers) -> float:
    """Negative derivative of the torque with respect to the pressure in chamber 2 [m^3]."""
    return mean.torque_per_pressure_2


def whole_pressure(_mean: MeanChambers) -> float:
    """Return 1 [-]: derivative of a controlled pressure with respect to itself."""
    return 1.0


def no_pressure(_mean: MeanChambers) -> float:
    """Return 0 [-]: derivative of a controlled pressure with respect to the pressure in the other chamber."""
    return 0.0


def loop_of(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    *,
    parts: LoopParts,
) -> TorqueLoop:
    """Torque or pressure loop at constant volume: R = K q max(P_1 / V_1, P_2 / V_2), theta; K 1 or 0 for a pressure.

    R is the larger value of the two extreme joint angles, at which the loop is fastest; theta is the dead time.
    """
    first, last = parts.places(stops, signals)
    here = parts.chambers_at(settings, stops, around, first)
    there = parts.chambers_at(settings, stops, around, last)
    # A chamber at a vacuum is filled from the room, quicker than it is emptied.
    first_source = max(around.supply_pressure, around.atmospheric_pressure)
    second_source = max(around.dorsiflexion_pressure, around.atmospheric_pressure)
    per_flow = max(
        parts.per_pressure_1(here) * first_source / here.volume_1,
        parts.per_pressure_2(here) * second_source / here.volume_2,
        parts.per_pressure_1(there) * first_source / there.volume_1,
        parts.per_pressure_2(there) * second_source / there.volume_2,
    )
    return TorqueLoop(
        rate=parts.valve_flow(numbers) * per_flow,
        dead_time=parts.time_of_valve(valve, signals.period) + parts.time_of_signals(signals),
    )


def reach_of(
    settings: Any,
    stops: Range,
    around: Surroundings,
    _numbers: FlowNumbers,
    _valve: Any,
    signals: Any,
    *,
    parts: LoopParts,
) -> float:
    """Largest change of torque [N m] or pressure [Pa] from one supply while the other chamber is vented."""
    place, _ = parts.places(stops, signals)
    mean = parts.chambers_at(settings, stops, around, place)
    gauge_1 = abs(around.supply_pressure - around.atmospheric_pressure)
    gauge_2 = abs(around.dorsiflexion_pressure - around.atmospheric_pressure)
    return max(parts.per_pressure_1(mean) * gauge_1, parts.per_pressure_2(mean) * gauge_2, 0.0)


def joint_of(
    settings: Any, stops: Range, around: Surroundings, signals: Any, travel: float, *, parts: JointParts
) -> Joint:
    """Joint of a device with its gas at atmospheric pressure, where the gas spring is softest."""
    mean = parts.mean_chambers(settings, stops, around)
    inertia, weight = parts.turning(signals)
    spring_1 = mean.torque_per_pressure_1 * mean.growth_1 * around.atmospheric_pressure / mean.volume_1
    spring_2 = mean.torque_per_pressure_2 * mean.growth_2 * around.atmospheric_pressure / mean.volume_2
    return Joint(
        inertia=inertia,
        stiffness=spring_1 + spring_2,
        damping=signals.viscous_damping,
        friction=signals.dynamic_torque,
        static_friction=signals.static_torque,
        travel=travel,
        gravity=weight,
        resolution=signals.angle_resolution,
        noise=signals.angle_noise,
    )


def slow_loop_of(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    *,
    parts: AngleParts,
) -> TorqueLoop:
    """Angle loop of a controller that opens the valve in proportion to its error."""
    loop = parts.torque_loop_of(settings, stops, around, numbers, valve, signals)
    return angle_loop.slow_loop(loop, parts.joint_of(settings, stops, around, signals, 0.0))


def gain_of_joint(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    travel: float,
    *,
    parts: GainOfJointParts,
) -> float:
    """Gain from ``parts.rule`` for the torque loop and the joint of a device, with ``travel`` [rad] per move."""
    loop = parts.torque_loop_of(settings, stops, around, numbers, valve, signals)
    return parts.rule(loop, parts.joint_of(settings, stops, around, signals, travel))


def gain_of_loop(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    *,
    parts: GainParts,
) -> float:
    """Gain from ``parts.rule`` for the torque loop of a device."""
    return parts.rule(parts.loop_of(settings, stops, around, numbers, valve, signals))


def share_of_reach(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    *,
    parts: ReachParts,
) -> float:
    """Number from ``parts.rule`` for the torque or pressure reach of a device."""
    return parts.rule(parts.reach_of(settings, stops, around, numbers, valve, signals))


def gain_of_loop_and_setting(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    setting: float,
    *,
    parts: GainParts,
) -> float:
    """Gain from ``parts.rule`` for the torque loop of a device and another setting of the controller."""
    return parts.rule(parts.loop_of(settings, stops, around, numbers, valve, signals), setting)


def opening_beyond_band(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    setting: float,
    *,
    parts: GainParts,
) -> float:
    """Command [-] for the valve opening from ``parts.rule``, for a valve with a dead band."""
    opening = parts.rule(parts.loop_of(settings, stops, around, numbers, valve, signals), setting)
    return float(valve.dead_band + (1.0 - valve.dead_band) * opening)


_OF_LOOP: dict[str, Callable[[TorqueLoop], float]] = {
    torque_loop.PROPORTIONAL_GAIN: torque_loop.proportional_gain,
    torque_loop.INTEGRAL_RATE: torque_loop.integral_rate,
    torque_loop.BOUNDARY: torque_loop.boundary_layer,
    torque_loop.CONVERGENCE: torque_loop.convergence_rate,
    torque_loop.LEAD: torque_loop.lead,
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

_PER_PRESSURE: dict[str, tuple[Callable[[MeanChambers], float], Callable[[MeanChambers], float]]] = {
    "pressure_1": (whole_pressure, no_pressure),
    "pressure_2": (no_pressure, whole_pressure),
    "pressure_difference": (whole_pressure, whole_pressure),
}
"""Derivatives of a controlled pressure with respect to both chamber pressures."""


class LoopFrames(NamedTuple):
    """Loop of the controlled quantity, its reach, and the torque loop, as functions of rows.

    ``rows`` are the row types and ``sources`` the paths that fill them. ``joint`` is the function for the joint, None
    unless the controller controls an angle.
    """

    loop: PlainFunction
    reach: PlainFunction
    torque_loop: PlainFunction
    rows: tuple[type, ...]
    sources: tuple[str, ...]
    joint: PlainFunction | None


def _frames(device: Device, seen: LawSignals, controlled: str, sonic: bool) -> LoopFrames:
    """Return the loop functions of a device for a controller with given signals.

    ``sonic`` selects the valve's orifice as a sonic conductance instead of an area.
    """
    valve = VALVES[device.valve.kind]
    chambers = chambers_of(device)
    names = {quantity.name for quantity in valve.quantities}
    timed = SpoolParts(valve.lag or valve.choose(valve_settings(device.valve)).command_delay)
    is_pair = {"opening_delay", "closing_delay", "switching_interval"} <= names
    per_pressure_1, per_pressure_2 = _PER_PRESSURE.get(controlled, (torque_by_pressure_1, torque_by_pressure_2))
    parts = LoopParts(
        chambers_at=chambers.at,
        places=seen.places,
        valve_flow=sonic_flow if sonic else area_flow,
        time_of_valve=time_of_pair if is_pair else made_of(time_of_spool, "time_of_spool_valve", timed),
        time_of_signals=seen.late,
        per_pressure_1=per_pressure_1,
        per_pressure_2=per_pressure_2,
    )
    loop = inner = made_of(loop_of, "loop_of_device", parts)
    joint: PlainFunction | None = None
    if seen.turning is not None:
        joint = made_of(joint_of, "joint_of_device", JointParts(chambers.function, seen.turning))
        loop = made_of(slow_loop_of, "slow_loop_of_device", AngleParts(inner, joint))
    sources = (
        *chambers.sources,
        *("gas.molar_mass", "gas.heat_capacity_ratio", "gas.temperature"),
        *(SONIC_PATHS if sonic else AREA_PATHS)[VALVE],
        *(f"valve.{quantity.name}" for quantity in valve.quantities),
        *seen.paths,
    )
    rows = (*chambers.rows, FlowNumbers, valve.settings, seen.signals)
    reach = made_of(reach_of, "reach_of_device", parts)
    return LoopFrames(loop=loop, reach=reach, torque_loop=inner, rows=rows, sources=sources, joint=joint)


def loop_terms(
    device: Device, law: ControllerKind, seen: LawSignals, controlled: str = TORQUE
) -> dict[str, LinkFunction]:
    """Return the functions for default gains, by the names of ``control.torque_loop`` and ``angle_loop``.

    ``controlled`` is the controlled quantity, ``seen`` the signals of the controller.
    """
    of_area, of_sonic = (_frames(device, seen, controlled, sonic) for sonic in (False, True))
    names = {quantity.name for quantity in VALVES[device.valve.kind].quantities}

    def in_form(frames: LoopFrames, frame: PlainFunction, by: PlainFunction, settings: tuple[str, ...]) -> LinkFunction:
        # A law of the angle alone has the torque loop inside it.
        own_loop = frames.loop if TORQUE in law.controls else frames.torque_loop
        if frame is gain_of_joint:
            assert frames.joint is not None, "a law of the angle knows its joint"
            made = made_of(frame, f"{by.__name__}_of_device", GainOfJointParts(frames.torque_loop, frames.joint, by))
        elif frame is share_of_reach:
            made = made_of(frame, f"{by.__name__}_of_device", ReachParts(frames.reach, by))
        else:
            made = made_of(frame, f"{by.__name__}_of_device", GainParts(own_loop, by))
        return LinkFunction((*frames.sources, *settings), made, frames.rows)

    def term(frame: PlainFunction, by: PlainFunction, *settings: str) -> LinkFunction:
        return in_its_form(device, VALVE, in_form(of_area, frame, by, settings), in_form(of_sonic, frame, by, settings))

    terms = {name: term(gain_of_loop, by) for name, by in _OF_LOOP.items()}
    for name, of_joint in _OF_JOINT.items() if TORQUE not in law.controls else ():
        terms[name] = term(gain_of_joint, of_joint, "controller.error_limit")
    # Of an angle no reach is known: its dead zone is to be given.
    for name, of_reach in _OF_REACH.items() if controlled != ANGLE else ():
        terms[name] = term(share_of_reach, of_reach)
    opening = opening_beyond_band if "dead_band" in names else gain_of_loop_and_setting
    terms[torque_loop.OPENING] = term(opening, torque_loop.dead_zone_opening, "controller.dead_zone")
    # An integral, and what is learnt, go with the proportional gain, also where that one is given.
    gain = next((quantity.name for quantity in law.quantities if torque_loop.PROPORTIONAL_GAIN in quantity.follows), "")
    path = f"controller.{gain}"
    terms[torque_loop.INTEGRAL_GAIN] = term(gain_of_loop_and_setting, torque_loop.integral_gain, path)
    terms[torque_loop.LEARNING_GAIN] = LinkFunction((path,), torque_loop.learning_gain)
    return terms
