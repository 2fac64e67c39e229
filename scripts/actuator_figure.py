"""Draws every kind of actuator: torque and volume over the angle, and the step responses of the tests.

    python scripts/actuator_figure.py docs/images/actuators.png

Solid lines are at the pressure of the supply in chamber 1, dashed ones at half of it; chamber 2 is at the atmosphere.
"""

import argparse
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from ppafo import load_device, simulate
from ppafo.answers.style import COLOURS, Margins, figure_of_free_panels, house_style, mark_kind
from ppafo.engine.scheme.actuators import torque_of, volumes_of
from ppafo.model.catalog import ACTUATORS
from ppafo.parameters.plant import plant_parameters

EXAMPLE = Path(__file__).parents[1] / "tests" / "actuators"
SHOWN = {
    "cylinder": ("cylinder-lever", "cylinder with a lever"),
    "muscles": ("muscle-pair", "McKibben pair"),
    "bladder": ("fabric-bladder", "fabric bladders"),
    "measured-bladder": (str(EXAMPLE / "measured-bladder.toml"), "measured (synthetic)"),
}
"""Set and label of each by the ending of its scenarios."""
MARGINS = Margins(left=0.65, right=0.2, top=0.75, bottom=0.55, row_gap=0.95, column_gap=0.85)


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
    figure, ((torques, volumes), (angles, pressures)) = figure_of_free_panels((9.0, 6.6), MARGINS, 2, 2)
    for (ending, (name, label)), colour in zip(SHOWN.items(), COLOURS, strict=False):
        draw_relation(torques, volumes, name, label, colour)
        recording = simulate(EXAMPLE / f"step-response-{ending}.toml").recording
        room = plant_parameters(load_device(name)).atmospheric_pressure
        angles.plot(recording.time, np.degrees(recording["angle"]), color=colour)
        pressures.plot(recording.time, 1e-3 * (recording["pressure_1"] - room), color=colour)
    torques.set(xlabel="Angle (deg)", ylabel="Torque (N m)", ylim=(0.0, None))
    torques.set_title("Torque with chamber 1 at supply; dashed: at half of it")
    volumes.set(xlabel="Angle (deg)", ylabel="Volume of chamber 1 (mL)", yscale="log")
    volumes.set_title("Volume of chamber 1")
    volumes.yaxis.set_major_formatter("{x:g}")
    angles.set(xlabel="Time (s)", ylabel="Angle (deg)", title="Step response: angle")
    pressures.set(xlabel="Time (s)", ylabel="Gauge pressure 1 (kPa)", title="Step response: pressure in chamber 1")
    figure.legend(*torques.get_legend_handles_labels(), loc="upper left", ncols=4, bbox_to_anchor=(0.06, 0.995))
    mark_kind(figure, "simulated")
    figure.savefig(out, dpi=110)


if __name__ == "__main__":
    main()
