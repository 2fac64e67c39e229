"""Tracking rule: numbers of the settled part of a run, their limits, and the kind of failure.

The settled part is the second half of the hold, or of the run if the reference never rests. Errors are relative to the
wanted change: the largest reference relative to the initial value, or to 0 for a torque. In a walk, only samples with a
requested torque count, and errors are relative to the RMS of the request.
"""

import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.control.catalog import PROFILES
from ppafo.control.kind import ControllerKind
from ppafo.engine.scheme.actuators import torque_of
from ppafo.metrics.command import command_reversals, requested_samples
from ppafo.metrics.metric import Floats, controlled_in, extent, followed, hold_start
from ppafo.metrics.settled import is_long_enough
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, reversals
from ppafo.metrics.tracking import SUSTAINED
from ppafo.model.catalog import ACTUATORS
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE
from ppafo.parameters.plant import plant_parameters
from ppafo.parameters.reach import torque_reach
from ppafo.signals import Recording
from ppafo.simulation.profiles import limits_of, profile_bounds, profile_values
from ppafo.simulation.scenario import Scenario

LARGEST_SHARE = 0.05
"""RMS error divided by the wanted change, above which a controller with gradual openings does not follow [-]."""
LARGEST_SHARE_SWITCHED = 0.25
"""RMS error divided by the wanted change, above which an on/off controller, which swings by design, does not follow."""
LARGEST_MEAN_SWITCHED = 0.15
"""Mean error divided by the wanted change, above which an on/off controller does not follow [-]."""
LARGEST_SPAN_SWITCHED = 0.6
"""Range of the error at rest divided by the wanted change, above which an on/off controller does not follow [-].

An RMS error of a quarter is a range of 50 % in a square wave and of 87 % in a triangle.
"""
LARGEST_SHARE_MOVING = 0.2
"""RMS error divided by the wanted change, if the reference or the joint moves: every loop lags then [-]."""
LARGEST_ANGLE_ERROR, LARGEST_ANGLE_SHARE = math.radians(2.0), 0.05
"""Largest angle error for a moving reference [rad], or divided by the reference's range [-] if that allows more."""
LARGEST_ANGLE_SWING, LARGEST_SWING_SHARE = math.radians(1.0), 0.03
"""Largest range of the angle error for a reference at rest, in the same two ways: a swing of 1 deg is visible."""
LARGEST_CREST = 1.5
"""Largest error divided by the largest RMS error, for a smooth wave of a torque or a pressure; of a lag it is 1.41."""
LARGEST_SHARE_OF_WAVE = 0.5
"""Standard deviation of the error divided by the standard deviation of a moving reference [-].

A controller that only keeps the mean of a sine has 1.0, however small the sine is beside its mean; a constant delay on
a slow ramp has 0. In a walk it is the RMS torque error divided by the RMS of the requested torque.
"""
LARGEST_PEAK = 1.5
"""Peak of the value divided by the wanted change [-]."""
LARGEST_PEAK_WALK = 1.5
"""Peak torque of a walk divided by the torque limit of its controller [-]."""
MOST_PER_STRIDE, MOST_PER_SECOND = 12.0, 10.0
"""Command reversals per stride and per second above which a loop oscillates."""
PER_TURN = 2.0
"""Additional command reversals for each reversal of the reference: there and back."""
FEWEST_PERIODS = 0.5
"""Periods of a reference in the settled part, below which the part may hold no peak of the reference [-]."""
_TIMES_OF_REFERENCE = 4000
"""Number of times at which a reference is evaluated to count its reversals."""
SMALLEST_MOVE = 0.01
"""Change of the value divided by the wanted change, below which the value does not move [-]."""
SMALLEST_CHANGE = 0.05
"""Smallest wanted change divided by the range of the controlled quantity [-]; smaller ones are judged as this one."""
SMALLEST_SIZE = 5.0e-4
"""Smallest wanted change if the range is 0, in typical sizes of the quantity (``ControlledQuantity.size``)."""

_ANGLES = 9
"""Number of angles between the stops at which the torque of a moving joint is evaluated."""

REVERSALS = "command_reversals"
"""Metric that counts reversals of the command."""
MOVED_JOINT = 0.01
"""Travel of a joint in the settled part above which it disturbs the loop of a torque or a pressure [rad]."""

Failure = Literal["does not move", "oscillates", "overshoots", "does not follow"]
"""Kind of failure."""


class SettledPart(NamedTuple):
    """Numbers of the settled part of a run, in SI units of the controlled quantity.

    ``samples`` selects the settled part in the recording and ``duration`` [s] is its length. ``wanted`` is the wanted
    change, in a walk the RMS of the request. ``error`` is the RMS error, ``missing`` the mean error and ``swing`` the
    standard deviation of the error. ``turns`` is the number of reversals of the error, 0 below ``SUSTAINED``. ``moved``
    is the range of the value over the run; ``peak`` the largest change in the wanted direction, 0 if meaningless.
    ``rests`` is true if reference and joint stand still; ``ends_on_ramp`` if the run ends before a monotone reference
    rests. ``start`` [s] is the start of the settled part, 0 for a walk. ``worst`` is the largest error and ``span`` the
    range of the error. ``way`` is the range of initial value and reference for an angle, 0 for other quantities.
    ``reversals`` [1/s] is the rate of command reversals in the last half of the part; ``wave`` the standard deviation
    of the reference, and ``periods`` the number of periods of a sine in the part, else infinite. ``is_smooth`` is
    true for a reference without steps and corners.
    """

    samples: slice | NDArray[np.bool_]
    duration: float
    wanted: float
    error: float
    missing: float
    swing: float
    turns: float
    moved: float
    peak: float
    rests: bool
    ends_on_ramp: bool = False
    start: float = 0.0
    worst: float = 0.0
    span: float = 0.0
    way: float = 0.0
    reversals: float = 0.0
    wave: float = 0.0
    periods: float = math.inf
    is_smooth: bool = False

    @property
    def is_undecided(self) -> Any:
        """True if the part is no basis for the verdict that a run follows: it ends on a ramp, or may hold no peak."""
        moves = ~np.asarray(self.rests) & (np.asarray(self.wave) > 0.0)
        return np.asarray(self.ends_on_ramp) | (moves & (np.asarray(self.periods) < FEWEST_PERIODS))

    @property
    def share(self) -> float:
        """RMS error divided by the wanted change [-]."""
        return self.error / self.wanted


def most_reversals(scenario: Scenario, law: ControllerKind | None, duration: float, stride_time: float = 0.0) -> float:
    """Largest number of command reversals in ``duration`` [s] of a loop that does not oscillate.

    Infinite for a controller that may switch. ``stride_time`` [s] is the stride time of a walk, 0 for a task.
    """
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


def settled_periods(scenario: Scenario) -> Any:
    """Periods of a sine in the second half of a run [-], inf for another reference; an array (runs,) if it varies.

    A table may have a part of its period alone on purpose, such as the swing of a stride.
    """
    frequency = scenario.reference.settings.get("frequency")
    return math.inf if frequency is None else 0.5 * np.asarray(scenario.run.duration) * frequency


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


def settled_walk(recording: Recording, limit: float) -> SettledPart | None:
    """Settled part of a walk: the samples with a requested torque; None if none is requested.

    For a controller that requests no torque but opens its valves up to a torque ``limit`` [N m], only the peak is set;
    a ``limit`` of 0 means none.
    """
    if controlled_in(recording) is None:
        peak = float(np.max(np.abs(recording["torque"])))
        numbers: dict[str, Any] = dict.fromkeys(("duration", "error", "missing", "swing", "turns", "moved"), 0.0)
        return (
            SettledPart(samples=slice(None), wanted=limit, peak=peak, rests=False, **numbers) if limit > 0.0 else None
        )
    asked = requested_samples(recording)
    reference, value = (series[asked] for series in followed(recording))
    wanted = float(np.sqrt(np.mean(reference**2))) if reference.size else 0.0
    if wanted == 0.0:
        return None
    error = value - reference
    rms = float(np.sqrt(np.mean(error**2)))
    return SettledPart(
        samples=asked,
        duration=float(np.ptp(recording.time[[0, -1]])),
        wanted=wanted,
        error=rms,
        missing=float(np.mean(error)),
        swing=rms,
        turns=0,
        moved=float(np.ptp(value)),
        peak=float(np.max(np.abs(recording["torque"]))),
        rests=False,
    )


def settled_task(scenario: Scenario, recording: Recording) -> SettledPart:
    """Settled part of a task with a reference."""
    reference, value = followed(recording)
    time, count = recording.time, len(recording)
    first = hold_start(recording)
    rests = first is not None and is_long_enough(first, count)
    begin = first if rests and first is not None else 0
    samples, last_half = slice((begin + count) // 2, None), slice((begin + 3 * count) // 4, None)
    error = (value - reference)[samples]
    asked = extent(recording)
    wanted = max(asked, smallest_change(scenario))
    # A joint that is moved disturbs the loop of a torque or a pressure all the time, as a moving reference does.
    is_angle = scenario.controlled == ANGLE
    rests = rests and (is_angle or float(np.ptp(recording["angle"][samples])) <= MOVED_JOINT)
    # An error behind a reference that turns turns with it.
    turns = reversals(error, OSCILLATION_THRESHOLD * wanted)
    turns -= 0 if rests else reversals(np.asarray(reference[samples]), OSCILLATION_THRESHOLD * wanted)
    steps = np.diff(reference)
    is_monotone = bool(np.all(steps >= 0.0) or np.all(steps <= 0.0))
    return SettledPart(
        samples=samples,
        duration=float(time[-1] - time[samples][0]),
        wanted=wanted,
        error=float(np.sqrt(np.mean(error**2))),
        missing=float(np.mean(error)),
        swing=float(np.std(error)),
        turns=turns if turns >= SUSTAINED else 0,
        moved=float(np.ptp(value)),
        peak=_peak(scenario, reference, value) if asked >= wanted else 0.0,
        rests=rests,
        ends_on_ramp=not rests and first is None and is_monotone,
        start=float(time[samples][0]),
        worst=float(np.max(np.abs(error))),
        span=float(np.ptp(error)),
        way=max(asked, float(np.ptp(reference))) if is_angle else 0.0,
        # Noise that turns the command until the joint rests is no oscillation.
        reversals=2.0 * command_reversals(recording, last_half) / max(float(time[-1] - time[samples][0]), 1.0),
        wave=float(np.std(reference[samples])),
        periods=float(settled_periods(scenario)),
        is_smooth=PROFILES[scenario.reference.kind].is_smooth,
    )


def _peak(scenario: Scenario, reference: Floats, value: Floats) -> float:
    """Largest change of the value in the direction of the reference, after the value first meets the reference."""
    start = 0.0 if scenario.controlled == TORQUE else float(value[0])
    ahead = reference - start
    sign = math.copysign(1.0, float(ahead[int(np.argmax(np.abs(ahead)))]))
    # What a joint has at the start, such as the torque of its material, is not the loop's.
    met = int(np.argmax((value - reference) * sign <= 0.0))
    return float(np.max((value[met:] - start) * sign))


def smallest_change(scenario: Scenario) -> float:
    """Smallest wanted change that is judged, from the range of the controlled quantity [SI unit of that quantity]."""
    kind, device = CONTROLLED[scenario.controlled], scenario.device
    if kind.name == TORQUE:
        lowest, highest = torque_reach(device, 0.5 * (device.actuator.angle_min + device.actuator.angle_max))
    else:
        limits = limits_of(device, kind)
        lowest, highest = float(limits.lowest), float(limits.highest)
    # A torque or a difference of pressures goes from 0 to one end of its range.
    one_way = 0.5 if kind.name in (TORQUE, "pressure_difference") else 1.0
    return max(SMALLEST_CHANGE * one_way * abs(highest - lowest), SMALLEST_SIZE * kind.size)


def shortfall(scenario: Scenario) -> Floats:
    """Largest reference minus the available torque [N m] in each run (runs,); 0 if the torque suffices.

    The available torque is with one chamber at its supply and the other vented, independent of the controller. For a
    moving joint the angle with the largest torque counts.
    """
    if scenario.controlled != TORQUE:
        return np.zeros(1)
    device = scenario.device
    actuator, supply, locked = device.actuator, device.supply, scenario.motion.locked_angle
    fractions = (0.0,) if locked is not None else np.linspace(0.0, 1.0, _ANGLES).tolist()
    first, travel = (actuator.angle_min, actuator.angle_max - actuator.angle_min) if locked is None else (locked, 0.0)
    model, plant, vented = ACTUATORS[actuator.kind].model, plant_parameters(device), supply.atmospheric_pressure
    angles = [first + fraction * travel for fraction in fractions]
    highest = [torque_of(model, plant, angle, supply.pressure, vented) for angle in angles]
    lowest = [torque_of(model, plant, angle, vented, supply.dorsiflexion_pressure) for angle in angles]
    if supply.is_vacuum:
        highest, lowest = lowest, highest
    least, most = profile_bounds(scenario.reference)
    above, below = most - np.max(highest, axis=0), np.min(lowest, axis=0) - least
    return np.atleast_1d(np.maximum(0.0, np.maximum(above, below)))


def excess_of_walk(settled: SettledPart, turning: Floats | float, limit: float) -> Floats | float:
    """Worst ratio of a walk's tracking numbers to their limits [-]: up to 1 the walk follows its reference.

    ``turning`` is the number of command reversals divided by its limit; ``limit`` [N m] is the controller's torque
    limit, 0 for none. The numbers of ``settled`` may be arrays (runs,).
    """
    peak = settled.peak / (LARGEST_PEAK_WALK * limit) if limit > 0.0 else 0.0
    return np.maximum(np.maximum(turning, peak), settled.share / LARGEST_SHARE_OF_WAVE)


def failure_of_walk(settled: SettledPart, turning: float, limit: float) -> Failure | None:
    """Kind of failure of a walk, with the arguments of ``excess_of_walk``; None if the walk follows."""
    if excess_of_walk(settled, turning, limit) <= 1.0:
        return None
    if turning > 1.0:
        return "oscillates"
    return "overshoots" if limit > 0.0 and settled.peak > LARGEST_PEAK_WALK * limit else "does not follow"


class _TaskExcess(NamedTuple):
    """Tracking numbers of a task, each divided by its limit [-].

    ``off`` is the remaining error, ``swings`` the oscillation of the value, ``peak`` the overshoot, and ``still`` the
    error of a value that does not move.
    """

    off: Floats
    swings: Floats
    peak: Floats
    still: Floats


def largest_error(settled: SettledPart, is_switched: bool) -> Floats:
    """Largest RMS error with which a task still follows its reference [unit of ``settled``]; arrays (runs,) allowed."""
    rests, wanted, wave = np.asarray(settled.rests), np.asarray(settled.wanted), np.asarray(settled.wave)
    # A wave below what a reference at rest may be missed by is judged as rest.
    is_wave = ~rests & (wave > (LARGEST_SHARE_SWITCHED if is_switched else LARGEST_SHARE) * wanted)
    share = LARGEST_SHARE_SWITCHED if is_switched else np.where(rests, LARGEST_SHARE, LARGEST_SHARE_MOVING)
    allowed: Floats = share * wanted
    # An offset beside the wave is judged by the share alone.
    of_wave = np.hypot(LARGEST_SHARE_OF_WAVE * wave, settled.missing)
    limit: Floats = np.where(is_wave, np.minimum(allowed, of_wave), allowed)
    return limit


def largest_deviation(settled: SettledPart, is_switched: bool) -> Floats:
    """Largest range of the error while the reference rests, or largest error while it moves; inf without a limit.

    An angle has both limits [rad], a smooth wave of another quantity the second one, an on/off controller the first
    one. The numbers of ``settled`` may be arrays (runs,).
    """
    rests, way = np.asarray(settled.rests), np.asarray(settled.way)
    if is_switched:
        return np.where(rests, LARGEST_SPAN_SWITCHED * np.asarray(settled.wanted), np.inf)
    # Degrees count for an angle, however far it goes.
    swing, error = (LARGEST_SWING_SHARE * way, LARGEST_ANGLE_SHARE * way)
    of_angle = np.where(rests, np.maximum(LARGEST_ANGLE_SWING, swing), np.maximum(LARGEST_ANGLE_ERROR, error))
    of_other = np.where(~rests & settled.is_smooth, LARGEST_CREST * largest_error(settled, False), np.inf)
    limit: Floats = np.where(way > 0.0, of_angle, of_other)
    return limit


def excess_of_task(settled: SettledPart, is_switched: bool) -> _TaskExcess:
    """Tracking numbers of a task divided by their limits, except command reversals: it follows if none exceeds 1.

    ``is_switched`` is true for a valve without gradual openings. The numbers of ``settled`` may be arrays
    (runs,).
    """
    rests, share = np.asarray(settled.rests), np.asarray(settled.share)
    deviation: Floats = np.where(rests, settled.span, settled.worst) / largest_deviation(settled, is_switched)
    off = np.asarray(settled.error) / largest_error(settled, is_switched)
    if is_switched:
        # It swings about its reference by design: its mean error is to be less.
        beside = np.abs(settled.missing) / (LARGEST_MEAN_SWITCHED * settled.wanted)
        off = np.where(rests, np.maximum(off, beside), off)
    off = np.maximum(off, deviation)
    # A run that ends on its ramp has no settled part: every loop is behind there.
    off = np.where(settled.ends_on_ramp, 0.0, off)
    if is_switched:
        swings = np.where(settled.swing > np.abs(settled.missing), off, 0.0)
    else:
        swings = np.where(rests | (off > 1.0), np.asarray(settled.turns) / (SUSTAINED - 1), 0.0)
        # A joint that creeps has a range of its error, too, and is no loop that swings.
        is_swing = rests & (settled.swing > np.abs(settled.missing))
        swings = np.where(is_swing, np.maximum(swings, deviation), swings)
    is_counted = rests & (not is_switched)
    peak = np.where(is_counted, settled.peak / (LARGEST_PEAK * settled.wanted), 0.0)
    is_still = (share > LARGEST_SHARE) & (settled.moved <= SMALLEST_MOVE * settled.wanted)
    still = np.where(is_still, share / LARGEST_SHARE, 0.0)
    return _TaskExcess(off=off, swings=swings, peak=peak, still=still)


def failure_of_task(settled: SettledPart, turning: float, is_switched: bool) -> Failure | None:
    """Kind of failure of a task; None if the task follows.

    ``turning`` is the number of command reversals divided by its limit; ``is_switched`` is true for a valve without
    gradual openings.
    """
    off, swings, peak, still = (float(number) for number in excess_of_task(settled, is_switched))
    if still > 1.0:
        return "does not move"
    if turning > 1.0 or swings > 1.0:
        return "oscillates"
    return "does not follow" if off > 1.0 else "overshoots" if peak > 1.0 else None


def torque_limit(settings: Mapping[str, float]) -> float:
    """Largest torque [N m] that the controller of a walk requests; 0 for no limit."""
    return float(settings.get("largest_torque", 0.0))
