"""Electrical energy of coils, spool and processor over a walk, and the battery that supplies it."""

import math
from dataclasses import dataclass

import numpy as np

from ppafo.model.valves.kind import VENTS_ABOVE
from ppafo.parameters.parts import Part
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

USABLE = 0.8
"""Usable fraction of a battery's energy; cold, ageing and a converter of 90 % take the rest. Assumed."""


@dataclass(frozen=True, slots=True)
class Electrical:
    """Electrical energy of a walk, and the battery that supplies it.

    ``powers``: mean power [W] by consumer
    ``cell``: cell of the battery
    ``cells``: number of cells
    ``is_whole``: False if the catalogue states no power for the valve, which is then missing in ``powers``
    """

    powers: dict[str, float]
    cell: Part
    cells: int
    is_whole: bool = True

    @property
    def power(self) -> float:
        """Mean electrical power of all consumers [W]."""
        return sum(self.powers.values())

    @property
    def mass(self) -> float:
        """Mass of the battery [kg]."""
        return self.cells * self.cell.values["mass"]

    @property
    def lasts(self) -> float:
        """Operating time of the battery [s]."""
        return USABLE * self.cells * self.cell.values["energy"] / self.power


def valve_power(valve: Part, command: Floats) -> Floats:
    """Return the electrical power [W] of a valve under commands (samples,) of -1 to 1, or to vent.

    For a pair of on/off valves, one coil is energised while its chamber is filled, none while both chambers vent. A
    spool valve takes its power at the centre position, and beyond it the power of the data sheet at full stroke in
    proportion to the stroke. The power is 0 if the catalogue states none.
    """
    # A command to vent is beyond 1 and no stroke.
    stroke = np.where(command > VENTS_ABOVE, 0.0, np.abs(command))
    idle, full = valve.values.get("idle_power", 0.0), valve.values.get("power", 0.0)
    return np.where(stroke > 0.0, full, idle) if valve.kind == "solenoid" else idle + (full - idle) * stroke


def electrical_of(recording: Recording, valve: Part, processor: Part, cell: Part, seconds: float) -> Electrical:
    """Return the electrical energy of a walk as means over the recording.

    The battery has as many cells as a walk of ``seconds`` [s] needs.
    """
    time, power = recording.time, valve_power(valve, recording["command"])
    # Each sample holds until the next one, as the controller's outputs do.
    length = float(time[-1] - time[0])
    mean = float(np.sum(power[:-1] * np.diff(time)) / length)
    is_whole = "power" in valve.values
    powers = {"valve": mean} if is_whole else {}
    powers["processor"] = processor.values["power"]
    needed = sum(powers.values()) * seconds / (USABLE * cell.values["energy"])
    return Electrical(powers, cell, max(1, math.ceil(needed)), is_whole)


def electrical_sentences(electrical: Electrical) -> list[str]:
    """Return sentences on the powers, and on mass and duration of the battery."""
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
