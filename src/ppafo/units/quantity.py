"""Conversion between text with a unit and SI floats."""

import contextlib
import difflib
import functools
import math
import re
from collections.abc import Iterable
from decimal import Decimal

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import UnitError
from ppafo.units.definitions import DECIMALS, KINDS, PRESSURE, ParsedUnit, UnknownUnitError, parse_unit
from ppafo.units.reference import MASS_FLOW, flow_of, is_volume_flow, read_unit, without_condition
from ppafo.units.spelling import as_product, quote, spellings, split_pressure_kind

# What may be meant by a unit that does not exist or does not fit: only what would be taken in its place.

_NEAR, _TRIED = 0.6, 12
LEVEL, DIFFERENCE = "Pa_a", "Pa_d"


def hint(unknown: UnknownUnitError, kind: str, si_unit: str | None) -> str:
    """Return a hint ``, did you mean 'mm^2'?`` with the nearest unit that fits ``si_unit``; empty if none.

    Without ``si_unit`` only units that differ in upper and lower case are suggested.
    """
    name, is_wanted = unknown.name, si_unit is not None
    near = difflib.get_close_matches(name, sorted(spellings()), _TRIED, _NEAR) if is_wanted else []
    same = [*_in_other_case(name), *([f"deg{name}"] if is_wanted and f"deg{name}" in spellings() else [])]
    # nm for N m: a force has a capital letter.
    product = as_product(name.capitalize())
    same += [product] if product else []
    meant = _that_fit(same, unknown.name, unknown.unit, kind, si_unit)
    return _did_you_mean(meant or _that_fit(near, unknown.name, unknown.unit, kind, si_unit)[:1])


def _in_other_case(name: str) -> list[str]:
    return sorted(known for known in spellings() if known.lower() == name.lower() and known != name)


def _that_fit(names: Iterable[str], name: str, unit: str, kind: str, si_unit: str | None) -> list[tuple[str, ...]]:
    """Return ``unit`` with ``name`` replaced by each fitting name, with pressure suffixes.

    If ``si_unit`` is None, all valid units are returned.
    """
    wanted = None if si_unit is None else parse_unit(si_unit)[0].dimensions
    usual = {LEVEL: ("_g", "_a"), DIFFERENCE: ("_d",)}.get(str(si_unit), ("_g", "_a", "_d"))
    endings, found = (f"_{kind}",) if kind else usual, []
    for known in dict.fromkeys(names):
        meant = re.sub(rf"(?<![A-Za-zµ]){re.escape(name)}(?![A-Za-zµ])", known, unit)
        try:
            dimensions = parse_unit(meant)[0].dimensions
        except UnitError:
            continue
        if wanted is None or dimensions == wanted:
            is_pressure = dimensions == PRESSURE and si_unit in (LEVEL, DIFFERENCE, None)
            found.append(tuple(f"'{meant}{suffix}'" for suffix in (endings if is_pressure else ("",))))
    return found


def _did_you_mean(meant: Iterable[tuple[str, ...]]) -> str:
    *others, last = [unit for units in meant for unit in units] or [""]
    return f", did you mean {' or '.join(filter(None, (', '.join(others), last)))}?" if last else ""


SI = "SI"
"""Unit of a number that is in SI units already, for any quantity; written by programs."""

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_NOT_ZERO = re.compile(r"[^eE]*[1-9]", re.ASCII)
_DECIMAL_COMMA = re.compile(r"([+-]?\d+),(\d+)(?![\d,.])", re.ASCII)
CONDUCTANCE = "m^3/(s Pa)"


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
    unit = stripped[match.end() :].strip()
    comma = _DECIMAL_COMMA.match(stripped)
    if comma is not None:
        rest = stripped[comma.end() :].strip()
        whole = f" or '{f'{comma[1]}{comma[2]} {rest}'.rstrip()}'" if len(comma[2]) == 3 else ""
        pointed = f"{comma[1]}.{comma[2]} {rest}".rstrip()
        raise UnitError(f"{quote(text)} has a comma in its number; write '{pointed}'{whole}")
    value = _finite(float(match.group()), text)
    # float() rounds 1e-400 to 0 without a word, and 0 often means "none" in a file.
    if value == 0.0 and _NOT_ZERO.match(match.group()):
        raise UnitError(
            f"{quote(text)} is too close to 0 for a 64-bit number and would become 0; write 0 or a larger number"
        )
    return value, unit


def number_text(text: str) -> str:
    """Check that a text is an ASCII number for ``float`` or ``int``. Raises ValueError, also for ``1_000``."""
    if not text.isascii() or "_" in text:
        raise ValueError(f"{quote(text)} is not a number")
    return text


def parse_quantity(text: str, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Convert a text to a number in ``si_unit``; gauge pressures are relative to ``atmosphere`` [Pa absolute]."""
    value, unit = split_number(text)
    return to_si(value, unit, si_unit, atmosphere)


def to_si(value: float, unit: str, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Convert a value to ``si_unit``: ``Pa_a`` for a pressure level, ``Pa_d`` for a pressure difference."""
    scale, offset, counts_from_atmosphere = conversion(unit, si_unit)
    # In decimals: 8.4 g is the float nearest to 0.0084 kg, not one beside it.
    exact = DECIMALS.add(DECIMALS.multiply(_decimal(value), scale), offset)
    return _finite(float(exact) + (atmosphere if counts_from_atmosphere else 0.0), f"{value:g} {unit}")


def from_si(value: float, unit: str, si_unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> float:
    """Convert an SI value to ``unit``, the inverse of ``to_si``."""
    scale, offset, counts_from_atmosphere = conversion(unit, si_unit)
    above = _finite(value, value) - (atmosphere if counts_from_atmosphere else 0.0)
    return float(DECIMALS.divide(DECIMALS.subtract(_decimal(above), offset), scale))


def format_quantity(value: float, unit: str) -> str:
    """Format value and unit as text, which ``split_quantity`` reads back exactly."""
    return f"{repr(float(value)).removesuffix('.0')} {unit}".rstrip()


_LARGEST_WITHOUT_EXPONENT = 1.0e6


def without_exponent(value: float, form: str) -> str:
    """Format a number by ``form``, with thousands written out instead of an exponent.

    Zero has neither a sign nor an exponent.

    >>> without_exponent(2641.3, ".3g"), without_exponent(2.0e7, ".3g"), without_exponent(0.12345, ".3g")
    ('2640', '2e+07', '0.123')
    >>> without_exponent(0.0, "+.3g"), without_exponent(0.0, ".1e"), without_exponent(-0.0, ".2f")
    ('0', '0', '0.00')
    >>> without_exponent(-0.3, ".0f")
    '0'
    """
    if value == 0.0:
        return "0" if form[-1:] == "e" else f"{0.0:{form.removeprefix('+')}}"
    text = f"{value:{form}}"
    text = text if text.strip("-0.") else text.removeprefix("-")
    is_long = "e+0" in text and form[-1:] == "g" and abs(value) < _LARGEST_WITHOUT_EXPONENT
    return f"{float(text):{form.partition('.')[0]}.0f}" if is_long else text


def percentage(fraction: float, digits: int) -> str:
    """Format a fraction [-] as a percentage with ``digits`` significant digits, without exponent: ``120 %``."""
    return f"{float(f'{100.0 * fraction:.{digits}g}'):.12g} %"


def check_unit(unit: str, near: str | None = None) -> None:
    """Check that a unit exists and is written like ``kg`` or ``m^3/(s Pa)``. Raises UnitError if not."""
    if unit != SI:
        _read(unit, near)


def _read(unit: str, si_unit: str | None) -> tuple[ParsedUnit, str]:
    """Parse a unit with the kind of a pressure.

    UnitError for an unknown unit suggests units compatible with ``si_unit``.
    """
    try:
        return read_unit(unit)
    except UnknownUnitError as error:
        _, kind = split_pressure_kind(unit)
        raise UnitError(f"'{error.name}' is not a known unit{hint(error, kind, si_unit)}{error.available}") from error


def base_value(value: float, unit: str) -> float:
    """Convert a value in any unit to base units (m, kg, s, K, mol, rad)."""
    parsed, kind = _read(unit, None)
    base = float(parsed.in_base(_decimal(value)))
    return base + (STANDARD_ATMOSPHERE if kind == "g" else 0.0)


def dimension(unit: str) -> dict[str, int]:
    """Return the dimension of a unit as powers of base dimensions such as ``[mass]`` and ``[angle]``."""
    return dict(_read(unit, None)[0].dimensions)


@functools.lru_cache(maxsize=512)
def conversion(unit: str, si_unit: str) -> tuple[Decimal, Decimal, bool]:
    """Return scale, offset and a flag to add the atmosphere; decimals, so that 8.4 g is exactly 0.0084 kg."""
    if unit == SI:
        return Decimal(1), Decimal(0), False
    wanted, _ = read_unit(si_unit)
    is_volume = False
    with contextlib.suppress(UnitError):
        # Without the gas and condition that make it a mass flow.
        is_volume = not flow_of(unit)[1] and is_volume_flow(unit)
    if is_volume:
        if wanted.dimensions == MASS_FLOW:
            raise UnitError(without_condition(unit))
        if flow_of(unit)[2]:
            raise UnitError(f"unit '{unit}' does not fit: {_describe_unit(si_unit)}")
    given, kind = _read(unit, si_unit)
    if given.dimensions != wanted.dimensions:
        given_text = f"unit '{unit}'" if unit else "a number without a unit"
        # KHz, kelvin times hertz, is meant as kHz.
        names = [] if kind else re.findall(r"[A-Za-zµ]+", unit)
        meant = [near for name in names for near in _that_fit(_in_other_case(name), name, unit, "", si_unit)]
        raise UnitError(f"{given_text} does not fit{_did_you_mean(meant)}: {_describe_unit(si_unit)}")
    is_pressure = si_unit in (LEVEL, DIFFERENCE)
    if is_pressure and not kind:
        suffixes = f"{unit}_g for gauge or {unit}_a for absolute"
        suffixes = f"{unit}_d for a difference" if si_unit == DIFFERENCE else suffixes
        raise UnitError(f"'{unit}' needs the kind of pressure: write {suffixes}")
    if is_pressure and (kind == "d") != (si_unit == DIFFERENCE):
        raise UnitError(f"'{unit}' is a {KINDS[kind]}, {_describe_unit(si_unit)}")
    counts_from_atmosphere = kind == "g" and si_unit == LEVEL
    if wanted.scale == 1 and wanted.offset == 0:
        return given.scale, given.offset, counts_from_atmosphere
    scale = DECIMALS.divide(given.scale, wanted.scale)
    return scale, DECIMALS.divide(DECIMALS.subtract(given.offset, wanted.offset), wanted.scale), counts_from_atmosphere


_NEEDED: dict[str, str] = {
    LEVEL: "a pressure level is needed, for example '50 psi_g' or '446 kPa_a'",
    DIFFERENCE: "a pressure difference is needed, for example '5 psi_d'",
    "rad": "an angle is needed, for example '75 deg' or '1.3 rad'",
    CONDUCTANCE: (
        "a sonic conductance is needed, such as '1 L/(s bar)', a flow per pressure before the valve; a nominal "
        "flow q from p1 to p2 (absolute) is C = q/(p1 sqrt(1 - ((p2/p1 - b)/(1 - b))^2)), with b = critical_ratio"
    ),
    "": "a plain number without a unit is needed",
}
"""Statements of what is needed in place of a wrong unit, by SI unit."""


def _describe_unit(si_unit: str) -> str:
    return _NEEDED.get(si_unit, f"a unit like '{si_unit}' is needed")


def _decimal(value: float) -> Decimal:
    return Decimal(repr(float(_finite(value, value))))


def _finite(value: float, shown: object) -> float:
    if not math.isfinite(value):
        raise UnitError(f"{quote(shown)} is not a finite number")
    return value
