"""Display units of quantities and metrics: the only table of them. Files and data stay in SI.

Where a parameter set writes pressures, torques, angles or flows in other units, those of the set take the place of the
table's (``units/shown.py``).
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.metrics import Metric
from ppafo.units import from_si, without_exponent
from ppafo.units.shown import gauge_zero, shown_unit

Floats = NDArray[np.float64]


class Units(NamedTuple):
    """The unit of a quantity in SI, and the one in which it is shown unless a parameter set writes another.

    A run computes nothing up to ``zero`` [SI]: what is not larger is rounding, and is shown as 0. It is 0 for
    quantities that are given and not computed.
    """

    si: str
    shown: str
    zero: float = 0.0


QUANTITIES: Mapping[str, Units] = MappingProxyType(
    {
        "acceleration": Units("m/s^2", "m/s^2", 1.0e-9),
        "angle": Units("rad", "deg", 1.0e-9),
        "angular acceleration": Units("rad/s^2", "rad/s^2", 1.0e-9),
        "angular velocity": Units("rad/s", "deg/s", 1.0e-9),
        "area": Units("m^2", "mm^2"),
        "duration": Units("s", "min"),
        "energy per gas mass": Units("J/kg", "J/kg", 1.0e-6),
        "energy": Units("J", "J", 1.0e-9),
        "force": Units("N", "N", 1.0e-9),
        "fraction": Units("1", "%", 1.0e-12),
        "frequency": Units("Hz", "Hz"),
        "gas mass": Units("kg", "g", 1.0e-12),
        "gas mass per energy": Units("kg/J", "g/J", 1.0e-12),
        "length": Units("m", "mm", 1.0e-9),
        "mass": Units("kg", "kg"),
        "mass flow": Units("kg/s", "g/s", 1.0e-12),
        "part mass": Units("kg", "g"),
        "power": Units("W", "W", 1.0e-9),
        "pressure": Units("Pa_a", "psi_g", 1.0e-4),
        "pressure change": Units("Pa_d", "psi_d", 1.0e-4),
        "temperature": Units("K", "degC"),
        "time": Units("s", "s", 1.0e-12),
        "torque": Units("N m", "N m", 1.0e-9),
        "velocity": Units("m/s", "m/s", 1.0e-9),
        "volume": Units("m^3", "cm^3"),
        "displacement per radian": Units("m^3/rad", "cm^3/rad"),
        "volume flow": Units("m^3/s", "L/min"),
        "body length": Units("m", "cm"),
        "conductance": Units("m^3/(s Pa)", "L/(s bar)"),
    }
)
"""Units by the kind of quantity."""
_NAMED = ("gas mass", "part mass", "body length", "duration", "fraction")
"""Kinds that no unit tells from another kind: whoever shows one has to name it."""
_OF_UNIT = {
    **{units.si: quantity for quantity, units in QUANTITIES.items() if quantity not in _NAMED},
    # Metrics and channels write Pa for a level; of the quantities in kg the plain one is meant.
    "Pa": "pressure",
    "kg": "mass",
}
"""Kind of quantity by its unit in SI."""
_OF_GAS = {"kg": "gas mass", "kg/J": "gas mass per energy"}
"""Kind of quantity of a metric by its unit in SI: masses among the metrics are masses of gas."""
_ON_AXES = {"psi_g": "psig", "psi_a": "psia", "mm^2": "mm$^2$", "cm^3": "cm$^3$", "degC": "°C"}
"""Units that an axis writes in a form of their own."""
_PRESSURE_KINDS = {"_g": " gauge", "_a": " absolute"}
"""Words on an axis for the ending of a pressure unit."""
_METRIC = ".4g"
"""Digits of a metric."""


def quantity_of_unit(si_unit: str) -> str:
    """Return the kind of quantity that has a unit in SI, empty for a plain number or a unit that is shown as it is.

    ``kg`` is a mass and ``s`` a time; masses of gas and parts, shown in grams, and what lasts minutes have to be named.
    """
    return _OF_UNIT.get(si_unit, "")


def si_unit(quantity: str) -> str:
    """Return the unit in SI of a quantity, as files write it; empty for a plain number."""
    return QUANTITIES[quantity].si if quantity else ""


def _unit(quantity: str) -> str:
    """Return the unit in which a quantity is shown: the set's, where it writes one, else the table's."""
    units = QUANTITIES[quantity]
    return units.shown if quantity in _NAMED else shown_unit(units.si, units.shown)


def display_unit(quantity: str) -> str:
    """Return the unit in which a quantity is shown, as a table writes it; empty for a plain number."""
    return _unit(quantity).removesuffix("_d") if quantity else ""


def change_unit(quantity: str) -> str:
    """Return the unit in which a difference of two values is shown; empty for a plain number."""
    unit = display_unit(quantity)
    # A difference of pressures is neither gauge nor absolute.
    return unit[:-2] if quantity == "pressure" and unit.endswith(("_g", "_a")) else unit


def axis_unit(quantity: str) -> str:
    """Return the unit in which a quantity is shown, as the label of an axis writes it: with raised exponents."""
    unit = display_unit(quantity)
    if unit in _ON_AXES:
        return _ON_AXES[unit]
    if quantity == "pressure":
        unit = f"{unit[:-2]}{_PRESSURE_KINDS.get(unit[-2:], unit[-2:])}"
    return unit.replace("m^2", "m$^2$").replace("m^3", "m$^3$").replace("s^2", "s$^2$")


def display_value(value: float, quantity: str, atmosphere: float | None = None) -> float:
    """Return a value in SI in the unit in which it is shown.

    Gauge counts from ``atmosphere`` [Pa absolute], of the device in force unless given (``units/shown.py``).

    What is zero within the accuracy of a run is 0.
    """
    if quantity not in QUANTITIES or not math.isfinite(value):
        return float(value)
    (si, _, zero), unit = QUANTITIES[quantity], _unit(quantity)
    shown, further = (
        each if si == unit else from_si(each, unit, si, gauge_zero() if atmosphere is None else atmosphere)
        for each in (float(value), float(value) + zero)
    )
    return 0.0 if abs(shown) <= abs(further - shown) else shown


def display_difference(value: float, quantity: str) -> float:
    """Return a difference of two values in SI in the unit in which it is shown."""
    # The zero of gauge pressures and of degrees Celsius falls out.
    return display_value(value, quantity) - display_value(0.0, quantity)


def display_values(values: Floats, quantity: str, atmosphere: float | None = None) -> Floats:
    """Return values in SI (any shape) in the unit in which they are shown."""
    # Units are affine, so that two values decide all.
    zero, one = (display_value(number, quantity, atmosphere) for number in (0.0, 1.0))
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
