"""Judged parts of a run: record of the numbers of one, measured from a recording or taken from metrics.

The reference of a task is cut into slow stretches and moves (``metrics.settled``), and judged are the last one and the
worst of the earlier ones. In a walk, the judged part is all samples with a requested torque.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.control.catalog import PROFILES
from ppafo.engine.in_python import over_samples
from ppafo.engine.recorded_samples import RunningEvaluation, evaluate_samples
from ppafo.metrics.command import requested_samples
from ppafo.metrics.metric import Floats, Readings, controlled_in, extent, followed, hold_start, reference_of
from ppafo.metrics.settled import (
    LARGEST_LAG,
    SETTLED,
    SETTLED_METRICS,
    SUSTAINED,
    RecordedSettled,
    sample_ahead,
    start_settled,
    update_recorded,
    weight_of,
)
from ppafo.model.columns import first
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE
from ppafo.model.helping import PUSH_OFF
from ppafo.parameters.reach import torque_reach
from ppafo.signals import Recording
from ppafo.signals.meter import (
    SAME_LEVEL,
    ReferenceSummary,
    Sample,
    start_up_of,
)
from ppafo.simulation.profiles import limits_of, profile_bounds, profile_parameters
from ppafo.simulation.scenario import Scenario

FEWEST_PERIODS = 0.5
"""Periods of a reference in the settled part, below which the part may hold no peak of the reference [-]."""
SMALLEST_CHANGE = 0.05
"""Smallest wanted change divided by the range of the controlled quantity [-]; smaller ones are judged as this one."""
SMALLEST_SIZE = 5.0e-4
"""Smallest wanted change if the range is 0, in typical sizes of the quantity (``ControlledQuantity.size``)."""
_NO_RETURN = 1.0e-9
"""Share of a reference's path that leads back, up to which it is a ramp [-]."""
_LONG_RAMP = 0.5
"""Share of the way of a reference from which its last part, in one direction, is a ramp that does not end [-]."""
_TINY = 1.0e-300
"""Divisor in place of 0."""

_OF_RECORDING = RunningEvaluation(
    RecordedSettled,
    Sample,
    ("number", "value", "reference", "angular_velocity", "command"),
    sample_ahead,
    update_recorded,
)
"""Settled meter of a recording, which reads no other channel."""

WHERE_REQUESTED, IN_PUSH_OFF = -1.0, -2.0
"""In place of the start of a judged part, for a walk."""


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
    """True if the reference stands still."""
    motion: float = 0.0
    """Motion of reference and joint [-]: 0 at rest, 1 where the limits of a moving reference hold."""
    lag: float = 0.0
    """RMS of the error that motion allows beside the one at rest [SI]."""
    mean_lag: float = 0.0
    """Mean of the error that motion allows beside the one at rest [SI]."""
    weight: float = 1.0
    """Weight of the error [-]: 1, and less for a quick ramp, on which every loop is behind."""
    way: float = math.inf
    """Path of a moving reference in the part, or its largest value if that is more; inf at rest [SI]."""
    ends_on_ramp: bool = False
    """True for a move in one direction to the largest reference, which the run does not see settle."""
    reference_range: float = 0.0
    """Range of initial value and reference for an angle [rad]; 0 for other quantities."""
    reference_mean: float = 0.0
    """Mean of the reference [SI]; 0 for a walk."""
    reference_deviation: float = 0.0
    """Standard deviation of the reference [SI]."""
    reference_periods: float = math.inf
    """Number of periods of a sine in the part; infinite for another reference."""
    is_reference_smooth: bool = False
    """True for a reference without steps and corners."""
    start: float = WHERE_REQUESTED
    """Start of the judged samples of the last part, or of an earlier part [s]; below 0 for a walk."""
    end: float = 0.0
    """End of an earlier part [s]; 0 for the last one."""
    duration: float = 0.0
    """Length of the part [s]; in a walk, the duration of the recording."""
    command_reversal_rate: float = 0.0
    """Rate of command reversals in the part [1/s]."""

    @property
    def is_undecided(self) -> Any:
        """True if the part is no basis for the verdict that a run follows: it ends on a ramp, or may hold no peak."""
        moves = ~np.asarray(self.rests) & (np.asarray(self.reference_deviation) > 0.0)
        return np.asarray(self.ends_on_ramp) | (moves & (np.asarray(self.reference_periods) < FEWEST_PERIODS))


def settled_walk(recording: Recording, limit: float, available: float) -> SettledPart | None:
    """Settled part of a walk: the samples with a requested torque; None if none is requested.

    A controller that requests no torque but opens its valves up to a torque ``limit`` [N m], 0 for none, should give
    that in push-off, or what is ``available`` [N m].
    """
    torque = recording["torque"]
    peak = float(np.max(np.abs(torque)))
    if controlled_in(recording) is None:
        if limit <= 0.0:
            return None
        in_push_off = torque[recording["controller_phase"] == PUSH_OFF]
        return SettledPart(
            samples=slice(None),
            wanted_change=limit,
            peak=peak,
            requested_peak=min(limit, available),
            given_peak=float(np.max(in_push_off, initial=0.0)),
            start=IN_PUSH_OFF,
        )
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


def task_parts(scenario: Scenario, recording: Recording) -> tuple[SettledPart, SettledPart]:
    """Last part of a task's reference, and the worst of the earlier ones, measured from a recording.

    They are the two of a run without recording: its settled meter is fed with the recorded samples.
    """
    course, end = _course(scenario, recording), len(recording) - 1
    reference, value = followed(recording)
    columns = {"number": np.arange(end + 1.0), "value": value, "reference": reference}
    columns |= {name: recording[name] for name in _OF_RECORDING.channels[3:]}
    is_cut = float(not PROFILES[scenario.reference.kind].is_wave)
    state = evaluate_samples(
        _OF_RECORDING, lambda sample: RecordedSettled(course, start_settled(course, sample), is_cut), columns
    )
    sums, worst_end = state.sums, int(state.worst_end)
    readings = Readings({SETTLED.name: sums}, course, np.asarray(course.interval), len(recording), {})
    numbers = {name: np.asarray(kind.read(readings)) for name, kind in SETTLED_METRICS.items()}
    last_part, worst_part = map(_single, settled_parts(scenario, numbers, smallest_change(scenario)))
    samples, time = slice(end + 1 - int(sums.part.taken), None), recording.time
    start = float(time[samples.start])
    last_part = last_part._replace(
        samples=samples,
        start=start,
        duration=float(time[-1] - start),
        command_reversal_rate=float(numbers["settled_reversals"]),
    )
    if worst_end:
        judged = slice(worst_end + 1 - int(sums.worst.taken), worst_end + 1)
        begins, first_judged, until = (float(time[each]) for each in (int(sums.worst.start), judged.start, worst_end))
        worst_part = worst_part._replace(samples=judged, start=begins, end=until, duration=until - first_judged)
    return last_part, worst_part


def _single(part: SettledPart) -> SettledPart:
    """Numbers of a part as floats, from arrays of one number."""
    return SettledPart._make(each.item() if isinstance(each, np.ndarray | np.generic) else each for each in part)


def _course(scenario: Scenario, recording: Recording) -> ReferenceSummary:
    """Summary of a recorded reference, as a run without recording has it at its end."""
    reference, count = reference_of(recording), len(recording)
    duration = float(recording.time[-1] - recording.time[0])
    interval = duration / (count - 1)
    largest, start = extent(recording), hold_start(recording)
    return ReferenceSummary(
        last=float(reference[-1]),
        largest=largest,
        tolerance=SAME_LEVEL * largest,
        hold_start=float(count - 1 if start is None else start),
        samples=float(count),
        start_up=_start_up(scenario, duration) / interval,
        interval=interval,
        of_joint=0.0 if scenario.controlled == ANGLE else 1.0,
        previous=float(reference[0]),
    )


def _start_up(scenario: Scenario, duration: float) -> float:
    """Time for a value to meet a repeated reference [s], 0 for another; of several runs that of the first."""
    profile, choice = PROFILES[scenario.reference.kind], scenario.reference
    single = replace(choice, settings={name: first(setting) for name, setting in choice.settings.items()})
    period = None if profile.period is None else profile.period(profile_parameters(single))
    return 0.0 if period is None else start_up_of(period, duration, profile.is_wave)


def settled_parts(scenario: Scenario, metrics: Mapping[str, Floats], least: float) -> tuple[SettledPart, SettledPart]:
    """Last part of the references of tasks, and the worst of the earlier ones, from ``SETTLED_METRICS`` by name.

    The numbers may be arrays (runs,); ``least`` is the ``smallest_change``. Those of an earlier part that does not
    exist are nan. Times and rate of command reversals are not known.
    """
    lowest, highest = profile_bounds(scenario.reference)
    initial: Any = 0.0 if scenario.controlled == TORQUE else metrics["settled_begun"]
    change = metrics["settled_extent"]
    wanted = np.maximum(change, least)
    is_upwards = np.abs(highest - initial) >= np.abs(lowest - initial)
    peak = np.where(is_upwards, metrics["settled_top"] - initial, initial - metrics["settled_bottom"])
    is_at_peak = (np.abs(metrics["settled_last"] - initial) >= (1.0 - SAME_LEVEL) * change) & (change > 0.0)
    profile, is_angle = PROFILES[scenario.reference.kind], scenario.controlled == ANGLE
    common: dict[str, Any] = {
        "wanted_change": wanted,
        "value_range": metrics["settled_highest"] - metrics["settled_lowest"],
        "peak": np.where(change >= wanted, peak, 0.0),
        "reference_range": np.maximum(change, highest - lowest) if is_angle else 0.0,
        "is_reference_smooth": profile.is_smooth,
    }

    # Of a sine only: another reference may have a part of its period alone on purpose, such as the swing of a stride.
    frequency = scenario.reference.settings.get("frequency")

    def part(prefix: str) -> SettledPart:
        of = {name.removeprefix(f"{prefix}_"): number for name, number in metrics.items() if name.startswith(prefix)}
        rms, mean, turns, rests = of["error"], of["missing"], of["turns"], of["rests"] > 0.0
        time = of["taken"] * metrics["settled_interval"]
        periods = math.inf if frequency is None else time * frequency
        # The error of a loop that lags reverses, too.
        of_lag = np.maximum(of["lag_turns"], 0.0 if frequency is None else np.ceil(2.0 * periods))
        turns = turns - np.where(rests, 0.0, of_lag)
        motion, way = np.minimum(of["lag"] / (LARGEST_LAG * np.maximum(change, _TINY)), 1.0), np.abs(of["way"])
        is_ramp = (of["path"] > _LONG_RAMP * change) & (of["path"] - way <= _NO_RETURN * of["path"])
        weight = over_samples(weight_of, of["rests"], of["path"], way, time, change)
        numbers: dict[str, Any] = {
            "rms_error": rms,
            "mean_error": mean,
            "error_deviation": np.sqrt(np.maximum(rms**2 - mean**2, 0.0)),
            "error_range": of["span"],
            "largest_error": of["largest"],
            "error_reversals": np.where(turns >= SUSTAINED, turns, 0.0),
            "rests": rests,
            "motion": motion,
            "lag": of["lag"],
            "mean_lag": of["mean_lag"],
            "weight": weight,
            "way": np.where(rests, np.inf, np.maximum(of["path"], change)),
            "ends_on_ramp": is_ramp & is_at_peak,
            "reference_mean": metrics["settled_begun"] + of["reference"],
            "reference_deviation": np.where(rests, 0.0, of["wave"]),
            "reference_periods": periods,
        }
        return SettledPart(samples=slice(None), **numbers, **common)

    return part("settled"), part("worst")


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
