"""An estimate: one value of a parameter set, with its interval and a verdict in words."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

from ppafo.errors import IdentificationError

Verdict = Literal["identified", "weak", "not identifiable", "at its bound", "law does not describe the data"]
"""What the recordings say about a value; only the first two are fit to be written into a parameter set."""

_VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
_USABLE: tuple[Verdict, ...] = ("identified", "weak")
_WORTH_TELLING = 1.05


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value in ``unit`` (SI text) with its interval ``low`` to ``high`` at the stated ``confidence``.

    ``path`` is a dotted path in a parameter set, such as ``actuator.torque_constant``; a quantity that no set holds
    has a path of its own, which no set knows. An estimate that could not be made has NaN for value and interval.
    ``explanation`` is one or two sentences: residual check, what the value trades against, what is assumed.
    ``recordings`` names each source with its hash: ``static.csv sha256:0123abcd...``.
    ``widened`` is how many times as wide the interval is as the scatter alone would have it; 1 where the law describes
    the recordings to within their scatter.
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

    def __post_init__(self) -> None:
        if self.verdict not in _VERDICTS:
            raise IdentificationError(f"'{self.verdict}' is not a verdict; allowed are {', '.join(_VERDICTS)}")
        if not 0.0 < self.confidence < 1.0:
            raise IdentificationError(f"a confidence lies between 0 and 1, not {self.confidence!r}")
        if self.is_usable and not (math.isfinite(self.value) and self.low <= self.value <= self.high):
            raise IdentificationError(
                f"{self.path}: a value called '{self.verdict}' lies inside its interval, "
                f"not {self.value!r} in {self.low!r} to {self.high!r}"
            )

    @property
    def is_usable(self) -> bool:
        """Whether the value may be written into a parameter set."""
        return self.verdict in _USABLE

    @property
    def verdict_in_words(self) -> str:
        """The verdict, and by how much the interval was widened where the law misses the recordings."""
        if self.is_usable and self.widened >= _WORTH_TELLING:
            return f"{self.verdict}, widened {self.widened:.3g} times (lack of fit)"
        return self.verdict

    @property
    def half_width(self) -> float:
        """Half the width of the interval, in ``unit``."""
        return (self.high - self.low) / 2.0

    @property
    def relative_half_width(self) -> float:
        """Half the width of the interval over the size of the value [-]; infinite where the value is zero."""
        return self.half_width / abs(self.value) if self.value else math.inf
