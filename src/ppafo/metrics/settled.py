"""Parts of a reference, slow stretches and moves, in a run without recording: numbers for the tracking verdict.

A stretch is straight, slow and no shorter than a tenth of a second; a sine is one move. Judged are the second half of
each stretch and the whole of each move; of a move at the start of a run, what follows once the value has met the
reference; of a reference that repeats, what follows a start-up. The error that is allowed at a sample is the same in
both. The last part and the worst of the earlier ones are kept. These numbers are for verdicts only: no table and no
study lists them.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ppafo.metrics.command import Reversals, is_torque_requested, start_reversals, update_reversals
from ppafo.metrics.metric import Floats, MetricKind, ReadAt, Readings, less, mean_of, root_mean
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, UNDECIDED, Swing, count_of, next_swing
from ppafo.model.columns import Numeric, choose, larger
from ppafo.model.helping import PUSH_OFF
from ppafo.signals.meter import (
    REQUESTED,
    SLOW_RATE,
    WALK,
    MeterKind,
    ReferenceSummary,
    Sample,
    advance_part,
    deciding_sample,
)

LARGEST_SHARE = 0.05
"""RMS error at rest divided by the wanted change, above which a law with gradual openings does not follow [-]."""
LARGEST_LAG = 0.15
"""Further error divided by the wanted change that a moving reference, or a joint that is moved, allows at most [-]."""
LAG_TIME = 0.2
"""Lag behind a moving reference that is allowed beside the error at rest [s]."""
RETURNING = 20.0
"""Share of the error of a quick move that counts, divided by the share of its path that leads back [-]."""
LARGEST_EXCUSED = 1.1
"""Largest error divided by the path of the reference, or its largest value, that a quick ramp excuses [-]."""
LAG_OF_JOINT = 0.6
"""Lag that a moving joint allows, divided by its speed and the wanted change [s/rad]."""
LARGEST_ANGLE_SWING, LARGEST_SWING_SHARE = math.radians(1.0), 0.03
"""Largest range of the error of an angle at rest [rad], or divided by the way of the reference [-] if that is more."""
SUSTAINED = 4
"""Number of reversals on the hold from which a loop counts as oscillating; settling takes one or two."""
_TINY = 1.0e-300
"""Divisor in place of 0."""


class PartSums(NamedTuple):
    """Sums over the judged samples of a part of the reference that begins with sample ``start``.

    ``rests`` is 1 for a slow stretch, 0 for a move. ``squares`` is the sum of squared errors, ``total`` that of errors,
    ``taken`` the number of samples, ``reference_squares`` and ``reference_total`` the sums for the reference less the
    initial value, ``lag_squares`` and ``lag_total`` those of the allowed lag, ``swing`` the reversal state of the
    error, ``lag_swing`` that of a loop that only lags, ``lowest_error`` and ``highest_error`` its extremes. ``first``
    and ``last`` are the reference before the part and at its end, and ``path`` is the sum of its changes in between,
    without their sign.
    """

    start: float = 0.0
    rests: float = 0.0
    squares: float = 0.0
    total: float = 0.0
    taken: float = 0.0
    reference_squares: float = 0.0
    reference_total: float = 0.0
    lag_squares: float = 0.0
    lag_total: float = 0.0
    swing: Swing = Swing(0.0, UNDECIDED, 0.0)
    lag_swing: Swing = Swing(0.0, UNDECIDED, 0.0)
    lowest_error: float = 0.0
    highest_error: float = 0.0
    first: float = 0.0
    last: float = 0.0
    path: float = 0.0


def stands(rests: Floats, path: Floats) -> Floats:
    """1 for a slow stretch, and for a reference that does not move at all; 0 for a move."""
    found: Floats = choose(path > 0.0, rests, 1.0)
    return found


def allowed_squares(at_rest: Numeric, mean_lag: Numeric, lag_squares: Numeric) -> Numeric:
    """Mean square of the error that is allowed for a part, from the error at rest and the lag; also of columns."""
    return at_rest * at_rest + 2.0 * at_rest * mean_lag + lag_squares


def weight_of(rests: float, path: float, way: float, time: float, extent: float) -> float:
    """Weight of the error of a part [-]: 1 at rest, less on a quick ramp, on which every loop is behind.

    ``path`` of the reference leads by ``way``, with ``time`` [s] judged; ``extent`` is its largest value.
    """
    inverse = 1.0 / (path if path > 0.0 else 1.0)
    slow = min(SLOW_RATE * extent * time * inverse, 1.0)
    moving = max(min(RETURNING * (1.0 - way * inverse), 1.0), slow * slow)
    return 1.0 if rests > 0.0 or path == 0.0 else moving


def badness(part: PartSums, course: ReferenceSummary) -> float:
    """Squared ratio of the largest number of a part to its limit, by which the worst of the earlier parts is chosen."""
    extent, taken = max(course.largest, _TINY), max(part.taken, 1.0)
    weight = weight_of(part.rests, part.path, abs(part.last - part.first), taken * course.interval, extent)
    # Sums in place of means: one division for all.
    allowed = allowed_squares(LARGEST_SHARE * extent * taken, part.lag_total, part.lag_squares * taken)
    error = weight * weight * part.squares * taken / max(allowed, _TINY)
    of_lag = 1.0 if part.rests > 0.0 else max(abs(part.lag_swing.turns), 1.0)
    turns = float(int(max(abs(part.swing.turns) - of_lag, 0.0))) / (SUSTAINED - 1.0)
    # Of an angle at rest the range has a limit, too.
    span = (part.highest_error - part.lowest_error) / max(LARGEST_ANGLE_SWING, LARGEST_SWING_SHARE * extent)
    at_rest = max(turns, span * (1.0 - course.of_joint))
    full_motion = LARGEST_LAG * extent * LARGEST_LAG * extent * taken
    reversing = error * max(full_motion, part.lag_squares) / max(part.lag_squares, _TINY)
    far = max(part.highest_error, -part.lowest_error) / (LARGEST_EXCUSED * max(extent, part.path))
    moving = max(min(turns * turns, reversing), far * far)
    return max(error, at_rest * at_rest if part.rests > 0.0 else moving)


class SettledSums(NamedTuple):
    """State of the settled meter: present part of the reference, and the worst of the earlier ones.

    ``worst_badness`` is that of the latter, ``waits`` is 1 while the present rest is in its first half, ``lagged``
    the reference with the allowed lag, ``met`` 1 once the value has met the reference, and ``command`` the
    reversals of the command in the judged samples of the part. ``begun`` is the initial controlled value,
    ``lowest`` and ``highest`` its extremes. ``met_upwards`` is 1 once the value has been at or below the reference,
    and ``top`` the highest value since then; ``met_downwards`` and ``bottom`` are the reverse.
    """

    part: PartSums
    worst: PartSums
    worst_badness: float
    waits: float
    lagged: float
    met: float
    command: Reversals
    begun: float
    lowest: float
    highest: float
    met_upwards: float
    top: float
    met_downwards: float
    bottom: float


def start_settled(course: ReferenceSummary, sample: Sample) -> SettledSums:
    """Start the settled meter at the first sample."""
    value, reference = sample.value, sample.reference
    error = value - reference
    return SettledSums(
        part=PartSums(
            start=0.0,
            rests=0.0,
            squares=error * error,
            total=error,
            taken=1.0,
            reference_squares=error * error,
            reference_total=-error,
            lag_squares=0.0,
            lag_total=0.0,
            swing=Swing(error, UNDECIDED, error),
            lag_swing=Swing(0.0, UNDECIDED, 0.0),
            lowest_error=error,
            highest_error=error,
            first=reference,
            last=reference,
            path=0.0,
        ),
        worst=PartSums(),
        worst_badness=0.0,
        waits=0.0,
        lagged=reference,
        met=1.0 if meets(course, sample) else 0.0,
        command=start_reversals(course, sample),
        begun=value,
        lowest=value,
        highest=value,
        met_upwards=1.0 if error <= 0.0 else 0.0,
        top=value,
        met_downwards=1.0 if error >= 0.0 else 0.0,
        bottom=value,
    )


def allowed_lag(course: ReferenceSummary, lag: float, change: float, speed: float) -> float:
    """Error allowed beside that at rest, for a reference ``lag`` ahead of a late one, and a joint's speed [rad/s].

    ``change`` is the change of the reference up to the sample: what lagged before the reference came to rest is no
    excuse. Twice its lag leaves room about the crest of a wave, where a late one moves on.
    """
    of_joint = course.of_joint * LAG_OF_JOINT * abs(speed) * course.largest
    of_reference = min(abs(lag), 2.0 * LAG_TIME / course.interval * abs(change))
    return min(of_reference + of_joint, LARGEST_LAG * course.largest)


def meets(course: ReferenceSummary, sample: Sample) -> bool:
    """Return whether a value is near a reference that is not repeated, and so may be judged from here on."""
    return course.start_up == 0.0 and abs(sample.value - sample.reference) <= LARGEST_SHARE * course.largest


def begun(swing: Swing, value: float, anew: bool) -> Swing:
    """Return the reversal state ``swing`` with a value, or that of a part that begins ``anew`` with the value."""
    return Swing(value if anew else swing.play, UNDECIDED if anew else swing.turns, value if anew else swing.highest)


def next_part(state: SettledSums, course: ReferenceSummary, sample: Sample, late: float, lag: float) -> PartSums:
    """Return the sums of the present part with a sample, anew where the part begins or is not judged yet.

    ``late`` is the lead of the reference over a late one, ``lag`` what is allowed of that.
    """
    before, error, reference = state.part, sample.value - sample.reference, sample.reference
    # From the initial value, or the square of a pressure would hide its change.
    ahead = reference - state.begun
    is_new = course.is_new > 0.0
    is_first = course.part_start == 0.0 and course.rests == 0.0
    begins = course.start_up > 0.0 and sample.number >= course.start_up and sample.number < course.start_up + 1.0
    is_met = state.met == 0.0 and 2.0 * sample.number < course.samples - 1.0 and meets(course, sample)
    anew = is_new or state.waits > 0.0 or (is_first and (begins or is_met))
    least = OSCILLATION_THRESHOLD * course.largest
    return PartSums(
        start=course.part_start,
        rests=course.rests,
        squares=error * error + (0.0 if anew else before.squares),
        total=error + (0.0 if anew else before.total),
        taken=1.0 if anew else before.taken + 1.0,
        reference_squares=ahead * ahead + (0.0 if anew else before.reference_squares),
        reference_total=ahead + (0.0 if anew else before.reference_total),
        lag_squares=lag * lag + (0.0 if anew else before.lag_squares),
        lag_total=lag + (0.0 if anew else before.lag_total),
        # What motion excuses is no reversal.
        swing=begun(next_swing(before.swing, error, least + lag), error, anew),
        lag_swing=begun(next_swing(before.lag_swing, late, least), late, anew),
        lowest_error=error if anew else min(before.lowest_error, error),
        highest_error=error if anew else max(before.highest_error, error),
        first=before.last if is_new else before.first,
        last=reference,
        path=abs(reference - before.last) + (0.0 if is_new else before.path),
    )


def update_settled(state: SettledSums, course: ReferenceSummary, sample: Sample) -> SettledSums:
    """Update the settled meter with a sample."""
    value = sample.value
    error = value - sample.reference
    met_upwards = 1.0 if state.met_upwards > 0.0 or error <= 0.0 else 0.0
    met_downwards = 1.0 if state.met_downwards > 0.0 or error >= 0.0 else 0.0
    before = state.part
    lagged = state.lagged + (sample.reference - state.lagged) * course.interval / (LAG_TIME + course.interval)
    late = sample.reference - lagged
    lag = allowed_lag(course, late, sample.reference - before.last, sample.angular_velocity)
    part, command = next_part(state, course, sample, late, lag), update_reversals(state.command, course, sample)
    return SettledSums(
        part=part,
        worst=state.worst,
        worst_badness=state.worst_badness,
        waits=course.in_first_half,
        lagged=lagged,
        met=1.0 if state.met > 0.0 or meets(course, sample) else 0.0,
        command=Reversals(command.way, command.task, command.turns if part.taken > 1.0 else 0.0),
        begun=state.begun,
        lowest=min(state.lowest, value),
        highest=max(state.highest, value),
        met_upwards=met_upwards,
        top=value if met_upwards > state.met_upwards else max(state.top, value),
        met_downwards=met_downwards,
        bottom=value if met_downwards > state.met_downwards else min(state.bottom, value),
    )


def keep_worst(state: SettledSums, course: ReferenceSummary) -> SettledSums:
    """Keep the part that ends with the sample before a new one, if it is the worst so far."""
    before, number = state.part, course.line_start + 1.0
    ends = course.is_new > 0.0 and (before.rests > 0.0 or before.path > 0.0)
    # At the start of a run the value may be on its way yet.
    is_late = course.start_up > 0.0 and number > course.start_up + 1.0
    found = badness(before, course)
    is_worse = ends and (before.start > 0.0 or state.met > 0.0 or is_late) and found > state.worst_badness
    return state._replace(
        worst=before if is_worse else state.worst, worst_badness=found if is_worse else state.worst_badness
    )


class RecordedSettled(NamedTuple):
    """State of the settled meter over a recording: summary of the reference, meter, and end of the worst earlier part.

    ``is_cut`` is 1 for a reference that has rests and moves, and ``worst_end`` the number of a sample, 0 without one.
    """

    course: ReferenceSummary
    sums: SettledSums
    is_cut: float
    worst_end: float = 0.0


def sample_ahead(state: RecordedSettled, sample: Sample) -> float:
    """Return the number of the recorded sample whose reference decides on the part of a sample."""
    return deciding_sample(state.course, sample.number, sample.reference)


def update_recorded(state: RecordedSettled, sample: Sample, later: Sample) -> RecordedSettled:
    """Update the settled meter with a recorded sample, as a run does, and with the sample that decides on its part."""
    number = sample_ahead(state, sample)
    parted = advance_part(state.course, sample.number, sample.reference, number, later.reference)
    course = parted if state.is_cut > 0.0 else state.course
    sums = update_settled(keep_worst(state.sums, course), course, sample)
    is_same = sums.worst_badness == state.sums.worst_badness
    return RecordedSettled(course, sums, state.is_cut, state.worst_end if is_same else sample.number - 1.0)


SETTLED = MeterKind("settled", SettledSums, start_settled, update_settled, needs_course=True, end_part=keep_worst)


def farther(highest: Floats, lowest: Floats) -> Floats:
    """Largest magnitude of an error, given its extremes ``highest`` and ``lowest``."""
    found: Floats = larger(highest, -lowest)
    return found


def deviation(squares: Floats, total: Floats, count: Floats) -> Floats:
    """Standard deviation from sum of squares, sum and number of samples."""
    count = larger(count, 1.0)
    return np.sqrt(np.maximum(squares / count - (total / count) ** 2, 0.0))


def read_reversals(readings: Readings) -> Floats:
    """Metric ``settled_reversals`` of the command in the last part [1/s]; less than a second counts as one."""
    sums = readings.meters[SETTLED.name]
    return np.asarray(sums.command.turns / larger((sums.part.taken - 1.0) * readings.interval, 1.0))


def _of_sums(part: str, *names: str, by: Callable[..., Floats] | None = None) -> ReadAt:
    return ReadAt(tuple(".".join(("meters", SETTLED.name, *part.split(), name)) for name in names), by)


_NUMBERS: dict[str, Callable[[Readings], Floats]] = {
    **{
        f"{prefix}_{name}": _of_sums(part, *fields, by=function)
        for prefix, part in (("settled", "part"), ("worst", "worst"))
        for name, fields, function in (
            ("error", ("squares", "taken"), root_mean),
            ("missing", ("total", "taken"), mean_of),
            ("largest", ("highest_error", "lowest_error"), farther),
            ("span", ("highest_error", "lowest_error"), less),
            ("reference", ("reference_total", "taken"), mean_of),
            ("wave", ("reference_squares", "reference_total", "taken"), deviation),
            ("turns", ("swing.turns",), count_of),
            ("lag", ("lag_squares", "taken"), root_mean),
            ("mean_lag", ("lag_total", "taken"), mean_of),
            ("lag_turns", ("lag_swing.turns",), count_of),
            ("way", ("last", "first"), less),
            ("rests", ("rests", "path"), stands),
            ("path", ("path",), None),
            ("taken", ("taken",), None),
        )
    },
    **{f"settled_{name}": _of_sums("", name) for name in ("begun", "lowest", "highest", "top", "bottom")},
    "settled_reversals": read_reversals,
    "settled_extent": ReadAt(("course.largest",)),
    "settled_last": ReadAt(("course.last",)),
    "settled_interval": ReadAt(("course.interval",)),
}
SETTLED_METRICS = {
    name: MetricKind(name, "-", "for verdicts", (), None, read, (SETTLED,)) for name, read in _NUMBERS.items()
}
"""Metrics of the last part and of the worst earlier one by name [SI unit of the controlled quantity], for verdicts."""


class _PlantarflexionPeaks(NamedTuple):
    """Largest torque in plantarflexion [N m] that a walk requests, and that the actuator gives; 0 without any.

    ``push_off_peak`` is the largest one that it gives in push-off.
    """

    requested_peak: float = 0.0
    given_peak: float = 0.0
    push_off_peak: float = 0.0


def start_plantarflexion(_course: ReferenceSummary, sample: Sample) -> _PlantarflexionPeaks:
    """Start the plantarflexion meter at the first sample, which has no request yet."""
    return _PlantarflexionPeaks(given_peak=max(0.0, sample.torque))


def update_plantarflexion(
    state: _PlantarflexionPeaks, _course: ReferenceSummary, sample: Sample
) -> _PlantarflexionPeaks:
    """Update the plantarflexion meter with a sample."""
    requested = sample.reference if is_torque_requested(sample.command, sample.stride.phase) else 0.0
    in_push_off = sample.torque if sample.stride.phase == PUSH_OFF else 0.0
    return _PlantarflexionPeaks(
        max(state.requested_peak, requested),
        max(state.given_peak, sample.torque),
        max(state.push_off_peak, in_push_off),
    )


_METERS = (MeterKind("plantarflexion", _PlantarflexionPeaks, start_plantarflexion, update_plantarflexion),)
WALK_PEAKS = {
    name: MetricKind(name, "N m", "for verdicts", (), None, read, _METERS, needs=(WALK, *of_request))
    for name in _PlantarflexionPeaks._fields
    for read in (ReadAt((f"meters.plantarflexion.{name}",)),)
    for of_request in ((REQUESTED,) if name == "requested_peak" else (),)
}
"""Metrics of the peaks of a walk by name, used for verdicts only."""
VERDICT_METRICS = {**SETTLED_METRICS, **WALK_PEAKS}
