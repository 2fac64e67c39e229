"""Kind of a number: label, SI unit and number format, declared once for text, tables and axes."""

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ppafo.errors import ArgumentError
from ppafo.metrics import METRICS
from ppafo.parameters.graph import fixed_zero
from ppafo.report.display_units import (
    axis_unit,
    change_unit,
    display_difference,
    display_unit,
    display_value,
    display_values,
    metric_quantity,
    metric_words,
)
from ppafo.report.setting_names import label_of
from ppafo.signals.recording import Floats
from ppafo.units.shown import QUANTITIES, quantity_of_unit
from ppafo.wording import known_names, without_exponent

_FORM = re.compile(r"[-+]?\d*(\.\d+)?[efgd]")
"""Pattern of a number format, which somebody may give as the quantity."""
YES_OR_NO = "; 1: yes, 0: no"
"""Remark in the label of a number that answers a question; a mean of several runs lies between."""


@dataclass(frozen=True, slots=True)
class ConfidenceInterval:
    """Estimate with the limits of its confidence interval, all in the same unit; a limit may be infinite."""

    value: float
    low: float
    high: float

    @property
    def width(self) -> float:
        """Width of the confidence interval, in the unit of the estimate."""
        return self.high - self.low


@dataclass(frozen=True, slots=True)
class Kind:
    """Kind of a number: label, SI unit, quantity (of ``QUANTITIES``, else shown in SI), and number format.

    ``zero`` [Pa absolute] is the reference of gauge pressures, None for the atmosphere of the device. ``given`` is the
    unit of the user's input, which replaces the display unit.
    """

    words: str = ""
    unit: str = ""
    quantity: str = ""
    form: str = ".4g"
    zero: float | None = None
    given: str = ""

    def __post_init__(self) -> None:
        """Raise ArgumentError for an unknown quantity, such as a format in its place."""
        if self.quantity and self.quantity not in QUANTITIES:
            is_form = _FORM.fullmatch(self.quantity) is not None
            hint = f"; give the format as form={self.quantity!r}" if is_form else known_names(self.quantity, QUANTITIES)
            raise ArgumentError(f"Kind({self.words!r}): there is no quantity {self.quantity!r}{hint}")

    @property
    def shown_unit(self) -> str:
        """Display unit; empty for a dimensionless number."""
        if self.given:
            return self.given.removesuffix("_d")
        return display_unit(self.quantity) if self.quantity else self.unit.removeprefix("-")

    @property
    def shown_change_unit(self) -> str:
        """Display unit of a difference of two values."""
        return change_unit(self.quantity, self.given) if self.quantity else self.shown_unit

    @property
    def title(self) -> str:
        """Label with unit, for a table."""
        return f"{self.words} ({self.shown_unit})" if self.shown_unit else self.words

    @property
    def axis(self) -> str:
        """Label with unit, for an axis; a remark in the label, after a semicolon, stands behind the unit."""
        words, semicolon, remark = self.words.partition(";")
        return f"{words} ({self.axis_unit}){semicolon}{remark}" if self.axis_unit else self.words

    @property
    def axis_unit(self) -> str:
        """Display unit in the form for an axis; empty for a dimensionless number."""
        unit = axis_unit(self.quantity, self.given) if self.quantity else self.shown_unit
        return "" if unit == "1" else unit

    def values(self, values: ArrayLike) -> Floats:
        """Return values given in SI in the display unit."""
        return display_values(np.asarray(values, dtype=np.float64), self.quantity, self.zero, self.given)

    def number(self, value: float, form: str = "") -> str:
        """Return a value given in SI as text in the display unit, without the unit."""
        return without_exponent(display_value(value, self.quantity, self.zero, self.given), form or self.form)

    def text(self, value: float, form: str = "") -> str:
        """Return a value given in SI as text in the display unit, with the unit."""
        return f"{self.number(value, form)} {self.shown_unit}".rstrip()

    def change(self, value: float, form: str = ".3g") -> str:
        """Return a difference of two values, given in SI, as text in the display unit, with the unit."""
        return f"{self.change_number(value, form)} {self.shown_change_unit}".rstrip()

    def change_number(self, value: float, form: str = ".3g") -> str:
        """Return a difference of two values, given in SI, as text in the display unit, without the unit."""
        return without_exponent(display_difference(value, self.quantity, self.given), form)

    def interval(self, interval: ConfidenceInterval) -> str:
        """Return an estimate with the limits of its confidence interval, given in SI, as text without unit."""
        return _interval_text(interval, self.form, self.number)

    def change_interval(self, interval: ConfidenceInterval) -> str:
        """Return a difference with the limits of its confidence interval, given in SI, as text without unit."""
        return _interval_text(interval, self.form, self.change_number)


def _interval_text(interval: ConfidenceInterval, form: str, number: Callable[[float, str], str]) -> str:
    """Return an estimate and its limits in as many digits, up to three more than ``form``, as tell these apart."""
    ends = (interval.value, interval.low, interval.high)
    for more in range(_MORE_DIGITS + 1):
        finer = re.sub(r"\d+", lambda digits, more=more: str(int(digits[0]) + more), form)  # type: ignore[misc]
        value, low, high = (number(each, finer) for each in ends)
        if len({value, low, high}) == len({*ends}):
            break
    return f"{value} [{low}, {high}]"


_MORE_DIGITS = 3
"""Largest number of digits added to tell the limits of an interval apart."""
PLAIN = Kind()
"""Kind of dimensionless numbers, and of texts."""
TIME = Kind("Time", "s", "time")
_LONG = 120.0
"""Duration [s] above which durations and time axes are in minutes."""


def of_metric(name: str, form: str = ".4g") -> Kind:
    """Return the kind of a metric, from the catalogue of metrics."""
    return of_stored_metric(name, METRICS[name].unit, form)


def of_stored_metric(name: str, unit: str, form: str = ".4g") -> Kind:
    """Return the kind of a stored metric from its name and SI unit, also for a metric that is no longer defined."""
    return Kind(metric_words(name), unit, metric_quantity(unit), form)


def of_path(path: str, unit: str, form: str = ".6g", given: str = "") -> Kind:
    """Return the kind of the number at a path, from its SI unit and the unit of the user's input, if any."""
    quantity = quantity_of_unit(unit)
    return Kind(label_of(path), unit, quantity, form, fixed_zero(path), given if quantity else "")


def duration_kind(longest: float) -> Kind:
    """Return the kind of durations up to the longest [s]: in seconds, or in minutes above two minutes."""
    return Kind("Time", "s", "duration") if longest > _LONG else TIME
