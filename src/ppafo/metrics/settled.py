"""Settled part of a run without recording: numbers for the tracking verdict.

The settled part is the second half of the hold, or of a run that repeats its reference or rests for less than a tenth.
These numbers are for verdicts only: no table and no study lists them.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ppafo.metrics.command import Reversals, is_torque_requested, start_reversals, update_reversals
from ppafo.metrics.metric import Floats, MetricKind, ReadAt, Readings, less, mean_of, root_mean
from ppafo.metrics.switching import OSCILLATION_THRESHOLD, UNDECIDED, Swing, count_of, next_swing
from ppafo.model.columns import larger
from ppafo.signals.meter import REQUESTED, WALK, MeterKind, ReferenceSummary, Sample

SHORTEST_HOLD = 0.1
"""Shortest hold accepted for a verdict, as a fraction of the run [-]."""


class _SettledSums(NamedTuple):
    """State of the settled meter: sums and extremes of error, reference, angle and controlled quantity.

    ``squares`` is the sum of squared errors, ``total`` the sum of errors, ``taken`` the number of samples,
    ``reference_squares`` and ``reference_total`` the sums for the reference less ``begun``, ``swing`` the reversal
    state of the error, ``lowest_error`` and ``highest_error`` the extremes of the error, ``command`` the reversals of
    the command in the last half of the settled part, and ``lowest_angle`` and ``highest_angle`` the extremes of the
    angle [rad]. ``begun`` is the initial controlled value, ``lowest`` and ``highest`` its extremes. ``met_upwards`` is
    1 once the value has been at or below the reference, and ``top`` the highest value since then; ``met_downwards`` and
    ``bottom`` are the reverse.
    """

    squares: float
    total: float
    taken: float
    reference_squares: float
    reference_total: float
    swing: Swing
    lowest_error: float
    highest_error: float
    command: Reversals
    lowest_angle: float
    highest_angle: float
    begun: float
    lowest: float
    highest: float
    met_upwards: float
    top: float
    met_downwards: float
    bottom: float


def start_settled(course: ReferenceSummary, sample: Sample) -> _SettledSums:
    """Start the settled meter at the first sample."""
    value = sample.value
    error = value - sample.reference
    return _SettledSums(
        squares=error * error,
        total=error,
        taken=1.0,
        reference_squares=error * error,
        reference_total=-error,
        swing=Swing(error, UNDECIDED, error),
        lowest_error=error,
        highest_error=error,
        command=start_reversals(course, sample),
        lowest_angle=sample.angle,
        highest_angle=sample.angle,
        begun=value,
        lowest=value,
        highest=value,
        met_upwards=1.0 if error <= 0.0 else 0.0,
        top=value,
        met_downwards=1.0 if error >= 0.0 else 0.0,
        bottom=value,
    )


def update_settled(state: _SettledSums, course: ReferenceSummary, sample: Sample) -> _SettledSums:
    """Update the settled meter with a sample; its sums restart at half of the run and at half of the hold.

    Reversals of the command restart at three quarters, too: a loop that has come to rest by then does not oscillate.
    """
    value = sample.value
    error = value - sample.reference
    # From the initial value, or the square of a pressure would hide its change.
    ahead = sample.reference - state.begun
    # The first sample of a half is that from which on twice its number is at least this.
    of_run, of_hold = course.samples - 1.0, course.hold_start + course.samples - 1.0
    twice = 2.0 * sample.number
    is_hold = course.is_repeated == 0.0 and is_long_enough(course.hold_start, course.samples)
    rests = course.hold_start <= sample.number and is_hold
    half_of_run = twice >= of_run and twice < of_run + 2.0
    half_of_hold = rests and twice >= of_hold and twice < of_hold + 2.0
    anew = half_of_run or half_of_hold
    last_of_run, last_of_hold = 3.0 * of_run, course.hold_start + 3.0 * of_run
    fourfold = 4.0 * sample.number
    in_last_half = (fourfold >= last_of_run and fourfold < last_of_run + 4.0) or (
        rests and fourfold >= last_of_hold and fourfold < last_of_hold + 4.0
    )
    swing = next_swing(state.swing, error, OSCILLATION_THRESHOLD * course.largest)
    command = update_reversals(state.command, course, sample)
    met_upwards = 1.0 if state.met_upwards > 0.0 or error <= 0.0 else 0.0
    met_downwards = 1.0 if state.met_downwards > 0.0 or error >= 0.0 else 0.0
    return _SettledSums(
        squares=error * error + (0.0 if anew else state.squares),
        total=error + (0.0 if anew else state.total),
        taken=1.0 if anew else state.taken + 1.0,
        reference_squares=ahead * ahead + (0.0 if anew else state.reference_squares),
        reference_total=ahead + (0.0 if anew else state.reference_total),
        swing=Swing(
            error if anew else swing.play, UNDECIDED if anew else swing.turns, error if anew else swing.highest
        ),
        lowest_error=error if anew else min(state.lowest_error, error),
        highest_error=error if anew else max(state.highest_error, error),
        command=Reversals(command.way, command.task, 0.0 if anew or in_last_half else command.turns),
        lowest_angle=sample.angle if anew else min(state.lowest_angle, sample.angle),
        highest_angle=sample.angle if anew else max(state.highest_angle, sample.angle),
        begun=state.begun,
        lowest=min(state.lowest, value),
        highest=max(state.highest, value),
        met_upwards=met_upwards,
        top=value if met_upwards > state.met_upwards else max(state.top, value),
        met_downwards=met_downwards,
        bottom=value if met_downwards > state.met_downwards else min(state.bottom, value),
    )


def is_long_enough(hold_start: float, samples: float) -> bool:
    """Return whether the hold of a reference, from sample ``hold_start`` on, is long enough for a verdict."""
    length = samples - 1.0 - hold_start
    return length >= 1.0 and length >= SHORTEST_HOLD * (samples - 1.0)


SETTLED = MeterKind("settled", _SettledSums, start_settled, update_settled, True)


def farther(highest: Floats, lowest: Floats) -> Floats:
    """Largest magnitude of an error, given its extremes ``highest`` and ``lowest``."""
    found: Floats = larger(highest, -lowest)
    return found


def deviation(squares: Floats, total: Floats, count: Floats) -> Floats:
    """Standard deviation from sum of squares, sum and number of samples."""
    return np.sqrt(np.maximum(squares / count - (total / count) ** 2, 0.0))


def read_reversals(readings: Readings) -> Floats:
    """Metric ``settled_reversals`` of the command [1/s], in the last half of the settled part.

    A settled part below a second counts as one second.
    """
    sums = readings.meters[SETTLED.name]
    return np.asarray(2.0 * sums.command.turns / larger((sums.taken - 1.0) * readings.interval, 1.0))


def read_share_of_hold(readings: Readings) -> Floats:
    """Metric ``settled_share_of_hold`` [-]: duration of hold divided by duration of run, 0 between repetitions."""
    share = (readings.samples - 1 - readings.course.hold_start) / (readings.samples - 1)
    return np.asarray(share * (1.0 - readings.course.is_repeated))


def _of_sums(*names: str, by: Callable[..., Floats] | None = None) -> ReadAt:
    return ReadAt(tuple(f"meters.{SETTLED.name}.{name}" for name in names), by)


_NUMBERS: dict[str, Callable[[Readings], Floats]] = {
    "error": _of_sums("squares", "taken", by=root_mean),
    "missing": _of_sums("total", "taken", by=mean_of),
    "worst": _of_sums("highest_error", "lowest_error", by=farther),
    "span": _of_sums("highest_error", "lowest_error", by=less),
    "wave": _of_sums("reference_squares", "reference_total", "taken", by=deviation),
    "turns": _of_sums("swing.turns", by=count_of),
    "angle_range": _of_sums("highest_angle", "lowest_angle", by=less),
    **{name: _of_sums(name) for name in ("begun", "lowest", "highest", "top", "bottom")},
    "reversals": read_reversals,
    "share_of_hold": read_share_of_hold,
    "extent": ReadAt(("course.largest",)),
}
SETTLED_METRICS = {
    f"settled_{name}": MetricKind(f"settled_{name}", "-", "for verdicts", (), None, read, (SETTLED,))
    for name, read in _NUMBERS.items()
}
"""Metrics of the settled part by name [SI unit of the controlled quantity], used for verdicts only."""


class _PlantarflexionPeaks(NamedTuple):
    """Largest torque in plantarflexion [N m] that a walk requests, and that the actuator gives; 0 without any."""

    requested_peak: float = 0.0
    given_peak: float = 0.0


def start_plantarflexion(_course: ReferenceSummary, sample: Sample) -> _PlantarflexionPeaks:
    """Start the plantarflexion meter at the first sample, which has no request yet."""
    return _PlantarflexionPeaks(given_peak=max(0.0, sample.torque))


def update_plantarflexion(
    state: _PlantarflexionPeaks, _course: ReferenceSummary, sample: Sample
) -> _PlantarflexionPeaks:
    """Update the plantarflexion meter with a sample."""
    requested = sample.reference if is_torque_requested(sample.command, sample.stride.phase) else 0.0
    return _PlantarflexionPeaks(max(state.requested_peak, requested), max(state.given_peak, sample.torque))


_METERS = (MeterKind("plantarflexion", _PlantarflexionPeaks, start_plantarflexion, update_plantarflexion),)
WALK_PEAKS = {
    name: MetricKind(name, "N m", "for verdicts", (), None, read, _METERS, needs=(WALK, REQUESTED))
    for name in _PlantarflexionPeaks._fields
    for read in (ReadAt((f"meters.plantarflexion.{name}",)),)
}
"""Metrics of the peaks of a walk by name, used for verdicts only."""
VERDICT_METRICS = {**SETTLED_METRICS, **WALK_PEAKS}
