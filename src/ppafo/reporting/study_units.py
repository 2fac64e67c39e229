"""Metrics and varied paths of a study in the units in which tables and figures show them."""

import numpy as np
from numpy.typing import NDArray

from ppafo.constants import PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.metrics import METRICS, Metric
from ppafo.reporting.metrics_table import in_shown_unit
from ppafo.studies.sweep.results import StudyResults

Floats = NDArray[np.float64]

_PATH_UNITS = {"m^2": ("mm$^2$", 1.0e6), "m^3": ("cm$^3$", 1.0e6), "rad": ("deg", 180.0 / np.pi), "-": ("", 1.0)}


def shown_metric(name: str, value: float = 1.0) -> Metric:
    """Return a value of a metric [SI] in its shown unit; that of a plain number is empty."""
    return in_shown_unit(Metric(value, METRICS[name].unit.replace("-", ""), METRICS[name].summary))


def shown_values(name: str, values: Floats) -> Floats:
    """Return values of a metric [SI] in its shown unit."""
    zero, one = shown_metric(name, 0.0).value, shown_metric(name, 1.0).value
    return zero + (one - zero) * values


def metric_label(name: str) -> str:
    """Return name and unit of a metric as an axis has it."""
    return _labelled(name.replace("_", " "), shown_metric(name).unit)


def shown_path(results: StudyResults, path: str, values: Floats) -> tuple[str, Floats]:
    """Return label and values of a varied path [SI] in the units of the field; psi counts from 101.325 kPa."""
    unit = results.document["varied"][path]["unit"]
    name = path.replace(".", " ").replace("_", " ")
    if unit == "Pa_a":
        return f"{name} (psi gauge)", (values - STANDARD_ATMOSPHERE) / PASCALS_PER_PSI
    shown, scale = _PATH_UNITS.get(unit, (unit, 1.0))
    return _labelled(name, shown), scale * values


def _labelled(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit else name
