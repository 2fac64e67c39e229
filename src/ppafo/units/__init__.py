"""Units at the interface of the package: text with units to SI floats, and back.

Inside the package all floats are SI. Four rules go beyond arithmetic:

- A pressure states its kind: ``psi_g`` gauge, ``psi_a`` absolute, ``psi_d`` a difference. The suffix works with every
  unit of pressure, including quotients. ``psi`` alone is refused, except inside a compound such as ``N m/psi``. In SI
  a level is ``Pa_a`` and a difference ``Pa_d``.
- An angle is a dimension: ``75`` is no angle, ``75 deg`` is, and ``rad/s`` is not ``Hz``.
- ``4 SI`` is the number 4 in the SI unit of the quantity to which it is assigned. Programs write their numbers so.
- A volume flow becomes a mass flow by its reference condition and gas: ``L/min (ANR, air)``.

>>> pressure = parse_quantity("65 psi_g", "Pa_a")
>>> f"{pressure:.0f} Pa absolute, {from_si(pressure, 'psi_g', 'Pa_a', 101325.0):.0f} psi gauge"
'549484 Pa absolute, 65 psi gauge'
"""

import functools
import math
import re
from collections.abc import Mapping
from decimal import Decimal
from typing import Any

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import UnitError
from ppafo.units.spelling import (
    DECIMALS,
    MASS_FLOW,
    flow_of,
    quote,
    read_unit,
)
from ppafo.units.spelling import split_pressure_kind as split_pressure_kind

SI = "SI"
"""Unit of a number that is in SI units already, for any quantity; written by programs."""
LEVEL = "Pa_a"
DIFFERENCE = "Pa_d"
KINDS = {"g": "a gauge pressure", "a": "an absolute pressure", "d": "a pressure difference"}
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_NOT_ZERO = re.compile(r"[^eE]*[1-9]", re.ASCII)
_DECIMAL_COMMA = re.compile(r"([+-]?\d+),(\d+)(?![\d,.])", re.ASCII)
_NEEDED = {
    LEVEL: "a pressure level is needed, for example '50 psi_g' or '446 kPa_a'",
    DIFFERENCE: "a pressure difference is needed, for example '5 psi_d'",
    "rad": "an angle is needed, for example '75 deg' or '1.3 rad'",
    "m^3/(s Pa)": "a sonic conductance is needed, such as '1 L/(s bar)', a flow per pressure before the valve",
    "": "a plain number without a unit is needed",
}
"""Statements of what is needed in place of a wrong unit, by SI unit."""


def split_quantity(text: str) -> tuple[float, str]:
    """Split a text such as ``12.6mm^2``, ``50 psi_g`` or ``0.4 1/s`` into number and unit, which may be empty."""
    value, unit = split_number(text)
    check_unit(unit)
    return value, unit


def split_number(text: str) -> tuple[float, str]:
    """Split a text into number and unit, without a check of the unit.

    For callers that know the wanted unit and raise a more specific error.
    """
    stripped = text.strip()
    match = _NUMBER.match(stripped)
    if match is None:
        raise UnitError(f"{quote(text)} does not start with a number; write for example '12.6 mm^2' or '50 psi_g'")
    if comma := _DECIMAL_COMMA.match(stripped):
        # Three digits may be a group of a number above a thousand.
        marks = (".", "") if len(comma[2]) == 3 else (".",)
        ways = [f"'{comma[1]}{mark}{stripped[comma.start(2) :]}'" for mark in marks]
        raise UnitError(f"{quote(text)} has a comma in its number; write {' or '.join(ways)}")
    value = _finite(float(match.group()), text)
    # float() rounds 1e-400 to 0 without a word, and 0 often means "none" in a file.
    if value == 0.0 and _NOT_ZERO.match(match.group()):
        raise UnitError(
            f"{quote(text)} is too close to 0 for a 64-bit number and would become 0; write 0 or a larger number"
        )
    return value, stripped[match.end() :].strip()


def parse_quantity(text: str, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Convert a text to a number in ``si_unit``; gauge pressures are relative to ``atmosphere`` [Pa absolute]."""
    return to_si(*split_number(text), si_unit, atmosphere)


def to_si(value: float, unit: str, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Convert a value to ``si_unit``: ``Pa_a`` for a pressure level, ``Pa_d`` for a pressure difference."""
    scale, offset, counts_from_atmosphere = conversion(unit, si_unit)
    exact = DECIMALS.fma(_decimal(value), scale, offset)
    return _finite(float(exact) + (atmosphere if counts_from_atmosphere else 0.0), f"{value:g} {unit}")


def from_si(value: float, unit: str, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Convert an SI value to ``unit``, the inverse of ``to_si``."""
    scale, offset, counts_from_atmosphere = conversion(unit, si_unit)
    above = _finite(value, value) - (atmosphere if counts_from_atmosphere else 0.0)
    return float(DECIMALS.divide(DECIMALS.subtract(_decimal(above), offset), scale))


def base_value(value: float, unit: str) -> float:
    """Convert a value in any unit to base units (m, kg, s, K, mol, rad)."""
    parsed = read_unit(unit)
    exact = DECIMALS.fma(_decimal(value), parsed.scale, parsed.offset)
    return float(exact) + (STANDARD_ATMOSPHERE if parsed.kind == "g" else 0.0)


def check_unit(unit: str) -> None:
    """Check that a unit exists and is written like ``kg`` or ``m^3/(s Pa)``. Raises UnitError if not."""
    if unit != SI:
        read_unit(unit)


@functools.lru_cache(maxsize=512)
def conversion(unit: str, si_unit: str) -> tuple[Decimal, Decimal, bool]:
    """Return scale and offset to an SI unit, and a flag to add the atmosphere."""
    if unit == SI:
        return Decimal(1), Decimal(0), False
    wanted = read_unit(si_unit)
    needed = _NEEDED.get(si_unit, f"a unit like '{si_unit}' is needed")
    flow = flow_of(unit)
    is_mass_flow = wanted.dimensions == MASS_FLOW
    if flow.is_normal and not flow.is_stated and not is_mass_flow:
        raise UnitError(f"unit '{unit}' does not fit: {needed}")
    given = read_unit(unit, is_mass_flow)
    if given.dimensions != wanted.dimensions:
        raise UnitError(f"{f'unit {unit!r}' if unit else 'a number without a unit'} does not fit: {needed}")
    if si_unit in (LEVEL, DIFFERENCE):
        if not given.kind:
            ways = f"{unit}_g for gauge or {unit}_a for absolute" if si_unit == LEVEL else f"{unit}_d for a difference"
            raise UnitError(f"'{unit}' needs the kind of pressure: write {ways}")
        if (given.kind == "d") != (si_unit == DIFFERENCE):
            raise UnitError(f"'{unit}' is {KINDS[given.kind]}, {needed}")
    offset = DECIMALS.divide(DECIMALS.subtract(given.offset, wanted.offset), wanted.scale)
    return DECIMALS.divide(given.scale, wanted.scale), offset, given.kind == "g" and si_unit == LEVEL


def _decimal(value: float) -> Decimal:
    return Decimal(repr(float(_finite(value, value))))


def _finite(value: float, shown: object) -> float:
    if not math.isfinite(value):
        raise UnitError(f"{quote(shown)} is not a finite number")
    return value


def format_quantity(value: float, unit: str) -> str:
    """Format value and unit as text, which ``split_quantity`` reads back exactly."""
    return f"{repr(float(value)).removesuffix('.0')} {unit}".rstrip()


def carried(value: Any) -> tuple[Any, str] | None:
    """Return the number or array and the unit of a quantity of pint, an array of xarray or pandas, or a metric.

    The unit of a plain number is 1; a value without any gives None.
    """
    if type(value) in (float, int, str, bool) or value is None:
        return None
    for number, unit in (("magnitude", "units"), ("value", "unit"), ("values", "unit")):
        if hasattr(value, unit) and hasattr(value, number):
            return getattr(value, number), _text(getattr(value, unit))
    attributes = getattr(value, "attrs", None)
    if not isinstance(attributes, Mapping):
        return None
    if hasattr(getattr(value, "data", None), "units"):
        return carried(value.data)
    units = attributes.get("units")
    # pandas copies the attributes of a table, the units by column, to each column of it.
    units = units.get(getattr(value, "name", None)) if isinstance(units, Mapping) else units
    return None if units is None or not hasattr(value, "values") else (value.values, _text(units))


def _text(unit: Any) -> str:
    # pint writes its symbols so, mm ** 2 instead of millimeter ** 2.
    text = f"{unit:~}" if hasattr(unit, "dimensionality") else str(unit)
    return {"": "1", "-": "1", "dimensionless": "1"}.get(text, text)
