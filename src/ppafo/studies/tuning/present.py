"""The value that a scenario has at a path before anything is varied."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from ppafo.errors import ScenarioError
from ppafo.simulation.scenario import LedMotion, Scenario

_RENAMED = {
    "run.duration": "duration",
    "run.step": "time_step",
    "run.output_interval": "output_interval",
    "controller.period": "control.period",
    "initial.pressure_1": "initial_pressure_1",
    "initial.pressure_2": "initial_pressure_2",
    "sensors.angle_resolution": "sensors.angle_quantum",
    "sensors.pressure_resolution": "sensors.pressure_quantum",
}
_SETTINGS = {
    "controller": "control.settings",
    "reference": "reference.settings",
    "motion.profile": "motion.profile.settings",
}


def present_value(path: str, scenario: Scenario) -> float:
    """Return the value [SI] of a scenario at a path as in overrides; ScenarioError where it has none there."""
    if path == "controller.rate":
        return 1.0 / scenario.control.period
    node: Any = scenario
    for part in _place(path, scenario).split("."):
        node = node.get(part) if isinstance(node, Mapping) else getattr(node, part, None)
    if not isinstance(node, int | float):
        raise ScenarioError(f"scenario '{scenario.name}' has no value '{path}' now; give it one with an override")
    return float(node)


def _place(path: str, scenario: Scenario) -> str:
    """Return the attributes and keys that lead to a value."""
    section, _, name = path.rpartition(".")
    if path in _RENAMED:
        return _RENAMED[path]
    if path == "motion.angle" and isinstance(scenario.motion, LedMotion):
        return "motion.profile.settings.level"
    if section in _SETTINGS:
        return f"{_SETTINGS[section]}.{name}"
    if section in ("motion", "sensors"):
        return path
    if section == "valve":
        is_orifice = name in {item.name for item in fields(scenario.device.valve.orifice)}
        return f"device.valve.{'orifice' if is_orifice else 'settings'}.{name}"
    return f"device.{path}"
