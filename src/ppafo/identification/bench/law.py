"""Fit of bench laws by the common estimator, and tolerances of the bench as variables with priors."""

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.identification.conflict import wrong_shape
from ppafo.identification.fit import Fit, fit
from ppafo.identification.noise import SAMPLES_PER_COEFFICIENT
from ppafo.identification.residuals import FitVariable, ResidualBlock
from ppafo.identification.source import RecordingSource
from ppafo.signals.faults import resolution_of, rounding_of
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.usual_errors import deviation_of_limit

Values = Mapping[str, float]
"""Values of the fit variables by name [SI]; a missing name means 0."""

_MEMORY = 2
"""Highest order of the noise autoregression: enough for sensor lag, drift or hum, too low to absorb model error."""

_TELLING = 1.0e-3
"""Least residuals whose shape is tested [ranges of the readings]; smaller ones are lost in the errors of a bench."""

_WIDEST = 12.0
"""Largest deviation of a tolerance in the search, as a multiple of its limit [-]."""


def tolerance(name: str, deviation: float, start: float = 0.0, family: str = "") -> tuple[FitVariable, ...]:
    """Return a variable with a prior of standard deviation ``deviation`` about ``start`` [SI]; nothing if exact.

    Variables of one ``family`` are tested together.
    """
    if not deviation > 0.0:
        return ()
    # The scale of the search is the limit, so that a step of one scale is a likely one.
    limit = math.sqrt(3.0) * deviation
    width = _WIDEST * limit
    return (FitVariable(name, start, start - width, start + width, limit, deviation, family),)


def within(name: str, limit: float, family: str = "") -> tuple[FitVariable, ...]:
    """Return an error of the bench within +-``limit`` [SI], as a variable with a prior; nothing if exact."""
    return tolerance(name, deviation_of_limit(limit), family=family)


def sought(name: str, start: float, low: float = -math.inf, high: float = math.inf, scale: float = 0.0) -> FitVariable:
    """Return an unknown without a prior [SI]; the default scale is the magnitude of its start."""
    return FitVariable(name, start, low, high, scale or abs(start) or 1.0)


@dataclass(frozen=True, slots=True)
class PooledReadings:
    """Readings of all recordings, with labels for each reading.

    ``measured`` are the values [unit of the channel], ``sensors`` name the sensor (one noise each), ``recordings`` the
    recording or repetition, and ``groups`` other groups. The separate estimates of each sensor, recording and group are
    tested against the common estimates.
    """

    measured: Floats
    sensors: Sequence[str]
    recordings: Sequence[str]
    groups: tuple[Sequence[str], ...] = ()


def recordings_of(sources: tuple[RecordingSource, ...], counts: Iterable[int] = ()) -> list[str]:
    """Return for each reading the label of its recording, with the file name; ``counts`` are readings by recording."""
    sizes = tuple(counts) or [len(source.recording) for source in sources]
    pairs = enumerate(zip(sources, sizes, strict=True), start=1)
    return [label for number, (source, size) in pairs for label in [f"recording {number} ({source.name})"] * size]


def solve(
    law: Callable[[Values], Floats], readings: PooledReadings, numbers: Sequence[FitVariable], confidence: float
) -> tuple[Fit, Floats]:
    """Fit a law to readings. Returns the fit, and the fitted values in the unit of the readings.

    Residuals of sensors whose readings are too few for correlated noise are tested for runs in order of the law.
    """
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
    model = law(at(fitted.values))
    tested = (name for name in resolutions if fitted.correlation[name] == 0)
    for sensor in (name for name in tested if fitted.noise[name] > _TELLING * float(np.ptp(measured[sensors == name]))):
        series = []
        for block in (block for block in blocks if block.channel == sensor):
            samples = order[block.rows]
            by_law = samples[np.argsort(model[samples], kind="stable")]
            series.append((measured - model)[by_law] / fitted.noise[sensor])
        fitted = replace(fitted, conflict=fitted.conflict or wrong_shape(sensor, series))
    return fitted, model
