"""Values of metrics from texts with their unit."""

from ppafo.errors import StudyError, UnitError
from ppafo.metrics import METRICS
from ppafo.units import parse_quantity

_LEVELS = {"Pa": "Pa_a", "-": ""}
_DIFFERENCES = {"Pa": "Pa_d", "-": ""}


def level_of(text: str, metric: str, what: str) -> float:
    """Return a value of a metric in SI; StudyError, whose message ``what`` begins, where the unit does not fit."""
    unit = METRICS[metric].unit
    return _number(text, _LEVELS.get(unit, unit), what)


def difference_of(text: str, metric: str, what: str) -> float:
    """Return a difference of two values of a metric in SI; StudyError as in ``level_of``."""
    unit = METRICS[metric].unit
    return _number(text, _DIFFERENCES.get(unit, unit), what)


def _number(text: str, unit: str, what: str) -> float:
    try:
        return parse_quantity(text, unit)
    except UnitError as error:
        raise StudyError(f"{what}: {error}") from error
