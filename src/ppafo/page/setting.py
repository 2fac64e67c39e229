"""Setting of a page: record of a number that the user may change, with display unit, limits and slider."""

import contextlib
import math
from collections.abc import Iterable, Mapping
from typing import Any

from ppafo.errors import UnitError
from ppafo.model.controlled import CONTROLLED
from ppafo.page.motions import with_limits
from ppafo.page.wasm.description import display_of
from ppafo.page.words import words
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.report.setting_names import REFERENCE_LEVELS, label_of
from ppafo.simulation.declaration import PRESSURE_WORDS
from ppafo.simulation.profiles import limits_of
from ppafo.simulation.scenario import Scenario
from ppafo.units import from_si, split_quantity, to_si
from ppafo.units.quantity import SI
from ppafo.units.shown import shown_in

Interval = tuple[float, float]

LEVEL, DIFFERENCE = "Pa_a", "Pa_d"
"""SI units of an absolute pressure and of a pressure difference."""
_GAUGES = ("psi_g", "kPa_g", "bar_g", "Pa_g")
_INITIAL_PRESSURES = ("initial.pressure_1", "initial.pressure_2")
_ROUND_NUMBERS = (1.0, 2.0, 2.5, 5.0, 10.0)
"""Round numbers of a decade, for the ends of a slider."""


def page_setting(
    described: Mapping[str, Any],
    in_file: Any,
    gauge_text: str,
    intervals: Mapping[str, Interval],
    scenario: Scenario,
) -> dict[str, Any]:
    """Return the record of a setting that the script of a page reads; numbers are in SI units.

    Arguments:
        described: setting in the description of the WebAssembly module
        in_file: value in the file of the scenario or walk, or None
        gauge_text: value as a gauge pressure, or ""
        intervals: 95 % intervals [SI] by key, for settings without an uncertainty of their own
        scenario: scenario or walk of the setting
    """
    entry = with_limits(described, scenario)
    key, joint = entry["key"], scenario.device.joint
    display = _display(entry, in_file)
    return {
        "key": key,
        "label": joint.said(label_of(key, CONTROLLED[scenario.controlled].words)),
        "unit": bare_unit(entry["unit"]),
        "shown": typed_unit(bare_unit(display["unit"]), entry["unit"]),
        "low": entry["minimum"],
        "high": entry["maximum"],
        "isLowAllowed": entry["is_minimum_allowed"],
        "value": entry["value"],
        "text": gauge_text,
        "follows": entry["follows"] or "",
        "made": entry["made"],
        "words": {word: f"supply.{name}" for word, name in PRESSURE_WORDS.items()} if key in _INITIAL_PRESSURES else {},
        "kept": entry["kept"] or "",
        "slider": _slider(entry, display, scenario),
        "summary": joint.said(entry["description"]),
        "origin": entry["origin"],
        "source": entry["source"],
        "note": entry["note"],
        "interval": _interval(entry, intervals),
    }


def _display(entry: Mapping[str, Any], in_file: Any) -> Mapping[str, Any]:
    """Return the display unit of a setting, with ``factor`` and ``zero``: SI value = zero + factor * displayed value.

    A pressure has the display unit of its set, but is absolute for a controller. Any other setting has the unit of its
    value in the file, for example ``2 ms``.
    """
    si: str = entry["unit"]
    display: Mapping[str, Any] = entry["display"]
    if si in (LEVEL, DIFFERENCE):
        if entry["group"] == "controller" and display["unit"].endswith("_g"):
            return {**display, "unit": f"{display['unit'][:-2]}_a", "zero": 0.0}
        return display
    with contextlib.suppress(UnitError):
        unit = split_quantity(in_file)[1] if isinstance(in_file, str) else ""
        if unit not in ("", SI, si):
            zero = to_si(0.0, unit, si)
            return {"unit": unit, "factor": to_si(1.0, unit, si) - zero, "zero": zero}
    return display


def _interval(entry: Mapping[str, Any], intervals: Mapping[str, Interval]) -> Interval | None:
    """Return the 95 % interval of a parameter [SI]: from its uncertainty in the set, else from ``intervals``.

    It is None for a changed value and for a value outside the interval: the interval belongs to the value of the set.
    """
    value, half_width = entry["value"], entry["half_width"]
    interval = intervals.get(entry["key"]) if half_width is None else (value - half_width, value + half_width)
    if entry["origin"] == "changed" or interval is None:
        return None
    return interval if interval[0] <= value <= interval[1] else None


def _slider(entry: Mapping[str, Any], display: Mapping[str, Any], scenario: Scenario) -> Interval:
    """Return the ends of the slider of a setting, in its display unit: within its limits, and around its value."""
    factor, zero = display["factor"], display["zero"]
    value = (entry["value"] - zero) / factor
    lowest, highest = (None if end is None else (end - zero) / factor for end in (entry["minimum"], entry["maximum"]))
    usual = _usual_ends(entry, display, scenario)
    begin, end = usual if usual and usual[0] <= value <= usual[1] else _round_ends(value, highest)
    # A slider ends a hundredth of its length above a limit that is not allowed, or too close to zero to be an end.
    limit = 0.0 if lowest is None else lowest
    is_near_limit = lowest is not None and begin <= lowest
    is_limit_left_out = not entry["is_minimum_allowed"] or 0.0 < limit < end / 100.0
    if entry["kept"] == "above zero" or (is_near_limit and is_limit_left_out):
        begin = max(begin, limit + (end - limit) / 100.0)
    begin = begin if lowest is None else max(begin, lowest)
    end = end if highest is None else min(end, highest)
    return min(begin, value), max(end, value)


def _usual_ends(entry: Mapping[str, Any], display: Mapping[str, Any], scenario: Scenario) -> Interval | None:
    """Return the usual ends of a slider in the display unit, or None for a setting without usual ends.

    A reference level has those that the device reaches; other settings have the ends in ``words.toml``. Converted ends
    are rounded to two digits.
    """
    device, controlled = scenario.device, CONTROLLED[scenario.controlled]
    if entry["key"] in REFERENCE_LEVELS and controlled.reach is not None:
        limits = limits_of(device, controlled)
        ends_in_si = limits.lowest, limits.highest
    elif entry["key"] in words()["sliders"]:
        first, last = map(float, words()["sliders"][entry["key"]])
        # The ends in words.toml are in the default display units of the package, not in those of the set.
        with shown_in({}):
            atmosphere, is_absolute = device.supply.atmospheric_pressure, entry["key"] == ATMOSPHERE_PATH
            default = display_of(entry["unit"], atmosphere, is_absolute=is_absolute)
        if default["unit"] == display["unit"]:
            return first, last
        ends_in_si = default["zero"] + default["factor"] * first, default["zero"] + default["factor"] * last
    else:
        return None
    first, last = (float(f"{(end - display['zero']) / display['factor']:.2g}") for end in ends_in_si)
    return first, last


def _round_ends(value: float, highest: float | None) -> Interval:
    """Return slider ends for a value without usual ends: from 0 to a round number of at least 2.5 times the value.

    For a negative value, the slider is symmetric about 0; for the value 0, it ends at 1, or at ``highest`` if smaller.
    """
    if value == 0.0:
        return 0.0, 1.0 if highest is None else min(highest, 1.0)
    least = 2.5 * abs(value)
    decade = 10.0 ** math.floor(math.log10(least))
    size = next(number * decade for number in _ROUND_NUMBERS if number * decade >= least * (1.0 - 1e-9))
    return (-size, size) if value < 0.0 else (0.0, size)


def gauge_texts(scenario: Scenario, settings: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Return the pressures that follow the atmosphere, as gauge pressures by key, for example ``50 psi_g``."""
    following = {entry["key"] for entry in settings if entry["follows"]}
    gaps = {
        path: link.gap
        for path, links in scenario.graph.items()
        for link in links
        if link.sources == (ATMOSPHERE_PATH,) and path not in following
    }
    texts = {}
    for path, gap in gaps.items():
        # The shortest text that gives exactly the same number in SI.
        written = (
            f"{number!r} {unit}"
            for unit in _GAUGES
            for digits in range(1, 17)
            if to_si(number := float(f"{from_si(gap, unit, LEVEL, 0.0):.{digits}g}"), unit, LEVEL, 0.0) == gap
        )
        texts[path] = next(written, "")
    return texts


def bare_unit(unit: str) -> str:
    """Return a unit as typed by the user: empty for a plain number, whose unit in the description may be ``1``."""
    return "" if unit == "1" else unit


def typed_unit(unit: str, si: str) -> str:
    """Return the typed form of a display unit, with the suffix of a pressure difference."""
    return f"{unit}_d" if si == DIFFERENCE and not unit.endswith("_d") else unit
