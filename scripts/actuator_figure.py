"""Draws every kind of actuator: torque and volume over the angle, and the step responses of the example.

    python scripts/actuator_figure.py docs/images/actuators.png

Solid lines are at the pressure of the supply in chamber 1, dashed ones at half of it; chamber 2 is at the atmosphere.
"""

import argparse
from importlib import resources
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from ppafo import load_device, simulate
from ppafo.answers.style import house_style
from ppafo.engine.scheme.actuators import torque_of, volumes_of
from ppafo.model.catalog import ACTUATORS
from ppafo.parameters.plant import plant_parameters

EXAMPLE = Path(str(resources.files("ppafo") / "examples" / "actuators"))
SHOWN = {
    "cylinder": ("cylinder-lever", "cylinder with a lever"),
    "muscles": ("muscle-pair", "McKibben pair"),
    "bladder": ("fabric-bladder", "fabric bladders"),
    "measured-bladder": (str(EXAMPLE / "measured-bladder.toml"), "measured (synthetic)"),
}
"""Set and label of each by the ending of its scenarios."""


def draw_relation(torques: Axes, volumes: Axes, name: str, label: str, colour: str) -> None:
    """Draw torque and volume of chamber 1 over the angle at two pressures."""
    device = load_device(name)
    plant, model = plant_parameters(device), ACTUATORS[device.actuator.kind].model
    angles = np.linspace(plant.angle_min, plant.angle_max, 181)
    room = np.full(angles.size, plant.atmospheric_pressure)
    for share, line in ((1.0, "-"), (0.5, "--")):
        pressure = room + share * (plant.supply_pressure - plant.atmospheric_pressure)
        torque = torque_of(model, plant, angles, pressure, room)
        volume = volumes_of(model, plant, angles, pressure, room)[0]
        torques.plot(np.degrees(angles), torque, line, color=colour, label=label if share == 1.0 else None)
        volumes.plot(np.degrees(angles), 1e6 * volume, line, color=colour)


def main() -> None:
    """Draw and write the figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, help="the picture")
    chosen = parser.parse_args()
    with house_style():
        draw(chosen.out)


def draw(out: Path) -> None:
    """Draw all kinds into one picture."""
    figure, ((torques, volumes), (angles, pressures)) = plt.subplots(2, 2, figsize=(9.0, 6.2), layout="constrained")
    for number, (ending, (name, label)) in enumerate(SHOWN.items()):
        draw_relation(torques, volumes, name, label, f"C{number}")
        recording = simulate(EXAMPLE / f"step-response-{ending}.toml").recording
        room = plant_parameters(load_device(name)).atmospheric_pressure
        angles.plot(recording.time, np.degrees(recording["angle"]), color=f"C{number}")
        pressures.plot(recording.time, 1e-3 * (recording["pressure_1"] - room), color=f"C{number}")
    torques.set(
        xlabel="angle [deg]", ylabel="torque [N m]", title="chamber 1 at supply pressure (dashed: at half of it)"
    )
    volumes.set(xlabel="angle [deg]", ylabel="volume of chamber 1 [mL]", yscale="log", title="the same")
    angles.set(xlabel="time [s]", ylabel="angle [deg]", title="step response of the example")
    pressures.set(xlabel="time [s]", ylabel="gauge pressure 1 [kPa]", title="the same")
    torques.legend()
    figure.savefig(out, dpi=110)


if __name__ == "__main__":
    main()
