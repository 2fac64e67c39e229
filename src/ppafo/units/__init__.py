"""Units at the interface of the package: text with units to SI floats, and back.

Inside the package all floats are SI.

Four rules go beyond arithmetic:

- A pressure states its kind: ``psi_g`` gauge, ``psi_a`` absolute, ``psi_d`` a difference. The suffix works with every
  unit of pressure, including quotients. ``psi`` alone is refused, except inside a compound such as ``N m/psi``. In SI
  a level is ``Pa_a`` and a difference ``Pa_d``.
- An angle is a dimension: ``75`` is no angle, ``75 deg`` is, and ``rad/s`` is not ``Hz``.
- ``4 SI`` is the number 4 in the SI unit of the quantity to which it is assigned. Programs write their numbers so.
- Only the units listed in ``definitions.py`` exist. A short list turns a misspelling into an error and shortens the
  start. Common other spellings are converted in ``spelling.py``.

A volume flow becomes a mass flow by its reference condition and gas (``reference.py``): ``L/min (ANR, air)``.

>>> pressure = parse_quantity("65 psi_g", "Pa_a")
>>> f"{pressure:.0f} Pa absolute, {from_si(pressure, 'psi_g', 'Pa_a', 101325.0):.0f} psi gauge"
'549484 Pa absolute, 65 psi gauge'
"""

from ppafo.units.definitions import ParsedUnit, known_units, unit_by_pint
from ppafo.units.quantity import (
    SI,
    base_value,
    check_unit,
    conversion,
    dimension,
    format_quantity,
    from_si,
    number_text,
    parse_quantity,
    percentage,
    split_number,
    split_quantity,
    to_si,
    without_exponent,
)
from ppafo.units.reference import flow_of, is_volume_flow, with_condition
from ppafo.units.spelling import split_pressure_kind

__all__ = [
    "SI",
    "ParsedUnit",
    "base_value",
    "check_unit",
    "conversion",
    "dimension",
    "flow_of",
    "format_quantity",
    "from_si",
    "is_volume_flow",
    "known_units",
    "number_text",
    "parse_quantity",
    "percentage",
    "split_number",
    "split_pressure_kind",
    "split_quantity",
    "to_si",
    "unit_by_pint",
    "with_condition",
    "without_exponent",
]
