"""Volume flow at a reference condition as mass flow of a gas: ``L/min (ANR, air)``.

``m_dot = rho q``, where rho = p M/(R T) is the density of an ideal gas of molar mass M at the condition. Air in the
atmosphere of ISO 8778, which is humid, has the 1.185 kg/m^3 of ISO 6358.

Normal litres, slm and SCFM do not state their condition: manufacturers mean 0, 15, 20, 21.1 or 25 degC by them.
"""

import re
from decimal import Decimal
from typing import NamedTuple

from ppafo.constants import (
    MOLAR_GAS_CONSTANT,
    MOLAR_MASSES,
    STANDARD_ATMOSPHERE,
    STANDARD_REFERENCE_DENSITY_AIR,
    STANDARD_REFERENCE_TEMPERATURE,
)
from ppafo.errors import UnitError
from ppafo.units.definitions import DECIMALS, PRESSURE, ParsedUnit, parse_unit
from ppafo.units.spelling import says_kind
from ppafo.wording import nearest_name

MASS_FLOW = {"[mass]": 1, "[time]": -1}
VOLUME_FLOW = {"[length]": 3, "[time]": -1}
_MOLAR_MASS = {"[mass]": 1, "[substance]": -1}


class Condition(NamedTuple):
    """Reference condition of a gas volume: temperature [K], pressure [Pa absolute], humid as in ISO 8778 or dry."""

    temperature: float
    pressure: float
    is_humid: bool = False


_ANR = Condition(STANDARD_REFERENCE_TEMPERATURE, 1.0e5, is_humid=True)
CONDITIONS: dict[str, Condition] = {
    "ANR": _ANR,
    "ISO 8778": _ANR,
    "ISO 6358": _ANR,
    "DIN 1343": Condition(273.15, STANDARD_ATMOSPHERE),
    "ISO 2533": Condition(288.15, STANDARD_ATMOSPHERE),
}
"""Reference conditions by name: pneumatics, normal litres, standard atmosphere at sea level."""

_BEHIND = re.compile(r"(?P<flow>.*[^/ ]) *\((?P<words>[^()]*)\)|(?P<bare>.*[^/ ])[ _]+(?P<name>ANR)")
_NORMAL = re.compile(
    r"(?:(?i:std\.?|standard|norm\.?|normal) +|[NSns](?=c?m\^?[23³]/|[lL]/|cc/))(?P<volume>[^ ]+/.+)"
    r"|(?P<milli>m?)[lL](?:[ns]|\(n\))/(?P<per>\w+)"
    r"|(?P<word>[NnSs][lL]p?m|[NS]LP?M|[Ss][Cc][Cc][Mm]|[Ss][Cc][Ff][MmHh])"
)
_WORDS = {"ccm": "cm^3/min", "cfm": "ft^3/min", "cfh": "ft^3/h"}
_EXAMPLE = "70 degF, 14.696 psi_a"


def flow_of(unit: str) -> tuple[str, str, bool]:
    """Split a unit into volume flow, words after it, and a flag for normal or standard flow.

    The words are the condition and the gas, if given; otherwise empty.
    """
    text = unit.strip()
    behind = _BEHIND.fullmatch(text)
    flow = text if behind is None else behind["flow"] or behind["bare"]
    words = "" if behind is None else behind["words"] or behind["name"] or ""
    # What stands behind bar (abs) or kgf/cm^2 (g) is no condition.
    if words and says_kind(text):
        return text, "", False
    normal = _NORMAL.fullmatch(flow)
    if normal is None:
        return flow, words, False
    if normal["word"]:
        word = normal["word"].lower()
        return _WORDS.get(word[1:], "L/min"), words, True
    return normal["volume"] or f"{normal['milli']}L/{normal['per']}", words, True


def is_volume_flow(unit: str) -> bool:
    """Return whether a unit is a volume per time, with or without condition. Raises UnitError if invalid."""
    flow, _, is_normal = flow_of(unit)
    return is_normal or parse_unit(flow)[0].dimensions == VOLUME_FLOW


def with_condition(unit: str, condition: str, gas: str) -> str:
    """Add reference condition and gas to a unit of volume flow."""
    flow, words, is_normal = flow_of(unit)
    place, own = condition_and_gases(words)
    name = unit.strip() if not words else unit.strip().removesuffix(")").removesuffix(words).rstrip(" (_")
    whole = ", ".join(filter(None, (place or condition, *(own or (gas,)))))
    return f"{name if is_normal else flow} ({whole})" if whole else unit


def read_unit(unit: str) -> tuple[ParsedUnit, str]:
    """Parse a unit with the kind of a pressure; a volume flow with condition and gas becomes a mass flow.

    Raises UnitError for an invalid unit, a normal flow without condition, and a condition without gas.
    """
    flow, words, is_normal = flow_of(unit)
    if not words and not is_normal:
        return parse_unit(unit)
    parsed, _ = parse_unit(flow)
    if parsed.dimensions != VOLUME_FLOW:
        if is_normal:
            return parse_unit(unit)
        raise UnitError(f"'{unit}': a reference condition belongs to a volume flow, such as 'L/min (ANR, air)'")
    if not words:
        raise UnitError(without_condition(unit))
    place, gases = condition_and_gases(words)
    condition = condition_of(place, unit)
    if len(gases) != 1:
        example = with_condition(unit, "", "air") if not gases else "L/min (ANR, air)"
        raise UnitError(
            f"'{unit}' {'states no gas' if not gases else 'states two gases'}: write one gas, for example '{example}'; "
            f"allowed: {', '.join(MOLAR_MASSES)}, or a molar mass in kg/mol"
        )
    factor = Decimal(repr(density(condition, _molar_mass(gases[0]))))
    return ParsedUnit(DECIMALS.multiply(parsed.scale, factor), Decimal(0), MASS_FLOW), ""


def molar_mass_in(unit: str) -> float | None:
    """Return the molar mass [kg/mol] of the gas that a unit of flow states, such as air in 'L/min (ANR, air)'.

    None for a unit without a gas.
    """
    gases = condition_and_gases(flow_of(unit)[1])[1]
    return _molar_mass(gases[0]) if gases else None


def _molar_mass(word: str) -> float:
    """Return the molar mass [kg/mol] of a gas, given by name or as a molar mass with unit."""
    known = {name.lower(): mass for name, mass in MOLAR_MASSES.items()}.get(word.lower())
    if known is not None:
        return known
    match = re.fullmatch(r"\s*(\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)\s*(\S+)\s*", word)
    of_gas = None if match is None else parse_unit(match[2])[0]
    if match is None or of_gas is None or of_gas.dimensions != _MOLAR_MASS or not float(match[1]) > 0.0:
        raise UnitError(f"'{word}' is not a molar mass, such as '0.044 kg/mol'")
    return float(of_gas.in_base(Decimal(match[1])))


def without_condition(unit: str, gas: str = "") -> str:
    """Return the message on a volume flow without reference condition and gas, given for a mass flow.

    ``gas`` is the gas of the bench by name or molar mass, empty if unknown.
    """
    named, normal, own = (with_condition(unit, at, "air") for at in ("ANR", "DIN 1343", _EXAMPLE))
    other = f"where the gas is {gas}" if gas else "with another gas"
    is_air = bool(gas) and abs(_molar_mass(gas) / MOLAR_MASSES["air"] - 1.0) < _AS_AIR
    too = "" if is_air else f"; in a [[procedure]] {other}, give gas = 'air' too"
    return (
        f"'{unit}' is a volume flow, which is a mass flow only with a reference condition and a gas: write '{named}' "
        f"(20 degC, 1 bar), '{normal}' (0 degC, 1.01325 bar) or '{own}', as in the data sheet of the meter; in a "
        f"column map give at = 'ANR' and gas = 'air'{too}"
    )


def density(condition: Condition, molar_mass: float) -> float:
    """Return the density of an ideal gas [kg/m^3], ``p M/(R T)``; for air at ANR the density of ISO 6358."""
    if condition.is_humid and abs(molar_mass / MOLAR_MASSES["air"] - 1.0) < _AS_AIR:
        return STANDARD_REFERENCE_DENSITY_AIR
    return condition.pressure * molar_mass / (MOLAR_GAS_CONSTANT * condition.temperature)


_AS_AIR = 5.0e-3
"""Relative deviation from the molar mass of air [-] within which a gas counts as air."""


def condition_of(text: str, unit: str) -> Condition:
    """Parse a reference condition: a name, or temperature and pressure. Raises UnitError for other text."""
    name = re.sub(r"[\s_-]+", " ", text).upper()
    if name in CONDITIONS:
        return CONDITIONS[name]
    temperature = pressure = None
    for word in _split(text):
        match = re.fullmatch(r"\s*([+-]?\d+(?:[.,]\d+)?)\s*(\S.*?)\s*", word)
        if match is None:
            break
        parsed, kind = parse_unit(match[2])
        value = parsed.in_base(Decimal(match[1].replace(",", ".")))
        if parsed.dimensions == {"[temperature]": 1} and value > 0:
            temperature = float(value)
        elif parsed.dimensions == PRESSURE and kind in ("", "a") and value > 0:
            pressure = float(value)
        else:
            break
    else:
        if temperature is not None and pressure is not None:
            return Condition(temperature, pressure)
    names = ", ".join(CONDITIONS)
    raise UnitError(
        f"'{unit}': '{text}' is not a reference condition{nearest_name(name, CONDITIONS)}; use {names}, or a "
        f"temperature and an absolute pressure, such as '{_EXAMPLE}'"
    )


def _split(words: str) -> list[str]:
    """Split words at commas, semicolons or 'and'; a comma between digits is a decimal comma."""
    return re.split(r"(?<!\d),|,(?!\d)|;|\band\b|&|@", words)


def condition_and_gases(words: str) -> tuple[str, list[str]]:
    """Split the words after a flow into reference condition, and gases or molar masses."""
    said = [word.strip() for word in _split(words) if word.strip()]
    known = [name.lower() for name in MOLAR_MASSES]
    gases = [word for word in said if word.lower() in known or word.endswith("/mol")]
    return ", ".join(word for word in said if word not in gases), gases
