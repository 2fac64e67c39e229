"""Quantities and metrics as people are shown them, in the units of ``units/shown.py``; files and data stay in SI."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ppafo.metrics import Metric
from ppafo.units import without_exponent
from ppafo.units.shown import QUANTITIES, quantity_of_unit, shown_value, unit_of

Floats = NDArray[np.float64]


_OF_GAS = {"kg": "gas mass", "kg/J": "gas mass per energy"}
"""Kind of quantity of a metric by its unit in SI: masses among the metrics are masses of gas."""
_ON_AXES = {"psi_g": "psig", "psi_a": "psia", "mm^2": "mm$^2$", "cm^3": "cm$^3$", "degC": "°C"}
"""Units that an axis writes in a form of their own."""
_PRESSURE_KINDS = {"_g": " gauge", "_a": " absolute"}
"""Words on an axis for the ending of a pressure unit."""
_METRIC = ".4g"
"""Digits of a metric."""


def si_unit(quantity: str) -> str:
    """Return the unit in SI of a quantity, as files write it; empty for a plain number."""
    return QUANTITIES[quantity].si if quantity else ""


def display_unit(quantity: str) -> str:
    """Return the unit in which a quantity is shown, as a table writes it; empty for a plain number."""
    return unit_of(quantity).removesuffix("_d") if quantity else ""


def change_unit(quantity: str, given: str = "") -> str:
    """Return the unit in which a difference of two values is shown; empty for a plain number."""
    unit = given or display_unit(quantity)
    # A difference of pressures is neither gauge nor absolute.
    return unit[:-2] if quantity == "pressure" and unit.endswith(("_g", "_a")) else unit


def axis_unit(quantity: str, given: str = "") -> str:
    """Return the unit in which a quantity is shown, as the label of an axis writes it: with raised exponents."""
    unit = given.removesuffix("_d") or display_unit(quantity)
    if unit in _ON_AXES:
        return _ON_AXES[unit]
    if quantity == "pressure":
        unit = f"{unit[:-2]}{_PRESSURE_KINDS.get(unit[-2:], unit[-2:])}"
    return unit.replace("m^2", "m$^2$").replace("m^3", "m$^3$").replace("s^2", "s$^2$")


def display_value(value: float, quantity: str, atmosphere: float | None = None, unit: str = "") -> float:
    """Return a value in SI in the unit in which it is shown.

    Gauge counts from ``atmosphere`` [Pa absolute], of the device in force unless given (``units/shown.py``).

    What is zero within the accuracy of a run is 0. ``unit`` is the one in which it was given, where that is known.
    """
    if quantity not in QUANTITIES or not math.isfinite(value):
        return float(value)
    units = QUANTITIES[quantity]
    return shown_value(value, units.si, unit or unit_of(quantity), atmosphere, units.zero)


def display_difference(value: float, quantity: str, unit: str = "") -> float:
    """Return a difference of two values in SI in the unit in which it is shown, or was given."""
    # The zero of gauge pressures and of degrees Celsius falls out.
    return display_value(value, quantity, unit=unit) - display_value(0.0, quantity, unit=unit)


def display_values(values: Floats, quantity: str, atmosphere: float | None = None, unit: str = "") -> Floats:
    """Return values in SI (any shape) in the unit in which they are shown, or were given."""
    # Units are affine, so that two values decide all.
    zero, one = (display_value(number, quantity, atmosphere, unit) for number in (0.0, 1.0))
    return values if (zero, one) == (0.0, 1.0) else zero + (one - zero) * values


def quantity_text(value: float, quantity: str, form: str = ".3g") -> str:
    """Return a value in SI as text with the unit in which it is shown."""
    return f"{without_exponent(display_value(value, quantity), form)} {display_unit(quantity)}".rstrip()


def metric_quantity(si_unit: str) -> str:
    """Return the kind of quantity of a metric or channel that has a unit in SI, empty for a plain number."""
    return _OF_GAS.get(si_unit) or quantity_of_unit(si_unit)


def metric_words(name: str) -> str:
    """Return the name of a metric in words: ``RMS error``."""
    words = name.replace("_", " ").replace("rms", "RMS")
    return words[:1].upper() + words[1:]


def metrics_lines(metrics: Mapping[str, Metric]) -> list[str]:
    """Return a line of text for each metric: name, value and unit as people are shown it, meaning."""
    levels = [metric_level(metric.value, metric.unit) for metric in metrics.values()]
    values, units = [without_exponent(value, _METRIC) for value, _ in levels], [unit for _, unit in levels]
    name_width, value_width, unit_width = (max(map(len, texts), default=0) for texts in (metrics, values, units))
    return [
        f"{name:<{name_width}}  {value:>{value_width}} {unit:<{unit_width}}  {metric.summary}"
        for (name, metric), value, unit in zip(metrics.items(), values, units, strict=True)
    ]


def metric_text(value: float, si_unit: str) -> str:
    """Return a value of a metric or channel as text with its unit, as people are shown them."""
    shown, unit = metric_level(value, si_unit)
    return f"{without_exponent(shown, _METRIC)} {unit}".rstrip()


def name_lines(metrics: Mapping[str, Metric]) -> list[str]:
    """Return a line of text for each metric: name, value and unit as people are shown it, for ``repr``."""
    width = max(map(len, metrics), default=0)
    return [f"  {name:<{width}}  {metric_text(metric.value, metric.unit)}" for name, metric in metrics.items()]


def metric_level(value: float, si_unit: str) -> tuple[float, str]:
    """Return a value of a metric or channel, and its unit, as people are shown them."""
    quantity = metric_quantity(si_unit)
    return display_value(value, quantity), display_unit(quantity) or si_unit.removeprefix("-")


def metric_change(value: float, si_unit: str) -> tuple[float, str]:
    """Return a difference of two values of a metric or channel, and its unit, as people are shown them."""
    quantity = metric_quantity(si_unit)
    # A difference of temperatures counts in kelvin.
    unit = {"degC": "K"}.get(change_unit(quantity), change_unit(quantity))
    return display_difference(value, quantity), unit or si_unit.removeprefix("-")
