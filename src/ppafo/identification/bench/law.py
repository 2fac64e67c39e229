"""A law of the bench as residuals of the one estimator, and the tolerances of a bench as numbers with priors.

A tolerance is a limit, as data sheets state it. Only the limit is known, so its prior has the standard deviation of an
even distribution between the limits, limit / sqrt(3) (GUM, JCGM 100:2008, 4.3.7).
"""

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.constants import PASCALS_PER_PSI
from ppafo.identification.fit import Block, Fit, Free, fit
from ppafo.signals.recording import Floats

Values = Mapping[str, float]
"""Numbers of a law by name, SI units; one that is not there is 0."""

_WIDEST = 12.0
"""Limits by which a tolerance may be off at most in the search."""


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Limits on either side of what a bench does not know exactly, in SI units or as a fraction; 0 is known.

    Temperature of the gas [K] where none is stated; departure from the ideal gas law; zero of each pressure sensor
    [Pa]; gain of each sensor; zero of the flow meter, of its largest reading; a number of the set or of the problem
    that states no uncertainty of its own.
    """

    temperature: float = 15.0
    gas_law: float = 0.01
    zero_of_pressure: float = 0.3 * PASCALS_PER_PSI
    gain: float = 0.005
    zero_of_flow: float = 0.05
    held: float = 0.02


DEFAULTS = Tolerances()
"""Of a bench of which a problem says nothing."""


def tolerance(name: str, limit: float, start: float = 0.0) -> tuple[Free, ...]:
    """Return a number known within a limit on either side of its start [SI]; nothing where the limit is 0."""
    if not limit > 0.0:
        return ()
    width = _WIDEST * limit
    return (Free(name, start, start - width, start + width, limit, limit / math.sqrt(3.0)),)


def sought(name: str, start: float, low: float = -math.inf, high: float = math.inf, scale: float = 0.0) -> Free:
    """Return a number that is sought [SI]; its scale is its start where none is given."""
    return Free(name, start, low, high, scale or abs(start) or 1.0)


def solve(
    law: Callable[[Values], Floats],
    measured: Floats,
    numbers: Sequence[Free],
    labels: tuple[Sequence[str], Sequence[str]],
    confidence: float,
) -> tuple[Fit, Floats]:
    """Return the fit of a law to readings, and what the law gives there, in the unit of what was measured.

    ``labels`` are two for each reading, of its recording or repetition and of its branch or level: readings of one
    label are a group whose numbers are compared with those of all.
    """
    names = [one.name for one in numbers]
    keys = list(zip(*labels, strict=True))
    ranks = {key: rank for rank, key in enumerate(dict.fromkeys(keys))}
    order = np.argsort([ranks[key] for key in keys], kind="stable")
    ends = np.cumsum([0, *np.bincount([ranks[key] for key in keys])])
    floor = 1.0e-6 * float(np.ptp(measured))
    blocks = [Block(*key, slice(int(ends[rank]), int(ends[rank + 1])), floor) for key, rank in ranks.items()]

    def at(point: Floats) -> Values:
        return defaultdict(float, zip(names, point.tolist(), strict=True))

    def residuals(points: Floats) -> Floats:
        return np.stack([(measured - law(at(point)))[order] for point in points.T], axis=1)

    found = fit(residuals, numbers, blocks, confidence)
    return found, law(at(found.values))
