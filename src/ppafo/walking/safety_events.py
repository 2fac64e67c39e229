"""Safety events of a walk: reduced assistance, pause, stop or return of assistance, with fault flag and readings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.control.walking.fault_flags import FAULT_FLAGS, FaultFlag
from ppafo.engine.lanes import Floats
from ppafo.model.helping import HELPS, LIFTS, MID_STANCE, PAUSED, PUSH_OFF, STOPPED
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.units.shown import shown_text
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import law_of

SAFE_ROW = "controller_state.safety.level"
"""Path of the row for the assistance level of an event-based controller: full, lift-only, paused or stopped."""

SILENT_ROW = "unpowered.silent"
"""Path of the row for the time since the last controller signal, for a shut-off valve with a watchdog."""

SILENT = FaultFlag(
    "silent_controller", STOPPED, "the controller has stopped sampling: the watchdog has closed the supply", (), ()
)
"""Fault flag of the watchdog, which controllers cannot raise."""

VENTINGS_ROW = "controller_state.safety.ventings"
"""Path of the row that counts reductions of assistance (lift-only, pause, stop)."""

FINDING_ROW = "controller_state.safety.finding"
"""Path of the row for the last fault flag that reduced the assistance, with the readings at that time."""

_WORDS = {LIFTS: "lift-only (no push-off) from", PAUSED: "paused at", STOPPED: "stopped for good at"}
_RETURNS = {HELPS: "help came back", LIFTS: "the foot is lifted again"}
_NAMES = {HELPS: "help", LIFTS: "lift", PAUSED: "pause", STOPPED: "stop"}
_UNITS = {"heel_force": "N", "toe_force": "N", "angle": "rad", "pressure_1": "Pa_a", "pressure_2": "Pa_a"}
SHOWN = 5
"""Largest number of events printed individually; the file contains all events."""


def failure_times(configuration: Scenario) -> dict[str, float]:
    """Return the failure times [s] of sensors and parts of the plant, by name in order of time; {} if all are sound."""
    motion = walk_of(configuration)
    faults = {**motion.faults, **motion.broken}
    times = {part: float(fault.numbers["time"]) for part, fault in faults.items() if fault.kind}
    return dict(sorted(times.items(), key=lambda failure: failure[1]))


def acting_phase(recording: Recording) -> Floats:
    """Return the phase in which the device acts, for each sample (samples,), in the numbers of ``model.helping``.

    It is the controller's phase, with two exceptions: with lifting only, push-off counts as mid-stance, and during a
    pause or after a stop every phase counts as mid-stance, without torque. The recording must contain
    ``controller_phase``.
    """
    seen = recording["controller_phase"]
    level = recording["safe_state"] if "safe_state" in recording else np.zeros(seen.size)
    is_idle = (level > LIFTS) | ((level == LIFTS) & (seen == PUSH_OFF))
    return np.where(is_idle, MID_STANCE, seen)


@dataclass(frozen=True, slots=True)
class SafetyEvent:
    """Reduced assistance, pause, stop or return of assistance at a time [s] of the recording.

    ``level`` is the new assistance level, ``fault_flag`` the reason. ``readings`` are the sensor readings at this time
    and ``settings`` the limits with which they were compared, by name, in SI units; both are empty for a return of
    assistance. ``units`` are the units of the settings. Gauge pressures are relative to ``atmosphere`` [Pa absolute].
    """

    time: float
    level: float
    fault_flag: FaultFlag | None = None
    readings: Mapping[str, float] = field(default_factory=dict)
    settings: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    atmosphere: float = STANDARD_ATMOSPHERE

    @property
    def message(self) -> str:
        """Description of the event in one line."""
        if self.fault_flag is None:
            return f"{_RETURNS[self.level]} at {self.time:.2f} s"
        head = f"{_WORDS[self.level]} {self.time:.2f} s"
        zero = self.atmosphere
        words = {name: name.replace("_force", "").replace("_", " ") for name in self.readings}
        shown = [
            f"{words[name]} {shown_text(value, _UNITS[name], '.3g', zero)}" for name, value in self.readings.items()
        ]
        limits = [f"{name} {shown_text(value, self.units[name], '.3g', zero)}" for name, value in self.settings.items()]
        return f"{head}: {self.fault_flag.summary}; {'; '.join(', '.join(part) for part in (shown, limits) if part)}"

    def to_dict(self) -> dict[str, Any]:
        """Return the event as plain data, in SI units."""
        return {
            "time": self.time,
            "kind": _NAMES[self.level],
            "fault_flag": None if self.fault_flag is None else self.fault_flag.name,
            "readings": dict(self.readings),
            "settings": dict(self.settings),
            "message": self.message,
        }


def safety_events(configuration: Scenario, time: Floats, record: Mapping[str, Floats]) -> tuple[SafetyEvent, ...]:
    """Return the events of a walk in order of time, from its rows (samples,) by path at these times [s]."""
    watchdog: tuple[SafetyEvent, ...] = ()
    shut_off = walk_of(configuration).shut_off
    if SILENT_ROW in record and shut_off:
        silent = np.flatnonzero(record[SILENT_ROW] > shut_off["silence"])
        watchdog = (SafetyEvent(float(time[silent[0]]), STOPPED, SILENT),) if silent.size else ()
    if VENTINGS_ROW not in record:
        return watchdog
    level, ventings = record[SAFE_ROW], record[VENTINGS_ROW]
    vents = np.diff(ventings, prepend=0.0) > 0.0
    helps = np.diff(level, prepend=HELPS) < 0.0
    places = np.flatnonzero(vents | helps).tolist()
    quantities = {quantity.name: quantity for quantity in law_of(configuration).quantities}
    events = []
    for sample in places:
        event = SafetyEvent(float(time[sample]), float(level[sample]))
        if vents[sample] and level[sample] > HELPS:
            flag = FAULT_FLAGS[float(record[f"{FINDING_ROW}.fault_flag"][sample])]
            event = replace(
                event,
                fault_flag=flag,
                readings={name: float(record[f"{FINDING_ROW}.{name}"][sample]) for name in flag.readings},
                settings={name: configuration.controller.settings[name] for name in flag.settings},
                units={name: quantities[name].unit for name in flag.settings},
                atmosphere=configuration.device.supply.atmospheric_pressure,
            )
        events.append(event)
    # A watchdog that has acted stays, whatever the controller does when it comes back.
    return (*(event for event in events if not watchdog or event.time < watchdog[0].time), *watchdog)


def event_lines(events: Sequence[SafetyEvent]) -> list[str]:
    """Return each event as a line of text; of many events only the first few and the last, with the number omitted."""
    lines = [event.message for event in events]
    if len(lines) <= SHOWN:
        return lines
    between = len(lines) - SHOWN
    return [*lines[: SHOWN - 1], f"... and {between} more changes of assistance", lines[-1]]
