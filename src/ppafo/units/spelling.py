"""Units as people write them, read by pint.

A spelling is brought to a normal form such as ``N m s/rad``, ``mm^2``, ``L/(s bar)``, ``psi_g``, only where it is
unambiguous. The list of units is short, so that a misspelling is an error. Factors are decimals, so that 8.4 g is the
float nearest to 0.0084 kg.
"""

import decimal
import functools
import re
from decimal import Decimal
from typing import TYPE_CHECKING, Any, NamedTuple

from ppafo.constants import PASCALS_PER_PSI
from ppafo.errors import UnitError

if TYPE_CHECKING:
    import pint

_PREFIXES = """micro- = 1e-6 = u-; milli- = 1e-3 = m-; centi- = 1e-2 = c-; deci- = 1e-1 = d-; deca- = 10 = da-
hecto- = 1e2 = h-; kilo- = 1e3 = k-; mega- = 1e6 = M-"""
_UNITS = f"""metre = [length] = m = meter; inch = 0.0254 m = in = inches; foot = 0.3048 m = ft = feet
litre = 0.001 m^3 = L = l = liter = ltr
kilogram = [mass] = kg; gram = 0.001 kg = g; pound = 0.45359237 kg = lb; ounce = 0.028349523125 kg = oz
mole = [substance] = mol; percent = 0.01; second = [time] = s = sec; minute = 60 s = min; hour = 3600 s = h = hr
day = 86400 s; hertz = 1/s = Hz = hz = HZ; KHz = kHz; radian = [angle] = rad
degree = 0.017453292519943295 rad = deg; revolution = 6.283185307179586 rad = rev
kelvin = [temperature] = K = Kelvin = degK; celsius = K; offset: 273.15 = degC = Celsius
fahrenheit = 0.5555555555555555555555555556 K; offset: 255.3722222222222222222222222 = degF = Fahrenheit
newton = kg m/s^2 = N; pound_force = 4.4482216152605 N = lbf; ounce_force = 0.27801385095378125 N = ozf
kilogram_force = 9.80665 N = kgf = kp; joule = N m = J; watt = J/s = W
pascal = N/m^2 = Pa = PA; bar = 1e5 Pa = _ = Bar = BAR; atm = 101325 Pa; torr = 133.3223684210526 Pa = Torr
pound_per_square_inch = {PASCALS_PER_PSI!r} Pa = psi = Psi = PSI; metre_of_mercury = 133322.387415 Pa = mHg
inch_of_mercury = 3386.388640341 Pa = inHg; metre_of_water = 9806.65 Pa = mWC; inch_of_water = 249.08891 Pa = inWC
rpm = rev/min = _ = RPM; lpm = L/min = _ = LPM = Lpm = LM; cfm = ft^3/min = _ = CFM; cfh = ft^3/h = _ = CFH
ccpm = cm^3/min = _ = CCM; cc = cm^3 = _ = ccm; at = kgf/cm^2; ksi = kpsi; mBar = mbar = _ = MBAR
KPa = kPa = _ = KPA = kpa = kPA; qmm = mm^2 = _ = sqmm; sqin = in^2; cuin = in^3; cuft = ft^3"""
UNITS = (
    *("m", "in", "ft", "L", "l", "kg", "g", "lb", "oz", "mol", "percent", "s", "min", "h", "day", "Hz", "rad", "deg"),
    *("rev", "K", "degC", "degF", "N", "lbf", "ozf", "kgf", "J", "W", "Pa", "bar", "psi", "atm", "Torr", "mHg"),
    *("inHg", "mWC", "inWC"),
)
"""Units that take prefixes and that messages list, by their symbols."""
PRESSURES = UNITS[UNITS.index("Pa") :]
_IN_PLURAL = ("lb", "lbf", "sec", "msec", "usec", "min", "hr", "rad", "deg", "rev")
"""Symbols that people write with an s; of others it is a second: ``Ns`` is N s."""
PREFIXES = ("u", "m", "c", "d", "da", "h", "k", "M")
DECIMALS = decimal.Context(prec=28, rounding=decimal.ROUND_HALF_EVEN)
"""Decimal context of unit arithmetic, independent of the settings of a host program."""
_PRESSURE = {"[mass]": 1, "[length]": -1, "[time]": -2}
_LONGEST = 60
_PREFIX = "|".join(PREFIXES)
_FACTOR = r"[A-Za-z]+(?:_[gad])?(?:\^-?[1-9])?"
_PRODUCT = rf"{_FACTOR}(?: {_FACTOR})*"
_EXPRESSION = re.compile(rf"(?:1|{_PRODUCT})(?:/(?:{_FACTOR}|\({_PRODUCT}\)))*")
_CHARACTERS = str.maketrans("·⋅\u00d7*\u00a0\u202f\u2212\u2013\u2215\u2044μµ¹", "      --//uu1") | {
    ord(sign): word for sign, word in zip("²³⁻°℃℉%", ("^2", "^3", "^-", "deg", "degC", "degF", "percent"), strict=True)
}
KIND_WORD = "g|ga|gauge|rel|relative|ü|ue|a|abs|absolute|d|diff|differential|difference"
_LETTER = {"r": "g", "ü": "g", "u": "g"}
_KIND = re.compile(
    rf"(?P<unit>((?:{_PREFIX})?(?:{'|'.join(PRESSURES)})|at|ksi)[ _]?|.+_|.+/.+?(?: |(?=\()|(?<=cm\^2)))"
    rf"\(?(?P<word>{KIND_WORD})\.?\)?",
    re.IGNORECASE,
)
"""Kind of a pressure behind one unit or a quotient: ``psig``, ``bar (abs)``, ``kPa gauge``, ``lbf/in^2_a``."""
_SPELLINGS = [
    (re.compile(pattern), normal)
    for pattern, normal in (
        # Heads of water are written with the unit WC (water column).
        (r"\b(mm|cm|m|in) ?(?:H2O|h2o|WS|wc)(?![A-Za-fh-z0-9])", r"\1WC"),
        (r"\bsq\.? ?(mm|cm|m|in|ft)\b", r"\1^2"),
        (r"\bcu\.? ?(mm|cm|m|in|ft)\b", r"\1^3"),
        # m2, s-2, mm3: a power without its sign; in-lb and N.m are products.
        (r"([A-Za-z])(-?[1-9])(?![0-9])", r"\1^\2"),
        (r"(?<=[A-Za-z0-9])[-.](?=[A-Za-z])", " "),
        (r"\bdeg +(?=[CFK]\b)", "deg"),
        (r" *([/()^]) *", r"\1"),
        (r" +", " "),
    )
]
_FORCES = re.compile(r"(lb|oz) (in|ft)|(in|ft) (lb|oz)|(lb|kg)(/(?:in|ft|cm|mm)\^2)")
"""Spellings in which pound, ounce or kilogram is a force."""
_KIND_BELONGS = "_g, _a and _d are allowed only for a single unit of pressure, such as psi_g"


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
def _registry() -> "pint.UnitRegistry[Any]":
    import pint

    with decimal.localcontext(DECIMALS):
        registry: pint.UnitRegistry[Any] = pint.UnitRegistry(None, non_int_type=Decimal)
        registry.load_definitions(
            f"{_PREFIXES}\n{_UNITS}".replace("; offset", ";offset").replace("; ", "\n").split("\n")
        )
    return registry


@functools.cache
def names() -> frozenset[str]:
    """Return all unit names with all prefixes."""
    return frozenset(prefix + unit for unit in UNITS for prefix in ("", *PREFIXES))


@functools.cache
def _meant(word: str) -> tuple[str, str] | None:
    """Return prefix and unit, as pint calls them, of a word; None for an unknown one."""
    known = _registry().parse_unit_name(word) if word.isalpha() else ()
    for prefix, unit, _ in known:
        singular = word.removesuffix("s")
        is_plural = singular != word and (prefix, unit) in [each[:2] for each in _registry().parse_unit_name(singular)]
        if not is_plural or len(singular) > 4 or singular in (prefix + unit, *_IN_PLURAL):
            return prefix, unit
    return None


def is_unit(word: str) -> bool:
    """Return whether a word without a power is one unit."""
    return word in names() or _meant(word) is not None


def usual_name(word: str) -> str:
    """Return the symbol, with its prefix, of a unit in words: ``kPa`` for ``kilopascals``."""
    return word if word in names() or _meant(word) is None else str(_registry().get_symbol(word))


@functools.lru_cache(maxsize=512)
def product(unit: str) -> ParsedUnit:
    """Return the unit of a product in normal spelling, such as ``N m s/rad``; a unit alone keeps its offset.

    Raises UnknownUnitError.
    """
    for word in re.findall(r"[A-Za-z_]+", unit):
        meant = _meant(word)
        if meant is None:
            raise UnknownUnitError(word)
        if meant[0] and meant[1] in ("celsius", "fahrenheit"):
            raise UnitError("degC and degF take no prefix; give degC, degF or K")
    registry = _registry()
    parsed = registry.parse_units(unit.replace("^", "**").replace(" ", "*"))
    # Units are affine: their values at 0 and 1 give scale and offset.
    with decimal.localcontext(DECIMALS):
        offset, one = (registry.Quantity(Decimal(number), parsed).to_base_units().magnitude for number in (0, 1))
        scale = one - offset
    return ParsedUnit(scale, Decimal(offset), {name: int(str(power)) for name, power in parsed.dimensionality.items()})


@functools.lru_cache(maxsize=512)
def split_pressure_kind(unit: str) -> tuple[str, str]:
    """Return a unit in normal spelling without pressure suffix, and its suffix letter ``g``, ``a`` or ``d``.

    Raises UnitError for a text that does not have the form of a unit.
    """
    kind = ""
    normal = unit.replace("**", "^").replace("^^", "^ ^").translate(_CHARACTERS).replace("^-^", "^-").strip(" ")
    for pattern, replacement in _SPELLINGS:
        normal = pattern.sub(replacement, normal)
    if match := _KIND.fullmatch(normal):
        letter = match["word"][0].lower()
        normal, kind = match["unit"].rstrip(" _"), _LETTER.get(letter, letter)
    normal = re.sub(r"[A-Za-z]+", lambda word: usual_name(word[0]), normal)
    if normal and (len(normal) > _LONGEST or not _EXPRESSION.fullmatch(normal)):
        below = _in_brackets(normal)
        is_clear = len(normal) <= _LONGEST and _EXPRESSION.fullmatch(below)
        example = f"'{below}'" if is_clear else "a unit like 'mm^2', 'N m s/rad' or 'm^3/(s Pa)'"
        raise UnitError(f"{quote(unit)} is not a unit; write {example}")
    spaced = re.sub(r"[A-Za-z]+(?![A-Za-z]|_[gad])", lambda word: as_product(word[0]) or word[0], normal)
    normal = _in_brackets(spaced) if spaced != normal else normal
    force = _FORCES.fullmatch(normal)
    return force.expand(r"\1\4\5f\6") + f" {force[2] or force[3]}" * (force[6] is None) if force else normal, kind


def _in_brackets(unit: str) -> str:
    """Put brackets round a product in a denominator: ``J/kg K`` becomes ``J/(kg K)``."""
    return re.sub(rf"/({_FACTOR}(?: {_FACTOR})+)", r"/(\1)", unit)


@functools.lru_cache(maxsize=512)
def parse_unit(unit: str) -> ParsedUnit:
    """Parse a unit with the kind of a pressure. Raises UnitError for an unknown unit."""
    bare, kind = split_pressure_kind(unit)
    try:
        parsed = product(bare)
    except UnknownUnitError as error:
        if re.search("_[gad]$", error.name):
            raise UnitError(f"'{error.name}': {_KIND_BELONGS}") from error
        raise
    except UnitError as error:
        raise UnitError(f"'{unit}': {error}") from error
    # Only a pressure has a zero that may lie at the atmosphere.
    if kind and not parsed.is_pressure:
        raise UnitError(f"'{unit}': {_KIND_BELONGS}")
    return parsed._replace(kind=kind)


@functools.cache
def _joined() -> re.Pattern[str]:
    """Return the pattern of two to four joined units, each of them once.

    The first is as long as it can be: mbarl is mbar L, and no metre times bar. The others are as short: Nms is N m s.
    """
    units = sorted(UNITS, key=len)
    first, more = rf"((?:{_PREFIX})?(?:{'|'.join(units[::-1])}))", rf"((?:{_PREFIX})??(?:{'|'.join(units)}))"
    return re.compile(rf"{first}(?!\1){more}(?:(?!\1|\2){more}(?:(?!\1|\2|\3){more})?)?")


def as_product(name: str) -> str:
    """Split a joined name into known units, ``Nmm`` into ``N mm``; empty if already known or no product."""
    # A letter typed twice, as in degg, is no product.
    is_name = is_unit(name) or is_unit(re.sub(r"(.)\1", r"\1", name))
    match = None if is_name else _joined().fullmatch(name)
    return "" if match is None else " ".join(filter(None, match.groups()))


def quote(text: object) -> str:
    """Quote a value for a message, shortened to one line."""
    quoted = repr(text)
    return quoted if len(quoted) <= 50 else f"{quoted[:46]}...'"
