"""What the league says of one walking entrant, and of all of them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ppafo.studies.league.walking.bound import WalkingBound
from ppafo.studies.league.walking.entrants import WalkingEntrant
from ppafo.studies.league.walking.playing import PlayedStride
from ppafo.studies.league.walking.task import WalkingTask
from ppafo.studies.uncertainty.intervals import Interval, noise_interval
from ppafo.walking.configuration import Configuration


@dataclass(frozen=True, slots=True)
class WalkingRobustness:
    """Measures by name for each drawn wearer and device; None where the walk diverged.

    ``renoised`` are those of the first of them with other noise; none where the sensors are ideal.
    """

    drawn: tuple[Mapping[str, float] | None, ...]
    renoised: tuple[Mapping[str, float] | None, ...] = ()

    @property
    def noise(self) -> Interval | None:
        """Share of the variance of the torque errors over the draws that noise makes, with its 95 % interval."""
        first, again = (
            np.array([np.nan if item is None else item["torque_error"] for item in items])
            for items in (self.drawn[: len(self.renoised)], self.renoised)
        )
        return noise_interval(first, again, 0.95) if again.size else None

    def error(self, share: float) -> float:
        """RMS torque error [N m] that this share of the draws does not exceed; inf where a walk diverged."""
        return self._not_exceeded("torque_error", share)

    def lagged_error(self, share: float) -> float:
        """The same of the error that the lag leaves."""
        return self._not_exceeded("lagged_error", share)

    def _not_exceeded(self, measure: str, share: float) -> float:
        values = [float("inf") if item is None else item[measure] for item in self.drawn]
        return float(np.quantile(values, share, method="higher"))

    @property
    def clear(self) -> float:
        """Share of the draws in which the toes cleared the ground on every stride."""
        return float(np.mean([item is not None and item["toes_clear"] == 1.0 for item in self.drawn]))

    @property
    def safe_states(self) -> int:
        """Number of draws on which the controller vented for good, with sensors that work."""
        return sum(1 for item in self.drawn if item is not None and item["safe_state"] > 0.0)

    @property
    def failed(self) -> int:
        """Number of draws on which the walk diverged."""
        return sum(1 for item in self.drawn if item is None)


@dataclass(frozen=True, slots=True)
class WalkingStanding:
    """One entrant: its walk, the measures of it, how it stands on the draws (None without draws), and the command."""

    entrant: WalkingEntrant
    configuration: Configuration
    measures: Mapping[str, float]
    robustness: WalkingRobustness | None
    command: str


@dataclass(frozen=True, slots=True)
class WalkingBounded:
    """The lower bound of a valve, and what the engine makes of the strides of its curve, the least error first."""

    bound: WalkingBound
    played: tuple[PlayedStride, ...]


@dataclass(frozen=True, slots=True)
class WalkingLeague:
    """All standings in order of torque error; ``bounds`` by valve, or why there are none in ``without_bound``.

    ``absent`` says by name why an entrant could not walk.
    """

    task: WalkingTask
    standings: tuple[WalkingStanding, ...]
    absent: Mapping[str, str]
    draws: int
    bounds: Mapping[str, WalkingBounded]
    without_bound: str

    def error_above_least(self, standing: WalkingStanding) -> float | None:
        """RMS torque error [N m] above the least that its valve can have with clear toes; None without a bound."""
        bounded = self.bounds.get(standing.entrant.valve)
        return (
            None
            if bounded is None
            else max(0.0, standing.measures["torque_error"] - bounded.bound.least_error.rms_error)
        )

    def least_gas(self, standing: WalkingStanding) -> float | None:
        """Least gas [kg] in a stride of its valve with a torque as late, an error at the lag and toes as good."""
        bounded = self.bounds.get(standing.entrant.valve)
        own = None if bounded is None else bounded.bound.own.get(standing.entrant.name)
        return None if own is None else own.gas

    def gas_above_least(self, standing: WalkingStanding) -> float | None:
        """Gas [kg] in a stride above that; None without a bound."""
        least = self.least_gas(standing)
        return None if least is None else standing.measures["gas"] - least
