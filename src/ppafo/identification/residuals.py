"""Variables and residuals of a fit: variables with priors, blocks of residual rows, and model runs at scaled points."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import IdentificationError
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


@dataclass(frozen=True, slots=True)
class FitVariable:
    """Variable of a fit: start, bounds and typical magnitude ``scale``, in SI units.

    ``deviation`` is the standard deviation of its prior about the start: infinite for an unknown, finite for a
    tolerance. Tolerances of one ``family``, such as the friction in each recording, are tested together. With a
    ``base``, the name of another variable of the same scale, start and bounds are of the excess over that variable.
    """

    name: str
    start: float
    low: float
    high: float
    scale: float
    deviation: float = math.inf
    family: str = ""
    base: str = ""


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
    ``base @ point`` has the scaled values over which variables with a base are counted, 0 for the others.
    """

    def __init__(
        self,
        residuals: Residuals,
        numbers: tuple[FitVariable, ...],
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
        self.channels = tuple(dict.fromkeys(block.channel for block in blocks))
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
            raise IdentificationError(
                f"{number.name}: every run fails near {point[failing[0]] * number.scale:.6g}; give other bounds "
                "or another start value"
            )
        at_first = np.where(runs_above, values_above, values_below)
        at_second = np.where(runs_both, values_below, self.residuals_at(point)[:, None])
        return np.ascontiguousarray((at_first - at_second) / (first - second))

    def adapt_steps(self, slopes: Floats, weight: Floats) -> None:
        """Set the lengths of finite differences from a Jacobian [SI] and the weights [1/SI] of its rows."""
        sizes = np.linalg.norm(slopes * weight[:, None], axis=0)
        self.steps = np.clip(_UNITS_OF_NOISE / np.maximum(sizes, 1.0e-300), _SHORTEST_STEP, _LONGEST_STEP)

    def rows_of(self, channel: str) -> list[slice]:
        """Return the rows of a channel, one slice for each recording."""
        return [block.rows for block in self.blocks if block.channel == channel]

    def shared(self) -> Floats:
        """Return the errors [SI] common to the rows of a recording, shape (rows, recordings with such errors)."""
        names = list(dict.fromkeys(block.recording for block in self.blocks if block.shared is not None))
        columns = np.zeros((self.blocks[-1].rows.stop, len(names)))
        for block in self.blocks:
            if block.shared is not None:
                columns[block.rows, names.index(block.recording)] = block.shared
        return columns

    @cached_property
    def _least_noise(self) -> dict[str, float]:
        """Noise floor by channel [SI], proportional to the channel's largest residual at the start."""
        start = self.residuals_at(self.start)
        largest = {name: max(float(np.abs(start[rows]).max()) for rows in self.rows_of(name)) for name in self.channels}
        return {name: _LEAST_NOISE * (size or 1.0) for name, size in largest.items()}

    def deviations(self, series: Floats) -> tuple[Floats, dict[str, float]]:
        """Return the noise [SI] by row and by channel, pooled over recordings and not below the floor.

        ``series`` has the residuals as first column; further columns are the uncertainty of the fitted model.
        """
        noise, by_channel = np.empty(len(series)), {}
        for channel, least in self._least_noise.items():
            samples = np.concatenate([series[rows] for rows in self.rows_of(channel)])
            pooled = max(math.sqrt(float(np.square(samples).sum()) / len(samples)), least)
            blocks = [block for block in self.blocks if block.channel == channel]
            by_channel[channel] = max(pooled, float(np.min(blocks[0].floor)))
            for block in blocks:
                noise[block.rows] = np.maximum(pooled, block.floor)
        return noise, by_channel
