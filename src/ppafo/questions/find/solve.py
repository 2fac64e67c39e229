"""The lowest or highest value that meets a condition on a metric: a grid, then ever smaller brackets; the answer."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import (
    axis_unit,
    change_text,
    display_value,
    display_values,
    metric_quantity,
    metric_title,
    quantity_of_unit,
    quantity_text,
)
from ppafo.answers.setting_names import label_of
from ppafo.answers.style import (
    BLACK,
    BLUE,
    GREEN,
    VERMILION,
    Margins,
    figure_of_panels,
    house_style,
    label_lines,
    mark_kind,
)
from ppafo.errors import ScenarioError, StudyError, UnitError, one_line, refused_as
from ppafo.loading import scenario_or_load
from ppafo.progress import Report
from ppafo.questions.question import Solved
from ppafo.simulation.scenario import Scenario, plain
from ppafo.studies.draws import (
    Outcomes,
    Tally,
    Uncertainty,
    atmosphere_of,
    check_metrics,
    level_of,
    scenario_model,
    settled,
    with_companions,
)
from ppafo.studies.sampling import NOISE, with_noise
from ppafo.studies.study import with_overrides
from ppafo.studies.varying import VariedPath, varied_path
from ppafo.units import split_quantity

if TYPE_CHECKING:
    import matplotlib.figure

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


@dataclass(frozen=True, slots=True, repr=False)
class Found(Solved):
    """The value that was looked for, None where no value of the grid meets the condition.

    ``value`` meets the condition and ``beyond`` does not, the next one that was tried; None where the range ends there.
    ``values`` and ``metrics`` [SI] (runs,) are all that were tried, in ascending order, nan where a run failed;
    ``grid`` (runs,) is true for those of the first grid. ``changes`` counts how often neighbours among them differ in
    meeting the condition: more than once says that the condition is met in several stretches. Where sensors are noisy
    metrics are means over ``streams`` streams of noise, and ``spread`` (runs,) is the standard deviation from one to
    another; else there are no streams and no spread. ``unsettled`` counts the runs whose loop oscillates at the instant
    of the metric, so that their RMS error on the hold was taken in its place.
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
    unsettled: int = 0

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
    parts = _CONDITION.fullmatch(such_that)
    if parts is None:
        raise StudyError(
            f"'{one_line(such_that)}' is not of the form METRIC <= LIMIT or METRIC >= LIMIT, "
            "for example 'final_error <= 0.3 N m'"
        )
    check_metrics([parts[1]], base)
    condition = Condition(
        parts[1],
        parts[2] == "<=",
        level_of(parts[3], parts[1], f"'{one_line(such_that)}'", atmosphere_of(base, [path.path])),
        f"{parts[1]} {parts[2]} {parts[3]}",
    )
    if not FEWEST <= grid <= MOST:
        raise StudyError(f"grid = {grid}: must be at least {FEWEST} and at most {MOST:,}")
    noise = Uncertainty(with_noise((), None, [base], [path.path])[0])
    seeds = noise.random_columns(0, STREAMS, _SEED)[NOISE] if noise.has_noise else np.zeros(0)
    tally = Tally(grid * max(1, seeds.size), progress)
    metrics = with_companions([condition.metric], base)
    search = _Search(path.path, condition, scenario_model(base, metrics, threads, tally.add), seeds)
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
        search.unsettled,
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
        self.failures, self.unsettled, self.reason = 0, 0, ""

    def run(self, values: Floats) -> None:
        """Try values, each over all streams of noise."""
        streams = max(1, self._seeds.size)
        columns = {self._path: np.tile(values, streams)}
        if self._seeds.size:
            columns[NOISE] = np.repeat(self._seeds, values.size)
        outcomes = self._model(columns)
        judged = settled(outcomes, [self._condition.metric]).metrics[self._condition.metric]
        self.unsettled += int(np.count_nonzero(judged > outcomes.metrics[self._condition.metric]))
        found = judged.reshape(streams, values.size)
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
    with refused_as(StudyError, f"'{one_line(text)}'", ScenarioError, UnitError):
        path = varied_path(parts[1], base)
        unit = split_quantity(parts[3])[1]
        lower = parts[2] if split_quantity(parts[2])[1] else f"{parts[2]} {unit}".rstrip()
        low, high = path.level(lower), path.level(parts[3])
    if not low < high:
        raise StudyError(f"'{one_line(text)}': the low end must be below the high end")
    return path, low, high


_SIZE = (7.0, 3.8)
_MARGINS = Margins(left=0.85, right=0.25, top=0.6, bottom=0.55, row_gap=0.0)
_CAPTION = "The metric over the value; dashed: the limit; shaded: where the condition is met."


def answer_of(found: Found) -> Answer:
    """Return the answer of a search; it has passed where a value was found."""
    drawn = Figure("find", _CAPTION, lambda: find_figure(found))
    rows = tuple((_text(found, low), _text(found, high)) for low, high in stretches(found))
    table = Table((Column("from"), Column("to")), rows)
    title = f"The {_side(found)} {found.path.path} such that {found.condition.text}"
    return Answer(
        name="find",
        kicker="Search",
        title=title,
        lead=(verdict(found), *remarks(found)),
        sections=(
            Section("Met in the range that was tried", table=table),
            Section("Metric over the value", figure=drawn),
        ),
        data=_data(found),
        passed=found.value is not None,
    )


def verdict(found: Found) -> str:
    """Return the result in a sentence, with how accurate it is."""
    path, condition = found.path.path, found.condition.text
    if found.value is None:
        row = int((np.nanargmin if found.condition.is_upper_limit else np.nanargmax)(found.metrics))
        nearest = f"{_metric(found, found.metrics[row])} at {_text(found, found.values[row])}"
        return f"no {path} from {_ends(found)} meets {condition}; the nearest is {nearest}"
    further = "higher" if found.is_highest else "lower"
    value = f"{path} = {_text(found, found.value)} is the {_side(found)} value that meets {condition}"
    there = f"{found.condition.metric} is {_metric(found, found.metric_at(found.value))} there"
    if found.beyond is None:
        return f"{value}, and the end of the range: {there}; a wider range may have a {further} one"
    return f"{value}: {there}; the next {further} one that was tried, by {_width(found)}, does not"


def remarks(found: Found) -> list[str]:
    """Return how sure the result is: what was tried, where the condition changes again, which runs failed."""
    tried = (
        f"{np.count_nonzero(found.grid)} values from {_ends(found)}, evenly, then {np.count_nonzero(~found.grid)} more"
    )
    said = [f"{tried} in the bracket; the condition is met {_where(found)}"]
    if found.changes > 1:
        said.append(
            f"the condition changes {found.changes} times over the range, so it is not met everywhere "
            f"{'below' if found.is_highest else 'above'} this value; see the table and the figure"
        )
    if found.streams:
        said.append(_noise(found))
    if found.unsettled:
        said.append(
            f"in {found.unsettled} runs the loop oscillates on the hold, and {found.condition.metric} is one instant "
            "of that: their rms_error_hold was taken in its place"
        )
    if found.failures:
        runs = found.values.size * max(1, found.streams)
        said.append(f"{found.failures} of {runs} runs failed and count as not met; the first: {found.reason}")
    return said


def _noise(found: Found) -> str:
    said = f"sensors are noisy: the metric is the mean over {found.streams} noise streams, the same for all values"
    if found.value is None:
        return said
    change = change_text(found.spread_at(found.value), metric_quantity(found.condition.metric))
    return (
        f"{said}; at the value that was found it varies by {change} (standard deviation) from stream to stream, so a "
        "single run may miss the condition there"
    )


def stretches(found: Found) -> list[tuple[float, float]]:
    """Return the first and last value [SI] of each stretch of neighbours that meet the condition."""
    padded = np.concatenate([[False], found.is_met, [False]]).astype(int)
    first, after = np.flatnonzero(np.diff(padded) > 0), np.flatnonzero(np.diff(padded) < 0)
    return [(float(found.values[low]), float(found.values[high - 1])) for low, high in zip(first, after, strict=True)]


def find_figure(found: Found) -> "matplotlib.figure.Figure":
    """Return the metric over the value, with the limit and the value that was found."""
    quantity, metric = quantity_of_unit(found.path.quantity.unit), metric_quantity(found.condition.metric)
    name, unit = label_of(found.path.path), axis_unit(quantity) if quantity else found.path.quantity.unit
    with house_style():
        figure, ((axes,),) = figure_of_panels(_SIZE, _MARGINS, 1)
        values = display_values(found.values, quantity)
        axes.plot(values, display_values(found.metrics, metric), color=BLUE)
        axes.plot(values[found.grid], display_values(found.metrics[found.grid], metric), "o", color=BLUE, markersize=3)
        limit = display_value(found.condition.limit, metric)
        axes.axhline(limit, color=BLACK, linestyle="--", linewidth=1.0, label="limit")
        for number, (low, high) in enumerate(stretches(found)):
            label = "" if number else "condition met"
            ends = display_value(low, quantity), display_value(high, quantity)
            axes.axvspan(*ends, color=GREEN, alpha=0.12, linewidth=0, label=label)
        if found.value is not None:
            value = display_value(found.value, quantity)
            axes.axvline(value, color=VERMILION, linewidth=1.4, label=f"found: {value:.4g} {unit}".rstrip())
        axes.set_xlabel(name if unit in ("", "1") else f"{name} ({unit})")
        label_lines(axes)
        axes.set_ylabel(metric_title(found.condition.metric))
        mark_kind(figure, "simulated")
        return figure


def _data(found: Found) -> dict[str, Any]:
    return {
        "scenario": found.scenario.name,
        "path": found.path.path,
        "unit": found.path.quantity.unit,
        "condition": found.condition.text,
        "metric": found.condition.metric,
        "limit": found.condition.limit,
        "wanted": _side(found),
        "value": found.value,
        "metric_at_value": None if found.value is None else found.metric_at(found.value),
        "not_met_at": found.beyond,
        "changes": found.changes,
        "met": [list(ends) for ends in stretches(found)],
        "remarks": remarks(found),
        "noise_streams": found.streams,
        "runs": found.values.size * max(1, found.streams),
        "failed": found.failures,
        "unsettled": found.unsettled,
        "tried": [
            {"value": value, "metric": metric, "is_of_grid": bool(on_grid)}
            for value, metric, on_grid in zip(
                found.values.tolist(), plain(found.metrics.tolist()), found.grid.tolist(), strict=True
            )
        ],
    }


def _side(found: Found) -> str:
    return "highest" if found.is_highest else "lowest"


def _where(found: Found) -> str:
    if found.is_met.all():
        return "everywhere"
    return "nowhere" if found.value is None else f"at {np.count_nonzero(found.is_met)} of them"


def _ends(found: Found) -> str:
    return f"{_text(found, found.values[0])} to {_text(found, found.values[-1])}"


def _text(found: Found, value: float) -> str:
    quantity = quantity_of_unit(found.path.quantity.unit)
    return quantity_text(value, quantity, ".6g") if quantity else f"{value:.6g} {found.path.quantity.unit}".rstrip()


def _width(found: Found) -> str:
    """Return how accurate the value is: the width of the bracket."""
    width = abs((found.value or 0.0) - (found.beyond or 0.0))
    quantity = quantity_of_unit(found.path.quantity.unit)
    return change_text(width, quantity, ".1g") if quantity else f"{width:.1g} {found.path.quantity.unit}".rstrip()


def _metric(found: Found, value: float) -> str:
    return quantity_text(float(value), metric_quantity(found.condition.metric), ".4g")
