"""Estimator: bounded least squares with whitened residuals, confidence intervals, and tests of the model.

Bench procedures and the trajectory fit use the same ``fit``; uncertain quantities are variables with a prior. Variables
are scaled; residuals are divided by the noise of their channel, which is estimated from the residuals. The step of each
finite difference changes all residuals together by three units of noise.
"""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import chi2, norm, qmc
from scipy.stats import f as fisher
from scipy.stats import t as student

from ppafo.errors import IdentificationError
from ppafo.identification.estimate import NAMED, UNKNOWN, Estimate, Verdict, in_shown_unit, relative_half_width
from ppafo.identification.least_squares import (
    SHORT,
    FitNumber,
    FitRuns,
    Flags,
    Indices,
    Linear,
    ResidualBlock,
    Residuals,
    best_along,
    cost_of,
    fall_of,
    interval_ends,
    linear_at,
    root_of_inverse,
    unidentified,
)
from ppafo.identification.noise import HIGHEST_ORDER, Noise
from ppafo.linear_algebra import on_one_thread
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.faults import noise_of as white_noise_of
from ppafo.signals.faults import off_neighbours, outlying_samples
from ppafo.signals.recording import Floats
from ppafo.wording import percentage

SMOOTH = "noise"
"""Marker in ``Conflict.number`` for residuals too smooth to be noise; ``standard_errors`` is then 1 / innovation."""
SHAPE = "shape"
"""Marker in ``Conflict.number`` for residuals whose neighbours have the same sign; the law has another shape."""
STATED = "stated limit"
"""Marker in ``Conflict.group`` for recordings that contradict the stated limit of a tolerance."""
_SMOOTHEST = 0.15
"""Relative innovation [-] below which residuals do not count as noise; a first-order lag of 90 samples gives 0.15.

Noise with a lag of 33 samples, 0.24, is estimated down to 0.19 in two recordings of 500 samples.
"""
_SEVERAL = {"readings", "commands"}
"""Last words of group names that are plural."""
_SIGNIFICANCE = 0.01
"""Significance level [-] of a difference between estimates."""
_BY_CHANCE = 0.001
"""Significance level [-] of residuals that follow each other, about 3.1 standard errors of their correlation."""
_PARTING = 0.05
"""Smallest relative excess of a group's variance over the common variance [-] for a direction to be tested."""
_LEFT_OUT = 0.01
"""Largest fraction of samples left out [-], for outliers and for samples affected by an event such as an impact."""
_LEVERAGE = 0.1
"""Leverage of a single sample [-] above which the sample is left out."""
_EVALUATIONS = 40
"""Largest number of residual evaluations in each pass of the search."""
_ROUGH, _FINE = 1.0e-3, 1.0e-4
"""Relative decrease of the squares [-] that ends the robust pass of the search, and the second pass."""
_STEPS = 40
"""Largest number of Gauss-Newton steps on whitened samples."""
_GAIN = 1.0e-4
"""Decrease of the squares [-] below which a point is their minimum: a hundredth of a standard error."""
_CONVERGED = 0.5
"""Decrease of the squares in the last step [-] below which the search has converged within the standard errors."""
_AT_BOUND = 1.0e-6
"""Largest distance of a variable from its bound [-] that counts as at the bound, relative above 1."""
_OWN_SHARE = 0.2
"""Weight in an undetermined combination [-] from which a number itself counts as not identifiable."""
_NEAR = 1.0e-3
"""Distance from a bound [widths of the interval] up to which an estimate counts as at its bound."""
_NONE = 0.1
"""Upper end of an interval that begins at zero [typical magnitudes], below which the part is none."""
_BETTER = 1.0
"""Increase of the log-likelihood [-] above which another start replaces the result; equal optima do not."""
_OTHER_STARTS = 32
"""Number of additional start points tried if the first fit is inconsistent or has not converged."""


@dataclass(frozen=True, slots=True)
class Conflict:
    """Part of the data whose separate estimates differ significantly from the common estimates (Hausman's test).

    ``group`` is a sensor ("pressure_1"), a recording ("back"), a channel of a recording ("pressure_1 of back"), another
    group ("rising branch"), or ``STATED``. ``number`` is the quantity that differs most, by ``standard_errors``
    standard errors. ``p`` is the probability of such a difference in any group if the model is right.
    """

    group: str
    number: str
    standard_errors: float
    p: float


def _groups(runs: FitRuns) -> Iterator[tuple[str, list[slice]]]:
    """Yield name and rows of every sensor, recording, channel of a recording and named group, without duplicates."""
    labels = [
        (block.channel, block.recording, f"{block.channel} of {block.recording}", *block.groups)
        for block in runs.blocks
    ]
    known = {tuple((block.rows.start, block.rows.stop) for block in runs.blocks)}
    for column in zip(*labels, strict=True):
        for name in dict.fromkeys(column):
            rows = [block.rows for block, label in zip(runs.blocks, column, strict=True) if label == name]
            key = tuple((part.start, part.stop) for part in rows)
            if key not in known:
                known.add(key)
                yield name, rows


def wrong_shape(sensor: str, series: Sequence[Floats]) -> Conflict | None:
    """Return a conflict if neighbouring residuals of a sensor follow each other, as noise does not; else None.

    ``series`` are residuals divided by their noise [-], each in order of what the law predicts. Their correlation with
    the next one times the root of the count is standard normal under white noise.
    """
    size = sum(float(values @ values) for values in series)
    count = sum(values.size - 1 for values in series)
    # Residuals below the floor are rounding, and no noise.
    if count < 1 or size < 0.5 * sum(values.size for values in series):
        return None
    errors = sum(float(values[1:] @ values[:-1]) for values in series) / size * math.sqrt(count)
    p = float(norm.sf(errors))
    return Conflict(sensor, SHAPE, errors, p) if p < _BY_CHANCE else None


def conflict_of(runs: FitRuns, rows: Floats, point: Floats, free: Flags, freedom: float) -> Conflict | None:
    """Return the group of rows whose separate estimates differ most from the common estimates; None if insignificant.

    Hausman's test: the estimate of a group alone differs by d = -H_g^-1 (J_g' r_g + P (z - m)), with covariance H_g^-1
    - C. With C = L L' and the eigenvalues a of L' H_g L, both are diagonal: d'(H_g^-1 - C)^-1 d is the sum of q^2 / (a
    (1 - a)).
    """
    errors, slopes = rows[:, 0], rows[:, 1:][:, free]
    prior, shift = np.square(runs.prior[free]), (point - runs.start)[free]
    root, seen = root_of_inverse(slopes.T @ slopes + np.diag(prior))
    root = root[:, seen]
    variance = np.square(root).sum(axis=1)
    groups, worst = list(_groups(runs)), None
    names = np.array([number.name for number in runs.numbers])[free]
    count_of_tests = len(groups) + int((prior > 0.0).sum())
    for name, parts in groups:
        group = np.concatenate([slopes[part] for part in parts])
        pull = group.T @ np.concatenate([errors[part] for part in parts]) + prior * shift
        alone, turned = np.linalg.eigh(root.T @ (group.T @ group + np.diag(prior)) @ root)
        # In other directions the group is nearly all that is known, or says nothing: both differences are 0 over 0.
        tested = (alone > 1.0e-6) & (alone < 1.0 / (1.0 + _PARTING))
        count = int(tested.sum())
        if not count:
            continue
        alone, axes = alone[tested], root @ turned[:, tested]
        along = axes.T @ pull
        statistic = float(np.sum(np.square(along) / (alone * (1.0 - alone))))
        p = min(float(fisher.sf(statistic / count, count, freedom)) * count_of_tests, 1.0)
        if p < _SIGNIFICANCE and (worst is None or p < worst.p):
            moved = np.abs(axes @ (along / alone))
            spread = np.sqrt(np.square(axes) @ (1.0 / alone - 1.0))
            # A number of which the group says nothing moves by rounding alone. Along one direction all part as far.
            ratios = np.where(spread > 1.0e-6 * np.sqrt(variance), moved / np.maximum(spread, 1.0e-300), 0.0)
            most = int(np.argmax(ratios > (1.0 - 1.0e-6) * ratios.max()))
            worst = Conflict(group=name, number=str(names[most]), standard_errors=float(ratios[most]), p=p)
    # The stated value of a tolerance is a group of its own: its mean parts from the fit by deviation^2 - C.
    own_variance = 1.0 / np.maximum(prior, 1.0e-300) - variance
    for index in np.flatnonzero((prior > 0.0) & (own_variance >= _PARTING * variance)).tolist():
        ratio = abs(float(shift[index])) / math.sqrt(float(own_variance[index]))
        p = min(2.0 * float(student.sf(ratio, freedom)) * count_of_tests, 1.0)
        if p < _SIGNIFICANCE and (worst is None or p < worst.p):
            worst = Conflict(group=STATED, number=str(names[index]), standard_errors=ratio, p=p)
    families = np.array([number.family for number in runs.numbers])[free]
    for family in dict.fromkeys(families[prior > 0.0].tolist()):
        members = np.flatnonzero((families == family) & (prior > 0.0))
        if family and len(members) > 1 and worst is None:
            worst = _of_family(
                names[members],
                shift[members] * np.sqrt(prior[members]),
                root[members] * np.sqrt(prior[members])[:, None],
            )
    return worst


def _of_family(names: NDArray[np.str_], moved: Floats, root: Floats) -> Conflict | None:
    """Return the most exceeded stated limit of a family of tolerances, None if the family as a whole is consistent.

    ``moved`` are the estimated tolerances and ``root`` is a square root of their covariance, both divided by the prior
    standard deviations [-]. Directions that the unknowns of the fit absorb are not tested.
    """
    known, axes = np.linalg.eigh(np.eye(len(names)) - root @ root.T)
    tested = known > _PARTING
    count = int(tested.sum())
    if not count:
        return None
    # Stated deviations are known, not estimated: so this is chi-square, not F.
    p = float(chi2.sf(float(np.sum(np.square(axes.T @ moved)[tested] / known[tested])), count))
    ratios = np.abs(moved) / np.sqrt(np.maximum(1.0 - np.square(root).sum(axis=1), _PARTING))
    most = int(np.argmax(ratios))
    return Conflict(STATED, str(names[most]), float(ratios[most]), p) if p < _SIGNIFICANCE else None


@dataclass(frozen=True, slots=True)
class Fit:
    """Result of a fit in SI units, in the order of ``numbers``; a variable with a base includes its base here.

    ``numbers``: variables of the fit. ``values``: estimates. ``covariance``: their covariance. ``low``, ``high``: ends
    of the confidence intervals at ``confidence``. ``outliers``: rows of residuals left out as isolated outliers.
    ``conflict``: part of the data that contradicts the rest, if any. ``unidentified``: combinations that the recordings
    do not determine, as weights of variables relative to their values. ``shares``: for each variable, the tolerances
    that contribute to its variance, with fractions [-], largest first. ``evaluations``: number of model runs.
    ``log_likelihood``: log-likelihood [-] of whitened residuals and priors, up to a constant of the readings.
    ``sensors``: noise model by channel. ``edge``: unknowns that the search drives to values at which no run succeeds,
    with the direction, 1 upwards or -1 downwards; such a search has not converged.
    """

    numbers: tuple[FitNumber, ...]
    values: Floats
    covariance: Floats
    low: Floats
    high: Floats
    outliers: tuple[int, ...]
    conflict: Conflict | None
    unidentified: tuple[Mapping[str, float], ...]
    shares: Mapping[str, tuple[tuple[str, float], ...]]
    evaluations: int
    has_converged: bool
    log_likelihood: float
    sensors: Mapping[str, Noise]
    confidence: float
    edge: Mapping[str, int]

    @property
    def by_name(self) -> dict[str, float]:
        """Estimated values by name [SI]."""
        return dict(zip((number.name for number in self.numbers), self.values.tolist(), strict=True))


@on_one_thread
def fit(
    residuals: Residuals,
    numbers: Sequence[FitNumber],
    blocks: Sequence[ResidualBlock],
    confidence: float = 0.95,
    report: Report = report_nothing,
    memory: int = HIGHEST_ORDER,
    is_motion: bool = False,
) -> Fit:
    """Fit variables to recordings; the result has covariance, intervals and consistency tests.

    Weighted squares are minimised within bounds, at first with a robust loss (soft L1); the weights follow from the
    residuals of each channel. Then residuals are whitened by the noise model of each channel, and Gauss-Newton steps
    follow until none reduces the cost. Another start is used only if it explains the recordings better. ``memory`` is
    the highest order of the noise autoregression, 0 for independent readings. In recordings of motion (``is_motion``)
    sensors may drift, and samples affected by an impact are left out; for bench readings, drift cannot be separated
    from slow signals. Raises IdentificationError if no run succeeds, if there are no more samples than unknowns, or if
    the bounds of a variable do not enclose its start.
    """
    for number in numbers:
        if not (number.low <= number.start <= number.high and number.low < number.high):
            raise IdentificationError(
                f"{number.name}: bounds {number.low:g} to {number.high:g}, start {number.start:g}: the lower bound "
                "must be below the upper bound and the start between them"
            )
    runs = FitRuns(residuals, tuple(numbers), tuple(blocks), report, memory, is_motion)
    samples = sum(block.rows.stop - block.rows.start for block in blocks)
    sought = sum(math.isinf(number.deviation) for number in numbers)
    if samples <= sought:
        raise IdentificationError(f"{samples} samples cannot determine {sought} parameters")
    best = _fit_from(runs, runs.start, confidence)
    if best.conflict is None and best.has_converged:
        return best
    # With a wrong law, most starts end at the same point: only starts with a lower cost are followed.
    for start in _other_starts(runs, best):
        report(Progress("fit: another start, which fits better than the first result"))
        other = _fit_from(runs, start, confidence)
        if other.log_likelihood > best.log_likelihood + _BETTER:
            best = other
    return replace(best, evaluations=runs.evaluations)


def _fit_from(runs: FitRuns, start: Floats, confidence: float) -> Fit:
    """Return the fit, with intervals and consistency tests, found by a search from a scaled start point."""
    searched, outliers = _search(runs, start)
    end = _settle(runs, searched, outliers)
    point, linear = end.point, end.linear
    errors, jacobian = linear.rows[:, 0], linear.rows[:, 1:]
    covariance = linear.root @ linear.root.T
    # Effective degrees of freedom: samples less the trace of J C J', to which a prior contributes little.
    freedom = max(len(errors) - float(np.sum(jacobian * (jacobian @ covariance))), 1.0)
    low, high = interval_ends(runs, point, linear, float(student.ppf(0.5 + 0.5 * confidence, freedom)))
    # At a bound is what the squares would pull across it.
    slope = errors @ jacobian + np.square(runs.prior) * (point - runs.start)
    near = _AT_BOUND * np.maximum(1.0, np.abs(point))
    is_free = ~(((point - runs.low < near) & (slope > 0.0)) | ((runs.high - point < near) & (slope < 0.0)))
    conflict = conflict_of(runs, linear.rows, point, is_free, freedom)
    smoothest, noise = min(linear.sensors.items(), key=lambda item: item[1].innovation)
    if conflict is None and noise.innovation < _SMOOTHEST:
        conflict = Conflict(smoothest, SMOOTH, 1.0 / noise.innovation, 0.0)
    for row, base in np.argwhere(runs.base).tolist():
        correlation = covariance[row, base] / math.sqrt(covariance[row, row] * covariance[base, base])
        for limits, sign in ((low, -1.0), (high, 1.0)):
            own, below = limits[row] - point[row], limits[base] - point[base]
            width = math.sqrt(max(own * own + below * below + 2.0 * correlation * own * below, 0.0))
            limits[row] = point[row] + point[base] + sign * width
        low[row] = max(low[row], low[base] + runs.low[row])
    covariance = covariance + runs.base @ covariance + (covariance + runs.base @ covariance) @ runs.base.T
    point = point + runs.base @ point
    # Unknowns count relative to their estimates, because a start may be far off; those that may be 0 or of either sign
    # relative to the start where it is larger. After a conflict an estimate may be far too large: the start limits it.
    estimated = np.abs(point) if conflict is None else np.minimum(np.abs(point), 1.0)
    is_positive = runs.low > 0.0
    is_positive |= runs.base @ is_positive > 0.0
    typical = np.where(runs.prior > 0.0, 1.0, np.where(is_positive, estimated, np.maximum(estimated, 1.0)))
    names = [number.name for number in runs.numbers]
    # A prior of standard deviation s_j contributes (C_ij / s_j)^2 / C_ii to the variance C_ii of variable i.
    fractions = np.square(covariance * runs.prior) / np.diag(covariance)[:, None]
    shares = {
        name: tuple((names[other], float(row[other])) for other in np.argsort(-row).tolist() if runs.prior[other] > 0.0)
        for name, row in zip(names, fractions, strict=True)
    }
    # Up to a constant of the readings.
    counts = [(linear.sensors[block.channel], block.rows.stop - block.rows.start) for block in runs.blocks]
    size = sum(count * (math.log(noise.deviation) + math.log(noise.innovation)) for noise, count in counts)
    return Fit(
        numbers=runs.numbers,
        values=point * runs.scale,
        covariance=covariance * np.outer(runs.scale, runs.scale),
        low=low * runs.scale,
        high=high * runs.scale,
        outliers=tuple(outliers.tolist()),
        conflict=conflict,
        unidentified=tuple(unidentified(covariance / np.outer(typical, typical), names)),
        shares=shares,
        evaluations=runs.evaluations,
        # A search whose steps all leave the region in which runs succeed has no minimum.
        has_converged=-math.inf < end.gain < _CONVERGED,
        log_likelihood=-size - 0.5 * float(np.square((point - runs.start) * runs.prior).sum()),
        sensors=linear.sensors,
        confidence=confidence,
        edge={} if math.isfinite(end.gain) else _edge(runs, end.point, end.step),
    )


def _search(runs: FitRuns, start: Floats) -> tuple[Floats, Indices]:
    """Search for the least-squares point with white noise, first with a robust loss, roughly.

    A variable at a bound can lose its gradient while the clock is still wrong, therefore the robust loss. Returns the
    scaled point, and for motion the rows of isolated outliers.
    """
    point, outliers = np.clip(start, runs.low, runs.high), np.zeros(0, dtype=np.intp)
    residuals = runs.residuals_at(point)
    if not np.isfinite(residuals).all():
        raise IdentificationError("every run fails at the start values")
    started = time.monotonic()
    for number, (loss, least) in enumerate([("soft_l1", _ROUGH), ("linear", _FINE)]):
        runs.report(Progress("fit", number, 2, noun="passes", elapsed=time.monotonic() - started))
        weight = 1.0 / runs.deviations(residuals[:, None])[0]
        weight[outliers] = 0.0
        point = _minimise(runs, point, weight, loss, least)
        residuals = runs.residuals_at(point).copy()
        if number == 0 and runs.is_motion:
            outliers = _outliers(runs, residuals)
        residuals[outliers] = 0.0
    return point, outliers


def _minimise(runs: FitRuns, point: Floats, weight: Floats, loss: str, least: float) -> Floats:
    """Return the scaled point with the least squares of residuals and priors, searched within the bounds from a point.

    ``weight`` [1/SI] is by row. The search ends at a relative decrease of the squares below ``least``.
    """

    def slopes(x: Floats) -> Floats:
        jacobian = runs.jacobian(x, is_central=not runs.is_motion)
        runs.adapt_steps(jacobian, weight)
        return np.concatenate([jacobian * weight[:, None], np.diag(runs.prior)])

    result = least_squares(
        lambda x: np.concatenate([runs.residuals_at(x) * weight, (x - runs.start) * runs.prior]),
        point,
        slopes,
        (runs.low, runs.high),
        method="trf",
        x_scale="jac",
        xtol=1.0e-9,
        gtol=None,
        ftol=least,
        loss=loss,
        max_nfev=_EVALUATIONS,
    )
    return np.asarray(result.x)


def _outliers(runs: FitRuns, residuals: Floats) -> Indices:
    """Return the isolated outliers among the residuals of the robust pass, at most one sample in 100.

    A single outlier near a break-away could otherwise determine a friction. If more samples stand out, the noise has
    heavy tails, and only the largest are left out.
    """
    outliers, sizes = list[Indices](), list[Floats]()
    for block in runs.blocks:
        samples = residuals[block.rows]
        noise = max(white_noise_of(samples), float(np.min(block.floor)))
        rows = np.flatnonzero(outlying_samples(samples, noise))
        outliers.append(rows + block.rows.start)
        sizes.append(off_neighbours(samples)[rows] / max(noise, 1.0e-300))
    order = np.argsort(-np.concatenate(sizes), kind="stable")[: int(_LEFT_OUT * len(residuals))]
    return np.sort(np.concatenate(outliers)[order])


class _SearchEnd(NamedTuple):
    """End of a search: scaled point, linearisation at this point, and the step to its minimum.

    ``gain`` is the decrease of the squares in the last step [-], -inf if no run succeeds after a short step.
    """

    point: Floats
    linear: Linear
    step: Floats
    gain: float


def _settle(runs: FitRuns, point: Floats, outliers: Indices) -> _SearchEnd:
    """Return the minimum by Gauss-Newton steps, for white noise and then for the noise of each channel.

    Outliers are left out and, in a fit of motion, also samples of high leverage. These and the kind and order of the
    noise are chosen once, at the minimum for white noise: chosen on the way, they would depend on the start.
    """
    residuals, jacobian, left_out = runs.residuals_at(point), runs.jacobian(point), outliers
    kinds, stage, last = {channel: Noise(1.0) for channel in runs.channels}, 0, 2 if runs.is_motion else 1
    for _ in range(_STEPS):
        linear, step = linear_at(runs, point, residuals, jacobian, left_out, kinds)
        runs.adapt_steps(jacobian, 1.0 / linear.noise)
        squares, fall = cost_of(runs, residuals, point, linear), fall_of(runs, point, linear, step)
        reached, trial, trial_residuals = best_along(runs, point, residuals, step, linear.rows[:, 1:], linear)
        gain = squares - reached
        if gain > 0.0:
            point, residuals = trial, trial_residuals
        if min(gain, fall) >= _GAIN:
            kinds, jacobian = linear.sensors, runs.jacobian(point)
            continue
        if stage == last:
            break
        stage, kinds = stage + 1, {}
        if stage == 2:
            # Near an impact the derivative holds on one side only, so that a sample would determine a variable falsely.
            leverage = np.square(linear.rows[:, 1:] @ linear.root).sum(axis=1)
            highest = np.argsort(-leverage)[: int(_LEFT_OUT * len(leverage))]
            left_out = np.union1d(outliers, highest[leverage[highest] > _LEVERAGE])
    return _SearchEnd(point=point, linear=linear, step=step, gain=min(gain, fall))


def _edge(runs: FitRuns, point: Floats, step: Floats) -> dict[str, int]:
    """Return the unknowns for which no run succeeds after a short step from a point, with the sign of the step.

    If every single step succeeds and only their combination fails, all unknowns are returned.
    """
    sought = np.flatnonzero((runs.prior == 0.0) & (step != 0.0))
    moved = point[:, None] + SHORT * np.diag(step)[:, sought]
    residuals = runs.residuals_at_points(np.clip(moved, runs.low[:, None], runs.high[:, None]))
    fails = ~np.isfinite(residuals).all(axis=0)
    indices = sought[fails] if fails.any() else sought
    return {runs.numbers[index].name: int(np.sign(step[index])) for index in indices.tolist()}


def _other_starts(runs: FitRuns, fitted: Fit) -> Iterator[Floats]:
    """Yield at most two scaled start points with a lower robust cost than the fit."""
    sought = ~(runs.prior > 0.0)
    point, is_excess = fitted.values / runs.scale, runs.base.any(axis=1)
    point = point - runs.base @ point
    low, high = np.maximum(runs.low, -1.0e3)[sought], np.minimum(runs.high, 1.0e3)[sought]
    is_ratio = (low > 0.0) & (high > 10.0 * low)
    with np.errstate(invalid="ignore", divide="ignore"):
        ends = [np.where(is_ratio, np.log(end), end) for end in (low, high)]
    # A fixed seed gives the same result for the same recordings.
    drawn = qmc.Sobol(int(sought.sum()), seed=1).random(_OTHER_STARTS).T
    drawn = ends[0][:, None] + drawn * (ends[1] - ends[0])[:, None]
    # The last column is the fitted point, before it the same without an excess, which may hide its base.
    points = np.repeat(point[:, None], _OTHER_STARTS + 1 + int(is_excess.any()), axis=1)
    points[sought, :_OTHER_STARTS] = np.where(is_ratio[:, None], np.exp(np.where(is_ratio[:, None], drawn, 0.0)), drawn)
    points[is_excess, :-1] = 0.0
    noise = [
        np.full(block.rows.stop - block.rows.start, fitted.sensors[block.channel].deviation) for block in runs.blocks
    ]
    residuals = runs.residuals_at_points(points)
    costs = np.sum(np.log1p(np.square(residuals / np.concatenate(noise)[:, None])), axis=0)
    costs[~np.isfinite(costs)] = np.inf
    yield from (points[:, index] for index in np.argsort(costs)[:2].tolist() if costs[index] < costs[-1])


def estimate_of(fitted: Fit, row: int, recordings: Sequence[str], conflict: str) -> Estimate:
    """Return the estimate of the number in a row of a fit, with verdict and explanation.

    ``conflict`` is a sentence on readings that the model does not explain, empty if it explains all.
    """
    number = fitted.numbers[row]
    value, low, high = (float(column[row]) for column in (fitted.values, fitted.low, fitted.high))
    bounds = max(number.low, fitted.by_name.get(number.base, -math.inf)), number.high
    width = relative_half_width(value, low, high, number.size)
    exact, near = _AT_BOUND * number.scale, _NEAR * (high - low) if math.isfinite(high - low) else 0.0
    bound = next((end for end in bounds if abs(value - end) <= max(exact, near)), None)
    # Not 1e-17 where 0 is meant.
    value = bound if bound is not None and abs(value - bound) <= exact else value
    # A part whose interval begins at its bound of zero cannot be distinguished from no part.
    is_part = number.size is not None and number.low == 0.0 >= low
    if is_part and high < _NONE * (number.size or 0.0):
        value = bound = 0.0
    combination = next((each for each in fitted.unidentified if abs(each.get(number.name, 0.0)) >= _OWN_SHARE), None)
    verdict: Verdict = "holds for this model only" if conflict else "identified"
    text, why = number.text, widened_by(fitted, number.name)
    if bound == 0.0 and number.size is not None and width < UNKNOWN:
        text = f"{text}: none"
    elif combination is not None and not text:
        verdict = "not identifiable"
        # So far from where it was linearised the interval of a straight line means nothing.
        low, high = min(low, bounds[0]), max(high, bounds[1])
        others = [other for other in combination if other != number.name]
        # Where the model lacks something, that may be what moves a number so far from its start.
        silent = conflict or "the recordings are hardly sensitive to this parameter"
        why = f"trades off against {' and '.join(others)}" if others else silent
    elif bound is not None and not number.base:
        verdict = "at its bound"
        why = f"the recordings favour a value at or beyond {_shown(bound, number.unit)}"
    elif width >= UNKNOWN or is_part:
        verdict, why = "not identifiable", f"{why}; the interval includes zero or twice the value"
    elif conflict and not text:
        # Said of every number: which of them the missing physics moves is not known.
        why = conflict
    elif number.base and low <= bounds[0]:
        why = f"{why}; the interval contains its bound, {number.base}"
    else:
        ends = zip(bounds, (low, high), strict=True)
        cut = [bound for bound, end in ends if abs(end - bound) <= _AT_BOUND * abs(end)]
        why += f"; the interval ends at its bound, {_shown(cut[0], number.unit)}" if cut else ""
    why = f"{text}; {why}." if text else why
    size, confidence = number.size, fitted.confidence
    return Estimate(number.name, value, number.unit, low, high, verdict, why, tuple(recordings), confidence, size)


def _shown(value: float, unit: str) -> str:
    """Return a value [SI] as text in its display unit."""
    number, shown = in_shown_unit(value, unit)
    return f"{number:.6g} {shown}".rstrip(" -")


def widened_by(fitted: Fit, name: str) -> str:
    """Return a phrase on the largest parts of the variance of a variable, of tolerances and of the scatter."""
    scatter = 1.0 - sum(share for _, share in fitted.shares[name])
    parts = [("the scatter of the readings", scatter), *(part for part in fitted.shares[name] if part[0] != name)]
    # Of parts that are shown as equal, such as those of both chambers, the name decides.
    parts.sort(key=lambda part: (-float(f"{part[1]:.2g}"), part[0]))
    return f"variance from {', '.join(f'{part} ({percentage(share, 2)})' for part, share in parts[:NAMED])}"


def conflict_in_words(fitted: Fit, reason: str = "") -> str:
    """Return a sentence on the readings that contradict the others, with a reason if known; empty if all agree."""
    conflict, reason = fitted.conflict, reason and f"; {reason}"
    if conflict is None:
        return ""
    errors = conflict.standard_errors
    if conflict.group == STATED:
        return f"{conflict.number} is {errors:.1f} standard errors beyond its stated limit{reason}"
    if conflict.number == SMOOTH:
        return f"the residual of {conflict.group} is {errors:.0f} times its noise and too smooth to be noise{reason}"
    if conflict.number == SHAPE:
        return (
            f"the residuals of {conflict.group} have a shape that the law has not, by {errors:.1f} standard "
            f"errors{reason}"
        )
    give = "give" if _SEVERAL & set(conflict.group.split()) else "gives"
    return (
        f"{conflict.group}, fitted alone, {give} different values: {conflict.number} by {errors:.1f} standard "
        f"errors{reason}"
    )
