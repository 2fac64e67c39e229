"""Estimate: value of a device parameter with confidence interval, verdict and an explanation in one sentence."""

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import Literal, get_args

from ppafo.errors import IdentificationError

Verdict = Literal["identified", "holds for this model only", "not identifiable", "at its bound"]
"""Verdict of the recordings on a value.

A value is "identified" only if the model explains the recordings. A value that "holds for this model only" is written
into a set with the origin ``fitted``, and is not to be taken as a property of the device.
"""

_VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
_USABLE: tuple[Verdict, ...] = ("identified", "holds for this model only")


def interval_factor(confidence: float) -> float:
    """Return the half-width of a confidence interval in standard errors [-], 1.96 for a confidence of 95 %."""
    return NormalDist().inv_cdf(0.5 + 0.5 * confidence)


@dataclass(frozen=True, slots=True)
class Estimate:
    """Value in ``unit`` (SI text) with its confidence interval ``low`` to ``high`` at the stated ``confidence``.

    ``path`` is a dotted path in a parameter set, such as ``actuator.torque_constant``; a quantity without an entry in
    sets has a path of its own. An estimate that could not be made has NaN for value and interval. ``explanation`` is
    one sentence: the sources of the uncertainty, the quantities that the value trades off against, or the limits of its
    validity. ``recordings`` names each source with its hash: ``static.csv sha256:0123abcd...``.
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
        """True if the value may be used in a parameter set."""
        return self.verdict in _USABLE

    @property
    def is_identified(self) -> bool:
        """True if the recordings determine the value and the model explains the recordings."""
        return self.verdict == "identified"

    @property
    def half_width(self) -> float:
        """Half-width of the confidence interval [``unit``]."""
        return (self.high - self.low) / 2.0

    @property
    def wider_half_width(self) -> float:
        """Width [``unit``] of the wider side of the interval; a side cut off at zero is too narrow."""
        return max(self.high - self.value, self.value - self.low)
