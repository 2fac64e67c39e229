"""Tracking rule: judged parts of a run, what an actuator can give, numbers over their limits, and the kind of failure.

The reference of a task is cut into slow stretches and moves (``metrics.settled``), and judged are the last one and the
worst of the earlier ones; in a walk, all samples with a requested torque. Parts are records of a recording, or made of
the metrics of runs without one. "SI" is the SI unit of the controlled quantity.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.control.catalog import PROFILES
from ppafo.control.kind import ControllerKind
from ppafo.engine.in_python import over_samples
from ppafo.engine.recorded_samples import RunningEvaluation, evaluate_samples
from ppafo.engine.scheme.actuators import torque_of
from ppafo.metrics.command import requested_samples
from ppafo.metrics.metric import Floats, Readings, controlled_in, extent, followed, hold_start
from ppafo.metrics.settled import (
    IN_PUSH_OFF,
    LARGEST_SHARE,
    LARGEST_SHARE_OF_WAVE,
    MOST_REVERSALS,
    PART_SUMS,
    SETTLED,
    SETTLED_METRICS,
    WALK_PEAKS,
    PartLimits,
    PartSums,
    RecordedSettled,
    SettledPart,
    error_and_oscillation,
    gradual_limits,
    numbers_of,
    sample_ahead,
    start_settled,
    update_recorded,
)
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, Swing, reversals
from ppafo.model.catalog import ACTUATORS
from ppafo.model.columns import first
from ppafo.model.controlled import ANGLE, CONTROLLED, TORQUE
from ppafo.model.helping import PUSH_OFF
from ppafo.parameters.plant import plant_parameters
from ppafo.parameters.reach import reaching_pressures, torque_reach
from ppafo.signals import Recording
from ppafo.signals.meter import (
    SAME_LEVEL,
    ReferenceSummary,
    Sample,
    start_up_of,
)
from ppafo.simulation.clock import TIMES
from ppafo.simulation.ensemble.planning import columns_in_range
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.profiles import limits_of, profile_bounds, profile_parameters, profile_values
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
"""Peak torque of a walk divided by the torque limit of its controller, or by the largest requested torque [-]."""
LEAST_PEAK_WALK = 0.7
"""Largest torque of a walk in plantarflexion divided by the largest requested one; with less it does not follow [-]."""
# Command reversals per stride and per second above which a loop oscillates.
MOST_PER_STRIDE = 12.0
MOST_PER_SECOND = 10.0
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
ON_PURPOSE = "beyond_reach_on_purpose"
"""Name of the state of a run that misses its reference for the reason alone that its scenario gives."""
_ANGLES = 9
"""Number of angles between the stops at which the torque of a moving joint is evaluated."""
_LEAST_REACH = 1.0e-9
"""Torque within reach that is judged at least [N m]: an actuator without a supply gives none."""
_PHASES = np.sin(np.linspace(0.0, 2.0 * math.pi, 32, endpoint=False))[:, None]
"""Course of a moving reference about its mean, divided by its amplitude [-]."""
_OF_WALK = ("torque_error", "requested_torque", "peak_torque", *WALK_PEAKS)
"""Metrics by which a walk is judged, in addition to the reversals of its command."""
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
    "excess peak torque",
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
SMALLEST_CHANGE = 0.05
"""Smallest wanted change divided by the range of the controlled quantity [-]; smaller ones are judged as this one."""
SMALLEST_SIZE = 5.0e-4
"""Smallest wanted change if the range is 0, in typical sizes of the quantity (``ControlledQuantity.size``)."""
_NO_RETURN = 1.0e-9
"""Share of a reference's path that leads back, up to which it is a ramp [-]."""
_LONG_RAMP = 0.5
"""Share of the way of a reference from which its last part, in one direction, is a ramp that does not end [-]."""

_OF_RECORDING = RunningEvaluation(
    RecordedSettled,
    Sample,
    ("number", "value", "reference", "angular_velocity", "command"),
    sample_ahead,
    update_recorded,
)
"""Settled meter of a recording, which reads no other channel."""


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


def task_parts(scenario: Scenario, recording: Recording) -> list[SettledPart]:
    """Judged parts of a task's reference, the last one first, measured from a recording.

    They are those of a run without recording: its settled meter is fed with the recorded samples.
    """
    reference, value = followed(recording)
    time = recording.time
    count = len(recording)
    duration = float(time[-1] - time[0])
    interval = duration / (count - 1)
    largest = extent(recording)
    start = hold_start(recording)
    profile = PROFILES[scenario.reference.kind]
    choice = scenario.reference
    of_one = replace(choice, settings={name: first(setting) for name, setting in choice.settings.items()})
    period = None if profile.period is None else profile.period(profile_parameters(of_one))
    # The summary of the reference that a run without recording has at its end.
    course = ReferenceSummary(
        last=float(reference[-1]),
        largest=largest,
        tolerance=SAME_LEVEL * largest,
        hold_start=float(count - 1 if start is None else start),
        samples=float(count),
        # A value meets a repeated reference in this time.
        start_up=0.0 if period is None else start_up_of(period, duration, profile.is_wave) / interval,
        interval=interval,
        of_joint=0.0 if scenario.controlled == ANGLE else 1.0,
        previous=float(reference[0]),
    )
    columns = {"number": np.arange(float(time.size)), "value": value, "reference": reference}
    columns |= {name: recording[name] for name in _OF_RECORDING.channels[3:]}
    is_cut = float(not profile.is_wave)
    sums = evaluate_samples(
        _OF_RECORDING, lambda sample: RecordedSettled(course, start_settled(course, sample), is_cut), columns
    ).sums
    readings = Readings({SETTLED.name: sums}, course, np.asarray(course.interval), len(recording), {})
    numbers = {name: np.asarray(kind.read(readings)) for name, kind in SETTLED_METRICS.items()}
    found = []
    for part, of in zip(
        settled_parts(scenario, numbers, smallest_change(scenario)), (sums.part, sums.before, sums.worst), strict=True
    ):
        since = int(of.since)
        end = int(of.end)
        is_last = of is sums.part
        single = SettledPart._make(each.item() if isinstance(each, np.ndarray | np.generic) else each for each in part)
        found.append(
            single._replace(
                first=of.since,
                last=of.end,
                start=float(time[since]),
                end=0.0 if is_last else float(time[end]),
                duration=float(time[end] - time[since]),
                command_reversal_rate=float(numbers["settled_reversals"]) if is_last else 0.0,
            )
        )
    return found


def settled_parts(scenario: Scenario, metrics: Mapping[str, Floats], least: float) -> list[SettledPart]:
    """Judged parts of the references of tasks: the last, the move before a last rest, and the worst of the others.

    ``metrics`` are ``SETTLED_METRICS`` by name; they may be arrays (runs,). ``least`` is the ``smallest_change``. The
    numbers of an earlier part that does not exist are nan. Times and rate of command reversals are not known.
    """
    lowest, highest = profile_bounds(scenario.reference)
    initial: Any = 0.0 if scenario.controlled == TORQUE else metrics["settled_begun"]
    change = metrics["settled_extent"]
    wanted = np.maximum(change, least)
    is_upwards = np.abs(highest - initial) >= np.abs(lowest - initial)
    peak = np.where(is_upwards, metrics["settled_top"] - initial, initial - metrics["settled_bottom"])
    is_at_peak = (np.abs(metrics["settled_final"] - initial) >= (1.0 - SAME_LEVEL) * change) & (change > 0.0)
    profile = PROFILES[scenario.reference.kind]
    is_angle = scenario.controlled == ANGLE
    angle_range = np.maximum(change, highest - lowest) if is_angle else 0.0
    common: dict[str, Any] = {
        "value_range": metrics["settled_highest"] - metrics["settled_lowest"],
        "peak": np.where(change >= wanted, peak, 0.0),
    }

    # Of a sine only: another reference may have a part of its period alone on purpose, such as the swing of a stride.
    frequency = scenario.reference.settings.get("frequency")

    def part(prefix: str) -> SettledPart:
        of: dict[str, Any] = {name: metrics[f"{prefix}_{name}"] for name in PART_SUMS}
        swings = {name: Swing(0.0, of[name], 0.0) for name in ("swing", "lag_swing")}
        path = of["path"]
        way = np.abs(of["last"] - of["first"])
        interval = metrics["settled_interval"]
        periods = math.inf if frequency is None else of["taken"] * interval * frequency
        # The error of a loop that lags reverses, too.
        turns = 0.0 if frequency is None else np.ceil(2.0 * periods)
        sums: Any = PartSums(**of | swings)
        numbers = over_samples(numbers_of, sums, change, interval, wanted, angle_range, float(profile.is_smooth), turns)
        found: SettledPart = numbers._replace(
            ends_on_ramp=(path > _LONG_RAMP * change) & (path - way <= _NO_RETURN * path) & is_at_peak,
            reference_mean=metrics["settled_begun"] + numbers.reference_mean,
            reference_periods=periods,
            **common,
        )
        return found

    parts = [part(prefix) for prefix in ("settled", "before", "worst")]
    if scenario.controlled != TORQUE:
        return parts
    # Any part may be beyond reach, not the worst alone; the end of a ramp that is not seen to settle is not judged.
    is_seen = np.asarray(parts[0].ends_on_ramp) == 0.0
    most_of_last = np.where(is_seen, metrics["settled_highest_reference"], -np.inf)
    least_of_last = np.where(is_seen, metrics["settled_lowest_reference"], np.inf)
    reach = available_torque(scenario)
    above = np.fmax(metrics["settled_highest_asked"], most_of_last) - reach[1]
    below = reach[0] - np.fmin(metrics["settled_lowest_asked"], least_of_last)
    beyond: Any = np.maximum(np.maximum(above, below), 0.0)
    return [part._replace(beyond_reach=beyond) for part in parts]


def smallest_change(scenario: Scenario) -> float:
    """Smallest wanted change that is judged, from the range of the controlled quantity [SI unit of that quantity]."""
    kind = CONTROLLED[scenario.controlled]
    device = scenario.device
    if kind.name == TORQUE:
        lowest, highest = torque_reach(device, 0.5 * (device.actuator.angle_min + device.actuator.angle_max))
    else:
        limits = limits_of(device, kind)
        lowest = float(limits.lowest)
        highest = float(limits.highest)
    # A torque or a difference of pressures goes from 0 to one end of its range.
    one_way = 0.5 if kind.name in (TORQUE, "pressure_difference") else 1.0
    return max(SMALLEST_CHANGE * one_way * abs(highest - lowest), SMALLEST_SIZE * kind.size)


def most_reversals(scenario: Scenario, duration: float | None = None) -> float:
    """Largest number of command reversals in ``duration`` [s] of a loop that does not oscillate.

    Infinite for a controller that may switch. The default duration is the duration of the run.
    """
    law = scenario.law
    stride_time = scenario.motion.stride_time
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


def is_noisy(scenario: Scenario) -> Any:
    """True, for each run if the noise varies (runs,), if sensor noise reverses the command of a task.

    Reversals then count in its settled part only.
    """
    noise = np.maximum(scenario.sensors.angle_noise, scenario.sensors.pressure_noise)
    return np.logical_and(scenario.follows_reference, noise > 0.0)


def excess_of_walk(settled: SettledPart, turning: Floats | float, limit: Floats | float) -> Any:
    """Worst ratio of a walk's tracking numbers to their limits [-]: up to 1 the walk follows its reference.

    ``turning`` is the number of command reversals divided by its limit; ``limit`` [N m] is the controller's torque
    limit, 0 for none. The numbers of ``settled`` may be arrays (runs,).
    """
    peak = settled.peak / np.where(np.asarray(limit) > 0.0, LARGEST_PEAK_WALK * limit, np.inf)
    lacking = LEAST_PEAK_WALK * settled.requested_peak / np.maximum(settled.given_peak, 1.0e-9)
    excess = settled.given_peak / (LARGEST_PEAK_WALK * np.maximum(settled.requested_peak, _TINY))
    # Of a walk that requests dorsiflexion alone there is no peak to exceed.
    excess = np.where(np.asarray(settled.requested_peak) > 0.0, excess, 0.0)
    error = settled.rms_error / settled.wanted_change / LARGEST_SHARE_OF_WAVE
    return np.maximum.reduce(np.broadcast_arrays(turning, peak, error, lacking, excess))


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
    - ``reach``: torque of the reference beyond the actuator's reach
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
    mean = LARGEST_MEAN_SWITCHED * at_rest
    span = LARGEST_SPAN_SWITCHED * at_rest
    return PartLimits(LARGEST_SHARE_SWITCHED * wanted, mean, span, np.full_like(at_rest, np.inf))  # type: ignore[arg-type]


def excess_of_part(settled: SettledPart, is_switched: bool) -> _TaskExcess:
    """Tracking numbers of a part of a task divided by their limits, except command reversals: up to 1 it follows.

    ``is_switched`` is true for a valve without gradual openings. The numbers of ``settled`` may be arrays (runs,).
    """
    wanted = settled.wanted_change
    mean_error = np.abs(settled.mean_error)
    motion = np.asarray(settled.motion)
    error, oscillation = over_samples(error_and_oscillation, settled, part_limits(settled, is_switched))
    overshoot = (settled.peak / wanted - 1.0) / (LARGEST_PEAK - 1.0) * (1.0 - motion)
    if is_switched:
        # A limit cycle beside the reference has a large mean error, and reverses.
        swings = (settled.error_deviation > mean_error) | (np.asarray(settled.error_reversals) > MOST_REVERSALS)
        oscillation = np.where(swings, error, 0.0)
        overshoot = np.zeros_like(motion)
    share = np.asarray(settled.rms_error / wanted)
    is_still = (share > LARGEST_SHARE) & (settled.value_range <= SMALLEST_MOVE * wanted)
    standstill = np.where(is_still, share / LARGEST_SHARE, 0.0)
    # The wider limits of a pair, and the mean error of a wave with its peaks cut, hide a torque beyond reach.
    reach = settled.beyond_reach / (LARGEST_SHARE * wanted)
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


def available_torque(scenario: Scenario) -> tuple[Floats, Floats]:
    """Lowest and highest torque of the actuator [N m] in each run (runs,).

    One chamber is at its supply and the other vented, independent of the controller. For a moving joint the angle with
    the largest torque counts.
    """
    device = scenario.device
    actuator = device.actuator
    locked = scenario.motion.locked_angle
    fractions = (0.0,) if locked is not None else np.linspace(0.0, 1.0, _ANGLES).tolist()
    first, travel = (actuator.angle_min, actuator.angle_max - actuator.angle_min) if locked is None else (locked, 0.0)
    model = ACTUATORS[actuator.kind].model
    plant = plant_parameters(device)
    at_lowest, at_highest = reaching_pressures(device)
    angles = [first + fraction * travel for fraction in fractions]
    highest = [torque_of(model, plant, angle, *at_highest) for angle in angles]
    lowest = [torque_of(model, plant, angle, *at_lowest) for angle in angles]
    return np.min(lowest, axis=0), np.max(highest, axis=0)


def misses_for_reach(scenario: Scenario, parts: Sequence[SettledPart], turning: Floats | float) -> NDArray[np.bool_]:
    """True for each run (runs,) that reach alone keeps from its reference: it gives what the actuator can give.

    ``parts`` are the judged parts, ``turning`` is the number of command reversals divided by its limit.
    """
    is_lacking = parts[0].beyond_reach > 0.0
    if not np.any(is_lacking):
        return np.asarray(is_lacking)
    reach = available_torque(scenario)
    switches = only_switches(scenario, scenario.law)
    found = np.fmax.reduce([excess_of_part(_within_reach(part, *reach), switches).largest for part in parts])
    return np.asarray(is_lacking & (np.fmax(found, turning) <= 1.0))


def _within_reach(part: SettledPart, lowest: Floats, highest: Floats) -> SettledPart:
    """Judged part with the errors that are left of a reference cut at the lowest and highest torque [N m].

    A moving reference is taken for a wave of the same mean and deviation.
    """
    reference = part.reference_mean + math.sqrt(2.0) * np.asarray(part.reference_deviation) * _PHASES
    cut = np.clip(reference, lowest, highest)
    beyond = reference - cut
    mean = part.mean_error + beyond.mean(axis=0)
    deviation = np.maximum(part.error_deviation - beyond.std(axis=0), 0.0)
    farthest = np.abs(beyond).max(axis=0)
    left: dict[str, Any] = part._asdict() | {
        "wanted_change": np.minimum(part.wanted_change, np.maximum(np.maximum(highest, -lowest), _LEAST_REACH)),
        "rms_error": np.hypot(mean, deviation),
        "mean_error": mean,
        "error_deviation": deviation,
        "error_range": np.maximum(part.error_range - np.ptp(beyond, axis=0), 0.0),
        "largest_error": np.maximum(part.largest_error - farthest, 0.0),
        # The error of a wave whose peaks are cut reverses more often than the wave.
        "beyond_reach": 0.0,
        "error_reversals": np.where((np.asarray(part.rests) > 0.0) | (farthest == 0.0), part.error_reversals, 0.0),
        "reference_deviation": cut.std(axis=0),
    }
    return SettledPart._make(np.broadcast_arrays(*left.values()))


def needed_metrics(scenario: Scenario) -> tuple[str, ...]:
    """Names of the metrics by which runs of a scenario without recording are judged; none without a reference."""
    if scenario.controller.is_open_loop:
        return ()
    return (*(SETTLED_METRICS if scenario.follows_reference else _OF_WALK), REVERSALS)


def command_turning(scenario: Scenario, metrics: Mapping[str, Floats], most_reversals: float) -> Floats:
    """Command reversals of each run divided by their limit (runs,): above 1 the loop oscillates; 0 if unknown.

    Under sensor noise the reversals in the settled part count, if known. Arguments as in
    ``tracking_excess``.
    """
    turning = np.nan_to_num(metrics.get(REVERSALS, np.zeros(next(iter(metrics.values())).size))) / most_reversals
    if "settled_reversals" not in metrics:
        return turning
    often = most_reversals / np.maximum(scenario.run.duration, 1.0)
    return np.where(is_noisy(scenario), np.nan_to_num(metrics["settled_reversals"]) / often, turning)


class TrackingExcess(NamedTuple):
    """Numbers of each run divided by their limits (runs,); nan if unknown.

    With ``largest`` up to 1 the run follows its reference, with ``oscillation`` up to 1 its loop does not oscillate.
    ``beyond_reach`` [N m] is the torque of the reference that the actuator cannot give, which the limits allow in part.
    A run that misses its reference for that alone, as its scenario announces, is ``on_purpose``: it does not follow.
    ``turns_often`` is true where the command alone turns too often.
    """

    largest: Floats
    oscillation: Floats
    beyond_reach: Floats
    on_purpose: NDArray[np.bool_]
    turns_often: NDArray[np.bool_]

    @property
    def follows(self) -> Floats:
        """1 for each run (runs,) that follows its reference, 0 for the others, nan if unknown."""
        return np.where(np.isnan(self.largest), np.nan, self.largest <= 1.0)

    @property
    def oscillates(self) -> Floats:
        """1 for each run (runs,) whose loop oscillates, 0 for the others, nan if unknown."""
        return np.where(np.isnan(self.oscillation), np.nan, self.oscillation > 1.0)


def tracking_excess(base: Scenario, columns: Mapping[str, Floats], metrics: Mapping[str, Floats]) -> TrackingExcess:
    """Numbers of each run of an ensemble by which its tracking is judged, divided by their limits.

    Arguments:
        base: scenario of the ensemble
        columns: varied numbers [SI] by path, each (runs,)
        metrics: the available ``needed_metrics`` of the runs, each (runs,)
    """
    in_range = columns_in_range(base, columns)
    scenario = with_numbers(base, {path: column for path, column in in_range.items() if path not in TIMES})
    most: Any = most_reversals(base)
    if (durations := in_range.get("run.duration")) is not None:
        scenario = replace(scenario, run=replace(scenario.run, duration=durations))  # type: ignore[arg-type]
        most = np.array([most_reversals(base, float(duration)) for duration in durations])
    none = np.full(next(iter(metrics.values())).size, np.nan)
    turning = command_turning(scenario, metrics, most)
    counted = np.isfinite(metrics.get(REVERSALS, none)) & np.isfinite(most)
    numbers = {name: metrics.get(name, none) for name in needed_metrics(scenario)}
    with np.errstate(divide="ignore", invalid="ignore"):
        if not scenario.follows_reference:
            error, requested, peak = (numbers[name] for name in _OF_WALK[:3])
            limit = np.asarray(scenario.controller.settings.get("largest_torque", 0.0))
            of_walk: dict[str, Any] = {
                "wanted_change": np.nan_to_num(requested, nan=np.inf),
                "rms_error": np.nan_to_num(error),
                "peak": peak,
                "requested_peak": np.nan_to_num(numbers["requested_peak"]),
                "given_peak": np.nan_to_num(numbers["given_peak"]),
            }
            asks = np.isfinite(error)
            if not np.any(asks):
                highest = np.minimum(limit, available_torque(scenario)[1])
                of_walk |= {"requested_peak": highest, "given_peak": np.nan_to_num(numbers["push_off_peak"])}
            settled = SettledPart(**of_walk)
            # A law that requests no torque is judged by the peak alone.
            excess = excess_of_walk(settled, turning, limit)
            known = (asks & (requested > 0.0)) | (~asks & np.isfinite(peak) & (limit > 0.0))
            known_turning = np.where(counted | known, turning, np.nan)
            zeros = np.zeros(none.size)
            return TrackingExcess(np.where(known, excess, np.nan), known_turning, zeros, zeros > 0.0, turning > 1.0)
        parts = settled_parts(scenario, numbers, smallest_change(base))
        is_switched = only_switches(scenario, scenario.law)
        found = [excess_of_part(part, is_switched) for part in parts]
        explained = bool(scenario.beyond_reach) & misses_for_reach(scenario, parts, turning)
    known = np.isfinite(numbers["settled_error"])
    # Without an earlier part its numbers are nan.
    largest = np.fmax.reduce([turning, *(part.largest for part in found)])
    known_verdict = known & ~(parts[0].is_undecided & (largest <= 1.0))
    # A value that does not move is no oscillation, however far it is from the reference, and a cut wave is none either.
    swings = (np.where((each.standstill > 1.0) | (each.reach > 1.0), 0.0, each.oscillation) for each in found)
    return TrackingExcess(
        largest=np.where(known_verdict, largest, np.nan),
        oscillation=np.where(counted | known, np.fmax.reduce([turning, *swings]), np.nan),
        beyond_reach=parts[0].beyond_reach + np.zeros(none.size),
        on_purpose=(largest > 1.0) & explained,
        turns_often=turning > 1.0,
    )
