"""From a fitted number to an estimate: what all of one procedure share, and how their intervals come about."""

import math
from dataclasses import dataclass, replace

from ppafo.identification.bench.result import verdict_of
from ppafo.identification.estimate import WORTH_TELLING, Estimate, Verdict

_ANY = -math.inf
_NOTHING = 1.0e-9
_CAPPED: Verdict = "holds for this model only"
_MISSED = "The law misses the readings by more than they scatter: another law of the same device has another value."


@dataclass(frozen=True, slots=True)
class Number:
    """A fitted number: where it belongs, its SI unit, half the width of its interval, what is to be said of it.

    ``scale`` stands in for the size of a value that may be zero; ``lowest`` is where its interval ends at the latest;
    ``widened`` is how much wider than the scatter's the interval is, because the law misses the readings. ``condition``
    says where the value holds, if the device has another one elsewhere.
    """

    path: str
    unit: str
    value: float
    half_width: float
    explanation: str
    scale: float | None = None
    lowest: float = _ANY
    widened: float = 1.0
    condition: str = ""


@dataclass(frozen=True, slots=True)
class Evidence:
    """Recordings, confidence of the intervals, and the relative uncertainty of the sensors' gain, same confidence [-].

    A gain that is wrong shows in no residual: it can only be told.
    """

    recordings: tuple[str, ...]
    confidence: float = 0.95
    calibration: float = 0.0

    def calibrated(self, number: Number) -> Estimate:
        """Return the estimate of a number to which a wrong gain would pass on, with the calibration in its interval."""
        return self.estimate(number, math.hypot(number.half_width, self.calibration * number.value))

    def plain(self, number: Number) -> Estimate:
        """Return the estimate of a number that no gain touches, such as a time constant."""
        return self.estimate(number, number.half_width)

    def at_or_above_zero(self, number: Number) -> Estimate:
        """Return the estimate of a number that the fit could not bring below zero, and whether it stopped there."""
        bounded = replace(number, lowest=0.0)
        if number.value > _NOTHING * (number.value + number.half_width):
            return self.plain(bounded)
        text = f"The fit would have it below zero, so it is held at zero. {number.explanation}"
        return self.estimate(replace(bounded, explanation=text), number.half_width, "at its bound")

    def estimate(self, number: Number, half_width: float, verdict: Verdict | None = None) -> Estimate:
        """Return the estimate of a number with an interval of a half width of its own, in its unit."""
        value, half = float(number.value), float(half_width)
        low, high = value - half, value + half
        is_missed = float(number.widened) >= WORTH_TELLING
        told = verdict or verdict_of(value, low, high, number.scale, is_missed or bool(number.condition))
        missed = f" {_MISSED}" if is_missed and told == _CAPPED else ""
        return Estimate(
            path=number.path,
            value=value,
            unit=number.unit,
            low=max(number.lowest, low),
            high=high,
            verdict=told,
            explanation=f"{number.explanation}{missed}",
            recordings=self.recordings,
            confidence=self.confidence,
            widened=float(number.widened),
            condition=number.condition,
        )

    @property
    def calibration_told(self) -> str:
        """What is to be said of the calibration, as the end of a sentence."""
        if self.calibration:
            return f"{self.calibration:.2%} for what all readings share are in it"
        return "calibration of the sensors is not in it"
