"""Content of a page as plain data for its script: scenarios and walks with settings, and conversions of units."""

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ppafo.errors import ScenarioError, UnitError
from ppafo.page.motions import declared_content, is_walk, usual_changes
from ppafo.page.setting import DIFFERENCE, LEVEL, Interval, bare_unit, gauge_texts, page_setting, typed_unit
from ppafo.page.wasm import WasmModule
from ppafo.page.words import stored_data
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.parameters.joint import ANKLE, JointNames
from ppafo.parameters.overrides import over, read_overrides
from ppafo.report.display_units import metric_quantity
from ppafo.report.style import PAGE_LOOKS
from ppafo.simulation.document import value_at
from ppafo.simulation.overrides import is_of_device, override_document
from ppafo.simulation.scenario import Scenario
from ppafo.units import conversion, parse_quantity
from ppafo.units.shown import QUANTITIES
from ppafo.version import __version__

_UNITS: dict[str, tuple[str, ...]] = {
    LEVEL: ("psi_g", "psi_a", "bar_g", "bar_a", "kPa_g", "kPa_a", "MPa_g", "MPa_a", "Pa_g", "Pa_a"),
    DIFFERENCE: ("psi_d", "bar_d", "kPa_d", "Pa_d"),
    "m^2": ("mm^2", "cm^2", "m^2"),
    "m^3": ("cm^3", "mm^3", "L", "m^3"),
    "m^3/rad": ("cm^3/rad", "cm^3/deg", "m^3/rad"),
    "rad": ("deg", "rad"),
    "rad/s": ("deg/s", "rad/s"),
    "s": ("s", "ms", "us", "min"),
    "Hz": ("Hz", "kHz"),
    "K": ("K", "degC"),
    "kg": ("g", "kg", "mg"),
    "kg/mol": ("g/mol", "kg/mol"),
    "m": ("mm", "cm", "m"),
    "N m/rad": ("N m/rad", "N m/deg"),
    "kg m^2": ("g m^2", "kg cm^2", "kg m^2"),
    "kg m^2/s": ("g m^2/s", "kg m^2/s", "N m s"),
    "": ("", "percent"),
}
"""Units accepted for typed values, besides the display unit and the SI unit."""


@dataclass(frozen=True, slots=True)
class PageSimulation:
    """Scenario or walk with its WebAssembly module; ``label`` distinguishes it within a tab."""

    scenario: Scenario
    module: WasmModule
    label: str


def program_content(simulated: PageSimulation, module: str, intervals: Mapping[str, Interval]) -> dict[str, Any]:
    """Return the page data of a scenario or walk.

    ``module`` is the id of the HTML element with the WebAssembly module; ``intervals`` are 95 % intervals [SI] by key.
    """
    described, scenario = simulated.module.description, simulated.scenario
    entries, joint, document = described["settings"], scenario.device.joint, _document(described, scenario)
    keys, gauges = {entry["key"] for entry in entries}, gauge_texts(scenario, entries)
    return {
        "name": described["name"],
        "kind": described["kind"],
        "actuator": scenario.device.actuator.kind,
        "label": simulated.label,
        # Index of the first colour. The page gives walks the colours in their order.
        "look": 0 if is_walk(scenario) else PAGE_LOOKS.get(scenario.device.valve.kind, 0),
        "description": " ".join(described["title"].split()),
        "document": document,
        "usual": usual_changes(scenario),
        "deviceSections": sorted({key.partition(".")[0] for key in keys if is_of_device(key)}),
        "settings": [
            page_setting(entry, value_at(document, entry["key"]), gauges.get(entry["key"], ""), intervals, scenario)
            for entry in entries
        ],
        "relations": [_relation(relation) for relation in described["relations"]],
        "channels": [_shown(entry, joint) for entry in described["channels"] if entry["name"] != "time"],
        "metrics": [_shown(entry, joint) for entry in described["metrics"]],
        # None for an actuator without these settings, whose static torque is not proportional to a pressure.
        "sustained": dict(_SUSTAINED) if keys >= set(_SUSTAINED.values()) else None,
        "module": module,
    }


def _document(described: Mapping[str, Any], scenario: Scenario) -> dict[str, Any]:
    """Return the file of a scenario or walk with its overrides: values of the device are in ``device.overrides``."""
    overrides = read_overrides(described["overrides"], ScenarioError)
    changed = override_document(described["document"], overrides, described["name"], declared_content(scenario))
    device = changed.document.get("device", {})
    of_device = [*over(device.get("overrides", ()), map(str, changed.device), valve=scenario.device.valve_name)]
    return {**changed.document, "device": {**device, "overrides": of_device} if of_device else dict(device)}


def _relation(described: Mapping[str, Any]) -> dict[str, Any]:
    """Return a relation between two settings: ``key`` against ``factor`` times ``other``, with tolerance ``slack``."""
    tolerance, is_share = described["tolerance"], described["is_share"]
    return {
        **{name: described[name] for name in ("key", "relation", "other")},
        "factor": 1.0 + tolerance * is_share,
        "slack": 0.0 if is_share else tolerance,
    }


_SUSTAINED = {
    "factor": "actuator.torque_constant",
    "raised": "supply.pressure",
    "lowered": "supply.dorsiflexion_pressure",
    "zero": ATMOSPHERE_PATH,
}
"""Settings that determine the static torque range at the supply pressures, by name in the script of a page."""


def usual_values(scenario: Scenario) -> dict[str, float]:
    """Return the initial changes of a scenario on a page, as times [s] by key."""
    return {key: parse_quantity(text, "s") for key, text in usual_changes(scenario).items()}


def page_content(
    title: str,
    form: str,
    tabs: Sequence[Mapping[str, Any]],
    programs: Sequence[Mapping[str, Any]],
    joint: str = ANKLE.name,
) -> dict[str, Any]:
    """Return all page data except modules; ``joint`` is the joint in plot titles."""
    shown = {
        (entry["unit"], entry["shown"])
        for program in programs
        for kind in ("settings", "channels", "metrics")
        for entry in program[kind]
    }
    recorded = {("s", "s"), ("N m", "N m"), (LEVEL, "psi_g"), ("rad", "deg"), ("", ""), ("kg", "g")}
    wanted: dict[str, dict[str, None]] = {}
    for si, unit in sorted(shown | recorded):
        wanted.setdefault(si, {}).update(dict.fromkeys((unit, *_UNITS.get(si, ()), si)))
    # Conversion of every unit that may be typed into SI, as decimal texts, as ``ppafo.units`` computes in decimals.
    scales: dict[str, list[dict[str, Any]]] = {}
    for si, units in wanted.items():
        scales[si] = []
        for unit in units:
            # A display unit that cannot be typed for this quantity has no conversion.
            with contextlib.suppress(UnitError):
                scale, offset, is_gauge = conversion(typed_unit(unit, si), si)
                scales[si].append({"unit": unit, "scale": str(scale), "offset": str(offset), "isGauge": is_gauge})
    return {
        "version": __version__,
        "title": title,
        "joint": joint,
        "form": form,
        "tabs": list(tabs),
        "bottle": stored_data("minutes.json"),
        "programs": list(programs),
        "units": scales,
        # Magnitude below which a number is shown as 0, by SI unit.
        "zeros": {unit: QUANTITIES[kind].zero for unit in wanted if (kind := metric_quantity(unit))},
    }


def _shown(entry: Mapping[str, Any], joint: JointNames) -> dict[str, str]:
    """Return a channel or metric of a run as the script of a page reads it."""
    unit = LEVEL if entry["unit"] == "Pa" else bare_unit(entry["unit"])
    text = entry["description"]
    return {
        "name": entry["name"],
        "unit": unit,
        "shown": bare_unit(entry["display"]["unit"]),
        "label": joint.said(text[:1].upper() + text[1:]),
    }
