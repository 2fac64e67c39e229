"""Judged parts of a run: record of the numbers of one, measured from a recording or taken from metrics.

The reference of a task is cut into slow stretches and moves (``metrics.settled``), and judged are the last one and the
worst of the earlier ones. In a walk, the judged part is all samples with a requested torque.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.control.catalog import PROFILES
from ppafo.engine.in_python import over_samples
from ppafo.engine.recorded_samples import RunningEvaluation, evaluate_samples
from ppafo.metrics.command import requested_samples
from ppafo.metrics.metric import Floats, Readings, controlled_in, extent, followed, hold_start, reference_of
from ppafo.metrics.settled import (
    IN_PUSH_OFF,
    PART_SUMS,
    SETTLED,
    SETTLED_METRICS,
    PartSums,
    RecordedSettled,
    SettledPart,
    numbers_of,
    sample_ahead,
    start_settled,
    update_recorded,
)
from ppafo.metrics.switching import Swing
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
    course, time = _course(scenario, recording), recording.time
    reference, value = followed(recording)
    columns = {"number": np.arange(float(time.size)), "value": value, "reference": reference}
    columns |= {name: recording[name] for name in _OF_RECORDING.channels[3:]}
    is_cut = float(not PROFILES[scenario.reference.kind].is_wave)
    sums = evaluate_samples(
        _OF_RECORDING, lambda sample: RecordedSettled(course, start_settled(course, sample), is_cut), columns
    ).sums
    readings = Readings({SETTLED.name: sums}, course, np.asarray(course.interval), len(recording), {})
    numbers = {name: np.asarray(kind.read(readings)) for name, kind in SETTLED_METRICS.items()}
    found = []
    for part, of in zip(
        settled_parts(scenario, numbers, smallest_change(scenario)), (sums.part, sums.before, sums.worst), strict=True
    ):
        start, since, end = int(of.start), int(of.since), int(of.end)
        is_last = of is sums.part
        single = SettledPart._make(each.item() if isinstance(each, np.ndarray | np.generic) else each for each in part)
        found.append(
            single._replace(
                first=of.since,
                last=of.end,
                start=float(time[since if is_last else start]),
                end=0.0 if is_last else float(time[end]),
                duration=float(time[end] - time[since]),
                command_reversal_rate=float(numbers["settled_reversals"]) if is_last else 0.0,
            )
        )
    return found


def _course(scenario: Scenario, recording: Recording) -> ReferenceSummary:
    """Summary of a recorded reference, as a run without recording has it at its end."""
    reference, count = reference_of(recording), len(recording)
    duration = float(recording.time[-1] - recording.time[0])
    interval = duration / (count - 1)
    largest, start = extent(recording), hold_start(recording)
    profile, choice = PROFILES[scenario.reference.kind], scenario.reference
    single = replace(choice, settings={name: first(setting) for name, setting in choice.settings.items()})
    period = None if profile.period is None else profile.period(profile_parameters(single))
    return ReferenceSummary(
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
    profile, is_angle = PROFILES[scenario.reference.kind], scenario.controlled == ANGLE
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
        path, way = of["path"], np.abs(of["last"] - of["first"])
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

    return [part(prefix) for prefix in ("settled", "before", "worst")]


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
