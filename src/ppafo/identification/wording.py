"""Text on fit results: values in display units and digits, sources of uncertainty, conflicting readings."""

import math

from ppafo.identification.fit import SHAPE, SMOOTH, STATED, Fit
from ppafo.units import split_pressure_kind
from ppafo.units.shown import shown_unit, shown_value
from ppafo.wording import percentage

_DIFFERENCES = {"Pa": "Pa_d"}
"""Unit of a difference by SI unit."""
_SMALLEST, _LARGEST = 1.0e-2, 1.0e5
"""Range of magnitudes written without a power of ten."""
_NOTHING, _NEAREST = 1.0e-6, 0.05
"""Fraction of an error [-] that is rounding, and least distance of an end from its value that sets digits [values]."""
_SEVERAL = {"readings", "commands"}
"""Last words of group names that are plural."""
NAMED = 2
"""Number of parts of a variance that are named, the largest ones: a least share would hide one that is near it."""


def in_shown_unit(number: float, unit: str, stated: str = "") -> tuple[float, str]:
    """Return number and unit for display: in the unit ``stated`` in the file, or else in the display unit.

    A pressure stated as gauge is shown absolute, as it is stored.
    """
    si_unit = _DIFFERENCES.get(unit, unit)
    shown = stated or shown_unit(si_unit)
    if stated and si_unit == "Pa_d":
        shown = f"{split_pressure_kind(stated)[0]}_d"
    return shown_value(float(number), si_unit, shown), shown.removesuffix("_d")


def with_error(value: float, error: float) -> str:
    """Return a value with its standard error, ``480.5 +- 6.9``: two significant digits of the error, value to match."""
    if not (math.isfinite(value) and math.isfinite(error) and error > 0.0):
        return f"{value:.4g} +- {error:.2g}"
    size = max(abs(value), error)
    power = 0 if _SMALLEST <= size < _LARGEST else math.floor(math.log10(size))
    scaled, scaled_error = value / 10.0**power, error / 10.0**power
    digits = max(0, 1 - math.floor(math.log10(scaled_error)))
    # A zero that was rounded from below has no sign.
    text = f"{round(scaled, digits) + 0.0:.{digits}f} +- {scaled_error:.{digits}f}"
    return f"({text})e{power:+03d}" if power else text


def digits_of(number: float, error: float) -> str:
    """Return a number rounded to two significant digits of an error, ``9.77`` for 9.7701 and an error of 0.22.

    A number that would become 0 keeps two digits of its own, unless it is rounding beside the error.
    """
    if not (math.isfinite(number) and math.isfinite(error) and error > 0.0):
        return f"{number:.4g}"
    if abs(number) <= _NOTHING * error:
        return "0"
    decimals = 1 - math.floor(math.log10(error))
    if round(number, decimals) == 0.0:
        return f"{number:.2g}"
    if _SMALLEST <= max(abs(number), error) < _LARGEST:
        return f"{round(number, decimals):.{max(decimals, 0)}f}"
    return f"{number:.{max(math.floor(math.log10(abs(number))) + decimals, 1)}e}"


def interval_texts(value: float, low: float, high: float) -> tuple[str, str, str]:
    """Return a value and the ends of its interval as text, each end by its own distance from the value.

    The value has two significant digits of the nearer end, but of 5 % of itself where a bound is nearer.
    """
    below, above = value - low, high - value
    error = max(min(below, above), min(_NEAREST * abs(value), max(below, above)))
    return digits_of(value, error), digits_of(low, max(below, error)), digits_of(high, max(above, error))


def widened_by(fitted: Fit, name: str) -> str:
    """Return a phrase on the largest parts of the variance of a variable, of tolerances and of the scatter."""
    scatter = 1.0 - sum(share for _, share in fitted.shares[name])
    parts = [("the scatter of the readings", scatter), *(part for part in fitted.shares[name] if part[0] != name)]
    # Of parts that are shown as equal, such as those of both chambers, the name decides.
    parts.sort(key=lambda part: (-float(f"{part[1]:.2g}"), part[0]))
    return f"variance from {', '.join(f'{part} ({percentage(share, 2)})' for part, share in parts[:NAMED])}"


def conflict_in_words(fitted: Fit, remedy: str) -> str:
    """Return a sentence on the readings that contradict the others, with a remedy; empty if all agree."""
    conflict = fitted.conflict
    if conflict is None:
        return ""
    errors = conflict.standard_errors
    if conflict.group == STATED:
        return f"{conflict.number} is {errors:.1f} standard errors beyond its stated limit; {remedy}"
    if conflict.number == SMOOTH:
        return f"the residual of {conflict.group} is {errors:.0f} times its noise and too smooth to be noise; {remedy}"
    if conflict.number == SHAPE:
        return (
            f"the residuals of {conflict.group} have a shape that the law has not, by {errors:.1f} standard errors; "
            f"{remedy}"
        )
    give = "give" if _SEVERAL & set(conflict.group.split()) else "gives"
    return (
        f"{conflict.group}, fitted alone, {give} different values: {conflict.number} by {errors:.1f} standard "
        f"errors; {remedy}"
    )
