"""Kind of a number: label, SI unit and number format, declared once for text, tables and axes, and its display unit."""

import math
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import ArrayLike

from ppafo.errors import ArgumentError
from ppafo.metrics import METRICS, Metric
from ppafo.parameters.graph import fixed_zero
from ppafo.signals.recording import Floats
from ppafo.units.shown import QUANTITIES, quantity_of_unit, shown_value, unit_of
from ppafo.wording import known_names, without_exponent

_OF_GAS = {"kg": "gas mass", "kg/J": "gas mass per energy"}
"""Quantity of a metric by SI unit, where the unit alone is ambiguous: masses among the metrics are gas masses."""
_ON_AXES = {"psi_g": "psig", "psi_a": "psia", "mm^2": "mm$^2$", "cm^3": "cm$^3$", "degC": "°C"}
"""Forms of display units on the axes of figures, where these differ from the form in tables."""
_PRESSURE_KINDS = {"_g": " gauge", "_a": " absolute", "_d": ""}
"""Words for the suffixes of pressure units on the axes of figures."""
_PREFIXES = {"sensors": "Sensors: ", "supply_line": "Line: "}
REFERENCE_LEVELS = {"reference.level": "to hold", "reference.start_level": "before the ramp"}
"""Labels of reference settings after the name of the controlled quantity, as in "Torque before the ramp"."""
_METRIC = ".4g"
"""Number format of a metric."""
_FORM = re.compile(r"[-+]?\d*(\.\d+)?[efgd]")
"""Pattern of a number format, which somebody may give as the quantity."""
YES_OR_NO = "; 1: yes, 0: no"
"""Remark in the label of a number that answers a question; a mean of several runs lies between."""
_MORE_DIGITS = 3
"""Largest number of digits added to tell the limits of an interval apart."""
_LONG = 120.0
"""Duration [s] above which durations and time axes are in minutes."""


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
        if self.given or self.quantity:
            return self.given or unit_of(self.quantity)
        return self.unit.removeprefix("-")

    @property
    def shown_change_unit(self) -> str:
        """Display unit of a difference of two values."""
        unit = self.given if self.given and self.quantity else self.shown_unit
        # No text to paste: a difference of pressures is neither gauge nor absolute.
        return unit[:-2] if unit.endswith(("_g", "_a", "_d")) else unit

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
        """Display unit in the form for an axis, with raised exponents; empty for a dimensionless number."""
        unit = self.shown_unit
        if not self.quantity or unit in _ON_AXES:
            return _ON_AXES[unit] if self.quantity else "" if unit == "1" else unit
        if unit[-2:] in _PRESSURE_KINDS:
            unit = f"{unit[:-2]}{_PRESSURE_KINDS[unit[-2:]]}"
        return "" if unit == "1" else unit.replace("m^2", "m$^2$").replace("m^3", "m$^3$").replace("s^2", "s$^2$")

    def shown(self, value: float) -> float:
        """Return a value given in SI in the display unit; one that is zero within the accuracy of a run is 0."""
        if not self.quantity or not math.isfinite(value):
            return float(value)
        units = QUANTITIES[self.quantity]
        return shown_value(value, units.si, self.given or unit_of(self.quantity), self.zero, units.zero)

    def shown_change(self, value: float) -> float:
        """Return a difference of two values, given in SI, in the display unit."""
        # The zero of gauge pressures and of degrees Celsius falls out.
        level = replace(self, zero=None)
        return level.shown(value) - level.shown(0.0)

    def values(self, values: ArrayLike) -> Floats:
        """Return values given in SI in the display unit."""
        # Units are affine, so that two values decide all.
        zero, one = (self.shown(number) for number in (0.0, 1.0))
        given = np.asarray(values, dtype=np.float64)
        return given if (zero, one) == (0.0, 1.0) else zero + (one - zero) * given

    def number(self, value: float, form: str = "") -> str:
        """Return a value given in SI as text in the display unit, without the unit."""
        return without_exponent(self.shown(value), form or self.form)

    def text(self, value: float, form: str = "") -> str:
        """Return a value given in SI as text in the display unit, with the unit."""
        return f"{self.number(value, form)} {self.shown_unit}".rstrip()

    def change(self, value: float, form: str = ".3g") -> str:
        """Return a difference of two values, given in SI, as text in the display unit, with the unit."""
        return f"{self.change_number(value, form)} {self.shown_change_unit}".rstrip()

    def change_number(self, value: float, form: str = ".3g") -> str:
        """Return a difference of two values, given in SI, as text in the display unit, without the unit."""
        return without_exponent(self.shown_change(value), form)

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


PLAIN = Kind()
"""Kind of dimensionless numbers, and of texts."""
TIME = Kind("Time", "s", "time")


def of_metric(name: str, form: str = ".4g") -> Kind:
    """Return the kind of a metric, from the catalogue of metrics."""
    return of_stored_metric(name, METRICS[name].unit, form)


def of_stored_metric(name: str, unit: str, form: str = ".4g") -> Kind:
    """Return the kind of a stored metric from its name and SI unit, also for a metric that is no longer defined."""
    return Kind(metric_words(name), unit, metric_quantity(unit), form)


@cache
def setting_names() -> dict[str, str]:
    """Return the display names of settings by path; most settings have none."""
    return tomllib.loads(files("ppafo.report").joinpath("setting_names.toml").read_text(encoding="utf-8"))


def label_of(path: str, controlled: str = "torque") -> str:
    """Return the display name of a setting; the default is the last part of its path.

    ``controlled`` names the quantity that a reference prescribes, in words.
    """
    if path in REFERENCE_LEVELS:
        return f"{controlled[:1].upper()}{controlled[1:]} {REFERENCE_LEVELS[path]}"
    group, _, name = path.rpartition(".")
    said = name.replace("_", " ")
    prefix = _PREFIXES.get(group.partition(".")[0], "")
    return setting_names().get(path, f"{prefix}{said}" if prefix else said[:1].upper() + said[1:])


def of_path(path: str, unit: str, form: str = ".6g", given: str = "") -> Kind:
    """Return the kind of the number at a path, from its SI unit and the unit of the user's input, if any."""
    quantity = quantity_of_unit(unit)
    return Kind(label_of(path), unit, quantity, form, fixed_zero(path), given if quantity else "")


def duration_kind(longest: float) -> Kind:
    """Return the kind of durations up to the longest [s]: in seconds, or in minutes above two minutes."""
    return Kind("Time", "s", "duration") if longest > _LONG else TIME


def metric_quantity(si_unit: str) -> str:
    """Return the quantity of a metric or channel by its SI unit; empty for a dimensionless number."""
    return _OF_GAS.get(si_unit) or quantity_of_unit(si_unit)


def metric_words(name: str) -> str:
    """Return the name of a metric in words, for example ``RMS error``."""
    words = name.replace("_", " ").replace("rms", "RMS")
    return words[:1].upper() + words[1:]


def metric_level(value: float, si_unit: str) -> tuple[float, str]:
    """Convert the value of a metric or channel from SI; returns number and display unit."""
    kind = of_stored_metric("", si_unit)
    return kind.shown(value), kind.shown_unit or si_unit.removeprefix("-")


def metric_change(value: float, si_unit: str) -> tuple[float, str]:
    """Convert a difference of two values of a metric or channel from SI; returns number and display unit."""
    kind = of_stored_metric("", si_unit)
    # A difference of temperatures counts in kelvin.
    unit = {"degC": "K"}.get(kind.shown_change_unit, kind.shown_change_unit)
    return kind.shown_change(value), unit or si_unit.removeprefix("-")


def metric_text(value: float, si_unit: str) -> str:
    """Format the value of a metric or channel, given in SI, as number and display unit."""
    return of_stored_metric("", si_unit).text(value)


def metrics_lines(metrics: Mapping[str, Metric]) -> list[str]:
    """Return a line of text for each metric: name, value, display unit and meaning."""
    levels = [metric_level(metric.value, metric.unit) for metric in metrics.values()]
    values = [without_exponent(value, _METRIC) for value, _ in levels]
    units = [unit for _, unit in levels]
    name_width, value_width, unit_width = (max(map(len, texts), default=0) for texts in (metrics, values, units))
    return [
        f"{name:<{name_width}}  {value:>{value_width}} {unit:<{unit_width}}  {metric.summary}"
        for (name, metric), value, unit in zip(metrics.items(), values, units, strict=True)
    ]


def name_lines(metrics: Mapping[str, Metric]) -> list[str]:
    """Return a short line of text for each metric, for ``repr``: name, value and display unit."""
    width = max(map(len, metrics), default=0)
    return [f"  {name:<{width}}  {metric_text(metric.value, metric.unit)}" for name, metric in metrics.items()]
