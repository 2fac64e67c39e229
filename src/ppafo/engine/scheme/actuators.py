"""Actuators of any type: chamber and torque functions for compiled steps, and their evaluation from Python."""

from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

from ppafo.engine.rows import of_each
from ppafo.engine.scheme.pneumatics import HeldChambers, held_pressures
from ppafo.model.actuators.kind import ActuatorModel, Chambers
from ppafo.model.actuators.vane import MODEL as VANE
from ppafo.model.actuators.vane import chambers
from ppafo.model.binding import made_of
from ppafo.model.columns import choose
from ppafo.model.plant import (
    ActuatorFunctions,
    PlantParameters,
    PlantState,
    chamber_mass,
    chamber_pressures,
    chamber_volumes,
    joint_torque,
)

SAME = 1.0e-9
"""Relative difference of two pressures [-] that is rounding."""


def rest_volumes(plant: PlantParameters, angle: float, *, parts: ActuatorFunctions) -> tuple[float, float]:
    """Volumes of both chambers [m^3] at the supply pressures, used as the reference for errors of the gas."""
    # At the supplies' pressures, not the present ones: what an error is measured against must not move with it.
    still = parts.chambers(plant, angle, plant.supply_pressure, plant.dorsiflexion_pressure)
    return still.volume_1, still.volume_2


def pressures_held(
    plant: PlantParameters, held: HeldChambers, state: PlantState, *, parts: ActuatorFunctions
) -> tuple[float, float]:
    """Absolute chamber pressures [Pa] at the angle stored in ``held``, for chambers that may expand under pressure."""
    return parts.pressures(plant, held.angle, state.mass_1, state.mass_2)


def state_at_pressures(
    plant: PlantParameters,
    angle: float,
    angular_velocity: float,
    pressure_1: float,
    pressure_2: float,
    *,
    parts: ActuatorFunctions,
) -> PlantState:
    """Plant state at an angle [rad], an angular velocity [rad/s] and two absolute pressures [Pa], with totals of 0.

    The masses are the inverse of the pressures of the actuator: those of equation (3), in proportion to the pressures
    where the two differ by more than rounding.
    """
    filled = parts.chambers(plant, angle, pressure_1, pressure_2)
    mass_1 = chamber_mass(pressure_1, filled.volume_1, plant.gas_product)
    mass_2 = chamber_mass(pressure_2, filled.volume_2, plant.gas_product)
    reached_1, reached_2 = parts.pressures(plant, angle, mass_1, mass_2)
    # An evacuated chamber, as of a dead sensor in a recording, has no proportion.
    return PlantState(
        angle=angle,
        angular_velocity=angular_velocity,
        mass_1=choose(
            abs(reached_1 - pressure_1) > SAME * pressure_1,
            mass_1 * pressure_1 / choose(reached_1 > 0.0, reached_1, 1.0),
            mass_1,
        ),
        mass_2=choose(
            abs(reached_2 - pressure_2) > SAME * pressure_2,
            mass_2 * pressure_2 / choose(reached_2 > 0.0, reached_2, 1.0),
            mass_2,
        ),
        supplied_mass=0.0,
        vented_mass=0.0,
        leaked_mass=0.0,
    )


VANE_FUNCTIONS = ActuatorFunctions(
    chambers=chambers,
    pressures=chamber_pressures,
    torque=joint_torque,
    rest_volumes=chamber_volumes,
    held_pressures=held_pressures,
)


@lru_cache(maxsize=256)
def functions_of_actuator(actuator: ActuatorModel) -> ActuatorFunctions:
    """Return the functions of an actuator; volumes of a vane do not depend on pressure, which saves divisions."""
    if actuator == VANE:
        return VANE_FUNCTIONS
    own = VANE_FUNCTIONS._replace(chambers=actuator.chambers, pressures=actuator.pressures, torque=actuator.torque)
    return own._replace(
        rest_volumes=made_of(rest_volumes, "rest_volumes", own),
        held_pressures=made_of(pressures_held, "pressures_held", own),
    )


def _of_plant(actuator: ActuatorModel, function: Callable[..., Any], plant: Any, *given: Any) -> Any:
    """Return the result of a model function, whose arguments may be numbers or arrays of one length."""
    # A kind's function takes floats: where numbers are columns it is called for each combination.
    return function(plant, *given) if actuator is VANE else of_each(function, plant, *given)


def pressures_of(actuator: ActuatorModel, plant: Any, angle: Any, mass_1: Any, mass_2: Any) -> tuple[Any, Any]:
    """Absolute pressures [Pa] of both chambers at an angle [rad] with two masses [kg]. Equation (3)."""
    pressure_1, pressure_2 = _of_plant(actuator, actuator.pressures, plant, angle, mass_1, mass_2)
    return pressure_1, pressure_2


def filled_chambers(actuator: ActuatorModel, plant: Any, angle: Any, pressure_1: Any, pressure_2: Any) -> Chambers:
    """Volumes and compliances of both chambers at an angle [rad] and two absolute pressures [Pa]."""
    filled: Chambers = _of_plant(actuator, actuator.chambers, plant, angle, pressure_1, pressure_2)
    return filled


def filled_state(
    actuator: ActuatorModel, plant: Any, angle: Any, angular_velocity: Any, pressure_1: Any, pressure_2: Any
) -> PlantState:
    """Plant state at an angle [rad], an angular velocity [rad/s] and two absolute pressures [Pa], with totals of 0."""
    state = partial(state_at_pressures, parts=functions_of_actuator(actuator))
    filled: PlantState = _of_plant(actuator, state, plant, angle, angular_velocity, pressure_1, pressure_2)
    return filled


def torque_of(actuator: ActuatorModel, plant: Any, angle: Any, pressure_1: Any, pressure_2: Any) -> Any:
    """Torque [N m] at an angle [rad] and two absolute pressures [Pa], positive in plantarflexion."""
    return _of_plant(actuator, actuator.torque, plant, angle, pressure_1, pressure_2)
