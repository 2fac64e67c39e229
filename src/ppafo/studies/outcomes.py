"""Runs of one scenario with many values: metrics, which runs failed and why."""

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import ScenarioError, StudyError, UnitError, first_twice, nearest_name
from ppafo.metrics import METRICS
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.progress import Progress, Report
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.ensemble.running import lacking
from ppafo.simulation.scenario import Scenario
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import MAXIMUM_DRAWS
from ppafo.units import parse_quantity

_LEVELS = {"Pa": "Pa_a", "-": ""}
_DIFFERENCES = {"Pa": "Pa_d", "-": ""}
_RUNS_AT_ONCE = 16_384
"""Between two pieces of this size progress is reported and an interruption is heard."""
_SLOW_RUNS_AT_ONCE = 32
"""The same where a Python object controls: about a second."""


@dataclass(frozen=True, slots=True)
class Outcomes:
    """Metrics by name, values (runs,) in SI units, nan where a run failed or has no such metric.

    ``failed`` (runs,) is true where a run diverged or was refused; ``reason`` states why the first of them did.
    """

    metrics: Mapping[str, Floats]
    failed: NDArray[np.bool_]
    reason: str

    @property
    def runs(self) -> int:
        """Number of all runs."""
        return int(self.failed.size)

    @property
    def failures(self) -> int:
        """Number of runs that failed."""
        return int(np.count_nonzero(self.failed))


Model = Callable[[Mapping[str, Floats]], Outcomes]
"""Columns of values [SI] (runs,) by path in, outcomes out; what every analysis here is done on."""


def scenario_model(
    scenario: Scenario,
    metrics: Sequence[str],
    threads: int | None = None,
    on_piece: Callable[[int, int], None] | None = None,
    gauge: Collection[str] = (),
) -> Model:
    """Return the model that runs a scenario on the lanes; ``on_piece(runs, failed)`` is called after every piece.

    Columns of the paths in ``gauge`` count from the atmosphere of their run.
    StudyError for a metric that does not exist or that the scenario cannot have.
    """
    check_metrics(metrics, scenario)

    at_once = _RUNS_AT_ONCE if scenario.control.custom is None else _SLOW_RUNS_AT_ONCE

    def outcomes(columns: Mapping[str, Floats]) -> Outcomes:
        runs = len(next(iter(columns.values())))
        pieces = []
        for first in range(0, runs, at_once):
            part = {path: values[first : first + at_once] for path, values in columns.items()}
            pieces.append(_piece(scenario, part, metrics, threads, gauge))
            if on_piece is not None:
                on_piece(pieces[-1].runs, pieces[-1].failures)
        return join(pieces)

    return outcomes


def check_metrics(metrics: Sequence[str], scenario: Scenario) -> None:
    """Refuse a metric that does not exist, or that needs what the scenario has not."""
    for name in metrics:
        if name not in METRICS:
            hint = nearest_name(name, METRICS)
            raise StudyError(f"there is no metric '{name}'{hint}; available: {', '.join(METRICS)}")
        reason = lacking(scenario, METRICS[name])
        if reason:
            raise StudyError(f"scenario '{scenario.name}' has no '{name}': {reason}")
    repeated = first_twice(metrics)
    if repeated is not None:
        raise StudyError(f"the metric '{repeated}' is named twice")


def join(pieces: Sequence[Outcomes]) -> Outcomes:
    """Return outcomes one after the other."""
    names = pieces[0].metrics
    return Outcomes(
        {name: np.concatenate([piece.metrics[name] for piece in pieces]) for name in names},
        np.concatenate([piece.failed for piece in pieces]),
        next((piece.reason for piece in pieces if piece.reason), ""),
    )


def check_failures(outcomes: Outcomes, maximum_failed: float, what: str) -> None:
    """Refuse to continue where more than a fraction of the runs failed; ``what`` names them in the message."""
    fraction = outcomes.failures / outcomes.runs
    if fraction > maximum_failed:
        raise StudyError(
            f"{what}: {outcomes.failures:,} of {outcomes.runs:,} runs failed ({100.0 * fraction:.3g} %), more than the "
            f"{100.0 * maximum_failed:.3g} % allowed; the first: {outcomes.reason}"
        )


def check_fraction(value: float, name: str) -> float:
    """Return a number from 0 to below 1; StudyError for any other."""
    if not 0.0 <= value < 1.0:
        raise StudyError(f"{name} = {value!r}: must be at least 0 and less than 1")
    return value


def check_confidence(value: float) -> float:
    """Return a confidence from 0.5 to below 1; StudyError for any other."""
    if not 0.5 <= value < 1.0:
        raise StudyError(f"confidence = {value!r}: must be at least 0.5 and less than 1")
    return value


def check_draws(draws: int, fewest: int) -> int:
    """Return a number of draws that can be made; StudyError for any other."""
    if not fewest <= draws <= MAXIMUM_DRAWS:
        raise StudyError(f"draws = {draws!r}: must be at least {fewest} and at most {MAXIMUM_DRAWS:,}")
    return draws


@final
class Tally:
    """Counts runs for whoever watches: ``runs`` is how many there will be, doubled where there are more after all."""

    def __init__(self, runs: int, progress: Report | None) -> None:
        self._runs, self._report, self._started = max(1, runs), progress, 0.0
        self.done = self.failed = self._first = 0

    def add(self, runs: int, failed: int) -> None:
        """Count runs that are done; the rate leaves out the first ones, before which models may be compiled."""
        if self.done == 0:
            self._first, self._started = runs, time.monotonic()
        self.done += runs
        self.failed += failed
        while self._runs < self.done:
            self._runs *= 2
        if self._report is not None:
            elapsed = time.monotonic() - self._started
            self._report(Progress("", self.done, self._runs, self.failed, self._first, elapsed))


def _piece(
    scenario: Scenario,
    columns: Mapping[str, Floats],
    metrics: Sequence[str],
    threads: int | None,
    gauge: Collection[str],
) -> Outcomes:
    try:
        result = run_ensemble(scenario, columns, metrics, threads=threads, gauge=gauge)
    except ScenarioError as error:
        raise StudyError(f"scenario '{scenario.name}': {error}") from error
    runs = result.status.size
    values = {name: result.metrics.get(name, np.full(runs, np.nan)) for name in metrics}
    reason = result.reasons[min(result.reasons)] if result.reasons else ""
    return Outcomes(values, result.status != 0, reason)


def atmosphere_of(scenario: Scenario, varied: Collection[str]) -> float | None:
    """Return the pressure [Pa absolute] from which gauge pressures of a scenario count; None where it is varied."""
    return None if ATMOSPHERE_PATH in varied else scenario.device.supply.atmospheric_pressure


def level_of(text: str, metric: str, what: str, atmosphere: float | None) -> float:
    """Return a value of a metric in SI; gauge pressure counts from ``atmosphere`` [Pa absolute].

    StudyError, whose message ``what`` begins, where the unit does not fit, and for a gauge pressure where the runs have
    no one atmosphere, which is None then.
    """
    atmospheres = (0.0, STANDARD_ATMOSPHERE) if atmosphere is None else (atmosphere,)
    found = common_level(text, METRICS[metric].unit, what, atmospheres)
    if found is None:
        raise StudyError(
            f"{what}: a gauge pressure counts from {ATMOSPHERE_PATH}, which varies here; give an absolute pressure, "
            "for example '446 kPa_a'"
        )
    return found


def common_level(text: str, unit: str, what: str, atmospheres: Collection[float]) -> float | None:
    """Return a level in a unit of metrics; None for a gauge pressure under several atmospheres [Pa absolute].

    StudyError, whose message ``what`` begins, where the unit does not fit.
    """
    found = {_number(text, _LEVELS.get(unit, unit), what, atmosphere) for atmosphere in atmospheres}
    return found.pop() if len(found) == 1 else None


def difference_of(text: str, metric: str, what: str) -> float:
    """Return a difference of two values of a metric in SI; StudyError as in ``level_of``."""
    unit = METRICS[metric].unit
    return _number(text, _DIFFERENCES.get(unit, unit), what, 0.0)


def _number(text: str, unit: str, what: str, atmosphere: float) -> float:
    try:
        return parse_quantity(text, unit, atmosphere)
    except UnitError as error:
        raise StudyError(f"{what}: {error}") from error
