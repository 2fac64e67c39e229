"""Formatting of output: typographic signs and units, aligned columns, page templates."""

import base64
import re
import shutil
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from markupsafe import Markup

UNKNOWN = "\N{EN DASH}"
_DIGITS = "-0123456789"
_SUPERSCRIPTS = str.maketrans(_DIGITS, "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_SUBSCRIPTS = str.maketrans(_DIGITS, "₋₀₁₂₃₄₅₆₇₈₉")
_TIMES = "\N{MULTIPLICATION SIGN}"
_MINUS = "\N{MINUS SIGN}"
_APOSTROPHE = "\N{RIGHT SINGLE QUOTATION MARK}"
_NO_BREAK = "\N{NO-BREAK SPACE}"
_QUOTED = "\N{LEFT DOUBLE QUOTATION MARK}\\1\N{RIGHT DOUBLE QUOTATION MARK}"
_PRESSURE_UNITS = {"Pa_a": "Pa (absolute)", "Pa_d": "Pa", "psi_g": "psig", "psi_a": "psia", "psi_d": "psi"}
_POWER_OF_TEN = re.compile(r"(?<=\d)e([+-]?\d+)\b")
_EXPONENT = re.compile(r"\^(-?\d+)")
_INDEX = re.compile(r"\b(C|P|V|CO)([12])\b")
_PRESSURE = re.compile(rf"\b({'|'.join(_PRESSURE_UNITS)})\b")
_PRODUCT = re.compile(r"(?<=\d) x (?=\d)")
_NEGATIVE = re.compile(r"(?<![\w.)-])-(?=[\dA-Z])")
_DIFFERENCE = re.compile(r"(?<=[\w)]) - (?=[\w(])")
_WORD_APOSTROPHE = re.compile(r"(?<=\w)'(?=\w)")
_QUOTATION = re.compile(r"'([^']+)'")
_BEFORE_UNIT = re.compile(
    r"(?<=[\d⁰¹²³⁴⁵⁶⁷⁸⁹]) (?=(?:%|deg|psi[ga]?|ms|s|mm²|cm³|m³|m|kg|g|J|K|N|Hz|kHz|Pa|rad|1)(?![\w]))"
)
_IN_UNIT = re.compile(r"(?<=[\d\s](?:N|g)) (?=m)")
_PATH = re.compile(r"\b[a-z_]+(?:\.[a-z0-9_]+)+\b")


def typeset(text: str) -> str:
    """Return plain text with typographic superscripts, subscripts, signs and quotation marks, and psig for psi_g."""
    # Powers of ten first: their sign is no minus sign of a number.
    text = _POWER_OF_TEN.sub(lambda found: f" {_TIMES} 10{str(int(found[1])).translate(_SUPERSCRIPTS)}", text)
    text = _EXPONENT.sub(lambda found: found[1].translate(_SUPERSCRIPTS), text)
    text = _INDEX.sub(lambda found: found[1] + found[2].translate(_SUBSCRIPTS), text)
    text = _PRESSURE.sub(lambda found: _PRESSURE_UNITS[found[1]], text)
    text = _PRODUCT.sub(f" {_TIMES} ", text)
    text = _DIFFERENCE.sub(f" {_MINUS} ", _NEGATIVE.sub(_MINUS, text))
    text = _QUOTATION.sub(_QUOTED, _WORD_APOSTROPHE.sub(_APOSTROPHE, text))
    return _IN_UNIT.sub(_NO_BREAK, _BEFORE_UNIT.sub(_NO_BREAK, text))


def with_paths_as_code(text: str) -> "Markup":
    """Return text as HTML, with each dotted path of a value, such as ``valve.area``, marked as code."""
    from markupsafe import Markup, escape

    return Markup(_PATH.sub(lambda found: f"<code>{found[0]}</code>", str(escape(text))))


def sentence(text: str, title: str = "") -> str:
    """Return text as a sentence, with a capital letter and a full stop; a path or symbol at the start is unchanged.

    Names keep their case: a word with a digit, the first word of the page ``title``, and any word of the title before
    a colon.
    """
    stripped = text.strip()
    if not stripped:
        return ""
    first = stripped.partition(" ")[0]
    named = title.split()
    word = first.rstrip(".:,")
    is_symbol = any(mark in "._" or mark.isdecimal() for mark in word)
    is_name = word in (named if first.endswith(":") else named[:1])
    capital = stripped if is_symbol or is_name else stripped[0].upper() + stripped[1:]
    return capital if capital.endswith((".", "!", "?")) else f"{capital}."


def quantity(value: float | None, unit: str, digits: int = 4) -> str:
    """Format a number with its unit, such as ``0.1000 N m``; a dash for None.

    A number with the unit ``-`` is dimensionless; an integral number is written without decimals.
    """
    if value is None:
        return UNKNOWN
    is_whole = value == 0.0 or (unit == "-" and value == int(value))
    number = f"{value:.0f}" if is_whole else f"{value:#.{digits}g}".removesuffix(".")
    return f"{number} {'' if unit == '-' else unit}".rstrip()


def terminal_width() -> int:
    """Return the number of characters in a line of the terminal; 0 where the output goes elsewhere."""
    return shutil.get_terminal_size().columns if sys.stdout is not None and sys.stdout.isatty() else 0


def align_columns(rows: Sequence[Sequence[str]], left: int = 1, width: int = 0) -> list[str]:
    """Format rows of texts as aligned lines: the first ``left`` columns left-aligned, the others right-aligned.

    Columns that would exceed a ``width`` above 0 follow in further blocks of lines, each with the first ``left``.
    """
    columns = []
    for place, texts in enumerate(zip(*rows, strict=True)):
        widest = max(map(len, texts))
        columns.append([f"{cell:<{widest}}" if place < left else f"{cell:>{widest}}" for cell in texts])
    names = columns[:left]
    blocks = [columns[:left]]
    for column in columns[left:]:
        if width and len(blocks[-1]) > left and sum(len(each[0]) + 2 for each in (*blocks[-1], column)) - 2 > width:
            blocks.append([*names])
        blocks[-1].append(column)
    lines = [["  ".join(cells).rstrip() for cells in zip(*block, strict=True)] for block in blocks]
    return [line for block in lines for line in ("", *block)][1:]


def render_page(template: str, values: Mapping[str, Any], package: str = "ppafo.report") -> str:
    """Render a page template of a package; texts are escaped, and a missing value raises an error."""
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    # A page of an analysis includes the style sheet, which all pages share.
    packages = dict.fromkeys((package, "ppafo.report"))
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(name) for name in packages]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["typeset"] = typeset
    environment.filters["sentence"] = sentence
    environment.filters["coded"] = with_paths_as_code
    return environment.get_template(template).render(values)


def inline_figure(content: bytes) -> str:
    """Return an SVG file as a data URL, for an image embedded in a page."""
    return f"data:image/svg+xml;base64,{base64.b64encode(content).decode('ascii')}"
