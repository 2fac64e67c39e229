"""What the slap of the foot comes from: one thing of the device or its control changed at a time, and all of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ppafo.errors import SimulationError
from ppafo.parameters.device import Device, Orifice
from ppafo.progress import Progress, Report
from ppafo.walking.comparison import with_device_off
from ppafo.walking.configuration import Configuration
from ppafo.walking.loading import load_walk
from ppafo.walking.walk import walk
from ppafo.walking.walk_metrics import settled

MINUTES = 0.3
LARGER = 4.0
"""Valves of so many times the area, chambers of one so manieth of the volume: about as far as virtual work allows."""

HIGHER = 20.0 * 6894.757293168361
"""Rise of both supply pressures [Pa]: 20 psi."""

LEAD = "30 ms"
TIMED = ("timing.kind=fractional",)
EARLY = (*TIMED, f"timing.valve_delay={LEAD}")


@dataclass(frozen=True, slots=True)
class SlapSource:
    """A walk with one change: rate of the foot as it comes down [rad/s], and what it falls from and costs.

    ``drop`` [rad] is how far the foot is tilted up at the heel strike above where it lies flat; ``lowest_toes`` [m] in
    mid-swing, ``gas`` [kg] and ``push_off_work`` [J] a stride.
    """

    change: str
    slap_rate: float
    drop: float
    lowest_toes: float
    gas: float
    push_off_work: float


def larger_valves(device: Device) -> Device:
    """The device with valves of a larger area."""
    orifice = device.valve.orifice
    larger = (
        replace(orifice, area=LARGER * orifice.area)
        if isinstance(orifice, Orifice)
        else replace(orifice, sonic_conductance=LARGER * orifice.sonic_conductance)
    )
    return replace(device, valve=replace(device.valve, orifice=larger))


def smaller_chambers(device: Device) -> Device:
    """The device with smaller chambers and the same torque constant."""
    actuator = device.actuator
    volumes = {
        name: getattr(actuator, name) / LARGER for name in ("volume_per_angle", "dead_volume_1", "dead_volume_2")
    }
    return replace(device, actuator=replace(actuator, **volumes))


def higher_pressure(device: Device) -> Device:
    """The device with more pressure of both supplies."""
    supply = device.supply
    pressures = {name: getattr(supply, name) + HIGHER for name in ("pressure", "dorsiflexion_pressure")}
    return replace(device, supply=replace(supply, **pressures))


def same_device(device: Device) -> Device:
    """The device as it is."""
    return device


def all_together(device: Device) -> Device:
    """The device with larger valves, smaller chambers and more pressure."""
    return higher_pressure(smaller_chambers(larger_valves(device)))


LOW, HIGH, TRIES = 1.45, 1.95, 8
"""Swing angles [rad] between which the foot is made to fall as far as with the device as it is, in so many walks."""

Change = tuple[str, Sequence[str], Callable[[Device], Device]]

CHANGES: tuple[Change, ...] = (
    ("as it is", (), same_device),
    (f"valves {LARGER:g} times as large", (), larger_valves),
    (f"chambers of 1/{LARGER:g} the volume", (), smaller_chambers),
    ("20 psi more pressure", (), higher_pressure),
    ("time in the stride known (fractional)", TIMED, same_device),
    (f"the same, valves switched {LEAD} ahead", EARLY, same_device),
    ("device and timing together", EARLY, all_together),
)


def slap_sources(
    file: str, overrides: Sequence[str], gait: str | Path | None, progress: Report
) -> tuple[SlapSource, ...]:
    """Walk with the device off, as it is, and with each change; SimulationError where a walk diverges."""
    found: list[SlapSource] = []
    for number, (change, own, device) in enumerate(CHANGES):
        progress(Progress(f"slap, {change}", number, len(CHANGES) + 1))
        configuration = load_walk(file, (*overrides, *own), gait)
        changed = replace(configuration, device=device(configuration.device))
        found.append(_fallen_as_far(change, changed, found[0].drop) if found else _walked(change, changed))
    progress(Progress("slap, device off", len(CHANGES), len(CHANGES) + 1))
    return (_walked("device off", with_device_off(load_walk(file, overrides, gait))), *found)


def _fallen_as_far(change: str, configuration: Configuration, drop: float) -> SlapSource:
    """Walk with the swing angle at which the foot falls as far [rad] as with the device as it is, or nearly so.

    Else a change that lifts the foot higher would seem to make the slap.
    """
    tried: list[SlapSource] = []
    low, high = LOW, HIGH
    for _ in range(TRIES):
        angle = 0.5 * (low + high)
        found = _walked(change, replace(configuration, settings={**configuration.settings, "swing_angle": angle}))
        tried.append(found)
        low, high = (angle, high) if found.drop > drop else (low, angle)
    return min(tried, key=lambda item: abs(item.drop - drop))


def _walked(change: str, configuration: Configuration) -> SlapSource:
    result = walk(configuration, MINUTES)
    if not result.status.is_completed:
        raise SimulationError(f"{configuration.name}, {change}: {result.status.message}")
    recording = result.recording
    helped = np.flatnonzero(settled(result.helped))
    tilt = recording["shank_angle"] - recording["angle"]
    strikes = result.starts[:-1][helped]
    flat = [
        float(tilt[a:b][recording["contact"][a:b] == 2.0][0])
        for a, b in zip(strikes, result.starts[1:][helped], strict=True)
    ]
    metrics = result.metrics
    return SlapSource(
        change=change,
        slap_rate=metrics["slap_rate"].value,
        drop=float(np.mean(tilt[strikes] - np.array(flat))),
        lowest_toes=metrics["lowest_toes"].value,
        gas=metrics["gas"].value,
        push_off_work=metrics["push_off_work"].value,
    )
