"""Settled part of a run: record of its numbers, measured from a recording or taken from metrics.

The settled part is the second half of the hold, or of the run if the reference never rests. In a walk, the settled part
is all samples with a requested torque.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.control.catalog import PROFILES
from ppafo.metrics.command import command_reversals, requested_samples
from ppafo.metrics.metric import Floats, controlled_in, extent, followed, hold_start
from ppafo.metrics.settled import SHORTEST_HOLD, is_long_enough
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, reversals
from ppafo.metrics.tracking import SUSTAINED
from ppafo.model.columns import first
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE
from ppafo.parameters.reach import torque_reach
from ppafo.signals import Recording
from ppafo.simulation.profiles import limits_of, profile_bounds, profile_parameters, profile_values
from ppafo.simulation.scenario import Scenario

FEWEST_PERIODS = 0.5
"""Periods of a reference in the settled part, below which the part may hold no peak of the reference [-]."""
SMALLEST_CHANGE = 0.05
"""Smallest wanted change divided by the range of the controlled quantity [-]; smaller ones are judged as this one."""
SMALLEST_SIZE = 5.0e-4
"""Smallest wanted change if the range is 0, in typical sizes of the quantity (``ControlledQuantity.size``)."""
MOVED_JOINT = 0.01
"""Travel of a joint in the settled part above which it disturbs the loop of a torque or a pressure [rad]."""


class SettledPart(NamedTuple):
    """Numbers of the settled part of a run, or arrays (runs,) of such numbers without recordings.

    "SI" is the SI unit of the controlled quantity. The error is the value minus the reference.
    """

    samples: slice | NDArray[np.bool_]
    """Samples of the settled part in the recording; all samples if there is no recording."""
    wanted_change: float
    """Largest reference relative to the initial value, or to 0 for a torque; in a walk the RMS of the request [SI]."""
    rms_error: float = 0.0
    """RMS error [SI]."""
    mean_error: float = 0.0
    """Mean error [SI]."""
    error_deviation: float = 0.0
    """Standard deviation of the error [SI]."""
    error_range: float = 0.0
    """Largest minus smallest error [SI]."""
    largest_error: float = 0.0
    """Largest absolute error [SI]."""
    error_reversals: float = 0.0
    """Number of reversals of the error beyond those of a lag behind a moving reference; 0 below ``SUSTAINED``."""
    value_range: float = 0.0
    """Range of the controlled quantity over the whole run [SI]."""
    peak: float = 0.0
    """Largest change in the direction of the reference; 0 for a wanted change below the smallest one [SI].

    In a walk: largest absolute torque [N m].
    """
    requested_peak: float = 0.0
    """Largest torque in plantarflexion that a walk requests [N m]; 0 for a task."""
    given_peak: float = 0.0
    """Largest torque in plantarflexion that the actuator of a walk gives [N m]; 0 for a task."""
    rests: bool = False
    """True if reference and joint stand still."""
    ends_on_ramp: bool = False
    """True if the run ends before a monotone reference rests."""
    reference_range: float = 0.0
    """Range of initial value and reference for an angle [rad]; 0 for other quantities."""
    reference_deviation: float = 0.0
    """Standard deviation of the reference [SI]."""
    reference_periods: float = math.inf
    """Number of periods of a sine in the part; infinite for another reference."""
    is_reference_smooth: bool = False
    """True for a reference without steps and corners."""
    start: float = 0.0
    """Start of the part [s]; 0 for a walk."""
    duration: float = 0.0
    """Length of the part [s]; in a walk, the duration of the recording."""
    command_reversal_rate: float = 0.0
    """Rate of command reversals in the last half of the part [1/s]."""

    @property
    def is_undecided(self) -> Any:
        """True if the part is no basis for the verdict that a run follows: it ends on a ramp, or may hold no peak."""
        moves = ~np.asarray(self.rests) & (np.asarray(self.reference_deviation) > 0.0)
        return np.asarray(self.ends_on_ramp) | (moves & (np.asarray(self.reference_periods) < FEWEST_PERIODS))


def settled_walk(recording: Recording, limit: float) -> SettledPart | None:
    """Settled part of a walk: the samples with a requested torque; None if none is requested.

    For a controller that requests no torque but opens its valves up to a torque ``limit`` [N m], only the peak is set;
    a ``limit`` of 0 means none.
    """
    peak = float(np.max(np.abs(recording["torque"])))
    if controlled_in(recording) is None:
        return SettledPart(samples=slice(None), wanted_change=limit, peak=peak) if limit > 0.0 else None
    requested = requested_samples(recording)
    reference, value = (series[requested] for series in followed(recording))
    wanted = float(np.sqrt(np.mean(reference**2))) if reference.size else 0.0
    if wanted == 0.0:
        return None
    error = value - reference
    rms = float(np.sqrt(np.mean(error**2)))
    return SettledPart(
        samples=requested,
        wanted_change=wanted,
        rms_error=rms,
        mean_error=float(np.mean(error)),
        error_deviation=rms,
        value_range=float(np.ptp(value)),
        peak=peak,
        requested_peak=max(float(np.max(reference)), 0.0),
        given_peak=max(float(np.max(recording["torque"])), 0.0),
        duration=float(np.ptp(recording.time[[0, -1]])),
    )


def settled_task(scenario: Scenario, recording: Recording) -> SettledPart:
    """Settled part of a task with a reference, measured from its recording."""
    reference, value = followed(recording)
    time, count = recording.time, len(recording)
    hold = hold_start(recording)
    period = PROFILES[scenario.reference.kind].period
    # A rest between repetitions is not what the task ends with.
    is_repeated = period is not None and period(profile_parameters(scenario.reference)) < time[-1] - time[0]
    has_hold = hold is not None and is_long_enough(hold, count) and not is_repeated
    first = hold if has_hold and hold is not None else 0
    samples, last_half = slice((first + count) // 2, None), slice((first + 3 * count) // 4, None)
    error, settled_reference, start = (value - reference)[samples], reference[samples], float(time[samples][0])
    duration = float(time[-1] - time[samples][0])
    change = extent(recording)
    wanted = max(change, smallest_change(scenario))
    # A joint that is moved disturbs the loop of a torque or a pressure all the time, as a moving reference does.
    is_angle = scenario.controlled == ANGLE
    rests = has_hold and (is_angle or float(np.ptp(recording["angle"][samples])) <= MOVED_JOINT)
    error_reversals = reversals(error, OSCILLATION_THRESHOLD * wanted)
    if not rests:
        error_reversals -= int(_reversals_of_lag(scenario, wanted))
    steps = np.diff(reference)
    is_monotone = bool(np.all(steps >= 0.0) or np.all(steps <= 0.0))
    return SettledPart(
        samples=samples,
        wanted_change=wanted,
        rms_error=float(np.sqrt(np.mean(error**2))),
        mean_error=float(np.mean(error)),
        error_deviation=float(np.std(error)),
        error_range=float(np.ptp(error)),
        largest_error=float(np.max(np.abs(error))),
        error_reversals=error_reversals if error_reversals >= SUSTAINED else 0,
        value_range=float(np.ptp(value)),
        peak=_peak(scenario, reference, value) if change >= wanted else 0.0,
        rests=rests,
        ends_on_ramp=not rests and hold is None and is_monotone,
        reference_range=max(change, float(np.ptp(reference))) if is_angle else 0.0,
        reference_deviation=float(np.std(settled_reference)),
        reference_periods=float(_settled_periods(scenario)),
        is_reference_smooth=PROFILES[scenario.reference.kind].is_smooth,
        start=start,
        duration=duration,
        # Noise that reverses the command until the joint rests is no oscillation: only the last half counts.
        command_reversal_rate=2.0 * command_reversals(recording, last_half) / max(duration, 1.0),
    )


def settled_tasks(scenario: Scenario, metrics: Mapping[str, Floats], least: float) -> SettledPart:
    """Settled parts of tasks without recording, as arrays (runs,), from ``SETTLED_METRICS`` by name.

    ``least`` is the ``smallest_change``. Start, duration and rate of command reversals are not known.
    """
    lowest, highest = profile_bounds(scenario.reference)
    initial: Any = 0.0 if scenario.controlled == TORQUE else metrics["settled_begun"]
    change = metrics["settled_extent"]
    wanted = np.maximum(change, least)
    is_upwards = np.abs(highest - initial) >= np.abs(lowest - initial)
    peak = np.where(is_upwards, metrics["settled_top"] - initial, initial - metrics["settled_bottom"])
    rms, mean, error_reversals = (metrics[f"settled_{name}"] for name in ("error", "missing", "turns"))
    is_angle, hold = scenario.controlled == ANGLE, metrics["settled_share_of_hold"]
    rests = (hold >= SHORTEST_HOLD) & (is_angle or (metrics["settled_angle_range"] <= MOVED_JOINT))
    if not np.all(rests):
        error_reversals = error_reversals - np.where(rests, 0.0, _reversals_of_lag(scenario, first(wanted)))
    profile = PROFILES[scenario.reference.kind]
    numbers: dict[str, Any] = {
        "wanted_change": wanted,
        "rms_error": rms,
        "mean_error": mean,
        "error_deviation": np.sqrt(np.maximum(rms**2 - mean**2, 0.0)),
        "error_range": metrics["settled_span"],
        "largest_error": metrics["settled_worst"],
        "error_reversals": np.where(error_reversals >= SUSTAINED, error_reversals, 0.0),
        "value_range": metrics["settled_highest"] - metrics["settled_lowest"],
        "peak": np.where(change >= wanted, peak, 0.0),
        "rests": rests,
        "ends_on_ramp": (hold <= 0.0) & profile.is_monotone,
        "reference_range": np.maximum(change, highest - lowest) if is_angle else 0.0,
        "reference_deviation": metrics["settled_wave"],
        "reference_periods": _settled_periods(scenario),
        "is_reference_smooth": profile.is_smooth,
    }
    return SettledPart(samples=slice(None), **numbers)


def _settled_periods(scenario: Scenario) -> Any:
    """Periods of a sine in the second half of a run [-], inf for another reference; an array (runs,) if it varies.

    A table may have a part of its period alone on purpose, such as the swing of a stride.
    """
    frequency = scenario.reference.settings.get("frequency")
    return math.inf if frequency is None else 0.5 * np.asarray(scenario.run.duration) * frequency


def _reversals_of_lag(scenario: Scenario, wanted: float) -> Any:
    """Reversals of the error of a loop that lags, in the second half of a run: of the reference, or of its rate.

    Twice a period of a sine, an array (runs,) if it varies; of another reference those of the first run hold for all.
    """
    periods = _settled_periods(scenario)
    if np.isfinite(periods).all():
        return np.ceil(2.0 * periods)
    choice, duration = scenario.reference, float(first(scenario.run.duration))
    single = replace(choice, settings={name: first(setting) for name, setting in choice.settings.items()})
    times = np.arange(0.5 * duration, duration, float(first(scenario.run.output_interval)))
    values, rate, _ = profile_values(single, times)
    of_rate = reversals(rate, OSCILLATION_THRESHOLD * float(np.max(np.abs(rate))))
    return max(reversals(values, OSCILLATION_THRESHOLD * wanted), of_rate)


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
