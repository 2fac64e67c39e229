"""The one estimator: bounded least squares with whitened residuals, and what the residuals say against the model.

Bench procedures and the trajectory fit are residuals of the same ``fit``; what nobody knows exactly is a number with a
prior. Numbers are moved in units of their scale; residuals are in units of the noise of their channel, which is
estimated from them. Each difference of the Jacobian is as long as changes the residuals by three units of noise in all.
"""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, lsq_linear
from scipy.signal import lfilter
from scipy.stats import chi2, qmc
from scipy.stats import f as fisher
from scipy.stats import t as student

from ppafo.errors import IdentificationError
from ppafo.linear_algebra import on_one_thread
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.recording import Floats

Mask = NDArray[np.bool_]
Residuals = Callable[[Floats], Floats]
"""Measured less model [SI] (rows, points) at points [SI] (numbers, points), as one batch; NaN where a run fails."""


@dataclass(frozen=True, slots=True)
class Free:
    """A number that the fit moves: start, bounds and typical size ``scale``, SI units.

    ``deviation`` is the standard deviation of its prior about its start; infinite for a number that is sought, finite
    for a tolerance. Tolerances of one ``family``, such as friction in each recording, are tested together.
    """

    name: str
    start: float
    low: float
    high: float
    scale: float
    deviation: float = math.inf
    family: str = ""


@dataclass(frozen=True, slots=True)
class Block:
    """Rows of the residuals that are one channel of one recording or a part of it, in the order of time.

    ``floor`` is the error of the engine, or of the resolution [SI], below which no residual says anything: one for all
    rows, or each row's. ``shared`` is an error [SI] by row that all rows of the recording have at once, as one normal
    deviate times it. ``groups`` are further groups, such as a branch, whose numbers are compared with the numbers of
    all.
    """

    recording: str
    channel: str
    rows: slice
    floor: float | Floats = 0.0
    shared: Floats | None = None
    groups: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise of a channel: standard deviation [SI], and what makes it white: an autoregression or a level that drifts.

    ``reflection`` are coefficients [-] of the autoregression (Burg). ``gain`` [-] is the part of each innovation by
    which a level moves that drifts as a random walk beside white noise, 0 for none. ``innovation`` is the size of what
    nothing foretells over the deviation [-].
    """

    deviation: float
    reflection: tuple[float, ...] = ()
    gain: float = 0.0
    innovation: float = 1.0


@dataclass(frozen=True, slots=True)
class Conflict:
    """A sensor, a recording, a channel of one, a group or a stated value that alone wants other numbers than all.

    It is Hausman's test. ``group`` is "pressure_1", "back", "pressure_1 of back", "rising branch" or ``STATED``.
    ``number`` is the one that parts most, by so many ``standard_errors``; ``p`` is the chance, over all groups, that a
    model that holds shows as much.
    """

    group: str
    number: str
    standard_errors: float
    p: float


@dataclass(frozen=True, slots=True)
class Fit:
    """What recordings say of numbers, SI units, in the order of ``numbers``.

    ``low`` and ``high`` are intervals at the confidence, ``noise`` standard deviations and ``correlation`` orders of
    the autoregression by channel, ``residuals`` measured less model. ``unidentified`` are combinations, as weights of
    numbers in units of their scale, that the recordings do not fix; ``shares`` has for each number the
    tolerances that widen its interval, largest first, as fractions of the variance. ``jacobian`` is whitened [1/SI].
    """

    numbers: tuple[Free, ...]
    values: Floats
    covariance: Floats
    low: Floats
    high: Floats
    noise: Mapping[str, float]
    correlation: Mapping[str, int]
    residuals: Floats
    conflict: Conflict | None
    unidentified: tuple[Mapping[str, float], ...]
    shares: Mapping[str, tuple[tuple[str, float], ...]]
    evaluations: int
    has_converged: bool
    sensors: Mapping[str, Noise]
    jacobian: Floats
    confidence: float

    @property
    def by_name(self) -> dict[str, float]:
        """The numbers by name [SI]."""
        return dict(zip((one.name for one in self.numbers), self.values.tolist(), strict=True))


SMOOTH = "noise"
"""Number of a conflict whose channel leaves what is too smooth for noise: ``standard_errors`` times its innovation."""

STATED = "stated limit"
"""Group of a conflict that is not among recordings: they want a tolerance beyond its limit."""

_UNITS_OF_NOISE = 3.0
"""Change of all residuals together, in units of noise, that a difference makes."""

_STEPS = (1.0e-7, 1.0e-3)
"""Shortest and longest difference over the scale of a number."""

_HIGHEST_ORDER = 12
SAMPLES_PER_COEFFICIENT = 100
"""Samples for each coefficient of the autoregression at least; 100 white ones then get none in 7 of 10 fits."""
_LARGEST_REFLECTION = 1.0 - 1.0e-9
"""Of residuals that follow a law exactly, such as a constant's: no innovation would be left."""

_GAINS = tuple(2.0**-power for power in range(1, 9))
"""Gains of a level that are tried; with less it would not move within some hundred samples."""

_SMOOTHEST = 0.15
"""Innovation [-] below which residuals are no noise: that of a sensor with a first order lag of 90 samples.

Noise with a lag of 33 samples, 0.24, is estimated down to 0.19 in two recordings of 500.
"""

_LEFT_OUT = 0.01
"""Largest fraction of the samples that are left out because an event, such as an impact, passes them."""

_OF_ANY_SIZE = 1.0e8
"""Standard deviation of an error of which nothing is known, over the noise [-]."""

_LEVERAGE = 0.1
"""Share of a combination of numbers that one sample decides alone from which it is left out."""


_PASSES = 4
_ROUNDS = 20
_SETTLED = 0.03
_EVALUATIONS, _FEW_EVALUATIONS = 40, 10
_ROUGH, _FINE = 1.0e-3, 1.0e-4
"""Relative gain of squares that ends the robust pass, and those after it; the steps after whitening are finer."""
_LAST_STEPS = 12
_SHARES = (1.0, 0.3, 0.1)
_GAIN = 0.05
"""Steps after whitening, the fractions of one that are tried, and the sum of squares [-] below which one is no gain."""
_CONVERGED = 0.5
"""Gain of the last step [-] below which the numbers are where they would end, within a fraction of their errors."""
_SIGNIFICANCE = 0.01
_PARTING = 0.05
"""Fraction of the covariance of all by which a group's alone must be larger for its direction to be tested."""

_RANK = 1.0e-13
"""Eigenvalue [-] of scaled numbers from which they are seen."""

_UNKNOWN = 0.5
"""Standard error of a combination over the scales of its numbers from which it is not identifiable."""

_SHOWN = 0.01
_OTHER_STARTS = 32


@on_one_thread
def fit(
    residuals: Residuals,
    numbers: Sequence[Free],
    blocks: Sequence[Block],
    confidence: float = 0.95,
    report: Report = report_nothing,
    memory: int = _HIGHEST_ORDER,
    is_motion: bool = False,
) -> Fit:
    """Return the numbers that explain recordings best, their covariance and whether the recordings agree on them.

    Squares are minimised within bounds, at first with a loss that is robust (soft L1); weights follow from what is left
    in each channel. Then residuals are whitened by the noise of each channel and the numbers step on until none gains.
    Another start is followed only where it explains more than where the first ended. ``memory`` is the highest order
    of the autoregression, 0 for readings that were taken one by one. In recordings of motion (``is_motion``) sensors
    may drift, and samples that an impact passes are left out; what a bench reads moves as slowly as its sensors
    drift. IdentificationError where no run succeeds, and where samples are no more than the numbers that are sought,
    and for bounds that leave a number no room about its start.
    """
    if not numbers or not blocks:
        raise IdentificationError(f"a fit of {len(numbers)} numbers to {len(blocks)} blocks: each needs at least one")
    for one in numbers:
        if not (one.low <= one.start <= one.high and one.low < one.high):
            raise IdentificationError(
                f"{one.name}: bounds {one.low:g} to {one.high:g} with the start {one.start:g}: the lower must be below "
                "the upper and the start between them"
            )
    work = _Work(residuals, tuple(numbers), tuple(blocks), report, memory, is_motion)
    samples, sought = (
        sum(one.rows.stop - one.rows.start for one in blocks),
        sum(math.isinf(one.deviation) for one in numbers),
    )
    if samples <= sought:
        raise IdentificationError(f"{samples} samples for {sought} numbers that are sought; more samples are needed")
    found = _whitened(work, _search(work, work.start), confidence)
    # A right law in its right place has neither.
    if found.conflict is None and found.has_converged:
        return found
    # Where the law is wrong other starts end where the first does: only one that explains more at once is followed.
    for start in _other_starts(work, found):
        report(Progress("fit: another start, which explains more than where the first ended"))
        other = _whitened(work, _search(work, start), confidence)
        # By more than what the search itself leaves open, so that equal optima do not change the answer.
        if _likelihood(work, other) > _likelihood(work, found) + 1.0:
            found = other
    return replace(found, evaluations=work.evaluations)


class _Work:
    """Runs of a fit in scaled numbers, with the last one kept."""

    def __init__(
        self,
        residuals: Residuals,
        numbers: tuple[Free, ...],
        blocks: tuple[Block, ...],
        report: Report,
        memory: int,
        is_motion: bool,
    ) -> None:
        self.residuals, self.numbers, self.blocks, self.report = residuals, numbers, blocks, report
        self.memory, self.is_motion = memory, is_motion
        self.scale = np.array([one.scale for one in numbers])
        self.start, self.low, self.high, deviation = (
            np.array([getattr(one, name) for one in numbers]) / self.scale
            for name in ("start", "low", "high", "deviation")
        )
        self.prior = 1.0 / deviation
        self.mean = self.start
        self.evaluations = 0
        self.least: dict[str, float] = {}
        self.step = np.full(len(numbers), _STEPS[1])
        self.left_out = np.zeros(0, dtype=np.intp)
        self._last: tuple[bytes, Floats] | None = None

    def at(self, points: Floats) -> Floats:
        """Return residuals [SI] (rows, points) at scaled points (numbers, points)."""
        self.evaluations += points.shape[1]
        return self.residuals(points * self.scale[:, None])

    def one(self, point: Floats) -> Floats:
        """Return residuals [SI] at a scaled point, which is run once."""
        key = point.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self.at(point[:, None])[:, 0]
        return self._last[1]

    def jacobian(self, point: Floats, weight: Floats, *, is_central: bool = True) -> Floats:
        """Return the derivative of the residuals [SI] by scaled numbers, differences of one batch.

        ``weight`` [1/SI] by row sets the lengths of the differences of the next one. Differences to one side take half
        the runs, and say well enough where to search.
        """
        above, below = np.minimum(point + self.step, self.high), np.maximum(point - self.step, self.low)
        sides = [above, below] if is_central else [np.where(above - point >= point - below, above, below)]
        values = self.at(np.concatenate([point[:, None] + np.diag(side - point) for side in sides], axis=1))
        centre, count = self.one(point), len(point)
        slopes = np.empty((len(centre), count))
        for place in range(count):
            tried = [(float(side[place]), values[:, place + number * count]) for number, side in enumerate(sides)]
            ran = [(end, own) for end, own in tried if np.isfinite(own).all()]
            if not is_central and not ran:
                return self.jacobian(point, weight)
            (up, last), (down, first) = [*ran, (float(point[place]), centre)][:2]
            # Neither side runs: at a bound, or where a device is none.
            if up == down:
                free = self.numbers[place]
                raise IdentificationError(
                    f"{free.name}: no run succeeds near {point[place] * free.scale:.6g}; give other bounds or "
                    "another start"
                )
            slopes[:, place] = (last - first) / (up - down)
        # With a thousandth of the number 7 of 16 intervals held, with thirty units of noise 11, with three 28.
        sizes = np.linalg.norm(slopes * weight[:, None], axis=0)
        self.step = np.clip(_UNITS_OF_NOISE / np.maximum(sizes, 1.0e-300), *_STEPS)
        return slopes

    def rows_of(self, channel: str) -> list[slice]:
        """Return the rows of a channel in each recording."""
        return [one.rows for one in self.blocks if one.channel == channel]

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels, each once."""
        return tuple(dict.fromkeys(one.channel for one in self.blocks))

    def shared(self) -> Floats:
        """Return the errors [SI] that rows of a recording share, a column for each recording that has some."""
        names = dict.fromkeys(one.recording for one in self.blocks if one.shared is not None)
        columns = np.zeros((self.blocks[-1].rows.stop, len(names)))
        for place, name in enumerate(names):
            for one in self.blocks:
                if one.recording == name and one.shared is not None:
                    columns[one.rows, place] = one.shared
        return columns

    def deviations(self, series: Floats) -> tuple[Floats, dict[str, float]]:
        """Return the noise [SI] of each row, and by channel, pooled over its recordings; no less than the floor.

        ``series`` are residuals, and in further columns what the error of the numbers may hide of them.
        """
        found, by_channel = np.empty(len(series)), {}
        for channel in self.channels:
            own = np.concatenate([series[rows] for rows in self.rows_of(channel)])
            pooled = math.sqrt(float(np.square(own).sum()) / len(own))
            # Of its own size at the start: channels have units of their own, and a law may fit exactly.
            least = self.least.setdefault(channel, 1.0e-12 * (float(np.abs(own[:, 0]).max()) or 1.0))
            blocks = [one for one in self.blocks if one.channel == channel]
            by_channel[channel] = max(pooled, least, float(np.min(blocks[0].floor)))
            for one in blocks:
                found[one.rows] = np.maximum(max(pooled, least), one.floor)
        return found, by_channel


def _search(work: _Work, start: Floats) -> Floats:
    """Return about the least squares, weights and squares in turn until both stay."""
    point = np.clip(start, work.low, work.high)
    left = work.one(point)
    if not np.isfinite(left).all():
        raise IdentificationError("no run succeeds at the start values; give others, or check the recordings")
    noise, _ = work.deviations(left[:, None])
    begun = time.monotonic()
    for number in range(_PASSES):
        work.report(Progress("fit", number, _PASSES, noun="passes", elapsed=time.monotonic() - begun))
        weight = 1.0 / noise

        def weighted(x: Floats, weight: Floats = weight) -> Floats:
            return np.concatenate([work.one(x) * weight, (x - work.mean) * work.prior])

        def slopes(x: Floats, weight: Floats = weight) -> Floats:
            return np.concatenate(
                [work.jacobian(x, weight, is_central=not work.is_motion) * weight[:, None], np.diag(work.prior)]
            )

        # The first pass is robust: a number can lose its gradient at a bound while the clock is still wrong.
        result = least_squares(
            weighted,
            point,
            slopes,
            (work.low, work.high),
            method="trf",
            x_scale="jac",
            xtol=1.0e-9,
            gtol=None,
            ftol=_FINE if number else _ROUGH,
            loss="linear" if number else "soft_l1",
            max_nfev=_FEW_EVALUATIONS if number > 1 else _EVALUATIONS,
        )
        point = np.asarray(result.x)
        before, (noise, _) = noise, work.deviations(work.one(point)[:, None])
        if number and result.status > 0 and float(np.abs(np.log(noise / before)).max()) < _SETTLED:
            break
    return point


def burg(series: Sequence[Floats], highest: int = _HIGHEST_ORDER) -> tuple[float, ...]:
    """Return the reflection coefficients [-] of one autoregression of several series (Burg), as many as AIC wants.

    Columns of a series (samples, columns) add up, as its residuals and their error do. There is at most one coefficient
    for each 100 samples: with more, the misfit of a law that is wrong passes for noise in the few readings of a bench,
    and nothing is flagged. So correlated noise of fewer samples is not seen, and its intervals are too narrow.
    """
    forward, backward = list(series), list(series)
    count = sum(len(one) for one in series)
    power, found, best = 1.0, [], (0.0, 0)
    for order in range(1, min(highest, count // SAMPLES_PER_COEFFICIENT, min(len(one) for one in series) - 2) + 1):
        ahead, behind = [one[1:] for one in forward], [one[:-1] for one in backward]
        across = sum(float(np.sum(a * b)) for a, b in zip(ahead, behind, strict=True))
        size = sum(float(np.sum(a * a + b * b)) for a, b in zip(ahead, behind, strict=True))
        # Residuals of 0 throughout, of a law without noise, have no memory.
        if size <= 0.0:
            break
        found.append(max(-_LARGEST_REFLECTION, min(_LARGEST_REFLECTION, 2.0 * across / size)))
        forward = [a - found[-1] * b for a, b in zip(ahead, behind, strict=True)]
        backward = [b - found[-1] * a for a, b in zip(ahead, behind, strict=True)]
        power *= 1.0 - found[-1] ** 2
        best = min(best, (count * math.log(max(power, 1.0e-300)) + 2.0 * order, order))
    return tuple(found[: best[1]])


def noise_of(series: Sequence[Floats], highest: int = _HIGHEST_ORDER, may_drift: bool = True) -> Noise:
    """Return the noise of several series [-] as AIC wants it: an autoregression, or a random walk beside white noise.

    That is a slow drift, where it ``may_drift``, for which an autoregression needs many coefficients. Columns add up,
    as for ``burg``.
    """
    count, size = sum(len(one) for one in series), sum(float(np.square(one).sum()) for one in series)
    # What is less than the floor is the engine's, and no noise.
    if size < 0.5 * count:
        return Noise(1.0)
    reflection = burg(series, highest)
    found = Noise(1.0, reflection, 0.0, math.sqrt(math.prod(1.0 - one * one for one in reflection)))
    best = 2.0 * count * math.log(found.innovation) + 2.0 * len(reflection)
    for gain in _GAINS if may_drift and count >= SAMPLES_PER_COEFFICIENT else ():
        innovation = math.sqrt(sum(float(np.square(_without_level(one, gain)).sum()) for one in series) / size)
        criterion = 2.0 * count * math.log(innovation) + 2.0
        if criterion < best:
            best, found = criterion, Noise(1.0, (), gain, innovation)
    return found


def _without_level(values: Floats, gain: float) -> Floats:
    """Return the innovations of white noise beside a random walk: the Kalman filter of a local level, settled."""
    return np.asarray(lfilter([1.0, -1.0], [1.0, gain - 1.0], values, axis=0))


def whiten(values: Floats, noise: Noise) -> Floats:
    """Return columns (samples, columns) [SI] of one recording as innovations [-] of the noise of their channel."""
    forward = values / noise.deviation
    if noise.gain > 0.0:
        return _without_level(forward, noise.gain) / noise.innovation
    backward, power = forward.copy(), 1.0
    done = forward.copy()
    for order, one in enumerate(noise.reflection, start=1):
        forward, backward = forward[1:] - one * backward[:-1], backward[:-1] - one * forward[1:]
        power *= 1.0 - one * one
        done[order:] = forward / math.sqrt(power)
    return done


class _Linear(NamedTuple):
    """Residuals and Jacobian whitened [-] side by side, root of the covariance of scaled numbers, noise by channel.

    ``shared`` are columns [-] of what rows have in common: errors of all samples of a recording, and samples that are
    left out. Rows less ``shared`` times their products with it have errors that are independent.
    """

    rows: Floats
    shared: Floats
    root: Floats
    noise: Floats
    sensors: dict[str, Noise]


def _linear(work: _Work, point: Floats, left: Floats, slopes: Floats) -> tuple[_Linear, Floats]:
    """Return the problem whitened at a point, and the step to its least squares within the bounds.

    What the numbers absorb of the noise is missing in the residuals; its expectation J C J' is added until both agree
    (expectation and maximisation), so that slow noise is not taken for little noise.
    """
    step, hidden = np.zeros(len(point)), np.zeros((len(left), 0))
    limits = work.low - point - 1.0e-300, work.high - point + 1.0e-300
    # A sample with a number of its own, of no known size, says nothing: so it is left out of any noise.
    own_numbers = np.zeros((len(left), len(work.left_out)))
    own_numbers[work.left_out, np.arange(len(work.left_out))] = _OF_ANY_SIZE
    common = work.shared()
    for _ in range(_ROUNDS):
        series = np.column_stack([left + slopes @ step, hidden])
        series[work.left_out] = 0.0
        noise, sizes = work.deviations(series)
        known, scaled = {}, np.column_stack([left, slopes, common]) / noise[:, None]
        rows = np.column_stack([scaled, own_numbers])
        for channel in work.channels:
            own = work.rows_of(channel)
            kind = noise_of([series[one] / noise[one, None] for one in own], work.memory, work.is_motion)
            known[channel] = replace(kind, deviation=sizes[channel])
            for one in own:
                rows[one] = whiten(rows[one], kind)
        # With D = U S V' the covariance is 1 + D D', and 1 - U (1 - 1 / sqrt(1 + S^2)) U' makes it 1.
        axes, triangle = np.linalg.qr(rows[:, 1 + len(point) :])
        turned, spread, _ = np.linalg.svd(triangle)
        shared = axes @ (turned * np.sqrt(1.0 - 1.0 / np.hypot(1.0, spread)))
        rows = rows[:, : 1 + len(point)]
        rows = rows - shared @ (shared.T @ rows)
        root, _ = _root_of_inverse(rows[:, 1:].T @ rows[:, 1:] + np.diag(np.square(work.prior)))
        hidden = slopes @ root
        before = step
        solved = lsq_linear(
            np.concatenate([rows[:, 1:], np.diag(work.prior)]),
            -np.concatenate([rows[:, 0], (point - work.mean) * work.prior]),
            limits,
            method="bvls",
        )
        step = np.asarray(solved.x)
        if np.abs((step - before) @ np.linalg.pinv(root)).max() < 0.01 and series.shape[1] > 1:
            break
    return _Linear(rows=rows, shared=shared, root=root, noise=noise, sensors=known), step


def _root_of_inverse(curvature: Floats) -> tuple[Floats, Mask]:
    """Return a matrix whose product with its transpose is the inverse, and which of its columns are seen at all.

    The others are large, of numbers or combinations that nothing fixes.
    """
    sizes = np.sqrt(np.maximum(np.diag(curvature), 0.0))
    size = np.where(sizes > 1.0e-9 * sizes.max(initial=0.0), sizes, sizes.max(initial=1.0e-9) or 1.0)
    values, vectors = np.linalg.eigh(curvature / size / size[:, None])
    return np.asarray(vectors / np.sqrt(np.maximum(values, _RANK)) / size[:, None]), np.asarray(values > _RANK)


def _whitened(work: _Work, point: Floats, confidence: float) -> Fit:
    """Return the fit after whitening and Gauss-Newton steps from the least squares."""
    left = work.one(point)
    (noise, _), is_checked = work.deviations(left[:, None]), False
    work.left_out = work.left_out[:0]
    for number in range(_LAST_STEPS):
        linear, step = _linear(work, point, left, work.jacobian(point, 1.0 / noise))
        noise, cost = linear.noise, _cost(work, left, point, linear)
        # A step may leave where runs succeed, or overshoot: a shorter one is taken then, one that gains or none.
        for share in _SHARES:
            reached = np.clip(point + share * step, work.low, work.high)
            after = work.one(reached)
            gain = cost - _cost(work, after, reached, linear) if np.isfinite(after).all() else -math.inf
            if gain > 0.0:
                break
        settled = gain < _GAIN
        if (settled and (is_checked or not work.is_motion)) or number == _LAST_STEPS - 1:
            break
        if settled:
            is_checked = True
            # What a sample near an impact seems to say alone is narrow and false: its slope holds on one side only.
            leverage = np.square(linear.rows[:, 1:] @ linear.root).sum(axis=1)
            highest = np.argsort(-leverage)[: int(_LEFT_OUT * len(leverage))]
            work.left_out = highest[leverage[highest] > _LEVERAGE]
        if gain > 0.0:
            point, left = reached, after
    rows = linear.rows
    known, whitened, errors = linear.sensors, rows[:, 1:], rows[:, 0]
    covariance = linear.root @ linear.root.T
    # Samples less what the numbers took: a tolerance that the readings do not move takes none.
    freedom = max(len(left) - float(np.sum(whitened * (whitened @ covariance))), 1.0)
    wide = float(student.ppf(0.5 + 0.5 * confidence, freedom)) * np.sqrt(np.diag(covariance))
    # At a bound that the squares would leave a number is no longer free, and no group can move it there.
    gradient = errors @ whitened + np.square(work.prior) * (point - work.mean)
    near = 1.0e-6 * np.maximum(1.0, np.abs(point))
    touching = ((point - work.low < near) & (gradient > 0.0)) | ((work.high - point < near) & (gradient < 0.0))
    names = [one.name for one in work.numbers]
    fractions = np.square(covariance * work.prior) / np.diag(covariance)[:, None]
    return Fit(
        numbers=work.numbers,
        values=point * work.scale,
        covariance=covariance * np.outer(work.scale, work.scale),
        low=np.maximum(point - wide, work.low) * work.scale,
        high=np.minimum(point + wide, work.high) * work.scale,
        noise={channel: one.deviation for channel, one in known.items()},
        correlation={channel: len(one.reflection) + (one.gain > 0.0) for channel, one in known.items()},
        residuals=left,
        conflict=_conflict(work, rows, point, ~touching, freedom) or _too_smooth(known),
        unidentified=tuple(_unidentified(covariance, names)),
        shares={
            names[place]: tuple(
                (names[at], float(fractions[place, at]))
                for at in np.argsort(-fractions[place]).tolist()
                if fractions[place, at] >= _SHOWN
            )
            for place in range(len(names))
        },
        evaluations=work.evaluations,
        has_converged=gain < _CONVERGED,
        sensors=known,
        jacobian=whitened / work.scale,
        confidence=confidence,
    )


def _cost(work: _Work, left: Floats, point: Floats, linear: _Linear) -> float:
    """Return the sum of squares [-] of whitened residuals and priors."""
    scaled = (left / linear.noise)[:, None]
    kinds = {channel: replace(one, deviation=1.0) for channel, one in linear.sensors.items()}
    errors = np.concatenate([whiten(scaled[one.rows], kinds[one.channel]) for one in work.blocks])
    errors = errors - linear.shared @ (linear.shared.T @ errors)
    return float(np.square(errors).sum()) + float(np.square((point - work.mean) * work.prior).sum())


def _groups(work: _Work) -> Iterator[tuple[str, list[slice]]]:
    """Return sensors, recordings, channels of recordings and further groups, none of them twice nor the whole."""
    labels = [(one.channel, one.recording, f"{one.channel} of {one.recording}", *one.groups) for one in work.blocks]
    seen = {tuple((one.rows.start, one.rows.stop) for one in work.blocks)}
    for column in zip(*labels, strict=True):
        for name in dict.fromkeys(column):
            rows = [one.rows for one, label in zip(work.blocks, column, strict=True) if label == name]
            key = tuple((one.start, one.stop) for one in rows)
            if key not in seen:
                seen.add(key)
                yield name, rows


def _too_smooth(sensors: Mapping[str, Noise]) -> Conflict | None:
    """Return the channel whose residuals are least like noise, None where all are like noise."""
    channel, noise = min(sensors.items(), key=lambda item: item[1].innovation)
    return Conflict(channel, SMOOTH, 1.0 / noise.innovation, 0.0) if noise.innovation < _SMOOTHEST else None


def _conflict(work: _Work, rows: Floats, point: Floats, free: Mask, freedom: float) -> Conflict | None:
    """Return the group of rows that wants other numbers most, None where no group does (Hausman's test).

    A group alone would go by d = -H_g^-1 (J_g' r_g + P (z - m)), whose covariance is H_g^-1 - C. With C = L L' and the
    eigenvalues a of L' H_g L, both are diagonal: d'(H_g^-1 - C)^-1 d is the sum of q^2 / (a (1 - a)).
    """
    errors, slopes = rows[:, 0], rows[:, 1:][:, free]
    prior, shift = np.square(work.prior[free]), (point - work.mean)[free]
    root, seen = _root_of_inverse(slopes.T @ slopes + np.diag(prior))
    root = root[:, seen]
    variance = np.square(root).sum(axis=1)
    groups, found = list(_groups(work)), None
    names = np.array([one.name for one in work.numbers])[free]
    count_of_tests = len(groups) + int((prior > 0.0).sum())
    for name, own in groups:
        part = np.concatenate([slopes[one] for one in own])
        pull = part.T @ np.concatenate([errors[one] for one in own]) + prior * shift
        alone, turned = np.linalg.eigh(root.T @ (part.T @ part + np.diag(prior)) @ root)
        # In other directions the group is nearly all that is known, or says nothing: both differences are 0 over 0.
        tested = (alone > 1.0e-6) & (alone < 1.0 / (1.0 + _PARTING))
        count = int(tested.sum())
        if not count:
            continue
        alone, axes = alone[tested], root @ turned[:, tested]
        along = axes.T @ pull
        statistic = float(np.sum(np.square(along) / (alone * (1.0 - alone))))
        p = min(float(fisher.sf(statistic / count, count, freedom)) * count_of_tests, 1.0)
        if p < _SIGNIFICANCE and (found is None or p < found.p):
            moved = np.abs(axes @ (along / alone))
            spread = np.sqrt(np.square(axes) @ (1.0 / alone - 1.0))
            # A number of which the group says nothing moves by rounding alone. Along one direction all part as far.
            ratios = np.where(spread > 1.0e-6 * np.sqrt(variance), moved / np.maximum(spread, 1.0e-300), 0.0)
            most = int(np.argmax(ratios > (1.0 - 1.0e-6) * ratios.max()))
            found = Conflict(group=name, number=str(names[most]), standard_errors=float(ratios[most]), p=p)
    # What is stated of a tolerance is a group of its own: its mean parts from the fit by deviation^2 - C.
    own_variance = 1.0 / np.maximum(prior, 1.0e-300) - variance
    for place in np.flatnonzero((prior > 0.0) & (own_variance >= _PARTING * variance)).tolist():
        ratio = abs(float(shift[place])) / math.sqrt(float(own_variance[place]))
        p = min(2.0 * float(student.sf(ratio, freedom)) * count_of_tests, 1.0)
        if p < _SIGNIFICANCE and (found is None or p < found.p):
            found = Conflict(group=STATED, number=str(names[place]), standard_errors=ratio, p=p)
    families = np.array([one.family for one in work.numbers])[free]
    for family in dict.fromkeys(families[prior > 0.0].tolist()):
        members = np.flatnonzero((families == family) & (prior > 0.0))
        if family and len(members) > 1 and found is None:
            found = _of_family(
                names[members],
                shift[members] * np.sqrt(prior[members]),
                root[members] * np.sqrt(prior[members])[:, None],
            )
    return found


def _of_family(names: NDArray[np.str_], moved: Floats, root: Floats) -> Conflict | None:
    """Return the tolerance of a family that parts most where all of it are beyond their limits, one by one or together.

    ``moved`` are tolerances, ``root`` a root of their covariance, both over their standard deviations [-]. Where two
    numbers are sought of them, two directions are free.
    """
    known, axes = np.linalg.eigh(np.eye(len(names)) - root @ root.T)
    tested = known > _PARTING
    count = int(tested.sum())
    if not count:
        return None
    # What is stated is known, and no estimate: so this is chi-square, not F.
    p = float(chi2.sf(float(np.sum(np.square(axes.T @ moved)[tested] / known[tested])), count))
    ratios = np.abs(moved) / np.sqrt(np.maximum(1.0 - np.square(root).sum(axis=1), _PARTING))
    most = int(np.argmax(ratios))
    return Conflict(STATED, str(names[most]), float(ratios[most]), p) if p < _SIGNIFICANCE else None


def _unidentified(covariance: Floats, names: Sequence[str]) -> Iterator[dict[str, float]]:
    """Return combinations of scaled numbers whose standard error is above half their scale, as weights."""
    variances, vectors = np.linalg.eigh(covariance)
    for variance, vector in zip(variances[::-1].tolist(), vectors.T[::-1], strict=True):
        if math.sqrt(max(variance, 0.0)) > _UNKNOWN:
            largest = float(vector[np.argmax(np.abs(vector))])
            weights = {name: float(one) / largest for name, one in zip(names, vector, strict=True)}
            yield {name: one for name, one in weights.items() if abs(one) >= 0.1}


def _likelihood(work: _Work, found: Fit) -> float:
    """Return the logarithm of the likelihood [-] of whitened residuals and priors, but for a constant."""
    size = 0.0
    for one in work.blocks:
        noise, count = found.sensors[one.channel], one.rows.stop - one.rows.start
        size += count * (math.log(noise.deviation) + math.log(noise.innovation))
    return -size - 0.5 * float(np.square((found.values / work.scale - work.mean) * work.prior).sum())


def _other_starts(work: _Work, found: Fit) -> Iterator[Floats]:
    """Return scaled starts for the numbers that are sought that explain more than a fit: at most two of a batch."""
    sought = ~(work.prior > 0.0)
    point = found.values / work.scale
    low, high = np.maximum(work.low, -1.0e3)[sought], np.minimum(work.high, 1.0e3)[sought]
    is_ratio = (low > 0.0) & (high > 10.0 * low)
    with np.errstate(invalid="ignore", divide="ignore"):
        ends = [np.where(is_ratio, np.log(end), end) for end in (low, high)]
    # Seeded, so that the same recordings give the same numbers.
    drawn = qmc.Sobol(int(sought.sum()), seed=1).random(_OTHER_STARTS).T
    drawn = ends[0][:, None] + drawn * (ends[1] - ends[0])[:, None]
    points = np.repeat(point[:, None], _OTHER_STARTS + 1, axis=1)
    points[sought, :-1] = np.where(is_ratio[:, None], np.exp(np.where(is_ratio[:, None], drawn, 0.0)), drawn)
    left = work.at(points)
    noise = np.concatenate([np.full(one.rows.stop - one.rows.start, found.noise[one.channel]) for one in work.blocks])
    costs = np.sum(np.log1p(np.square(left / noise[:, None])), axis=0)
    costs[~np.isfinite(costs)] = np.inf
    # The last is where the fit ended.
    yield from (points[:, place] for place in np.argsort(costs)[:2].tolist() if costs[place] < costs[-1])
