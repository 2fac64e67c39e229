"""Laws of a leak between two closed chambers, each as the decay of the pressure difference D = P1 - P2 in time.

At constant temperature dP1/dt = -k g(P1, P2) and dP2/dt = (V1/V2) k g, so D' = -(1 + V1/V2) k g, and the time to fall
from one D to another is an integral over D. It is worked out once for a law; the rate k only stretches the time.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ppafo.signals.recording import Floats

Shape = Callable[[Floats, Floats], Floats]
_POINTS = 1200
_MOST_DECADES = 14.0


@dataclass(frozen=True, slots=True)
class Law:
    """A law of flow: its name, its formula, the unit of its rate k, and g [Pa times the rest of that unit]."""

    name: str
    formula: str
    rate_unit: str
    shape: Shape


LAMINAR = Law("laminar", "k (P1^2 - P2^2)", "1/(s Pa)", lambda first, second: first**2 - second**2)
LINEAR = Law("linear", "k (P1 - P2), an exponential decay", "1/s", lambda first, second: first - second)
"""Laws of flow that an opening's is compared with."""


@dataclass(frozen=True, slots=True)
class Chambers:
    """Two closed chambers: volume_ratio V1/V2 [-], 0 where chamber 2 is a room; ``conserved`` = P1 V1/V2 + P2 [Pa]."""

    volume_ratio: float
    conserved: float

    def pressures(self, difference: Floats) -> tuple[Floats, Floats]:
        """Return both pressures [Pa] at a pressure difference [Pa]; no gas is lost to the outside."""
        second = (self.conserved - self.volume_ratio * difference) / (1.0 + self.volume_ratio)
        return second + difference, second


def decay_times(law: Law, chambers: Chambers, start: float, lowest: float) -> tuple[Floats, Floats]:
    """Return k t and the difference [Pa] from ``start`` down past ``lowest``: the decay for a rate of 1."""
    reach = min(2.0 * np.log(start / max(lowest, 1e-12 * start)) + 0.05, _MOST_DECADES)
    logs = np.linspace(0.0, reach, _POINTS)
    difference = start * np.exp(-logs)
    first, second = chambers.pressures(difference)
    slowness = difference / ((1.0 + chambers.volume_ratio) * law.shape(first, second))
    steps = 0.5 * (slowness[1:] + slowness[:-1]) * np.diff(logs)
    return np.concatenate(([0.0], np.cumsum(steps))), difference


def difference_in_time(law: Law, chambers: Chambers, start: float, rate: float, times: Floats, lowest: float) -> Floats:
    """Return the pressure difference [Pa] at times [s] after ``start`` [Pa] with the law's rate k."""
    stretched, difference = decay_times(law, chambers, start, lowest)
    return np.asarray(start * np.exp(np.interp(rate * times, stretched, np.log(difference / start))))
