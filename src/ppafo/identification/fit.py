"""Estimator: bounded least squares with whitened residuals, confidence intervals, and tests of the model.

Bench procedures and the trajectory fit use the same ``fit``; uncertain quantities are variables with a prior. Variables
are scaled; residuals are divided by the noise of their channel, which is estimated from the residuals. The step of each
finite difference changes all residuals together by three units of noise.
"""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc
from scipy.stats import t as student

from ppafo.errors import IdentificationError
from ppafo.identification.conflict import Conflict, conflict_of, too_smooth
from ppafo.identification.intervals import interval_ends, unidentified
from ppafo.identification.noise import HIGHEST_ORDER, Noise
from ppafo.identification.residuals import FitRuns, FitVariable, Indices, ResidualBlock, Residuals
from ppafo.identification.whitened import Linear, cost_of, linear_at
from ppafo.linear_algebra import on_one_thread
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.faults import noise_of as white_noise_of
from ppafo.signals.faults import off_neighbours, outlying_samples
from ppafo.signals.recording import Floats


@dataclass(frozen=True, slots=True)
class Fit:
    """Result of a fit in SI units, in the order of ``numbers``.

    ``numbers``: variables of the fit. ``values``: estimates. ``covariance``: their covariance. ``low``, ``high``: ends
    of the confidence intervals at ``confidence``. ``noise``: standard deviation by channel. ``correlation``: order of
    the noise autoregression by channel. ``residuals``: measured - model. ``outliers``: rows of residuals left out as
    isolated outliers. ``conflict``: part of the data that contradicts the rest, if any. ``unidentified``: combinations
    that the recordings do not determine, as weights of scaled variables. ``shares``: for each variable, the tolerances
    that contribute to its variance, with fractions [-], largest first. ``evaluations``: number of model runs.
    ``sensors``: noise model by channel. ``jacobian``: whitened Jacobian [1/SI]. ``edge``: unknowns that the search
    drives to values at which no run succeeds, with the direction, 1 upwards or -1 downwards; such a search has not
    converged.
    """

    numbers: tuple[FitVariable, ...]
    values: Floats
    covariance: Floats
    low: Floats
    high: Floats
    noise: Mapping[str, float]
    correlation: Mapping[str, int]
    residuals: Floats
    outliers: tuple[int, ...]
    conflict: Conflict | None
    unidentified: tuple[Mapping[str, float], ...]
    shares: Mapping[str, tuple[tuple[str, float], ...]]
    evaluations: int
    has_converged: bool
    sensors: Mapping[str, Noise]
    jacobian: Floats
    confidence: float
    edge: Mapping[str, int]

    @property
    def by_name(self) -> dict[str, float]:
        """Estimated values by name [SI]."""
        return dict(zip((one.name for one in self.numbers), self.values.tolist(), strict=True))


_LEFT_OUT = 0.01
"""Largest fraction of samples left out [-], for outliers and for samples affected by an event such as an impact."""

_LEVERAGE = 0.1
"""Leverage of a single sample [-] above which the sample is left out."""


_PASSES = 4
"""Largest number of passes of the search; each pass uses the noise estimated by the previous one."""
_SETTLED = 0.03
"""Change of the logarithm of the noise between passes [-] below which the search ends."""
_EVALUATIONS, _FEW_EVALUATIONS = 40, 10
"""Largest number of evaluations in each of the first two passes, and in each later pass."""
_ROUGH, _FINE = 1.0e-3, 1.0e-4
"""Relative decrease of the squares [-] that ends the robust pass and the later passes; later steps are finer."""
_LAST_STEPS = 12
_SHARES = (1.0, 0.3, 0.1)
_GAIN = 0.05
"""Decrease of the sum of squares [-] below which a step after whitening counts as converged."""
_CONVERGED = 0.5
"""Decrease of the squares in the last step [-] below which the search has converged within the standard errors."""

_SHOWN = 0.01
"""Least contribution to the variance [-] for which a tolerance is listed."""
_OTHER_STARTS = 32
"""Number of further start points tried."""


@on_one_thread
def fit(
    residuals: Residuals,
    numbers: Sequence[FitVariable],
    blocks: Sequence[ResidualBlock],
    confidence: float = 0.95,
    report: Report = report_nothing,
    memory: int = HIGHEST_ORDER,
    is_motion: bool = False,
) -> Fit:
    """Return the variables that explain the recordings best, with covariance, intervals and consistency tests.

    Weighted squares are minimised within bounds, at first with a robust loss (soft L1); the weights follow from the
    residuals of each channel. Then residuals are whitened by the noise model of each channel, and Gauss-Newton steps
    follow until none reduces the cost. Another start is used only if it explains the recordings better. ``memory`` is
    the highest order of the noise autoregression, 0 for independent readings. In recordings of motion (``is_motion``)
    sensors may drift, and samples affected by an impact are left out; for bench readings, drift cannot be separated
    from slow signals. Raises IdentificationError if no run succeeds, if there are no more samples than unknowns, or if
    the bounds of a variable do not enclose its start.
    """
    if not numbers or not blocks:
        raise IdentificationError(
            f"a fit needs at least one number and one block of residuals, it has {len(numbers)} and {len(blocks)}"
        )
    for one in numbers:
        if not (one.low <= one.start <= one.high and one.low < one.high):
            raise IdentificationError(
                f"{one.name}: bounds {one.low:g} to {one.high:g} with the start {one.start:g}: the lower must be below "
                "the upper and the start between them"
            )
    work = FitRuns(residuals, tuple(numbers), tuple(blocks), report, memory, is_motion)
    samples = sum(one.rows.stop - one.rows.start for one in blocks)
    sought = sum(math.isinf(one.deviation) for one in numbers)
    if samples <= sought:
        raise IdentificationError(f"{samples} samples for {sought} numbers that are sought; more samples are needed")
    found = _whitened(work, _search(work, work.start), confidence)
    # A right law in its right place has neither.
    if found.conflict is None and found.has_converged:
        return found
    # Where the law is wrong other starts end where the first does: only one that explains more at once is followed.
    for start in _other_starts(work, found):
        report(Progress("fit: another start, which fits better than the first result"))
        other = _whitened(work, _search(work, start), confidence)
        # By more than what the search itself leaves open, so that equal optima do not change the answer.
        if _likelihood(work, other) > _likelihood(work, found) + 1.0:
            found = other
    return replace(found, evaluations=work.evaluations)


def _search(work: FitRuns, start: Floats) -> Floats:
    """Return the approximate least-squares point, alternating between estimation of weights and minimisation."""
    point = np.clip(start, work.low, work.high)
    left, work.outliers = work.one(point), work.outliers[:0]
    if not np.isfinite(left).all():
        raise IdentificationError("no run succeeds at the start values; give others, or check the recordings")
    noise, _ = work.deviations(left[:, None])
    begun = time.monotonic()
    for number in range(_PASSES):
        work.report(Progress("fit", number, _PASSES, noun="passes", elapsed=time.monotonic() - begun))
        weight = 1.0 / noise
        weight[work.outliers] = 0.0

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
        left = work.one(point).copy()
        if number == 0 and work.is_motion:
            work.outliers = _outliers(work, left)
        left[work.outliers] = 0.0
        before, (noise, _) = noise, work.deviations(left[:, None])
        if number and result.status > 0 and float(np.abs(np.log(noise / before)).max()) < _SETTLED:
            break
    return point


def _outliers(work: FitRuns, left: Floats) -> Indices:
    """Return the isolated outliers among the residuals of the robust pass, at most one sample in 100.

    A single outlier near a break-away could otherwise determine a friction. If more samples stand out, the noise has
    heavy tails, and only the largest are left out.
    """
    found, sizes = list[Indices](), list[Floats]()
    for one in work.blocks:
        own = left[one.rows]
        noise = max(white_noise_of(own), float(np.min(one.floor)))
        rows = np.flatnonzero(outlying_samples(own, noise))
        found.append(rows + one.rows.start)
        sizes.append(off_neighbours(own)[rows] / max(noise, 1.0e-300))
    order = np.argsort(-np.concatenate(sizes), kind="stable")[: int(_LEFT_OUT * len(left))]
    return np.sort(np.concatenate(found)[order])


def _settled(work: FitRuns, point: Floats) -> tuple[Floats, Floats, Linear, Floats, float]:
    """Return the point at which Gauss-Newton steps on whitened samples end, starting from a scaled ``point``.

    Returns the scaled variables, the residuals, the linearisation there, the last step tried, and its gain: the
    decrease of the cost; at most 0 if the step was not taken, -inf if no run succeeds there. Outliers are left out and,
    in a fit of motion, also samples of high leverage.
    """
    left = work.one(point)
    work.left_out, is_checked = work.outliers, False
    kept = left.copy()
    kept[work.left_out] = 0.0
    noise, _ = work.deviations(kept[:, None])
    for number in range(_LAST_STEPS):
        linear, step = linear_at(work, point, left, work.jacobian(point, 1.0 / noise))
        noise, cost = linear.noise, cost_of(work, left, point, linear)
        # A step may leave where runs succeed, or overshoot: a shorter one is taken then, one that gains or none.
        for share in _SHARES:
            reached = np.clip(point + share * step, work.low, work.high)
            after = work.one(reached)
            gain = cost - cost_of(work, after, reached, linear) if np.isfinite(after).all() else -math.inf
            if gain > 0.0:
                break
        is_settled = gain < _GAIN
        if (is_settled and (is_checked or not work.is_motion)) or number == _LAST_STEPS - 1:
            break
        if is_settled:
            is_checked = True
            # What a sample near an impact seems to say alone is narrow and false: its slope holds on one side only.
            leverage = np.square(linear.rows[:, 1:] @ linear.root).sum(axis=1)
            highest = np.argsort(-leverage)[: int(_LEFT_OUT * len(leverage))]
            work.left_out = np.union1d(work.outliers, highest[leverage[highest] > _LEVERAGE])
        if gain > 0.0:
            point, left = reached, after
    return point, left, linear, step, gain


def _edge(work: FitRuns, point: Floats, step: Floats) -> dict[str, int]:
    """Return the unknowns for which no run succeeds after a short step from a point, with the sign of the step.

    If every single step succeeds and only their combination fails, all unknowns are returned.
    """
    sought = np.flatnonzero((work.prior == 0.0) & (step != 0.0))
    moved = point[:, None] + _SHARES[-1] * np.diag(step)[:, sought]
    fails = ~np.isfinite(work.at(np.clip(moved, work.low[:, None], work.high[:, None]))).all(axis=0)
    rows = sought[fails] if fails.any() else sought
    return {work.numbers[row].name: int(np.sign(step[row])) for row in rows.tolist()}


def _whitened(work: FitRuns, start: Floats, confidence: float) -> Fit:
    """Return the whitened fit with intervals and consistency tests, starting from a scaled least-squares point."""
    point, left, linear, step, gain = _settled(work, start)
    rows = linear.rows
    known, whitened, errors = linear.sensors, rows[:, 1:], rows[:, 0]
    covariance = linear.root @ linear.root.T
    # Samples less what the numbers took: a tolerance that the readings do not move takes none.
    freedom = max(len(left) - float(np.sum(whitened * (whitened @ covariance))), 1.0)
    low, high = interval_ends(work, point, linear, float(student.ppf(0.5 + 0.5 * confidence, freedom)))
    # At a bound that the squares would leave a number is no longer free, and no group can move it there.
    gradient = errors @ whitened + np.square(work.prior) * (point - work.mean)
    near = 1.0e-6 * np.maximum(1.0, np.abs(point))
    touching = ((point - work.low < near) & (gradient > 0.0)) | ((work.high - point < near) & (gradient < 0.0))
    names = [number.name for number in work.numbers]
    # What is assumed of each number widens the interval of every one by its share of the variance [-].
    fractions = np.square(covariance * work.prior) / np.diag(covariance)[:, None]
    shares = {
        name: tuple((names[other], float(row[other])) for other in np.argsort(-row).tolist() if row[other] >= _SHOWN)
        for name, row in zip(names, fractions, strict=True)
    }
    return Fit(
        numbers=work.numbers,
        values=point * work.scale,
        covariance=covariance * np.outer(work.scale, work.scale),
        low=low * work.scale,
        high=high * work.scale,
        noise={channel: sensor.deviation for channel, sensor in known.items()},
        correlation={channel: len(sensor.reflection) + (sensor.gain > 0.0) for channel, sensor in known.items()},
        residuals=left,
        outliers=tuple(work.outliers.tolist()),
        conflict=conflict_of(work, rows, point, ~touching, freedom) or too_smooth(known),
        unidentified=tuple(unidentified(covariance, names)),
        shares=shares,
        evaluations=work.evaluations,
        # Where every step leaves the region in which runs succeed nothing says that this is the least.
        has_converged=-math.inf < gain < _CONVERGED,
        sensors=known,
        jacobian=whitened / work.scale,
        confidence=confidence,
        edge={} if math.isfinite(gain) else _edge(work, point, step),
    )


def _likelihood(work: FitRuns, found: Fit) -> float:
    """Return the log-likelihood [-] of whitened residuals and priors, up to a constant."""
    size = 0.0
    for one in work.blocks:
        noise, count = found.sensors[one.channel], one.rows.stop - one.rows.start
        size += count * (math.log(noise.deviation) + math.log(noise.innovation))
    return -size - 0.5 * float(np.square((found.values / work.scale - work.mean) * work.prior).sum())


def _other_starts(work: FitRuns, found: Fit) -> Iterator[Floats]:
    """Yield at most two scaled start points that explain the recordings better than the fit does."""
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
