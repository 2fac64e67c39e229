"""Lines with flow resistance between valve and chambers, in series with the valve."""

from typing import Annotated, Any, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect
from ppafo.model.orifice import area_conductance, conductance_in_series
from ppafo.model.ports import exhaust_path, supply_path


class LineResistance(NamedTuple):
    """Inverse square of the conductance of each line [(s Pa/kg)^2]; 0 without a line."""

    resistance: float


class LineSettings(NamedTuple):
    """Settings of a line, as an orifice with the same pressure drop."""

    area: Annotated[
        float, Number("m^2", "area of an orifice with the pressure loss of a line, 0 for no loss", 0.0, 0.0, 1.0e-2)
    ]
    discharge_coefficient: Annotated[float, Number("", "discharge coefficient of that orifice", 0.6, 0.01, 2.0)]


def prepare(settings: LineSettings, device: Any) -> LineResistance:
    """Parameters of an orifice with the pressure drop of a line, for the gas of the device. Equation (6)."""
    area = settings.area
    gas = device.gas
    conductance = area_conductance(
        area, settings.discharge_coefficient, gas.heat_capacity_ratio, gas.specific_gas_constant, gas.temperature
    )
    # Without an area there is no line and no loss, and a conductance of 0 would divide by 0.
    return LineResistance(1.0 / (conductance * conductance) if area > 0.0 else 0.0)


def fed_through_line(conductance: float, line_resistance: LineResistance) -> float:
    """Conductance [kg/(s Pa)] from a supply to a chamber, given the valve's: ``1/C^2 = 1/C_v^2 + 1/C_r^2``.

    The volume of a line is part of the dead volume of its chamber, and is at the pressure of the chamber: valid if the
    line is small compared with the chamber. Gas that a valve passes from chamber to chamber does not pass the lines.
    """
    return supply_path(conductance_in_series(conductance, line_resistance.resistance))


def vented_through_line(conductance: float, line_resistance: LineResistance) -> float:
    """Conductance [kg/(s Pa)] from a chamber to the atmosphere, by the formula of ``fed_through_line``."""
    return exhaust_path(conductance_in_series(conductance, line_resistance.resistance))


EFFECT = Effect(
    name="line_resistance",
    summary="Lines with resistance between valve and chambers.",
    settings=LineSettings,
    parameters=LineResistance,
    prepare=prepare,
    switch=("area",),
    laws={supply_path: fed_through_line, exhaust_path: vented_through_line},
    source="equation (6) of the paper, ISO 6358-3:2014, and the orifice of the simulated test bench's lines",
    equation="1/C^2 = 1/C_v^2 + 1/C_r^2",
)
