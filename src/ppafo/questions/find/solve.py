"""The lowest or highest value of a number that meets a condition on a metric: a grid, then ever smaller brackets."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ppafo.answers import Solved
from ppafo.errors import ScenarioError, StudyError, UnitError, one_line
from ppafo.loading import scenario_or_load
from ppafo.progress import Report
from ppafo.simulation.scenario import Scenario
from ppafo.studies.configurations import with_overrides
from ppafo.studies.draws import Uncertainty
from ppafo.studies.noise import NOISE, with_noise
from ppafo.studies.outcomes import Outcomes, Tally, atmosphere_of, check_metrics, level_of, scenario_model
from ppafo.studies.varying import VariedPath, varied_path
from ppafo.units import split_quantity

Floats = NDArray[np.float64]

DEFAULT_GRID, FEWEST, MOST = 64, 3, 100_000
PARTS = 32
"""Parts into which a bracket is divided: that many runs side by side take little longer than one."""
STREAMS = 16
"""Noise streams over which every value is tried where sensors are noisy, the same for all."""
ACCURACY = 1.0e-6
"""Width of the last bracket, as a fraction of the range."""

_SEED = 1
_RANGE = re.compile(r"\s*([^=\s]+)\s*=\s*(.+?)\s*\.\.\s*(.+?)\s*")
_CONDITION = re.compile(r"\s*(\w+)\s*(<=|>=)\s*(.+?)\s*")


@dataclass(frozen=True, slots=True)
class Condition:
    """A metric that must be at most (or else at least) a limit [SI]; ``text`` is how it was written."""

    metric: str
    is_upper_limit: bool
    limit: float
    text: str

    def is_met(self, values: Floats) -> NDArray[np.bool_]:
        """Return where values of the metric [SI] meet it; a run without a value does not."""
        return values <= self.limit if self.is_upper_limit else values >= self.limit


@dataclass(frozen=True, slots=True)
class Found(Solved):
    """The value that was looked for, None where no value of the grid meets the condition.

    ``value`` meets the condition and ``beyond`` does not, the next one that was tried; None where the range ends there.
    ``values`` and ``metrics`` [SI] (runs,) are all that were tried, in ascending order, nan where a run failed;
    ``grid`` (runs,) is true for those of the first grid. ``changes`` counts how often neighbours among them differ in
    meeting the condition: more than once says that the condition is met in several stretches. Where sensors are noisy
    metrics are means over ``streams`` streams of noise, and ``spread`` (runs,) is the standard deviation from one to
    another; else there are no streams and no spread.
    """

    scenario: Scenario
    path: VariedPath
    condition: Condition
    is_highest: bool
    value: float | None
    beyond: float | None
    values: Floats
    metrics: Floats
    grid: NDArray[np.bool_]
    failures: int
    reason: str
    streams: int
    spread: Floats

    @property
    def is_met(self) -> NDArray[np.bool_]:
        """Where the condition is met, of the values that were tried."""
        return self.condition.is_met(self.metrics)

    @property
    def changes(self) -> int:
        """How often the condition begins or ceases to be met along the values that were tried."""
        return int(np.count_nonzero(np.diff(self.is_met)))

    def metric_at(self, value: float) -> float:
        """Return the metric [SI] at a value that was tried."""
        return float(self.metrics[np.searchsorted(self.values, value)])

    def spread_at(self, value: float) -> float:
        """Return the standard deviation of the metric [SI] from one stream of noise to another, at a value tried."""
        return float(self.spread[np.searchsorted(self.values, value)])


def find(
    scenario: Scenario | str | Path,
    vary: str,
    such_that: str,
    highest: bool = False,
    grid: int = DEFAULT_GRID,
    overrides: Sequence[str] = (),
    threads: int | None = None,
    progress: Report | None = None,
) -> Found:
    """Return the lowest value (or the ``highest``) [SI] of a number of a scenario that meets a condition on a metric.

    ``vary`` is the number with its range, ``"supply.pressure=20..90 psi_g"``; ``such_that`` the condition,
    ``"final_error <= 0.3 N m"``. A grid of values over the range is run side by side; between the last one that does
    not meet the condition and the first one that does, the bracket is divided again and again down to 1e-6 of the
    range. What happens between two values of the grid on one side of the condition is not seen. StudyError or
    ScenarioError for bad input, and where every run fails.
    """
    base = scenario_or_load(scenario)
    base = with_overrides(base, overrides)
    path, low, high = _range(vary, base)
    condition = _condition(such_that, base, path.path)
    if not FEWEST <= grid <= MOST:
        raise StudyError(f"grid = {grid}: must be at least {FEWEST} and at most {MOST:,}")
    noise = Uncertainty(with_noise((), None, [base], [path.path])[0])
    seeds = noise.random_columns(0, STREAMS, _SEED)[NOISE] if noise.has_noise else np.zeros(0)
    tally = Tally(grid * max(1, seeds.size), progress)
    search = _Search(path.path, condition, scenario_model(base, [condition.metric], threads, tally.add), seeds)
    search.run(np.linspace(low, high, grid))
    if not np.isfinite(search.metrics).any():
        raise StudyError(
            f"scenario '{base.name}': no run from {path.quote(low)} to {path.quote(high)} has a "
            f"'{condition.metric}'{search.reason and '; the first: '}{search.reason}"
        )
    value, beyond = search.ends(highest)
    while value is not None and beyond is not None and abs(value - beyond) > ACCURACY * (high - low):
        inside = np.linspace(value, beyond, PARTS + 1)[1:-1]
        search.run(inside)
        value, beyond = search.ends(highest)
    order = np.argsort(search.values)
    return Found(
        base,
        path,
        condition,
        highest,
        value,
        beyond,
        search.values[order],
        search.metrics[order],
        order < grid,
        search.failures,
        search.reason,
        seeds.size,
        search.spread[order],
    )


class _Search:
    """What was tried so far."""

    def __init__(
        self, path: str, condition: Condition, model: Callable[[dict[str, Floats]], Outcomes], seeds: Floats
    ) -> None:
        self._path, self._condition, self._model, self._seeds = path, condition, model, seeds
        self.values: Floats = np.empty(0)
        self.metrics: Floats = np.empty(0)
        self.spread: Floats = np.empty(0)
        self.failures, self.reason = 0, ""

    def run(self, values: Floats) -> None:
        """Try values, each over all streams of noise."""
        streams = max(1, self._seeds.size)
        columns = {self._path: np.tile(values, streams)}
        if self._seeds.size:
            columns[NOISE] = np.repeat(self._seeds, values.size)
        outcomes = self._model(columns)
        found = outcomes.metrics[self._condition.metric].reshape(streams, values.size)
        self.values = np.concatenate([self.values, values])
        self.metrics = np.concatenate([self.metrics, found.mean(axis=0)])
        self.spread = np.concatenate([self.spread, found.std(axis=0, ddof=min(1, streams - 1))])
        self.failures += outcomes.failures
        self.reason = self.reason or outcomes.reason

    def ends(self, highest: bool) -> tuple[float | None, float | None]:
        """Return the outermost value that meets the condition, and its neighbour on the outer side."""
        order = np.argsort(-self.values if highest else self.values)
        met = np.flatnonzero(self._condition.is_met(self.metrics[order]))
        if met.size == 0:
            return None, None
        values = self.values[order]
        return float(values[met[0]]), float(values[met[0] - 1]) if met[0] else None


def _range(text: str, base: Scenario) -> tuple[VariedPath, float, float]:
    parts = _RANGE.fullmatch(text)
    if parts is None:
        raise StudyError(
            f"'{one_line(text)}' is not of the form PATH=LOW..HIGH, for example 'supply.pressure=20..90 psi_g'"
        )
    try:
        path = varied_path(parts[1], base)
        unit = split_quantity(parts[3])[1]
        lower = parts[2] if split_quantity(parts[2])[1] else f"{parts[2]} {unit}".rstrip()
        low, high = path.level(lower), path.level(parts[3])
    except (ScenarioError, UnitError) as error:
        raise StudyError(f"'{one_line(text)}': {error}") from error
    if not low < high:
        raise StudyError(f"'{one_line(text)}': the low end must be below the high end")
    return path, low, high


def _condition(text: str, base: Scenario, varied: str) -> Condition:
    parts = _CONDITION.fullmatch(text)
    if parts is None:
        raise StudyError(
            f"'{one_line(text)}' is not of the form METRIC <= LIMIT or METRIC >= LIMIT, "
            "for example 'final_error <= 0.3 N m'"
        )
    check_metrics([parts[1]], base)
    return Condition(
        parts[1],
        parts[2] == "<=",
        level_of(parts[3], parts[1], f"'{one_line(text)}'", atmosphere_of(base, [varied])),
        f"{parts[1]} {parts[2]} {parts[3]}",
    )
