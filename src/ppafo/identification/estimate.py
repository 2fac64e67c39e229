"""Estimate: value of a device parameter with confidence interval, verdict and an explanation in one sentence."""

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import Literal, get_args

from ppafo.errors import IdentificationError
from ppafo.wording import percentage

Verdict = Literal["identified", "holds for this model only", "not identifiable", "at its bound", "unit probably wrong"]
"""Verdict on an estimated value, given the fit of the model to the recordings.

A value is "identified" only if the model explains the recordings. A value that "holds for this model only" is written
into a set with the origin ``fitted``, and is not to be taken as a property of the device.
"""

_VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
WRONG_UNIT: Verdict = "unit probably wrong"
"""Verdict where the recordings do better in another unit of pressure; the value is not used in a set."""
_USABLE: tuple[Verdict, ...] = ("identified", "holds for this model only")

UNKNOWN = 0.995
"""Relative half-width of the confidence interval [-] from which a value is not identifiable, +-100 % when rounded: it
then contains zero or twice the value."""
_WIDE = 0.1
"""Relative half-width of the confidence interval [-] above which the verdict states the half-width."""


def interval_factor(confidence: float) -> float:
    """Return the half-width of a confidence interval in standard errors [-], 1.96 for a confidence of 95 %."""
    return NormalDist().inv_cdf(0.5 + 0.5 * confidence)


def relative_half_width(value: float, low: float, high: float, size: float | None = None) -> float:
    """Return the wider half of an interval as a fraction of the value [-].

    ``size`` is a typical magnitude that replaces the value of a quantity that may be zero. A side cut off at
    a bound is too narrow, so the wider side counts.

    >>> relative_half_width(0.4, 0.24, 0.5)
    0.4
    """
    wider = max(high - value, value - low)
    size = abs(value) if size is None else size
    return wider / size if size > 0.0 else math.inf


@dataclass(frozen=True, slots=True)
class Estimate:
    """Value in ``unit`` (SI text) with its confidence interval ``low`` to ``high`` at the stated ``confidence``.

    ``path`` is a dotted path in a parameter set, such as ``actuator.torque_constant``; a quantity without an entry in
    sets has a path of its own. An estimate that could not be made has NaN for value and interval. ``explanation`` is
    one sentence: the sources of the uncertainty, the quantities that the value trades off against, or the limits of its
    validity. ``recordings`` names each source with its hash: ``static.csv sha256:0123abcd...``. ``size`` is a typical
    magnitude [``unit``] of a quantity that may be zero, such as the zero of a sensor.
    """

    path: str
    value: float
    unit: str
    low: float
    high: float
    verdict: Verdict
    explanation: str
    recordings: tuple[str, ...]
    confidence: float = 0.95
    size: float | None = None

    def __post_init__(self) -> None:
        if self.verdict not in _VERDICTS:
            raise IdentificationError(f"verdict '{self.verdict}' is unknown; allowed: {', '.join(_VERDICTS)}")
        if not 0.0 < self.confidence < 1.0:
            raise IdentificationError(f"confidence must be between 0 and 1, not {self.confidence!r}")
        if self.is_usable and not (math.isfinite(self.value) and self.low <= self.value <= self.high):
            raise IdentificationError(
                f"{self.path}: value {self.value!r} with verdict '{self.verdict}' must lie inside its interval, "
                f"{self.low!r} to {self.high!r}"
            )

    @property
    def is_usable(self) -> bool:
        """True if the value may be used in a parameter set."""
        return self.verdict in _USABLE

    @property
    def is_identified(self) -> bool:
        """True if the recordings determine the value and the model explains the recordings."""
        return self.verdict == "identified"

    @property
    def verdict_text(self) -> str:
        """Verdict, with the half-width of a wide interval relative to the value: ``identified, +-44 %``.

        A probably wrong unit is named, with its factor.
        """
        if self.verdict == WRONG_UNIT:
            return f"{self.verdict}: {self.explanation.partition(';')[0]}"
        width = relative_half_width(self.value, self.low, self.high)
        if not self.is_usable or self.size is not None or width <= _WIDE:
            return self.verdict
        return f"{self.verdict}, +-{percentage(width, 2)}"

    @property
    def half_width(self) -> float:
        """Half-width of the confidence interval [``unit``]."""
        return (self.high - self.low) / 2.0

    @property
    def wider_half_width(self) -> float:
        """Width [``unit``] of the wider side of the interval; a side cut off at zero is too narrow."""
        return max(self.high - self.value, self.value - self.low)
