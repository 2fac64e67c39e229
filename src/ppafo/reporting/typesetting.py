"""Numbers, units and sentences as a printed text has them: powers of ten and superscripts, not 1.451e-05 m^3."""

import re

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PRESSURE_UNITS = {"Pa_a": "Pa (absolute)", "Pa_d": "Pa", "psi_g": "psig", "psi_a": "psia", "psi_d": "psi"}

_POWER_OF_TEN = re.compile(r"(?<=\d)e([+-]?\d+)\b")
_EXPONENT = re.compile(r"\^(-?\d+)")
_PRESSURE = re.compile(rf"\b({'|'.join(_PRESSURE_UNITS)})\b")
_TIMES = re.compile(r"(?<=\d) x (?=\d)")
_MINUS = re.compile(r"(?<![\w.)⁰¹²³⁴⁵⁶⁷⁸⁹])-(?=\d)")
_DIFFERENCE = re.compile(r"(?<=[\w)]) - (?=[\w(])")

UNKNOWN = "\N{EN DASH}"
_TIMES_SIGN, _MINUS_SIGN = "\N{MULTIPLICATION SIGN}", "\N{MINUS SIGN}"


def typeset(text: str) -> str:
    """Return a plain text with superscripts, minus and multiplication signs, and psig instead of psi_g."""
    text = _POWER_OF_TEN.sub(lambda found: f" {_TIMES_SIGN} 10{_superscript(str(int(found[1])))}", text)
    text = _EXPONENT.sub(lambda found: _superscript(found[1]), text)
    text = _PRESSURE.sub(lambda found: _PRESSURE_UNITS[found[1]], text)
    text = _TIMES.sub(f" {_TIMES_SIGN} ", text)
    return _DIFFERENCE.sub(f" {_MINUS_SIGN} ", _MINUS.sub(_MINUS_SIGN, text))


def sentence(text: str) -> str:
    """Return a text with a capital at its beginning and a full stop at its end."""
    stripped = text.strip()
    if not stripped:
        return ""
    capital = stripped if stripped.partition(" ")[0].find(".") > 0 else stripped[0].upper() + stripped[1:]
    return capital if capital.endswith((".", "!", "?")) else f"{capital}."


def quantity(value: float | None, unit: str, digits: int = 4) -> str:
    """Return number and unit in plain text, ``0.1 N m``; a dash where there is no number. A plain number has unit -."""
    if value is None:
        return UNKNOWN
    return f"{value:.{digits}g} {'' if unit == '-' else unit}".rstrip()


def _superscript(digits: str) -> str:
    return digits.translate(_SUPERSCRIPTS)
