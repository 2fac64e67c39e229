"""Tracking rule: limits of the numbers of a settled part (``settled.py``), and the kind of failure beyond them.

"SI" is the SI unit of the controlled quantity.
"""

import math
from typing import Any, Literal, NamedTuple

import numpy as np

from ppafo.control.kind import ControllerKind
from ppafo.engine.in_python import over_samples
from ppafo.metrics.metric import Floats
from ppafo.metrics.settled import (
    LARGEST_SHARE,
    LARGEST_SHARE_OF_WAVE,
    PartLimits,
    SettledPart,
    error_and_oscillation,
    gradual_limits,
)
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, reversals
from ppafo.model.columns import first
from ppafo.simulation.profiles import profile_bounds, profile_values
from ppafo.simulation.scenario import Scenario

LARGEST_SHARE_SWITCHED = 0.25
"""RMS error divided by the wanted change, above which an on/off controller, which swings by design, does not follow."""
LARGEST_MEAN_SWITCHED = 0.15
"""Mean error divided by the wanted change, above which an on/off controller does not follow [-]."""
LARGEST_SPAN_SWITCHED = 0.6
"""Range of the error at rest divided by the wanted change, above which an on/off controller does not follow [-].

One step of a quarter, above which a pair is called coarse, beyond each side of a dead zone of +-4.2 % is 58 %.
"""
LARGEST_PEAK = 1.5
"""Peak of the value divided by the wanted change [-]."""
LARGEST_PEAK_WALK = 1.5
"""Peak torque of a walk divided by the torque limit of its controller [-]."""
LEAST_PEAK_WALK = 0.7
"""Largest torque of a walk in plantarflexion divided by the largest requested one; with less it does not follow [-]."""
MOST_PER_STRIDE, MOST_PER_SECOND = 12.0, 10.0
"""Command reversals per stride and per second above which a loop oscillates."""
_TINY = 1.0e-300
"""Divisor in place of 0."""
PER_TURN = 2.0
"""Additional command reversals for each reversal of the reference: there and back."""
_TIMES_OF_REFERENCE = 4000
"""Number of times at which a reference is evaluated to count its reversals."""
SMALLEST_MOVE = 0.01
"""Change of the value divided by the wanted change, below which the value does not move [-]."""
REVERSALS = "command_reversals"
"""Metric that counts reversals of the command."""
Failure = Literal["does not move", "oscillates", "overshoots", "does not follow"]
"""Kind of failure."""
Criterion = Literal[
    "RMS error",
    "mean error",
    "swing",
    "largest error",
    "reversals",
    "command reversals",
    "movement",
    "peak",
    "missing peak torque",
    "reach",
    "any reach",
]
"""Number of the judged part with a limit, command reversals of the whole run.

A torque reference may exceed the reach of a locked or of a moving joint.
"""
CRITERION_TEXTS: dict[Criterion | Literal[""], str] = {
    "reach": "the reference exceeds the largest available torque by",
    "any reach": "the reference exceeds the largest available torque at every angle by",
}
"""Words before the number of a criterion whose name is no noun phrase."""


def most_reversals(scenario: Scenario, duration: float | None = None) -> float:
    """Largest number of command reversals in ``duration`` [s] of a loop that does not oscillate.

    Infinite for a controller that may switch. The default duration is the duration of the run.
    """
    law, stride_time = scenario.law, scenario.motion.stride_time
    duration = first(scenario.run.duration) if duration is None else duration
    # A law that requests openings between shut and open should not reverse, where the valve has these openings.
    if law is None or is_pair(scenario) or not scenario.motion.motion_kind.asks_gradually(law):
        return math.inf
    if stride_time > 0.0:
        return duration * MOST_PER_STRIDE / stride_time
    # A run of tenths of a second is a transient: a few reversals are its rate, and no oscillation.
    most = max(duration, 1.0) * MOST_PER_SECOND
    # A profile whose numbers are arrays has no reversals that could be counted once.
    if not scenario.follows_reference or any(np.ndim(number) for number in scenario.reference.settings.values()):
        return most
    lowest, highest = profile_bounds(scenario.reference)
    if highest <= lowest:
        return most
    times = np.linspace(0.0, duration, _TIMES_OF_REFERENCE)
    values = np.asarray(profile_values(scenario.reference, times)[0], dtype=np.float64)
    return most + PER_TURN * reversals(values, OSCILLATION_THRESHOLD * (highest - lowest))


def is_pair(scenario: Scenario) -> bool:
    """True if the valve of the device is a pair of on/off valves."""
    return "switching_interval" in scenario.device.valve.settings


def only_switches(scenario: Scenario, law: ControllerKind | None) -> bool:
    """True if a valve is only ever fully open or shut, by its controller or as a pair: the loop swings by design."""
    return is_pair(scenario) or (law is not None and law.only_switches)


def is_noisy(scenario: Scenario) -> bool:
    """True if sensor noise reverses the command of a task; reversals then count in its settled part only."""
    sensors = scenario.sensors
    return scenario.follows_reference and bool(sensors.angle_noise or sensors.pressure_noise)


def excess_of_walk(settled: SettledPart, turning: Floats | float, limit: Floats | float) -> Any:
    """Worst ratio of a walk's tracking numbers to their limits [-]: up to 1 the walk follows its reference.

    ``turning`` is the number of command reversals divided by its limit; ``limit`` [N m] is the controller's torque
    limit, 0 for none. The numbers of ``settled`` may be arrays (runs,).
    """
    peak = settled.peak / np.where(np.asarray(limit) > 0.0, LARGEST_PEAK_WALK * limit, np.inf)
    lacking = LEAST_PEAK_WALK * settled.requested_peak / np.maximum(settled.given_peak, 1.0e-9)
    error = settled.rms_error / settled.wanted_change / LARGEST_SHARE_OF_WAVE
    return np.maximum(np.maximum(turning, peak), np.maximum(error, lacking))


def failure_of_walk(settled: SettledPart, turning: float, limit: float) -> Failure | None:
    """Kind of failure of a walk, with the arguments of ``excess_of_walk``; None if the walk follows."""
    if excess_of_walk(settled, turning, limit) <= 1.0:
        return None
    if turning > 1.0:
        return "oscillates"
    return "overshoots" if limit > 0.0 and settled.peak > LARGEST_PEAK_WALK * limit else "does not follow"


class _TaskExcess(NamedTuple):
    """Tracking numbers of a task (runs,), each divided by its limit [-]: above 1 the task fails.

    - ``error``: remaining error
    - ``oscillation``: oscillation of the value
    - ``overshoot``: peak of the value beyond the wanted change
    - ``standstill``: error of a value that does not move, 0 for others
    - ``reach``: torque that is beyond the actuator's reach, and missing
    """

    error: Floats
    oscillation: Floats
    overshoot: Floats
    standstill: Floats
    reach: Floats

    @property
    def largest(self) -> Floats:
        """Largest of the numbers by which a run fails (runs,)."""
        largest: Floats = np.max(self, axis=0)
        return largest


def part_limits(settled: SettledPart, is_switched: bool) -> PartLimits:
    """Limits of a part; of on/off valves, ``is_switched``, wider ones. Numbers may be arrays (runs,)."""
    if not is_switched:
        limits: PartLimits = over_samples(gradual_limits, settled)
        return limits
    wanted = np.asarray(settled.wanted_change)
    at_rest = wanted / np.maximum(1.0 - np.asarray(settled.motion), _TINY)
    mean, span = LARGEST_MEAN_SWITCHED * at_rest, LARGEST_SPAN_SWITCHED * at_rest
    return PartLimits(LARGEST_SHARE_SWITCHED * wanted, mean, span, np.full_like(at_rest, np.inf))  # type: ignore[arg-type]


def excess_of_part(settled: SettledPart, is_switched: bool, beyond: Floats | float = 0.0) -> _TaskExcess:
    """Tracking numbers of a part of a task divided by their limits, except command reversals: up to 1 it follows.

    ``is_switched`` is true for a valve without gradual openings, and ``beyond`` the torque beyond reach [N m]. The
    numbers of ``settled`` may be arrays (runs,).
    """
    wanted, mean_error, motion = settled.wanted_change, np.abs(settled.mean_error), np.asarray(settled.motion)
    error, oscillation = over_samples(error_and_oscillation, settled, part_limits(settled, is_switched))
    overshoot = (settled.peak / wanted - 1.0) / (LARGEST_PEAK - 1.0) * (1.0 - motion)
    if is_switched:
        # A limit cycle beside the reference has a large mean error, and reverses.
        swings = (settled.error_deviation > mean_error) | (np.asarray(settled.error_reversals) > 0.0)
        oscillation, overshoot = np.where(swings, error, 0.0), np.zeros_like(motion)
    share = np.asarray(settled.rms_error / wanted)
    is_still = (share > LARGEST_SHARE) & (settled.value_range <= SMALLEST_MOVE * wanted)
    standstill = np.where(is_still, share / LARGEST_SHARE, 0.0)
    # A pair swings by design, so that a torque beyond reach shows in the mean error rather than in the RMS error. The
    # mean error of a wave hides its peaks, and a ramp may end before them.
    missing = np.where(settled.rests, mean_error, np.maximum(mean_error, beyond))
    is_beyond = (np.asarray(beyond) > 0.0) & (np.asarray(settled.ends_on_ramp) == 0.0)
    reach = np.where(is_beyond, missing / (LARGEST_SHARE * wanted), 0.0)
    ratios = (error, oscillation, overshoot, standstill, reach)
    return _TaskExcess._make(np.broadcast_arrays(*(np.asarray(settled.share * each) for each in ratios)))


def failure_of_task(excess: _TaskExcess, turning: float) -> Failure | None:
    """Kind of failure of a task; None if the task follows.

    ``turning`` is the number of command reversals divided by its limit.
    """
    if excess.standstill > 1.0:
        return "does not move"
    if turning > 1.0 or excess.oscillation > 1.0:
        return "oscillates"
    if excess.error > 1.0 or (excess.reach > 1.0 and excess.overshoot <= 1.0):
        return "does not follow"
    return "overshoots" if excess.overshoot > 1.0 else None
