"""Torque loop, torque reach and joint of a device as functions of its numbers.

Each is a generic function here: functions for the actuator's chambers, the valve's flow and the delays are inserted, so
that one function of floats gives the number in a file, in a study and in an exported library.
"""

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.control import angle_loop
from ppafo.control.angle_loop import Joint
from ppafo.control.torque_loop import SAMPLES_LATE, TorqueLoop
from ppafo.model.actuators.kind import Range
from ppafo.model.binding import made_of
from ppafo.model.catalog import VALVES
from ppafo.model.declaration import Number, PlainFunction
from ppafo.model.gas import specific_gas_constant
from ppafo.model.orifice import area_conductance, sonic_conductance_mass
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.parameters.plant import valve_settings
from ppafo.simulation.mean_chambers import MeanChambers, Surroundings, chambers_of
from ppafo.simulation.motion_kind import LawSignals
from ppafo.simulation.nominal import AREA_PATHS, SONIC_PATHS, VALVE


class FlowNumbers(NamedTuple):
    """Gas properties, and the valve's area with discharge coefficient, or sonic conductance with critical ratio."""

    molar_mass: Annotated[float, Number("kg/mol", "")]
    heat_capacity_ratio: Annotated[float, Number("", "")]
    temperature: Annotated[float, Number("K", "")]
    orifice_1: Annotated[float, Number("", "area or sonic conductance")]
    orifice_2: Annotated[float, Number("", "discharge coefficient or critical ratio")]


class _SpoolParts(NamedTuple):
    """Function for the time [s] that a spool takes to follow a command."""

    follow_time: Callable[[Any], float]


class _LoopParts(NamedTuple):
    """Functions that compute the torque loop; each takes the parameter rows that it needs.

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


class _JointParts(NamedTuple):
    """Functions for the joint: mean chambers of the actuator; inertia [kg m^2] and gravity torque [N m]."""

    mean_chambers: Callable[[Any, Range, Surroundings], MeanChambers]
    turning: Callable[[Any], tuple[float, float]]


class JointGainParts(NamedTuple):
    """Functions behind a gain of an angle controller: torque loop, joint, and rule of ``control.angle_loop``."""

    torque_loop_of: Callable[..., TorqueLoop]
    joint_of: Callable[..., Joint]
    rule: Callable[[TorqueLoop, Joint], Any]


def area_flow(numbers: FlowNumbers) -> float:
    """Flow coefficient of an orifice area: R T times its conductance [m^3/s]. Equation (6)."""
    ratio, temperature = numbers.heat_capacity_ratio, numbers.temperature
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, numbers.molar_mass)
    return constant * temperature * area_conductance(numbers.orifice_1, numbers.orifice_2, ratio, constant, temperature)


def sonic_flow(numbers: FlowNumbers) -> float:
    """Flow coefficient of a sonic orifice: R T times its conductance [m^3/s]. ISO 6358-1."""
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, numbers.molar_mass)
    return constant * numbers.temperature * sonic_conductance_mass(numbers.orifice_1, constant, numbers.temperature)


def time_of_spool(valve: Any, period: float, *, parts: _SpoolParts) -> float:
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


def same_pressure(_mean: MeanChambers) -> float:
    """Derivative of a controlled pressure with respect to itself [-]: 1."""
    return 1.0


def other_pressure(_mean: MeanChambers) -> float:
    """Derivative of a controlled pressure with respect to the other chamber's pressure [-]: 0."""
    return 0.0


def loop_of(
    settings: Any,
    stops: Range,
    around: Surroundings,
    numbers: FlowNumbers,
    valve: Any,
    signals: Any,
    *,
    parts: _LoopParts,
) -> TorqueLoop:
    """Torque or pressure loop at constant volume: R = K q max(P_1 / V_1, P_2 / V_2), theta; K 1 or 0 for a pressure.

    R is the larger value of the two extreme joint angles, at which the loop is fastest; theta is the dead time.
    """
    lowest, highest = parts.places(stops, signals)
    chambers = parts.chambers_at(settings, stops, around, lowest)
    other = parts.chambers_at(settings, stops, around, highest)
    # A chamber at a vacuum is filled from the room, quicker than it is emptied.
    source_1 = max(around.supply_pressure, around.atmospheric_pressure)
    source_2 = max(around.dorsiflexion_pressure, around.atmospheric_pressure)
    per_flow = max(
        parts.per_pressure_1(chambers) * source_1 / chambers.volume_1,
        parts.per_pressure_2(chambers) * source_2 / chambers.volume_2,
        parts.per_pressure_1(other) * source_1 / other.volume_1,
        parts.per_pressure_2(other) * source_2 / other.volume_2,
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
    parts: _LoopParts,
) -> float:
    """Largest change of torque [N m] or pressure [Pa] from one supply while the other chamber is vented."""
    lowest, _ = parts.places(stops, signals)
    mean = parts.chambers_at(settings, stops, around, lowest)
    gauge_1 = abs(around.supply_pressure - around.atmospheric_pressure)
    gauge_2 = abs(around.dorsiflexion_pressure - around.atmospheric_pressure)
    return max(parts.per_pressure_1(mean) * gauge_1, parts.per_pressure_2(mean) * gauge_2, 0.0)


def joint_of(
    settings: Any, stops: Range, around: Surroundings, signals: Any, travel: float, *, parts: _JointParts
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
    parts: JointGainParts,
) -> TorqueLoop:
    """Angle loop of a controller that opens the valve in proportion to its error: ``parts.rule`` is ``slow_loop``."""
    loop = parts.torque_loop_of(settings, stops, around, numbers, valve, signals)
    slow_loop: TorqueLoop = parts.rule(loop, parts.joint_of(settings, stops, around, signals, 0.0))
    return slow_loop


_PER_PRESSURE: dict[str, tuple[Callable[[MeanChambers], float], Callable[[MeanChambers], float]]] = {
    "pressure_1": (same_pressure, other_pressure),
    "pressure_2": (other_pressure, same_pressure),
    "pressure_difference": (same_pressure, same_pressure),
}
"""Derivatives of a controlled pressure with respect to both chamber pressures."""


class _LoopFunctions(NamedTuple):
    """Functions that compute the loop of the controlled quantity, its reach, and the torque loop.

    ``rows`` are the row types and ``sources`` the paths that fill them. ``joint`` is the function for the joint, None
    unless the controller controls an angle.
    """

    loop: PlainFunction
    reach: PlainFunction
    torque_loop: PlainFunction
    rows: tuple[type, ...]
    sources: tuple[str, ...]
    joint: PlainFunction | None


def loop_functions(device: Device, seen: LawSignals, controlled: str) -> _LoopFunctions:
    """Return the loop functions of a device for a controller with given signals."""
    valve, sonic = VALVES[device.valve.kind], isinstance(device.valve.orifice, SonicOrifice)
    chambers = chambers_of(device)
    settings = tuple(quantity.name for quantity in valve.quantities)
    if {"opening_delay", "closing_delay", "switching_interval"}.issubset(settings):
        time_of_valve: PlainFunction = time_of_pair
    else:
        follow_time = valve.lag or valve.choose(valve_settings(device.valve)).command_delay
        time_of_valve = made_of(time_of_spool, "time_of_spool_valve", _SpoolParts(follow_time))
    per_pressure_1, per_pressure_2 = _PER_PRESSURE.get(controlled, (torque_by_pressure_1, torque_by_pressure_2))
    parts = _LoopParts(
        chambers_at=chambers.at,
        places=seen.places,
        valve_flow=sonic_flow if sonic else area_flow,
        time_of_valve=time_of_valve,
        time_of_signals=seen.late,
        per_pressure_1=per_pressure_1,
        per_pressure_2=per_pressure_2,
    )
    loop = torque_loop = made_of(loop_of, "loop_of_device", parts)
    joint: PlainFunction | None = None
    if seen.turning is not None:
        joint = made_of(joint_of, "joint_of_device", _JointParts(chambers.function, seen.turning))
        slow_parts = JointGainParts(torque_loop, joint, angle_loop.slow_loop)
        loop = made_of(slow_loop_of, "slow_loop_of_device", slow_parts)
    sources = (
        *chambers.sources,
        *("gas.molar_mass", "gas.heat_capacity_ratio", "gas.temperature"),
        *(SONIC_PATHS if sonic else AREA_PATHS)[VALVE],
        *(f"valve.{name}" for name in settings),
        *seen.paths,
    )
    rows = (*chambers.rows, FlowNumbers, valve.settings, seen.signals)
    reach = made_of(reach_of, "reach_of_device", parts)
    return _LoopFunctions(loop=loop, reach=reach, torque_loop=torque_loop, rows=rows, sources=sources, joint=joint)
