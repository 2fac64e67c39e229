"""Defaults of a walk that follow other numbers, as their quantities declare: lags of the valve and of the sensors."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

from ppafo.model.declaration import FORCE_LAG, PRESSURE_LAG, VALVE_DELAY, VALVE_LAG, Quantity
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.device import Device, Valve
from ppafo.parameters.graph import Follows, Graph, Term
from ppafo.walking.planning import walking_valve

_TURN = 2.0 * math.pi


def lag_of_bandwidth(bandwidth: float) -> float:
    """Time constant [s] of a sensor of a bandwidth [Hz]; 0 for one that follows at once, whose bandwidth is 0."""
    return 1.0 / (_TURN * bandwidth) if bandwidth > 0.0 else 0.0


def links_of_defaults(sections: Mapping[str, Iterable[Quantity]], device: Device) -> Graph:
    """Return the links of the quantities of some sections whose defaults follow others, by path."""
    terms = _terms(device.valve)
    return {
        f"{section}.{item.name}": (Follows(tuple(terms[name] for name in item.follows), item.default or 0.0),)
        for section, items in sections.items()
        for item in items
        if item.follows
    }


def with_default(item: Quantity, path: str, links: Graph, present: Callable[[str], Any]) -> Quantity:
    """Return a quantity with the default that follows from what others are at ``present``."""
    return replace(item, default=float(links[path][0].number(present))) if path in links else item


def _terms(valve: Valve) -> dict[str, Term]:
    kind = VALVES[valve.kind]
    names = tuple(item.name for item in kind.quantities)
    paths, delay = tuple(f"valve.{name}" for name in names), walking_valve(valve).command_delay
    return {
        VALVE_LAG: Term(paths, kind.lag or delay, names),
        VALVE_DELAY: Term(paths, delay, names),
        PRESSURE_LAG: Term(("sensors.pressure_bandwidth",), lag_of_bandwidth),
        FORCE_LAG: Term(("sensors.force_bandwidth",), lag_of_bandwidth),
    }
