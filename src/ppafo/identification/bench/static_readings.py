"""Readings of a static torque test, by branch, repetition and pressure, and the straight lines through them.

Intervals stay honest where readings are not independent of each other.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import IdentificationError
from ppafo.identification.bench.curve_fit import CHANCE, exceeds_chance, quantile
from ppafo.identification.bench.inputs import check_moves, pool
from ppafo.identification.source import Source
from ppafo.signals.recording import Floats

Labels = NDArray[np.int64]
_FEWEST_CLUSTERS = 3


@dataclass(frozen=True, slots=True)
class Regression:
    """Coefficients in the order of the design's columns, half widths of their intervals, and the residuals.

    ``widened`` says how many times as wide each interval is as independent readings would have it, 1 where the line
    misses the cells by no more than the readings scatter in them.
    """

    coefficients: Floats
    half_widths: Floats
    residuals: Floats
    widest: str
    widened: Floats

    @property
    def scatter(self) -> float:
        """Standard deviation of the residuals, in the unit of what was fitted."""
        freedom = max(1, self.residuals.size - self.coefficients.size)
        return float(np.sqrt(self.residuals @ self.residuals / freedom))

    def differs_from_zero(self, index: int) -> bool:
        """Whether the interval of a coefficient leaves zero out."""
        return bool(abs(self.coefficients[index]) > self.half_widths[index])


def regress(
    design: Floats, values: Floats, clusters: Labels, cells: Labels, confidence: float, judged_by: int = 0
) -> Regression:
    """Return the least-squares fit; for each coefficient, in its unit, the widest of three intervals.

    1. Readings independent of each other. 2. Readings of one cluster (a repetition, a stroke) share an error: the
    cluster-robust covariance, where there are three clusters or more. 3. Readings of one cell (a pressure, one
    branch) share an error, as they do where the straight line does not quite hold: the regression of the cells' means.
    ``widest`` names the one that counted for the coefficient ``judged_by``.
    """
    inverse = np.asarray(np.linalg.inv(design.T @ design), dtype=np.float64)
    coefficients = inverse @ (design.T @ values)
    residuals = values - design @ coefficients
    candidates = {
        "independent readings": _independent_half_widths(design, inverse, residuals, confidence),
        "scatter between repetitions": _clustered_half_widths(design, inverse, residuals, clusters, confidence),
        "departure of pressure levels from a straight line": _cell_half_widths(design, values, cells, confidence),
    }
    stacked = np.array(list(candidates.values()))
    name = list(candidates)[int(np.argmax(stacked[:, judged_by]))]
    half_widths = stacked.max(axis=0)
    widened = np.ones_like(half_widths)
    if _misses(residuals, cells, design.shape[1]):
        np.divide(half_widths, stacked[0], out=widened, where=stacked[0] > 0.0)
    return Regression(coefficients, half_widths, residuals, name, widened)


def labels_of(parts: Sequence[Labels]) -> Labels:
    """Return one label for each combination of labels."""
    _, labels = np.unique(np.stack(parts), axis=1, return_inverse=True)
    return np.asarray(labels, dtype=np.int64).reshape(-1)


def _misses(residuals: Floats, cells: Labels, columns: int) -> bool:
    """Return whether the line misses the cells by more than the readings scatter in them: the test of lack of fit."""
    counts = np.bincount(cells)
    freedom, inner = counts.size - columns, residuals.size - counts.size
    if freedom < 1 or inner < 1:
        return False
    means = np.bincount(cells, weights=residuals) / counts
    between, within = counts @ means**2 / freedom, float(((residuals - means[cells]) ** 2).sum()) / inner
    return exceeds_chance(float(between), within, freedom, inner, CHANCE)


def _independent_half_widths(design: Floats, inverse: Floats, residuals: Floats, confidence: float) -> Floats:
    freedom = design.shape[0] - design.shape[1]
    variance = residuals @ residuals / freedom
    return np.asarray(quantile(confidence, freedom) * np.sqrt(variance * np.diag(inverse)))


def _clustered_half_widths(
    design: Floats, inverse: Floats, residuals: Floats, clusters: Labels, confidence: float
) -> Floats:
    count, columns = design.shape
    groups = int(clusters.max()) + 1
    if groups < _FEWEST_CLUSTERS or groups >= count:
        return np.zeros(columns)
    scores = np.zeros((groups, columns))
    np.add.at(scores, clusters, design * residuals[:, None])
    correction = groups / (groups - 1) * (count - 1) / (count - columns)
    covariance = correction * inverse @ (scores.T @ scores) @ inverse
    return np.asarray(quantile(confidence, groups - 1) * np.sqrt(np.diag(covariance)))


def _cell_half_widths(design: Floats, values: Floats, cells: Labels, confidence: float) -> Floats:
    columns = design.shape[1]
    groups = int(cells.max()) + 1
    if groups <= columns or groups >= values.size:
        return np.zeros(columns)
    counts = np.bincount(cells)
    means = np.stack([np.bincount(cells, weights=column) / counts for column in (*design.T, values)])
    mean_design, mean_values = means[:-1].T, means[-1]
    if np.linalg.matrix_rank(mean_design) < columns:
        return np.zeros(columns)
    inverse = np.asarray(np.linalg.inv(mean_design.T @ mean_design), dtype=np.float64)
    residuals = mean_values - mean_design @ (inverse @ (mean_design.T @ mean_values))
    return _independent_half_widths(mean_design, inverse, residuals, confidence)


PROCEDURE = "static-torque"
Flags = NDArray[np.bool_]
MINIMUM_SAMPLES = 6
_MINIMUM_LEVELS = 3
_LEVEL_GAP = 1.0 / 40.0
_WIDEST_LEVEL = 1.0 / 8.0
_BINS = 20
_FLAT = 0.002


@dataclass(frozen=True, slots=True)
class Readings:
    """All readings of a branch: pressure difference [Pa], torque [N m], branch (+1, -1), groups, place in a file."""

    pressure: Floats
    torque: Floats
    branch: Floats
    clusters: Labels
    levels: Labels
    places: tuple[str, ...]

    @property
    def middle(self) -> float:
        """Mean pressure difference [Pa]."""
        return float(np.mean(self.pressure))


def readings_of(sources: tuple[Source, ...]) -> Readings:
    """Return the readings of all recordings; IdentificationError where they cannot separate slope from friction."""
    direction = pool(sources, "direction")
    for source in sources:
        _check_direction(source)
    used = direction != 0.0
    used &= ~_not_broken_away(pool(sources, "pressure_difference"), pool(sources, "torque"), direction)
    pressure, torque = pool(sources, "pressure_difference")[used], pool(sources, "torque")[used]
    if pressure.size < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs at least {MINIMUM_SAMPLES} readings, there are {pressure.size}"
        )
    for sign, name in ((1.0, "rising"), (-1.0, "falling")):
        if not (direction[used] == sign).any():
            raise IdentificationError(
                f"{', '.join(source.name for source in sources)}: {PROCEDURE}: the {name} branch is missing: no "
                f"reading has direction {sign:+.0f}; without both, friction cannot be separated from "
                "the zero of the scale"
            )
    if pressure.max() == pressure.min():
        check_moves(sources[0], PROCEDURE, "pressure_difference")
    levels = _levels(pressure)
    if levels.max() + 1 < _MINIMUM_LEVELS:
        raise IdentificationError(
            f"{sources[0].name}: {PROCEDURE} needs readings at {_MINIMUM_LEVELS} different pressures or more, "
            f"there are {levels.max() + 1}"
        )
    places = tuple(
        f"sample {number} of {source.name}" for source in sources for number in range(1, len(source.recording) + 1)
    )
    kept = tuple(place for place, is_used in zip(places, used.tolist(), strict=True) if is_used)
    return Readings(pressure, torque, direction[used], _clusters(sources)[used], levels, kept)


def _not_broken_away(pressure: Floats, torque: Floats, direction: Floats) -> Flags:
    """Return which rising readings lie on a flat start: a scale that only pulls shows none until friction is overcome.

    A flat start is a lowest reading that belongs to two pressures or more, or is nothing at all.
    """
    lowest = torque.min()
    resting = (direction > 0.0) & (torque <= lowest + _FLAT * np.ptp(torque))
    is_flat = resting.any() and np.ptp(pressure[resting]) > _LEVEL_GAP * np.ptp(pressure)
    return np.asarray(resting if is_flat or lowest == 0.0 else np.zeros_like(resting))


def _check_direction(source: Source) -> None:
    values = source.recording["direction"]
    wrong = np.flatnonzero(~np.isin(values, (-1.0, 0.0, 1.0)))
    if wrong.size:
        raise IdentificationError(
            f"{source.name}: {PROCEDURE}: channel 'direction' is {values[wrong[0]]:g} at sample {wrong[0] + 1}; "
            f"it is 1 while the pressure rises, -1 while it falls, 0 for neither"
        )


def _clusters(sources: tuple[Source, ...]) -> Labels:
    """Return one label for each repetition of each recording; without repetitions a recording is one cluster."""
    files = np.concatenate([np.full(len(source.recording), number) for number, source in enumerate(sources)])
    repetitions = [
        source.recording["repetition"] if "repetition" in source.recording else np.zeros(len(source.recording))
        for source in sources
    ]
    _, labels = np.unique(np.concatenate(repetitions), return_inverse=True)
    return labels_of([files.astype(np.int64), labels.astype(np.int64)])


def _levels(pressure: Floats) -> Labels:
    """Return which pressure level each reading belongs to: groups with gaps between them, else equal parts."""
    span = float(pressure.max() - pressure.min())
    if span == 0.0:
        return np.zeros(pressure.size, dtype=np.int64)
    order = np.argsort(pressure)
    steps = np.diff(pressure[order]) > _LEVEL_GAP * span
    levels = np.empty(pressure.size, dtype=np.int64)
    levels[order] = np.concatenate(([0], np.cumsum(steps)))
    widths = [float(np.ptp(pressure[levels == level])) for level in range(int(levels.max()) + 1)]
    if max(widths) <= _WIDEST_LEVEL * span:
        return levels
    bins = np.minimum((pressure - pressure.min()) / span * _BINS, _BINS - 1).astype(np.int64)
    return labels_of([bins])
