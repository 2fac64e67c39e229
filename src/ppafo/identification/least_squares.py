"""Nonlinear least squares at a point: model runs, whitened linearisation and step, limits from profile likelihood.

For a linear law the covariance gives the limits. For a nonlinear law, such as one in which only a product of two
variables counts, distant values may explain the recordings as well: a limit is the value at which the minimum of the
squares over all other variables is larger by t^2, with Student's factor t (profile likelihood).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from ppafo.errors import IdentificationError
from ppafo.identification.noise import Noise, noise_of, whiten
from ppafo.progress import Report
from ppafo.signals.recording import Floats

Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]
Residuals = Callable[[Floats], Floats]
"""Function from points [SI] (numbers, points) to residuals measured - model [SI] (rows, points); NaN if a run fails."""
_UNITS_OF_NOISE = 3.0
"""Combined change of all residuals in a finite difference, in units of noise [-].

Differences of a thousandth of the variable, or of thirty units of noise, gave fewer intervals with the true value."""
_SHORTEST_STEP, _LONGEST_STEP = 1.0e-7, 1.0e-3
"""Shortest and longest finite difference, as fractions of the scale of a variable [-]."""
_LEAST_NOISE = 1.0e-12
"""Least noise of a channel, relative to its largest residual at the start [-], for a law that fits exactly."""
_OF_ANY_SIZE = 1.0e8
"""Standard deviation of an error of unknown magnitude, relative to the noise [-]."""
_ROUNDS = 20
"""Largest number of iterations between noise and variables; most fits converge in a few."""
SHORT = 0.1
"""Shortest fraction of a step that is tried [-], from which its curvature is found too."""
_SHARES = np.array([1.0, 0.5, 0.25])[:, None]
"""Longer fractions of a step [-]; the best is taken."""
_STILL = 1.0e-3
"""Change of the step between iterations [standard errors] at which noise and variables agree."""
_RANK = 1.0e-13
"""Least eigenvalue of the scaled curvature [-] for a direction to be observable."""
_TRIES, _STEPS = 10, 12
"""Largest numbers of trial points per limit, and of Gauss-Newton steps of the other variables at each."""
_SETTLED = 0.02
"""Decrease of the squares [-] below which the other variables have converged."""
_CLOSE = 0.01
"""Relative distance of the profile from its wanted value [-] from which a limit is extrapolated."""
_AWAY = 0.1
"""Least distance of a trial limit from both ends of its bracket, as a fraction of the bracket [-]."""


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

    ``start`` is also the mean of the priors, ``prior`` the reciprocal of their standard deviations, 0 for an unknown;
    both are scaled. ``steps`` are the lengths of finite differences [-], which ``adapt_steps`` changes.
    ``base @ point`` has the scaled values over which variables with a base are counted, 0 for the others. ``channels``
    are the blocks by channel.
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
        self._residuals, self.numbers, self.blocks, self.report = residuals, numbers, blocks, report
        self.memory, self.is_motion = memory, is_motion
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

        One-sided differences need half the runs and are accurate enough for the search; where one of their runs fails,
        central differences are returned. Raises IdentificationError if no run succeeds on either side of a variable.
        """
        above, below = np.minimum(point + self.steps, self.high), np.maximum(point - self.steps, self.low)
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
        first, second = np.where(runs_above, above, below), np.where(runs_both, below, point)
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
        largest = (max(float(np.abs(start[block.rows]).max()) for block in blocks) for blocks in self.channels.values())
        return {name: _LEAST_NOISE * (size or 1.0) for name, size in zip(self.channels, largest, strict=True)}

    def deviations(self, series: Floats) -> tuple[Floats, dict[str, float]]:
        """Return the noise [SI] by row and by channel, pooled over recordings and not below the floor.

        ``series`` has the residuals as first column; further columns are the uncertainty of the fitted model.
        """
        noise, by_channel = np.empty(len(series)), {}
        for channel, blocks in self.channels.items():
            samples = np.concatenate([series[block.rows] for block in blocks])
            pooled = max(math.sqrt(float(np.square(samples).sum()) / len(samples)), self._least_noise[channel])
            by_channel[channel] = max(pooled, float(np.min(blocks[0].floor)))
            for block in blocks:
                noise[block.rows] = np.maximum(pooled, block.floor)
        return noise, by_channel


class Linear(NamedTuple):
    """Linearised least-squares problem of some runs.

    ``rows``: whitened residuals and Jacobian [-], side by side. ``shared``: columns [-] for correlated errors, common
    to the samples of a recording or covering the samples left out; after subtraction of ``shared @ (shared.T @ x)`` the
    errors are independent. ``root``: square root of the covariance of the scaled variables. ``noise``: noise of each
    row [SI]. ``sensors``: noise model by channel.
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
        """Return the sum of squares [-] of independent errors (rows, points) and priors, for each scaled point."""
        away = (points - self.runs.start[:, None]) * self.runs.prior[:, None]
        return np.asarray(np.square(errors).sum(axis=0) + np.square(away).sum(axis=0))

    def cost(self, residuals: Floats, point: Floats) -> float:
        """Return the sum of squares [-] of priors and whitened residuals, given residuals [SI] (rows,) at a point."""
        return float(self.squares(self.errors(residuals[:, None]), point[:, None])[0])


def linear_at(
    runs: FitRuns, point: Floats, residuals: Floats, slopes: Floats, left_out: Indices, like: Mapping[str, Noise]
) -> tuple[Linear, Floats]:
    """Return the whitened problem at a point, and the step to its least-squares solution within the bounds.

    Fitting absorbs part of the noise, which is then missing in the residuals. The expected part J C J' is added and the
    noise re-estimated until both agree (expectation maximisation), so that slow noise is not underestimated. Rows
    ``left_out`` say nothing. Kind and order of the noise are those of ``like`` by channel, if it has any.
    """
    step, hidden = np.zeros(len(point)), np.zeros((len(residuals), 0))
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
        sensors, scaled = {}, np.column_stack([residuals, slopes, common]) / noise[:, None]
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
        root, _ = root_of_inverse(rows[:, 1:].T @ rows[:, 1:] + np.diag(np.square(runs.prior)))
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


def root_of_inverse(curvature: Floats) -> tuple[Floats, Flags]:
    """Return a square root of the inverse of a matrix, and flags of its columns that belong to observable directions.

    The columns of unobservable directions are large.
    """
    sizes = np.sqrt(np.maximum(np.diag(curvature), 0.0))
    size = np.where(sizes > 1.0e-9 * sizes.max(initial=0.0), sizes, sizes.max(initial=1.0e-9) or 1.0)
    values, vectors = np.linalg.eigh(curvature / size / size[:, None])
    return np.asarray(vectors / np.sqrt(np.maximum(values, _RANK)) / size[:, None]), np.asarray(values > _RANK)


def best_along(
    linear: Linear, point: Floats, residuals: Floats, step: Floats, slopes: Floats
) -> tuple[float, Floats, Floats]:
    """Return the least sum of squares [-] along a step from a scaled point, its point, and the residuals [SI] there.

    The way bends as the residuals do along the step (geodesic acceleration), because static friction trades off against
    its fall along a curved valley. A variable without a step stays. ``slopes`` is the whitened Jacobian [-] at the
    point. The sum is infinite if no run succeeds, even after a ``SHORT`` fraction of the step.
    """
    runs = linear.runs
    ends = np.clip(np.column_stack([point + SHORT * step, point - SHORT * step]).T, runs.low, runs.high).T
    ahead, behind = runs.residuals_at_points(ends).T
    curvature = linear.errors(((ahead - residuals) + (behind - residuals))[:, None] / SHORT**2)[:, 0]
    bend = np.zeros(len(point))
    if np.isfinite(curvature).all():
        right_side = np.concatenate([curvature, bend])
        bend -= np.linalg.lstsq(np.concatenate([slopes, np.diag(runs.prior)]), right_side, rcond=None)[0]
        bend[step == 0.0] = 0.0
    tried = np.clip(point + _SHARES * step + 0.5 * np.square(_SHARES) * bend, runs.low, runs.high).T
    points = np.column_stack([tried, ends[:, 0]])
    found = np.column_stack([runs.residuals_at_points(tried), ahead])
    squares = linear.squares(linear.errors(found), points)
    best = int(np.argmin(np.where(np.isfinite(squares), squares, np.inf)))
    return (float(squares[best]) if np.isfinite(squares[best]) else np.inf), points[:, best], found[:, best]


def interval_ends(linear: Linear, point: Floats, times: float) -> tuple[Floats, Floats]:
    """Return scaled lower and upper confidence limits: ``times`` standard errors, or wider for nonlinear laws.

    Only intervals of unknowns without a prior are widened, by profile likelihood. The profile is the root of the
    increase of the squares: by how many standard errors priors and samples tell a point from the estimate. It is
    searched from the linear limit to the bound, which is the limit where the samples determine none.
    """
    runs, covariance = linear.runs, linear.root @ linear.root.T
    wide = times * np.sqrt(np.diag(covariance))
    low, high = np.maximum(point - wide, runs.low), np.minimum(point + wide, runs.high)
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
                    before, inner = inner, (reached, profile)
                other = before if outer is None else outer
                rise, missing = abs(other[1] - inner[1]), times - inner[1]
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

    The other variables take Gauss-Newton steps within their bounds, each with its own Jacobian, because far from the
    estimate its Jacobian leads out of a curved valley. The sum is infinite if no run succeeds.
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
        reached, tried, found = best_along(linear, point, residuals, step, slopes)
        fall = squares - reached
        if not fall > 0.0:
            break
        point, residuals, squares = tried, found, reached
        if fall < _SETTLED:
            break
    return squares, point
