"""Metrics for people: their names in words, and the kind of quantity that each is."""

from collections.abc import Mapping

from ppafo.answers.answer import Column
from ppafo.answers.display_units import display_difference, display_unit, display_value, quantity_of_unit
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.metrics import METRICS, Metric

_OF_GAS = {"kg": "gas mass", "kg/J": "gas mass per energy"}
"""Masses among the metrics are those of gas."""


def metric_quantity(name: str) -> str:
    """Return the kind of quantity of a metric, empty for a plain number."""
    return _quantity(METRICS[name].unit)


def metric_words(name: str) -> str:
    """Return the name of a metric in words: ``RMS error``."""
    words = name.replace("_", " ").replace("rms", "RMS")
    return words[:1].upper() + words[1:]


def metric_title(name: str) -> str:
    """Return the name of a metric in words with the unit in which it is shown: ``RMS error (N m)``."""
    unit = metric_unit(name)
    return f"{metric_words(name)} ({unit})" if unit else metric_words(name)


def metric_unit(name: str) -> str:
    """Return the unit in which a metric is shown, its own where it is no quantity of the table; empty for a number."""
    quantity = metric_quantity(name)
    return display_unit(quantity) if quantity else METRICS[name].unit.removeprefix("-")


def metric_column(name: str, form: str = ".4g") -> Column:
    """Return the column of the values of a metric in SI."""
    return Column(metric_words(name), metric_quantity(name), form)


def metrics_lines(metrics: Mapping[str, Metric], atmosphere: float = STANDARD_ATMOSPHERE) -> list[str]:
    """Return a line of text for each metric: name, value and unit as people are shown it, meaning.

    Pressures count from ``atmosphere`` [Pa absolute].
    """
    rows = []
    for name, metric in metrics.items():
        value, unit = metric_level(metric.value, metric.unit, atmosphere)
        rows.append((name, f"{value:.4g}", unit, metric.summary))
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(3)]
    return [f"{row[0]:<{widths[0]}}  {row[1]:>{widths[1]}} {row[2]:<{widths[2]}}  {row[3]}" for row in rows]


def metric_level(value: float, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> tuple[float, str]:
    """Return a value of a metric or channel, and its unit, as people are shown them.

    Pressures are gauge ones and count from ``atmosphere`` [Pa absolute].
    """
    quantity = _quantity(si_unit)
    return display_value(value, quantity, atmosphere), display_unit(quantity) or si_unit.removeprefix("-")


def metric_change(value: float, si_unit: str) -> tuple[float, str]:
    """Return a difference of two values of a metric or channel, and its unit, as people are shown them."""
    quantity = _quantity(si_unit)
    return display_difference(value, quantity), display_unit(quantity).replace("psi_g", "psi") or si_unit.removeprefix(
        "-"
    )


def _quantity(unit: str) -> str:
    return _OF_GAS.get(unit) or quantity_of_unit(unit)
