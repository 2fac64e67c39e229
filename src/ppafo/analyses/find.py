"""Search for the lowest or highest value that meets a condition on a metric: a grid, then division of the bracket."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.analyses import ask, np
from ppafo.arguments import Count, Overrides, Threads, Word, checked
from ppafo.errors import ParameterError, ScenarioError, StudyError, UnitError, at_fault, refused_as
from ppafo.plugins import Plugins
from ppafo.progress import Report
from ppafo.units import SI
from ppafo.units.shown import shown_in
from ppafo.wording import one_line

if TYPE_CHECKING:
    from ppafo.report.finding import Finding
    from ppafo.simulation.scenario import Scenario

ScenarioLike = Annotated["Scenario | str | Path", Word("SCENARIO", help="name of a scenario, or a .toml file")]
VariedRange = Annotated[str, Word("PATH=LOW..HIGH", option="--vary")]
Condition = Annotated[str, Word("CONDITION", option="--such-that")]
ACCURACY = 1.0e-6
"""Width of the last bracket, as a fraction of the range of values [-]."""
_SETTLED = "RMS error in the second half of the hold"
"""Number that decides in place of the error of one instant, for a loop that swings."""


@dataclass(frozen=True, slots=True)
class Threshold:
    """Lowest or highest value that meets a condition on a metric; numbers in SI.

    - ``said``, ``remarks``: result in a sentence, and remarks on it
    - ``value``: value found; None if no value meets the condition, to which ``nearest`` is then nearest
    - ``not_met_at``: next tried value on the outer side, which does not meet it; None at the end of the range
    - ``changes``: number of changes between met and not met along the tried values
    - ``met``: first and last tried value of each interval in which the condition is met; beside ``value``, of the grid
    - ``unsettled``: number of runs that swing at the instant of the metric, as in ``judged``
    - ``tried``: columns of the tried values, ascending: ``value``, those of ``judged``, and ``is_of_grid``, False for
      values of a bracket
    """

    scenario: str
    path: str
    unit: str
    condition: str
    metric: str
    limit: float
    wanted: str
    said: str
    remarks: list[str]
    value: float | None
    nearest: float | None
    metric_at_value: float | None
    not_met_at: float | None
    changes: int
    met: list[list[float]]
    noise_streams: int
    runs: int
    failed: int
    unsettled: int
    tried: dict[str, list[Any]]


@checked
def find(
    scenario: ScenarioLike,
    *,
    vary: VariedRange,
    such_that: Condition,
    highest: bool = False,
    grid: Count = 64,
    overrides: Overrides = (),
    threads: Threads | None = None,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Threshold]:
    """Find the lowest or highest value that meets a condition on a metric.

    A grid of values over the range is run in parallel. The bracket between the outermost grid value that meets the
    condition and its outer neighbour is then divided repeatedly, down to 1e-6 of the range. A change of the condition
    between two neighbouring grid values that both meet it, or both miss it, is not detected.

    Arguments:
        scenario: name of a scenario, or a .toml file
        vary: a number of the scenario or its device, and its range, for example 'supply.pressure=20..90 psi_g'
        such_that: a metric, <= or >=, and a limit, for example 'final_error <= 0.3 N m', or 'follows': the
            run follows its reference
        highest: find the highest value; default: the lowest
        grid: number of evenly spaced values to try first; default 64
        overrides: values to change, for example 'valve.area=12.6 mm^2'; may be repeated
        threads: number of threads; default: all cores
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is a Threshold: the value, and the metric there

    Raises:
        StudyError: a range or a condition that cannot be used, and a grid of which every run fails
        ScenarioError: a scenario that cannot be used

    >>> import ppafo
    >>> task, metric = "torque-task-proportional", "rms_error <= 0.5 N m"
    >>> print(ppafo.find(task, vary="supply.pressure=20..90 psi_g", such_that=metric).said[0])
    supply.pressure = 54.7758 psi_g is the lowest value that meets rms_error <= 0.5 N m: rms_error is 0.5 N m there
    (bracketed to 3e-05 psi)
    """
    base = ask.with_overrides(ask.scenario_or_load(scenario), overrides)
    # As in 'supply.pressure=2..6 bar_g' and 'final_error <= 30 N cm'.
    ranged = vary.rpartition("..")[2] if vary.strip().startswith(ask.PATHS_THAT_SET_UNITS) else ""
    with shown_in({**base.device.shown, **ask.units_of_texts((ranged, such_that.rpartition("=")[2]))}):
        with at_fault("vary"):
            path, low, high = _range(vary, base)
        with at_fault("such_that"):
            limit = _limit(such_that, base, path.path)
        # Both ends and one between.
        if not 3 <= grid <= 100_000:
            raise StudyError(f"grid = {grid}: must be at least 3 and at most 100,000")
        # Of noisy sensors the same 16 streams for all values, so that neighbours differ by the value alone.
        seeds = ask.seeds_of_noise([base], [path.path], 16, 1)
        streams = max(1, seeds.size)
        runs = ask.scenario_runs(base, [limit.metric], ask.RunCounter(grid * streams, progress), (), threads)

        def tried(values: ask.Floats) -> ask.Rows:
            columns = {path.path: np.tile(values, streams)}
            if seeds.size:
                columns[ask.NOISE_SEED] = np.repeat(seeds, values.size)
            return judged(runs.run(columns), limit, streams)

        rows, index, outer = outermost(tried, low, high, grid, highest)
        values = rows["value"]
        is_met = rows["is_met"]
        remarks = []
        if not np.isfinite(rows["judged"]).any():
            ends = f"from {path.quote(low)} to {path.quote(high)}"
            why = runs.reason and f"the first: {runs.reason}"
            fault = f"no run {ends} gives the metric '{limit.metric}'"
            if rows["oscillating"].any():
                fault = f"the loop oscillates in every run {ends}"
                why = _verdict(base, path, low, has_remedy=True)
            raise StudyError("; ".join(filter(None, (f"scenario '{base.name}': {fault}", why))))
        row = int((np.nanargmin if limit.is_most else np.nanargmax)(rows["judged"])) if index is None else index
        # A loop that fails even at the nearest value is why no value meets the condition.
        shown = [row] if (limit.text == ask.FOLLOWS if index is not None else rows["is_missed"][row]) else []
        if outer is not None:
            try:
                ask.with_overrides(base, [f"{path.path}={float(values[outer])!r} {SI}"])
                shown += [outer] if shown else []
            except (ParameterError, ScenarioError) as error:
                wanted = "highest" if highest else "lowest"
                remarks = [f"it is the {wanted} valid value, not the limit of the condition: {error}"]
        if not seeds.size:  # with noise a single run does not represent the mean over the noise streams
            remarks += [_verdict(base, path, float(values[number]), index is None) for number in shown]
        remarks += [ask.remark_on_following_gains(base, [path.path]), base.origin.replaced]
        if runs.failures:
            remarks.append(f"{runs.failures} of {runs.count} runs failed: not met; the first: {runs.reason}")
        edges = np.flatnonzero(np.diff(np.concatenate([[False], is_met, [False]])))
        found = Threshold(
            scenario=base.name,
            path=path.path,
            unit=path.quantity.unit,
            condition=limit.text,
            metric=limit.metric,
            limit=limit.limit,
            wanted="highest" if highest else "lowest",
            said="",
            remarks=list(filter(None, remarks)),
            value=None if index is None else float(values[index]),
            nearest=float(values[row]) if index is None else None,
            metric_at_value=None if index is None else float(rows["metric"][index]),
            not_met_at=None if outer is None else float(values[outer]),
            changes=int(np.count_nonzero(np.diff(is_met))),
            met=[[float(values[first]), float(values[after - 1])] for first, after in edges.reshape(-1, 2)],
            noise_streams=seeds.size,
            runs=runs.count,
            failed=runs.failures,
            unsettled=int(rows["unsettled"].sum()),
            tried={name: column.tolist() for name, column in rows.items()},
        )
        return _finding(found, rows, row, ask.of_path(path.path, found.unit, given=path.given), base)


def _range(text: str, base: Scenario) -> tuple[ask.VariedPath, float, float]:
    """Return path, lower and upper bound [SI] of a text ``PATH=LOW..HIGH``; StudyError for any other text."""
    quoted = f"'{one_line(text)}'"
    parts = re.fullmatch(r"\s*([^=\s]+)\s*=\s*(.+?)\s*\.\.\s*(.+?)\s*", text)
    if parts is None:
        raise StudyError(f"{quoted} is not of the form PATH=LOW..HIGH, for example 'supply.pressure=20..90 psi_g'")
    name, lower, upper = parts.groups()
    with refused_as(StudyError, quoted, ScenarioError, UnitError):
        path = ask.varied_path(name, base, [upper])
        if path.quantity.whole:
            raise StudyError(
                f"{quoted}: {name} takes whole numbers alone, which a study varies: [[vary]] kind = 'list'"
            )
        # As in '20..90 psi_g': the low end has the unit of the high one unless it says its own.
        if not ask.split_quantity(lower)[1]:
            lower = f"{lower} {ask.split_quantity(upper)[1]}".rstrip()
        low = path.level(lower)
        high = path.level(upper)
    if low >= high:
        raise StudyError(f"{quoted}: the lower end must be below the upper end")
    return path, low, high


def _limit(text: str, base: Scenario, path: str) -> ask.MetricLimit:
    """Return the limit of a text ``METRIC <= LIMIT``, ``METRIC >= LIMIT`` or ``follows``; StudyError for others.

    Gauge pressures refer to the ambient pressure of the scenario, unless ``path``, the varied number, is this pressure.
    """
    quoted = f"'{one_line(text)}'"
    parts = re.fullmatch(r"\s*([\w.:]+)\s*(<=|>=)\s*(.+?)\s*", text)
    if text.strip() == ask.FOLLOWS:
        # Every value that is found follows its reference; of two that do not, the error says which is nearer.
        tracked = (f"rms_{base.controlled}_error", "rms_error", "torque_error", "peak_torque")
        errors = [name for name in tracked if name in ask.METRICS and not ask.lacking(base, ask.METRICS[name])]
        if base.controller.is_open_loop or not errors:
            raise StudyError(f"{quoted} needs a reference, which scenario '{base.name}' lacks")
        return ask.MetricLimit(errors[0], math.inf, True, ask.FOLLOWS)
    if parts is None:
        raise StudyError(
            f"{quoted} must be METRIC <= LIMIT or METRIC >= LIMIT, for example 'final_error <= 0.3 N m', "
            f"or '{ask.FOLLOWS}'"
        )
    metric, sign, level = parts.groups()
    ask.check_metrics([metric], base)
    limit = ask.level_of(level, metric, quoted, ask.atmosphere_of(base, [path]))
    return ask.MetricLimit(metric, limit, sign == "<=", f"{metric} {sign} {level}")


def outermost(
    tried: Callable[[ask.Floats], ask.Rows], low: float, high: float, grid: int, highest: bool
) -> tuple[ask.Rows, int | None, int | None]:
    """Return columns of all tried values, ascending, and rows of the outermost one that is met and its outer neighbour.

    ``tried`` returns columns for values, of which ``is_met`` decides. Rows are None if missing.

    >>> import numpy as np
    >>> rows, index, outer = outermost(lambda values: {"is_met": values >= 2.5}, 0.0, 9.0, 10, False)
    >>> print(f"{rows['value'][index]:.5f}, {rows['value'].size} values")
    2.50000, 134 values
    """
    values = np.linspace(low, high, grid)
    rows = {"value": values, **tried(values), "is_of_grid": np.full(grid, True)}
    while True:
        met = np.flatnonzero(rows["is_met"])
        if not met.size:
            return rows, None, None
        index = int(met[-1] if highest else met[0])
        outer = index + (1 if highest else -1)
        if not 0 <= outer < rows["value"].size:
            return rows, index, None
        value, neighbour = rows["value"][[index, outer]].tolist()
        if abs(value - neighbour) <= ACCURACY * (high - low):
            return rows, index, outer
        # 32 parts of a bracket are run side by side, which takes little longer than one run of a bisection.
        values = np.linspace(value, neighbour, 33)[1:-1]
        more = {"value": values, **tried(values), "is_of_grid": np.full(values.size, False)}
        order = np.argsort(np.concatenate([rows["value"], values]), kind="stable")
        rows = {name: np.concatenate([column, more[name]])[order] for name, column in rows.items()}


def judged(runs: ask.Rows, limit: ask.MetricLimit, streams: int) -> ask.Rows:
    """Return columns (values,) of judged runs (streams * values,).

    - ``metric``, ``spread``: mean and standard deviation over the noise streams [SI]; nan if a run failed
    - ``judged``: number compared with the limit: the mean of ``settled``; nan if the loop oscillates throughout
    - ``excess``: tracking error divided by its limit [-], the largest; up to 1 the reference is followed
    - ``follows``, ``beyond_reach_on_purpose``: True if the reference is followed in all streams, or missed in any for
      the reason that its scenario gives; ``is_missed``: True if it is missed in any for another reason
    - ``is_kept``, ``is_met``: True if the limit is kept, and if the reference is not missed besides
    - ``unsettled``, ``oscillating``: number of runs that swing in the second half of the hold, and throughout
    """

    def by_value(runs: Any) -> Any:
        return runs.reshape(streams, -1)

    # Nobody would build on a loop whose command turns all the time.
    metric = runs[limit.metric]
    settled = runs[f"judged_{limit.metric}"]
    oscillates = runs["oscillates"] == 1.0
    on_purpose = runs[ask.ON_PURPOSE]
    follows = by_value(runs[ask.FOLLOWS] == 1.0).all(axis=0)
    is_missed = by_value((runs[ask.FOLLOWS] == 0.0) & ~on_purpose).any(axis=0)
    number = by_value(np.where(oscillates, np.nan, settled)).mean(axis=0)
    is_kept = np.asarray(limit.is_kept(number))
    return {
        "metric": by_value(metric).mean(axis=0),
        "judged": number,
        "spread": by_value(metric).std(axis=0, ddof=min(1, streams - 1)),
        "excess": by_value(runs["excess"]).max(axis=0),
        ask.FOLLOWS: follows,
        ask.ON_PURPOSE: by_value(on_purpose).any(axis=0),
        "is_missed": is_missed,
        "is_kept": is_kept,
        # A run without a verdict is none that follows, nor one that misses its reference.
        "is_met": is_kept & (follows if limit.text == ask.FOLLOWS else ~is_missed),
        "unsettled": by_value(settled > metric).sum(axis=0),
        "oscillating": by_value(oscillates).sum(axis=0),
    }


def _verdict(base: Scenario, path: ask.VariedPath, value: float, has_remedy: bool) -> str:
    """Return value [SI] and verdict of its run, with the remedy if asked."""
    # Given in the unit of the range, the value and what is said of it are in that unit.
    result = ask.simulate(ask.with_overrides(base, [f"{path.path}={path.quote(value, '.17g')}"]))
    # The remedy that succeeds decides between possible causes.
    verdict = ask.verdict_of(result)
    said = verdict.sentence
    if verdict.fails and not has_remedy:
        intended = f"intended: {verdict.accepted}" if verdict.accepted else ""
        said = "; ".join(filter(None, (verdict.found, verdict.cause, intended)))
    said = "; ".join(filter(None, (said, ask.standing_still(result, not verdict.fails))))
    return said and f"at {path.quote(value, '.9g')} {said}"


def _finding(found: Threshold, rows: ask.Rows, row: int, kind: ask.Kind, base: Scenario) -> Finding[Threshold]:
    """Return a search as a finding: sentences, table of intervals that meet the condition, metric over value.

    ``row`` is that of the value found, or of the nearest one.
    """
    values = rows["value"]
    of_limit = ask.of_metric(found.metric)
    is_verdict = found.condition == ask.FOLLOWS
    # Values that meet the condition although the run does not follow its reference.
    missed = 0 if is_verdict else int(np.count_nonzero(rows["is_missed"] & rows["is_kept"]))
    meets = "lets the run follow its reference" if is_verdict else f"meets {found.condition}"
    meets += " and follows its reference" if missed else ""
    name = found.metric
    number = float(rows["metric"][row])
    if rows["judged"][row] > number:
        name = _SETTLED
        number = float(rows["judged"][row])
    used = ""
    remarks = [*found.remarks]
    there = "" if is_verdict else f"{name} of {of_limit.text(number)} at "
    if found.value is None:
        # The nearest one says whether a wider range could.
        ends = f"from {kind.text(values[0])} to {kind.text(values[-1])}"
        said = f"none of the {values.size} values of {found.path} {ends} {meets}; the nearest is {there}"
        said += kind.text(values[row])
    else:
        # In more digits than are shown, so that the value that is pasted meets the condition.
        used = ask.override_text(ask.over(base.origin.overrides, [f"{found.path}={kind.text(found.value, '.9g')}"]))
        said = f"{found.path} = {kind.text(found.value)} is the {found.wanted} value that {meets}"
        there = "" if is_verdict else f": {name} is {of_limit.text(number)} there"
        further, beside, step = ("higher", "above", 1) if found.wanted == "highest" else ("lower", "below", -1)
        if found.not_met_at is None:
            said += f", at the end of the range{there}; a wider range may have a {further} value"
        else:
            said += f"{there} (bracketed to {kind.change(abs(found.value - found.not_met_at), '.1g')})"
            if rows["oscillating"][row + step]:
                said += f"; {beside} it the loop oscillates"
            elif rows["is_kept"][row + step] and not is_verdict:
                said += f"; {beside} it the reference is not followed"
    if found.noise_streams:
        remarks.append(f"the metric is the mean over {found.noise_streams} streams of sensor noise")
        if found.value is not None:
            spread = of_limit.change(float(rows["spread"][row]))
            remarks[-1] += f", over which it varies by {spread} (standard deviation): one run may miss the condition"
    if found.unsettled:
        remarks.append(f"{found.unsettled} runs swing in the second half of the hold: its RMS error must meet it too")
    if turning := int(rows["oscillating"].sum()):
        remarks.append(f"in {turning} of {found.runs} runs the loop oscillates: not met")
    if missed:
        remarks.append(f"at {missed} values the condition is met, but the reference is not followed")
    if on_purpose := int(np.count_nonzero(rows[ask.ON_PURPOSE] & rows["is_met"])):
        remarks.append(f"at {on_purpose} values the condition is met, with a reference beyond reach on purpose")
    # Ends of intervals that are values of the grid are not bracketed as the value found is.
    grid = values[rows["is_of_grid"]]
    met = f"the condition is met{' and the reference followed' if missed else ''}"
    exact = (values[0], values[-1], found.value)
    inner = ", ".join(kind.number(end) for interval in found.met for end in interval if end not in exact)
    beyond = f"of the grid; the condition may be met up to {kind.change(grid[1] - grid[0])} beyond"
    drawn = (
        "error, swing, peak or command reversals, each divided by its limit, whichever is largest,"
        if is_verdict
        else ""
    )
    return ask.Finding(
        name="find",
        kicker="Search",
        title=f"The {found.wanted} {found.path} such that {'the run ' if is_verdict else ''}{found.condition}",
        said=(said, *remarks),
        parts=(
            ask.Section(
                "Where the condition is met",
                ask.columns_of(("from", "to"), [[kind.text(end) for end in interval] for interval in found.met]),
                remarks=[f"{inner}: {beyond}"] if inner else [],
            ),
            ask.Section("To use the value" if used else "", code=used),
            ask.Section(
                "Metric over the value",
                panels=(_panel(found, rows, kind, of_limit, met),),
                name="find",
                caption=f"The {drawn or 'metric'} over the value; dashed: the limit; shaded and full: where {met}.",
            ),
        ),
        found=replace(found, said=said, remarks=remarks),
        passed=found.value is not None,
        overrides=ask.changes_in(base),
    )


def _panel(found: Threshold, rows: ask.Rows, kind: ask.Kind, of_limit: ask.Kind, met: str) -> ask.Panel:
    """Return a panel of the metric over the value, with the limit, the values that meet it, and the result."""
    values = rows["value"]
    metric = rows["metric"]
    number = rows["judged"]
    limit = found.limit
    if found.condition == ask.FOLLOWS:
        # The excess decides whether a run follows; it has no larger number beside it.
        metric = number = rows["excess"]
        of_limit = ask.Kind("Largest tracking number over its limit")
        limit = 1.0
    of_grid = rows["is_of_grid"]
    is_met = rows["is_met"]
    marks = [ask.Mark("line", values, metric)]
    for which, numbers, marker, label, colour, style in (
        (of_grid & is_met, metric, "o", "", ask.BLUE, {}),
        (of_grid & ~is_met, metric, "o", "", ask.BLUE, {"markerfacecolor": "white"}),
        (of_grid & (rows["oscillating"] > 0), metric, "x", "the loop oscillates", ask.BLACK, {"markersize": 7}),
        # The RMS error where that is larger, and what the condition is asked of.
        (number > metric, number, "+", f"{_SETTLED}, if it swings", ask.GREY, {"markersize": 6}),
    ):
        if which.any():
            marks.append(ask.dots(values[which], numbers[which], marker, label, colour, **{"markersize": 4, **style}))
    dashed = {"linestyle": "--", "linewidth": 1.0}
    marks.append(ask.Mark("level", (), limit, label="limit", colour=ask.BLACK, style=dashed))
    marks += [ask.Mark("span", ends, label="" if row else met, colour=ask.GREEN) for row, ends in enumerate(found.met)]
    if found.value is not None:
        text = f"found: {kind.number(found.value, '.4g')} {kind.axis_unit}".rstrip()
        marks.append(ask.Mark("at", found.value, label=text, colour=ask.VERMILION))
    return ask.Panel(kind, of_limit, tuple(marks))
