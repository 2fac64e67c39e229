"""Search for a single cause that explains recordings whose residuals exceed noise.

A cause is a model of a sensor, y = h(model; a) + e, or another value of a parameter. Causes are tried in stages, from
errors that the samples themselves show to effects that the model lacks; the first stage with a cause that explains all
recordings ends the search. ``candidates.py`` lists them, ``record.py`` computes the residuals under a change.

G = sum over channels of n [ln max(MS0/s^2, 1) - ln max(MSc/s^2, 1)] - k ln N, with MS0 and MSc the mean squared
residuals without and with a change, s the noise of the n samples of a channel, N the number of all samples, and k = 1
for a change with a fitted magnitude, else 0.
"""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import reduce
from itertools import islice

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import chi2

from ppafo.errors import PpafoError
from ppafo.linear_algebra import on_one_thread
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.recording import Floats
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.recorded.channels import COMMAND
from ppafo.simulation.recorded.rest import samples_at_rest
from ppafo.simulation.recorded.usual_errors import deviation_of_limit, usual_errors
from ppafo.validation.agreement import RecordingAgreement, agreement_of, compare_recording, replay_of
from ppafo.validation.candidates import Cause, of_effects, of_motion, of_numbers, of_samples, of_sensors
from ppafo.validation.record import (
    ONLY_NOISE,
    SENSORS,
    STEPS,
    SWAPPED,
    UNTRIED,
    ModelChange,
    Record,
    ScaledResiduals,
    at_rate,
    joined,
    record_of,
    residuals_of,
)
from ppafo.validation.replay import Replay, Replayed, replay_together, replayed_scenario
from ppafo.validation.settings import ANGLE, EXPLAINED_FRACTION

_TIMES = {"milliseconds read as seconds": 1.0e3, "seconds read as milliseconds": 1.0e-3}
"""Clock rate [-] that corrects misread times, by kind of mistake."""
_LESS = 0.5
"""Largest remaining fraction of an error above its limit [-] for times in another unit to explain the error."""
_SHORT_INTERVAL = 2.0e-5
"""Longest sample interval [s] that may be milliseconds read as seconds: 50 samples per second or more in truth."""
_LONGEST_SEARCHED = 10.0
"""Duration [s] of all recordings up to which a device with a measured angle is searched for causes beside samples."""
_OF_MOTION = ("friction", "foot_plate", "stribeck", "seal_friction")
"""Sections and effects that act on the motion of the vane alone, and say nothing if the angle is prescribed."""
_TRIED_WITH_MEASURED_ANGLE = "faulty samples, errors and units of the pressures, numbers of the set, effects"
_TRIED_IN_LONG_RECORDINGS = "faulty samples alone (the angle is measured, over more than 10 s)"
_NAMED = 3
"""Number of causes that are named where none explains the recordings, the nearest ones."""
_TOGETHER = 32
"""Number of changes replayed in a batch, which limits memory and sets the rate of progress reports."""
_DIFFERENCE = 0.02
"""Step of a finite difference as a fraction of the distance between two trial magnitudes [-]."""
_BEST, _OF_BEST, _OF_RISING = 6, 2, 4
"""Number of candidates that are nearest after the steps of all, and their further Gauss-Newton steps.

Of these a candidate takes up to four more while each gains more than separates two causes: else a true cause that is
not yet at its best would lose to one that explains almost as much.
"""
_SHORTER = 0.35
"""Length of a step divided by that of one that went too far [-]."""
_SMALL = 0.1
"""Trial magnitude of a second change, relative to the smallest magnitude on its grid [-]."""
_PARTING = 1.0e-4
"""Least squared fraction of a slope [-] orthogonal to the first change, for a second change to be distinct."""
_UNUSUAL = 0.01
"""Probability [-] below which several usual sensor errors together are unusual."""
_SMALLEST = 1.0e-300
"""Lower bound of a sum of squares used as a divisor."""

Slope = tuple[Cause, Floats]
"""Cause, and the derivative of all errors divided by noise (all samples,) with respect to its magnitude."""
_Trial = tuple[Cause, ModelChange, Floats, float]
"""Cause, change that moves its magnitude by a step, errors (all samples,) before, and the step."""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Result of the search for a cause of a disagreement.

    ``found`` is the cause, if any; ``nearest`` is the best candidate if none explains the recordings, ``has_second``
    true if it leaves noise with a second change in it. ``tried`` is the number of candidates compared, ``kinds`` the
    kinds of causes where not all were tried. ``is_noise`` is true if the residuals are noise, so that no cause is
    needed.
    """

    found: Cause | None = None
    nearest: Cause | None = None
    tried: int = 0
    is_noise: bool = False
    kinds: str = ""
    has_second: bool = False


@on_one_thread
def causes_of(agreements: Sequence[RecordingAgreement], report: Report = report_nothing) -> Diagnosis:
    """Return the single cause that explains all recordings together, or a diagnosis without a cause."""
    if (other_unit := _in_other_unit(agreements)) is not None:
        return Diagnosis(other_unit, None, 1)
    records = [record_of(agreement) for agreement in agreements]
    search = CauseSearch(records, report)
    none = search.evaluated([ModelChange()])[0]
    if none is None or none.is_noise:
        return Diagnosis(is_noise=none is not None)
    search = replace(search, none=none)
    tried, motion = list[Cause](), agreements[0].request.settings.motion
    for visible in (of_samples(records), of_motion(records, motion)):
        tried += search.compared([*visible])
        if any(cause.explains for cause in tried):
            return search.explained(tried, [])
    is_measured = motion == "measured"
    if is_measured and sum(agreement.measured.duration for agreement in agreements) > _LONGEST_SEARCHED:
        # Hundreds of replays of a minute each would take minutes of computing time.
        return Diagnosis(tried=len(tried), kinds=_TRIED_IN_LONG_RECORDINGS)
    rows, lacking = _rows(agreements)
    sized = [row for row in rows if row.has_size]
    # Errors that any bench has come before a fault, a mistake without a size too: they need no cause.
    of_bench = search.compared([row for row in sized if row.usual])
    explaining = [cause for cause in of_bench if cause.explains]
    usual = [cause for cause in explaining if cause.is_usual]
    # A delay that ends at its limit is longer than that, and no error of any bench.
    is_late = any(agreement.is_at_limit for agreement in agreements)
    if not usual and not is_late:
        # Beside pressures that are nearly equal a flow bends: what is small together may fail on straight lines, and
        # not alone. One error beyond its limit explains more than several that strain to add up to it.
        least = max((cause.gain for cause in explaining), default=0.0) - search.penalty
        together = search.compared(search.together(of_bench))
        usual = [cause for cause in together if cause.explains and cause.gain > least]
    if usual and not is_late:
        return Diagnosis(search.best_of(usual), None, len(tried) + len(of_bench))
    exchanges, not_of_bench = [row for row in rows if not row.has_size], [row for row in sized if not row.usual]
    for compared, untried in (([], exchanges), (of_bench, [*not_of_bench, *lacking])):
        tried += [*compared, *search.compared(untried)]
        if any(cause.explains for cause in tried):
            return search.explained(tried, sized)
    return search.unexplained(tried, _TRIED_WITH_MEASURED_ANGLE if is_measured else "")


def _rows(agreements: Sequence[RecordingAgreement]) -> tuple[list[Cause], list[Cause]]:
    """Return causes in sensors, clock and numbers of the set, and effects that the model lacks.

    With a measured angle they leave out what changes an input or the motion of the model.
    """
    request = agreements[0].request
    recordings, device = [agreement.measured for agreement in agreements], request.device
    names = set.intersection(*(set(recording.names) for recording in recordings))
    # A channel moves that departs, measured or modelled, from the atmosphere by more than a zero error.
    moving = {
        name
        for recording in (*recordings, *(agreement.model for agreement in agreements))
        for name in recording.names
        if float(np.abs(recording[name] - device.supply.atmospheric_pressure).max()) > usual_errors(name).zero
    }
    units = {name: {item.channels[name].stated for item in recordings if name in item} for name in moving}

    def is_tried(row: Cause) -> bool:
        change = row.at(row.grid[0])
        sections = {path.partition(".")[0] for path in (*change.numbers, *change.effects)}
        has_delay = change.has_delay or any(sensor.delay for sensor in change.sensors.values())
        is_of_input = bool({COMMAND, ANGLE} & change.sensors.keys() or sections & {*_OF_MOTION})
        return request.settings.motion != "measured" or not (is_of_input or has_delay or change.clock != 1.0)

    # Numbers of the set are compared with sensors: the gain of a command is the area of its valve.
    rows = [*of_sensors(device, names, units), *of_numbers(request)]
    return [*filter(is_tried, rows)], [*filter(is_tried, of_effects(device))]


def _in_other_unit(agreements: Sequence[RecordingAgreement]) -> Cause | None:
    """Return milliseconds read as seconds (or the reverse) as cause if the model agrees only with the corrected times.

    With corrected times the model must explain half of the variance of every signal that moves, and every error above
    its limit must fall to less than half. This cause is tried first: with wrong times, all other trials would simulate
    a thousand times, or a thousandth of, the true duration.
    """
    if all(agreement.passes for agreement in agreements):
        return None
    # Hardly any bench samples so often, and a run a thousand times as long is not made for others.
    is_short = max(np.median(np.diff(agreement.measured.time)) for agreement in agreements) <= _SHORT_INTERVAL
    name = "seconds read as milliseconds" if is_short else "milliseconds read as seconds"
    gain, left = 0.0, 0.0
    for as_read in agreements:
        request = as_read.request
        in_other = replace(request.measured, recording=at_rate(as_read.measured, _TIMES[name]))
        try:
            other = compare_recording(in_other, request.device, request.settings)
        except PpafoError:
            return None
        for before, after in zip(as_read.channels, other.channels, strict=True):
            is_better = before.passes or after.rms < _LESS * before.rms
            explains = after.passes or after.rms**2 < (1.0 - EXPLAINED_FRACTION) * after.variation**2
            if not (is_better and explains):
                return None
            if before.channel in SENSORS:
                ratio = max(before.in_noise, 1.0) / max(after.in_noise, 1.0)
                gain += 2.0 * len(as_read.measured) * math.log(ratio)
            left = max(left, after.in_noise)
    words = f"times seem to be in {name}"
    return Cause(name, words, lambda rate: ModelChange(clock=rate), size=_TIMES[name], gain=gain, left=left)


@dataclass(frozen=True, slots=True)
class CauseSearch:
    """Recordings on which changes are tried; ``report`` receives the progress.

    ``none`` are the residuals without a change.
    """

    records: list[Record]
    report: Report
    none: ScaledResiduals = UNTRIED

    @property
    def counts(self) -> list[int]:
        """Number of samples by channel and recording."""
        return [record.values.shape[1] for record in self.records for _ in record.channels]

    @property
    def penalty(self) -> float:
        """Logarithm of the number of samples: penalty of a fitted magnitude, and least difference of two gains."""
        return math.log(sum(self.counts))

    @property
    def of_engine(self) -> float:
        """Squared integration error of the engine, divided by noise and summed over all samples [-]."""
        return sum(float(np.square(record.engine) @ record.good.sum(axis=1)) for record in self.records)

    def evaluated(self, changes: Sequence[ModelChange]) -> list[ScaledResiduals | None]:
        """Return the residuals under each change; None for a device that cannot produce the recordings."""
        evaluated: list[ScaledResiduals | None] = []
        for start in range(0, len(changes), _TOGETHER):
            self.report(Progress("searching for causes", start, len(changes), noun="changes"))
            batch = changes[start : start + _TOGETHER]
            rows = [self._requests(change) for change in batch]
            replayed = iter(replay_together([request for row in rows for request in row]))
            for change, row in zip(batch, rows, strict=True):
                residuals = [
                    residuals_of(record, result, change)
                    for result, record in zip(islice(replayed, len(row)), self.records, strict=False)
                    if isinstance(result, Replayed)
                ]
                is_whole = len(residuals) == len(self.records)
                joint = map(np.concatenate, zip(*residuals, strict=True))
                evaluated.append(ScaledResiduals(*joint) if is_whole else None)
        return evaluated

    def _requests(self, change: ModelChange) -> list[Replay]:
        """Return the replays of the corrected recordings on the changed device; empty for an invalid device."""
        with suppress(PpafoError):
            return [_request(record, change) for record in self.records]
        return []

    def _at(self, cause: Cause, size: float, residuals: ScaledResiduals) -> Cause:
        """Return a cause at a magnitude, with its residuals and its gain G [-]."""
        squares = [np.log(np.maximum(item.squares, 1.0)) for item in (self.none, residuals)]
        gain = float(np.array(self.counts) @ (squares[0] - squares[1])) - self.penalty * cause.has_size
        left = math.sqrt(float(residuals.squares.max()))
        return replace(cause, size=size, residuals=residuals, gain=gain, left=left)

    def compared(self, rows: Sequence[Cause]) -> list[Cause]:
        """Return each cause at its best magnitude: the best of a grid, refined by two Gauss-Newton steps.

        Causes whose best magnitude is at an end of the grid are rejected.
        """
        best, worse, rising = dict[str, Cause](), dict[str, float](), set[str]()
        trials = [(row, size) for row in rows for size in row.grid]
        for step in range(STEPS + _OF_BEST + _OF_RISING + 1):
            rising.clear()
            changes = [row.at(size) for row, size in trials]
            for (row, size), residuals in zip(trials, self.evaluated(changes), strict=True):
                if residuals is not None:
                    cause, previous = self._at(row, size, residuals), best.get(row.name)
                    # Sizes that leave nothing but noise are equal: one inside the grid is known better than its ends.
                    if previous is None or (cause.gain, cause.is_inside) > (previous.gain, previous.is_inside):
                        best[row.name] = cause
                        worse.pop(row.name, None)
                        if previous is not None and cause.gain - previous.gain > self.penalty:
                            rising.add(row.name)
                    elif step:
                        worse[row.name] = size
            improved = [cause for cause in best.values() if cause.has_size]
            if step >= STEPS:
                improved = sorted(improved, key=lambda cause: -cause.gain)[:_BEST]
            if step >= STEPS + _OF_BEST:
                improved = [cause for cause in improved if cause.name in rising]
            if step == STEPS + _OF_BEST + _OF_RISING:
                break
            # A step that went too far is taken again, shorter; the others end between neighbours on their grids.
            trials = [
                (cause, cause.size + _SHORTER * (worse[cause.name] - cause.size))
                for cause in improved
                if cause.name in worse
            ]
            ends, moved = dict[str, tuple[float, float]](), list[_Trial]()
            for cause in (cause for cause in improved if cause.name not in worse):
                grid = sorted(cause.grid)
                nearest = int(np.argmin(np.abs(np.array(grid) - cause.size)))
                low, high = ends[cause.name] = grid[max(0, nearest - 1)], grid[min(len(grid) - 1, nearest + 1)]
                length = _DIFFERENCE * (high - low)
                moved.append((cause, cause.at(cause.size + length), cause.residuals.errors, length))
            for cause, slope in self._slopes(moved):
                (low, high), square = ends[cause.name], max(float(slope @ slope), _SMALLEST)
                trials.append((cause, min(max(cause.size - float(slope @ cause.residuals.errors) / square, low), high)))
        return [cause for cause in best.values() if cause.is_inside or not cause.has_size]

    def _slopes(self, trials: Sequence[_Trial]) -> list[Slope]:
        """Return the derivatives of the errors by the magnitude of each cause that can be replayed."""
        moved = self.evaluated([change for _, change, _, _ in trials])
        return [
            (cause, (residuals.errors - errors) / step)
            for (cause, _, errors, step), residuals in zip(trials, moved, strict=True)
            if residuals is not None
        ]

    def slopes(self, change: ModelChange, errors: Floats, rows: Sequence[Cause]) -> list[Slope]:
        """Return the derivatives of the ``errors`` under a change, by the magnitude of each additional cause."""
        # A delay of all sensors is free already, unless the change has one itself.
        is_free = self.records[0].agreement.request.settings.longest_delay > 0.0 and not change.has_delay
        trials = list[_Trial]()
        for row in rows:
            # From what is off no straight line leads to a ratio.
            if not (row.is_off or (is_free and row.at(row.grid[0]).has_delay)):
                step = _SMALL * min(map(abs, row.grid))
                trials.append((row, joined(change, row.at(step)), errors, step))
        return self._slopes(trials)

    def together(self, of_bench: Sequence[Cause]) -> list[Cause]:
        """Return the likeliest usual errors of all sensors as a single change; empty if together they are unusual.

        Only errors of single sensors are used; errors of groups would add to them beyond their limits. In each channel
        the sum of the explained errors, squared and divided by its variance, is chi-square distributed; many errors at
        their limits with the same sign are as unlikely as one error beyond its limit.
        """
        slopes = self.slopes(ModelChange(), self.none.errors, [cause for cause in of_bench if cause.is_of_bench])
        if not slopes:
            return []
        sizes = _bounded(slopes, self.none.errors)
        places = np.cumsum([0, *self.counts[:-1]])
        sums = np.add.reduceat(np.stack([slope for _, slope in slopes], axis=1), places)
        deviations = [deviation_of_limit(cause.usual) for cause, _ in slopes]
        explained = np.square(sums @ sizes)
        squares = explained / np.maximum(np.square(sums * deviations).sum(axis=1), _SMALLEST)
        if len(self.counts) * float(chi2.sf(squares.max(), 1)) < _UNUSUAL:
            return []
        change = reduce(joined, [cause.at(size) for (cause, _), size in zip(slopes, sizes, strict=True)])
        words = "zeros, gains and delays of several sensors seem to be off"
        return [Cause("several sensors", words, lambda _: change, (1.0,), usual=1.0)]

    def needs_another(self, first: Cause, slopes: Sequence[Slope]) -> bool:
        """Return whether the residuals left by the first change need a second, unusually large change.

        The test is linear in both magnitudes. The squared error explained by the second change must exceed 2 (ln N + ln
        p) m^2 + e^2, with N samples, p candidates (extended BIC, Chen and Chen 2008), m >= 1 the mean square of the
        errors that remain [-], above 1 for correlated noise, and e^2 the squared integration error of the engine. The
        penalty has ln N for the fitted magnitude and ln N to separate two causes.
        """
        if not slopes:
            return False
        # A tangent: of a logarithm the sizes themselves are no measure.
        errors, step = first.residuals.errors, _DIFFERENCE * float(np.diff(sorted(first.grid)).min())
        moved = self._slopes([(first, first.at(first.size + step), errors, 1.0)])
        along_first = moved[0][1] if moved else np.zeros_like(errors)
        along_first /= max(float(np.linalg.norm(along_first)), _SMALLEST)
        # Beside a second change the first would have another size: what it can take over is no merit of the second.
        rest = errors - (along_first @ errors) * along_first
        threshold = 2.0 * (self.penalty + math.log(len(slopes)))
        for cause, slope in slopes:
            across = slope - (along_first @ slope) * along_first
            across_square = float(across @ across)
            # A cause with the effect of the first leaves rounding, along which anything may seem to be explained.
            if across_square > _PARTING * float(slope @ slope):
                along = float(across @ rest)
                explained = along * along / across_square
                noise = max((float(rest @ rest) - explained) / len(errors), 1.0)
                is_larger = abs(along / across_square) > cause.usual
                if is_larger and explained > self.of_engine + threshold * noise * noise:
                    return True
        return False

    def explained(self, tried: Sequence[Cause], sized: Sequence[Cause]) -> Diagnosis:
        """Return the best cause with its alternatives, or a diagnosis without a cause if a second one is needed.

        Some of the causes ``tried`` explain the recordings; ``sized`` are causes with a magnitude, to combine with one.
        Alternatives are also unusually large changes that explain the recordings together with usual sensor errors,
        which cost no penalty: their magnitudes come from a linear fit, and a replay verifies each.
        """
        explaining = [cause for cause in tried if cause.explains]
        first, known = max(explaining, key=lambda cause: cause.gain), {cause.name for cause in explaining}
        # A cause without a size to fit, a swap or a sign, cannot pass for two other changes.
        is_fitted = first.has_size and not first.is_of_samples
        # One Jacobian, at the first cause, shows what a second one would add and what could replace it.
        slopes = self.slopes(first.fitted, first.residuals.errors, sized) if is_fitted else []
        if self.needs_another(first, slopes):
            return Diagnosis(None, first, len(tried), has_second=True)
        none, usual = self.none.errors, [item for item in slopes if item[0].is_of_bench]
        larger, changes = list[tuple[Cause, float]](), list[ModelChange]()
        for cause, slope in (item for item in slopes if item[0].name not in known):
            others = [item for item in usual if item[0] is not cause]
            sizes = _bounded([(replace(cause, usual=math.inf), slope), *others], none)
            fitted, size = list(zip([(cause, slope), *others], sizes, strict=True)), sizes[0]
            errors = none + sum(part * item for (_, item), part in fitted)
            # A straight line leaves some more; what leaves far more is no small change, nor is what its grid does not
            # reach: of a logarithm such a size would be no number any more.
            is_inside = min(cause.grid) < size < max(cause.grid)
            if is_inside and float(errors @ errors) < 2.0 * ONLY_NOISE * len(errors) and abs(size) > cause.usual:
                larger.append((cause, size))
                changes.append(reduce(joined, [item.at(part) for (item, _), part in fitted]))
        beside = [
            self._at(cause, size, residuals)
            for (cause, size), residuals in zip(larger, self.evaluated(changes), strict=True)
            if residuals is not None
        ]
        together = [cause for cause in beside if cause.explains and cause.is_inside]
        return Diagnosis(self.best_of(explaining, together), None, len(tried))

    def best_of(self, named: Sequence[Cause], others: Sequence[Cause] = ()) -> Cause:
        """Return the best of the ``named`` causes, with all causes that the recordings cannot distinguish from it.

        These have about the same gain, or differ by no more than the engine errs. ``others`` explain the recordings
        only together with usual sensor errors, and are listed last.
        """
        best, alone = max(named, key=lambda cause: cause.gain), {cause.name for cause in named}

        def is_alike(cause: Cause) -> bool:
            apart = cause.residuals.errors - best.residuals.errors
            return cause.gain > best.gain - self.penalty or float(apart @ apart) <= self.of_engine

        # Of those that the recordings cannot tell apart, numbers of the set come first.
        first, *rest = sorted(
            filter(is_alike, [*named, *others]),
            key=lambda cause: (cause.name not in alone, not cause.fitted.numbers, -cause.gain),
        )
        return replace(first, same=tuple(rest))

    def unexplained(self, tried: Sequence[Cause], kinds: str) -> Diagnosis:
        """Return the diagnosis without a cause, with the best of the causes ``tried``, of the ``kinds`` in words."""
        # Wrong samples are seen in themselves, whatever else is wrong; a misread unit is no hint beside others.
        hinting = [cause for cause in tried if not cause.is_of_unit and (cause.gain > 0.0 or cause.is_of_samples)]
        hints = sorted(
            (replace(cause, left=left) for cause, left in zip(hinting, self.left_by(hinting), strict=True)),
            # Of those that leave the same, numbers of the set come first.
            key=lambda cause: (not cause.is_of_samples, float(f"{cause.left:.2g}"), not cause.numbers, cause.left),
        )
        if not hints:
            return Diagnosis(tried=len(tried), kinds=kinds)
        nearest, *others = hints
        next_ones = tuple(other for other in others if other.is_of_samples == nearest.is_of_samples)[: _NAMED - 1]
        return Diagnosis(nearest=replace(nearest, same=next_ones), tried=len(tried), kinds=kinds)

    def left_by(self, causes: Sequence[Cause]) -> list[float]:
        """Return the largest RMS error of any channel that each cause leaves, divided by its noise [-].

        It is what a validation finds once the cause is mended, with its rule for the common delay: none at its limit.
        """
        rows, left = [self._requests(cause.fitted) for cause in causes], list[float]()
        replays = iter(replay_together([request for row in rows for request in row]))
        for cause, row in zip(causes, rows, strict=True):
            change, errors = cause.fitted, list[float]()
            for request, record, replayed in zip(row, self.records, islice(replays, len(row)), strict=True):
                assert isinstance(replayed, Replayed), "the search has replayed it"
                recording = request.measured.recording
                for name, sensor in change.sensors.items():
                    if sensor.delay and name in recording:
                        values = np.interp(recording.time + sensor.delay, recording.time, recording[name])
                        recording = recording.with_channel(name, values, recording.unit(name))
                in_step = replace(request.measured, recording=recording)
                corrected = replace(request, measured=in_step, settings=record.agreement.request.settings)
                agreement = agreement_of(corrected, replayed, abs(change.delay) or None)
                errors += [channel.in_noise for channel in agreement.channels]
            # Wrong samples are left out of the errors of the search alone.
            left.append(max(errors) if change.start is None else cause.left)
        return left


def _request(record: Record, change: ModelChange) -> Replay:
    """Return the replay of a corrected recording on the changed device. Raises PpafoError for an invalid device.

    Without its faulty samples a channel starts from the mean of the valid ones, or from the share of its range that the
    change states.
    """
    request = record.agreement.request
    measured, device, settings = request.measured, request.device, request.settings
    recording, initial = measured.recording, dict(settings.initial)
    for name, sensor in change.sensors.items():
        if name in recording:
            values = sensor.true(recording[name])
            values = np.clip(values, -1.0, 1.0) if name == COMMAND else values
            recording = recording.with_channel(name, values, recording.unit(name))
    if change.is_swapped:
        swapped = {name: recording[other] for name, other in SWAPPED.items()}
        for name, values in swapped.items():
            recording = recording.with_channel(name, values, recording.unit(name))
    if change.clock != 1.0:
        recording = at_rate(recording, change.clock)
    if change.start is not None:
        actuator, supply, count = device.actuator, device.supply, samples_at_rest(measured.recording)
        for name, values, good in zip(record.channels, record.values * record.noise[:, None], record.good, strict=True):
            valid = values[:count][good[:count] > 0.0]
            if name in SENSORS and len(valid) < count:
                low, high = supply.atmospheric_pressure, max(supply.pressure, supply.dorsiflexion_pressure)
                if name == ANGLE:
                    low, high = actuator.angle_min, actuator.angle_max
                initial.setdefault(name, float(valid.mean()) if len(valid) else low + change.start * (high - low))
    settings = replace(settings, initial=initial, motion=change.motion or settings.motion)
    request = replay_of(replace(measured, recording=recording), device, settings)
    device = replace(request.device, effects={**request.device.effects, **change.effects})
    if change.numbers:
        scenario = replace(replayed_scenario(request), device=device)
        device = with_numbers(scenario, change.numbers).device
    return replace(request, device=device)


def _bounded(slopes: Sequence[Slope], errors: Floats) -> list[float]:
    """Return the most likely magnitude of each cause within its usual limit, from a linear fit.

    Each usual limit acts as a prior, so that a magnitude on which the errors carry no information stays small. A cause
    with an infinite usual magnitude is not bounded.
    """
    limits = np.array([cause.usual for cause, _ in slopes])
    # In units of its limit, or of its slope, each has one size, whatever its own unit is.
    norms = np.array([max(float(np.linalg.norm(slope)), _SMALLEST) for _, slope in slopes])
    scales, limits = np.where(np.isfinite(limits), limits, 1.0 / norms), np.where(np.isfinite(limits), 1.0, math.inf)
    columns = np.stack([slope for _, slope in slopes], axis=1) * scales
    prior = np.diag(np.where(np.isfinite(limits), 1.0 / deviation_of_limit(1.0), 0.0))
    rows, right_side = np.concatenate([columns, prior]), np.concatenate([-errors, np.zeros(len(limits))])
    sizes: list[float] = (lsq_linear(rows, right_side, (-limits, limits)).x * scales).tolist()
    return sizes
