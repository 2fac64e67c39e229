"""Metrics of an analysis, and texts for their levels, differences, limits and fractions."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import StudyError, UnitError, refused_as
from ppafo.metrics import METRICS
from ppafo.metrics.metric import MetricKind
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.plugins import nearest_kind
from ppafo.simulation.ensemble import lacking, offered
from ppafo.simulation.scenario import Scenario
from ppafo.units import parse_quantity
from ppafo.wording import first_twice

_OUTCOME_LEVELS = {"Pa": "Pa_a", "-": ""}
_DIFFERENCES = {"Pa": "Pa_d", "-": ""}


def check_metrics(metrics: Sequence[str], scenario: Scenario) -> None:
    """Raise StudyError for a metric that does not exist or that the scenario cannot have."""
    for name in metrics:
        if name not in METRICS:
            known = offered(scenario)
            hint = nearest_kind(name, known, MetricKind)
            raise StudyError(f"there is no metric '{name}'{hint}; available: {', '.join(known)}")
        if reason := lacking(scenario, METRICS[name]):
            raise StudyError(f"scenario '{scenario.name}' has no '{name}': {reason}")
    if (repeated := first_twice(metrics)) is not None:
        raise StudyError(f"metric '{repeated}' is named twice; name it once")


def atmosphere_of(scenario: Scenario, varied: Collection[str]) -> float | None:
    """Return the atmospheric pressure [Pa absolute] for gauge pressures of a scenario; None if it is varied."""
    return None if ATMOSPHERE_PATH in varied else scenario.device.supply.atmospheric_pressure


def level_of(text: str, metric: str, what: str, atmosphere: float | None) -> float:
    """Convert a level of a metric from text to SI; gauge pressures are relative to ``atmosphere`` [Pa absolute].

    Raises StudyError, prefixed with ``what``, for a wrong unit, and for a gauge pressure if ``atmosphere`` is None
    because it varies between the runs.
    """
    atmospheres = (0.0, STANDARD_ATMOSPHERE) if atmosphere is None else (atmosphere,)
    # The same under two atmospheres: an absolute pressure, or no pressure at all.
    unit = METRICS[metric].unit
    with refused_as(StudyError, what, UnitError):
        levels = {parse_quantity(text, _OUTCOME_LEVELS.get(unit, unit), atmosphere) for atmosphere in atmospheres}
    level = levels.pop() if len(levels) == 1 else None
    if level is None:
        raise StudyError(f"{what}: must not be a gauge pressure, because {ATMOSPHERE_PATH} varies")
    return level


def difference_of(text: str, metric: str, what: str) -> float:
    """Convert a difference of two metric values from text to SI; StudyError, prefixed with ``what``, if it fails."""
    unit = METRICS[metric].unit
    with refused_as(StudyError, what, UnitError):
        return parse_quantity(text, _DIFFERENCES.get(unit, unit), 0.0)


@dataclass(frozen=True, slots=True)
class MetricLimit:
    """Limit of a metric [SI] and its text: an upper limit if ``is_most``, else a lower one."""

    metric: str
    limit: float
    is_most: bool
    text: str

    def is_kept(self, values: Any) -> Any:
        """Return elementwise whether values of the metric [SI] satisfy the limit; False for nan (no value)."""
        return values <= self.limit if self.is_most else values >= self.limit

    @property
    def words(self) -> str:
        """Text of the limit, such as 'at most 5 N m'."""
        return f"at {'most' if self.is_most else 'least'} {self.text}"
