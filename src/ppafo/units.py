"""Units at the edge: text and units in, SI floats out, and back. Inside the package there are only SI floats.

Four rules go beyond arithmetic:

- A pressure says what it is: ``psi_g`` gauge, ``psi_a`` absolute, ``psi_d`` a difference; the suffix works on
  every unit of pressure. ``psi`` alone is refused, except inside a compound such as ``N m/psi``. In SI a level is
  ``Pa_a`` and a difference ``Pa_d``.
- An angle is a dimension: ``75`` is no angle, ``75 deg`` is, and ``rad/s`` is not ``Hz``.
- ``4 SI`` is the number 4 in the SI unit of what it is given to, for programs that have numbers.
- Only the units listed here exist. A short list makes a misspelling an error and the start quick.

pint reads units. Its answers for units in the files of the package are kept in ``known_units.json``, so that most
processes start without it; ``scripts/known_units.py`` writes that file.
"""

import functools
import json
import math
import re
from collections.abc import Iterable
from decimal import Decimal
from importlib.resources import files
from typing import TYPE_CHECKING, Any, NamedTuple

from ppafo.constants import PASCALS_PER_PSI, STANDARD_ATMOSPHERE
from ppafo.errors import UnitError, nearest_name

if TYPE_CHECKING:
    import pint

_PREFIXES = {
    "u": "micro- = 1e-6 = µ- = u-",
    "m": "milli- = 1e-3 = m-",
    "c": "centi- = 1e-2 = c-",
    "d": "deci- = 1e-1 = d-",
    "k": "kilo- = 1e3 = k-",
    "M": "mega- = 1e6 = M-",
}
_UNITS = {
    "m": "metre = [length] = m",
    "kg": "kilogram = [mass] = kg",
    "g": "gram = 1e-3 * kilogram = g",
    "s": "second = [time] = s",
    "K": "kelvin = [temperature] = K",
    "mol": "mole = [substance] = mol",
    "rad": "radian = [angle] = rad",
    "deg": "degree = 0.017453292519943295 * radian = deg",
    "degC": "degree_celsius = kelvin; offset: 273.15 = degC",
    "min": "minute = 60 * second = min",
    "Hz": "hertz = 1 / second = Hz",
    "N": "newton = kilogram * metre / second ** 2 = N",
    "J": "joule = newton * metre = J",
    "W": "watt = joule / second = W",
    "Pa": "pascal = newton / metre ** 2 = Pa",
    "bar": "bar = 1e5 * pascal",
    "psi": f"pound_per_square_inch = {PASCALS_PER_PSI!r} * pascal = psi",
    "L": "litre = 1e-3 * metre ** 3 = L = l",
    "in": "inch = 0.0254 * metre = in",
    "ft": "foot = 0.3048 * metre = ft",
    "lb": "pound = 0.45359237 * kilogram = lb",
    "lbf": "pound_force = 4.4482216152605 * newton = lbf",
    "percent": "percent = 0.01",
}
_PRESSURES = ("Pa", "bar", "psi")
SI = "SI"
"""The unit of a number that is in SI already, whatever it is the number of."""
_LEVEL, _DIFFERENCE = "Pa_a", "Pa_d"
_KINDS = {"g": "gauge pressure", "a": "absolute pressure", "d": "pressure difference"}
_KIND_BELONGS = "_g, _a and _d belong to a unit of pressure that stands alone, such as psi_g"
_LONGEST_UNIT = 60
_MOST_FACTORS = 4

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_NOT_ZERO = re.compile(r"[^eE]*[1-9]", re.ASCII)
_PRESSURE_KIND = re.compile(r"([A-Za-z]+)_([gad])")
_FACTOR = r"[A-Za-zµ]+(?:_[gad])?(?:\^-?[1-9])?"
_PRODUCT = rf"{_FACTOR}(?: {_FACTOR})*"
_EXPRESSION = re.compile(rf"(?:1|{_PRODUCT})(?:/(?:{_FACTOR}|\({_PRODUCT}\)))*")
_SPELLINGS = str.maketrans({"²": "^2", "³": "^3", "·": " ", "*": " ", "°": "deg", "μ": "µ", "%": "percent"})


class ParsedUnit(NamedTuple):
    """A unit as data: a value in base units (m, kg, s, K, mol, rad) is ``scale`` times the one in it plus ``offset``.

    ``dimensions`` are the powers of the base dimensions, such as ``[mass]`` and ``[angle]``.
    """

    scale: Decimal
    offset: Decimal
    dimensions: dict[str, int]


def split_quantity(text: str) -> tuple[float, str]:
    """Return number and unit of a text such as ``12.6mm^2``, ``50 psi_g`` or ``0.4 1/s``; the unit may be empty."""
    stripped = text.strip()
    match = _NUMBER.match(stripped)
    if match is None:
        raise UnitError(f"{_quote(text)} does not start with a number; write for example '12.6 mm^2' or '50 psi_g'")
    unit = stripped[match.end() :].strip()
    check_unit(unit)
    value = _finite(float(match.group()), text)
    # float() rounds 1e-400 to 0 without a word, and 0 often means "none" in a file.
    if value == 0.0 and _NOT_ZERO.match(match.group()):
        raise UnitError(f"{_quote(text)} is too small for a number of 64 bits, and would be 0; write 0 or a larger one")
    return value, unit


def number_text(text: str) -> str:
    """Return a text for ``float`` or ``int``, which take digits of any script and ``1_000``; ValueError for those."""
    if not text.isascii() or "_" in text:
        raise ValueError(f"{_quote(text)} is not a number")
    return text


def parse_quantity(text: str, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Return the value of a text in ``si_unit``; gauge pressure counts from ``atmosphere`` [Pa absolute]."""
    value, unit = split_quantity(text)
    return to_si(value, unit, si_unit, atmosphere)


def to_si(value: float, unit: str, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Return ``value`` in ``si_unit``: ``Pa_a`` for a pressure level, ``Pa_d`` for a pressure difference."""
    scale, offset, counts_from_atmosphere = conversion(unit, si_unit)
    # In decimals: 8.4 g is the float nearest to 0.0084 kg, not one beside it.
    exact = Decimal(repr(_finite(value, value))) * scale + offset
    return _finite(float(exact) + (atmosphere if counts_from_atmosphere else 0.0), f"{value:g} {unit}")


def from_si(value: float, unit: str, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Return the SI ``value`` in ``unit``: the inverse of ``to_si``."""
    scale, offset, counts_from_atmosphere = conversion(unit, si_unit)
    above = _finite(value, value) - (atmosphere if counts_from_atmosphere else 0.0)
    return float((Decimal(repr(above)) - offset) / scale)


def format_quantity(value: float, unit: str) -> str:
    """Return a text that ``split_quantity`` reads back to exactly the same number and unit."""
    return f"{repr(float(value)).removesuffix('.0')} {unit}".rstrip()


def percentage(fraction: float, digits: int) -> str:
    """Return a fraction [-] as a percentage of so many digits, in which hundreds are no powers of ten: ``120 %``."""
    return f"{float(f'{100.0 * fraction:.{digits}g}'):.12g} %"


def check_unit(unit: str) -> None:
    """Refuse a unit that does not exist or is not written as ``kg``, ``N m s/rad`` or ``m^3/(s Pa)``."""
    if unit != SI:
        _parse_unit(unit)


def base_value(value: float, unit: str) -> float:
    """Return ``value`` in the base units (m, kg, s, K, mol, rad) of its own unit, whatever its dimension is."""
    parsed, kind = _parse_unit(unit)
    base = float(Decimal(repr(_finite(value, value))) * parsed.scale + parsed.offset)
    return base + (STANDARD_ATMOSPHERE if kind == "g" else 0.0)


def dimension(unit: str) -> dict[str, int]:
    """Return the powers of the base dimensions of a unit, such as ``[mass]`` and ``[angle]``."""
    return dict(_parse_unit(unit)[0].dimensions)


@functools.lru_cache(maxsize=512)
def conversion(unit: str, si_unit: str) -> tuple[Decimal, Decimal, bool]:
    """Return scale, offset and whether the atmosphere is to be added; in decimals, so that 8.4 g is 0.0084 kg."""
    if unit == SI:
        return Decimal(1), Decimal(0), False
    given, kind = _parse_unit(unit)
    wanted, _ = _parse_unit(si_unit)
    if given.dimensions != wanted.dimensions:
        given_text = f"unit '{unit}'" if unit else "a number without a unit"
        raise UnitError(f"{given_text} does not fit: {_describe_unit(si_unit)}")
    is_pressure = si_unit in (_LEVEL, _DIFFERENCE)
    if is_pressure and not kind:
        name = unit or "Pa"
        raise UnitError(
            f"'{name}' does not say which pressure: write {name}_g for gauge, {name}_a for absolute "
            f"or {name}_d for a difference"
        )
    if is_pressure and (kind == "d") != (si_unit == _DIFFERENCE):
        raise UnitError(f"'{unit}' is a {_KINDS[kind]}, {_describe_unit(si_unit)}")
    counts_from_atmosphere = kind == "g" and si_unit == _LEVEL
    if wanted.scale == 1 and wanted.offset == 0:
        return given.scale, given.offset, counts_from_atmosphere
    return given.scale / wanted.scale, (given.offset - wanted.offset) / wanted.scale, counts_from_atmosphere


def _describe_unit(si_unit: str) -> str:
    if si_unit == _LEVEL:
        return "a pressure level is needed, for example '50 psi_g' or '446 kPa_a'"
    if si_unit == _DIFFERENCE:
        return "a pressure difference is needed, for example '5 psi_d'"
    if si_unit == "rad":
        return "an angle is needed, for example '75 deg' or '1.3 rad'"
    return f"a unit like '{si_unit}' is needed" if si_unit else "a plain number without a unit is needed"


@functools.lru_cache(maxsize=512)
def _parse_unit(unit: str) -> tuple[ParsedUnit, str]:
    """Return a unit as data, and ``g``, ``a`` or ``d`` for a pressure that says so; else an empty text."""
    bare, kind = split_pressure_kind(unit)
    # The kept file first: pint's import takes longer than a run.
    parsed = known_units().get(bare) or unit_by_pint(unit)
    # Only a pressure has a zero that may lie at the atmosphere.
    if kind and parsed.dimensions != known_units()["Pa"].dimensions:
        raise UnitError(f"'{unit}': {_KIND_BELONGS}")
    return parsed, kind


@functools.cache
def known_units() -> dict[str, ParsedUnit]:
    """Return the kept units by their normal spelling."""
    told = json.loads((files("ppafo") / "known_units.json").read_text(encoding="utf-8"))
    return {unit: ParsedUnit(Decimal(scale), Decimal(offset), powers) for unit, (scale, offset, powers) in told.items()}


def unit_by_pint(unit: str) -> ParsedUnit:
    """Return a unit as pint reads it, be it gauge, absolute or a difference; UnitError where it does not exist."""
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
        others = ", ".join(other for other in _UNITS if other not in _PRESSURES)
        pressures = ", ".join(f"{pressure}_{kind}" for pressure in _PRESSURES for kind in _KINDS)
        raise UnitError(
            f"'{name}' is not a known unit{_unit_hint(name, unit)}; available: {others}, pressures as {pressures} "
            f"(in a compound {', '.join(_PRESSURES)}), with the prefixes {', '.join(_PREFIXES)}"
        ) from error
    except pint.OffsetUnitCalculusError as error:  # milli of a temperature that has another zero
        raise UnitError(f"'{unit}': degC takes no prefix; give degC or K") from error
    # Units are affine: their values at 0 and 1 give scale and offset.
    zero, one = (_registry().Quantity(Decimal(number), parsed).to_base_units().magnitude for number in (0, 1))
    powers = {name: round(float(str(power))) for name, power in parsed.dimensionality.items()}
    return ParsedUnit(one - zero, zero, powers)


def _unit_hint(name: str, unit: str) -> str:
    """Return what may be meant by an unknown name in a unit: ``, did you mean 'N m'?``; an empty text if nothing is."""
    bare, kind = split_pressure_kind(unit)
    known, pressures = _spellings(_UNITS), _spellings(_PRESSURES)
    if name == bare and not kind and name[-1] in _KINDS and name[:-1] in pressures:
        return f", did you mean '{name[:-1]}_{name[-1]}'?"

    product = _as_product(name)
    if product:
        # Names that are products too get their spaces with this one, and parentheses below a stroke.
        spaced = re.sub(r"[A-Za-zµ]+", lambda found: _as_product(found[0]) or found[0], bare)
        spaced = re.sub(rf"/({_FACTOR}(?: {_FACTOR})+)", r"/(\1)", spaced)
        return f", did you mean '{spaced}'?"

    hint = nearest_name(name, known)
    if name == bare:
        # Alone, a pressure must say which it is.
        for near in pressures:
            *others, last = (f"'{near}_{which}'" for which in kind or _KINDS)
            hint = hint.replace(f"'{near}'", " or ".join(filter(None, (", ".join(others), last))))
    return hint


def _as_product(name: str) -> str:
    """Return a name as known units with spaces, ``N m`` for ``Nm``; an empty text where it is known or no product.

    No unit is there twice, so that ``Nmm`` is ``N mm``; short ones come first, so that ``Nms`` is ``N m s``.
    """
    known = _spellings(_UNITS)
    # A letter typed twice, as in degg, is no product.
    if name in known or re.sub(r"(.)\1", r"\1", name) in known:
        return ""

    def split(rest: str, before: tuple[str, ...]) -> str:
        if not rest:
            return " ".join(before)
        # Products of more are not written, and would take long to find in a long name.
        if len(before) == _MOST_FACTORS:
            return ""
        parts = (rest[:end] for end in range(1, len(rest) + 1))
        found = (split(rest[len(part) :], (*before, part)) for part in parts if part in known and part not in before)
        return next(filter(None, found), "")

    return split(name, ())


def _spellings(units: Iterable[str]) -> tuple[str, ...]:
    return tuple(prefix + unit for unit in units for prefix in ("", "µ", *_PREFIXES))


def split_pressure_kind(unit: str) -> tuple[str, str]:
    """Return a unit in its normal spelling without ``_g``, ``_a`` or ``_d`` at its end, and that letter."""
    normal = unit.replace("**", "^").translate(_SPELLINGS)
    normal = re.sub(r" *([/()^]) *", r"\1", normal.strip(" "))
    normal = re.sub(r" +", " ", normal)
    if normal and (len(normal) > _LONGEST_UNIT or _EXPRESSION.fullmatch(normal) is None):
        raise UnitError(f"{_quote(unit)} is not a unit; write it like 'mm^2', 'N m s/rad' or 'm^3/(s Pa)'")
    pressure = _PRESSURE_KIND.fullmatch(normal)
    return (pressure[1], pressure[2]) if pressure else (normal, "")


@functools.cache
def _registry() -> "pint.UnitRegistry[Any]":
    """Build the registry of the units above: milliseconds, where pint's own list takes a tenth of a second."""
    import pint

    # Decimals throughout, so that a unit's factor is what its definition says.
    registry: pint.UnitRegistry[Any] = pint.UnitRegistry(None, non_int_type=Decimal)
    registry.load_definitions([*_PREFIXES.values(), *_UNITS.values()])
    return registry


def _finite(value: float, shown: object) -> float:
    if not math.isfinite(value):
        raise UnitError(f"{_quote(shown)} is not a finite number")
    return value


def _quote(text: object) -> str:
    """Return a short quotation of what was given, on one line."""
    quoted = repr(text)
    return quoted if len(quoted) <= 50 else f"{quoted[:46]}...'"
