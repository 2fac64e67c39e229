"""Stopping rule for a statistic, interim estimates, and the final estimate.

An ordinary interval is too narrow if interim estimates are repeated until an interval happens to be favourable. Here
the number of interim estimates is limited before the first draw, and each takes an equal part of the allowed error
(Bonferroni's inequality): with the stated confidence, all their intervals hold at the same time, including the last.
"""

import math
from dataclasses import dataclass, field
from typing import Any

from ppafo.analyses.sweep.statistic_kind import Statistic
from ppafo.documents.json_text import plain
from ppafo.errors import StudyError, UnitError, refused_as
from ppafo.report.kind import ConfidenceInterval
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import FEWEST_DRAWS, MAXIMUM_DRAWS
from ppafo.studies.intervals import is_carried
from ppafo.studies.limits import CONFIDENCE, check_fraction, difference_of
from ppafo.units import number_text, parse_quantity


@dataclass(frozen=True, slots=True)
class StoppingRule:
    """Stopping rule for draws: an interval of a target width, or ``maximum`` draws.

    ``width``: target width in the SI unit of the statistic, or as a fraction of its value
    ``is_relative``: True if ``width`` is a fraction of the value
    ``first``: number of draws before the first interim estimate; doubled for each later one
    ``maximum``: maximum number of draws
    ``confidence``: joint confidence level of all interim estimates
    ``maximum_failed``: fraction of failed draws above which the estimate is refused
    """

    width: float
    is_relative: bool
    first: int = 256
    maximum: int = 2**20
    confidence: float = 0.95
    maximum_failed: float = 0.01

    def __post_init__(self) -> None:
        """Raise StudyError for a rule that can never be met or that has invalid limits."""
        if not (math.isfinite(self.width) and self.width > 0.0):
            raise StudyError(f"width = {self.width!r}: must be above 0")
        if not FEWEST_DRAWS <= self.first <= self.maximum <= MAXIMUM_DRAWS:
            raise StudyError(
                f"first = {self.first!r}, maximum = {self.maximum!r}: must be from {FEWEST_DRAWS} to "
                f"{MAXIMUM_DRAWS:,} draws, and first must not exceed maximum"
            )
        check_fraction(self.confidence, *CONFIDENCE)
        check_fraction(self.maximum_failed, "maximum_failed")

    @property
    def sizes(self) -> tuple[int, ...]:
        """Numbers of draws at the interim estimates, up to the maximum."""
        # Doubled each time: few looks have to share the allowed error, and the last takes half of all draws.
        sizes = [self.first]
        while sizes[-1] < self.maximum:
            sizes.append(min(2 * sizes[-1], self.maximum))
        return tuple(sizes)

    @property
    def confidence_of_look(self) -> float:
        """Confidence level of a single interim estimate, for which all of them together keep ``confidence``."""
        return 1.0 - (1.0 - self.confidence) / len(self.sizes)

    def is_narrow(self, look: "InterimEstimate") -> bool:
        """Return whether the interval, widened by the possible effect of values not drawn, is narrow enough."""
        allowed = self.width * (abs(look.interval.value) if self.is_relative else 1.0)
        return look.interval.width + look.unseen <= allowed


def target_width(statistic: Statistic, metric: str, width: str) -> tuple[float, bool]:
    """Return the target width of an interval from its text: number, and True if it is a fraction of the value."""
    text = width.strip()
    if statistic.threshold is not None:
        try:
            return float(number_text(text)), False
        except ValueError as error:
            raise StudyError(f"width = '{text}': must be a plain number for a probability, for example 0.01") from error
    if not text.endswith("%"):
        return difference_of(text, metric, f"width = '{width}'"), False
    with refused_as(StudyError, f"width = '{text}'", UnitError):
        return parse_quantity(text, ""), True


@dataclass(frozen=True, slots=True)
class InterimEstimate:
    """Interim estimate after a number of draws.

    ``draws``, ``missing``: number of draws, and of draws without a value
    ``interval``: estimate with its confidence interval [SI]
    ``effective_size``: effective sample size, below the number of values if a few large ones dominate
    ``unseen``: upper bound of the change of a mean by values that were not drawn [SI]
    """

    draws: int
    missing: int
    interval: ConfidenceInterval
    effective_size: float
    unseen: float = 0.0

    @property
    def is_carried(self) -> bool:
        """True if the effective sample size is large enough for the number of draws."""
        return is_carried(self.effective_size, self.draws - self.missing)


@dataclass(frozen=True, slots=True)
class MetricMean:
    """Mean of an additional metric [SI] over the same draws, with interval and number of draws with a value."""

    draws: int
    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class StatisticEstimate:
    """Estimate of a statistic of a metric, with interval [SI] and all interim estimates.

    ``is_met``: True if the last interval is narrow enough and rests on enough draws
    ``failed``: number of failed draws
    ``also``: means of additional metrics
    ``share_of_noise``: fraction of the variance that is due to sensor noise; None without noise
    ``looks``: interim estimates in order
    ``values``: values of the metric over all draws [SI]
    """

    metric: str
    statistic: str
    unit: str
    is_met: bool
    draws: int
    failed: int
    interval: ConfidenceInterval
    remarks: list[str]
    also: dict[str, MetricMean]
    share_of_noise: ConfidenceInterval | None
    seed: int
    rule: dict[str, float | str]
    looks: list[InterimEstimate]
    values: Floats = field(compare=False, repr=False)
    folder: str = field(default="", compare=False)

    def json_document(self) -> dict[str, Any]:
        """Return the estimate as plain data, with the path of the result folder."""
        document: dict[str, Any] = plain(self)
        return document | ({"folder": self.folder} if self.folder else {})
