"""Evidence in a run that does not follow its reference: numbers that a change with which it follows makes a cause.

Evidence alone is no cause: each clause belongs to one or more changes by their words, and is said where a further run
with such a change follows (``ppafo.counterfactuals``).
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ppafo.control.catalog import CONTROLLERS, switching_remedy
from ppafo.control.torque_loop import SAMPLES_LATE
from ppafo.metrics.metric import Floats, controlled_in, followed
from ppafo.metrics.settled import LARGEST_SHARE
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.model.plant import gravity_torque
from ppafo.parameters.graph import PRESSURE_PATH, Asked
from ppafo.parameters.reach import static_torque, supply_that_moves, torque_reach
from ppafo.simulation.clock import RATE_PATH
from ppafo.simulation.gains import loop_of
from ppafo.simulation.numbers import declared_numbers, number_at
from ppafo.simulation.profiles import profile_bounds
from ppafo.simulation.scenario import FreeMotion, Scenario
from ppafo.simulation.torque_loop import LoopParts, lag_of_sensor, quicker_at
from ppafo.simulation.tracking.case import Case, change_text, level_text, stated_number
from ppafo.simulation.tracking.rule import LEAST_PEAK_WALK, is_pair

HIGHER_SUPPLY = "with a higher supply pressure"
SMALLER_REFERENCE = "with a smaller reference"
LARGER_VALVE = "with a larger valve"
SMALLER_VALVE = "with a smaller valve"
CARRYING_START = "with initial pressures that carry the load"
FASTER_CONTROLLER = "with a faster controller"
"""Words of changes for which a run may have evidence."""
LOAD = "motion.external_torque"
QUICKER_ABOVE = ("bandwidth", "frequency", "slew_limit")
"""Ends of the paths of numbers of which more is quicker."""
# Fractions of the judged samples, or of a delay, that count as most, and as often [-].
_MOSTLY = 0.5
_OFTEN = 0.1
_FINE = 0.1
"""Step of an on/off valve during its dead time divided by the wanted change, up to which it makes no loop fail [-]."""
_FLUNG = 0.5
"""Initial deviation from the reference, divided by the wanted change, from which a joint counts as thrown off [-]."""
_NEGATIVE = " in the negative direction"
"""Direction of a torque whose sign a text omits."""
_ONE_WAY = 0.05
"""Reach in one direction divided by the reach in the other, below which an actuator pushes one way only [-]."""
_SAMPLES = 400
"""Largest number of samples at which the reach is compared with the torque."""
ON_STOP = 1.0e-3
"""Distance from a stop up to which a joint rests on it [rad]."""

Evidence = tuple[tuple[str, ...], str]
"""Words of the changes that confirm a clause, and the clause."""


def ideal_words(scenario: Scenario, path: str) -> str:
    """Words of the change that makes a number ideal."""
    if path == RATE_PATH:
        return FASTER_CONTROLLER
    return f"{'with a quicker' if path.endswith(QUICKER_ABOVE) else 'without'} {stated_number(scenario, path)}"


def evidence_in(case: Case) -> Iterator[Evidence]:
    """Yield the evidence in a run, most telling first."""
    scenario = case.scenario
    if scenario.follows_reference:
        of_load = (ideal_words(scenario, LOAD),) if LOAD in declared_numbers(scenario) else ()
        if text := torque_beyond_reach(case):
            yield (HIGHER_SUPPLY, SMALLER_REFERENCE), text
        if text := _load_beyond_reach(case):
            yield (HIGHER_SUPPLY, *of_load), text
        if text := _flung_at_start(case):
            yield (CARRYING_START,), text
    elif text := _request_beyond_reach(case):
        yield (HIGHER_SUPPLY, SMALLER_REFERENCE), text
    if text := _step_of_valves(case):
        yield (SMALLER_VALVE,), text
    # A move, and the push-off of a walk, are a small part of the time.
    if case.open_share > (_MOSTLY if case.settled.rests else _OFTEN):
        yield (LARGER_VALVE,), f"the valve is fully open for {100.0 * case.open_share:.0f} % of the time"
    delays = delays_of(scenario)
    if path := most_of(delays):
        total = level_text("s", math.fsum(delays.values()))
        rate = 1.0 / scenario.controller.period
        stated = f"`{RATE_PATH} = {rate:.4g} Hz`" if path == RATE_PATH else stated_number(scenario, path)
        yield (ideal_words(scenario, path),), f"{stated} is most of the loop's delay of {total}"


def delays_of(scenario: Scenario) -> dict[str, float]:
    """Delays of a loop [s] by the path of their number: sensors, sampling, valve, spool, slew, regulator.

    A second-order spool delays by 2 zeta / omega, a rate limit by half of the time for a full opening, a first-order
    lag by its time constant, a sample by one period and the half of a hold.
    """
    declared = declared_numbers(scenario)
    number = {path: number_at(scenario, path) for path in _DELAYS if path in declared}
    spool = number.pop(_SPOOL, 0.0)
    slew = number.pop(_SLEW, 0.0)
    damping = number.pop(_DAMPING, 0.0)
    delays = {path: lag_of_sensor(value) if path.endswith("bandwidth") else value for path, value in number.items()}
    delays[RATE_PATH] = SAMPLES_LATE * scenario.controller.period
    delays[_SPOOL] = 2.0 * damping / (2.0 * math.pi * spool) if spool > 0.0 else 0.0
    delays[_SLEW] = 0.5 / slew if slew > 0.0 else 0.0
    return delays


_SPOOL = "valve.spool_frequency"
_DAMPING = "valve.spool_damping_ratio"
_SLEW = "valve.slew_limit"
_DELAYS = (
    "sensors.delay",
    "sensors.pressure_bandwidth",
    "sensors.angle_bandwidth",
    "valve.delay",
    _SPOOL,
    _DAMPING,
    _SLEW,
    "valve.response_time",
    "valve.opening_delay",
    "valve.closing_delay",
    "valve.switching_interval",
)
"""Paths of the numbers that delay a loop."""


def most_of(delays: dict[str, float]) -> str:
    """Path of the delay that is more than half of all; "" if none is."""
    path = max(delays, key=delays.__getitem__)
    return path if delays[path] > _MOSTLY * math.fsum(delays.values()) else ""


class TorqueReach(NamedTuple):
    """Wanted torque at an angle, and the reach of the actuator in its direction there.

    ``wanted`` and ``reach`` [N m], ``angle`` [rad]; ``upwards`` is true for a torque above the reach, false for one
    below.
    """

    wanted: float
    reach: float
    angle: float
    upwards: bool

    @property
    def lacking(self) -> float:
        """Torque beyond reach [N m], 0 or less within reach."""
        return self.wanted - self.reach if self.upwards else self.reach - self.wanted


def torque_peaks(case: Case) -> tuple[TorqueReach, TorqueReach]:
    """Highest and lowest wanted torque with the reach there; a reference with a period counts with its own peaks."""
    reference = case.reference
    angle = case.channel("angle")
    device = case.device
    has_period = math.isfinite(case.settled.reference_periods)
    lowest, highest = profile_bounds(case.scenario.reference) if has_period else (reference.min(), reference.max())
    top = float(angle[int(np.argmax(reference))])
    bottom = float(angle[int(np.argmin(reference))])
    return (
        TorqueReach(float(highest), torque_reach(device, top)[1], top, upwards=True),
        TorqueReach(float(lowest), torque_reach(device, bottom)[0], bottom, upwards=False),
    )


def cuts_wave(case: Case) -> bool:
    """True if a moving reference of a torque goes far beyond what the actuator reaches at the angle of its peak."""
    settled = case.settled
    if case.scenario.controlled != TORQUE or settled.rests or settled.ends_on_ramp:
        return False
    return max(peak.lacking for peak in torque_peaks(case)) > LARGEST_SHARE * settled.wanted_change


def _reach_text(reach: float, upwards: bool) -> str:
    """Torque limit [N m] of the actuator in the positive or negative direction, as text with the size and direction."""
    if upwards:
        return f"at most {level_text('N m', reach)}"
    # Of an actuator that always pushes, the smallest torque is positive.
    return (
        f"{'at least' if reach > 0.0 else 'at most'} {level_text('N m', abs(reach))}{_NEGATIVE if reach <= 0.0 else ''}"
    )


def torque_beyond_reach(case: Case) -> str:
    """Clause: the wanted torque exceeds the actuator's torque from its supplies at that angle; "" if it does not."""
    scenario = case.scenario
    device = case.device
    peaks = torque_peaks(case) if scenario.controlled == TORQUE and not case.oscillates else ()
    worst = max(peaks, key=lambda peak: peak.lacking, default=None)
    if worst is None or worst.lacking <= 0.0:
        return ""
    # An actuator that only pushes gives least where its chamber is vented.
    pushes = worst.reach > 0.0 and not worst.upwards
    of_second = supply_that_moves(device, worst.upwards) != PRESSURE_PATH
    filled = float(device.lowest_pressure if pushes else device.highest_pressures[of_second])
    gives = f"the actuator gives {_reach_text(worst.reach, worst.upwards)}"
    return f"at {level_text('rad', worst.angle)} and {level_text('Pa', filled)} {gives}"


def _load_at(case: Case, angle: float) -> float | None:
    """Torque of load and weight at a controlled angle [rad] of a free joint; None for other joints, and for legs."""
    motion = case.scenario.motion
    if case.scenario.controlled != ANGLE or not isinstance(motion, FreeMotion) or motion.leg is not None:
        return None
    return float(motion.outside_torque) + float(gravity_torque(angle, case.device.foot_plate.gravity_torque))


def _load_beyond_reach(case: Case) -> str:
    """Clause: the load on a free joint exceeds the actuator's torque at the wanted angle; "" if it does not."""
    scenario = case.scenario
    device = case.device
    wanted = float(np.mean(case.reference))
    if (load := _load_at(case, wanted)) is None:
        return ""
    lowest, highest = torque_reach(device, wanted)
    # A joint that rests beside its reference needs what breaks its static friction, too.
    holding = float(device.friction.static_torque) if case.settled.rests else 0.0
    is_within = lowest <= load <= highest
    is_high = load > highest if not is_within else case.settled.mean_error < 0.0
    needed = load if not is_within else load + holding if is_high else load - holding
    if lowest <= needed <= highest:
        return ""
    stop = stop_of(scenario, case.channel("angle"))
    rests = f"the joint lies on its {stop} stop: " if stop else ""
    against = f" to break its static friction of {level_text('N m', holding)}" if is_within else ""
    reach = highest if is_high else lowest
    one_way = abs(reach) <= _ONE_WAY * max(abs(lowest), abs(highest))
    gives = f"the actuator gives {_reach_text(reach, is_high)}{': it acts in one direction only' if one_way else ''}"
    return f"{rests}the load needs {level_text('N m', needed)} at {level_text('rad', wanted)}{against}, {gives}"


def stop_of(scenario: Scenario, angle: Floats) -> str:
    """Stop on which a joint rests for most of some samples; "" if on none."""
    ends = (("lower", scenario.device.actuator.angle_min), ("upper", scenario.device.actuator.angle_max))
    return next((word for word, stop in ends if np.mean(np.abs(angle - stop) <= ON_STOP) > _MOSTLY), "")


def _flung_at_start(case: Case) -> str:
    """Clause: the initial pressures do not carry the load, which throws the joint off; "" if it is not thrown off."""
    device = case.device
    initial = case.scenario.initial
    reference, angle = followed(case.recording)
    start = float(angle[0])
    if case.oscillates or (load := _load_at(case, start)) is None:
        return ""
    lacking = load - static_torque(device)(start, float(initial.pressure_1), float(initial.pressure_2))
    # A lack of torque turns the joint to smaller angles; later the reference moves away, not the joint.
    deviation = float(np.max(((reference - angle) * np.sign(lacking))[reference == reference[0]]))
    if abs(lacking) <= float(device.friction.static_torque) or deviation <= _FLUNG * case.settled.wanted_change:
        return ""
    carried = level_text("N m", load - lacking)
    needed = level_text("N m", load)
    away = f"the joint moves away by {change_text(ANGLE, deviation)} before the chambers are filled"
    return f"at the start the chambers give {carried} for a load of {needed}: {away}"


def _step_of_valves(case: Case) -> str:
    """Clause: on/off valves change the controlled quantity during their dead time, however little is requested."""
    scenario = case.scenario
    law = case.law
    if law is None and case.opens_fully_alone:
        # Valves that a Python object opens fully alone act as under the shipped on/off law.
        law = CONTROLLERS["on_off"]
    if law is None or not (case.only_switches or case.law is None):
        return ""
    # Step R theta at the mean angle, in the dead time theta.
    loop = loop_of(scenario, law)
    angle = float(np.mean(case.channel("angle")))
    parts = LoopParts(scenario.device, scenario.motion.motion_kind.sees(scenario), scenario.controlled)
    step = loop.rate * loop.dead_time * quicker_at(parts, Asked(lambda path: number_at(scenario, path)), angle)
    ratio = step / case.settled.wanted_change
    if ratio <= _FINE:
        return ""
    controlled = scenario.controlled if TORQUE in law.controls else TORQUE
    declare = switching_remedy(scenario.controller.kind)
    asks = f"`{law.name}` requests partial openings, which on/off valves do not have{declare}: "
    in_time = f"in their dead time of {1.0e3 * loop.dead_time:.3g} ms, {ratio:.2g} times the requested change"
    partial = asks if is_pair(scenario) and not law.only_switches else ""
    return f"{partial}the valves cause a step of {change_text(controlled, step)} {in_time}"


def _request_beyond_reach(case: Case) -> str:
    """Clause: the controller of a walk often requests more torque than the actuator gives at the current angle."""
    settled = case.settled
    if case.overshoots or controlled_in(case.recording) is None:
        return ""
    angle = case.channel("angle")
    torque = static_torque(case.device)
    places = np.unique(np.linspace(0, angle.size - 1, _SAMPLES).astype(np.intp))
    reaches = np.array([torque_reach(case.device, float(angle[place]), torque) for place in places])
    reference = case.reference[places]
    above = reference - reaches[:, 1]
    below = reaches[:, 0] - reference
    share = float(np.mean((above > 0.0) | (below > 0.0)))
    if share <= (0.0 if settled.given_peak < LEAST_PEAK_WALK * settled.requested_peak else _OFTEN):
        return ""
    at = int(np.argmax(np.maximum(above, below)))
    upwards = bool(above[at] > 0.0)
    asked = level_text("N m", float(reference[at]))
    gives = _reach_text(float(reaches[at, int(upwards)]), upwards)
    often = f"for {100.0 * share:.0f} % of the time the controller requests more torque than the actuator gives"
    return f"{often}, such as {asked} where the actuator gives {gives}"
