"""What a league reports of one entrant, and of a valve: measures, robustness over draws, lower bound; any task."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from ppafo.progress import Report
from ppafo.questions.league.entrants import Entrant
from ppafo.questions.league.learning import Learning
from ppafo.studies.intervals import Interval, noise_interval

Measures = Mapping[str, float]
"""Values [SI] by name."""


@dataclass(frozen=True, slots=True)
class Robustness:
    """Measures on each draw; None where the run diverged.

    ``renoised`` are those of the first draws again, each with other noise; empty where the controller receives none.
    """

    drawn: tuple[Measures | None, ...]
    renoised: tuple[Measures | None, ...] = ()

    def values(self, measure: str, missing: float) -> list[float]:
        """Return a measure [SI] of every draw, ``missing`` where the run diverged."""
        return [missing if item is None else item[measure] for item in self.drawn]

    def not_exceeded(self, measure: str, fraction: float) -> float:
        """Return the value [SI] that this fraction of the draws does not exceed; inf where a run diverged."""
        return float(np.quantile(self.values(measure, float("inf")), fraction, method="higher"))

    def noise(self, measure: str) -> Interval | None:
        """Return the fraction of the variance over the draws that is due to noise, with its 95 % interval."""
        if not self.renoised:
            return None
        again = Robustness(self.renoised).values(measure, np.nan)
        return noise_interval(np.array(self.values(measure, np.nan)[: len(again)]), np.array(again), 0.95)

    @property
    def failed(self) -> int:
        """Number of draws on which the run diverged."""
        return self.drawn.count(None)


@dataclass(frozen=True, slots=True)
class Standing:
    """One entrant: the settings of its controller [SI], its period [s], the measures of its run, and the command.

    ``robustness`` is None without draws, ``learning`` for an entrant that does not learn.
    """

    entrant: Entrant
    settings: Measures
    period: float
    measures: Measures
    robustness: Robustness | None
    command: str
    status: str = "completed"
    learning: Learning | None = None


class Point(Protocol):
    """A control: its RMS error [N m] and its gas [kg]."""

    @property
    def rms_error(self) -> float:
        """RMS error [N m]."""

    @property
    def gas(self) -> float:
        """Gas taken from the supply [kg]."""


class Bound(Protocol):
    """What no control of a valve can pass: the minimum error, and the minimum gas at growing errors."""

    @property
    def least_error(self) -> Point:
        """The control with the minimum error."""

    @property
    def curve(self) -> Sequence[Point]:
        """The controls with the minimum gas, in order of their error."""

    @property
    def is_attainable(self) -> bool:
        """True where the minimum error counts as none."""


B_co = TypeVar("B_co", bound=Bound, covariant=True)


@dataclass(frozen=True, slots=True)
class Bounded(Generic[B_co]):
    """The lower bound of a valve, and what the engine makes of its controls; none where no valve can play them.

    ``least_gas`` is, by entrant, the minimum gas [kg] with which what it reached is possible.
    """

    bound: B_co
    played: tuple[Point, ...]
    least_gas: Measures

    @property
    def points(self) -> tuple[Point, ...]:
        """The minimum error, and the curve after it."""
        return (self.bound.least_error, *self.bound.curve)


class Contest(Protocol):
    """A task for all entrants; ``error`` and ``gas`` name the measures that the bound is for."""

    @property
    def name(self) -> str:
        """What the task is, in words."""

    @property
    def overrides(self) -> tuple[str, ...]:
        """What is changed for all."""

    @property
    def entrants(self) -> tuple[Entrant, ...]:
        """Who plays by default."""

    @property
    def error(self) -> str:
        """The measure by which entrants are ranked, an RMS error [N m]."""

    @property
    def gas(self) -> str:
        """The measure that is the gas taken from the supply [kg]."""

    def evaluate(self, entrant: Entrant, draws: int, seed: int, progress: Report) -> Standing:
        """Return how an entrant does, over draws too unless 0; a PpafoError states why it cannot play."""

    def bound(self, valve: str, standings: Sequence[Standing], progress: Report) -> Bounded[Bound]:
        """Return the bound of a valve that these played with; SimulationError or ScenarioError where there is none."""
