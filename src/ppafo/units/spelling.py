"""Spelling of units: conversion to a normal form such as ``N m s/rad``, ``mm^2``, ``L/(s bar)``, ``psi_g``.

Only unambiguous spellings are changed. Unknown units are refused where the unit is looked up.
"""

import functools
import re

from ppafo.errors import UnitError

PREFIXES = ("u", "m", "c", "d", "h", "k", "M")
UNITS = (
    *("m", "kg", "g", "s", "K", "mol", "rad", "deg", "rev", "degC", "degF", "min", "h", "day", "Hz", "N", "J", "W"),
    *("Pa", "bar", "psi", "atm", "Torr", "mHg", "inHg", "mWC", "inWC"),
    *("L", "in", "ft", "lb", "lbf", "oz", "ozf", "kgf", "percent"),
)
PRESSURES = ("Pa", "bar", "psi", "atm", "Torr", "mHg", "inHg", "mWC", "inWC")
"""Pressure units of a single word."""

LONGEST_UNIT = 60
_MOST_FACTORS = 4

FACTOR = r"[A-Za-zµ]+(?:_[gad])?(?:\^-?[1-9])?"
PRODUCT = rf"{FACTOR}(?: {FACTOR})*"
_EXPRESSION = re.compile(rf"(?:1|{PRODUCT})(?:/(?:{FACTOR}|\({PRODUCT}\)))*")
_KIND_BEHIND = re.compile(r"(.+)_([gad])")

_CHARACTERS = str.maketrans(
    {
        "²": "^2",
        "³": "^3",
        "⁻": "^-",
        "¹": "1",
        "·": " ",
        "⋅": " ",
        "\u00d7": " ",
        "*": " ",
        "\u00a0": " ",
        "\u202f": " ",
    }
    | {"°": "deg", "℃": "degC", "℉": "degF", "μ": "µ", "%": "percent"}
    | {"\u2212": "-", "\u2013": "-", "\u2215": "/", "\u2044": "/"}
)

_PRESSURE = r"(?P<unit>[mkMhµu]?(?:bar|psi|Pa|atm|Torr)|[cm]?mHg|inHg|[cm]?mWC|inWC)"
_KIND_WORDS = {
    "g": ("g", "ga", "gauge", "rel", "relative", "ü", "ue"),
    "a": ("a", "abs", "absolute"),
    "d": ("d", "diff", "differential", "difference"),
}
_WORD_OF_KIND = "|".join(word for words in _KIND_WORDS.values() for word in words)
_KIND = re.compile(rf"{_PRESSURE}[ _]?\(?(?P<word>{_WORD_OF_KIND})\.?\)?", re.IGNORECASE)

_MEANT = {
    "s": ("sec", "secs", "second", "seconds"),
    "ms": ("msec", "msecs", "millisecond", "milliseconds"),
    "us": ("usec", "µsec", "microsecond", "microseconds"),
    "min": ("mins", "minute", "minutes"),
    "h": ("hr", "hrs", "hour", "hours"),
    "day": ("days",),
    "deg": ("degs", "degree", "degrees"),
    "rad": ("rads", "radian", "radians"),
    "rev": ("revs", "revolution", "revolutions"),
    "rev/min": ("rpm", "RPM"),
    "Hz": ("hz", "HZ"),
    "L": ("litre", "litres", "liter", "liters", "ltr"),
    "cm^3": ("cc", "ccm"),
    "mm^2": ("qmm", "sqmm"),
    "in^2": ("sqin",),
    "in^3": ("cuin",),
    "ft^3": ("cuft",),
    "in": ("inch", "inches"),
    "ft": ("foot", "feet"),
    "lb": ("lbs", "pound", "pounds"),
    "lbf": ("lbfs",),
    "kgf": ("kp",),
    "bar": ("bars", "Bar", "BAR"),
    "mbar": ("mBar", "millibar", "MBAR"),
    "psi": ("Psi", "PSI"),
    "Pa": ("pascal", "pascals", "PA"),
    "kPa": ("kpa", "KPa", "KPA", "kPA"),
    "Torr": ("torr",),
    "K": ("degK", "kelvin", "Kelvin"),
    "degC": ("celsius", "Celsius"),
    "degF": ("fahrenheit", "Fahrenheit"),
    "N": ("newton", "newtons"),
    "L/min": ("lpm", "LPM", "Lpm"),
    "ft^3/min": ("cfm", "CFM"),
    "ft^3/h": ("cfh", "CFH"),
    "cm^3/min": ("ccpm", "CCM"),
}
_WORDS = {word: unit for unit, words in _MEANT.items() for word in words}
_COLUMNS_OF = re.compile(r"\b(mm|cm|m|in) ?(?:H2O|h2o|WS|wc)(?![A-Za-fh-z0-9])")
"""Pattern of water heads, written with the unit WC (water column)."""

_SQUARE_OR_CUBIC = (
    (re.compile(r"\bsq\.? ?(mm|cm|m|in|ft)\b"), r"\1^2"),
    (re.compile(r"\bcu\.? ?(mm|cm|m|in|ft)\b"), r"\1^3"),
)
_FORCES = {
    "lb in": "lbf in",
    "in lb": "lbf in",
    "lb ft": "lbf ft",
    "ft lb": "lbf ft",
    "oz in": "ozf in",
    "in oz": "ozf in",
    "lb/in^2": "lbf/in^2",
    "lb/ft^2": "lbf/ft^2",
    "kg/cm^2": "kgf/cm^2",
    "kg/mm^2": "kgf/mm^2",
}
"""Spellings in which pound, ounce or kilogram is a force."""


_KIND_OF_QUOTIENT = re.compile(
    rf"(?P<unit>.+?)(?: *\((?P<inside>{_WORD_OF_KIND})\)| +(?P<word>{_WORD_OF_KIND})|(?<=cm\^2)(?P<joined>[ga]))",
    re.IGNORECASE,
)


@functools.lru_cache(maxsize=512)
def split_pressure_kind(unit: str) -> tuple[str, str]:
    """Return a unit in normal spelling without pressure suffix, and its suffix letter ``g``, ``a`` or ``d``.

    Raises UnitError for a text that does not have the form of a unit.
    """
    normal = unit.replace("**", "^").replace("^^", "^ ^").translate(_CHARACTERS).replace("^-^", "^-").strip(" ")
    normal = _COLUMNS_OF.sub(r"\1WC", normal)
    normal, kind = _kind_of_pressure(normal)
    for written, meant in _SQUARE_OR_CUBIC:
        normal = written.sub(meant, normal)
    # m2, s-2, mm3: a power without its sign.
    normal = re.sub(r"([A-Za-zµ])(-?[1-9])(?![0-9])", r"\1^\2", normal)
    # in-lb and N.m are products.
    normal = re.sub(r"(?<=[A-Za-z0-9µ])[-.](?=[A-Za-zµ])", " ", normal)
    normal = re.sub(r"\bdeg +(?=[CFK]\b)", "deg", normal)
    normal = re.sub(r" *([/()^]) *", r"\1", normal)
    normal = re.sub(r" +", " ", normal)
    normal = re.sub(r"[A-Za-zµ]+", lambda word: _WORDS.get(word[0], word[0]), normal)
    if not kind and (behind := _KIND_BEHIND.fullmatch(normal)):
        normal, kind = behind[1], behind[2]
    if normal and (len(normal) > LONGEST_UNIT or _EXPRESSION.fullmatch(normal) is None):
        below = re.sub(rf"/({FACTOR}(?: {FACTOR})+)", r"/(\1)", normal)
        is_clear = len(normal) <= LONGEST_UNIT and _EXPRESSION.fullmatch(below) is not None
        example = f"'{below}'" if is_clear else "a unit like 'mm^2', 'N m s/rad' or 'm^3/(s Pa)'"
        raise UnitError(f"{quote(unit)} is not a unit; write {example}")
    spaced = re.sub(r"[A-Za-zµ]+(?![A-Za-zµ]|_[gad])", lambda word: as_product(word[0]) or word[0], normal)
    normal = re.sub(rf"/({FACTOR}(?: {FACTOR})+)", r"/(\1)", spaced) if spaced != normal else normal
    return _FORCES.get(normal, normal), kind


def says_kind(unit: str) -> bool:
    """Return whether a word after a unit states the kind of a pressure."""
    return _kind_of_pressure(unit.translate(_CHARACTERS).strip(" "))[1] != ""


def _kind_of_pressure(text: str) -> tuple[str, str]:
    """Split off the word for the kind of a pressure: ``psig``, ``bar (abs)``, ``kPa gauge``."""
    match = _KIND.fullmatch(text)
    word = "" if match is None else match["word"]
    if match is None and "/" in text:
        match = _KIND_OF_QUOTIENT.fullmatch(re.sub(r"cm2", "cm^2", text))
        word = "" if match is None else match["inside"] or match["word"] or match["joined"]
    if match is None:
        return text, ""
    word = word.lower()
    return match["unit"], next(kind for kind, words in _KIND_WORDS.items() if word in words)


def as_product(name: str) -> str:
    """Split a joined name into known units, ``Nm`` into ``N m``; empty if already known or no product.

    Each unit occurs at most once, so that ``Nmm`` is ``N mm``. After the first unit, shorter ones are tried first:
    ``Nms`` is ``N m s``.
    """
    known = spellings()
    # A letter typed twice, as in degg, is no product.
    if name in known or re.sub(r"(.)\1", r"\1", name) in known:
        return ""

    def split(rest: str, before: tuple[str, ...]) -> str:
        if not rest:
            return " ".join(before)
        # Products of more are not written, and would take long to find in a long name.
        if len(before) == _MOST_FACTORS:
            return ""
        # The first as long as it can be: mbarl is mbar L, and no metre times bar.
        ends = range(1, len(rest) + 1) if before else range(len(rest), 0, -1)
        parts = (rest[:end] for end in ends)
        found = (split(rest[len(part) :], (*before, part)) for part in parts if part in known and part not in before)
        return next(filter(None, found), "")

    return split(name, ())


@functools.cache
def spellings() -> frozenset[str]:
    """Return all unit names with all prefixes."""
    return frozenset(prefix + unit for unit in (*UNITS, "l") for prefix in ("", "µ", *PREFIXES))


def quote(text: object) -> str:
    """Quote a value for a message, shortened to one line."""
    quoted = repr(text)
    return quoted if len(quoted) <= 50 else f"{quoted[:46]}...'"
