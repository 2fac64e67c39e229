"""Report of a threshold: sentences, a table and a figure."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.analyses.find.solve import FOLLOWS, FindResult
from ppafo.parameters.overrides import over
from ppafo.report.finding import Column, Finding, Section
from ppafo.report.kind import Kind, of_metric, of_path
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, GREEN, GREY, VERMILION
from ppafo.wording import override_text


@dataclass(frozen=True, slots=True)
class FindSample:
    """Tried value of the varied path, and the metric of its run.

    ``value``: tried value [SI]
    ``metric``: metric at this value [SI]; nan if the run failed
    ``judged``: number compared with the limit [SI]: the metric, or the RMS error in the second half of the hold if that
        is larger and the value swings there; nan if the loop oscillates throughout
    ``is_of_grid``: True if the value belongs to the initial grid
    """

    value: float
    metric: float
    judged: float
    is_of_grid: bool


@dataclass(frozen=True, slots=True)
class Threshold:
    """Lowest or highest value that meets a condition on a metric; numbers in SI.

    ``value``: value found; None if no value meets the condition
    ``not_met_at``: next tried value on the outer side, which does not meet the condition; None at the end of the range
    ``changes``: number of changes between met and not met along the tried values
    ``met``: first and last tried value of each interval in which the condition is met; beside ``value``, of the grid
    ``unsettled``: number of runs that swing at the instant of the metric, so that their RMS error in the second half of
        the hold must meet the condition too
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
    tried: list[FindSample]


def finding_of(outcome: FindResult, overrides: Sequence[str] = ()) -> Finding[Threshold]:
    """Return a search as a finding: sentences, table of intervals that meet the condition, metric over value.

    ``overrides`` are those with which the value was searched.
    """
    wanted = "highest" if outcome.highest else "lowest"
    path, condition, tried = outcome.path, outcome.condition, outcome.tried
    # In the unit of the range that was given.
    kind = of_path(path.path, path.quantity.unit, given=path.given)
    met, (index, neighbour) = outcome.met_intervals, outcome.found
    drawn, also = "metric", ""
    if condition.text == FOLLOWS:
        drawn = "error, swing, peak or command reversals, each divided by its limit, whichever is largest,"
        also = "; a torque beyond the actuator's does not meet it"
    columns = [Column(title, [kind.text(ends[end]) for ends in met]) for end, title in enumerate(("from", "to"))]
    # Values that meet the condition although the run does not follow its reference.
    missed = int(np.count_nonzero(~tried["follows"] & condition.is_kept(tried["judged"]))) * (condition.text != FOLLOWS)
    remarks = list(_remarks(outcome, kind, missed))
    # In more digits than are shown, so that the value that is pasted meets the condition.
    used = ""
    if index is not None:
        used = override_text(over(overrides, [f"{path.path}={kind.text(float(tried['value'][index]), '.9g')}"]))
    return Finding(
        name="find",
        kicker="Search",
        title=f"The {wanted} {path.path} such that {'the run ' if condition.text == FOLLOWS else ''}{condition.text}",
        said=(_verdict(outcome, kind, missed), *remarks),
        parts=(
            Section("Where the condition is met", columns, remarks=_ends_of_grid(outcome, kind, met)),
            Section("To use the value" if used else "", code=used),
            Section(
                "Metric over the value",
                panels=(_panel(outcome, kind, _met_words(missed)),),
                name="find",
                caption=f"The {drawn} over the value; dashed: the limit; shaded: where {_met_words(missed)}{also}.",
            ),
        ),
        found=Threshold(
            scenario=outcome.scenario,
            path=path.path,
            unit=path.quantity.unit,
            condition=condition.text,
            metric=condition.metric,
            limit=condition.limit,
            wanted=wanted,
            value=None if index is None else float(tried["value"][index]),
            metric_at_value=None if index is None else float(tried["metric"][index]),
            not_met_at=neighbour,
            changes=int(np.count_nonzero(np.diff(outcome.is_met))),
            met=met,
            remarks=remarks,
            noise_streams=outcome.noise_streams,
            runs=outcome.runs.count,
            failed=outcome.runs.failures,
            unsettled=int(tried["unsettled"].sum()),
            tried=[FindSample(*row) for row in tried[["value", "metric", "judged", "is_of_grid"]].tolist()],
        ),
        passed=index is not None,
    )


_SETTLED = "RMS error in the second half of the hold"
"""Number that decides in place of the error of one instant, for a loop that swings."""


def _verdict(outcome: FindResult, kind: Kind, missed: int) -> str:
    """Return a sentence on the value found, or on the nearest value if none meets the condition."""
    path, condition, tried = outcome.path.path, outcome.condition, outcome.tried
    of_condition, (index, neighbour) = of_metric(condition.metric), outcome.found
    wanted, further = ("highest", "higher") if outcome.highest else ("lowest", "lower")
    is_verdict = condition.text == FOLLOWS
    meets = "lets the run follow its reference" if is_verdict else f"meets {condition.text}"
    # Beyond the value found, the condition may be met by a loop that does not follow its reference.
    follows = " and follows its reference" if missed else ""
    nearest = f"{condition.metric} of " if is_verdict else ""
    if index is None:
        # The nearest one says whether a wider range could.
        row = int(np.searchsorted(tried["value"], outcome.nearest))
        nearest = f"{_SETTLED} of " if tried["judged"][row] > tried["metric"][row] else nearest
        there = "" if is_verdict and outcome.verdicts else f"{nearest}{of_condition.text(tried['judged'][row])} at "
        ends = f"from {kind.text(tried['value'][0])} to {kind.text(tried['value'][-1])}"
        # Inside the range this number alone does not decide.
        other = ", inside the range: a finer grid, or other gains (ppafo tune), may meet it"
        other = other if 0 < row < tried.size - 1 else ""
        near = f"the nearest is {there}{kind.text(tried['value'][row])}{other}"
        return f"no {path} {ends} {meets}{follows}; {_condition_alone(outcome, kind) if missed else near}"
    value = float(tried["value"][index])
    intervals, gap = outcome.met_intervals, ""
    if len(intervals) > 1:
        (_, start), (stop, _) = intervals[-2:] if outcome.highest else intervals[:2]
        gap = f", but no value between {kind.text(start)} and {kind.text(stop)} does"
    lead = f"{path} = {kind.text(value)} is the {wanted} value that {meets}{follows}{gap}"
    # Verdicts have the number that decided, in a line of their own.
    number, judged = (of_condition.text(float(tried[name][index])) for name in ("metric", "judged"))
    there = "" if outcome.verdicts else f": {condition.metric} is {number} there"
    if there and tried["judged"][index] > tried["metric"][index]:
        there += f", and the {_SETTLED}, which decides, {judged}"
    if neighbour is None:
        return f"{lead}, at the end of the range{there}; a wider range may have a {further} value"
    bracket, (reason, other) = f"(bracketed to {kind.change(abs(value - neighbour), '.1g')})", outcome.refusal
    if reason:
        end = kind.text(float(tried["value"][-1 if outcome.highest else 0]), ".9g")
        add = f"; for {further} values, add {override_text([f'{other}={end}'])}" if other else ""
        valid = f"it is the {wanted} valid value, not the limit of the condition {bracket}"
        return f"{path} = {kind.text(value)} {meets}{follows}{gap}{there}; {valid}: {reason}{add}"
    beyond, why = tried[index + (1 if outcome.highest else -1)], ""
    side = "above" if outcome.highest else "below"
    if beyond["oscillating"]:
        why = f"; {side} it the loop oscillates"
    elif not is_verdict and condition.is_kept(beyond["judged"]):
        why = f"; {side} it the reference is not followed: {_condition_alone(outcome, kind)}"
    return f"{lead}{there} {bracket}{why}"


def _condition_alone(outcome: FindResult, kind: Kind) -> str:
    """Return a clause on the outermost tried value that meets the condition, whether its run follows or not."""
    values = outcome.tried["value"]
    bound, row, step = ("up to", -1, 1) if outcome.highest else ("from", 0, -1)
    index = int(np.flatnonzero(outcome.condition.is_kept(outcome.tried["judged"]))[row])
    text = f"the condition alone is met {bound} {kind.text(values[index], '.4g')}"
    outer = index + step
    return f"{text} (not at {kind.text(values[outer], '.4g')})" if 0 <= outer < values.size else text


def _remarks(outcome: FindResult, kind: Kind, missed: int) -> Iterator[str]:
    """Yield remarks on runs, further intervals, noise, oscillation and failures."""
    condition, is_met, tried, runs = outcome.condition, outcome.is_met, outcome.tried, outcome.runs
    index, _ = outcome.found
    yield from (f"at {kind.text(value, '.9g')} {said}" for value, said in outcome.verdicts if said)
    yield from filter(None, outcome.remarks)
    evenly = np.count_nonzero(tried["is_of_grid"])
    met = np.count_nonzero(is_met)
    where = "everywhere" if is_met.all() else f"at {met} of them" if met else "nowhere"
    more = f", then {tried.size - evenly} more in the bracket" if tried.size > evenly else ""
    ends = f"from {kind.text(tried['value'][0])} to {kind.text(tried['value'][-1])}"
    yield f"{evenly} values {ends}, evenly spaced{more}; the condition is met {where}"
    if (changes := np.count_nonzero(np.diff(is_met))) > 1:
        side = "below" if outcome.highest else "above"
        yield f"the condition changes {changes} times over the range, so it is not met everywhere {side} this value"
    if streams := outcome.noise_streams:
        spread = ""
        if index is not None:
            varies = of_metric(condition.metric).change(float(tried["spread"][index]))
            spread = f"; at the value found it varies by {varies} (standard deviation): one run may miss the condition"
        yield f"sensors are noisy: the metric is the mean over {streams} noise streams, the same for all values{spread}"
    if unsettled := int(tried["unsettled"].sum()):
        yield (
            f"in {unsettled} runs the loop still oscillates in the second half of the hold, so {condition.metric} "
            "depends on the instant: these runs must also meet the condition with the RMS error of that half"
        )
    if oscillating := int(tried["oscillating"].sum()):
        yield f"in {oscillating} of {runs.count} runs the loop oscillates: they count as not met"
    if missed:
        yield f"at {missed} values the condition is met, but the reference is not followed: they count as not met"
    if runs.failures:
        yield f"{runs.failures} of {runs.count} runs failed and count as not met; the first: {runs.reason}"


def _ends_of_grid(outcome: FindResult, kind: Kind, met: Sequence[Sequence[float]]) -> list[str]:
    """Return a remark on the ends of intervals that are values of the grid, not bracketed as the value found is."""
    values, (index, _) = outcome.tried["value"], outcome.found
    exact = [values[0], values[-1], *([] if index is None else [values[index]])]
    grid = values[outcome.tried["is_of_grid"]]
    ends = [kind.number(end) for interval in met for end in interval if end not in exact]
    if not ends:
        return []
    return [f"{', '.join(ends)}: of the grid; the condition may be met up to {kind.change(grid[1] - grid[0])} beyond"]


def _met_words(missed: int) -> str:
    """Return the label of the values that count as met, ``missed`` values being met without being followed."""
    return f"the condition is met{' and the reference followed' if missed else ''}"


def _panel(outcome: FindResult, kind: Kind, met: str) -> Panel:
    """Return a panel of the metric over the value, with the limit, the values that meet it, and the result."""
    tried, condition = outcome.tried, outcome.condition
    # What decides whether a run follows is the excess, which has no larger number beside it.
    drawn, of_drawn, limit = ("metric", "judged"), of_metric(condition.metric), condition.limit
    if condition.text == FOLLOWS:
        drawn, of_drawn, limit = ("excess", "excess"), Kind("Largest tracking number over its limit"), 1.0
    values, metrics, judged = tried["value"], *(tried[name] for name in drawn)
    dots, dashes = {"linestyle": "", "marker": "o", "markersize": 3}, {"linestyle": "--", "linewidth": 1.0}
    grid_samples = tried[tried["is_of_grid"]]
    marks = [Mark("line", values, metrics), Mark("line", grid_samples["value"], grid_samples[drawn[0]], style=dots)]
    # The RMS error where that is larger, and what the condition is asked of.
    larger = np.where(judged > metrics, judged, np.nan)
    if np.isfinite(larger).any():
        crosses = {"linestyle": "", "marker": "x", "markersize": 4}
        label = "RMS error in the second half of the hold, if oscillating"
        marks.append(Mark("line", values, larger, label=label, colour=GREY, style=crosses))
    marks.append(Mark("level", (), limit, label="limit", colour=BLACK, style=dashes))
    marks += [
        Mark("span", ends, label="" if row else met, colour=GREEN) for row, ends in enumerate(outcome.met_intervals)
    ]
    index, _ = outcome.found
    if index is not None:
        value = float(values[index])
        text = f"found: {kind.number(value, '.4g')} {kind.axis_unit}".rstrip()
        marks.append(Mark("at", value, label=text, colour=VERMILION))
    return Panel(kind, of_drawn, tuple(marks))
