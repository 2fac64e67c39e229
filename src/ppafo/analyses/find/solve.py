"""The lowest or highest value that meets a condition on a metric: a grid, then ever smaller brackets."""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import ScenarioError, StudyError, UnitError, one_line, refused_as
from ppafo.report.finding import Column, Finding, Part
from ppafo.report.kind import of_metric, of_path
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, GREEN, VERMILION
from ppafo.simulation.scenario import Scenario
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import Limit
from ppafo.studies.sampling import NOISE
from ppafo.studies.varying import VariedPath, varied_path
from ppafo.study.runs import Runs, oscillating, settled
from ppafo.units import split_quantity

DEFAULT_GRID, FEWEST, MOST = 64, 3, 100_000
PARTS = 32
"""Parts into which a bracket is divided: that many runs side by side take little longer than one."""
STREAMS = 16
"""Noise streams over which every value is tried where sensors are noisy, the same for all."""
ACCURACY = 1.0e-6
"""Width of the last bracket, as a fraction of the range."""
SEED = 1
_RANGE = re.compile(r"\s*([^=\s]+)\s*=\s*(.+?)\s*\.\.\s*(.+?)\s*")
CONDITION = re.compile(r"\s*(\w+)\s*(<=|>=)\s*(.+?)\s*")


@dataclass(frozen=True, slots=True)
class Tried:
    """A value [SI] that was tried, and the metric there [SI], nan where the run failed."""

    value: float
    metric: float
    is_of_grid: bool


@dataclass(frozen=True, slots=True)
class Threshold:
    """The lowest, or highest, value that meets a condition on a metric; numbers in SI.

    ``value`` is None where none does, and ``not_met_at`` the next value on its outer side that was tried and does not,
    None at the end of the range. ``changes`` counts how often the condition begins or ceases to be met along the values
    that were tried, ``met`` are the ends of each stretch where it is. ``unsettled`` counts the runs whose loop
    oscillates at the instant of the metric, so that their RMS error on the hold was taken in its place.
    """

    scenario: str
    path: str
    unit: str
    condition: str
    metric: str
    limit: float
    wanted: str
    value: float | None
    metric_at_value: float | None
    not_met_at: float | None
    changes: int
    met: list[list[float]]
    remarks: list[str]
    noise_streams: int
    runs: int
    failed: int
    unsettled: int
    tried: list[Tried]


class Search:
    """What was tried so far: values, the metric of each and its standard deviation over the noise, in that order."""

    def __init__(self, base: Scenario, path: str, condition: Limit, runs: Runs, seeds: Floats) -> None:
        self._base, self._path, self.condition, self.runs, self.seeds = base, path, condition, runs, seeds
        self.values: Floats = np.empty(0)
        self.metrics: Floats = np.empty(0)
        self.spread: Floats = np.empty(0)
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
        found = judged.reshape(streams, values.size)
        self.values = np.concatenate([self.values, values])
        self.metrics = np.concatenate([self.metrics, found.mean(axis=0)])
        self.spread = np.concatenate([self.spread, found.std(axis=0, ddof=min(1, streams - 1))])

    def ends(self, highest: bool) -> tuple[float | None, float | None]:
        """Return the outermost value that meets the condition, and its neighbour on the outer side."""
        order = np.argsort(-self.values if highest else self.values)
        met = np.flatnonzero(self.condition.is_kept(self.metrics[order]))
        if met.size == 0:
            return None, None
        values = self.values[order]
        return float(values[met[0]]), float(values[met[0] - 1]) if met[0] else None


def range_of(text: str, base: Scenario) -> tuple[VariedPath, float, float]:
    """Return path, low and high end [SI] of a text ``PATH=LOW..HIGH``; StudyError for any other text."""
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
        low, high = path.level(lower), path.level(parts[3])
    if not low < high:
        raise StudyError(f"'{one_line(text)}': the low end must be below the high end")
    return path, low, high


def stretches(values: Floats, is_met: NDArray[np.bool_]) -> list[list[float]]:
    """Return the first and last value [SI] of each stretch of neighbours that meet the condition."""
    # Not met beyond both ends: a stretch that reaches the end of the range ends there.
    padded = np.concatenate([[False], is_met, [False]]).astype(int)
    first, after = np.flatnonzero(np.diff(padded) > 0), np.flatnonzero(np.diff(padded) < 0)
    return [[float(values[low]), float(values[high - 1])] for low, high in zip(first, after, strict=True)]


def finding_of(scenario: str, path: VariedPath, search: Search, highest: bool, grid: int) -> Finding[Threshold]:
    """Return the search in words, a table of where the condition is met, and the metric over the value."""
    condition, order = search.condition, np.argsort(search.values)
    values, metrics, spread, of_grid = search.values[order], search.metrics[order], search.spread[order], order < grid
    value, beyond = search.ends(highest)
    is_met = condition.is_kept(metrics)
    changes = int(np.count_nonzero(np.diff(is_met)))
    kind, of_condition = of_path(path.path, path.quantity.unit), of_metric(condition.metric)
    at_value = None if value is None else float(metrics[np.searchsorted(values, value)])
    ends = f"{kind.text(values[0])} to {kind.text(values[-1])}"
    wanted, further = ("highest", "higher") if highest else ("lowest", "lower")
    # Where none meets it, the one that comes nearest says whether a wider range could.
    if value is None or at_value is None:
        row = int((np.nanargmin if condition.is_most else np.nanargmax)(metrics))
        verdict = (
            f"no {path.path} from {ends} meets {condition.text}; the nearest is {of_condition.text(metrics[row])} at "
            f"{kind.text(values[row])}"
        )
    else:
        verdict = (
            f"{path.path} = {kind.text(value)} is the {wanted} value that meets {condition.text}"
            f"{', and the end of the range' if beyond is None else ''}: {condition.metric} is "
            f"{of_condition.text(at_value)} there"
            + (
                f"; a wider range may have a {further} one"
                if beyond is None
                else f" (bracketed to {kind.change(abs(value - beyond), '.1g')})"
            )
        )
    where = "everywhere" if is_met.all() else "nowhere" if value is None else f"at {np.count_nonzero(is_met)} of them"
    remarks = [
        f"{np.count_nonzero(of_grid)} values from {ends}, evenly, then {np.count_nonzero(~of_grid)} more in the "
        f"bracket; the condition is met {where}"
    ]
    if changes > 1:
        remarks.append(
            f"the condition changes {changes} times over the range, so it is not met everywhere "
            f"{'below' if highest else 'above'} this value; see the table and the figure"
        )
    if search.seeds.size:
        noise = (
            f"sensors are noisy: the metric is the mean over {search.seeds.size} noise streams, the same for all values"
        )
        if value is not None:
            varies = of_condition.change(float(spread[np.searchsorted(values, value)]))
            noise += (
                f"; at the value that was found it varies by {varies} (standard deviation) from stream to stream, so a "
                "single run may miss the condition there"
            )
        remarks.append(noise)
    if search.unsettled:
        remarks.append(
            f"in {search.unsettled} runs the loop oscillates on the hold, and {condition.metric} is one instant of "
            "that: their rms_error_hold was taken in its place"
        )
    if search.oscillating:
        remarks.append(
            f"in {search.oscillating} of {search.runs.count} runs the torque loop oscillates: they count as not met"
        )
    if search.runs.failures:
        remarks.append(
            f"{search.runs.failures} of {search.runs.count} runs failed and count as not met; the first: "
            f"{search.runs.reason}"
        )
    met = stretches(values, is_met)
    panel = Panel(
        kind,
        of_condition,
        (
            Mark("line", values, metrics),
            Mark("line", values[of_grid], metrics[of_grid], style={"linestyle": "", "marker": "o", "markersize": 3}),
            Mark(
                "level", (), condition.limit, label="limit", colour=BLACK, style={"linestyle": "--", "linewidth": 1.0}
            ),
            *(Mark("span", each, label="" if row else "condition met", colour=GREEN) for row, each in enumerate(met)),
            *(
                ()
                if value is None
                else (Mark("at", value, label=f"found: {kind.text(value, '.4g')}", colour=VERMILION),)
            ),
        ),
    )
    return Finding(
        name="find",
        kicker="Search",
        title=f"The {wanted} {path.path} such that {condition.text}",
        said=(verdict, *remarks),
        parts=(
            Part(
                "Met in the range that was tried",
                [Column(title, [kind.text(each[end]) for each in met]) for end, title in enumerate(("from", "to"))],
            ),
            Part(
                "Metric over the value",
                panels=(panel,),
                name="find",
                caption="The metric over the value; dashed: the limit; shaded: where the condition is met.",
            ),
        ),
        found=Threshold(
            scenario=scenario,
            path=path.path,
            unit=path.quantity.unit,
            condition=condition.text,
            metric=condition.metric,
            limit=condition.limit,
            wanted=wanted,
            value=value,
            metric_at_value=at_value,
            not_met_at=beyond,
            changes=changes,
            met=met,
            remarks=remarks,
            noise_streams=search.seeds.size,
            runs=search.runs.count,
            failed=search.runs.failures,
            unsettled=search.unsettled,
            tried=list(map(Tried, values.tolist(), metrics.tolist(), of_grid.tolist())),
        ),
        passed=value is not None,
    )
