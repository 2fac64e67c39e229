"""Estimator: bounded least squares with whitened residuals, confidence intervals, and tests of the model.

Bench procedures and the trajectory fit use the same ``fit``; uncertain quantities are variables with a prior. Variables
are scaled; residuals are divided by the noise of their channel, which is estimated from the residuals. For a linear law
the covariance gives the limits of an interval. For a nonlinear law, such as one in which only a product of two
variables counts, distant values may explain the recordings as well: a limit is the value at which the minimum of the
squares over all other variables is larger by t^2, with Student's factor t (profile likelihood).
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, lsq_linear
from scipy.stats import chi2, norm, qmc
from scipy.stats import f as fisher
from scipy.stats import t as student

from ppafo.errors import IdentificationError
from ppafo.identification.estimate import NAMED, UNKNOWN, Estimate, Verdict, relative_half_width, shown_text
from ppafo.identification.noise import HIGHEST_ORDER, Noise, noise_of, whiten
from ppafo.linear_algebra import on_one_thread
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.faults import noise_of as white_noise_of
from ppafo.signals.faults import off_neighbours, outlying_samples
from ppafo.signals.recording import Floats
from ppafo.wording import percentage

Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]
Residuals = Callable[[Floats], Floats]
"""Function from points [SI] (numbers, points) to residuals measured - model [SI] (rows, points); NaN if a run fails."""
_UNITS_OF_NOISE = 3.0
"""Combined change of all residuals in a finite difference [noises]; with 30 fewer intervals held the true value."""
# Shortest and longest finite difference, as fractions of the scale of a variable [-].
_SHORTEST_STEP = 1.0e-7
_LONGEST_STEP = 1.0e-3
_LEAST_NOISE = 1.0e-12
"""Least noise of a channel [largest residuals at the start], for a law that fits exactly."""
_OF_ANY_SIZE = 1.0e8
"""Standard deviation of an error of unknown magnitude, relative to the noise [-]."""
# Largest numbers of iterations between noise and variables, evaluations in a pass of the search, steps on whitened
# samples, trial points per limit, and steps of the other variables at each.
_ROUNDS = 20
_EVALUATIONS = 40
_GAUSS_NEWTON = 40
_TRIES = 10
_STEPS = 12
# Shortest fraction of a step, from which its curvature is found too, and the longer ones; the best is taken [-].
_SHORT = 0.1
_SHARES = np.array([1.0, 0.5, 0.25])[:, None]
_STILL = 1.0e-3
"""Change of the step between iterations [standard errors] at which noise and variables agree."""
_RANK = 1.0e-13
"""Least eigenvalue of the scaled curvature [-] for a direction to be observable."""
_SETTLED = 0.02
"""Decrease of the squares [-] below which the other variables have converged."""
_CLOSE = 0.01
"""Relative distance of the profile from its wanted value [-] from which a limit is extrapolated."""
_AWAY = 0.1
"""Least distance of a trial limit from both ends of its bracket, as a fraction of the bracket [-]."""
SHAPE = "shape"
"""Marker in ``Conflict.number`` for residuals whose neighbours have the same sign; the law has another shape."""
_SMOOTHEST = 0.15
"""Relative innovation [-] below which residuals are no noise: a lag of 90 samples, whereas 33 give 0.19 to 0.24."""
# Significance levels of a difference between estimates, and of residuals that follow each other (3.1 errors) [-].
_SIGNIFICANCE = 0.01
_BY_CHANCE = 0.001
_PARTING = 0.05
"""Smallest relative excess of a group's variance over the common variance [-] for a direction to be tested."""
# Largest fraction of samples left out, as outliers or for their leverage, and the leverage above which one is [-].
_LEFT_OUT = 0.01
_LEVERAGE = 0.1
# Relative decrease of the squares [-] that ends the robust pass of the search, and the second pass.
_ROUGH = 1.0e-3
_FINE = 1.0e-4
# Decreases of the squares [-] below which a point is their minimum, and the search has converged to its errors.
_GAIN = 1.0e-4
_CONVERGED = 0.5
_AT_BOUND = 1.0e-6
"""Largest distance of a variable from its bound [-] that counts as at the bound, relative above 1."""
_WIDEST = 12.0
"""Largest deviation of a tolerance in the search [scales]."""
_UNDETERMINED = 0.5
"""Standard error of a combination of relative variables [-] above which it is not identifiable."""
# Least weight of a variable in such a combination [-] for which it is listed, and counts as not identifiable.
_SHOWN_WEIGHT = 0.1
_OWN_SHARE = 0.2
_NEAR = 1.0e-3
"""Distance from a bound [widths of the interval] up to which an estimate counts as at its bound."""
_NONE = 0.1
"""Upper end of an interval that begins at zero [typical magnitudes], below which the part is none."""
# Increase of the log-likelihood [-] by which another start replaces the first result, and number of such starts.
_BETTER = 1.0
_OTHER_STARTS = 32


@dataclass(frozen=True, slots=True)
class FitNumber:
    """Number of a fit in SI units: an unknown, or a quantity known within a tolerance (``is_tolerance``).

    ``path`` is that of a parameter set where it has one; ``recordings`` are the labels of the recordings in which it
    acts, empty for all. ``start`` and the bounds may be nan where a declaration gives them; ``scale`` is a typical
    magnitude. ``deviation`` is the standard deviation of its prior about the start, infinite for none. With
    ``is_logarithm`` the natural logarithm is varied, to which the deviation refers. Tolerances of one ``family``, such
    as the friction in each recording, are tested together. With a ``base``, the name of another number of the same
    scale, start and bounds are of the excess over that number. A number with a ``text`` is reported, in its ``unit``;
    ``size`` is a typical magnitude of one that may be zero, for which zero is a valid result and not a bound.
    """

    path: str
    start: float = math.nan
    low: float = math.nan
    high: float = math.nan
    scale: float = 1.0
    deviation: float = math.inf
    recordings: tuple[str, ...] = ()
    is_tolerance: bool = False
    is_logarithm: bool = False
    family: str = ""
    base: str = ""
    unit: str = ""
    text: str = ""
    size: float | None = None

    @property
    def name(self) -> str:
        """Path, followed by the labels of the recordings if the number is limited to some of them."""
        return f"{self.path} of {', '.join(self.recordings)}" if self.recordings else self.path

    def acts_in(self, label: str) -> bool:
        """Return whether the number acts in the recording with this label."""
        return not self.recordings or label in self.recordings


def tolerance(
    path: str, deviation: float, start: float = 0.0, scale: float = math.sqrt(3.0), **more: Any
) -> tuple[FitNumber, ...]:
    """Return a variable with a prior of standard deviation ``deviation`` about ``start`` [SI]; nothing if exact.

    The ``scale`` of the search [deviations] is the limit by default, so that a step of one scale is a likely one.
    ``more`` are its further fields, such as the recordings in which it acts.
    """
    width = _WIDEST * (scale * deviation)
    found = FitNumber(
        path, start, start - width, start + width, scale * deviation, deviation, is_tolerance=True, **more
    )
    return (found,) if deviation > 0.0 else ()


@dataclass(frozen=True, slots=True)
class ResidualBlock:
    """Rows of residuals that belong to one channel of one recording, or to a part of it, in order of time.

    ``floor`` is the least noise [SI], from integration error or resolution, common or by row. ``shared`` is an error
    [SI] by row that is fully correlated in the recording: a single standard normal deviate multiplies all its rows.
    ``groups`` name further groups, such as a branch, whose own estimates are tested against the common ones.
    """

    recording: str
    channel: str
    rows: slice
    floor: float | Floats = 0.0
    shared: Floats | None = None
    groups: tuple[str, ...] = ()


class FitRuns:
    """Model runs of a fit at scaled points; the residuals of the last single point are cached.

    ``start`` is also the mean of the priors, ``prior`` the reciprocal of their standard deviations, 0 for an unknown.
    ``steps`` are the lengths of finite differences [-]. ``base @ point`` has the values over which variables with a
    base are counted, 0 for the others. ``channels`` are the blocks by channel.
    """

    def __init__(
        self,
        residuals: Residuals,
        numbers: tuple[FitNumber, ...],
        blocks: tuple[ResidualBlock, ...],
        report: Report,
        memory: int,
        is_motion: bool,
    ) -> None:
        self._residuals = residuals
        self.numbers = numbers
        self.blocks = blocks
        self.report = report
        self.memory = memory
        self.is_motion = is_motion
        self.scale = np.array([number.scale for number in numbers])
        self.start, self.low, self.high, deviation = (
            np.array([getattr(number, name) for number in numbers]) / self.scale
            for name in ("start", "low", "high", "deviation")
        )
        self.prior = 1.0 / deviation
        self.base = np.array([[float(other.name == number.base) for other in numbers] for number in numbers])
        self.channels = {block.channel: [each for each in blocks if each.channel == block.channel] for block in blocks}
        self.steps = np.full(len(numbers), _LONGEST_STEP)
        self.evaluations = 0
        self._last: tuple[bytes, Floats] | None = None

    def residuals_at_points(self, points: Floats) -> Floats:
        """Return residuals [SI] (rows, points) at scaled points (numbers, points)."""
        self.evaluations += points.shape[1]
        return self._residuals((points + self.base @ points) * self.scale[:, None])

    def residuals_at(self, point: Floats) -> Floats:
        """Return residuals [SI] (rows,) at one scaled point; a repeated call does not run the model again."""
        key = point.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self.residuals_at_points(point[:, None])[:, 0]
        return self._last[1]

    def jacobian(self, point: Floats, *, is_central: bool = True) -> Floats:
        """Return the Jacobian of the residuals [SI] by the scaled variables, from finite differences in one batch.

        One-sided differences are accurate enough for the search; where one of their runs fails, central differences are
        returned. Raises IdentificationError if no run succeeds on either side of a variable.
        """
        above = np.minimum(point + self.steps, self.high)
        below = np.maximum(point - self.steps, self.low)
        if not is_central:
            side = np.where(above - point >= point - below, above, below)
            values = self.residuals_at_points(point[:, None] + np.diag(side - point))
            if np.isfinite(values).all():
                return np.ascontiguousarray((values - self.residuals_at(point)[:, None]) / (side - point))
        ends = np.concatenate([np.diag(above - point), np.diag(below - point)], axis=1)
        values_above, values_below = np.split(self.residuals_at_points(point[:, None] + ends), 2, axis=1)
        runs_above, runs_below = (np.isfinite(values).all(axis=0) for values in (values_above, values_below))
        # Where a side has no run, the point itself is the other end of the difference.
        runs_both = runs_above & runs_below
        first = np.where(runs_above, above, below)
        second = np.where(runs_both, below, point)
        failing = np.flatnonzero(~(runs_above | runs_below) | (first == second))
        if failing.size:
            number = self.numbers[failing[0]]
            raise IdentificationError(f"{number.name}: every run fails near {point[failing[0]] * number.scale:.6g}")
        at_first = np.where(runs_above, values_above, values_below)
        at_second = np.where(runs_both, values_below, self.residuals_at(point)[:, None])
        return np.ascontiguousarray((at_first - at_second) / (first - second))

    def adapt_steps(self, slopes: Floats, weight: Floats) -> None:
        """Set the lengths of finite differences from a Jacobian [SI] and the weights [1/SI] of its rows."""
        sizes = np.linalg.norm(slopes * weight[:, None], axis=0)
        self.steps = np.clip(_UNITS_OF_NOISE / np.maximum(sizes, 1.0e-300), _SHORTEST_STEP, _LONGEST_STEP)

    @cached_property
    def _least_noise(self) -> dict[str, float]:
        """Noise floor by channel [SI], proportional to the channel's largest residual at the start."""
        start = self.residuals_at(self.start)
        largest = (max(np.abs(start[block.rows]).max() for block in blocks) for blocks in self.channels.values())
        return {name: _LEAST_NOISE * (size or 1.0) for name, size in zip(self.channels, largest, strict=True)}

    def deviations(self, series: Floats) -> tuple[Floats, dict[str, float]]:
        """Return the noise [SI] by row and by channel, pooled over recordings and not below the floor.

        ``series`` has the residuals as first column; further columns are the uncertainty of the fitted model.
        """
        noise = np.empty(len(series))
        by_channel = {}
        for channel, blocks in self.channels.items():
            samples = np.concatenate([series[block.rows] for block in blocks])
            pooled = max(math.sqrt(np.square(samples).sum() / len(samples)), self._least_noise[channel])
            by_channel[channel] = max(pooled, float(np.min(blocks[0].floor)))
            for block in blocks:
                noise[block.rows] = np.maximum(pooled, block.floor)
        return noise, by_channel


class Linear(NamedTuple):
    """Linearised least-squares problem of some runs.

    ``rows``: whitened residuals and Jacobian [-], side by side. ``shared``: columns [-] for correlated errors and for
    the samples left out; after subtraction of ``shared @ (shared.T @ x)`` the errors are independent. ``root``: square
    root of the covariance of the scaled variables. ``noise``: noise of each row [SI], ``sensors`` by channel.
    """

    runs: FitRuns
    rows: Floats
    shared: Floats
    root: Floats
    noise: Floats
    sensors: dict[str, Noise]

    def errors(self, residuals: Floats) -> Floats:
        """Return residuals [SI] (rows, points) as independent errors [-]."""
        scaled = residuals / self.noise[:, None]
        models = {channel: replace(noise, deviation=1.0) for channel, noise in self.sensors.items()}
        errors = np.concatenate([whiten(scaled[block.rows], models[block.channel]) for block in self.runs.blocks])
        return np.asarray(errors - self.shared @ (self.shared.T @ errors))

    def squares(self, errors: Floats, points: Floats) -> Floats:
        """Return the sum of squares of independent errors [-] (rows, points) and priors, for each scaled point."""
        away = (points - self.runs.start[:, None]) * self.runs.prior[:, None]
        return np.asarray(np.square(errors).sum(axis=0) + np.square(away).sum(axis=0))

    def cost(self, residuals: Floats, point: Floats) -> float:
        """Return the sum of squares [-] of priors and whitened residuals, given residuals [SI] (rows,) at a point."""
        return float(self.squares(self.errors(residuals[:, None]), point[:, None])[0])


def _linear_at(
    runs: FitRuns, point: Floats, residuals: Floats, slopes: Floats, left_out: Indices, like: Mapping[str, Noise]
) -> tuple[Linear, Floats]:
    """Return the whitened problem at a point, and the step to its least-squares solution within the bounds.

    Fitting absorbs part of the noise, which is then missing in the residuals. The expected part J C J' is added and the
    noise re-estimated until both agree (expectation maximisation). Rows ``left_out`` say nothing. Kind and order of the
    noise are those of ``like`` by channel, if it has any.
    """
    step = np.zeros(len(point))
    hidden = np.zeros((len(residuals), 0))
    limits = runs.low - point - 1.0e-300, runs.high - point + 1.0e-300
    # A sample with a number of its own, of no known size, says nothing: so it is left out of any noise.
    own_numbers = np.zeros((len(residuals), len(left_out)))
    own_numbers[left_out, np.arange(len(left_out))] = _OF_ANY_SIZE
    # Errors [SI] that the rows of a recording share, one column for each recording that has them.
    having = [block for block in runs.blocks if block.shared is not None]
    names = list(dict.fromkeys(block.recording for block in having))
    common = np.zeros((len(residuals), len(names)))
    for part in having:
        common[part.rows, names.index(part.recording)] = part.shared
    for _ in range(_ROUNDS):
        series = np.column_stack([residuals + slopes @ step, hidden])
        series[left_out] = 0.0
        noise, sizes = runs.deviations(series)
        sensors = {}
        scaled = np.column_stack([residuals, slopes, common]) / noise[:, None]
        rows = np.column_stack([scaled, own_numbers])
        for channel, blocks in runs.channels.items():
            own = [series[block.rows] / noise[block.rows, None] for block in blocks]
            model = noise_of(own, runs.memory, runs.is_motion, like.get(channel))
            sensors[channel] = replace(model, deviation=sizes[channel])
            for block in blocks:
                rows[block.rows] = whiten(rows[block.rows], model)
        # With D = U S V' the covariance is 1 + D D', and 1 - U (1 - 1 / sqrt(1 + S^2)) U' makes it 1.
        axes, triangle = np.linalg.qr(rows[:, 1 + len(point) :])
        turned, spread, _ = np.linalg.svd(triangle)
        shared = axes @ (turned * np.sqrt(1.0 - 1.0 / np.hypot(1.0, spread)))
        rows = rows[:, : 1 + len(point)]
        rows = rows - shared @ (shared.T @ rows)
        root, _ = _root_of_inverse(rows[:, 1:].T @ rows[:, 1:] + np.diag(np.square(runs.prior)))
        hidden = slopes @ root
        before = step
        solved = lsq_linear(
            np.concatenate([rows[:, 1:], np.diag(runs.prior)]),
            -np.concatenate([rows[:, 0], (point - runs.start) * runs.prior]),
            limits,
            method="bvls",
        )
        step = np.asarray(solved.x)
        if np.abs(np.linalg.pinv(root) @ (step - before)).max() < _STILL and series.shape[1] > 1:
            break
    return Linear(runs, rows, shared, root, noise, sensors), step


def _root_of_inverse(curvature: Floats) -> tuple[Floats, Flags]:
    """Return a square root of the inverse of a matrix, and flags of its columns of observable directions."""
    sizes = np.sqrt(np.maximum(np.diag(curvature), 0.0))
    size = np.where(sizes > 1.0e-9 * sizes.max(initial=0.0), sizes, sizes.max(initial=1.0e-9) or 1.0)
    values, vectors = np.linalg.eigh(curvature / size / size[:, None])
    return np.asarray(vectors / np.sqrt(np.maximum(values, _RANK)) / size[:, None]), np.asarray(values > _RANK)


def _best_along(
    linear: Linear, point: Floats, residuals: Floats, step: Floats, slopes: Floats
) -> tuple[float, Floats, Floats]:
    """Return the least sum of squares [-] along a step from a scaled point, its point, and the residuals [SI] there.

    The way bends as the residuals do along the step (geodesic acceleration), because static friction trades off against
    its fall along a curved valley. ``slopes`` is the whitened Jacobian at the point. The sum is infinite if no run
    succeeds, even after a ``_SHORT`` fraction of the step.
    """
    runs = linear.runs
    ends = np.clip(np.column_stack([point + _SHORT * step, point - _SHORT * step]).T, runs.low, runs.high).T
    ahead, behind = runs.residuals_at_points(ends).T
    curvature = linear.errors(((ahead - residuals) + (behind - residuals))[:, None] / _SHORT**2)[:, 0]
    bend = np.zeros(len(point))
    if np.isfinite(curvature).all():
        right_side = np.concatenate([curvature, bend])
        bend -= np.linalg.lstsq(np.concatenate([slopes, np.diag(runs.prior)]), right_side, rcond=None)[0]
        bend[step == 0.0] = 0.0
    tried = np.clip(point + _SHARES * step + 0.5 * np.square(_SHARES) * bend, runs.low, runs.high).T
    points = np.column_stack([tried, ends[:, 0]])
    found = np.column_stack([runs.residuals_at_points(tried), ahead])
    squares = linear.squares(linear.errors(found), points)
    best = np.argmin(np.where(np.isfinite(squares), squares, np.inf))
    return (float(squares[best]) if np.isfinite(squares[best]) else np.inf), points[:, best], found[:, best]


def _interval_ends(linear: Linear, point: Floats, times: float) -> tuple[Floats, Floats]:
    """Return scaled lower and upper confidence limits: ``times`` standard errors, or wider for nonlinear laws.

    Only intervals of unknowns without a prior are widened. The profile is the root of the increase of the squares: by
    how many standard errors priors and samples tell a point from the estimate. It is searched from the linear limit to
    the bound, which is the limit where the samples determine none.
    """
    runs = linear.runs
    covariance = linear.root @ linear.root.T
    wide = times * np.sqrt(np.diag(covariance))
    low = np.maximum(point - wide, runs.low)
    high = np.minimum(point + wide, runs.high)
    least = linear.cost(runs.residuals_at(point), point)
    for number in np.flatnonzero(runs.prior == 0.0).tolist():
        way = covariance[:, number] / covariance[number, number]
        # At the bound of an excess the samples may say nothing of its size, which the straight line then overestimates.
        is_least = not runs.base[number].any()
        for ends, bound in ((low, runs.low[number]), (high, runs.high[number])):
            if ends[number] == point[number]:
                continue
            tried = point + way * (ends[number] - point[number])
            tried[number] = ends[number]
            # Points with their profiles: the two last ones below the wanted profile, and the last one above it.
            before = inner = point, 0.0
            outer: tuple[Floats, float] | None = None
            for _ in range(_TRIES):
                squares, reached = _least_along(linear, np.clip(tried, runs.low, runs.high), number)
                profile = math.sqrt(max(squares - least, 0.0))
                if profile >= times and inner[0] is point and is_least:
                    end = reached[number]
                    break
                if abs(profile - times) <= _CLOSE * times:
                    end = point[number] + times / profile * (reached[number] - point[number])
                    end = min(max(end, runs.low[number]), runs.high[number])
                    break
                if profile >= times:
                    outer = reached, profile
                elif reached[number] == bound:
                    end = bound
                    break
                else:
                    before = inner
                    inner = (reached, profile)
                other = before if outer is None else outer
                rise = abs(other[1] - inner[1])
                missing = times - inner[1]
                # Between two points the secant stays away from both; beyond them its distance may double.
                away = np.abs(np.array([inner[0][number] - point[number], other[0][number] - inner[0][number]]))
                most = away[0] / away[1] if outer is None else 1.0 - _AWAY
                share = min(missing / rise, most) if 0.0 < rise < math.inf else 0.5 * most
                tried = inner[0] + (-share if outer is None else max(share, _AWAY)) * (other[0] - inner[0])
            else:
                end = bound if outer is None else tried[number]
            ends[number] = end
    return low, high


def _least_along(linear: Linear, point: Floats, number: int) -> tuple[float, Floats]:
    """Return the least sum of squares [-] with one variable of a scaled point fixed, and the point that reaches it.

    Each Gauss-Newton step has its own Jacobian, because that of the estimate leads out of a curved valley.
    The sum is infinite if no run succeeds.
    """
    runs = linear.runs
    residuals = runs.residuals_at_points(point[:, None])[:, 0]
    if not np.isfinite(residuals).all():
        return math.inf, point
    squares = linear.cost(residuals, point)
    others = np.delete(np.arange(len(point)), number)
    for _ in range(_STEPS):
        jacobian = runs.jacobian(point, is_central=False)
        runs.adapt_steps(jacobian, 1.0 / linear.noise)
        slopes = linear.errors(jacobian)
        slopes[:, number] = 0.0
        errors = linear.errors(residuals[:, None])[:, 0]
        axes, triangle = np.linalg.qr(np.concatenate([slopes, np.diag(runs.prior)])[:, others])
        pull = axes.T @ np.concatenate([errors, (point - runs.start) * runs.prior])
        low, high = (end - point[others] for end in (runs.low[others], runs.high[others]))
        step = np.zeros(len(point))
        step[others] = lsq_linear(triangle, -pull, (low - 1.0e-300, high + 1.0e-300), method="bvls").x
        reached, tried, found = _best_along(linear, point, residuals, step, slopes)
        fall = squares - reached
        if not fall > 0.0:
            break
        point = tried
        residuals = found
        squares = reached
        if fall < _SETTLED:
            break
    return squares, point


@dataclass(frozen=True, slots=True)
class Conflict:
    """Part of the data that contradicts the rest or the model significantly, in ``words``.

    ``group`` is a sensor, a recording, a channel of a recording ("pressure_1 of back"), another group (a branch), or
    the stated limit of a tolerance. ``number`` is the quantity that differs most, by ``standard_errors``, ``SHAPE``,
    or empty for residuals too smooth to be noise. ``p`` is the probability of such a difference if the model is right.
    """

    group: str
    number: str
    standard_errors: float
    p: float
    words: str


def wrong_shape(sensor: str, series: Sequence[Floats]) -> Conflict | None:
    """Return a conflict if neighbouring residuals of a sensor follow each other, as noise does not; else None.

    ``series`` are residuals divided by their noise, each in order of what the law predicts. Their correlation with the
    next one times the root of the count is standard normal under white noise.
    """
    size = sum(float(values @ values) for values in series)
    count = sum(values.size - 1 for values in series)
    # Residuals below the floor are rounding, and no noise.
    if count < 1 or size < 0.5 * sum(values.size for values in series):
        return None
    errors = sum(float(values[1:] @ values[:-1]) for values in series) / size * math.sqrt(count)
    p = norm.sf(errors)
    return other_shape(sensor, errors, p) if p < _BY_CHANCE else None


def other_shape(sensor: str, errors: float, p: float = 0.0) -> Conflict:
    """Return the conflict of a sensor with the shape of a law."""
    words = f"the residuals of {sensor} have a shape that the law has not, by {errors:.1f} standard errors"
    return Conflict(sensor, SHAPE, errors, p, words)


def _conflict_of(runs: FitRuns, rows: Floats, point: Floats, free: Flags, freedom: float) -> Conflict | None:
    """Return the group of rows whose separate estimates differ most from the common estimates; None if insignificant.

    Hausman's test: the estimate of a group alone differs by d = -H_g^-1 (J_g' r_g + P (z - m)), with covariance
    H_g^-1 - C. With C = L L' and the eigenvalues a of L' H_g L, both are diagonal: d'(H_g^-1 - C)^-1 d is the sum of
    q^2 / (a (1 - a)).
    """
    errors = rows[:, 0]
    slopes = rows[:, 1:][:, free]
    prior = np.square(runs.prior[free])
    shift = (point - runs.start)[free]
    root, seen = _root_of_inverse(slopes.T @ slopes + np.diag(prior))
    root = root[:, seen]
    variance = np.square(root).sum(axis=1)
    numbers = [number for number, is_free in zip(runs.numbers, free.tolist(), strict=True) if is_free]
    labels = [
        (block.channel, block.recording, f"{block.channel} of {block.recording}", *block.groups)
        for block in runs.blocks
    ]
    groups = []
    known = [[block.rows for block in runs.blocks]]
    for column in zip(*labels, strict=True):
        for name in dict.fromkeys(column):
            parts = [block.rows for block, label in zip(runs.blocks, column, strict=True) if label == name]
            if parts not in known:
                known.append(parts)
                groups.append((name, parts))
    count_of_tests = len(groups) + (prior > 0.0).sum()
    found = []
    for name, parts in groups:
        group = np.concatenate([slopes[part] for part in parts])
        pull = group.T @ np.concatenate([errors[part] for part in parts]) + prior * shift
        alone, turned = np.linalg.eigh(root.T @ (group.T @ group + np.diag(prior)) @ root)
        # In other directions the group is nearly all that is known, or says nothing: both differences are 0 over 0.
        tested = (alone > 1.0e-6) & (alone < 1.0 / (1.0 + _PARTING))
        count = tested.sum()
        if not count:
            continue
        alone = alone[tested]
        axes = root @ turned[:, tested]
        along = axes.T @ pull
        statistic = np.sum(np.square(along) / (alone * (1.0 - alone)))
        p = min(fisher.sf(statistic / count, count, freedom) * count_of_tests, 1.0)
        moved = np.abs(axes @ (along / alone))
        spread = np.sqrt(np.square(axes) @ (1.0 / alone - 1.0))
        # A number of which the group says nothing moves by rounding alone. Along one direction all part as far.
        ratios = np.where(spread > 1.0e-6 * np.sqrt(variance), moved / np.maximum(spread, 1.0e-300), 0.0)
        most = np.argmax(ratios > (1.0 - 1.0e-6) * ratios.max())
        number = numbers[most].name
        ratio = ratios[most]
        words = f"{name}, fitted alone, would have other values: {number} by {ratio:.1f} standard errors"
        found.append(Conflict(name, number, ratio, p, words))
    # The stated value of a tolerance is a group of its own: its mean parts from the fit by deviation^2 - C.
    own_variance = 1.0 / np.maximum(prior, 1.0e-300) - variance
    for index in np.flatnonzero((prior > 0.0) & (own_variance >= _PARTING * variance)).tolist():
        ratio = abs(shift[index]) / math.sqrt(own_variance[index])
        p = min(2.0 * student.sf(ratio, freedom) * count_of_tests, 1.0)
        found.append(_beyond_limit(numbers[index].name, ratio, p))
    # Tolerances of a family are tested together, in directions that the unknowns of the fit do not absorb.
    families = []
    for family in dict.fromkeys(number.family for number in numbers if number.family):
        members = [index for index, number in enumerate(numbers) if number.family == family and prior[index] > 0.0]
        weight = np.sqrt(prior[members])
        moved = shift[members] * weight
        own = root[members] * weight[:, None]
        alone, axes = np.linalg.eigh(np.eye(len(members)) - own @ own.T)
        tested = alone > _PARTING
        if len(members) > 1 and tested.any():
            # Stated deviations are known, not estimated: so this is chi-square, not F.
            p = chi2.sf(np.sum(np.square(axes.T @ moved)[tested] / alone[tested]), tested.sum())
            ratios = np.abs(moved) / np.sqrt(np.maximum(1.0 - np.square(own).sum(axis=1), _PARTING))
            most = np.argmax(ratios)
            families.append(_beyond_limit(numbers[members[most]].name, ratios[most], p))
    # Of families the first one that differs, and only where no group does.
    significant = sorted((item for item in found if item.p < _SIGNIFICANCE), key=lambda item: item.p)
    return next(iter((*significant, *(item for item in families if item.p < _SIGNIFICANCE))), None)


def _beyond_limit(name: str, errors: float, p: float) -> Conflict:
    """Return the conflict of recordings with the stated limit of a tolerance."""
    return Conflict("stated limit", name, errors, p, f"{name} is {errors:.1f} standard errors beyond its stated limit")


@dataclass(frozen=True, slots=True)
class Fit:
    """Result of a fit in SI units, in the order of ``numbers``; a variable with a base includes its base here.

    ``low``, ``high``: ends of the confidence intervals. ``outliers``: rows of residuals left out as isolated outliers.
    ``unidentified``: combinations that the recordings do not determine, as weights of variables relative to their
    values. ``shares``: for each variable, the tolerances that contribute to its variance, with fractions [-], largest
    first. ``evaluations``: number of model runs. ``log_likelihood``: that of whitened residuals and priors [-], up to a
    constant of the readings. ``sensors``: noise model by channel. ``edge``: unknowns that the search drives to where no
    run succeeds, with the direction, 1 upwards or -1 downwards; such a search has not converged.
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

    Weighted squares are minimised within bounds, at first with a robust loss (soft L1); then residuals are whitened by
    the noise model of each channel. Another start is used only if it explains the recordings better. ``memory`` is the
    highest order of the noise autoregression, 0 for independent readings. In recordings of motion (``is_motion``)
    sensors may drift, and samples affected by an impact are left out; for bench readings, drift cannot be separated
    from slow signals. Raises IdentificationError if no run succeeds, or if there are no more samples than unknowns.
    """
    runs = FitRuns(residuals, tuple(numbers), tuple(blocks), report, memory, is_motion)
    samples = sum(block.rows.stop - block.rows.start for block in blocks)
    sought = sum(math.isinf(number.deviation) for number in numbers)
    if samples <= sought:
        raise IdentificationError(f"{samples} samples cannot determine {sought} parameters")
    best = _fit_from(runs, runs.start, confidence)
    if best.conflict is None and best.has_converged:
        return best
    # Of starts drawn within the bounds, the two of the lowest robust cost are followed, where it is below the fit's:
    # with a wrong law, most starts end at the same point.
    is_sought = ~(runs.prior > 0.0)
    point = best.values / runs.scale
    is_excess = runs.base.any(axis=1)
    point = point - runs.base @ point
    low = np.maximum(runs.low, -1.0e3)[is_sought]
    high = np.minimum(runs.high, 1.0e3)[is_sought]
    is_ratio = (low > 0.0) & (high > 10.0 * low)
    with np.errstate(invalid="ignore", divide="ignore"):
        ends = [np.where(is_ratio, np.log(end), end) for end in (low, high)]
    # A fixed seed gives the same result for the same recordings.
    drawn = qmc.Sobol(is_sought.sum(), seed=1).random(_OTHER_STARTS).T
    drawn = ends[0][:, None] + drawn * (ends[1] - ends[0])[:, None]
    drawn = np.where(is_ratio[:, None], np.exp(np.where(is_ratio[:, None], drawn, 0.0)), drawn)
    # The last column is the fitted point, before it the same without an excess, which may hide its base.
    points = np.repeat(point[:, None], _OTHER_STARTS + 1 + is_excess.any(), axis=1)
    points[is_sought, :_OTHER_STARTS] = drawn
    points[is_excess, :-1] = 0.0
    counts = [(best.sensors[block.channel].deviation, block.rows.stop - block.rows.start) for block in blocks]
    noise = np.concatenate([np.full(count, deviation) for deviation, count in counts])
    costs = np.sum(np.log1p(np.square(runs.residuals_at_points(points) / noise[:, None])), axis=0)
    costs[~np.isfinite(costs)] = np.inf
    for index in [each for each in np.argsort(costs)[:2].tolist() if costs[each] < costs[-1]]:
        report(Progress("fit: another start, which fits better than the first result"))
        other = _fit_from(runs, points[:, index], confidence)
        if other.log_likelihood > best.log_likelihood + _BETTER:
            best = other
    return replace(best, evaluations=runs.evaluations)


def _fit_from(runs: FitRuns, start: Floats, confidence: float) -> Fit:
    """Return the fit, with intervals and consistency tests, found by a search from a scaled start point."""
    point, linear, step, gain, outliers = _least_squares(runs, start)
    errors = linear.rows[:, 0]
    jacobian = linear.rows[:, 1:]
    covariance = linear.root @ linear.root.T
    # Effective degrees of freedom: samples less the trace of J C J', to which a prior contributes little.
    freedom = max(len(errors) - np.sum(jacobian * (jacobian @ covariance)), 1.0)
    low, high = _interval_ends(linear, point, student.ppf(0.5 + 0.5 * confidence, freedom))
    # At a bound is what the squares would pull across it.
    slope = errors @ jacobian + np.square(runs.prior) * (point - runs.start)
    near = _AT_BOUND * np.maximum(1.0, np.abs(point))
    is_free = ~(((point - runs.low < near) & (slope > 0.0)) | ((runs.high - point < near) & (slope < 0.0)))
    conflict = _conflict_of(runs, linear.rows, point, is_free, freedom)
    smoothest, noise = min(linear.sensors.items(), key=lambda item: item[1].innovation)
    if conflict is None and noise.innovation < _SMOOTHEST:
        errors_in_noise = 1.0 / noise.innovation
        words = f"the residual of {smoothest} is {errors_in_noise:.0f} times its noise and too smooth to be noise"
        conflict = Conflict(smoothest, "", errors_in_noise, 0.0, words)
    edge = {}
    if not math.isfinite(gain):
        # Unknowns of which a short step alone makes every run fail; all, where only their combination does.
        sought = np.flatnonzero((runs.prior == 0.0) & (step != 0.0))
        moved = point[:, None] + _SHORT * np.diag(step)[:, sought]
        tried = runs.residuals_at_points(np.clip(moved, runs.low[:, None], runs.high[:, None]))
        fails = ~np.isfinite(tried).all(axis=0)
        indices = (sought[fails] if fails.any() else sought).tolist()
        edge = {runs.numbers[index].name: int(np.sign(step[index])) for index in indices}
    for row, base in np.argwhere(runs.base).tolist():
        correlation = covariance[row, base] / math.sqrt(covariance[row, row] * covariance[base, base])
        for limits, sign in ((low, -1.0), (high, 1.0)):
            own = limits[row] - point[row]
            below = limits[base] - point[base]
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
    unidentified = []
    variances, vectors = np.linalg.eigh(covariance / np.outer(typical, typical))
    for variance, vector in zip(variances[::-1].tolist(), vectors.T[::-1], strict=True):
        if math.sqrt(max(variance, 0.0)) > _UNDETERMINED:
            weights = zip(names, (vector / vector[np.argmax(np.abs(vector))]).tolist(), strict=True)
            unidentified.append({name: weight for name, weight in weights if abs(weight) >= _SHOWN_WEIGHT})
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
        unidentified=tuple(unidentified),
        shares=shares,
        evaluations=runs.evaluations,
        # A search whose steps all leave the region in which runs succeed has no minimum.
        has_converged=-math.inf < gain < _CONVERGED,
        log_likelihood=-size - 0.5 * float(np.square((point - runs.start) * runs.prior).sum()),
        sensors=linear.sensors,
        confidence=confidence,
        edge=edge,
    )


def _least_squares(runs: FitRuns, start: Floats) -> tuple[Floats, Linear, Floats, float, Indices]:
    """Return the minimum of residuals and priors from a scaled start point: a rough search, then Gauss-Newton steps.

    It is a scaled point, its linearisation, the step that is left to its minimum, the decrease of the squares in the
    last step [-], -inf if no run succeeds after a short step, and the rows that are isolated outliers.

    The search has white noise and at first a robust loss, because a variable at a bound can lose its gradient while the
    clock is still wrong. In a fit of motion outliers are left out: a single one near a break-away could otherwise
    determine a friction. If too many stand out, the noise has heavy tails: the largest are left out. The steps have
    white noise, then the noise of each channel. Its kind and order, and samples of high leverage, are chosen once, at
    the minimum for white noise: chosen on the way, they would depend on the start.
    """
    point = np.clip(start, runs.low, runs.high)
    outliers = np.zeros(0, dtype=np.intp)
    weight = np.zeros(0)

    def weighted(x: Floats) -> Floats:
        return np.concatenate([runs.residuals_at(x) * weight, (x - runs.start) * runs.prior])

    def slopes(x: Floats) -> Floats:
        jacobian = runs.jacobian(x, is_central=not runs.is_motion)
        runs.adapt_steps(jacobian, weight)
        return np.concatenate([jacobian * weight[:, None], np.diag(runs.prior)])

    residuals = runs.residuals_at(point)
    if not np.isfinite(residuals).all():
        raise IdentificationError("every run fails at the start values")
    started = time.monotonic()
    bounds = (runs.low, runs.high)
    usual = {"method": "trf", "x_scale": "jac", "xtol": 1.0e-9, "gtol": None, "max_nfev": _EVALUATIONS}
    for number, (loss, least) in enumerate([("soft_l1", _ROUGH), ("linear", _FINE)]):
        runs.report(Progress("fit", number, 2, noun="passes", elapsed=time.monotonic() - started))
        weight = 1.0 / runs.deviations(residuals[:, None])[0]
        weight[outliers] = 0.0
        point = np.asarray(least_squares(weighted, point, slopes, bounds, loss=loss, ftol=least, **usual).x)
        residuals = runs.residuals_at(point).copy()
        if number == 0 and runs.is_motion:
            rows = []
            sizes = []
            for block in runs.blocks:
                samples = residuals[block.rows]
                noise = max(white_noise_of(samples), np.min(block.floor))
                own = np.flatnonzero(outlying_samples(samples, noise))
                rows.append(own + block.rows.start)
                sizes.append(off_neighbours(samples)[own] / max(noise, 1.0e-300))
            order = np.argsort(-np.concatenate(sizes), kind="stable")[: int(_LEFT_OUT * len(residuals))]
            outliers = np.sort(np.concatenate(rows)[order])
        residuals[outliers] = 0.0
    residuals = runs.residuals_at(point)
    jacobian = runs.jacobian(point)
    left_out = outliers
    kinds = {channel: Noise(1.0) for channel in runs.channels}
    stage = 0
    last = 2 if runs.is_motion else 1
    for _ in range(_GAUSS_NEWTON):
        linear, step = _linear_at(runs, point, residuals, jacobian, left_out, kinds)
        runs.adapt_steps(jacobian, 1.0 / linear.noise)
        straight = np.column_stack([linear.rows[:, 0], linear.rows[:, 0] + linear.rows[:, 1:] @ step])
        before, after = linear.squares(straight, np.column_stack([point, point + step])).tolist()
        squares = linear.cost(residuals, point)
        reached, trial, trial_residuals = _best_along(linear, point, residuals, step, linear.rows[:, 1:])
        gain = min(squares - reached, before - after)
        if squares > reached:
            point = trial
            residuals = trial_residuals
        if gain >= _GAIN:
            kinds = linear.sensors
            jacobian = runs.jacobian(point)
            continue
        if stage == last:
            break
        stage = stage + 1
        kinds = {}
        if stage == 2:
            # Near an impact the derivative holds on one side only, so that a sample would determine a variable falsely.
            leverage = np.square(linear.rows[:, 1:] @ linear.root).sum(axis=1)
            highest = np.argsort(-leverage)[: int(_LEFT_OUT * len(leverage))]
            left_out = np.union1d(outliers, highest[leverage[highest] > _LEVERAGE])
    return point, linear, step, gain, outliers


def estimate_of(fitted: Fit, row: int, recordings: Sequence[str], conflict: str) -> Estimate:
    """Return the estimate of the number in a row of a fit, with verdict and explanation.

    ``conflict`` is a sentence on readings that the model does not explain, empty if it explains all.
    """
    number = fitted.numbers[row]
    value, low, high = (float(column[row]) for column in (fitted.values, fitted.low, fitted.high))
    bounds = max(number.low, fitted.by_name.get(number.base, -math.inf)), number.high
    width = relative_half_width(value, low, high, number.size)
    exact = _AT_BOUND * number.scale
    near = _NEAR * (high - low) if math.isfinite(high - low) else 0.0
    bound = next((end for end in bounds if abs(value - end) <= max(exact, near)), None)
    # Not 1e-17 where 0 is meant.
    value = bound if bound is not None and abs(value - bound) <= exact else value
    # A part whose interval begins at its bound of zero cannot be distinguished from no part.
    is_part = number.size is not None and number.low == 0.0 >= low
    if is_part and high < _NONE * (number.size or 0.0):
        value = bound = 0.0
    combination = next((each for each in fitted.unidentified if abs(each.get(number.name, 0.0)) >= _OWN_SHARE), None)
    verdict: Verdict = "holds for this model only" if conflict else "identified"
    scatter = 1.0 - sum(share for _, share in fitted.shares[number.name])
    parts = [("the scatter of the readings", scatter), *(p for p in fitted.shares[number.name] if p[0] != number.name)]
    # Of parts that are shown as equal, such as those of both chambers, the name decides.
    parts.sort(key=lambda part: (-float(f"{part[1]:.2g}"), part[0]))
    largest = ", ".join(f"{part} ({percentage(share, 2)})" for part, share in parts[:NAMED])
    text = number.text
    why = f"variance from {largest}"
    if bound == 0.0 and number.size is not None and width < UNKNOWN:
        text = f"{text}: none"
    elif combination is not None and not text:
        verdict = "not identifiable"
        # So far from where it was linearised the interval of a straight line means nothing.
        low = min(low, bounds[0])
        high = max(high, bounds[1])
        others = [other for other in combination if other != number.name]
        # Where the model lacks something, that may be what moves a number so far from its start.
        silent = conflict or "the recordings are hardly sensitive to this parameter"
        why = f"trades off against {' and '.join(others)}" if others else silent
    elif bound is not None and not number.base:
        verdict = "at its bound"
        why = f"the recordings favour a value at or beyond {shown_text(bound, number.unit)}"
    elif width >= UNKNOWN or is_part:
        verdict = "not identifiable"
        why = f"{why}; the interval includes zero or twice the value"
    elif conflict and not text:
        # Said of every number: which of them the missing physics moves is not known.
        why = conflict
    elif number.base and low <= bounds[0]:
        why = f"{why}; the interval contains its bound, {number.base}"
    else:
        ends = zip(bounds, (low, high), strict=True)
        cut = [bound for bound, end in ends if abs(end - bound) <= _AT_BOUND * abs(end)]
        why += f"; the interval ends at its bound, {shown_text(cut[0], number.unit)}" if cut else ""
    why = f"{text}; {why}." if text else why
    size = number.size
    confidence = fitted.confidence
    return Estimate(number.name, value, number.unit, low, high, verdict, why, tuple(recordings), confidence, size)
