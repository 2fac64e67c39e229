"""A tuning as frozen values in SI units."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ppafo.simulation.scenario import Scenario
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import Uncertainty
from ppafo.studies.varying import VariedPath

AT_BOUND = 0.01
"""A gain has ended at a bound where it is nearer to it than this fraction of the way between the two."""

Gains = Mapping[str, float]


@dataclass(frozen=True, slots=True)
class SearchRange:
    """A path, its bounds [SI], whether its logarithm is searched, its value before [SI], and how it is written."""

    path: str
    minimum: float
    maximum: float
    is_logarithmic: bool
    before: float
    place: VariedPath

    def value(self, fraction: Floats) -> Floats:
        """Return values [SI] at fractions of the way from the minimum to the maximum."""
        if self.is_logarithmic:
            return self.minimum * np.exp(math.log(self.maximum / self.minimum) * fraction)
        return self.minimum + (self.maximum - self.minimum) * fraction

    def fraction(self, value: float) -> float:
        """Return the fraction of the way at which a value lies; outside 0 to 1 beyond the bounds."""
        if self.is_logarithmic:
            return math.log(value / self.minimum) / math.log(self.maximum / self.minimum) if value > 0.0 else -math.inf
        return (value - self.minimum) / (self.maximum - self.minimum)

    def bound_reached(self, value: float) -> Literal["minimum", "maximum"] | None:
        """Return the bound at which a value lies, None where it is between them."""
        fraction = self.fraction(value)
        if fraction <= AT_BOUND:
            return "minimum"
        return "maximum" if fraction >= 1.0 - AT_BOUND else None


@dataclass(frozen=True, slots=True)
class Goal:
    """A term of the objective: weight times metric over scale [SI]; by default the value before tuning."""

    metric: str
    weight: float
    scale: float | None


@dataclass(frozen=True, slots=True)
class Constraint:
    """A metric with the largest value that it may have [SI], or the smallest where not ``is_most``."""

    metric: str
    limit: float
    is_most: bool
    text: str


@dataclass(frozen=True, slots=True)
class Spread:
    """Draws over which a candidate is judged: distributions, how many, their seed, and the bad end of the result.

    The bad end is the quantile at ``fraction``, or where that is None the mean and ``deviations`` standard deviations.
    ``study`` is empty where the noise of the sensors is all that is drawn.
    """

    uncertainty: Uncertainty
    study: str
    draws: int
    seed: int
    deviations: float
    fraction: float | None

    @property
    def measure(self) -> str:
        """The measure by which candidates are judged, in words."""
        if self.fraction is not None:
            return f"{100.0 * self.fraction:g} % quantile"
        if self.deviations == 0.0:
            return "mean"
        return f"mean and {self.deviations:g} standard deviation{'' if self.deviations == 1.0 else 's'}"

    def bad_end(self, values: Floats, is_high: bool) -> Floats:
        """Return the high, or low, end of values (candidates, draws) [SI], shape (candidates,)."""
        if self.fraction is not None:
            return np.asarray(np.quantile(values, self.fraction if is_high else 1.0 - self.fraction, axis=1))
        spread = self.deviations * np.std(values, axis=1, ddof=1)
        return np.asarray(np.mean(values, axis=1) + (spread if is_high else -spread))


@dataclass(frozen=True, slots=True)
class Effort:
    """Independent starts, generations of each at most, candidates of a generation per gain, seed."""

    starts: int
    generations: int
    candidates_per_gain: int
    seed: int


@dataclass(frozen=True, slots=True, repr=False)
class Problem:
    """What is searched in a scenario, for what, and how long.

    ``spread`` is None for the device as it is said to be, with sensors without noise.
    """

    name: str
    description: str
    scenario: Scenario
    overrides: tuple[str, ...]
    searched: tuple[SearchRange, ...]
    goals: tuple[Goal, ...]
    constraints: tuple[Constraint, ...]
    spread: Spread | None
    effort: Effort

    def __repr__(self) -> str:
        """Return name, scenario and what is searched."""
        return f"Tuning '{self.name}' of '{self.scenario.name}': {', '.join(item.path for item in self.searched)}"

    @property
    def metrics(self) -> tuple[str, ...]:
        """Every metric that the goals and constraints need, each once."""
        wanted = [*(item.metric for item in self.goals), *(item.metric for item in self.constraints)]
        return tuple(dict.fromkeys(wanted))

    @property
    def before(self) -> Gains:
        """The values before tuning [SI]."""
        return {item.path: item.before for item in self.searched}

    @property
    def gauge(self) -> frozenset[str]:
        """The paths, searched and drawn, whose values count from the atmosphere of their run."""
        drawn = frozenset[str]() if self.spread is None else self.spread.uncertainty.gauge
        return drawn | {item.path for item in self.searched if item.place.is_gauge}

    def gains(self, fractions: Sequence[float]) -> Gains:
        """Return the values [SI] at fractions of the way, rounded as written: what is pasted is what was run."""
        values = {
            item.path: float(item.value(np.asarray(fraction)))
            for item, fraction in zip(self.searched, fractions, strict=True)
        }
        return {item.path: item.place.level(item.place.quote(values[item.path])) for item in self.searched}

    def lines(self, gains: Gains) -> list[str]:
        """Return gains as overrides, ``PATH=VALUE``."""
        return [f"{item.path}={item.place.quote(gains[item.path])}" for item in self.searched]
