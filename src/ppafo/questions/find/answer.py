"""The answer of a search for a value: the value with its bracket, where the condition is met, and the curve."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import (
    axis_unit,
    change_text,
    display_value,
    display_values,
    quantity_of_unit,
    quantity_text,
)
from ppafo.answers.layout import Margins, figure_of_panels
from ppafo.answers.shown_metrics import metric_quantity, metric_title
from ppafo.answers.style import BLACK, BLUE, GREEN, VERMILION, house_style, mark_kind
from ppafo.questions.find.solve import Found
from ppafo.simulation.document import plain

if TYPE_CHECKING:
    import matplotlib.figure

_SIZE = (7.0, 3.8)
_MARGINS = Margins(left=0.85, right=0.25, top=0.4, bottom=0.55, row_gap=0.0)
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
    with house_style():
        figure, ((axes,),) = figure_of_panels(_SIZE, _MARGINS, 1)
        values = display_values(found.values, quantity)
        axes.plot(values, display_values(found.metrics, metric), color=BLUE)
        axes.plot(values[found.grid], display_values(found.metrics[found.grid], metric), "o", color=BLUE, markersize=3)
        axes.axhline(display_value(found.condition.limit, metric), color=BLACK, linestyle="--", linewidth=1.0)
        for low, high in stretches(found):
            axes.axvspan(
                display_value(low, quantity), display_value(high, quantity), color=GREEN, alpha=0.12, linewidth=0
            )
        if found.value is not None:
            axes.axvline(display_value(found.value, quantity), color=VERMILION, linewidth=1.4)
        unit = axis_unit(quantity) if quantity else found.path.quantity.unit
        axes.set_xlabel(f"{found.path.path} ({unit})" if unit else found.path.path)
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
