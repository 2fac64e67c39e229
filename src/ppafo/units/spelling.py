"""Units as people write them, read by pint; volume flows at a reference condition as mass flows.

A spelling is brought to a normal form such as ``N m s/rad``, ``mm^2``, ``L/(s bar)``, ``psi_g``, only where it is
unambiguous. The list of units is short, so that a misspelling is an error. Factors are decimals, so that 8.4 g is the
float nearest to 0.0084 kg.

A volume flow with condition and gas, ``L/min (ANR, air)``, is the mass flow ``rho q``, where rho = p M/(R T) is the
density of an ideal gas of molar mass M. Air in the atmosphere of ISO 8778, which is humid, has the 1.185 kg/m^3 of ISO
6358. Normal litres, slm and SCFM do not state their condition: manufacturers mean 0, 15, 20, 21.1 or 25 degC by them.
"""

import decimal
import functools
import re
from decimal import Decimal
from typing import TYPE_CHECKING, Any, NamedTuple

from ppafo.constants import (
    MOLAR_GAS_CONSTANT,
    MOLAR_MASSES,
    PASCALS_PER_PSI,
    STANDARD_ATMOSPHERE,
    STANDARD_REFERENCE_DENSITY_AIR,
    STANDARD_REFERENCE_TEMPERATURE,
)
from ppafo.errors import UnitError
from ppafo.wording import nearest_name

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
"""Units that messages list, by their symbols; the last are the pressures."""
_PRESSURES = UNITS[UNITS.index("Pa") :]
_IN_PLURAL = ("lb", "lbf", "sec", "msec", "usec", "min", "hr", "rad", "deg", "rev")
"""Symbols that people write with an s; of others it is a second: ``Ns`` is N s."""
_PREFIX = "u|m|c|d|da|h|k|M"
_NAMES = [prefix + unit for prefix in ("", *_PREFIX.split("|")) for unit in UNITS]
"""Names of all units with all prefixes; written in capitals, 'MM' is more often a small unit than a large one."""
DECIMALS = decimal.Context(prec=28, rounding=decimal.ROUND_HALF_EVEN)
"""Decimal context of unit arithmetic, independent of the settings of a host program."""
_PRESSURE = {"[mass]": 1, "[length]": -1, "[time]": -2}
_MOLAR_MASS = {"[mass]": 1, "[substance]": -1}
MASS_FLOW = {"[mass]": 1, "[time]": -1}
_VOLUME_FLOW = {"[length]": 3, "[time]": -1}
_LONGEST = 60
_FACTOR = r"[A-Za-z]+(?:_[gad])?(?:\^-?[1-9])?"
_PRODUCT = rf"{_FACTOR}(?: {_FACTOR})*"
_EXPRESSION = re.compile(rf"(?:1|{_PRODUCT})(?:/(?:{_FACTOR}|\({_PRODUCT}\)))*")
_CHARACTERS = str.maketrans("·⋅\u00d7*\u00a0\u202f\u2212\u2013\u2215\u2044μµ¹", "      --//uu1") | {
    ord(sign): word for sign, word in zip("²³⁻°℃℉%", ("^2", "^3", "^-", "deg", "degC", "degF", "percent"), strict=True)
}
_KIND_WORD = "g|ga|gauge|rel|relative|ü|ue|a|abs|absolute|d|diff|differential|difference"
_LETTER = {"r": "g", "ü": "g", "u": "g"}
_KIND = re.compile(
    rf"(?P<unit>((?:{_PREFIX})?(?:{'|'.join(_PRESSURES)})|at|ksi)[ _]?|.+_|.+/.+?(?: |(?=\()|(?<=cm\^2)))"
    rf"\(?(?P<word>{_KIND_WORD})\.?\)?",
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
_FEW = sorted(UNITS, key=len)
_FIRST = rf"((?:{_PREFIX})?(?:{'|'.join(_FEW[::-1])}))"
_NEXT = rf"((?:{_PREFIX})??(?:{'|'.join(_FEW)}))"
_JOINED = re.compile(rf"{_FIRST}(?!\1){_NEXT}(?:(?!\1|\2){_NEXT}(?:(?!\1|\2|\3){_NEXT})?)?")
"""Two to four joined units, each of them once.

The first is as long as it can be: mbarl is mbar L, and no metre times bar. The others are as short: Nms is N m s.
"""
_KIND_BELONGS = "_g, _a and _d are allowed only for a single unit of pressure, such as psi_g"
_CONDITIONS = {
    **dict.fromkeys(("ANR", "ISO 8778", "ISO 6358"), (STANDARD_REFERENCE_TEMPERATURE, 1.0e5, True)),
    "DIN 1343": (273.15, STANDARD_ATMOSPHERE, False),
    "ISO 2533": (288.15, STANDARD_ATMOSPHERE, False),
}
"""Temperature [K], pressure [Pa] and humidity of pneumatics, of normal litres, of the atmosphere at sea level."""
_GASES = {name.lower(): mass for name, mass in MOLAR_MASSES.items()}
_AS_AIR = 5.0e-3
"""Relative deviation from the molar mass of air [-] within which a gas counts as air."""
_QUANTITY = re.compile(r"\s*([+-]?\d+(?:[.,]\d*)?(?:[eE][+-]?\d+)?)\s*(\S.*?)\s*")
# Words behind a unit, as in bar (abs) or kgf/cm^2 (g), are no condition.
_BEHIND = re.compile(
    rf"(?P<flow>.*[^/ ]) *\((?!(?i:{_KIND_WORD})\.?\))(?P<words>[^()]*)\)|(?P<bare>.*[^/ ])[ _]+(?P<name>ANR)"
)
_NORMAL = re.compile(
    r"(?:(?i:std\.?|standard|norm\.?|normal) +|[NSns](?=c?m\^?[23³]/|[lL]/|cc/))(?P<volume>[^ ]+/.+)"
    r"|(?P<milli>m?)[lL](?:[ns]|\(n\))(?P<per>/\w+)|[NnSs](?P<word>[lL]p?m|LP?M|(?i:ccm|cf[mh]))"
)


class ParsedUnit(NamedTuple):
    """Unit as data: value in base units (m, kg, s, K, mol, rad) = ``scale`` * value + ``offset``.

    ``dimensions`` maps each base dimension, such as ``[mass]`` and ``[angle]``, to its power. ``kind`` is ``g``, ``a``
    or ``d`` for a gauge or absolute pressure or a difference, else empty.
    """

    scale: Decimal
    offset: Decimal
    dimensions: dict[str, int]
    kind: str = ""


class WrittenFlow(NamedTuple):
    """Unit as written and as a flow without the word for normal; reference condition and gases, empty if not stated."""

    name: str
    unit: str
    is_normal: bool = False
    condition: str = ""
    gases: tuple[str, ...] = ()

    @property
    def is_stated(self) -> bool:
        """Return whether a condition or a gas is stated."""
        return bool(self.condition or self.gases)

    def at(self, condition: str, gas: str) -> str:
        """Return the unit with the condition and gas where it does not state its own."""
        whole = ", ".join(filter(None, (self.condition or condition, *(self.gases or (gas,)))))
        return f"{self.name} ({whole})" if whole else self.name


def flow_of(unit: str) -> WrittenFlow:
    """Split a unit into volume flow, whether it is a normal or standard one, condition and gases."""
    text = unit.strip()
    words = ""
    if match := _BEHIND.fullmatch(text):
        text = match["flow"] or match["bare"]
        words = match["words"] or match["name"] or ""
    said = [word.strip() for word in _split(words) if word.strip()]
    gases = tuple(word for word in said if word.lower() in _GASES or word.endswith("/mol"))
    flow = text
    normal = _NORMAL.fullmatch(text)
    if normal:
        flow = (normal["word"] or "").upper() or normal["volume"] or f"{normal['milli']}L{normal['per']}"
    return WrittenFlow(text, flow, normal is not None, ", ".join(word for word in said if word not in gases), gases)


def _split(words: str) -> list[str]:
    """Split words at commas, semicolons or 'and'; a comma between digits is a decimal comma."""
    return re.split(r"(?<!\d),|,(?!\d)|;|\band\b|&|@", words)


def is_volume_flow(unit: str) -> bool:
    """Return whether a unit is a volume per time, with or without condition. Raises UnitError if invalid."""
    flow = flow_of(unit)
    return flow.is_normal or parse_unit(flow.unit).dimensions == _VOLUME_FLOW


def read_unit(unit: str, is_mass_flow: bool = False) -> ParsedUnit:
    """Parse a unit; a volume flow with condition and gas becomes a mass flow.

    Raises UnitError for an invalid unit, a condition without gas, and a normal flow, or any as a mass flow, without
    condition.
    """
    flow = flow_of(unit)
    is_volume = (flow.is_stated or flow.is_normal or is_mass_flow) and parse_unit(flow.unit).dimensions == _VOLUME_FLOW
    if flow.is_stated and not is_volume:
        raise UnitError(f"'{unit}': a reference condition belongs to a volume flow, such as 'L/min (ANR, air)'")
    if not is_volume:
        return parse_unit(unit)
    temperature, pressure, is_humid = _condition_of(flow.condition, unit)
    if len(flow.gases) != 1:
        example = "L/min (ANR, air)" if flow.gases else flow.at("", "air")
        raise UnitError(
            f"'{unit}' states {'two gases' if flow.gases else 'no gas'}: write one gas, for example '{example}'; "
            f"allowed: {', '.join(MOLAR_MASSES)}, or a molar mass in kg/mol"
        )
    mass = _molar_mass(flow.gases[0])
    density = (
        STANDARD_REFERENCE_DENSITY_AIR
        if is_humid and abs(mass / MOLAR_MASSES["air"] - 1.0) < _AS_AIR
        else pressure * mass / (MOLAR_GAS_CONSTANT * temperature)
    )
    scale = DECIMALS.multiply(parse_unit(flow.unit).scale, Decimal(repr(density)))
    return ParsedUnit(scale, Decimal(0), MASS_FLOW)


def _condition_of(text: str, unit: str) -> tuple[float, float, bool]:
    """Parse a reference condition: a name, or temperature and pressure. Raises UnitError for other text."""
    name = re.sub(r"[\s_-]+", " ", text).upper()
    if name in _CONDITIONS:
        return _CONDITIONS[name]
    words = _split(text)
    values = {str(unit.dimensions): value for value, unit in _quantities(words) if unit.kind in ("", "a")}
    temperature, pressure = (values.get(str(of), 0.0) for of in ({"[temperature]": 1}, _PRESSURE))
    if len(words) == 2 and min(temperature, pressure) > 0.0:
        return temperature, pressure, False
    said = f": '{text}' is no reference condition{nearest_name(name, _CONDITIONS)}" if text else " is a volume flow"
    flow = flow_of(unit)._replace(condition="")
    named, own = (flow.at(condition, "air") for condition in ("ANR", "70 degF, 14.696 psi_a"))
    raise UnitError(
        f"'{flow.name}'{said}; a mass flow needs a gas and a condition ({', '.join(_CONDITIONS)}, or temperature and "
        f"pressure): write '{named}' (20 degC, 1 bar) or '{own}'; in a column map give at = 'ANR'"
    )


def molar_mass_in(unit: str) -> float | None:
    """Return the molar mass [kg/mol] of the gas that a unit of flow states, or None, as for 'L/min (ANR)'."""
    gases = flow_of(unit).gases
    return _molar_mass(gases[0]) if gases else None


def _molar_mass(word: str) -> float:
    """Return the molar mass [kg/mol] of a gas, given by name or as a molar mass with unit."""
    if word.lower() in _GASES:
        return _GASES[word.lower()]
    masses = [value for value, unit in _quantities([word]) if unit.dimensions == _MOLAR_MASS and value > 0.0]
    if not masses:
        raise UnitError(f"'{word}' is not a molar mass, such as '0.044 kg/mol'")
    return masses[0]


def _quantities(words: list[str]) -> list[tuple[float, ParsedUnit]]:
    """Return the value in base units and the unit of each word that is a number with a unit."""
    matches = [match for word in words if (match := _QUANTITY.fullmatch(word))]
    numbers = [(Decimal(match[1].replace(",", ".")), parse_unit(match[2])) for match in matches]
    return [(float(DECIMALS.fma(number, unit.scale, unit.offset)), unit) for number, unit in numbers]


@functools.lru_cache(maxsize=512)
def parse_unit(unit: str) -> ParsedUnit:
    """Parse a unit with the kind of a pressure. Raises UnitError for an unknown unit."""
    bare, kind = split_pressure_kind(unit)
    for word in re.findall(r"[A-Za-z_]+", bare):
        symbol = _symbol(word)
        if not symbol and word[-2:] in ("_g", "_a", "_d"):
            raise UnitError(f"'{word}': {_KIND_BELONGS}")
        if not symbol:
            raise UnitError(
                f"'{word}' is not a known unit{nearest_name(word, _NAMES)}; available: {', '.join(UNITS)}, with the "
                f"prefixes {_PREFIX.replace('|', ', ')}; pressures as psi_g, psi_a, psi_d, in a compound psi"
            )
        if symbol.endswith(("degC", "degF")) and len(symbol) > len("degC"):
            raise UnitError(f"'{unit}': degC and degF take no prefix; give degC, degF or K")
    registry = _registry()
    parsed = registry.parse_units(bare.replace("^", "**").replace(" ", "*"))
    dimensions = {name: int(str(power)) for name, power in parsed.dimensionality.items()}
    # Only a pressure has a zero that may lie at the atmosphere.
    if kind and dimensions != _PRESSURE:
        raise UnitError(f"'{unit}': {_KIND_BELONGS}")
    # Units are affine: their values at 0 and 1 give scale and offset.
    with decimal.localcontext(DECIMALS):
        offset, one = (registry.Quantity(Decimal(number), parsed).to_base_units().magnitude for number in (0, 1))
        return ParsedUnit(one - offset, Decimal(offset), dimensions, kind)


@functools.cache
def _registry() -> "pint.UnitRegistry[Any]":
    import pint

    with decimal.localcontext(DECIMALS):
        registry: pint.UnitRegistry[Any] = pint.UnitRegistry(None, non_int_type=Decimal)
        registry.load_definitions(
            f"{_PREFIXES}\n{_UNITS}".replace("; offset", ";offset").replace("; ", "\n").split("\n")
        )
    return registry


@functools.lru_cache(maxsize=512)
def _symbol(word: str) -> str:
    """Return the symbol of a unit, with its prefix: ``kPa`` for ``kilopascals``; empty for an unknown word."""
    known = _registry().parse_unit_name(word) if word.isalpha() else ()
    for prefix, unit, _ in known:
        singular = word.removesuffix("s")
        is_plural = singular != word and (prefix, unit) in [each[:2] for each in _registry().parse_unit_name(singular)]
        if not is_plural or len(singular) > 4 or singular in (prefix + unit, *_IN_PLURAL):
            return str(_registry().get_symbol(prefix + unit))
    return ""


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
        normal = match["unit"].rstrip(" _")
        kind = _LETTER.get(letter, letter)
    # A plain number has this unit in tables and results.
    normal = "1" if normal == "-" else re.sub(r"[A-Za-z]+", lambda word: _symbol(word[0]) or word[0], normal)
    if normal and (len(normal) > _LONGEST or not _EXPRESSION.fullmatch(normal)):
        raise UnitError(f"{quote(unit)} is not a unit; write a unit like 'mm^2', 'N m s/rad' or 'm^3/(s Pa)'")
    spaced = re.sub(r"[A-Za-z]+(?![A-Za-z]|_[gad])", lambda word: _as_product(word[0]) or word[0], normal)
    # J/kgK has both kg and K in its denominator.
    normal = re.sub(rf"/({_FACTOR}(?: {_FACTOR})+)", r"/(\1)", spaced) if spaced != normal else normal
    force = _FORCES.fullmatch(normal)
    return force.expand(r"\1\4\5f\6") + (
        f" {force[2] or force[3]}" if force[6] is None else ""
    ) if force else normal, kind


def _as_product(name: str) -> str:
    """Split a joined name into known units, ``Nmm`` into ``N mm``; empty if already known or no product."""
    # A letter typed twice, as in degg, is no product.
    is_name = _symbol(name) or _symbol(re.sub(r"(.)\1", r"\1", name))
    match = None if is_name else _JOINED.fullmatch(name)
    return "" if match is None else " ".join(filter(None, match.groups()))


def quote(text: object) -> str:
    """Quote a value for a message, shortened to one line."""
    quoted = repr(text)
    return quoted if len(quoted) <= 50 else f"{quoted[:46]}...'"
