"""Scenarios as plain data for ``run.json``: numbers in SI units, nothing left to look up elsewhere."""

import dataclasses
import math
import numbers
from collections.abc import Mapping
from typing import Any

from ppafo.simulation.scenario import Scenario

UNITS = "SI: kg, m, s, K, mol; angles in rad, pressures in Pa absolute, torques in N m"


def scenario_document(scenario: Scenario) -> dict[str, Any]:
    """Return the whole scenario with every number of the device, in SI units, as data that JSON can hold."""
    document: dict[str, Any] = plain(scenario)
    lines = scenario.supply_lines
    document["supply_lines"] = None if lines is None else plain(lines._asdict())
    return {"units": UNITS, **document}


def plain(value: Any) -> Any:
    """Return dicts, lists, texts and finite numbers; an infinite number becomes None, a controller its type's name."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        # Links are no part of what is run: what is not compared is not shown.
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value) if field.compare}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    return _plain_leaf(value)


def _plain_leaf(value: Any) -> str | bool | int | float | None:
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, numbers.Integral):
        return int(value)
    if isinstance(value, numbers.Real):
        return float(value) if math.isfinite(value) else None
    return f"{type(value).__module__}.{type(value).__qualname__}"
