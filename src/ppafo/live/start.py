"""What a page opens with, checked by the rules of its script: a page that could not open it would stay empty."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from typing import Any

from ppafo.constants import STANDARD_ATMOSPHERE
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
        _check_changes(changes, programs[name], content["units"])
    for tab in content["tabs"]:
        count = sum(item["program"] in tab["programs"] for item in start)
        if count > MOST_CONFIGURATIONS:
            raise ScenarioError(
                f"start: {count} configurations in the tab '{tab['title']}', at most {MOST_CONFIGURATIONS}"
            )


def _check_changes(changes: Mapping[str, Any], program: Mapping[str, Any], units: Mapping[str, Any]) -> None:
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
    for setting, text in _texts(settings, changes):
        # The controller of a walk knows no weather: its gauge pressures count from the standard atmosphere.
        zero = STANDARD_ATMOSPHERE if setting["key"].startswith("controller.") else atmosphere
        _checked(where, setting, text, scales=units[setting["unit"]], zero=zero)


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
    scale = _scale(match[2] or setting["shown"], scales)
    if scale is None:
        known = ", ".join(one["unit"] or "a plain number" for one in scales)
        raise ScenarioError(f"{said} has a unit that does not fit here; allowed: {known}")
    value = _in_si(float(match[1]), scale, zero)
    if not _is_inside(setting, value):
        raise ScenarioError(f"{said} is outside of its range, {_range(setting, scales, zero)}")
    if setting["kept"] and (setting["kept"] == "zero") != (value == 0.0):
        need = "0" if setting["kept"] == "zero" else "above 0"
        raise ScenarioError(f"{said}: must stay {need} on this page; another value needs a different compiled program")
    if setting["key"].endswith(".seed") and not value.is_integer():
        raise ScenarioError(f"{said} must be a whole number")
    return value


def _scale(unit: str, scales: Sequence[Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """The scale of a unit as it is listed, else in another spelling of it; None where it is not known here."""
    exact = (one for one in scales if unit in (one["unit"], _normal(one["unit"])))
    other = (one for one in scales if _normal(unit) in (one["unit"], _normal(one["unit"])))
    return next(exact, None) or next(other, None)


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


def _is_inside(setting: Mapping[str, Any], value: float) -> bool:
    low, high = setting["low"], setting["high"]
    is_below = low is not None and (value < low if setting["isLowAllowed"] else value <= low)
    return math.isfinite(value) and not is_below and not (high is not None and value > high)


def _range(setting: Mapping[str, Any], scales: Sequence[Mapping[str, Any]], zero: float) -> str:
    scale = next(one for one in scales if one["unit"] == setting["shown"])
    low, high = (
        None
        if end is None
        else (end - (zero if scale["isGauge"] else 0.0) - float(scale["offset"])) / float(scale["scale"])
        for end in (setting["low"], setting["high"])
    )
    begin = "" if low is None else f"{'from' if setting['isLowAllowed'] else 'above'} {low:.6g}"
    end = "" if high is None else f"up to {high:.6g}"
    return " ".join(word for word in (begin or ("" if end else "any finite number"), end, setting["shown"]) if word)
