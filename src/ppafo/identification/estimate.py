"""An estimate, one value of a parameter set with interval and verdict, and what is checked before and after a fit."""

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import Literal, get_args

from ppafo.errors import IdentificationError

Verdict = Literal[
    "identified",
    "holds for this model only",
    "weak",
    "upper bound",
    "not identifiable",
    "at its bound",
    "law does not describe the data",
    "within its tolerance",
    "beyond its tolerance",
]
"""What the recordings say about a value.

Only the first is given where the model explains the recordings. The first three are fit to be used in a parameter set,
the second and the third as fitted values that nobody should take for the device's own.
"""

BENCH_VERDICTS: tuple[Verdict, ...] = ("within its tolerance", "beyond its tolerance")
"""Of what a bench knows up to a tolerance, which is no value of a device."""

_VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
_USABLE: tuple[Verdict, ...] = ("identified", "holds for this model only", "weak")

WORTH_TELLING = 1.05
"""Widening of an interval from which the law is reported to miss the recordings."""


def interval_factor(confidence: float) -> float:
    """Return the standard errors [-] on each side of an interval with this confidence, 1.96 for 95 %."""
    return NormalDist().inv_cdf(0.5 + 0.5 * confidence)


def limit_for(chance: float) -> float:
    """Return the standard errors [-] that normal noise exceeds, on either side, with this chance."""
    return -NormalDist().inv_cdf(0.5 * chance)


def half_width_for(confidence: float, half_width: float, stated: float) -> float:
    """Return half the width of an interval for some confidence, from that of one ``stated`` for another."""
    return half_width * interval_factor(confidence) / interval_factor(stated)


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value in ``unit`` (SI text) with its interval ``low`` to ``high`` at the stated ``confidence``.

    ``path`` is a dotted path in a parameter set, such as ``actuator.torque_constant``; a quantity that no set holds
    has a path of its own, which no set knows. An estimate that could not be made has NaN for value and interval.
    ``explanation`` is one or two sentences: residual check, what the value trades against, what is assumed.
    ``recordings`` names each source with its hash: ``static.csv sha256:0123abcd...``.
    ``widened`` is how many times as wide the interval is as the scatter alone would have it; 1 where the law describes
    the recordings to within their scatter. ``condition`` says where the value holds, ``at 430 kPa``, if not everywhere;
    where it says what must not be, ``beside`` is the interval [unit] without that.
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
    widened: float = 1.0
    condition: str = ""
    beside: tuple[float, float] | None = None

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
        """Whether the value may be used in a parameter set."""
        return self.verdict in _USABLE

    @property
    def is_identified(self) -> bool:
        """Whether the recordings fix the value and the model explains them: only such a value counts as identified."""
        return self.verdict == "identified"

    @property
    def verdict_in_words(self) -> str:
        """What ``verdict_with`` returns with the interval beside in ``unit``."""
        low, high = self.beside or (math.nan, math.nan)
        return self.verdict_with(f"{low:.6g} to {high:.6g} {self.unit}".removesuffix(" -").rstrip())

    def verdict_with(self, beside: str) -> str:
        """Return the verdict, where it holds, and how much wider the interval is where the law misses the recordings.

        ``beside`` is the interval that stands beside, as it shall be written; it is left out where there is none.
        """
        description = f"{self.verdict}, {self.condition}" if self.condition else self.verdict
        if self.beside is not None:
            description = f"{description} (else {beside})"
        if self.is_usable and self.widened >= WORTH_TELLING:
            return f"{description}, widened {self.widened:.3g} times (lack of fit)"
        return description

    @property
    def half_width(self) -> float:
        """Half the width of the interval, in ``unit``."""
        return (self.high - self.low) / 2.0

    @property
    def wider_half_width(self) -> float:
        """The width [unit] of the wider side of the interval: one that was cut at zero is too narrow there."""
        return max(self.high - self.value, self.value - self.low)

    @property
    def relative_half_width(self) -> float:
        """Half the width of the interval over the size of the value [-]; infinite where the value is zero."""
        return self.half_width / abs(self.value) if self.value else math.inf


@dataclass(frozen=True, slots=True)
class Check:
    """A question that the residuals answer: its name, whether the answer is good, and the answer in words."""

    name: str
    holds: bool
    statement: str


@dataclass(frozen=True, slots=True)
class Prospect:
    """What recordings can give or cannot, known before anything is fitted: its name, whether, and why in words."""

    name: str
    can_be_had: bool
    statement: str
