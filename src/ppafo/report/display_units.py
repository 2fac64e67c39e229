"""Conversion of quantities and metrics from SI to the display units set in ``units/shown.py``, for text and axes."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ppafo.metrics import Metric
from ppafo.units.shown import QUANTITIES, quantity_of_unit, shown_value, unit_of
from ppafo.wording import without_exponent

Floats = NDArray[np.float64]


_OF_GAS = {"kg": "gas mass", "kg/J": "gas mass per energy"}
"""Quantity of a metric by SI unit, where the unit alone is ambiguous: masses among the metrics are gas masses."""
_ON_AXES = {"psi_g": "psig", "psi_a": "psia", "mm^2": "mm$^2$", "cm^3": "cm$^3$", "degC": "°C"}
"""Forms of display units on the axes of figures, where these differ from the form in tables."""
_PRESSURE_KINDS = {"_g": " gauge", "_a": " absolute"}
"""Words for the suffixes of pressure units on the axes of figures."""
_METRIC = ".4g"
"""Number format of a metric."""


def si_unit(quantity: str) -> str:
    """Return the SI unit of a quantity as written in files; empty for a dimensionless number."""
    return QUANTITIES[quantity].si if quantity else ""


def display_unit(quantity: str) -> str:
    """Return the display unit of a quantity as written in a table; empty for a dimensionless number."""
    return unit_of(quantity).removesuffix("_d") if quantity else ""


def change_unit(quantity: str, given: str = "") -> str:
    """Return the display unit of a difference of two values of a quantity; empty for a dimensionless number."""
    unit = given or display_unit(quantity)
    # A difference of pressures is neither gauge nor absolute.
    return unit[:-2] if quantity == "pressure" and unit.endswith(("_g", "_a")) else unit


def axis_unit(quantity: str, given: str = "") -> str:
    """Return the display unit of a quantity for an axis label, with raised exponents."""
    unit = given.removesuffix("_d") or display_unit(quantity)
    if unit in _ON_AXES:
        return _ON_AXES[unit]
    if quantity == "pressure":
        unit = f"{unit[:-2]}{_PRESSURE_KINDS.get(unit[-2:], unit[-2:])}"
    return unit.replace("m^2", "m$^2$").replace("m^3", "m$^3$").replace("s^2", "s$^2$")


def display_value(value: float, quantity: str, atmosphere: float | None = None, unit: str = "") -> float:
    """Convert a value from SI to its display unit.

    Gauge pressure is relative to ``atmosphere`` [Pa absolute], by default of the active device (``units/shown.py``).

    A value that is zero within the accuracy of a run is shown as 0. ``unit`` replaces the display unit, for example by
    the unit of the user's input.
    """
    if quantity not in QUANTITIES or not math.isfinite(value):
        return float(value)
    units = QUANTITIES[quantity]
    return shown_value(value, units.si, unit or unit_of(quantity), atmosphere, units.zero)


def display_difference(value: float, quantity: str, unit: str = "") -> float:
    """Convert a difference of two values from SI to its display unit or to ``unit``."""
    # The zero of gauge pressures and of degrees Celsius falls out.
    return display_value(value, quantity, unit=unit) - display_value(0.0, quantity, unit=unit)


def display_values(values: Floats, quantity: str, atmosphere: float | None = None, unit: str = "") -> Floats:
    """Convert an array of values (any shape) from SI to the display unit or to ``unit``."""
    # Units are affine, so that two values decide all.
    zero, one = (display_value(number, quantity, atmosphere, unit) for number in (0.0, 1.0))
    return values if (zero, one) == (0.0, 1.0) else zero + (one - zero) * values


def metric_quantity(si_unit: str) -> str:
    """Return the quantity of a metric or channel by its SI unit; empty for a dimensionless number."""
    return _OF_GAS.get(si_unit) or quantity_of_unit(si_unit)


def metric_words(name: str) -> str:
    """Return the name of a metric in words, for example ``RMS error``."""
    words = name.replace("_", " ").replace("rms", "RMS")
    return words[:1].upper() + words[1:]


def metrics_lines(metrics: Mapping[str, Metric]) -> list[str]:
    """Return a line of text for each metric: name, value, display unit and meaning."""
    levels = [metric_level(metric.value, metric.unit) for metric in metrics.values()]
    values, units = [without_exponent(value, _METRIC) for value, _ in levels], [unit for _, unit in levels]
    name_width, value_width, unit_width = (max(map(len, texts), default=0) for texts in (metrics, values, units))
    return [
        f"{name:<{name_width}}  {value:>{value_width}} {unit:<{unit_width}}  {metric.summary}"
        for (name, metric), value, unit in zip(metrics.items(), values, units, strict=True)
    ]


def metric_text(value: float, si_unit: str) -> str:
    """Format the value of a metric or channel, given in SI, as number and display unit."""
    shown, unit = metric_level(value, si_unit)
    return f"{without_exponent(shown, _METRIC)} {unit}".rstrip()


def name_lines(metrics: Mapping[str, Metric]) -> list[str]:
    """Return a short line of text for each metric, for ``repr``: name, value and display unit."""
    width = max(map(len, metrics), default=0)
    return [f"  {name:<{width}}  {metric_text(metric.value, metric.unit)}" for name, metric in metrics.items()]


def metric_level(value: float, si_unit: str) -> tuple[float, str]:
    """Convert the value of a metric or channel from SI; returns number and display unit."""
    quantity = metric_quantity(si_unit)
    return display_value(value, quantity), display_unit(quantity) or si_unit.removeprefix("-")


def metric_change(value: float, si_unit: str) -> tuple[float, str]:
    """Convert a difference of two values of a metric or channel from SI; returns number and display unit."""
    quantity = metric_quantity(si_unit)
    # A difference of temperatures counts in kelvin.
    unit = {"degC": "K"}.get(change_unit(quantity), change_unit(quantity))
    return display_difference(value, quantity), unit or si_unit.removeprefix("-")
