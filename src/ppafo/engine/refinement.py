"""Whether plain steps follow the gas of a held vane, so that no error needs to be looked at."""

from ppafo.model.columns import smaller
from ppafo.model.plant import PlantParameters, chamber_volumes

STEPS_PER_FILLING = 70.0


def filling_time(plant: PlantParameters, volume: float) -> float:
    """Shortest time constant [s] of a chamber of ``volume`` [m^3] behind the fully open valve and the leak."""
    return volume / ((plant.valve_conductance + plant.leak_conductance) * plant.gas_product)


def is_slow(plant: PlantParameters, step: float, lowest_angle: float, highest_angle: float, stiffness: float) -> bool:
    """True where a step [s] is at most 1/70 of the time in which a chamber fills, for angles between two [rad].

    This keeps the error of a plain step below 1e-3 of the pressure range (docs/decisions/0002). ``stiffness`` [-] is
    how much stiffer than at constant temperature the gas is: 1, or the heat capacity ratio, by which adiabatic chambers
    also fill faster. Any of the numbers may be an array (runs,), and the result is one then.
    """
    volume = smaller(chamber_volumes(plant, lowest_angle)[0], chamber_volumes(plant, highest_angle)[1])
    return step * STEPS_PER_FILLING * stiffness <= filling_time(plant, volume) * (1.0 + 1.0e-9)
