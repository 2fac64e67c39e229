"""Estimate: value of a device parameter with confidence interval, verdict and an explanation in one sentence."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import TYPE_CHECKING, Literal

from ppafo.units import split_pressure_kind
from ppafo.units.shown import shown_unit, shown_value
from ppafo.wording import percentage, without_exponent

if TYPE_CHECKING:
    from ppafo.signals import RecordingKind

# Fraction of an error [-] that is rounding, and least distance of an end from its value that sets digits [values].
_NOTHING = 1.0e-6
_NEAREST = 0.05
NAMED = 2
"""Number of parts of a variance that are named, the largest ones: a least share would hide one that is near it."""
Verdict = Literal["identified", "holds for this model only", "not identifiable", "at its bound", "unit probably wrong"]
"""Verdict on an estimated value, which is "identified" only if the model explains the recordings.

One that "holds for this model only" is written into a set with the origin ``fitted``: no property of the device.
"""
WRONG_UNIT: Verdict = "unit probably wrong"
"""Verdict where the recordings do better in another unit of pressure; the value is not used in a set."""
_USABLE: tuple[Verdict, ...] = ("identified", "holds for this model only")
UNKNOWN = 0.995
"""Relative half-width of the confidence interval [-] from which a value is not identifiable, +-100 % when rounded: it
then contains zero or twice the value."""
_WIDE = 0.1
"""Relative half-width of the confidence interval [-] above which the verdict states the half-width."""


def in_shown_unit(number: float, unit: str, stated: str = "") -> tuple[float, str]:
    """Return number and unit for display: in the unit ``stated`` in the file, or else in the display unit.

    A pressure stated as gauge is shown absolute, as it is stored.
    """
    si_unit = "Pa_d" if unit == "Pa" else unit
    shown = f"{split_pressure_kind(stated)[0]}_d" if stated and si_unit == "Pa_d" else stated or shown_unit(si_unit)
    return shown_value(float(number), si_unit, shown), shown.removesuffix("_d")


def shown_text(number: float, unit: str, stated: str = "", digits: int = 6) -> str:
    """Return a number with its unit as text, to ``digits`` significant digits, in the unit of ``in_shown_unit``."""
    shown, name = in_shown_unit(number, unit, stated)
    return f"{shown:.{digits}g} {name}".rstrip(" -")


def digits_of(number: float, error: float) -> str:
    """Return a number rounded to two significant digits of an error, ``9.77`` for 9.7701 and an error of 0.22.

    A number that would become 0 keeps two digits of its own, unless it is rounding beside the error.
    """
    if not (math.isfinite(number) and math.isfinite(error) and error > 0.0):
        return f"{number:.4g}"
    if abs(number) <= _NOTHING * error:
        return "0"
    digits = 2 + math.floor(math.log10(abs(number))) - math.floor(math.log10(error))
    return without_exponent(number, f"#.{max(digits, 2)}g").removesuffix(".")


def interval_texts(value: float, low: float, high: float) -> tuple[str, str, str]:
    """Return a value and the ends of its interval as text, each end by its own distance from the value.

    The value has two significant digits of the nearer end, but of 5 % of itself where a bound is nearer.
    """
    below = value - low
    above = high - value
    error = max(min(below, above), min(_NEAREST * abs(value), max(below, above)))
    return digits_of(value, error), digits_of(low, max(below, error)), digits_of(high, max(above, error))


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
    sets has a path of its own. ``explanation`` is one sentence: the sources of the uncertainty, the quantities that the
    value trades off against, or the limits of its validity. ``recordings`` names each source with its hash:
    ``static.csv sha256:0123abcd...``. ``size`` is a typical magnitude [``unit``] of a quantity that may be zero, such
    as the zero of a sensor. ``beside`` are numbers without unit that a set needs with the value, by path, such as the
    command of a node of a table.
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
    beside: Mapping[str, float] = field(default_factory=dict)

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
    def wider_half_width(self) -> float:
        """Width [``unit``] of the wider side of the interval; a side cut off at zero is too narrow."""
        return max(self.high - self.value, self.value - self.low)


@dataclass(frozen=True, slots=True)
class Identified:
    """Result of a bench procedure or of the trajectory fit, named in a report by ``procedure`` and ``summary``.

    ``kind``: origin of the recordings, which figures state unless measured. ``conflict``: sentence on readings that the
    model does not explain, empty if it explains all. ``remarks``: sentences for a report, of which the ``faults``, on
    the result as a whole, prevent a pass.
    """

    procedure: str
    summary: str
    estimates: tuple[Estimate, ...]
    kind: "RecordingKind"
    conflict: str = ""
    remarks: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()

    @property
    def is_good(self) -> bool:
        """True if the recordings agree with the model and each other, and no unit is probably wrong."""
        wrong_unit = any(estimate.verdict == WRONG_UNIT for estimate in self.estimates)
        return not (self.conflict or self.faults or wrong_unit)

    def __getitem__(self, path: str) -> Estimate:
        """Return the estimate at a path. Raises KeyError if there is none."""
        return {estimate.path: estimate for estimate in self.estimates}[path]
