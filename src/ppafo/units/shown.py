"""Display units: unit as given, else unit of the parameter set, else default of the package.

Files and data stay in SI. Gauge pressures are relative to the atmosphere of the device, which is stored with the units:
text, tables, axes and saved results use the same one.
"""

import functools
import math
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from contextvars import ContextVar
from types import MappingProxyType
from typing import NamedTuple, ParamSpec, TypeVar

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.units import from_si, split_pressure_kind
from ppafo.wording import set_within, without_exponent

P = ParamSpec("P")
R = TypeVar("R")
NAMED = ("gas mass", "body length", "duration", "fraction")
"""Kinds of quantity that share an SI unit with another kind, so that callers must name them."""
GAUGE_ZERO = "gauge_zero"
"""Key of the absolute pressure displayed as gauge zero, among display units by SI unit."""


class Units(NamedTuple):
    """SI unit of a quantity, its default display unit, and the magnitude [SI] up to which a computed value is 0."""

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
"""Display units by kind of quantity."""
_OF_UNIT = {
    **{units.si: quantity for quantity, units in QUANTITIES.items() if quantity not in NAMED},
    # Metrics and channels write Pa for a level; of the quantities in kg the plain one is meant.
    "Pa": "pressure",
    "kg": "mass",
}
"""Kind of quantity by SI unit."""
_WRITTEN = {"Pa": "Pa_a", "-": "1"}
"""Unit as written in files, by unit of a metric or channel."""

_chosen: ContextVar[Mapping[str, str]] = ContextVar("_chosen", default=MappingProxyType({}))


def shown_in(units: Mapping[str, str]) -> AbstractContextManager[None]:
    """Set the display units by SI unit in a ``with`` block: ``{"Pa_a": "bar_g", "N m": "N cm"}``."""
    return set_within(_chosen, units)


def in_units(units: Callable[..., Mapping[str, str]]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a function to run with the display units that ``units`` returns for its arguments."""

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def inside(*args: P.args, **kwargs: P.kwargs) -> R:
            with shown_in(units(*args, **kwargs)):
                return function(*args, **kwargs)

        return inside

    return decorate


def units_beside(si_unit: str, unit: str) -> dict[str, str]:
    """Return the display units implied by ``unit`` for quantities of ``si_unit``, by SI unit.

    With levels in ``bar_g`` differences are in ``bar_d``, with angles in ``deg`` angular velocities in ``deg/s``.
    """
    if si_unit == "Pa_a":
        pressure, kind = split_pressure_kind(unit)
        return {"Pa_a": f"{pressure}_{kind}", "Pa_d": f"{pressure}_d"}
    return {si_unit: unit, "rad/s": f"{unit}/s"} if si_unit == "rad" else {si_unit: unit}


def counted_from(units: Mapping[str, str], atmosphere: float) -> dict[str, str]:
    """Add the atmosphere [Pa absolute], as zero of gauge pressures, to display units by SI unit."""
    return {**units, GAUGE_ZERO: f"{atmosphere!r} Pa_a"}


def gauge_zero() -> float:
    """Return the absolute pressure displayed as gauge zero [Pa]."""
    stated = _chosen.get().get(GAUGE_ZERO)
    return STANDARD_ATMOSPHERE if stated is None else float(stated.removesuffix(" Pa_a"))


def units_in_force() -> dict[str, str]:
    """Return the chosen display units by SI unit; empty for the defaults of the package."""
    return dict(_chosen.get())


def quantity_of_unit(si_unit: str) -> str:
    """Return the kind of quantity of an SI unit, none of ``NAMED``; empty if it has no display unit."""
    return _OF_UNIT.get(si_unit, "")


def shown_unit(si_unit: str, chosen: Mapping[str, str] | None = None) -> str:
    """Return the display unit of an SI unit, ``chosen`` as by ``shown_in`` or by default; "" for a plain number."""
    chosen = _chosen.get() if chosen is None else chosen
    si_unit = _WRITTEN.get(si_unit, si_unit)
    if si_unit in chosen:
        return chosen[si_unit]
    if si_unit in ("N/Pa", "N m/Pa"):
        return f"{shown_unit(si_unit.removesuffix('/Pa'), chosen)}/{shown_unit('Pa_d', chosen).removesuffix('_d')}"
    quantity = quantity_of_unit(si_unit)
    return QUANTITIES[quantity].shown if quantity else "" if si_unit == "1" else si_unit


def unit_of(quantity: str) -> str:
    """Return the display unit of a kind of quantity."""
    return QUANTITIES[quantity].shown if quantity in NAMED else shown_unit(QUANTITIES[quantity].si)


def shown_value(
    value: float, si_unit: str, unit: str = "", atmosphere: float | None = None, zero: float = 0.0
) -> float:
    """Convert an SI value to ``unit``, by default its display unit; magnitudes up to ``zero`` become 0.

    Gauge pressures are relative to ``atmosphere`` [Pa absolute], by default the atmosphere of the device in force.
    """
    known = _WRITTEN.get(si_unit, si_unit)
    unit = unit or shown_unit(si_unit)
    if unit in (known, "") or not math.isfinite(value):
        return 0.0 if abs(value) <= zero else float(value)
    room = gauge_zero() if atmosphere is None else atmosphere
    shown, further = (from_si(each, unit, known, room) for each in (float(value), float(value) + zero))
    return 0.0 if abs(shown) <= abs(further - shown) else shown


def shown_text(value: float, si_unit: str, form: str = ".6g", atmosphere: float | None = None, unit: str = "") -> str:
    """Format an SI value in ``unit``, else in its display unit; a value within the accuracy of a run is 0.

    >>> shown_text(5.201e-4, "m^2"), shown_text(4.0e5, "Pa_a", unit="bar_a"), shown_text(1.0e-17, "N m")
    ('520.1 mm^2', '4 bar_a', '0 N m')
    """
    quantity = quantity_of_unit(si_unit)
    unit = unit or shown_unit(si_unit)
    zero = QUANTITIES[quantity].zero if quantity else 0.0
    return f"{without_exponent(shown_value(value, si_unit, unit, atmosphere, zero), form)} {unit}".rstrip()


def written_text(value: float, si_unit: str) -> str:
    """Format an SI value in its display unit for reading back, in nine digits without conversion errors.

    >>> written_text(206842.71879504 + 101325.0, "Pa_a"), written_text(3.929e-9, "m^3/(s Pa)")
    ('30 psi_g', '0.3929 L/(s bar)')
    """
    unit = shown_unit(si_unit)
    number = shown_value(value, si_unit, unit)
    return f"{float(f'{number:.9g}')!r}".removesuffix(".0") + f" {unit}".rstrip()
