"""Variables and residuals of a fit: variables with priors, blocks of residual rows, and model runs at scaled points."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import IdentificationError
from ppafo.progress import Report
from ppafo.signals.recording import Floats

Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]
Residuals = Callable[[Floats], Floats]
"""Function from points [SI] (numbers, points) to residuals measured - model [SI] (rows, points); NaN if a run fails."""


@dataclass(frozen=True, slots=True)
class FitVariable:
    """Variable of a fit: start, bounds and typical magnitude ``scale``, in SI units.

    ``deviation`` is the standard deviation of its prior about the start: infinite for an unknown, finite for a
    tolerance. Tolerances of one ``family``, such as the friction in each recording, are tested together.
    """

    name: str
    start: float
    low: float
    high: float
    scale: float
    deviation: float = math.inf
    family: str = ""


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


_UNITS_OF_NOISE = 3.0
"""Change of all residuals together in one finite difference, in units of noise [-]."""

_STEPS = (1.0e-7, 1.0e-3)
"""Shortest and longest finite difference, as fractions of the scale of a variable [-]."""


class FitRuns:
    """Model runs of a fit at scaled points; the residuals of the last single point are cached."""

    def __init__(
        self,
        residuals: Residuals,
        numbers: tuple[FitVariable, ...],
        blocks: tuple[ResidualBlock, ...],
        report: Report,
        memory: int,
        is_motion: bool,
    ) -> None:
        self.residuals, self.numbers, self.blocks, self.report = residuals, numbers, blocks, report
        self.memory, self.is_motion = memory, is_motion
        self.scale = np.array([number.scale for number in numbers])
        self.start, self.low, self.high, deviation = (
            np.array([getattr(number, name) for number in numbers]) / self.scale
            for name in ("start", "low", "high", "deviation")
        )
        self.prior = 1.0 / deviation
        self.mean = self.start
        self.evaluations = 0
        self.least: dict[str, float] = {}
        self.step = np.full(len(numbers), _STEPS[1])
        self.outliers = self.left_out = np.zeros(0, dtype=np.intp)
        self._last: tuple[bytes, Floats] | None = None

    def at(self, points: Floats) -> Floats:
        """Return residuals [SI] (rows, points) at scaled points (numbers, points)."""
        self.evaluations += points.shape[1]
        return self.residuals(points * self.scale[:, None])

    def one(self, point: Floats) -> Floats:
        """Return residuals [SI] (rows,) at one scaled point; a repeated call does not run the model again."""
        key = point.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self.at(point[:, None])[:, 0]
        return self._last[1]

    def jacobian(self, point: Floats, weight: Floats, *, is_central: bool = True) -> Floats:
        """Return the Jacobian of the residuals [SI] by the scaled variables, from finite differences in one batch.

        ``weight`` [1/SI] by row sets the step lengths for the next call. One-sided differences need half the runs and
        are accurate enough for the search.
        """
        above, below = np.minimum(point + self.step, self.high), np.maximum(point - self.step, self.low)
        sides = [above, below] if is_central else [np.where(above - point >= point - below, above, below)]
        values = self.at(np.concatenate([point[:, None] + np.diag(side - point) for side in sides], axis=1))
        centre, count = self.one(point), len(point)
        slopes = np.empty((len(centre), count))
        for index in range(count):
            tried = [
                (float(side[index]), values[:, index + side_number * count]) for side_number, side in enumerate(sides)
            ]
            ran = [(end, column) for end, column in tried if np.isfinite(column).all()]
            if not is_central and not ran:
                return self.jacobian(point, weight)
            (up, last), (down, first) = [*ran, (float(point[index]), centre)][:2]
            # Neither side runs: at a bound, or where a device is none.
            if up == down:
                free = self.numbers[index]
                raise IdentificationError(
                    f"{free.name}: no run succeeds near {point[index] * free.scale:.6g}; give other bounds or "
                    "another start"
                )
            slopes[:, index] = (last - first) / (up - down)
        # With a thousandth of the number 7 of 16 intervals held, with thirty units of noise 11, with three 28.
        sizes = np.linalg.norm(slopes * weight[:, None], axis=0)
        self.step = np.clip(_UNITS_OF_NOISE / np.maximum(sizes, 1.0e-300), *_STEPS)
        return slopes

    def rows_of(self, channel: str) -> list[slice]:
        """Return the rows of a channel in each recording."""
        return [block.rows for block in self.blocks if block.channel == channel]

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels, without duplicates."""
        return tuple(dict.fromkeys(block.channel for block in self.blocks))

    def shared(self) -> Floats:
        """Return the errors [SI] common to the rows of a recording, shape (rows, recordings with such errors)."""
        names = dict.fromkeys(block.recording for block in self.blocks if block.shared is not None)
        columns = np.zeros((self.blocks[-1].rows.stop, len(names)))
        for index, name in enumerate(names):
            for block in self.blocks:
                if block.recording == name and block.shared is not None:
                    columns[block.rows, index] = block.shared
        return columns

    def deviations(self, series: Floats) -> tuple[Floats, dict[str, float]]:
        """Return the noise [SI] of each row, and by channel, pooled over recordings and no less than the floor.

        ``series`` has the residuals as first column; further columns are the uncertainty of the fitted model.
        """
        noise, by_channel = np.empty(len(series)), {}
        for channel in self.channels:
            samples = np.concatenate([series[rows] for rows in self.rows_of(channel)])
            pooled = math.sqrt(float(np.square(samples).sum()) / len(samples))
            # Of its own size at the start: channels have units of their own, and a law may fit exactly.
            least = self.least.setdefault(channel, 1.0e-12 * (float(np.abs(samples[:, 0]).max()) or 1.0))
            blocks = [block for block in self.blocks if block.channel == channel]
            by_channel[channel] = max(pooled, least, float(np.min(blocks[0].floor)))
            for block in blocks:
                noise[block.rows] = np.maximum(max(pooled, least), block.floor)
        return noise, by_channel
