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
from ppafo.units.spelling import DECIMALS, KIND_WORD, ParsedUnit, parse_unit
from ppafo.wording import nearest_name

MASS_FLOW, VOLUME_FLOW = {"[mass]": 1, "[time]": -1}, {"[length]": 3, "[time]": -1}
_MOLAR_MASS, _TEMPERATURE = {"[mass]": 1, "[substance]": -1}, {"[temperature]": 1}
_CONDITIONS = {
    **dict.fromkeys(("ANR", "ISO 8778", "ISO 6358"), (STANDARD_REFERENCE_TEMPERATURE, 1.0e5, True)),
    "DIN 1343": (273.15, STANDARD_ATMOSPHERE, False),
    "ISO 2533": (288.15, STANDARD_ATMOSPHERE, False),
}
"""Temperature [K], pressure [Pa] and humidity of pneumatics, of normal litres, of the atmosphere at sea level."""
_GASES = {name.lower(): mass for name, mass in MOLAR_MASSES.items()}
_QUANTITY = re.compile(r"\s*([+-]?\d+(?:[.,]\d*)?(?:[eE][+-]?\d+)?)\s*(\S.*?)\s*")
_AS_AIR = 5.0e-3
"""Relative deviation from the molar mass of air [-] within which a gas counts as air."""
# What stands behind bar (abs) or kgf/cm^2 (g) is no condition.
_BEHIND = re.compile(
    rf"(?P<flow>.*[^/ ]) *\((?!(?i:{KIND_WORD})\.?\))(?P<words>[^()]*)\)|(?P<bare>.*[^/ ])[ _]+(?P<name>ANR)"
)
_NORMAL = re.compile(
    r"(?:(?i:std\.?|standard|norm\.?|normal) +|[NSns](?=c?m\^?[23³]/|[lL]/|cc/))(?P<volume>[^ ]+/.+)"
    r"|(?P<milli>m?)[lL](?:[ns]|\(n\))(?P<per>/\w+)|[NnSs](?P<word>[lL]p?m|LP?M|(?i:ccm|cf[mh]))"
)
_EXAMPLE = "70 degF, 14.696 psi_a"


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


def flow_of(unit: str) -> WrittenFlow:
    """Split a unit into volume flow, whether it is a normal or standard one, condition and gases."""
    text, words = unit.strip(), ""
    if match := _BEHIND.fullmatch(text):
        text, words = match["flow"] or match["bare"], match["words"] or match["name"] or ""
    said = [word.strip() for word in _split(words) if word.strip()]
    gases = tuple(word for word in said if word.lower() in _GASES or word.endswith("/mol"))
    flow, normal = text, _NORMAL.fullmatch(text)
    if normal:
        flow = (normal["word"] or "").upper() or normal["volume"] or f"{normal['milli']}L{normal['per']}"
    return WrittenFlow(text, flow, normal is not None, ", ".join(word for word in said if word not in gases), gases)


def _split(words: str) -> list[str]:
    """Split words at commas, semicolons or 'and'; a comma between digits is a decimal comma."""
    return re.split(r"(?<!\d),|,(?!\d)|;|\band\b|&|@", words)


def is_volume_flow(unit: str) -> bool:
    """Return whether a unit is a volume per time, with or without condition. Raises UnitError if invalid."""
    flow = flow_of(unit)
    return flow.is_normal or parse_unit(flow.unit).dimensions == VOLUME_FLOW


def with_condition(unit: str, condition: str, gas: str) -> str:
    """Add reference condition and gas to a unit of volume flow that does not state them."""
    flow = flow_of(unit)
    whole = ", ".join(filter(None, (flow.condition or condition, *(flow.gases or (gas,)))))
    return f"{flow.name} ({whole})" if whole else unit


def read_unit(unit: str) -> ParsedUnit:
    """Parse a unit; a volume flow with condition and gas becomes a mass flow.

    Raises UnitError for an invalid unit, a normal flow without condition, and a condition without gas.
    """
    flow = flow_of(unit)
    is_volume = (flow.is_stated or flow.is_normal) and parse_unit(flow.unit).dimensions == VOLUME_FLOW
    if flow.is_stated and not is_volume:
        raise UnitError(f"'{unit}': a reference condition belongs to a volume flow, such as 'L/min (ANR, air)'")
    if not is_volume:
        return parse_unit(unit)
    if not flow.is_stated:
        raise UnitError(without_condition(unit))
    temperature, pressure, is_humid = _condition_of(flow.condition, unit)
    if len(flow.gases) != 1:
        example = with_condition(unit, "", "air") if not flow.gases else "L/min (ANR, air)"
        raise UnitError(
            f"'{unit}' states {'two gases' if flow.gases else 'no gas'}: write one gas, for example '{example}'; "
            f"allowed: {', '.join(MOLAR_MASSES)}, or a molar mass in kg/mol"
        )
    mass = _molar_mass(flow.gases[0])
    density = pressure * mass / (MOLAR_GAS_CONSTANT * temperature)
    density = STANDARD_REFERENCE_DENSITY_AIR if is_humid and _is_air(mass) else density
    scale = DECIMALS.multiply(parse_unit(flow.unit).scale, Decimal(repr(density)))
    return ParsedUnit(scale, Decimal(0), MASS_FLOW)


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


def _is_air(molar_mass: float) -> bool:
    return abs(molar_mass / MOLAR_MASSES["air"] - 1.0) < _AS_AIR


def without_condition(unit: str, gas: str = "") -> str:
    """Return the message on a volume flow without reference condition and gas, given for a mass flow.

    ``gas`` is the gas of the bench by name or molar mass, empty if unknown.
    """
    named, own = (with_condition(unit, at, "air") for at in ("ANR", _EXAMPLE))
    too = "" if gas and _is_air(_molar_mass(gas)) else f"; where the bench has {gas or 'another'}, give gas = 'air' too"
    return (
        f"'{unit}' is a volume flow, which is a mass flow only with a reference condition and a gas: write '{named}' "
        f"(20 degC, 1 bar) or '{own}', as in the data sheet of the meter; in a column map give at = 'ANR' and "
        f"gas = 'air'{too}"
    )


def _condition_of(text: str, unit: str) -> tuple[float, float, bool]:
    """Parse a reference condition: a name, or temperature and pressure. Raises UnitError for other text."""
    name = re.sub(r"[\s_-]+", " ", text).upper()
    if name in _CONDITIONS:
        return _CONDITIONS[name]
    words = _split(text)
    values = {
        unit.is_pressure: value
        for value, unit in _quantities(words)
        if (unit.is_pressure or unit.dimensions == _TEMPERATURE) and unit.kind in ("", "a")
    }
    if len(values) == len(words) == 2 and min(values.values()) > 0.0:
        return values[False], values[True], False
    raise UnitError(
        f"'{unit}': '{text}' is not a reference condition{nearest_name(name, _CONDITIONS)}; use "
        f"{', '.join(_CONDITIONS)}, or a temperature and an absolute pressure, such as '{_EXAMPLE}'"
    )
