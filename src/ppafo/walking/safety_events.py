"""Every pause, stop and return of help in a walk: when, by which sign, with which readings and settings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.control.walking.signs import HELPS, LIFTS, PAUSED, SIGNS, STOPPED, Sign
from ppafo.engine.lanes import Floats
from ppafo.simulation.declaration import PLAIN
from ppafo.simulation.reading import WRITTEN_UNITS
from ppafo.simulation.scenario import Scenario
from ppafo.units import from_si
from ppafo.walking.planning import law_of
from ppafo.walking.recorded import FINDING_ROW, SAFE_ROW, VENTINGS_ROW

_WORDS = {LIFTS: "lift-only (no push-off) from", PAUSED: "paused at", STOPPED: "stopped for good at"}
_RETURNS = {HELPS: "help came back", LIFTS: "the foot is lifted again"}
_NAMES = {HELPS: "help", LIFTS: "lift", PAUSED: "pause", STOPPED: "stop"}
_UNITS = {"heel_force": "N", "toe_force": "N", "angle": "rad", "pressure_1": "Pa_a", "pressure_2": "Pa_a"}
SHOWN = 5
"""Events that are listed one by one; of more the first ones are, and all are in the file."""


@dataclass(frozen=True, slots=True)
class SafetyEvent:
    """Less help, a pause, a stop or a return of help at a time [s] of the recording.

    ``readings`` are what the sensors showed then and ``settings`` what they were compared with, by name, in SI units;
    empty where help came back. ``units`` are those of the settings. Gauge pressures count from ``atmosphere`` [Pa
    absolute].
    """

    time: float
    level: float
    sign: Sign | None = None
    readings: Mapping[str, float] = field(default_factory=dict)
    settings: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    atmosphere: float = STANDARD_ATMOSPHERE

    @property
    def message(self) -> str:
        """The event in one line."""
        if self.sign is None:
            return f"{_RETURNS[self.level]} at {self.time:.2f} s"
        head = f"{_WORDS[self.level]} {self.time:.2f} s"
        zero = self.atmosphere
        shown = [f"{_word(name)} {_text(value, _UNITS[name], zero)}" for name, value in self.readings.items()]
        limits = [f"{name} {_text(value, self.units[name], zero)}" for name, value in self.settings.items()]
        return f"{head}: {self.sign.summary}; {'; '.join(', '.join(part) for part in (shown, limits) if part)}"

    def to_dict(self) -> dict[str, Any]:
        """Return the event as plain data, in SI units."""
        return {
            "time": self.time,
            "kind": _NAMES[self.level],
            "sign": None if self.sign is None else self.sign.name,
            "readings": dict(self.readings),
            "settings": dict(self.settings),
            "message": self.message,
        }


def safety_events(configuration: Scenario, time: Floats, record: Mapping[str, Floats]) -> tuple[SafetyEvent, ...]:
    """Return the events of a walk in their order, from its rows (samples,) by path at these times [s]."""
    if SAFE_ROW not in record:
        return ()
    level, ventings = record[SAFE_ROW], record[VENTINGS_ROW]
    vents = np.diff(ventings, prepend=0.0) > 0.0
    helps = np.diff(level, prepend=HELPS) < 0.0
    places = np.flatnonzero(vents | helps).tolist()
    return tuple(
        _venting(configuration, float(time[place]), float(level[place]), record, place)
        if vents[place] and level[place] > HELPS
        else SafetyEvent(float(time[place]), float(level[place]))
        for place in places
    )


def _venting(
    configuration: Scenario, time: float, level: float, record: Mapping[str, Floats], place: int
) -> SafetyEvent:
    sign = SIGNS[float(record[f"{FINDING_ROW}.sign"][place])]
    quantities = {item.name: item for item in law_of(configuration).quantities}
    return SafetyEvent(
        time=time,
        level=level,
        sign=sign,
        readings={name: float(record[f"{FINDING_ROW}.{name}"][place]) for name in sign.readings},
        settings={name: configuration.control.settings[name] for name in sign.settings},
        units={name: quantities[name].unit for name in sign.settings},
        atmosphere=configuration.device.supply.atmospheric_pressure,
    )


def _word(name: str) -> str:
    return name.replace("_force", "").replace("_", " ")


def _text(value: float, si_unit: str, atmosphere: float) -> str:
    """Return a value in SI as people write it, with three digits; gauge counts from ``atmosphere`` [Pa absolute]."""
    unit = WRITTEN_UNITS.get(si_unit, "" if si_unit in PLAIN else si_unit)
    return f"{from_si(value, unit, si_unit, atmosphere):.3g} {unit}".rstrip()


def event_lines(events: Sequence[SafetyEvent]) -> list[str]:
    """Return the events as lines: each one, or the first ones and the last and how many lie between."""
    lines = [event.message for event in events]
    if len(lines) <= SHOWN:
        return lines
    between = len(lines) - SHOWN
    return [*lines[: SHOWN - 1], f"... and {between} more pauses and returns of help", lines[-1]]
