"""Search for a cause: residuals under model changes, best magnitude of each change, and combined changes.

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
from ppafo.parameters.device import Device
from ppafo.progress import Progress, Report
from ppafo.report.kind import Kind
from ppafo.signals.recording import Floats
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.recorded.channels import COMMAND
from ppafo.simulation.recorded.usual_errors import deviation_of_limit
from ppafo.units.shown import quantity_of_unit
from ppafo.validation.agreement import agreement_of, replay_of
from ppafo.validation.candidates import SWAPPED, CandidateCause, ModelChange, joined
from ppafo.validation.measured import MeasuredRecording
from ppafo.validation.record import (
    ONLY_NOISE,
    STEPS,
    Record,
    ScaledResiduals,
    at_rate,
    residuals_of,
    starts_without_wrong,
)
from ppafo.validation.replay import Replay, Replayed, replay_together, replayed_scenario
from ppafo.validation.settings import ReplaySettings

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
