"""Spelling of units: conversion to a normal form such as ``N m s/rad``, ``mm^2``, ``L/(s bar)``, ``psi_g``.

Only unambiguous spellings are changed. Unknown units are refused where the unit is looked up.
"""

import functools
import re

from ppafo.errors import UnitError
from ppafo.units.definitions import PREFIXES, PRESSURES, UNITS, ParsedUnit, UnknownUnitError, names, product, usual_name

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


@functools.lru_cache(maxsize=512)
def split_pressure_kind(unit: str) -> tuple[str, str]:
    """Return a unit in normal spelling without pressure suffix, and its suffix letter ``g``, ``a`` or ``d``.

    Raises UnitError for a text that does not have the form of a unit.
    """
    normal, kind = (
        unit.replace("**", "^").replace("^^", "^ ^").translate(_CHARACTERS).replace("^-^", "^-").strip(" "),
        "",
    )
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
    is_name = name in names() or re.sub(r"(.)\1", r"\1", name) in names()
    match = None if is_name else _joined().fullmatch(name)
    return "" if match is None else " ".join(filter(None, match.groups()))


def quote(text: object) -> str:
    """Quote a value for a message, shortened to one line."""
    quoted = repr(text)
    return quoted if len(quoted) <= 50 else f"{quoted[:46]}...'"
