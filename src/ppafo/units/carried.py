"""Values that carry their unit: quantities of pint, arrays of xarray and pandas with ``units`` among their attributes.

A metric, a channel or a number of a parameter set does too, by ``value`` and ``unit``.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple


class Carried(NamedTuple):
    """Number or array of a value, and the unit that it carries; 1 for a plain number."""

    magnitude: Any
    unit: str


def carried(value: Any) -> Carried | None:
    """Return what a value carries; None for a value without a unit."""
    if type(value) in (float, int, str, bool) or value is None:
        return None
    for number, unit in (("magnitude", "units"), ("value", "unit"), ("values", "unit")):
        if hasattr(value, unit) and hasattr(value, number):
            return Carried(getattr(value, number), _text(getattr(value, unit)))
    attributes = getattr(value, "attrs", None)
    if not isinstance(attributes, Mapping):
        return None
    if hasattr(getattr(value, "data", None), "units"):
        return carried(value.data)
    units = attributes.get("units")
    # pandas copies the attributes of a table, the units by column, to each column of it.
    units = units.get(getattr(value, "name", None)) if isinstance(units, Mapping) else units
    return None if units is None or not hasattr(value, "values") else Carried(value.values, _text(units))


def _text(unit: Any) -> str:
    # pint writes its symbols so, mm ** 2 instead of millimeter ** 2.
    text = f"{unit:~}" if hasattr(unit, "dimensionality") else str(unit)
    return {"": "1", "-": "1", "dimensionless": "1"}.get(text, text)
