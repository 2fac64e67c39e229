"""The file that a browser opens: content, modules, script and style in one page with a strict policy.

What a page opens with is checked here by the rules of its script: a page that could not open it would stay empty.
"""

import base64
import gzip
import hashlib
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.engine.cache import kept_bytes
from ppafo.errors import ScenarioError, nearest_name
from ppafo.parameters.graph import ATMOSPHERE_PATH

MOST_CONFIGURATIONS = 4
_WHITE = "\t\n\v\f\r \u00a0\u1680\u2000-\u200a\u2028\u2029\u202f\u205f\u3000\ufeff"
"""What is white for the script of the page, which is not all that is white for Python, nor the other way round."""
_QUANTITY = re.compile(rf"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)[{_WHITE}]*([^\n\r\u2028\u2029]*)", re.ASCII)
_AROUND = re.compile(rf"^[{_WHITE}]+|[{_WHITE}]+\Z")
_SPELLINGS = (
    ("²", "^2"),
    ("³", "^3"),
    (r"\*\*", "^"),
    (r"[·*]", " "),
    ("°", "deg"),
    (r"[μu](?=[A-Za-z])", "µ"),
    ("%", "percent"),
    (r" *([/()^]) *", r"\1"),
    (" +", " "),
)
_SHORT = 40
_SEPARATORS = ";\n"
"""What an address and a file of a state may not have in a text."""


def check_start(start: Sequence[Mapping[str, Any]], content: Mapping[str, Any]) -> None:
    """Refuse what the script of the page could not open: ScenarioError."""
    programs = {program["name"]: program for program in content["programs"]}
    for place, item in enumerate(start):
        name, changes = (item.get("program"), item.get("changes")) if isinstance(item, Mapping) else (None, None)
        if not isinstance(name, str) or not isinstance(changes, Mapping):
            raise ScenarioError(f"start, configuration {place + 1}: must be a table of 'program' and 'changes'")
        if name not in programs:
            raise ScenarioError(
                f"start, configuration {place + 1}: '{name}' is not on this page{nearest_name(name, programs)}; "
                f"allowed: {', '.join(programs)}"
            )
        values_of_changes(changes, programs[name], content["units"])
    for tab in content["tabs"]:
        count = sum(item["program"] in tab["programs"] for item in start)
        if count > MOST_CONFIGURATIONS:
            raise ScenarioError(
                f"start: {count} configurations in the tab '{tab['title']}', at most {MOST_CONFIGURATIONS}"
            )


def values_of_changes(
    changes: Mapping[str, Any], program: Mapping[str, Any], units: Mapping[str, Any]
) -> dict[str, float]:
    """Return the numbers in SI, by key, that the texts of a configuration are; ScenarioError where one is none."""
    settings = {one["key"]: one for one in program["settings"]}
    where = f"start, '{program['name']}'"
    for key, text in changes.items():
        if key not in settings:
            raise ScenarioError(f"{where}: there is no setting '{key}'{nearest_name(str(key), settings)}")
        if not isinstance(text, str):
            raise ScenarioError(f"{where}, {key}: must be a text such as '50 psi_g', not {text!r}")
        if any(mark in text for mark in _SEPARATORS):
            raise ScenarioError(f"{where}, {key}: a text may not have a semicolon or a line break in it")
    atmosphere = settings.get(ATMOSPHERE_PATH, {}).get("value", STANDARD_ATMOSPHERE)
    if ATMOSPHERE_PATH in changes:
        own = settings[ATMOSPHERE_PATH]
        atmosphere = _checked(where, own, changes[ATMOSPHERE_PATH], scales=units[own["unit"]], zero=STANDARD_ATMOSPHERE)
    found = {ATMOSPHERE_PATH: atmosphere} if ATMOSPHERE_PATH in changes else {}
    for setting, text in _texts(settings, changes):
        # The controller of a walk knows no weather: its gauge pressures count from the standard atmosphere.
        zero = STANDARD_ATMOSPHERE if setting["key"].startswith("controller.") else atmosphere
        found[setting["key"]] = _checked(where, setting, text, scales=units[setting["unit"]], zero=zero)
    return found


def _texts(settings: Mapping[str, Mapping[str, Any]], changes: Mapping[str, str]) -> Iterator[tuple[Any, str]]:
    """Settings with the texts that the page reads: those given, and gauge pressures where the atmosphere moves."""
    for key, setting in settings.items():
        text = changes.get(key, setting["text"] if ATMOSPHERE_PATH in changes and not setting["follows"] else "")
        if key != ATMOSPHERE_PATH and (key in changes or text) and text not in setting["words"]:
            yield setting, text


def _checked(
    where: str, setting: Mapping[str, Any], text: str, *, scales: Sequence[Mapping[str, Any]], zero: float
) -> float:
    """Return the value of a text in SI; gauge pressures count from ``zero`` [Pa absolute]."""
    said = f"{where}, {setting['key']}: {text if len(text) <= _SHORT else text[:_SHORT] + ' ...'!r}"
    match = _QUANTITY.fullmatch(_AROUND.sub("", text))
    if match is None:
        raise ScenarioError(
            f"{said} does not start with a number; write for example '{setting['slider'][1]:g} {setting['shown']}'"
        )
    # The scale of a unit as it is listed, else in another spelling of it; None where it is not known here.
    unit = match[2] or setting["shown"]
    exact = (one for one in scales if unit in (one["unit"], _normal(one["unit"])))
    other = (one for one in scales if _normal(unit) in (one["unit"], _normal(one["unit"])))
    scale = next(exact, None) or next(other, None)
    if scale is None:
        known = ", ".join(one["unit"] or "a plain number" for one in scales)
        raise ScenarioError(f"{said} has a unit that does not fit here; allowed: {known}")
    value = _in_si(float(match[1]), scale, zero)
    low, high = setting["low"], setting["high"]
    is_below = low is not None and (value < low if setting["isLowAllowed"] else value <= low)
    if not (math.isfinite(value) and not is_below and not (high is not None and value > high)):
        raise ScenarioError(f"{said} is outside of its range, {_range(setting, scales, zero)}")
    if setting["kept"] and (setting["kept"] == "zero") != (value == 0.0):
        need = "0" if setting["kept"] == "zero" else "above 0"
        raise ScenarioError(f"{said}: must stay {need} on this page; another value needs a different compiled program")
    if setting["key"].endswith(".seed") and not value.is_integer():
        raise ScenarioError(f"{said} must be a whole number")
    return value


def _normal(unit: str) -> str:
    found = _AROUND.sub("", unit)
    for pattern, other in _SPELLINGS:
        found = re.sub(pattern, other, found)
    return found


def _in_si(number: float, scale: Mapping[str, Any], zero: float) -> float:
    if not math.isfinite(number):
        return number
    exact = Decimal(repr(number)) * Decimal(scale["scale"]) + Decimal(scale["offset"])
    return float(exact) + (zero if scale["isGauge"] else 0.0)


def _range(setting: Mapping[str, Any], scales: Sequence[Mapping[str, Any]], zero: float) -> str:
    scale = next(one for one in scales if one["unit"] == setting["shown"])
    low, high = (
        None
        if end is None
        else (end - (zero if scale["isGauge"] else 0.0) - float(scale["offset"])) / float(scale["scale"])
        for end in (setting["low"], setting["high"])
    )
    begin = "" if low is None else f"{'' if setting['isLowAllowed'] else 'more than '}{low:,.6g}"
    if low is None or high is None:
        least = f"at least {begin}" if setting["isLowAllowed"] else begin
        words = f"at most {high:,.6g}" if high is not None else (least if low is not None else "any finite number")
    else:
        words = f"{begin} to {high:,.6g}" if setting["isLowAllowed"] else f"{begin}, at most {high:,.6g}"
    return f"{words} {setting['shown']}".strip()


_POLICY = (
    "default-src 'none'; script-src 'sha256-{script}' 'strict-dynamic' 'wasm-unsafe-eval'; style-src 'sha256-{style}'; "
    "worker-src blob:; img-src data: blob:; base-uri 'none'; form-action 'none'"
)
_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="ppafo workbench">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>{style}</style>
</head>
<body class="live-page">
<div id="workbench"><noscript><h1>{title}</h1>
<p>This page simulates in the browser and needs JavaScript for it. This is what it opens with:</p>
{still}</noscript></div>
{data}
<script>{script}</script>
</body>
</html>
"""
SCRIPT, CONTENT = "workbench-script", "workbench-content"
_MARK = b'content="ppafo workbench"'
_MARKED = 2000
"""Bytes from the beginning in which a page says what made it."""


def bundled(name: str) -> str:
    """Return a script (``loader.js``, ``page.js``) or ``page.css``; their source is ``page/`` of the repository."""
    return files("ppafo.live").joinpath("bundle", name).read_text(encoding="utf-8").strip()


def is_page(path: Path) -> bool:
    """Tell whether a file is such a page, which may be written anew."""
    try:
        # A pipe would be waited for.
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return _MARK in file.read(_MARKED)
    except OSError:
        return False


def page_of(title: str, content: Mapping[str, Any], modules: Mapping[str, str], still: str) -> bytes:
    """Return a page; ``modules`` has the packed programs by the name that the content has for them.

    ``still`` is the picture, as SVG, for readers whose browser runs no scripts.
    """
    script, style = bundled("loader.js"), bundled("page.css")
    policy = _POLICY.format(script=digest(script), style=digest(style))
    filled = _PAGE.format(
        policy=policy, title=escape(title), style=style, script=script, data=data_of(content, modules), still=still
    )
    return filled.encode()


def block_of(content: Mapping[str, Any], modules: Mapping[str, str]) -> str:
    """Return a part of a page that has ``policy_of_block`` in its head: place, data, style and script."""
    place = '<div id="workbench"></div>'
    style, script = f"<style>{bundled('page.css')}</style>", f"<script>{bundled('loader.js')}</script>"
    return "\n".join([style, place, data_of(content, modules), script])


def policy_of_block() -> str:
    """Return the policy of a page with a block in it: the one script, nothing fetched, styles of the page's own."""
    policy = _POLICY.format(script=digest(bundled("loader.js")), style="")
    return policy.replace("'sha256-'", "'unsafe-inline'")


def data_of(content: Mapping[str, Any], modules: Mapping[str, str]) -> str:
    """Return the elements that hold the script and what it reads, content and programs: compressed, in base 85."""
    text = json.dumps(content, ensure_ascii=False, separators=(",", ":"))
    texts = {SCRIPT: packed_once(bundled("page.js").encode()), CONTENT: packed(text.encode()), **modules}
    return "\n".join(f'<script type="text/plain" id="{escape(name)}">{text}</script>' for name, text in texts.items())


def digest(text: str) -> str:
    """Return the SHA-256 of a script or style as a policy names it."""
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def packed_once(content: bytes) -> str:
    """Return the same of what many pages hold, from the disk where it was packed before."""
    return kept_bytes("packed", hashlib.sha256(content).hexdigest(), lambda: packed(content).encode()).decode()


def packed(content: bytes) -> str:
    """Return bytes as a page holds them: compressed, in base 85; no such text can end the element that it is in."""
    return base64.b85encode(gzip.compress(content, 9, mtime=0)).decode("ascii")
