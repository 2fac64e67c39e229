"""Numbers of metrics in the units in which tables and figures show them: levels, and differences of two levels."""

from ppafo.metrics import METRICS, Metric
from ppafo.reporting.metrics_table import in_shown_unit


def metric_unit(name: str) -> str:
    """Return the unit in which a metric is shown, empty for a plain number."""
    return _shown(name, 0.0).unit.replace("-", "")


def metric_level(name: str, value: float) -> float:
    """Return a value of a metric [SI] in its shown unit."""
    return _shown(name, value).value


def metric_difference(name: str, value: float) -> float:
    """Return a difference of two values of a metric [SI] in its shown unit."""
    return _shown(name, value).value - _shown(name, 0.0).value


def metric_title(name: str) -> str:
    """Return the name of a metric for people, with its shown unit: ``RMS error (N m)``."""
    words = name.replace("_", " ").replace("rms", "RMS")
    unit = metric_unit(name)
    title = words[:1].upper() + words[1:]
    return f"{title} ({unit})" if unit else title


def _shown(name: str, value: float) -> Metric:
    return in_shown_unit(Metric(float(value), METRICS[name].unit, METRICS[name].summary))
