"""A mesh over the exhaust port of the valve: what leaves a chamber passes it after the valve."""

import math
from typing import Any, NamedTuple

from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import Effect
from ppafo.model.orifice import area_conductance
from ppafo.model.places import way_out


class Mesh(NamedTuple):
    """One over the square of the conductance of the mesh [(s Pa/kg)^2]."""

    resistance: float


def behind_mesh(conductance: float, mesh: Mesh) -> float:
    """Conductance [kg/(s Pa)] of valve and mesh in a row, from that of the valve; 1/C^2 = 1/C_v^2 + 1/C_m^2."""
    return way_out(conductance / math.sqrt(1.0 + conductance * conductance * mesh.resistance))


def prepare(settings: Any, device: Any) -> Mesh:
    """The row of the mesh from its open area [m^2], with the gas of the device. Equation (6)."""
    area, gas = settings["area"], device.gas
    full = area_conductance(
        area,
        settings["discharge_coefficient"],
        gas.heat_capacity_ratio,
        gas.specific_gas_constant,
        gas.temperature,
    )
    return Mesh(1.0 / (full * full) if area > 0.0 else 0.0)


EFFECT = Effect(
    name="mesh",
    summary="A mesh over the exhaust port.",
    quantities=(
        Quantity("area", "m^2", "open area of the mesh, 0 for none", 0.0, 0.0, 1.0e-2),
        Quantity("discharge_coefficient", "", "discharge coefficient of the mesh", 0.6, 0.01, 2.0),
    ),
    parameters=Mesh,
    prepare=prepare,
    switch=("area",),
    laws={way_out: behind_mesh},
    source="equation (6) of the paper, and pressure drops in a row that add up",
    equation="1/C^2 = 1/C_v^2 + 1/C_m^2",
    symbols=(("1/C_m^2", "resistance", "(s Pa/kg)^2", "one over the square of the conductance of the mesh"),),
)
