"""The lowest or highest value that meets a condition on a metric: a grid, then ever smaller brackets."""

import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import ScenarioError, StudyError, UnitError, at_fault, refused_as
from ppafo.progress import Report
from ppafo.simulation.scenario import Scenario
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import MetricLimit, atmosphere_of, check_metrics, level_of, seeds_of_noise
from ppafo.studies.sampling import NOISE
from ppafo.studies.varying import VariedPath, given_in, varied_path
from ppafo.study.runs import RunCounter, Runs, oscillating, settled, tracking_violation, with_companions
from ppafo.units import split_quantity
from ppafo.wording import one_line

FEWEST, MOST = 3, 100_000
"""Values that may be tried first, from both ends with one between."""
_PARTS = 32
"""Parts into which a bracket is divided: that many runs side by side take little longer than one."""
_STREAMS = 16
"""Noise streams over which every value is tried where sensors are noisy, the same for all."""
ACCURACY = 1.0e-6
"""Width of the last bracket, as a fraction of the range."""
_SEED = 1
"""Seed of these streams."""
_RANGE = re.compile(r"\s*([^=\s]+)\s*=\s*(.+?)\s*\.\.\s*(.+?)\s*")
_CONDITION = re.compile(r"\s*(\w+)\s*(<=|>=)\s*(.+?)\s*")


class FindProgress:
    """Values tried so far; of each the metric, its judged value, and its standard deviation over the noise."""

    def __init__(self, base: Scenario, path: str, condition: MetricLimit, runs: Runs, seeds: Floats) -> None:
        self._base, self._path, self.condition, self.runs, self.seeds = base, path, condition, runs, seeds
        self.values: Floats = np.empty(0)
        self.metrics: Floats = np.empty(0)
        self.judged: Floats = np.empty(0)
        self.spread: Floats = np.empty(0)
        self.follows: NDArray[np.bool_] = np.empty(0, dtype=np.bool_)
        self.unsettled = 0
        self.oscillating = 0

    def run(self, values: Floats) -> None:
        """Try values, each over all streams of noise."""
        streams = max(1, self.seeds.size)
        columns = {self._path: np.tile(values, streams)}
        if self.seeds.size:
            columns[NOISE] = np.repeat(self.seeds, values.size)
        rows = self.runs.run(columns)
        # One instant of a loop that oscillates may meet the condition by chance.
        judged = settled(rows, self.condition.metric)
        self.unsettled += int(np.count_nonzero(judged > rows[self.condition.metric]))
        # A loop whose command turns all the time meets no condition that anybody would build on.
        turns = oscillating(rows, self._base)
        self.oscillating += int(np.count_nonzero(turns))
        judged = np.where(turns, np.nan, judged)
        by_stream, judged_by_stream = (
            each.reshape(streams, values.size) for each in (rows[self.condition.metric], judged)
        )
        self.values = np.concatenate([self.values, values])
        self.metrics = np.concatenate([self.metrics, by_stream.mean(axis=0)])
        self.judged = np.concatenate([self.judged, judged_by_stream.mean(axis=0)])
        self.spread = np.concatenate([self.spread, by_stream.std(axis=0, ddof=min(1, streams - 1))])
        fails = tracking_violation(rows, self._base, columns) > 0.0
        self.follows = np.concatenate([self.follows, ~fails.reshape(streams, values.size).any(axis=0)])

    @property
    def is_met(self) -> NDArray[np.bool_]:
        """True for each value that meets the condition with a reference that is followed."""
        return np.asarray(self.condition.is_kept(self.judged) & self.follows)

    def ends(self, highest: bool) -> tuple[float | None, float | None]:
        """Return the outermost value that meets the condition, and its neighbour on the outer side."""
        order = np.argsort(-self.values if highest else self.values)
        met = np.flatnonzero(self.is_met[order])
        if met.size == 0:
            return None, None
        values = self.values[order]
        return float(values[met[0]]), float(values[met[0] - 1]) if met[0] else None


class _SearchedRange(NamedTuple):
    """The path that is varied, and the low and the high end [SI] between which it is."""

    path: VariedPath
    low: float
    high: float


def range_of(text: str, base: Scenario) -> _SearchedRange:
    """Return the range of a text ``PATH=LOW..HIGH`` for a scenario; StudyError for any other text."""
    parts = _RANGE.fullmatch(text)
    if parts is None:
        raise StudyError(
            f"'{one_line(text)}' is not of the form PATH=LOW..HIGH, for example 'supply.pressure=20..90 psi_g'"
        )
    with refused_as(StudyError, f"'{one_line(text)}'", ScenarioError, UnitError):
        path = varied_path(parts[1], base)
        # As in '20..90 psi_g': the low end has the unit of the high one unless it says its own.
        unit = split_quantity(parts[3])[1]
        lower = parts[2] if split_quantity(parts[2])[1] else f"{parts[2]} {unit}".rstrip()
        low, high, path = path.level(lower), path.level(parts[3]), given_in(path, [parts[3]])
    if not low < high:
        raise StudyError(f"'{one_line(text)}': the low end must be below the high end")
    return _SearchedRange(path, low, high)


def condition_of(text: str, base: Scenario, path: str) -> MetricLimit:
    """Return the condition of a text ``METRIC <= LIMIT`` or ``METRIC >= LIMIT``; StudyError for any other text.

    The ambient pressure behind a gauge pressure is the scenario's, unless ``path``, which varies, is that pressure.
    """
    quoted = f"'{one_line(text)}'"
    parts = _CONDITION.fullmatch(text)
    if parts is None:
        raise StudyError(
            f"{quoted} is not of the form METRIC <= LIMIT or METRIC >= LIMIT, for example 'final_error <= 0.3 N m'"
        )
    metric, sign, limit = parts.groups()
    check_metrics([metric], base)
    level = level_of(limit, metric, quoted, atmosphere_of(base, [path]))
    return MetricLimit(metric, level, sign == "<=", f"{metric} {sign} {limit}")


@dataclass(frozen=True, slots=True)
class FindResult:
    """A finished search; numbers in SI.

    ``values`` (values,) ascend, ``metrics`` are the metric at each, nan where the run failed, and ``spread`` its
    standard deviation over ``noise_streams``. ``judged`` is what the condition is asked of: the metric, where the loop
    oscillates on the hold the larger one of it and of the RMS error there, and nan where it turns all the time.
    ``is_met`` is true where the condition is met and the run follows its reference, which ``follows`` holds for
    each value. ``value`` is the outermost that meets the condition, None where none does,
    and ``beyond`` its neighbour on the outer side, None at the end of the range.
    """

    scenario: str
    path: VariedPath
    condition: MetricLimit
    highest: bool
    values: Floats
    metrics: Floats
    judged: Floats
    spread: Floats
    is_of_grid: NDArray[np.bool_]
    is_met: NDArray[np.bool_]
    follows: NDArray[np.bool_]
    value: float | None
    beyond: float | None
    noise_streams: int
    runs: int
    failed: int
    first_failure: str
    unsettled: int
    oscillating: int

    @property
    def changes(self) -> int:
        """Number of times that the condition starts or ceases to be met along the values."""
        return int(np.count_nonzero(np.diff(self.is_met)))

    @property
    def stretches(self) -> list[list[float]]:
        """The first and last value of each stretch of neighbours that meet the condition."""
        # Not met beyond both ends: a stretch that reaches the end of the range ends there.
        padded = np.concatenate([[False], self.is_met, [False]]).astype(int)
        first, after = np.flatnonzero(np.diff(padded) > 0), np.flatnonzero(np.diff(padded) < 0)
        return [[float(self.values[low]), float(self.values[high - 1])] for low, high in zip(first, after, strict=True)]


def outermost(
    base: Scenario,
    vary: str,
    such_that: str,
    highest: bool,
    grid: int,
    threads: int | None = None,
    progress: Report | None = None,
) -> FindResult:
    """Return the search for the outermost value; StudyError for bad input, and where no run has the metric.

    ``vary`` is ``PATH=LOW..HIGH`` and ``such_that`` is ``METRIC <= LIMIT`` or ``METRIC >= LIMIT``; ``grid`` values
    are tried first, the highest that meets the condition is sought, or else the lowest.
    """
    with at_fault("vary"):
        searched = range_of(vary, base)
    with at_fault("such_that"):
        condition = condition_of(such_that, base, searched.path.path)
    if not FEWEST <= grid <= MOST:
        raise StudyError(f"grid = {grid}: must be at least {FEWEST} and at most {MOST:,}")
    # The same streams for all values, so that neighbours differ by the value alone.
    seeds = seeds_of_noise([base], [searched.path.path], 0, _STREAMS, _SEED)
    tally = RunCounter(grid * max(1, seeds.size), progress)
    runs = Runs(base, with_companions([condition.metric], base), tally, (), threads)
    search = FindProgress(base, searched.path.path, condition, runs, seeds)
    search.run(np.linspace(searched.low, searched.high, grid))
    _check_has_metric(search, base, searched)
    # All parts of a bracket side by side: a bisection would wait for every one of its runs.
    value, beyond = search.ends(highest)
    width = ACCURACY * (searched.high - searched.low)
    while value is not None and beyond is not None and abs(value - beyond) > width:
        search.run(np.linspace(value, beyond, _PARTS + 1)[1:-1])
        value, beyond = search.ends(highest)
    order = np.argsort(search.values)
    return FindResult(
        scenario=base.name,
        path=searched.path,
        condition=condition,
        highest=highest,
        values=search.values[order],
        metrics=search.metrics[order],
        judged=search.judged[order],
        spread=search.spread[order],
        is_of_grid=order < grid,
        is_met=search.is_met[order],
        follows=search.follows[order],
        value=value,
        beyond=beyond,
        noise_streams=seeds.size,
        runs=runs.count,
        failed=runs.failures,
        first_failure=runs.reason,
        unsettled=search.unsettled,
        oscillating=search.oscillating,
    )


def _check_has_metric(search: FindProgress, base: Scenario, searched: _SearchedRange) -> None:
    """Refuse a search in which no run has the metric of the condition."""
    if np.isfinite(search.judged).any():
        return
    ends = f"from {searched.path.quote(searched.low)} to {searched.path.quote(searched.high)}"
    if search.oscillating:
        raise StudyError(
            f"scenario '{base.name}': in every run {ends} the loop oscillates: leave its gains out, so that they "
            "follow the device"
        )
    reason = f"; the first: {search.runs.reason}" if search.runs.reason else ""
    raise StudyError(f"scenario '{base.name}': no run {ends} has a '{search.condition.metric}'{reason}")
