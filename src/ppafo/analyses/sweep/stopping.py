"""When drawing for a statistic stops, and what was seen by then: a rule, its looks, and the estimate.

Looking repeatedly and stopping at a favourable interval makes an ordinary interval too narrow. Here the number of
looks is bounded before the first draw, and each look takes an equal part of the allowed error (Bonferroni's
inequality): with the stated confidence all intervals of the trace hold at once, the one at which it stopped too.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Any

from ppafo.analyses.sweep.statistic_kind import Statistic
from ppafo.documents.json_text import plain
from ppafo.errors import StudyError, UnitError, refused_as
from ppafo.report.kind import ConfidenceInterval
from ppafo.studies.distributions import Floats, is_carried
from ppafo.studies.draws import FEWEST_DRAWS, MAXIMUM_DRAWS
from ppafo.studies.limits import CONFIDENCE, check_fraction, difference_of
from ppafo.units import number_text, parse_quantity


@dataclass(frozen=True, slots=True)
class StoppingRule:
    """When to stop: at an interval of this width, or after ``maximum`` draws.

    ``width`` is in the SI unit of the statistic, or a fraction of its value where ``is_relative``. The first look is
    after ``first`` draws, each later one after twice as many; ``confidence`` holds for all looks together. Draws are
    refused where more than the fraction ``maximum_failed`` of them fails.
    """

    width: float
    is_relative: bool
    first: int = 256
    maximum: int = 2**20
    confidence: float = 0.95
    maximum_failed: float = 0.01

    def __post_init__(self) -> None:
        """Refuse a rule that can never be met or that asks for nothing."""
        if not (math.isfinite(self.width) and self.width > 0.0):
            raise StudyError(f"width = {self.width!r}: must be more than 0")
        if not FEWEST_DRAWS <= self.first <= self.maximum <= MAXIMUM_DRAWS:
            raise StudyError(
                f"first = {self.first!r} and maximum = {self.maximum!r} draws: must be at least {FEWEST_DRAWS}, the "
                f"first not more than the maximum, and the maximum not above {MAXIMUM_DRAWS:,}"
            )
        check_fraction(self.confidence, *CONFIDENCE)
        check_fraction(self.maximum_failed, "maximum_failed")

    @property
    def sizes(self) -> tuple[int, ...]:
        """The numbers of draws at which it is looked at the interval, at most."""
        # Doubled each time: few looks have to share the allowed error, and the last takes half of all draws.
        sizes = [self.first]
        while sizes[-1] < self.maximum:
            sizes.append(min(2 * sizes[-1], self.maximum))
        return tuple(sizes)

    @property
    def confidence_of_look(self) -> float:
        """Confidence of each single look, so that all of them together keep ``confidence``."""
        return 1.0 - (1.0 - self.confidence) / len(self.sizes)

    def is_narrow(self, look: "InterimEstimate") -> bool:
        """Tell whether an interval is narrow enough, with what values that were not drawn would add to it."""
        allowed = self.width * (abs(look.interval.value) if self.is_relative else 1.0)
        return look.interval.width + look.unseen <= allowed


def stopping_rule(statistic: Statistic, metric: str, width: str, like: StoppingRule) -> StoppingRule:
    """Return the rule with the width that a text says, else like another one."""
    text = width.strip()
    if statistic.threshold is not None:
        try:
            return replace(like, width=float(number_text(text)), is_relative=False)
        except ValueError as error:
            raise StudyError(f"width = '{text}': for a probability give a plain number, such as 0.01") from error
    if not text.endswith("%"):
        return replace(like, width=difference_of(text, metric, f"width = '{width}'"), is_relative=False)
    with refused_as(StudyError, f"width = '{text}'", UnitError):
        return replace(like, width=parse_quantity(text, ""), is_relative=True)


@dataclass(frozen=True, slots=True)
class InterimEstimate:
    """Interim estimate: number of draws, number without a value, and the interval [SI].

    ``effective_size`` is how many of them determine the estimate: fewer than there are where a few large values decide.
    ``unseen`` [SI] is the change of a mean by values that were not drawn, at most.
    """

    draws: int
    missing: int
    interval: ConfidenceInterval
    effective_size: float
    unseen: float = 0.0

    @property
    def is_carried(self) -> bool:
        """Tell whether enough draws determine the estimate."""
        return is_carried(self.effective_size, self.draws - self.missing)


@dataclass(frozen=True, slots=True)
class OfMean:
    """The mean of a further metric [SI] over the same draws, with its interval, and how many draws have it."""

    draws: int
    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class StatisticEstimate:
    """A statistic of a metric, with its interval [SI] and the looks one after the other.

    ``is_met`` is true where the last interval is narrow enough and can be believed. ``share_of_noise`` is the fraction
    of the variance that is due to sensor noise, None where there is none; ``values`` are the metric's [SI].
    """

    metric: str
    statistic: str
    unit: str
    is_met: bool
    draws: int
    failed: int
    interval: ConfidenceInterval
    remarks: list[str]
    also: dict[str, OfMean]
    share_of_noise: ConfidenceInterval | None
    seed: int
    rule: dict[str, float | str]
    looks: list[InterimEstimate]
    values: Floats = field(compare=False, repr=False)
    folder: str = field(default="", compare=False)

    def json_document(self) -> dict[str, Any]:
        """Return the numbers, and the folder in which they are written."""
        document: dict[str, Any] = plain(self)
        return document | ({"folder": self.folder} if self.folder else {})
