"""Units that exist: definitions, prefixes and other names, and arithmetic of their products.

A short list turns a misspelling into an error. Factors are decimals, so that 8.4 g is the float nearest to 0.0084 kg.
"""

import decimal
import functools
import re
from decimal import Decimal
from typing import NamedTuple

from ppafo.constants import PASCALS_PER_PSI
from ppafo.errors import UnitError

_DEFINITIONS = f"""
m = [length]; in = 0.0254 m; ft = 0.3048 m; L = 0.001 m^3; l = 1 L
kg = [mass]; g = 0.001 kg; lb = 0.45359237 kg; oz = 0.028349523125 kg; mol = [substance]; percent = 0.01
s = [time]; min = 60 s; h = 3600 s; day = 86400 s; Hz = 1 1/s
rad = [angle]; deg = 0.017453292519943295 rad; rev = 6.283185307179586 rad
K = [temperature]; degC = 1 K; degF = 0.5555555555555555555555555556 K
N = 1 kg m/s^2; lbf = 4.4482216152605 N; ozf = 0.27801385095378125 N; kgf = 9.80665 N; J = 1 N m; W = 1 J/s
Pa = 1 N/m^2; bar = 1e5 Pa; psi = {PASCALS_PER_PSI!r} Pa; atm = 101325 Pa; Torr = 133.3223684210526 Pa
mHg = 133322.387415 Pa; inHg = 3386.388640341 Pa; mWC = 9806.65 Pa; inWC = 249.08891 Pa
"""
_PRODUCTS = """
rev/min = rpm RPM; L/min = lpm LPM Lpm LM; ft^3/min = cfm CFM; ft^3/h = cfh CFH; cm^3/min = ccpm CCM; cm^3 = cc ccm
mm^2 = qmm sqmm; in^2 = sqin; in^3 = cuin; ft^3 = cuft; kgf/cm^2 = at
"""
_WORDS = """
m = metre metres meter meters; in = inch inches; ft = foot feet; L = litre litres liter liters ltr
K = degK kelvin Kelvin; g = gram grams; lb = lbs pound pounds; oz = ounce ounces; lbf = lbfs; kgf = kp; mol = mole moles
s = sec secs second seconds; ms = msec msecs; us = usec; min = mins minute minutes; h = hr hrs hour hours; day = days
rad = rads radian radians; deg = degs degree degrees; rev = revs revolution revolutions; Hz = hz HZ hertz
degC = celsius Celsius; degF = fahrenheit Fahrenheit; N = newton newtons; J = joule joules; W = watt watts; Torr = torr
bar = bars Bar BAR; mbar = mBar MBAR; psi = Psi PSI; kpsi = ksi; Pa = pascal pascals PA; kPa = kpa KPa KPA kPA
"""
_PREFIXES = "micro u -6; milli m -3; centi c -2; deci d -1; deca da 1; hecto h 2; kilo k 3; mega M 6"


def _entries(table: str) -> list[list[str]]:
    return [entry.split(" = ") for line in table.strip().splitlines() for entry in line.split("; ")]


UNITS = {name: definition for name, definition in _entries(_DEFINITIONS)}
"""Base dimension, or number and units above, of each unit."""
_DEFINED = UNITS | {word: f"1 {unit}" for unit, words in _entries(_PRODUCTS) for word in words.split()}
_NAME_OF = {word: unit for unit, words in _entries(_WORDS) for word in words.split()}
_LONG = {word: prefix for word, prefix, _ in map(str.split, _PREFIXES.split("; "))}
PREFIXES = {prefix: int(power) for _, prefix, power in map(str.split, _PREFIXES.split("; "))}
"""Powers of ten."""
_OFFSETS = {"degC": Decimal("273.15"), "degF": Decimal("255.3722222222222222222222222")}
_PRESSURE = {"[mass]": 1, "[length]": -1, "[time]": -2}
DECIMALS = decimal.Context(prec=28, rounding=decimal.ROUND_HALF_EVEN)
"""Decimal context of unit arithmetic, independent of the settings of a host program."""
_POWER = re.compile(r"([A-Za-z]+(?:_[gad])?)(?:\^(-?[1-9]))?")


class ParsedUnit(NamedTuple):
    """Unit as data: value in base units (m, kg, s, K, mol, rad) = ``scale`` * value + ``offset``.

    ``dimensions`` maps each base dimension, such as ``[mass]`` and ``[angle]``, to its power. ``kind`` is ``g``, ``a``
    or ``d`` for a gauge or absolute pressure or a difference, else empty.
    """

    scale: Decimal
    offset: Decimal
    dimensions: dict[str, int]
    kind: str = ""

    @property
    def is_pressure(self) -> bool:
        """Return whether it is a unit of pressure."""
        return self.dimensions == _PRESSURE


class UnknownUnitError(UnitError):
    """Unknown name in a unit, with the names that exist."""

    def __init__(self, name: str, hint: str = "") -> None:
        """Store the unknown name, for a hint in another message."""
        self.name = name
        others = ", ".join(other for other in UNITS if other not in PRESSURES)
        super().__init__(
            f"'{name}' is not a known unit{hint}; available: {others}, pressures as psi_g, psi_a, psi_d (in a compound "
            f"psi) and {', '.join(PRESSURES)} likewise, with the prefixes {', '.join(PREFIXES)}"
        )


@functools.cache
def names() -> frozenset[str]:
    """Return all unit names with all prefixes."""
    return frozenset(prefix + unit for unit in UNITS for prefix in ("", *PREFIXES))


def usual_name(word: str) -> str:
    """Return the name in ``UNITS``, with a short prefix, of a unit in words: ``kPa`` for ``kilopascals``."""
    long = next((each for each in _LONG if word.startswith(each)), "")
    rest = word.removeprefix(long)
    return _LONG.get(long, "") + _NAME_OF.get(rest, rest) if rest in {**_NAME_OF, **UNITS} else word


@functools.cache
def named(name: str) -> ParsedUnit:
    """Return the unit of a name. Raises UnknownUnitError for an unknown one."""
    if name in _DEFINED:
        number, _, unit = _DEFINED[name].partition(" ")
        if number[0] == "[":
            return ParsedUnit(Decimal(1), Decimal(0), {number: 1})
        scale, _, dimensions, _ = product(unit)
        return ParsedUnit(DECIMALS.multiply(Decimal(number), scale), _OFFSETS.get(name, Decimal(0)), dimensions)
    prefix = next((each for each in PREFIXES if name.startswith(each) and name[len(each) :] in UNITS), None)
    if prefix is None:
        raise UnknownUnitError(name)
    bare = named(name.removeprefix(prefix))
    if bare.offset:
        raise UnitError("degC and degF take no prefix; give degC, degF or K")
    return bare._replace(scale=DECIMALS.scaleb(bare.scale, PREFIXES[prefix]))


def product(unit: str) -> ParsedUnit:
    """Return the unit of a product in normal spelling, such as ``N m s/rad``; a unit alone keeps its offset.

    Raises UnknownUnitError.
    """
    if unit.isalpha():
        return named(unit)
    scale, powers = Decimal(1), dict[str, int]()
    for place, part in enumerate(unit.split("/")):
        for name, power in _POWER.findall(part):
            factor, exponent = named(name), int(power or 1) * (-1 if place else 1)
            scale = DECIMALS.multiply(scale, DECIMALS.power(factor.scale, exponent))
            for dimension, of_factor in factor.dimensions.items():
                powers[dimension] = powers.get(dimension, 0) + of_factor * exponent
    return ParsedUnit(scale, Decimal(0), {dimension: power for dimension, power in powers.items() if power})


PRESSURES = [name for name in UNITS if named(name).is_pressure]
"""Pressure units of a single word."""
