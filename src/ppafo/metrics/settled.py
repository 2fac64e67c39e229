"""Parts of a reference, slow stretches and moves, in a run without recording: numbers for the tracking verdict.

A stretch is straight, slow and no shorter than a tenth of a second; a sine is one move. Judged are the second half of
each stretch and the whole of each move; of a move at the start of a run, what follows once the value has met the
reference; of a reference that repeats, what follows a start-up. The error that is allowed at a sample is the same in
both. A stretch of up to twice the least length counts in part by itself, and for the rest as part of the move around
it, so that no number jumps where a plateau becomes a stretch. The last part, the worst of the earlier ones and the move
before the last stretch are kept. These numbers are for verdicts only: no table and no study lists them.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ppafo.metrics.command import Reversals, is_torque_requested, start_reversals, update_reversals
from ppafo.metrics.metric import Floats, MetricKind, ReadAt, Readings, root_mean
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, UNDECIDED, Swing, begun_swing, count_of, next_swing
from ppafo.model.columns import larger
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
    shortest_rest,
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
# Largest range of the error of an angle at rest [rad], or divided by the way of the reference [-] if that is more.
LARGEST_ANGLE_SWING = math.radians(1.0)
LARGEST_SWING_SHARE = 0.03
# Largest angle error for a moving reference [rad], or divided by the reference's range [-] if that allows more.
LARGEST_ANGLE_ERROR = math.radians(2.0)
LARGEST_ANGLE_SHARE = 0.05
LARGEST_CREST = 1.5
"""Largest error divided by the largest RMS error, for a smooth wave of a torque or a pressure; of a lag it is 1.41."""
LARGEST_SHARE_OF_WAVE = 0.5
"""Standard deviation of the error divided by the standard deviation of a moving reference [-].

A controller that only keeps the mean of a sine has 1.0, however small the sine is beside its mean; a constant delay on
a slow ramp has 0. In a walk it is the RMS torque error divided by the RMS of the requested torque.
"""
TIMES_OF_SMALL_WAVE = 1.5
"""Reduction of the error that a moving joint allows, divided by the deviation of the reference [-]: of a wave that
moves as much as is allowed at rest, the limit is that of a wave alone."""
# In place of the start of a judged part, for a walk.
WHERE_REQUESTED = -1.0
IN_PUSH_OFF = -2.0
FEWEST_PERIODS = 0.5
"""Periods of a reference in the settled part, below which the part may hold no peak of the reference [-]."""
MOST_REVERSALS = 3.0
"""Number of reversals on the hold above which a loop counts as oscillating; settling takes one or two."""
_TINY = 1.0e-300
"""Divisor in place of 0."""
_NOTHING_ASKED = 1.0e300
"""Lowest reference before any is judged, finite, since the errors of numbers are estimated by their differences."""


class PartSums(NamedTuple):
    """Sums over the judged samples, ``since`` to ``end``, of a part of the reference that begins with ``start``.

    ``share`` is how much of it counts by itself, ``rests`` 1 for a slow stretch, 0 for a move. ``squares`` is the sum
    of squared errors, ``total`` that of errors, ``taken`` the number of samples, ``reference_squares`` and
    ``reference_total`` the sums for the reference less the initial value, ``lag_squares`` and ``lag_total`` those of
    the allowed lag, ``swing`` the reversal state of the error, ``lag_swing`` that of a loop that only lags,
    ``lowest_error`` and ``highest_error`` its extremes, ``lowest_reference`` and ``highest_reference`` those of the
    reference. ``first`` and ``last`` are the reference before the part and at its end, and ``path`` is the sum of its
    changes in between, without their sign.
    """

    start: float = 0.0
    since: float = 0.0
    end: float = 0.0
    share: float = 1.0
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
    lowest_reference: float = 0.0
    highest_reference: float = 0.0
    first: float = 0.0
    last: float = 0.0
    path: float = 0.0


class SettledPart(NamedTuple):
    """Numbers of a judged part of a run, or arrays (runs,) of such numbers without recordings.

    "SI" is the SI unit of the controlled quantity. The error is the value minus the reference.
    """

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
    """Number of reversals of the error beyond those of a lag behind a moving reference."""
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
    rests: float = 0.0
    """1 if the reference stands still, 0 if it moves."""
    motion: float = 0.0
    """Motion of reference and joint [-]: 0 at rest, 1 where the limits of a moving reference hold."""
    lag: float = 0.0
    """RMS of the error that motion allows beside the one at rest [SI]."""
    mean_lag: float = 0.0
    """Mean of the error that motion allows beside the one at rest [SI]."""
    weight: float = 1.0
    """Weight of the error [-]: 1, and less for a quick ramp, on which every loop is behind."""
    share: float = 1.0
    """Share by which the part counts by itself [-]: less for a short rest, and for the move before that."""
    way: float = math.inf
    """Path of a moving reference in the part, or its largest value if that is more; inf at rest [SI]."""
    ends_on_ramp: float = 0.0
    """1 for a move in one direction to the largest reference, which the run does not see settle."""
    reference_range: float = 0.0
    """Range of initial value and reference for an angle [rad]; 0 for other quantities."""
    reference_mean: float = 0.0
    """Mean of the reference [SI]; 0 for a walk."""
    reference_deviation: float = 0.0
    """Standard deviation of the reference [SI]."""
    reference_periods: float = math.inf
    """Number of periods of a sine in the part; infinite for another reference."""
    is_reference_smooth: float = 0.0
    """1 for a reference without steps and corners."""
    beyond_reach: float = 0.0
    """Largest torque of the reference in all judged parts that the actuator cannot give [N m]."""
    first: float = 0.0
    """First judged sample of a recorded task."""
    last: float = 0.0
    """Last judged sample of a recorded task."""
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
        moves = (np.asarray(self.rests) == 0.0) & (np.asarray(self.reference_deviation) > 0.0)
        is_short = np.asarray(self.reference_periods) < FEWEST_PERIODS
        return (np.asarray(self.ends_on_ramp) > 0.0) | (moves & is_short)


def numbers_of(
    part: PartSums, change: float, interval: float, wanted: float, angle_range: float, smooth: float, turns: float
) -> SettledPart:
    """Return the numbers of a part of a reference whose largest ``change`` counts as ``wanted``.

    ``interval`` [s] is that of the samples, ``turns`` the least number of reversals of the error by a lag.
    """
    inverse = 1.0 / part.taken if part.taken > 0.0 else math.nan
    mean = part.total * inverse
    square = part.squares * inverse
    mean_ahead = part.reference_total * inverse
    rests = 1.0 if part.rests > 0.0 or part.path == 0.0 else 0.0
    of_lag = 0.0 if rests > 0.0 else max(abs(part.lag_swing.turns) - 1.0, turns, 0.0)
    lag = math.sqrt(part.lag_squares * inverse)
    way = abs(part.last - part.first)
    wave = math.sqrt(max(part.reference_squares * inverse - mean_ahead * mean_ahead, 0.0))
    # On a quick ramp every loop is behind: the error of a move counts less.
    inverse_path = 1.0 / (part.path if part.path > 0.0 else 1.0)
    slow = min(SLOW_RATE * change * (part.taken * interval) * inverse_path, 1.0)
    of_move = max(min(RETURNING * (1.0 - way * inverse_path), 1.0), slow * slow)
    return SettledPart(
        wanted_change=wanted,
        reference_range=angle_range,
        is_reference_smooth=smooth,
        rms_error=math.sqrt(square),
        mean_error=mean,
        error_deviation=math.sqrt(max(square - mean * mean, 0.0)),
        error_range=part.highest_error - part.lowest_error,
        largest_error=max(part.highest_error, -part.lowest_error),
        error_reversals=max(abs(part.swing.turns) - 1.0 - of_lag, 0.0),
        rests=rests,
        motion=min(lag / (LARGEST_LAG * max(change, _TINY)), 1.0),
        lag=lag,
        mean_lag=part.lag_total * inverse,
        weight=1.0 if rests > 0.0 else of_move,
        share=part.share,
        way=math.inf if rests > 0.0 else max(part.path, change),
        reference_mean=mean_ahead,
        reference_deviation=0.0 if rests > 0.0 else wave,
    )


class PartLimits(NamedTuple):
    """Largest numbers with which a part of a task follows its reference [SI], inf without a limit.

    ``rms_error`` is that at rest with a lag beside it, or for a wave its share, which does not count the mean error.
    ``mean_error`` is for on/off valves at rest, which swing about the reference by design, ``swing`` for the range of
    the error of an angle, and of on/off valves, ``largest_error`` for a moving reference of an angle and a smooth wave.
    """

    rms_error: float
    mean_error: float
    swing: float
    largest_error: float


def gradual_limits(part: SettledPart) -> PartLimits:
    """Return the limits of a part for a valve with gradual openings, continuous in amplitude and speed."""
    share = LARGEST_SHARE * part.wanted_change
    # Of a small wave the limit is that of any motion.
    small = share + LARGEST_LAG * part.wanted_change - TIMES_OF_SMALL_WAVE * part.reference_deviation
    of_wave = max(LARGEST_SHARE_OF_WAVE * part.reference_deviation, share, small)
    # The error that is allowed at rest, and beside it the lag at each sample.
    with_lag = math.sqrt(share * share + 2.0 * share * part.mean_lag + part.lag * part.lag)
    rms = max(min(with_lag, math.sqrt(of_wave * of_wave + part.mean_error * part.mean_error)), _TINY)
    # An error of this many degrees is allowed for an angle, however small its range.
    swing = max(LARGEST_ANGLE_SWING, LARGEST_SWING_SHARE * part.reference_range)
    angle = max(LARGEST_ANGLE_ERROR, LARGEST_ANGLE_SHARE * part.reference_range)
    is_angle = part.reference_range > 0.0
    of_smooth = LARGEST_CREST * rms if part.rests == 0.0 and part.is_reference_smooth > 0.0 else math.inf
    return PartLimits(
        rms_error=rms,
        mean_error=math.inf,
        swing=swing + (2.0 * angle - swing) * part.motion if is_angle else math.inf,
        largest_error=(angle if is_angle else of_smooth) / max(part.motion, _TINY),
    )


def error_and_oscillation(part: SettledPart, limits: PartLimits) -> tuple[float, float]:
    """Return remaining error and oscillation of a part, divided by their limits [-], without its share."""
    span = part.error_range / limits.swing
    ratio = max(part.rms_error / limits.rms_error, abs(part.mean_error) / limits.mean_error, span)
    # On a quick ramp every loop lags, by no more than the whole way.
    weighed = max(ratio, part.largest_error / limits.largest_error) * part.weight
    error = max(weighed, part.largest_error / (LARGEST_EXCUSED * part.way))
    # While the reference moves, an error that reverses is none to speak of if it is small.
    turning = min(part.error_reversals / MOST_REVERSALS, error / max(part.motion, _TINY))
    # A joint that creeps has a range of its error, too, but a mean error above the standard deviation.
    swings = part.rests > 0.0 and part.error_deviation > abs(part.mean_error)
    return error, max(turning, span) if swings else turning


def badness(part: PartSums, course: ReferenceSummary) -> float:
    """Largest number of a part divided by its limit; 0 for a part that does not exist."""
    extent = max(course.largest, _TINY)
    angle_range = extent * (1.0 - course.of_joint)
    numbers = numbers_of(part, extent, course.interval, extent, angle_range, 0.0, 0.0)
    error, oscillation = error_and_oscillation(numbers, gradual_limits(numbers))
    return max(error, oscillation) if part.taken > 0.0 else 0.0


class SettledSums(NamedTuple):
    """State of the settled meter: present part of the reference, and the worst of the earlier ones.

    ``before`` is the move before a present rest, ``worst_badness`` that of the worst part, ``waits`` is 1 while the
    present rest is in its first half, ``lagged`` the reference with the allowed lag, ``met`` 1 once the value has met
    the reference, and ``command`` the reversals of the command in the judged samples of the part. ``begun`` is the
    initial controlled value, ``lowest`` and ``highest`` its extremes. ``met_upwards`` is 1 once the value has been at
    or below the reference, and ``top`` the highest value since then; ``met_downwards`` and ``bottom`` are the reverse.
    ``lowest_asked`` and ``highest_asked`` are the extremes of the reference in all earlier parts that are judged.
    """

    part: PartSums
    before: PartSums
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
    lowest_asked: float
    highest_asked: float


def start_settled(course: ReferenceSummary, sample: Sample) -> SettledSums:
    """Start the settled meter at the first sample."""
    value = sample.value
    reference = sample.reference
    error = value - reference
    return SettledSums(
        part=PartSums(
            squares=error * error,
            total=error,
            taken=1.0,
            reference_squares=error * error,
            reference_total=-error,
            swing=Swing(error, UNDECIDED, error),
            lowest_error=error,
            highest_error=error,
            lowest_reference=reference,
            highest_reference=reference,
            first=reference,
            last=reference,
        ),
        before=PartSums(),
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
        lowest_asked=_NOTHING_ASKED,
        highest_asked=-_NOTHING_ASKED,
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


def nearer(value: float, extreme: float, share: float) -> float:
    """Return an extreme of earlier samples, of which a ``share`` counts, for the ``value`` of the present one."""
    return extreme if share == 1.0 else value + share * (extreme - value)


def next_part(state: SettledSums, course: ReferenceSummary, sample: Sample, late: float, lag: float) -> PartSums:
    """Return the sums of the present part with a sample, anew where the part is not judged yet.

    ``late`` is the lead of the reference over a late one, ``lag`` what is allowed of that.
    """
    before = state.part
    error = sample.value - sample.reference
    reference = sample.reference
    # From the initial value, or the square of a pressure would hide its change.
    ahead = reference - state.begun
    is_first = course.part_start == 0.0 and course.rests == 0.0
    begins = course.start_up > 0.0 and sample.number >= course.start_up and sample.number < course.start_up + 1.0
    is_met = state.met == 0.0 and 2.0 * sample.number < course.samples - 1.0 and meets(course, sample)
    anew = state.waits > 0.0 or (is_first and (begins or is_met))
    # Share of the samples before: all of the part, and of the parts before a move after a short rest.
    of_before = 0.0 if anew else 1.0 - before.share if course.is_new > 0.0 else 1.0
    least = OSCILLATION_THRESHOLD * course.largest
    return PartSums(
        start=before.start,
        since=sample.number if anew or before.taken == 0.0 else before.since,
        end=sample.number,
        rests=course.rests,
        squares=error * error + (0.0 if anew else before.squares),
        total=error + (0.0 if anew else before.total),
        taken=1.0 if anew else before.taken + 1.0,
        reference_squares=ahead * ahead + (0.0 if anew else before.reference_squares),
        reference_total=ahead + (0.0 if anew else before.reference_total),
        lag_squares=lag * lag + (0.0 if anew else before.lag_squares),
        lag_total=lag + (0.0 if anew else before.lag_total),
        # A lag that motion excuses is no reversal.
        swing=begun_swing(next_swing(before.swing, error, least + lag), error, anew),
        lag_swing=begun_swing(next_swing(before.lag_swing, late, least), late, anew),
        lowest_error=nearer(error, min(before.lowest_error, error), of_before),
        highest_error=nearer(error, max(before.highest_error, error), of_before),
        lowest_reference=nearer(reference, min(before.lowest_reference, reference), of_before),
        highest_reference=nearer(reference, max(before.highest_reference, reference), of_before),
        first=before.first,
        last=reference,
        path=abs(reference - before.last) + before.path,
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
    part = next_part(state, course, sample, late, lag)
    command = update_reversals(state.command, course, sample)
    return SettledSums(
        part=part,
        before=state.before,
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
        lowest_asked=state.lowest_asked,
        highest_asked=state.highest_asked,
    )


def blended_swing(first: Swing, rest: Swing, of_first: float) -> Swing:
    """Return the reversal state of a rest that goes on, with a share ``of_first`` of the reversals as in ``blend``."""
    turns = of_first * (max(abs(first.turns) - 1.0, 0.0) + 2.0 * max(abs(rest.turns) - 1.0, 0.0))
    return Swing(rest.play, (-1.0 if rest.turns < 0.0 else 1.0) * (1.0 + turns), rest.highest)


def blend(first: PartSums, rest: PartSums, of_first: float) -> PartSums:
    """Return the sums with which a move after a rest begins: a share ``of_first`` of a move and of that rest."""
    # Only the second half of a rest was judged; a small part of a path that returns counts in full.
    of_rest = 2.0 * of_first
    of_path = of_first * of_first * of_first
    return PartSums(
        start=first.start if of_first > 0.0 else rest.end,
        since=first.since,
        end=rest.end,
        share=1.0 - of_first,
        squares=of_first * first.squares + of_rest * rest.squares,
        total=of_first * first.total + of_rest * rest.total,
        taken=of_first * first.taken + of_rest * rest.taken,
        reference_squares=of_first * first.reference_squares + of_rest * rest.reference_squares,
        reference_total=of_first * first.reference_total + of_rest * rest.reference_total,
        lag_squares=of_first * first.lag_squares + of_rest * rest.lag_squares,
        lag_total=of_first * first.lag_total + of_rest * rest.lag_total,
        swing=blended_swing(first.swing, rest.swing, of_first),
        lag_swing=blended_swing(first.lag_swing, rest.lag_swing, of_first),
        lowest_error=min(first.lowest_error, rest.lowest_error),
        highest_error=max(first.highest_error, rest.highest_error),
        lowest_reference=min(first.lowest_reference, rest.lowest_reference),
        highest_reference=max(first.highest_reference, rest.highest_reference),
        first=rest.last + of_path * (first.first - rest.last),
        last=rest.last,
        path=of_path * (first.path + 2.0 * rest.path),
    )


def worse(state: SettledSums, course: ReferenceSummary, part: PartSums, share: float) -> SettledSums:
    """Keep a part that ends and counts by a ``share``, if it is the worst so far."""
    found = share * badness(part, course)
    is_worse = found > state.worst_badness
    return state._replace(
        worst=part._replace(share=share) if is_worse else state.worst, worst_badness=max(found, state.worst_badness)
    )


def keep_worst(state: SettledSums, course: ReferenceSummary) -> SettledSums:
    """Before the first sample of a new part, end the one before; the move before a rest counts as much as the rest."""
    ended = state.part
    rests = state.part.rests > 0.0
    # At the start of a run the value may be on its way yet.
    is_late = ended.start > 0.0 or state.met > 0.0 or (course.start_up > 0.0 and ended.end > course.start_up)
    counts = is_late and (rests or ended.path > 0.0)
    share = min(max((ended.end - ended.start) / shortest_rest(course) - 1.0, 0.0), 1.0)
    asked = state._replace(
        lowest_asked=min(state.lowest_asked, ended.lowest_reference) if counts else state.lowest_asked,
        highest_asked=max(state.highest_asked, ended.highest_reference) if counts else state.highest_asked,
    )
    judged = worse(worse(asked, course, state.before, share), course, ended, share if counts else 0.0)
    absent = PartSums(
        start=ended.start,
        since=ended.since,
        lowest_error=ended.lowest_error,
        highest_error=ended.highest_error,
        lowest_reference=ended.lowest_reference,
        highest_reference=ended.highest_reference,
        first=ended.first,
    )
    joined = blend(state.before if state.before.taken > 0.0 else absent, ended, 1.0 - share)
    none = PartSums(start=ended.end, first=ended.last, last=ended.last)
    # A rest after a rest has before it what a move would begin with.
    after_rest = judged._replace(
        part=none if course.rests > 0.0 else joined, before=joined if course.rests > 0.0 else PartSums()
    )
    after_move = asked._replace(part=none, before=ended if counts else PartSums())
    following = after_rest if rests else after_move
    return following if course.is_new > 0.0 else state


class RecordedSettled(NamedTuple):
    """State of the settled meter over a recording: summary of the reference, and meter.

    ``is_cut`` is 1 for a reference that has rests and moves.
    """

    course: ReferenceSummary
    sums: SettledSums
    is_cut: float


def sample_ahead(state: RecordedSettled, sample: Sample) -> float:
    """Return the number of the recorded sample whose reference decides on the part of a sample."""
    return deciding_sample(state.course, sample.number, sample.reference)


def update_recorded(state: RecordedSettled, sample: Sample, later: Sample) -> RecordedSettled:
    """Update the settled meter with a recorded sample, as a run does, and with the sample that decides on its part."""
    number = sample_ahead(state, sample)
    parted = advance_part(state.course, sample.number, sample.reference, number, later.reference)
    course = parted if state.is_cut > 0.0 else state.course
    return RecordedSettled(course, update_settled(keep_worst(state.sums, course), course, sample), state.is_cut)


SETTLED = MeterKind("settled", SettledSums, start_settled, update_settled, needs_course=True, end_part=keep_worst)


def read_reversals(readings: Readings) -> Floats:
    """Metric ``settled_reversals`` of the command in the last part [1/s]; less than a second counts as one."""
    sums = readings.meters[SETTLED.name]
    return np.asarray(sums.command.turns / larger((sums.part.taken - 1.0) * readings.interval, 1.0))


PART_SUMS = tuple(name for name in PartSums._fields if name not in ("start", "since", "end"))
"""Sums of a part by which it is judged."""
OF_RUN = ("begun", "lowest", "highest", "top", "bottom", "lowest_asked", "highest_asked")
"""Numbers of the whole run by which its parts are judged."""
_SETTLED = f"meters.{SETTLED.name}"
_NUMBERS: dict[str, Callable[[Readings], Floats]] = {
    **{
        f"{prefix}_{name}": ReadAt((f"{_SETTLED}.{part}.{name}{'.turns' if name.endswith('swing') else ''}",))
        for prefix, part in (("settled", "part"), ("before", "before"), ("worst", "worst"))
        for name in PART_SUMS
    },
    **{f"settled_{name}": ReadAt((f"{_SETTLED}.{name}",)) for name in OF_RUN},
    "settled_error": ReadAt((f"{_SETTLED}.part.squares", f"{_SETTLED}.part.taken"), root_mean),
    "settled_turns": ReadAt((f"{_SETTLED}.part.swing.turns",), count_of),
    "settled_reversals": read_reversals,
    "settled_extent": ReadAt(("course.largest",)),
    "settled_final": ReadAt(("course.last",)),
    "settled_interval": ReadAt(("course.interval",)),
}
SETTLED_METRICS = {
    name: MetricKind(name, "-", "for verdicts", (), None, read, (SETTLED,)) for name, read in _NUMBERS.items()
}
"""Metrics of the last part, the move before it and the worst earlier part by name, for verdicts."""


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
