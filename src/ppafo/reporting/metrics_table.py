"""Metrics as a table of text, in the units in which people of the field think."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from ppafo.metrics import Metric
from ppafo.units import from_si

if TYPE_CHECKING:
    from ppafo.simulation.check import Changed, Check

_SHOWN_IN = {
    "kg": ("kg", "g"),
    "kg/J": ("kg/J", "g/J"),
    "rad": ("rad", "deg"),
    "rad/s": ("rad/s", "deg/s"),
    "Pa": ("Pa_a", "psi_a"),
}
_PLAIN_NUMBER = "-"


def metrics_table(metrics: Mapping[str, Metric]) -> list[str]:
    """Return one aligned line a metric: name, value, unit (g, deg, psi_a absolute ...), meaning."""
    shown = {name: in_shown_unit(metric) for name, metric in metrics.items()}
    rows = [
        (name, f"{item.value:.4g}", item.unit.replace(_PLAIN_NUMBER, ""), item.summary) for name, item in shown.items()
    ]
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(3)]
    return [f"{row[0]:<{widths[0]}}  {row[1]:>{widths[1]}} {row[2]:<{widths[2]}}  {row[3]}" for row in rows]


def in_shown_unit(metric: Metric) -> Metric:
    """Return the metric in the unit in which tables show it: grams, degrees, psi absolute; the rest stays in SI."""
    if metric.unit not in _SHOWN_IN:
        return metric
    si_unit, unit = _SHOWN_IN[metric.unit]
    return replace(metric, value=from_si(metric.value, unit, si_unit), unit=unit)


def shown_check(check: "Check") -> "Check":
    """Return a check in the units of these tables; the range of the pressures is a difference, as all changes are."""
    return replace(
        check,
        metrics=tuple(_shown_row(row) for row in check.metrics),
        courses=tuple(replace(row, unit=row.unit.replace("_a", "_d")) for row in map(_shown_row, check.courses)),
    )


def _shown_row(row: "Changed") -> "Changed":
    one = in_shown_unit(Metric(1.0, row.unit, ""))
    changes = {name: one.value * change for name, change in row.changes.items()}
    return replace(row, unit=one.unit, value=one.value * row.value, allowed=one.value * row.allowed, changes=changes)
