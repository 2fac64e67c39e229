"""The value from which on a condition is met, in words, a table and a figure."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ppafo.analyses.find.solve import FindResult
from ppafo.metrics.tracking import ONE_INSTANT
from ppafo.report.display_units import metric_words
from ppafo.report.finding import Column, Finding, Section
from ppafo.report.kind import Kind, of_metric, of_path
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLACK, GREEN, GREY, VERMILION


@dataclass(frozen=True, slots=True)
class FindSample:
    """A value [SI] that was tried, the metric there [SI], nan where the run failed, and by what it was judged [SI].

    ``judged`` is the metric, where the loop oscillates on the hold the larger one of it and of the RMS error there, and
    nan where the loop oscillates throughout.
    """

    value: float
    metric: float
    judged: float
    is_of_grid: bool


@dataclass(frozen=True, slots=True)
class Threshold:
    """The lowest, or highest, value that meets a condition on a metric; numbers in SI.

    ``value`` is None where none does, and ``not_met_at`` the next value on its outer side that was tried and does not,
    None at the end of the range. ``changes`` counts how often the condition begins or ceases to be met along the values
    that were tried, ``met`` are the ends of each stretch where it is. ``unsettled`` counts the runs whose loop
    oscillates at the instant of the metric, so that their RMS error on the hold has to meet the condition too.
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


def finding_of(outcome: FindResult) -> Finding[Threshold]:
    """Return the search in words, a table of where the condition is met, and the metric over the value."""
    wanted = "highest" if outcome.highest else "lowest"
    kind = _varied(outcome)
    met = outcome.stretches
    columns = [Column(title, [kind.text(ends[end]) for ends in met]) for end, title in enumerate(("from", "to"))]
    remarks = list(_remarks(outcome))
    rows = (outcome.values, outcome.metrics, outcome.judged, outcome.is_of_grid)
    return Finding(
        name="find",
        kicker="Search",
        title=f"The {wanted} {outcome.path.path} such that {outcome.condition.text}",
        said=(_verdict(outcome), *remarks),
        parts=(
            Section("Met in the range that was tried", columns),
            Section(
                "Metric over the value",
                panels=(_panel(outcome),),
                name="find",
                caption="The metric over the value; dashed: the limit; shaded: where the condition is met.",
            ),
        ),
        found=Threshold(
            scenario=outcome.scenario,
            path=outcome.path.path,
            unit=outcome.path.quantity.unit,
            condition=outcome.condition.text,
            metric=outcome.condition.metric,
            limit=outcome.condition.limit,
            wanted=wanted,
            value=outcome.value,
            metric_at_value=_metric_at_value(outcome),
            not_met_at=outcome.beyond,
            changes=outcome.changes,
            met=met,
            remarks=remarks,
            noise_streams=outcome.noise_streams,
            runs=outcome.runs,
            failed=outcome.failed,
            unsettled=outcome.unsettled,
            tried=list(map(FindSample, *(row.tolist() for row in rows))),
        ),
        passed=outcome.value is not None,
    )


def _varied(outcome: FindResult) -> Kind:
    """Return what is varied, in the unit of the range that was given."""
    return of_path(outcome.path.path, outcome.path.quantity.unit, given=outcome.path.given)


def _range(outcome: FindResult) -> str:
    kind = _varied(outcome)
    return f"{kind.text(outcome.values[0])} to {kind.text(outcome.values[-1])}"


def _metric_at_value(outcome: FindResult) -> float | None:
    if outcome.value is None:
        return None
    return float(outcome.metrics[np.searchsorted(outcome.values, outcome.value)])


def _verdict(outcome: FindResult) -> str:
    """Return the value, or where none meets the condition the one that comes nearest."""
    path, condition = outcome.path.path, outcome.condition
    kind, of_condition = _varied(outcome), of_metric(condition.metric)
    wanted, further = ("highest", "higher") if outcome.highest else ("lowest", "lower")
    metric = _metric_at_value(outcome)
    if outcome.value is None or metric is None:
        # The nearest one says whether a wider range could.
        row = int((np.nanargmin if condition.is_most else np.nanargmax)(outcome.judged))
        return (
            f"no {path} from {_range(outcome)} meets {condition.text}; the nearest is "
            f"{of_condition.text(outcome.judged[row])} at {kind.text(outcome.values[row])}"
        )
    # Beyond it the condition may be met by a loop that does not follow its reference.
    follows = " and follows its reference" if _not_followed(outcome) else ""
    lead = f"{path} = {kind.text(outcome.value)} is the {wanted} value that meets {condition.text}{follows}"
    there = f"{condition.metric} is {of_condition.text(metric)} there"
    if outcome.beyond is None:
        return f"{lead}, and the end of the range: {there}; a wider range may have a {further} one"
    return f"{lead}: {there} (bracketed to {kind.change(abs(outcome.value - outcome.beyond), '.1g')})"


def _not_followed(outcome: FindResult) -> int:
    """Number of values at which the condition is met, but the reference is not followed."""
    return int(np.count_nonzero(~outcome.follows & outcome.condition.is_kept(outcome.judged)))


def _remarks(outcome: FindResult) -> Iterator[str]:
    """Yield what else is to be known: runs, other stretches, noise, oscillation and failures."""
    condition, is_met = outcome.condition, outcome.is_met
    evenly, closer = np.count_nonzero(outcome.is_of_grid), np.count_nonzero(~outcome.is_of_grid)
    if is_met.all():
        where = "everywhere"
    else:
        where = "nowhere" if outcome.value is None else f"at {np.count_nonzero(is_met)} of them"
    yield (
        f"{evenly} values from {_range(outcome)}, evenly, then {closer} more in the bracket; the condition is met "
        f"{where}"
    )
    if outcome.changes > 1:
        side = "below" if outcome.highest else "above"
        yield (
            f"the condition changes {outcome.changes} times over the range, so it is not met everywhere {side} this "
            "value; see the table and the figure"
        )
    if outcome.noise_streams:
        noise = (
            f"sensors are noisy: the metric is the mean over {outcome.noise_streams} noise streams, the same for all "
            "values"
        )
        if outcome.value is not None:
            spread = float(outcome.spread[np.searchsorted(outcome.values, outcome.value)])
            noise += (
                f"; at the value that was found it varies by {of_metric(condition.metric).change(spread)} (standard "
                "deviation) from stream to stream, so a single run may miss the condition there"
            )
        yield noise
    if outcome.unsettled:
        yield (
            f"in {outcome.unsettled} runs the loop oscillates on the hold, and {condition.metric} is one sample of "
            f"it: in these runs the condition must also hold for {ONE_INSTANT[condition.metric][0]}"
        )
    if outcome.oscillating:
        yield f"in {outcome.oscillating} of {outcome.runs} runs the loop oscillates: they count as not met"
    missed = _not_followed(outcome)
    if missed:
        yield f"at {missed} values the condition is met, but the reference is not followed: they count as not met"
    if outcome.failed:
        yield (
            f"{outcome.failed} of {outcome.runs} runs failed and count as not met; the first: {outcome.first_failure}"
        )


def _larger(outcome: FindResult) -> list[Mark]:
    """Return the RMS error on the hold where that is larger, and what the condition is asked of."""
    larger = np.where(outcome.judged > outcome.metrics, outcome.judged, np.nan)
    if not np.isfinite(larger).any():
        return []
    crosses = {"linestyle": "", "marker": "x", "markersize": 4}
    label = metric_words(ONE_INSTANT[outcome.condition.metric][0])
    return [
        Mark("line", outcome.values, larger, label=f"{label}, of a loop that oscillates", colour=GREY, style=crosses)
    ]


def _panel(outcome: FindResult) -> Panel:
    """Return the metric over the value, with the limit, where it is met, and the value that was found."""
    values, metrics, is_of_grid = outcome.values, outcome.metrics, outcome.is_of_grid
    kind = _varied(outcome)
    dots, dashes = {"linestyle": "", "marker": "o", "markersize": 3}, {"linestyle": "--", "linewidth": 1.0}
    marks = [
        Mark("line", values, metrics),
        Mark("line", values[is_of_grid], metrics[is_of_grid], style=dots),
        *_larger(outcome),
        Mark("level", (), outcome.condition.limit, label="limit", colour=BLACK, style=dashes),
    ]
    marks += [
        Mark("span", ends, label="" if row else "condition met", colour=GREEN)
        for row, ends in enumerate(outcome.stretches)
    ]
    if outcome.value is not None:
        marks.append(
            Mark(
                "at",
                outcome.value,
                label=f"found: {kind.number(outcome.value, '.4g')} {kind.axis_unit}".rstrip(),
                colour=VERMILION,
            )
        )
    return Panel(kind, of_metric(outcome.condition.metric), tuple(marks))
