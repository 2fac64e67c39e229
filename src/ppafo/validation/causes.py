"""Search for a single cause that explains recordings whose residuals exceed noise.

A cause is a model of a sensor, y = h(model; a) + e, or another value of a parameter. Causes are tried in stages, from
errors that the samples themselves show to effects that the model lacks; the first stage with a cause that explains all
recordings ends the search. ``candidates.py`` lists them, ``record.py`` computes the residuals under a change.

G = sum over channels of n [ln max(MS0/s^2, 1) - ln max(MSc/s^2, 1)] - k ln N, with MS0 and MSc the mean squared
residuals without and with a change, s the noise of the n samples of a channel, N the number of all samples, and k = 1
for a change with a fitted magnitude, else 0.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import islice
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import chi2

from ppafo.errors import PpafoError
from ppafo.linear_algebra import on_one_thread
from ppafo.parameters.device import Device
from ppafo.progress import Progress, Report, report_nothing
from ppafo.report.kind import Kind
from ppafo.signals.recording import Floats
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.recorded.channels import COMMAND
from ppafo.simulation.recorded.rest import samples_at_rest
from ppafo.simulation.recorded.usual_errors import deviation_of_limit, usual_errors
from ppafo.units.shown import quantity_of_unit
from ppafo.validation.agreement import RecordingAgreement, agreement_of, compare_recording, replay_of
from ppafo.validation.candidates import (
    SENSORS,
    SWAPPED,
    CandidateCause,
    ModelChange,
    effects,
    exchanges,
    joined,
    numbers,
    sizes,
)
from ppafo.validation.measured import MeasuredRecording
from ppafo.validation.record import (
    ONLY_NOISE,
    STEPS,
    Record,
    ScaledResiduals,
    at_rate,
    record_of,
    residuals_of,
    starts_without_wrong,
)
from ppafo.validation.replay import Replay, Replayed, replay_together, replayed_scenario
from ppafo.validation.settings import ANGLE, EXPLAINED_FRACTION, Motion, ReplaySettings
from ppafo.wording import argument_text

_TIMES = {"milliseconds read as seconds": 1.0e3, "seconds read as milliseconds": 1.0e-3}
"""Clock rate [-] that corrects misread times, by kind of mistake."""

_LESS = 0.5
"""Largest remaining fraction of an error above its limit [-] for times in another unit to explain the error."""

_SHORT_INTERVAL = 2.0e-5
"""Longest sample interval [s] that may be milliseconds read as seconds: 50 samples per second or more in truth."""

_AT_REST = 2.0
"""Ratio of the angle's standard deviation to its noise [-] below which the vane may be locked."""

_LONGEST_SEARCHED = 10.0
"""Duration [s] of all recordings up to which a device with a measured angle is searched for causes beside samples."""

_OF_MOTION = ("friction", "foot_plate", "stribeck", "seal_friction")
"""Sections and effects that act on the motion of the vane alone, and say nothing if the angle is prescribed."""

_TRIED_WITH_MEASURED_ANGLE = "faulty samples, errors and units of the pressures, numbers of the set, effects"
_TRIED_IN_LONG_RECORDINGS = "faulty samples alone (the angle is measured, over more than 10 s)"

_NAMED = 3
"""Number of causes that are named where none explains the recordings, the nearest ones."""

_STARTS = (-0.05, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.05)
"""Trial initial values of a channel whose first samples are wrong, as fractions of its range [-].

The two outermost values lie outside the range, and a best fit there is rejected.
"""
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


@dataclass(frozen=True, slots=True, eq=False)
class ResidualCause:
    """Candidate cause at its best magnitude (for ratios, its logarithm), with residuals and gain G [-].

    ``left`` is the largest RMS error of any channel divided by its noise [-] under the cause. ``same`` are other causes
    that the recordings cannot distinguish from this one; of the nearest cause, the two next ones.
    """

    candidate: CandidateCause
    size: float
    residuals: ScaledResiduals
    gain: float
    left: float = math.nan
    same: "tuple[ResidualCause, ...]" = ()

    @property
    def name(self) -> str:
        """Name of the candidate."""
        return self.candidate.name

    @property
    def change(self) -> ModelChange:
        """Change of the model at this magnitude."""
        return self.candidate.at(self.size)

    @property
    def numbers(self) -> dict[str, tuple[float, str]]:
        """Changed parameters by path, each a value with its SI unit."""
        unit = self.candidate.unit
        return {path: (value, unit) for path, value in self.change.numbers.items() if unit}

    @property
    def in_words(self) -> str:
        """Message, with values of the set in display units."""
        said = self.candidate.in_words(self.size)
        for value, unit in self.numbers.values():
            # An atmosphere in gauge pressure says nothing.
            quantity = "pressure change" if unit == "Pa_a" else quantity_of_unit(unit)
            said += f" ({Kind('', '' if unit == '-' else unit, quantity).text(value)})"
        return said

    @property
    def is_of_samples(self) -> bool:
        """True for faulty samples, which are visible without a model."""
        return self.candidate.is_of_samples

    @property
    def is_inside(self) -> bool:
        """True if the magnitude is inside its grid; at an end, a better magnitude may lie beyond."""
        return min(self.candidate.grid) < self.size < max(self.candidate.grid)

    @property
    def is_usual(self) -> bool:
        """True if the magnitude is within the usual error of sensors."""
        return self.candidate.is_usual or 0.0 < abs(self.size) <= self.candidate.usual

    @property
    def explains(self) -> bool:
        """True if the residuals of every channel are noise and G is positive."""
        return self.residuals.is_noise and self.gain > 0.0


class _Slope(NamedTuple):
    """Derivative of all errors divided by noise (all samples,) with respect to the magnitude of a candidate."""

    candidate: CandidateCause
    errors: Floats


@dataclass(frozen=True, slots=True)
class CauseSearch:
    """Recordings of a device on which changes are tried; ``report`` receives the progress."""

    device: Device
    settings: ReplaySettings
    records: list[Record]
    report: Report

    @property
    def penalty(self) -> float:
        """Logarithm of the number of samples: penalty of a fitted magnitude, and least difference of two gains."""
        return math.log(sum(record.values.size for record in self.records))

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
            requests = [[self._request(record, change) for record in self.records] for change in batch]
            valid = [request for row in requests for request in row if request is not None]
            replayed = iter(replay_together(valid))
            for change, row in zip(batch, requests, strict=True):
                results = [None if request is None else next(replayed) for request in row]
                residuals = [
                    residuals_of(record, result, change, self.settings.longest_delay)
                    for record, result in zip(self.records, results, strict=True)
                    if isinstance(result, Replayed)
                ]
                if len(residuals) < len(self.records):
                    evaluated.append(None)
                    continue
                squares = np.concatenate([item.squares for item in residuals])
                errors = np.concatenate([item.errors for item in residuals])
                evaluated.append(ScaledResiduals(squares, errors))
        return evaluated

    def _request(self, record: Record, change: ModelChange) -> Replay | None:
        """Return the replay of a corrected recording on the changed device; None for an invalid device."""
        recording, settings = record.measured.recording, self.settings
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
            starts = starts_without_wrong(record, self.device, change.start)
            settings = replace(settings, initial={**starts, **settings.initial})
        try:
            settings = replace(settings, motion=change.motion or settings.motion)
            request = replay_of(replace(record.measured, recording=recording), self.device, settings)
            device = replace(request.device, effects={**request.device.effects, **change.effects})
            if change.numbers:
                scenario = replace(replayed_scenario(request), device=device)
                device = with_numbers(scenario, change.numbers).device
        except PpafoError:
            return None
        return replace(request, device=device)

    def compared(self, candidates: Sequence[CandidateCause], none: ScaledResiduals) -> list[ResidualCause]:
        """Return each candidate at its best magnitude: the best of a grid, refined by two Gauss-Newton steps.

        ``none`` are the residuals without a change. Candidates whose best magnitude is at an end of the grid are
        rejected.
        """
        best, worse, rising = dict[str, ResidualCause](), dict[str, float](), set[str]()
        trials = [(candidate, size) for candidate in candidates for size in candidate.grid]
        for step in range(STEPS + _OF_BEST + _OF_RISING + 1):
            rising.clear()
            changes = [candidate.at(size) for candidate, size in trials]
            for (candidate, size), residuals in zip(trials, self.evaluated(changes), strict=True):
                if residuals is not None:
                    cause = self._cause(candidate, size, residuals, none)
                    previous = best.get(candidate.name)
                    # Sizes that leave nothing but noise are equal: one inside the grid is known better than its ends.
                    if previous is None or (cause.gain, cause.is_inside) > (previous.gain, previous.is_inside):
                        best[candidate.name] = cause
                        worse.pop(candidate.name, None)
                        if previous is not None and cause.gain - previous.gain > self.penalty:
                            rising.add(candidate.name)
                    elif step:
                        worse[candidate.name] = size
            improved = [cause for cause in best.values() if cause.candidate.has_size]
            if step >= STEPS:
                improved = sorted(improved, key=lambda cause: -cause.gain)[:_BEST]
            if step >= STEPS + _OF_BEST:
                improved = [cause for cause in improved if cause.name in rising]
            trials = self._improved(improved, worse) if step < STEPS + _OF_BEST + _OF_RISING else []
        return [cause for cause in best.values() if cause.is_inside or not cause.candidate.has_size]

    def left_by(self, causes: Sequence[ResidualCause]) -> list[float]:
        """Return the largest RMS error of any channel that each cause leaves, divided by its noise [-].

        It is what a validation finds once the cause is mended, with its rule for the common delay: none at its limit.
        """
        all_requests = [self._request(record, cause.change) for cause in causes for record in self.records]
        requests, left = [request for request in all_requests if request is not None], list[float]()
        replays = zip(requests, replay_together(requests), strict=True)
        for cause in causes:
            change, errors = cause.change, list[float]()
            for request, replayed in islice(replays, len(self.records)):
                assert isinstance(replayed, Replayed), "the search has replayed it"
                corrected = replace(request, measured=_in_step(request.measured, change))
                agreement = agreement_of(corrected, replayed, self.settings, abs(change.delay) or None)
                errors += [channel.in_noise for channel in agreement.channels]
            # Wrong samples are left out of the errors of the search alone.
            left.append(max(errors) if change.start is None else cause.left)
        return left

    def _cause(
        self, candidate: CandidateCause, size: float, residuals: ScaledResiduals, none: ScaledResiduals
    ) -> ResidualCause:
        """Return a candidate at a magnitude with its gain G [-], given the residuals with and without it."""
        counts = np.concatenate([np.full(len(record.channels), record.values.shape[1]) for record in self.records])
        gain = float(counts @ (np.log(np.maximum(none.squares, 1.0)) - np.log(np.maximum(residuals.squares, 1.0))))
        left = math.sqrt(float(residuals.squares.max()))
        return ResidualCause(candidate, size, residuals, gain - self.penalty * candidate.has_size, left)

    def _improved(
        self, causes: Sequence[ResidualCause], worse: Mapping[str, float]
    ) -> list[tuple[CandidateCause, float]]:
        """Return the magnitude of each candidate after a Gauss-Newton step, kept between neighbouring grid points.

        A step that led to a ``worse`` magnitude is taken again, shorter.
        """
        improved = [
            (cause.candidate, cause.size + _SHORTER * (worse[cause.name] - cause.size))
            for cause in causes
            if cause.name in worse
        ]
        causes, ends = [cause for cause in causes if cause.name not in worse], []
        for cause in causes:
            grid = sorted(cause.candidate.grid)
            nearest = int(np.argmin(np.abs(np.array(grid) - cause.size)))
            ends.append((grid[max(0, nearest - 1)], grid[min(len(grid) - 1, nearest + 1)]))
        lengths = [_DIFFERENCE * (high - low) for low, high in ends]
        changes = [cause.candidate.at(cause.size + length) for cause, length in zip(causes, lengths, strict=True)]
        for cause, moved, length, (low, high) in zip(causes, self.evaluated(changes), lengths, ends, strict=True):
            if moved is not None:
                slope = (moved.errors - cause.residuals.errors) / length
                size = cause.size - float(slope @ cause.residuals.errors) / max(float(slope @ slope), _SMALLEST)
                improved.append((cause.candidate, min(max(size, low), high)))
        return improved

    def slopes(
        self, change: ModelChange, residuals: ScaledResiduals, candidates: Sequence[CandidateCause]
    ) -> list[_Slope]:
        """Return the derivatives of the errors under a change, by the magnitude of each additional candidate."""
        # A delay of all sensors is free already, unless the change has one itself.
        is_free = self.settings.longest_delay > 0.0 and not change.has_delay
        # From what is off no straight line leads to a ratio.
        candidates = [item for item in candidates if not (item.is_off or (is_free and item.at(item.grid[0]).has_delay))]
        steps = [_SMALL * min(map(abs, candidate.grid)) for candidate in candidates]
        changes = [joined(change, candidate.at(step)) for candidate, step in zip(candidates, steps, strict=True)]
        return [
            _Slope(candidate, (moved.errors - residuals.errors) / step)
            for candidate, step, moved in zip(candidates, steps, self.evaluated(changes), strict=True)
            if moved is not None
        ]

    def together(self, usual: Sequence[CandidateCause], none: ScaledResiduals) -> list[CandidateCause]:
        """Return the likeliest usual errors of all sensors as a single change; empty if together they are unusual.

        Only errors of single sensors are used; errors of groups would add to them beyond their limits. In each channel
        the sum of the explained errors, squared and divided by its variance, is chi-square distributed; many errors at
        their limits with the same sign are as unlikely as one error beyond its limit.
        """
        slopes = self.slopes(ModelChange(), none, [candidate for candidate in usual if candidate.is_of_bench])
        if not slopes:
            return []
        sizes = _bounded(slopes, none.errors)
        counts = [record.values.shape[1] for record in self.records for _ in record.channels]
        sums = np.add.reduceat(np.stack([slope.errors for slope in slopes], axis=1), np.cumsum([0, *counts[:-1]]))
        deviations = [deviation_of_limit(slope.candidate.usual) for slope in slopes]
        explained = np.square(sums @ sizes)
        squares = explained / np.maximum(np.square(sums * deviations).sum(axis=1), _SMALLEST)
        if len(counts) * float(chi2.sf(squares.max(), 1)) < _UNUSUAL:
            return []
        change = reduce(joined, [slope.candidate.at(size) for slope, size in zip(slopes, sizes, strict=True)])
        words = "zeros, gains and delays of several sensors seem to be off"
        return [CandidateCause("several sensors", words, lambda _: change, (1.0,), usual=1.0)]

    def beside_usual(
        self, slopes: Sequence[_Slope], none: ScaledResiduals, known: Collection[str]
    ) -> list[ResidualCause]:
        """Return unusually large changes that explain the recordings together with usual sensor errors.

        Magnitudes come from a linear fit, and a replay verifies each. Usual errors cost no penalty. Names in ``known``
        are left out.
        """
        usual = [slope for slope in slopes if slope.candidate.is_of_bench]
        sized, changes = list[tuple[CandidateCause, float]](), list[ModelChange]()
        for slope in slopes:
            candidate = slope.candidate
            if candidate.name in known:
                continue
            unbounded = slope._replace(candidate=replace(candidate, usual=math.inf))
            others = [other for other in usual if other is not slope]
            sizes = _bounded([unbounded, *others], none.errors)
            fitted, size = list(zip([slope, *others], sizes, strict=True)), sizes[0]
            errors = none.errors + sum(part * item.errors for item, part in fitted)
            # A straight line leaves some more; what leaves far more is no small change, nor is what its grid does not
            # reach: of a logarithm such a size would be no number any more.
            is_inside = min(candidate.grid) < size < max(candidate.grid)
            if is_inside and float(errors @ errors) < 2.0 * ONLY_NOISE * len(errors) and abs(size) > candidate.usual:
                sized.append((candidate, size))
                changes.append(reduce(joined, [item.candidate.at(part) for item, part in fitted]))
        causes = [
            self._cause(candidate, size, residuals, none)
            for (candidate, size), residuals in zip(sized, self.evaluated(changes), strict=True)
            if residuals is not None
        ]
        return [cause for cause in causes if cause.explains and cause.is_inside]

    def needs_another(self, first: ResidualCause, slopes: Sequence[_Slope]) -> bool:
        """Return whether the residuals left by the first change need a second, unusually large change.

        The test is linear in both magnitudes. The squared error explained by the second change must exceed 2 (ln N + ln
        p) m^2 + e^2, with N samples, p candidates (extended BIC, Chen and Chen 2008), m >= 1 the mean square of the
        errors that remain [-], above 1 for correlated noise, and e^2 the squared integration error of the engine. The
        penalty has ln N for the fitted magnitude and ln N to separate two causes.
        """
        if not slopes:
            return False
        errors = first.residuals.errors
        step = _SMALL * min(map(abs, first.candidate.grid))
        moved = self.evaluated([first.candidate.at(first.size + step)])[0]
        along_first = np.zeros_like(errors) if moved is None else moved.errors - errors
        along_first /= max(float(np.linalg.norm(along_first)), _SMALLEST)
        # Beside a second change the first would have another size: what it can take over is no merit of the second.
        rest = errors - (along_first @ errors) * along_first
        threshold = 2.0 * (self.penalty + math.log(len(slopes)))
        for candidate, slope in slopes:
            across = slope - (along_first @ slope) * along_first
            across_square = float(across @ across)
            # What does the same as the first leaves rounding, along which anything may seem to be explained.
            if across_square > _PARTING * float(slope @ slope):
                along = float(across @ rest)
                explained = along * along / across_square
                noise = max((float(rest @ rest) - explained) / len(errors), 1.0)
                is_larger = abs(along / across_square) > candidate.usual
                if is_larger and explained > self.of_engine + threshold * noise * noise:
                    return True
        return False


def _in_step(measured: MeasuredRecording, change: ModelChange) -> MeasuredRecording:
    """Return a recording without the delays of single sensors that a change supposes."""
    recording = measured.recording
    for name, sensor in change.sensors.items():
        if sensor.delay and name in recording:
            values = np.interp(recording.time + sensor.delay, recording.time, recording[name])
            recording = recording.with_channel(name, values, recording.unit(name))
    return replace(measured, recording=recording)


def _bounded(slopes: Sequence[_Slope], errors: Floats) -> list[float]:
    """Return the most likely magnitude of each candidate within its usual limit, from a linear fit.

    Each usual limit acts as a prior, so that a magnitude on which the errors carry no information stays small. A
    candidate with an infinite usual magnitude is not bounded.
    """
    # In units of its limit, or of its slope, each has one size, whatever its own unit is.
    scales = np.array(
        [
            slope.candidate.usual
            if math.isfinite(slope.candidate.usual)
            else 1.0 / max(float(np.linalg.norm(slope.errors)), _SMALLEST)
            for slope in slopes
        ]
    )
    limits = np.array([1.0 if math.isfinite(slope.candidate.usual) else math.inf for slope in slopes])
    columns = np.stack([slope.errors for slope in slopes], axis=1) * scales
    prior = np.diag(np.where(np.isfinite(limits), 1.0 / deviation_of_limit(1.0), 0.0))
    rows, right_side = np.concatenate([columns, prior]), np.concatenate([-errors, np.zeros(len(limits))])
    sizes: list[float] = (lsq_linear(rows, right_side, (-limits, limits)).x * scales).tolist()
    return sizes


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Result of the search for a cause of a disagreement.

    ``found`` is the cause, if any; ``nearest`` is the best candidate if none explains the recordings. ``tried`` is the
    number of candidates compared, ``kinds`` the kinds of causes where not all were tried. ``is_noise`` is true if the
    residuals are noise, so that no cause is needed.
    """

    found: ResidualCause | None = None
    nearest: ResidualCause | None = None
    tried: int = 0
    is_noise: bool = False
    kinds: str = ""


@on_one_thread
def causes_of(
    read: Sequence[MeasuredRecording],
    agreements: Sequence[RecordingAgreement],
    device: Device,
    settings: ReplaySettings,
    report: Report = report_nothing,
) -> Diagnosis:
    """Return the single cause that explains all recordings together, or a diagnosis without a cause.

    ``agreements`` are the comparisons of the recordings ``read``, in the same order.
    """
    if (other_unit := _in_other_unit(read, agreements, device, settings)) is not None:
        return Diagnosis(other_unit, None, 1)
    records = [
        record_of(measured, agreement, device, settings) for measured, agreement in zip(read, agreements, strict=True)
    ]
    search = CauseSearch(device, settings, records, report)
    none = search.evaluated([ModelChange()])[0]
    if none is None or none.is_noise:
        return Diagnosis(is_noise=none is not None)
    tried = list[ResidualCause]()
    for candidates in (_samples(records), _motions(records, settings)):
        tried += search.compared(candidates, none)
        if any(cause.explains for cause in tried):
            return _explained(search, none, tried, [])
    is_measured = settings.motion == "measured"
    if is_measured and sum(measured.recording.duration for measured in read) > _LONGEST_SEARCHED:
        # Hundreds of replays of a minute each would take minutes of computing time.
        return Diagnosis(tried=len(tried), kinds=_TRIED_IN_LONG_RECORDINGS)
    swaps, sized, lacking = _candidates(read, agreements, device, settings)
    # Errors that any bench has come before a fault, a mistake without a size too: they need no cause.
    of_bench = search.compared([candidate for candidate in sized if candidate.usual], none)
    explaining = [cause for cause in of_bench if cause.explains]
    usual = [cause for cause in explaining if cause.is_usual]
    # A delay that ends at its limit is longer than that, and no error of any bench.
    is_late = any(agreement.delay.is_at_limit for agreement in agreements)
    if not usual and not is_late:
        # Beside pressures that are nearly equal a flow bends: what is small together may fail on straight lines, and
        # not alone. One error beyond its limit explains more than several that strain to add up to it.
        least = max((cause.gain for cause in explaining), default=0.0) - search.penalty
        together = search.compared(search.together([cause.candidate for cause in of_bench], none), none)
        usual = [cause for cause in together if cause.explains and cause.gain > least]
    if usual and not is_late:
        return Diagnosis(_cause_of(usual, search), None, len(tried) + len(of_bench))
    not_of_bench = [candidate for candidate in sized if not candidate.usual]
    for compared, candidates in (([], swaps), (of_bench, [*not_of_bench, *lacking])):
        tried += [*compared, *search.compared(candidates, none)]
        if any(cause.explains for cause in tried):
            return _explained(search, none, tried, sized)
    return _unexplained(search, tried, _TRIED_WITH_MEASURED_ANGLE if is_measured else "")


def _candidates(
    read: Sequence[MeasuredRecording],
    agreements: Sequence[RecordingAgreement],
    device: Device,
    settings: ReplaySettings,
) -> tuple[list[CandidateCause], list[CandidateCause], list[CandidateCause]]:
    """Return exchanged channels and units, errors of a size with numbers of the set, and effects that the model lacks.

    With a measured angle they leave out what changes an input or the motion of the model.
    """
    recordings = [measured.recording for measured in read]
    names = set.intersection(*(set(recording.names) for recording in recordings))
    # A channel moves that departs, measured or modelled, from the atmosphere by more than a zero error.
    moving = {
        name
        for agreement in agreements
        for recording in (agreement.measured, agreement.model)
        for name in recording.names
        if float(np.abs(recording[name] - device.supply.atmospheric_pressure).max()) > usual_errors(name).zero
    }
    units = {name: {item.channels[name].stated for item in recordings if name in item} for name in moving}

    def acts_on_inputs_or_motion(candidate: CandidateCause) -> bool:
        change = candidate.at(candidate.grid[0])
        sections = {path.partition(".")[0] for path in (*change.numbers, *change.effects)}
        has_delay = change.has_delay or any(sensor.delay for sensor in change.sensors.values())
        changed = {COMMAND, ANGLE} & change.sensors.keys() or sections & {*_OF_MOTION}
        return bool(changed or has_delay or change.clock != 1.0)

    # Numbers of the set are compared with sensors: the gain of a command is the area of its valve.
    swaps, sized, lacking = (
        [one for one in stage if not (settings.motion == "measured" and acts_on_inputs_or_motion(one))]
        for stage in (
            exchanges(device, names, units),
            [*sizes(device, names), *numbers(read[0], device, settings)],
            effects(device),
        )
    )
    return swaps, sized, lacking


def _explained(
    search: CauseSearch, none: ScaledResiduals, tried: Sequence[ResidualCause], sized: Sequence[CandidateCause]
) -> Diagnosis:
    """Return the best cause with its alternatives, or a diagnosis without a cause if a second one is needed.

    Some of the causes ``tried`` explain the recordings; ``sized`` are candidates with a magnitude, to combine with one.
    """
    explaining = [cause for cause in tried if cause.explains]
    first = max(explaining, key=lambda cause: cause.gain)
    # What has no size of its own to fit, a swap or a sign, cannot pass for two other changes.
    is_fitted = first.candidate.has_size and not first.candidate.is_of_samples
    # One Jacobian, at the first cause, shows what a second one would add and what could replace it.
    slopes = search.slopes(first.change, first.residuals, sized) if is_fitted else []
    if search.needs_another(first, slopes):
        return Diagnosis(None, first, len(tried))
    # With errors of sensors that any bench has, other small changes may explain as much as one alone.
    others = search.beside_usual(slopes, none, {cause.name for cause in explaining})
    return Diagnosis(_cause_of(explaining, search, others), None, len(tried))


def _unexplained(search: CauseSearch, tried: Sequence[ResidualCause], kinds: str) -> Diagnosis:
    """Return the diagnosis without a cause, with the best of the causes ``tried``, of the ``kinds`` in words."""
    # What is wrong with samples is seen in them, whatever else is wrong; a misread unit is no hint beside other faults.
    hinting = [
        cause
        for cause in tried
        if not cause.candidate.is_of_unit and (cause.gain > 0.0 or cause.candidate.is_of_samples)
    ]
    hints = sorted(
        (replace(cause, left=left) for cause, left in zip(hinting, search.left_by(hinting), strict=True)),
        # Of those that leave the same, numbers of the set come first.
        key=lambda cause: (not cause.is_of_samples, float(f"{cause.left:.2g}"), not cause.numbers, cause.left),
    )
    if not hints:
        return Diagnosis(tried=len(tried), kinds=kinds)
    nearest, *others = hints
    next_ones = tuple(other for other in others if other.is_of_samples == nearest.is_of_samples)[: _NAMED - 1]
    return Diagnosis(nearest=replace(nearest, same=next_ones), tried=len(tried), kinds=kinds)


def _in_other_unit(
    read: Sequence[MeasuredRecording],
    agreements: Sequence[RecordingAgreement],
    device: Device,
    settings: ReplaySettings,
) -> ResidualCause | None:
    """Return milliseconds read as seconds (or the reverse) as cause if the model agrees only with the corrected times.

    With corrected times the model must explain half of the variance of every signal that moves, and every error above
    its limit must fall to less than half. This cause is tried first: with wrong times, all other trials would simulate
    a thousand times, or a thousandth of, the true duration.
    """
    if all(agreement.passes for agreement in agreements):
        return None
    # Hardly any bench samples so often, and a run a thousand times as long is not made for others.
    is_short = max(np.median(np.diff(measured.recording.time)) for measured in read) <= _SHORT_INTERVAL
    name = "seconds read as milliseconds" if is_short else "milliseconds read as seconds"
    rate = _TIMES[name]
    try:
        in_other = [
            compare_recording(replace(measured, recording=at_rate(measured.recording, rate)), device, settings)
            for measured in read
        ]
    except PpafoError:
        return None
    gain, left = 0.0, 0.0
    for as_read, other in zip(agreements, in_other, strict=True):
        for before, after in zip(as_read.channels, other.channels, strict=True):
            is_better = before.passes or after.rms < _LESS * before.rms
            explains = after.passes or after.rms**2 < (1.0 - EXPLAINED_FRACTION) * after.variation**2
            if not (is_better and explains):
                return None
            if before.channel in SENSORS:
                ratio = max(before.in_noise, 1.0) / max(after.in_noise, 1.0)
                gain += 2.0 * len(as_read.measured) * math.log(ratio)
            left = max(left, after.in_noise)
    candidate = CandidateCause(name, f"times seem to be in {name}", lambda rate: ModelChange(clock=rate))
    return ResidualCause(candidate, rate, ScaledResiduals(np.zeros(0), np.zeros(0)), gain, left)


def _samples(records: Sequence[Record]) -> list[CandidateCause]:
    """Return faulty samples of all channels as a single candidate cause; empty without faulty samples."""
    faulty = [record for record in records if record.words]
    if not faulty:
        return []
    has_several = len(records) > 1
    texts = [
        f"{words} ({record.measured.file})" if has_several else words for record in faulty for words in record.words
    ]
    channels = dict.fromkeys(words.split()[0] for record in faulty for words in record.words)
    # Every channel has a sample that a sensor made among those of the start.
    has_start = all(
        bool(record.good[:, : samples_at_rest(record.measured.recording)].any(axis=1).all()) for record in faulty
    )
    return [
        CandidateCause(
            f"samples of {' and '.join(channels)}",
            # No size is shown, and a file's name may have a brace.
            "; ".join(texts).replace("{", "{{").replace("}", "}}"),
            lambda share: ModelChange(start=share),
            (0.0,) if has_start else _STARTS,
            is_usual=all(record.has_few for record in faulty),
            is_of_samples=True,
        )
    ]


def _motions(records: Sequence[Record], settings: ReplaySettings) -> list[CandidateCause]:
    """Another motion as candidate: a locked vane for a recorded angle at rest, else a leg if the motion is free."""
    if settings.motion not in ("free", "leg"):
        return []
    angles = [record.values[record.channels.index(ANGLE)] for record in records if ANGLE in record.channels]
    is_at_rest = all(float(np.std(angle)) < _AT_REST for angle in angles)
    if not angles or (settings.motion == "leg" and not is_at_rest):
        return []
    motion: Motion = "locked" if is_at_rest else "leg"
    seems = "be locked, because its recorded angle is constant" if is_at_rest else "be coupled to a leg"
    words = f"the vane seems to {seems} ({argument_text('motion', motion)})"
    return [CandidateCause("motion", words, lambda _: ModelChange(motion=motion))]


def _cause_of(
    named: Sequence[ResidualCause], search: CauseSearch, others: Sequence[ResidualCause] = ()
) -> ResidualCause:
    """Return the best of the ``named`` causes, with all causes that the recordings cannot distinguish from it.

    These have about the same gain, or differ by no more than the engine errs. ``others`` explain the recordings only
    together with usual sensor errors, and are listed last.
    """
    best, alone = max(named, key=lambda cause: cause.gain), {cause.name for cause in named}

    def is_alike(cause: ResidualCause) -> bool:
        apart = cause.residuals.errors - best.residuals.errors
        return cause.gain > best.gain - search.penalty or float(apart @ apart) <= search.of_engine

    # Of those that the recordings cannot tell apart, numbers of the set come first.
    first, *rest = sorted(
        filter(is_alike, [*named, *others]),
        key=lambda cause: (cause.name not in alone, not cause.change.numbers, -cause.gain),
    )
    return replace(first, same=tuple(rest))
