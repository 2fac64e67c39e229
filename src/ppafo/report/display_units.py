"""In which unit a person is shown a quantity or a metric: the only table of it. Files and data stay in SI.

Where a parameter set writes pressures, torques, angles or flows in other units, those of the set take the place of the
table's (``units/shown.py``).
"""

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.metrics import Metric
from ppafo.units import from_si, without_exponent
from ppafo.units.shown import shown_unit

Floats = NDArray[np.float64]
QUANTITIES: MappingProxyType[str, tuple[str, str]] = MappingProxyType(
    {
        "acceleration": ("m/s^2", "m/s^2"),
        "angle": ("rad", "deg"),
        "angular acceleration": ("rad/s^2", "rad/s^2"),
        "angular velocity": ("rad/s", "deg/s"),
        "area": ("m^2", "mm^2"),
        "duration": ("s", "min"),
        "energy": ("J", "J"),
        "force": ("N", "N"),
        "fraction": ("1", "%"),
        "frequency": ("Hz", "Hz"),
        "gas mass": ("kg", "g"),
        "gas mass per energy": ("kg/J", "g/J"),
        "length": ("m", "mm"),
        "mass": ("kg", "kg"),
        "mass flow": ("kg/s", "g/s"),
        "part mass": ("kg", "g"),
        "power": ("W", "W"),
        "pressure": ("Pa_a", "psi_g"),
        "pressure change": ("Pa_d", "psi_d"),
        "temperature": ("K", "degC"),
        "time": ("s", "s"),
        "torque": ("N m", "N m"),
        "velocity": ("m/s", "m/s"),
        "volume": ("m^3", "cm^3"),
        "displacement per radian": ("m^3/rad", "cm^3/rad"),
        "volume flow": ("m^3/s", "L/min"),
        "body length": ("m", "cm"),
        "conductance": ("m^3/(s Pa)", "L/(s bar)"),
    }
)
"""Kind of quantity to its unit in SI and the unit in which it is shown unless a parameter set writes another."""
_NAMED = ("gas mass", "part mass", "body length", "duration", "fraction")
_OF_UNIT = {si: quantity for quantity, (si, _) in QUANTITIES.items() if quantity not in _NAMED}


# Metrics and channels write Pa for a level; of the quantities in kg the plain one is meant.
_OF_UNIT |= {"Pa": "pressure", "kg": "mass"}


def quantity_of_unit(si_unit: str) -> str:
    """Return the kind of quantity that has a unit in SI, empty for a plain number or a unit that is shown as it is.

    ``kg`` is a mass and ``s`` a time; masses of gas and parts, shown in grams, and what lasts minutes have to be named.
    """
    return _OF_UNIT.get(si_unit, "")


def si_unit(quantity: str) -> str:
    """Return the unit in SI of a quantity, as files write it; empty for a plain number."""
    return QUANTITIES[quantity][0] if quantity else ""


def _unit(quantity: str) -> str:
    """Return the unit in which a quantity is shown: the set's, where it writes one, else the table's."""
    si_unit, unit = QUANTITIES[quantity]
    return unit if quantity in _NAMED else shown_unit(si_unit, unit)


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
    words = {"psi_g": "psig", "psi_a": "psia", "mm^2": "mm$^2$", "cm^3": "cm$^3$", "degC": "°C"}
    kinds = {"_g": " gauge", "_a": " absolute"}
    typed = unit if quantity != "pressure" else f"{unit[:-2]}{kinds.get(unit[-2:], unit[-2:])}"
    return words.get(unit, typed.replace("m^2", "m$^2$").replace("m^3", "m$^3$").replace("s^2", "s$^2$"))


def display_value(value: float, quantity: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Return a value in SI in the unit in which it is shown; gauge counts from ``atmosphere`` [Pa absolute]."""
    si, unit = (QUANTITIES[quantity][0], _unit(quantity)) if quantity in QUANTITIES else ("", "")
    return float(value) if si == unit or not math.isfinite(value) else from_si(float(value), unit, si, atmosphere)


def display_difference(value: float, quantity: str) -> float:
    """Return a difference of two values in SI in the unit in which it is shown."""
    # The zero of gauge pressures and of degrees Celsius falls out.
    return display_value(value, quantity) - display_value(0.0, quantity)


def display_values(values: Floats, quantity: str) -> Floats:
    """Return values in SI (any shape) in the unit in which they are shown."""
    # Units are affine, so that two values decide all.
    zero, one = display_value(0.0, quantity), display_value(1.0, quantity)
    return values if (zero, one) == (0.0, 1.0) else zero + (one - zero) * values


def quantity_text(value: float, quantity: str, form: str = ".3g", atmosphere: float = STANDARD_ATMOSPHERE) -> str:
    """Return a value in SI as text with the unit in which it is shown; gauge counts from ``atmosphere`` [Pa]."""
    return f"{without_exponent(display_value(value, quantity, atmosphere), form)} {display_unit(quantity)}".rstrip()


_OF_GAS = {"kg": "gas mass", "kg/J": "gas mass per energy"}
"""Masses among the metrics are masses of gas."""


def metric_quantity(si_unit: str) -> str:
    """Return the kind of quantity of a metric or channel that has a unit in SI, empty for a plain number."""
    return _OF_GAS.get(si_unit) or quantity_of_unit(si_unit)


def gauge_shift(atmosphere: float) -> float:
    """Return what [Pa] is taken from pressures of a figure whose gauge ones count from ``atmosphere`` [Pa absolute].

    Axes count from the standard atmosphere; nothing is taken where absolute pressures are shown.
    """
    return atmosphere - STANDARD_ATMOSPHERE if display_unit("pressure").endswith("_g") else 0.0


def metric_words(name: str) -> str:
    """Return the name of a metric in words: ``RMS error``."""
    words = name.replace("_", " ").replace("rms", "RMS")
    return words[:1].upper() + words[1:]


def metrics_lines(metrics: Mapping[str, Metric], atmosphere: float = STANDARD_ATMOSPHERE) -> list[str]:
    """Return a line of text for each metric: name, value and unit as people are shown it, meaning.

    Pressures count from ``atmosphere`` [Pa absolute].
    """
    rows = []
    for name, metric in metrics.items():
        value, unit = metric_level(metric.value, metric.unit, atmosphere)
        rows.append((name, f"{value:.4g}", unit, metric.summary))
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(3)]
    return [f"{row[0]:<{widths[0]}}  {row[1]:>{widths[1]}} {row[2]:<{widths[2]}}  {row[3]}" for row in rows]


def metric_level(value: float, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> tuple[float, str]:
    """Return a value of a metric or channel, and its unit, as people are shown them.

    Pressures are gauge ones and count from ``atmosphere`` [Pa absolute].
    """
    quantity = metric_quantity(si_unit)
    return display_value(value, quantity, atmosphere), display_unit(quantity) or si_unit.removeprefix("-")


def metric_change(value: float, si_unit: str) -> tuple[float, str]:
    """Return a difference of two values of a metric or channel, and its unit, as people are shown them."""
    quantity = metric_quantity(si_unit)
    # A difference of temperatures counts in kelvin.
    unit = {"degC": "K"}.get(change_unit(quantity), change_unit(quantity))
    return display_difference(value, quantity), unit or si_unit.removeprefix("-")
