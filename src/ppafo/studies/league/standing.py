"""What the league says of one entrant, and of all of them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.simulation.result import Result
from ppafo.studies.league.entrants import Entrant
from ppafo.studies.league.learning import Learning
from ppafo.studies.league.lower_bound import LowerBound, Played
from ppafo.studies.uncertainty.intervals import Interval, noise_interval


@dataclass(frozen=True, slots=True)
class Robustness:
    """RMS errors [N m] and gas [kg] on the drawn devices, each (draws,); inf where a run diverged.

    ``renoised`` are the errors on the first of them with other noise; None where the controller hears none.
    """

    errors: Floats
    gas: Floats
    renoised: Floats | None = None

    @property
    def noise(self) -> Interval | None:
        """Share of the variance of the errors over the draws that noise makes, with its 95 % interval."""
        again = self.renoised
        return None if again is None else noise_interval(self.errors[: again.size], again, 0.95)

    def error(self, share: float) -> float:
        """RMS error [N m] that this share of the draws does not exceed."""
        return float(np.quantile(self.errors, share, method="higher"))

    @property
    def failed(self) -> int:
        """Number of draws on which the run diverged."""
        return int(np.count_nonzero(np.isinf(self.errors)))


@dataclass(frozen=True, slots=True)
class Standing:
    """One entrant: its run, how it stands on drawn devices (None without draws), and what it learnt, if it learns."""

    entrant: Entrant
    result: Result
    command: str
    robustness: Robustness | None
    learning: Learning | None

    def value(self, metric: str) -> float | None:
        """A metric of the run in SI units, None where the task has none of that name."""
        found = self.result.metrics.get(metric)
        return None if found is None else found.value


@dataclass(frozen=True, slots=True)
class Bounded:
    """The lower bound of a valve, and what the engine makes of its commands; none where no valve can play them."""

    bound: LowerBound
    played: tuple[Played, ...]


@dataclass(frozen=True, slots=True)
class League:
    """All standings in order of RMS error; ``bounds`` by valve, or why there are none in ``without_bound``.

    ``absent`` says by name why an entrant could not play this scenario.
    """

    scenario: str
    overrides: tuple[str, ...]
    standings: tuple[Standing, ...]
    absent: Mapping[str, str]
    draws: int
    bounds: Mapping[str, Bounded]
    without_bound: str

    def error_above_least(self, standing: Standing) -> float | None:
        """RMS error [N m] above the least that is possible with the entrant's valve; None without a bound."""
        error, bounded = standing.value("rms_error"), self.bounds.get(standing.entrant.valve)
        return None if bounded is None or error is None else max(0.0, error - bounded.bound.least_error.rms_error)

    def gas_above_least(self, standing: Standing) -> float | None:
        """Gas [kg] above the least with which the entrant's error is possible on its valve; None without a bound."""
        error, gas = standing.value("rms_error"), standing.value("gas_supplied")
        bounded = self.bounds.get(standing.entrant.valve)
        return None if bounded is None or error is None or gas is None else gas - bounded.bound.gas_at(error)
