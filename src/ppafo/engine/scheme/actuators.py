"""An actuator of any kind: what a program calls in place of the vane's functions, and its values from Python.

A program is linked: where its text calls the vane's ``chambers``, ``chamber_pressures``, ``joint_torque`` and what is
made of them, it calls its actuator's.
"""

from functools import partial
from typing import Any, TypeVar

import numpy as np

from ppafo.engine.rows import leaves, rebuilt
from ppafo.engine.scheme.pneumatics import (
    SHORTEST,
    HeldChambers,
    MovingGas,
    SlopedFlows,
    StillGas,
    added_flows,
    held_pressures,
    linearise,
    response,
    solve_stage,
)
from ppafo.model.actuators.kind import ActuatorModel, Chambers
from ppafo.model.actuators.vane import MODEL as VANE
from ppafo.model.actuators.vane import chambers
from ppafo.model.columns import over_runs
from ppafo.model.declaration import PlainFunction
from ppafo.model.plant import (
    PlantParameters,
    PlantState,
    chamber_pressures,
    chamber_volumes,
    joint_torque,
    pressures_per_mass,
)
from ppafo.model.sensors import GaitMeasurement, Measurement


def rest_volumes(plant: PlantParameters, angle: float) -> tuple[float, float]:
    """Volumes of both chambers [m^3] at the pressures of their supplies: what errors of gas are seen against."""
    # At the supplies' pressures, not the present ones: what an error is measured against must not move with it.
    still = chambers(plant, angle, plant.supply_pressure, plant.dorsiflexion_pressure)
    return still.volume_1, still.volume_2


def rest_pressures_per_mass(plant: PlantParameters, angle: float) -> tuple[float, float]:
    """Pressures over masses [Pa/kg] of both chambers at the pressures of their supplies."""
    volume_1, volume_2 = rest_volumes(plant, angle)
    return plant.gas_product / volume_1, plant.gas_product / volume_2


def pressures_held(plant: PlantParameters, held: HeldChambers, state: PlantState) -> tuple[float, float]:
    """Absolute pressures [Pa] of the gas of a state at the angle that is held, of chambers that may give."""
    return chamber_pressures(plant, held.angle, state.mass_1, state.mass_2)


def begin_shaped_gas(
    plant: PlantParameters,
    state: PlantState,
    _held: HeldChambers,
    next_angle: float,
    flowing: SlopedFlows,
    step: float,
) -> MovingGas:
    """First stage of one step [s] in which the angle runs to ``next_angle`` [rad]; as ``begin_moving_gas``.

    Mass answers to pressure as V + p dV/dp: a chamber that gives takes up more gas.
    """
    pressure_1, pressure_2 = chamber_pressures(plant, state.angle, state.mass_1, state.mass_2)
    # Volumes at both angles at one pressure: the drift is what the angle alone does.
    here = chambers(plant, state.angle, pressure_1, pressure_2)
    ahead = chambers(plant, next_angle, pressure_1, pressure_2)
    per_mass_1 = plant.gas_product / (here.volume_1 + pressure_1 * here.compliance_1)
    per_mass_2 = plant.gas_product / (here.volume_2 + pressure_2 * here.compliance_2)
    linear, flows = linearise(per_mass_1, per_mass_2, flowing, step)
    per_duration = 1.0 / (plant.gas_product * max(step, SHORTEST))
    drift = response(
        linear,
        pressure_1 * (here.volume_1 - ahead.volume_1) * per_duration,
        pressure_2 * (here.volume_2 - ahead.volume_2) * per_duration,
    )
    first = solve_stage(linear, added_flows(flows, drift))
    end_1, end_2 = chamber_pressures(
        plant, next_angle, state.mass_1 + step * first.mass_1, state.mass_2 + step * first.mass_2
    )
    return MovingGas(StillGas(linear=linear, first=first, end_1=end_1, end_2=end_2), drift)


def links_of(actuator: ActuatorModel) -> dict[Any, Any]:
    """Replacements of the vane's functions in a program with this actuator; empty for the vane."""
    if actuator is VANE:
        return {}
    return {
        chambers: actuator.chambers,
        joint_torque: actuator.torque,
        chamber_pressures: actuator.pressures,
        chamber_volumes: rest_volumes,
        pressures_per_mass: rest_pressures_per_mass,
        held_pressures: pressures_held,
        (PlantParameters, "_replace"): actuator.plant,
    }


def _of_plant(actuator: ActuatorModel, function: PlainFunction, plant: Any, *given: Any) -> Any:
    """Result of a function of a model for numbers any of which may be arrays of one length."""
    if actuator is VANE:
        return function(plant, *given)
    # A kind's function takes floats: where numbers are columns it is called for each combination.
    flat = leaves(plant)
    if not any(isinstance(number, np.ndarray) for number in flat):
        return over_runs(partial(function, plant), *given)

    def alone(*values: float) -> Any:
        return function(rebuilt(actuator.plant, values[: len(flat)]), *values[len(flat) :])

    return over_runs(alone, *flat, *given)


def pressures_of(actuator: ActuatorModel, plant: Any, angle: Any, mass_1: Any, mass_2: Any) -> tuple[Any, Any]:
    """Absolute pressures [Pa] of both chambers at an angle [rad] with two masses [kg]. Equation (3)."""
    pressure_1, pressure_2 = _of_plant(actuator, actuator.pressures, plant, angle, mass_1, mass_2)
    return pressure_1, pressure_2


def filled_chambers(actuator: ActuatorModel, plant: Any, angle: Any, pressure_1: Any, pressure_2: Any) -> Chambers:
    """Both chambers at an angle [rad] and two absolute pressures [Pa]."""
    filled: Chambers = _of_plant(actuator, actuator.chambers, plant, angle, pressure_1, pressure_2)
    return filled


def volumes_of(actuator: ActuatorModel, plant: Any, angle: Any, pressure_1: Any, pressure_2: Any) -> tuple[Any, Any]:
    """Volumes of both chambers [m^3] at an angle [rad] and two absolute pressures [Pa]."""
    filled = filled_chambers(actuator, plant, angle, pressure_1, pressure_2)
    return filled.volume_1, filled.volume_2


def torque_of(actuator: ActuatorModel, plant: Any, angle: Any, pressure_1: Any, pressure_2: Any) -> Any:
    """Torque [N m] at an angle [rad] and two absolute pressures [Pa], positive in plantarflexion."""
    return _of_plant(actuator, actuator.torque, plant, angle, pressure_1, pressure_2)


Seen = TypeVar("Seen", Measurement, GaitMeasurement)


def measurement_of(actuator: ActuatorModel, plant: Any, seen: Seen) -> Seen:
    """Sensor readings with the torque of the actuator at the measured angle and pressures."""
    return seen._replace(torque=actuator.torque(plant, seen.angle, seen.pressure_1, seen.pressure_2))
