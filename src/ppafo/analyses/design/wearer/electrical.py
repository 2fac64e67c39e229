"""Electrical energy of coils, spool, shut-off valve and processor over a walk, and the battery that supplies it."""

import math
from dataclasses import dataclass

import numpy as np

from ppafo.model.valves.kind import VENTS_ABOVE
from ppafo.parameters.parts import Part
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

USABLE = 0.8
"""Share of a battery's energy that is taken: cold, ageing and a converter of 90 % take the rest. Assumed."""


@dataclass(frozen=True, slots=True)
class Electrical:
    """Mean powers [W] by consumer, and the battery: how many cells, their mass [kg], how long they last [s].

    ``is_whole`` is False where the catalogue states no power of the valve, which is then not among them.
    """

    powers: dict[str, float]
    cell: Part
    cells: int
    is_whole: bool = True

    @property
    def power(self) -> float:
        """Mean power [W] of all consumers."""
        return sum(self.powers.values())

    @property
    def mass(self) -> float:
        """Mass of the battery [kg]."""
        return self.cells * self.cell.values["mass"]

    @property
    def lasts(self) -> float:
        """Time [s] for which the battery lasts."""
        return USABLE * self.cells * self.cell.values["energy"] / self.power


def valve_power(valve: Part, command: Floats) -> Floats:
    """Return the electrical power [W] of a valve, both of a pair, under a command (samples,) of -1 to 1, or to vent.

    One coil of a pair is energised while its chamber is filled, none while both vent. A spool takes the power of its
    centre, and what its data sheet states at full stroke in proportion to the stroke beyond. Nothing where its
    catalogue states no power.
    """
    # A command to vent is beyond 1 and no stroke.
    stroke = np.where(command > VENTS_ABOVE, 0.0, np.abs(command))
    idle, full = valve.values.get("idle_power", 0.0), valve.values.get("power", 0.0)
    if valve.kind == "solenoid":
        return np.where(stroke > 0.0, full, idle)
    return idle + (full - idle) * stroke


def electrical_of(
    recording: Recording, valve: Part, shut_off_power: float, processor: Part, cell: Part, seconds: float
) -> Electrical:
    """Return the electrical side of a walk, with as many cells as a time [s] takes; means over the recorded walk."""
    time, power = recording.time, valve_power(valve, recording["command"])
    # Each sample holds until the next one, as the controller's outputs do.
    length = float(time[-1] - time[0])
    mean = float(np.sum(power[:-1] * np.diff(time)) / length)
    # A controller without a safe state helps all the time.
    helps = recording["safe_state"] < 0.5 if "safe_state" in recording else np.ones(time.size)
    share = float(np.sum(helps[:-1] * np.diff(time)) / length)
    is_whole = "power" in valve.values
    powers = {"valve": mean} if is_whole else {}
    powers |= {"shut-off valve": shut_off_power * share, "processor": processor.values["power"]}
    needed = sum(powers.values()) * seconds / (USABLE * cell.values["energy"])
    return Electrical(powers, cell, max(1, math.ceil(needed)), is_whole)


def electrical_sentences(electrical: Electrical) -> list[str]:
    """Return powers, and mass and minutes of the battery."""
    parts = ", ".join(
        f"{name} {power:.3g} W" if power >= 1.0 else f"{name} {1000.0 * power:.3g} mW"
        for name, power in electrical.powers.items()
    )
    valve = "" if electrical.is_whole else ", without the valve, whose power the catalogue does not state"
    return [
        f"electrical power: {electrical.power:.3g} W ({parts}){valve}",
        f"battery: {electrical.cells} x {electrical.cell.title}, {1000.0 * electrical.mass:.0f} g, "
        f"runs {electrical.lasts / 60.0:.0f} min; "
        f"{100.0 * USABLE:.0f} % of its energy is counted",
    ]
