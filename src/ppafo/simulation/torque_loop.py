"""Which numbers of a device the gains of a law follow that nobody gives; the rules are ``control.torque_loop``'s.

A gain is a frame here: the chambers of the actuator, the flow of the valve and what comes late are put in their places,
so that one function of floats gives the gain in a file, in a study and in an exported library.
"""

import math
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

from ppafo.control import torque_loop
from ppafo.control.binding import bind
from ppafo.control.kind import ControllerKind
from ppafo.control.torque_loop import SAMPLES_LATE, TorqueLoop
from ppafo.model.actuators.kind import Range
from ppafo.model.catalog import VALVES
from ppafo.model.declaration import Number
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.parameters.graph import Term
from ppafo.parameters.plant import valve_settings
from ppafo.simulation.mean_chambers import MeanChambers, Surroundings, chambers_of
from ppafo.simulation.nominal import flow_of_area, flow_of_sonic

PERIOD_PATH = "controller.period"
RATE, DEAD_TIME = "torque rate at full opening", "dead time of the torque loop"
"""Names of what the gains are made of, among the terms."""


class FlowNumbers(NamedTuple):
    """Gas, and the valve's orifice in the form that it has."""

    molar_mass: Annotated[float, Number("kg/mol", "")]
    heat_capacity_ratio: Annotated[float, Number("", "")]
    temperature: Annotated[float, Number("K", "")]
    orifice_1: Annotated[float, Number("", "area or sonic conductance")]
    orifice_2: Annotated[float, Number("", "discharge coefficient or critical ratio")]


class Signals(NamedTuple):
    """Sample period and age of a measurement [s], bandwidth of the pressure sensors [Hz]."""

    period: Annotated[float, Number("s", "")]
    bandwidth: Annotated[float, Number("Hz", "")]
    delay: Annotated[float, Number("s", "")]


class SignalsOfWalk(NamedTuple):
    """The same of a walk, whose measurements are not old."""

    period: Annotated[float, Number("s", "")]
    bandwidth: Annotated[float, Number("Hz", "")]


def mean_chambers(settings: Any, stops: Range, around: Surroundings) -> MeanChambers:
    """Stand for the chambers of the actuator."""
    raise NotImplementedError


def valve_flow(numbers: FlowNumbers) -> float:
    """Stand for R T times the conductance of the valve [m^3/s]."""
    raise NotImplementedError


def time_of_valve(valve: Any, period: float) -> float:
    """Stand for how late the valve follows a command [s], once it is sampled every ``period`` [s]."""
    raise NotImplementedError


def time_of_signals(signals: Any) -> float:
    """Stand for how late the measurements are [s]."""
    raise NotImplementedError


def follow_time(settings: Any) -> float:
    """Stand for the time [s] after which a valve has followed a command."""
    raise NotImplementedError


def area_flow(numbers: FlowNumbers) -> float:
    """R T times the conductance of an area [m^3/s]."""
    return flow_of_area(
        numbers.molar_mass, numbers.heat_capacity_ratio, numbers.temperature, numbers.orifice_1, numbers.orifice_2
    )


def sonic_flow(numbers: FlowNumbers) -> float:
    """R T times a sonic conductance [m^3/s]."""
    return flow_of_sonic(numbers.molar_mass, numbers.temperature, numbers.orifice_1)


def time_of_spool(valve: Any, period: float) -> float:
    """Time [s] from a sample to the flow: what the valve needs, and the wait for the command and in it."""
    return follow_time(valve) + SAMPLES_LATE * period


def time_of_pair(valve: Any, period: float) -> float:
    """The same of a pair of on/off valves: a coil waits for its next switching, where that is longer."""
    delay: float = max(valve.opening_delay, valve.closing_delay)
    wait: float = max(SAMPLES_LATE * period, valve.switching_interval)
    return delay + wait


def lag_of_sensor(bandwidth: float) -> float:
    """Time constant [s] of a sensor with a bandwidth [Hz]; 0 for one that follows at once, whose bandwidth is 0."""
    return 1.0 / (2.0 * math.pi * bandwidth) if bandwidth > 0.0 else 0.0


def time_in_scenario(signals: Signals) -> float:
    """How old a measurement is [s], and how late the pressure sensors follow."""
    return signals.delay + lag_of_sensor(signals.bandwidth)


def time_in_walk(signals: SignalsOfWalk) -> float:
    """How late the pressure sensors follow [s]."""
    return lag_of_sensor(signals.bandwidth)


def loop_of(
    settings: Any, stops: Range, around: Surroundings, numbers: FlowNumbers, valve: Any, signals: Any
) -> TorqueLoop:
    """The torque loop of a device: R = K q max(P_1 / V_1, P_2 / V_2), theta."""
    mean = mean_chambers(settings, stops, around)
    per_flow = max(
        mean.torque_per_pressure_1 * around.supply_pressure / mean.volume_1,
        mean.torque_per_pressure_2 * around.dorsiflexion_pressure / mean.volume_2,
    )
    return TorqueLoop(
        rate=valve_flow(numbers) * per_flow,
        dead_time=time_of_valve(valve, signals.period) + time_of_signals(signals),
    )


def rule(loop: TorqueLoop, *_number: float) -> float:
    """Stand for a rule of ``control.torque_loop``."""
    raise NotImplementedError


def gain_of_loop(
    settings: Any, stops: Range, around: Surroundings, numbers: FlowNumbers, valve: Any, signals: Any
) -> float:
    """What a rule makes of the torque loop of a device."""
    return rule(loop_of(settings, stops, around, numbers, valve, signals))


def gain_of_loop_and_setting(
    settings: Any, stops: Range, around: Surroundings, numbers: FlowNumbers, valve: Any, signals: Any, setting: float
) -> float:
    """What a rule makes of the torque loop of a device and of another setting of the law."""
    return rule(loop_of(settings, stops, around, numbers, valve, signals), setting)


def opening_beyond_band(
    settings: Any, stops: Range, around: Surroundings, numbers: FlowNumbers, valve: Any, signals: Any, setting: float
) -> float:
    """Command [-] for what a rule makes an opening of, of a valve that opens beyond a dead band."""
    opening = rule(loop_of(settings, stops, around, numbers, valve, signals), setting)
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
"""What follows the torque loop alone, and by which rule."""


def loop_terms(device: Device, law: ControllerKind, walks: bool) -> dict[str, Term]:
    """Return what the gains of a law follow on a device, by the names of ``control.torque_loop``."""
    valve = VALVES[device.valve.kind]
    chambers, sonic = chambers_of(device), isinstance(device.valve.orifice, SonicOrifice)
    signals = SignalsOfWalk if walks else Signals
    names = {item.name for item in valve.quantities}
    timed = {"follow_time": valve.lag or valve.choose(valve_settings(device.valve)).command_delay}
    loop = bind(
        loop_of,
        "loop_of_device",
        {
            "mean_chambers": chambers.function,
            "valve_flow": sonic_flow if sonic else area_flow,
            "time_of_valve": time_of_pair
            if {"opening_delay", "closing_delay", "switching_interval"} <= names
            else bind(time_of_spool, "time_of_spool_valve", timed),
            "time_of_signals": time_in_walk if walks else time_in_scenario,
        },
    )
    orifice = ("sonic_conductance", "critical_ratio") if sonic else ("area", "discharge_coefficient")
    late = (PERIOD_PATH, "sensors.pressure_bandwidth", *(() if walks else ("sensors.delay",)))
    sources = (
        *chambers.sources,
        *("gas.molar_mass", "gas.heat_capacity_ratio", "gas.temperature"),
        *(f"valve.{name}" for name in (*orifice, *(item.name for item in valve.quantities))),
        *late,
    )
    rows = (*chambers.rows, FlowNumbers, valve.settings, signals)

    def term(frame: Callable[..., float], by: Callable[..., float], *settings: str) -> Term:
        return Term((*sources, *settings), bind(frame, f"{by.__name__}_of_device", {"loop_of": loop, "rule": by}), rows)

    found = {name: term(gain_of_loop, by) for name, by in _OF_LOOP.items()}
    opening = opening_beyond_band if "dead_band" in names else gain_of_loop_and_setting
    found[torque_loop.OPENING] = term(opening, torque_loop.dead_zone_opening, "controller.dead_zone")
    # An integral, and what is learnt, go with the proportional gain, also where that one is given.
    gain = next((item.name for item in law.quantities if torque_loop.PROPORTIONAL_GAIN in item.follows), "")
    path = f"controller.{gain}"
    found[torque_loop.INTEGRAL_GAIN] = term(gain_of_loop_and_setting, torque_loop.integral_gain, path)
    found[torque_loop.LEARNING_GAIN] = Term((path,), torque_loop.learning_gain)
    return found
