"""How many times a step must be divided so that the fastest chamber is followed: one number for a whole run.

A chamber fills or empties in about V / (conductance R T / M), and the gas is a spring for the vane. A step of 1/70 of
the first time and 1/10 of a radian of the second keeps the error of the scheme below 2e-4 of the angle range and 1e-3
of the pressure range (docs/decisions/0002).
"""

import numpy as np

from ppafo.model.columns import larger, root, smaller, whole
from ppafo.model.plant import PlantParameters, chamber_volumes

STEPS_PER_FILLING = 70.0
RADIANS_PER_STEP = 0.1
MOST_DIVISIONS = 1000
UNCOUNTABLE = 1.0e15


def filling_time(plant: PlantParameters, volume: float) -> float:
    """Shortest time constant [s] of a chamber of ``volume`` [m^3] behind the fully open valve and the leak."""
    return volume / ((plant.valve_conductance + plant.leak_conductance) * plant.gas_product)


def gas_spring_frequency(plant: PlantParameters, volume: float) -> float:
    """Angular frequency [rad/s] of the vane on the gas of one chamber at the highest pressure."""
    supplied = larger(plant.supply_pressure, plant.dorsiflexion_pressure)
    pressure = larger(supplied, plant.atmospheric_pressure)
    stiffness = plant.torque_constant * pressure * plant.volume_per_angle / volume
    return root(stiffness / plant.inertia)  # type: ignore[no-any-return]


def divisions(
    plant: PlantParameters, step: float, lowest_angle: float, highest_angle: float, is_free: bool, stiffness: float
) -> int:
    """Number of parts [-] into which a step [s] is divided for a vane that stays between two angles [rad].

    ``stiffness`` [-] is how much stiffer than at constant temperature the gas is: 1, or the heat capacity ratio, by
    which adiabatic chambers also fill faster. Any of the numbers may be an array (runs,), and the result is one then.
    """
    volume = smaller(chamber_volumes(plant, lowest_angle)[0], chamber_volumes(plant, highest_angle)[1])
    parts = step * STEPS_PER_FILLING * stiffness / filling_time(plant, volume)
    if is_free:
        spring = gas_spring_frequency(plant, volume) * root(stiffness)
        parts = larger(parts, step * spring / RADIANS_PER_STEP)
    return whole(np.clip(np.ceil(parts - 1e-9), 1.0, UNCOUNTABLE))  # type: ignore[no-any-return]
