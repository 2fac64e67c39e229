"""A law of the bench as residuals of the one estimator, and what a bench does not know as numbers with priors."""

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.identification.fit import Fit, fit
from ppafo.identification.noise import SAMPLES_PER_COEFFICIENT
from ppafo.identification.residuals import FitVariable, ResidualBlock
from ppafo.identification.source import RecordingSource
from ppafo.signals.faults import resolution_of, rounding_of
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.usual_errors import deviation_of_limit

Values = Mapping[str, float]
"""Numbers of a law by name, SI units; one that is not there is 0."""

_MEMORY = 2
"""Coefficients of the noise at most: for a slow sensor, drift or hum. More would pass the misfit of a law for noise."""

_WIDEST = 12.0
"""Limits by which a tolerance may be off at most in the search."""


def tolerance(name: str, deviation: float, start: float = 0.0, family: str = "") -> tuple[FitVariable, ...]:
    """Return a number known to a standard deviation about its start [SI]; nothing where it is known exactly.

    Those of one ``family`` are tested together.
    """
    if not deviation > 0.0:
        return ()
    # The scale of the search is the limit, so that a step of one scale is a likely one.
    limit = math.sqrt(3.0) * deviation
    width = _WIDEST * limit
    return (FitVariable(name, start, start - width, start + width, limit, deviation, family),)


def within(name: str, limit: float, family: str = "") -> tuple[FitVariable, ...]:
    """Return an error of the bench, known within a limit on either side of 0 [SI]; see ``tolerance``."""
    return tolerance(name, deviation_of_limit(limit), family=family)


def sought(name: str, start: float, low: float = -math.inf, high: float = math.inf, scale: float = 0.0) -> FitVariable:
    """Return a number that is sought [SI]; its scale is its start where none is given."""
    return FitVariable(name, start, low, high, scale or abs(start) or 1.0)


@dataclass(frozen=True, slots=True)
class PooledReadings:
    """Readings by their sensor, whose noise is one, by recording or repetition, and by groups: a label for each.

    Numbers of a recording, of a sensor and of a group are compared with the numbers of all.
    """

    measured: Floats
    sensors: Sequence[str]
    recordings: Sequence[str]
    groups: tuple[Sequence[str], ...] = ()


def recordings_of(sources: tuple[RecordingSource, ...], counts: Iterable[int] = ()) -> list[str]:
    """Return what a recording is called, with its file, for each of its readings, of which there are ``counts``."""
    sizes = tuple(counts) or [len(source.recording) for source in sources]
    pairs = enumerate(zip(sources, sizes, strict=True), start=1)
    return [label for number, (source, size) in pairs for label in [f"recording {number} ({source.name})"] * size]


def solve(
    law: Callable[[Values], Floats], readings: PooledReadings, numbers: Sequence[FitVariable], confidence: float
) -> tuple[Fit, Floats]:
    """Return the fit of a law to readings, and what the law gives there, in the unit of what was measured."""
    names, measured = [number.name for number in numbers], readings.measured
    keys = list(zip(readings.recordings, readings.sensors, *readings.groups, strict=True))
    # In the order of their first reading, so that the first block is the first recording.
    ranks = {key: rank for rank, key in enumerate(dict.fromkeys(keys))}
    # A block of the fit is a slice, so that readings of one label must lie side by side.
    order = np.argsort([ranks[key] for key in keys], kind="stable")
    counts = np.bincount([ranks[key] for key in keys])
    ends = np.cumsum([0, *counts])
    sensors = np.array(readings.sensors)
    resolutions = {name: resolution_of(measured[sensors == name]) for name in dict.fromkeys(readings.sensors)}
    # A meter shows six digits at most: residuals below say nothing.
    least, blocks = 1.0e-6 * float(np.ptp(measured)), []
    for (recording, sensor, *groups), rank in ranks.items():
        rows = slice(int(ends[rank]), int(ends[rank + 1]))
        floor = np.maximum(least, rounding_of(measured[order][rows], resolutions[sensor]))
        blocks.append(ResidualBlock(recording, sensor, rows, floor, groups=tuple(groups)))

    def at(point: Floats) -> Values:
        return defaultdict(float, zip(names, point.tolist(), strict=True))

    def residuals(points: Floats) -> Floats:
        return np.stack([(measured - law(at(point)))[order] for point in points.T], axis=1)

    fitted = fit(
        residuals, numbers, blocks, confidence, memory=min(_MEMORY, int(counts.min()) // SAMPLES_PER_COEFFICIENT)
    )
    return fitted, law(at(fitted.values))
