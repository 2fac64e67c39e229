"""Known units and their definitions in base units.

The definitions are parsed by pint. The results for units in the files of the package are stored in
``known_units.json``, so that most processes start without pint; ``scripts/known_units.py`` writes that file.
"""

import decimal
import functools
import json
from decimal import Decimal
from typing import TYPE_CHECKING, Any, NamedTuple

from ppafo.constants import PASCALS_PER_PSI
from ppafo.errors import UnitError
from ppafo.units.spelling import PREFIXES, PRESSURES, UNITS, split_pressure_kind

if TYPE_CHECKING:
    import pint

_PREFIXES = (
    "micro- = 1e-6 = µ- = u-",
    "milli- = 1e-3 = m-",
    "centi- = 1e-2 = c-",
    "deci- = 1e-1 = d-",
    "hecto- = 1e2 = h-",
    "kilo- = 1e3 = k-",
    "mega- = 1e6 = M-",
)
_DEFINITIONS = {
    "m": "metre = [length] = m",
    "kg": "kilogram = [mass] = kg",
    "g": "gram = 1e-3 * kilogram = g",
    "s": "second = [time] = s",
    "K": "kelvin = [temperature] = K",
    "mol": "mole = [substance] = mol",
    "rad": "radian = [angle] = rad",
    "deg": "degree = 0.017453292519943295 * radian = deg",
    "rev": "revolution = 6.283185307179586 * radian = rev",
    "degC": "degree_celsius = kelvin; offset: 273.15 = degC",
    "degF": "degree_fahrenheit = 0.5555555555555555555555555556 * kelvin; offset: 255.3722222222222222222222222 = degF",
    "min": "minute = 60 * second = min",
    "h": "hour = 3600 * second = h",
    "day": "day = 86400 * second",
    "Hz": "hertz = 1 / second = Hz",
    "N": "newton = kilogram * metre / second ** 2 = N",
    "J": "joule = newton * metre = J",
    "W": "watt = joule / second = W",
    "Pa": "pascal = newton / metre ** 2 = Pa",
    "bar": "bar = 1e5 * pascal",
    "psi": f"pound_per_square_inch = {PASCALS_PER_PSI!r} * pascal = psi",
    "atm": "standard_atmosphere = 101325 * pascal = atm",
    "Torr": "torr = 133.3223684210526 * pascal = Torr",
    "mHg": "metre_of_mercury = 133322.387415 * pascal = mHg",
    "inHg": "inch_of_mercury = 3386.388640341 * pascal = inHg",
    "mWC": "metre_of_water = 9806.65 * pascal = mWC",
    "inWC": "inch_of_water = 249.08891 * pascal = inWC",
    "L": "litre = 1e-3 * metre ** 3 = L = l",
    "in": "inch = 0.0254 * metre = in",
    "ft": "foot = 0.3048 * metre = ft",
    "lb": "pound = 0.45359237 * kilogram = lb",
    "lbf": "pound_force = 4.4482216152605 * newton = lbf",
    "oz": "ounce = 0.028349523125 * kilogram = oz",
    "ozf": "ounce_force = 0.27801385095378125 * newton = ozf",
    "kgf": "kilogram_force = 9.80665 * newton = kgf",
    "percent": "percent = 0.01",
}
DECIMALS = decimal.Context(
    prec=28,
    rounding=decimal.ROUND_HALF_EVEN,
    Emin=-999_999,
    Emax=999_999,
    capitals=1,
    clamp=0,
    traps=[decimal.InvalidOperation, decimal.DivisionByZero, decimal.Overflow],
)
"""Decimal context of unit arithmetic, independent of the settings of a host program."""
PRESSURE = {"[mass]": 1, "[length]": -1, "[time]": -2}
KINDS = {"g": "gauge pressure", "a": "absolute pressure", "d": "pressure difference"}
_KIND_BELONGS = "_g, _a and _d are allowed only for a single unit of pressure, such as psi_g"


class ParsedUnit(NamedTuple):
    """Unit as data: value in base units (m, kg, s, K, mol, rad) = ``scale`` * value + ``offset``.

    ``dimensions`` maps each base dimension, such as ``[mass]`` and ``[angle]``, to its power.
    """

    scale: Decimal
    offset: Decimal
    dimensions: dict[str, int]

    def in_base(self, value: Decimal) -> Decimal:
        """Convert a value in this unit to base units."""
        return DECIMALS.add(DECIMALS.multiply(value, self.scale), self.offset)


class UnknownUnitError(UnitError):
    """Unknown name in a unit, with the whole unit in normal spelling without pressure kind."""

    def __init__(self, name: str, unit: str) -> None:
        """Store the unknown name and the unit, for a suggestion in a message."""
        self.name, self.unit = name, unit
        others = ", ".join(other for other in UNITS if other not in PRESSURES)
        pressures = ", ".join(f"{pressure}_{kind}" for pressure in PRESSURES[:3] for kind in KINDS)
        self.available = (
            f"; available: {others}, pressures as {pressures} (in a compound {', '.join(PRESSURES[:3])}) and "
            f"{', '.join(PRESSURES[3:])} likewise, with the prefixes {', '.join(PREFIXES)}"
        )
        super().__init__(f"'{name}' is not a known unit{self.available}")


@functools.lru_cache(maxsize=512)
def parse_unit(unit: str) -> tuple[ParsedUnit, str]:
    """Parse a unit; return its data, and the kind of a pressure (``g``, ``a`` or ``d``, else empty).

    Raises UnitError for an unknown unit.
    """
    bare, kind = split_pressure_kind(unit)
    # The kept file first: pint's import takes longer than a run.
    parsed = known_units().get(bare) or unit_by_pint(unit)
    # Only a pressure has a zero that may lie at the atmosphere.
    if kind and parsed.dimensions != PRESSURE:
        raise UnitError(f"'{unit}': {_KIND_BELONGS}")
    return parsed, kind


@functools.cache
def known_units() -> dict[str, ParsedUnit]:
    """Return the stored units by normal spelling."""
    from importlib.resources import files  # what speaks of units reads none yet

    told = json.loads((files("ppafo") / "known_units.json").read_text(encoding="utf-8"))
    return {unit: ParsedUnit(Decimal(scale), Decimal(offset), powers) for unit, (scale, offset, powers) in told.items()}


def unit_by_pint(unit: str) -> ParsedUnit:
    """Parse a unit with pint, without the kind of a pressure. Raises UnitError for an unknown unit."""
    import pint

    bare, _ = split_pressure_kind(unit)
    try:
        parsed = _registry().parse_units(bare.replace("^", "**").replace(" ", "*"))
    except (pint.UndefinedUnitError, ValueError) as error:
        # pint takes 'nan' and 'inf' for numbers.
        unknown = error.unit_names if isinstance(error, pint.UndefinedUnitError) else bare
        name = unknown if isinstance(unknown, str) else next(iter(unknown))
        if name[-2:] in ("_g", "_a", "_d"):
            raise UnitError(f"'{name}': {_KIND_BELONGS}") from error
        raise UnknownUnitError(name, bare) from error
    except pint.OffsetUnitCalculusError as error:  # milli of a temperature that has another zero
        raise UnitError(f"'{unit}': degC and degF take no prefix; give degC, degF or K") from error
    # Units are affine: their values at 0 and 1 give scale and offset.
    with decimal.localcontext(DECIMALS):
        zero, one = (_registry().Quantity(Decimal(number), parsed).to_base_units().magnitude for number in (0, 1))
        scale = one - zero
    powers = {name: round(float(str(power))) for name, power in parsed.dimensionality.items()}
    return ParsedUnit(scale, zero, powers)


@functools.cache
def _registry() -> "pint.UnitRegistry[Any]":
    """Build a pint registry of these definitions only, in 1 ms instead of 0.1 s."""
    import pint

    # Decimals throughout, so that a unit's factor is what its definition says.
    with decimal.localcontext(DECIMALS):
        registry: pint.UnitRegistry[Any] = pint.UnitRegistry(None, non_int_type=Decimal)
        registry.load_definitions([*_PREFIXES, *_DEFINITIONS.values()])
    return registry
