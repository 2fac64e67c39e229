"""An estimate: one value of a parameter set with interval, verdict and one sentence."""

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import Literal, get_args

from ppafo.errors import IdentificationError

Verdict = Literal["identified", "holds for this model only", "not identifiable", "at its bound"]
"""Verdict of the recordings on a value.

Only the first is given where the model explains the recordings; the second is written into a set as a fitted value that
nobody should take for the device's own.
"""

_VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
_USABLE: tuple[Verdict, ...] = ("identified", "holds for this model only")


def interval_factor(confidence: float) -> float:
    """Return the standard errors [-] on each side of an interval with this confidence, 1.96 for 95 %."""
    return NormalDist().inv_cdf(0.5 + 0.5 * confidence)


def half_width_for(confidence: float, half_width: float, stated: float) -> float:
    """Return half the width of an interval for some confidence, from one ``stated`` for another."""
    return half_width * interval_factor(confidence) / interval_factor(stated)


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value in ``unit`` (SI text) with its interval ``low`` to ``high`` at the stated ``confidence``.

    ``path`` is a dotted path in a parameter set, such as ``actuator.torque_constant``; a quantity that no set holds
    has a path of its own, which no set knows. An estimate that could not be made has NaN for value and interval.
    ``explanation`` is one sentence: what widens the interval, what the value trades against, or where it holds.
    ``recordings`` names each source with its hash: ``static.csv sha256:0123abcd...``.
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

    def __post_init__(self) -> None:
        if self.verdict not in _VERDICTS:
            raise IdentificationError(f"'{self.verdict}' is not a verdict; allowed are {', '.join(_VERDICTS)}")
        if not 0.0 < self.confidence < 1.0:
            raise IdentificationError(f"a confidence must lie between 0 and 1, not {self.confidence!r}")
        if self.is_usable and not (math.isfinite(self.value) and self.low <= self.value <= self.high):
            raise IdentificationError(
                f"{self.path}: a value called '{self.verdict}' must lie inside its interval, "
                f"not {self.value!r} in {self.low!r} to {self.high!r}"
            )

    @property
    def is_usable(self) -> bool:
        """Tell whether the value may be used in a parameter set."""
        return self.verdict in _USABLE

    @property
    def is_identified(self) -> bool:
        """Tell whether the recordings fix the value and the model explains them."""
        return self.verdict == "identified"

    @property
    def half_width(self) -> float:
        """Half the width of the interval, in ``unit``."""
        return (self.high - self.low) / 2.0

    @property
    def wider_half_width(self) -> float:
        """The width [unit] of the wider side of the interval: one that was cut at zero is too narrow there."""
        return max(self.high - self.value, self.value - self.low)
