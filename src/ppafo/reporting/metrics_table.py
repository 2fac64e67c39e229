"""Metrics as a table of text, in the units in which people of the field think."""

from collections.abc import Mapping
from dataclasses import replace

from ppafo.metrics import Metric
from ppafo.units import from_si

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
