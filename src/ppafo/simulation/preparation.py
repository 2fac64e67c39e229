"""From settings in SI units to the numbers that a run begins with.

Pure functions of one run, or of columns of runs: Python plans with them, and an exported library has them in C.
"""

from typing import Any, NamedTuple

from ppafo.engine.refinement import is_slow
from ppafo.model.chambers import chamber_mass
from ppafo.model.columns import Number, choose, larger, rounded_up, smaller, truncated
from ppafo.model.plant import PlantParameters, PlantState, ThermalParameters, chamber_volumes
from ppafo.model.regulator import LineState, SupplyLines
from ppafo.model.thermal import wall_exchange
from ppafo.parameters.device import Gas
from ppafo.simulation.scenario import Thermal

WHOLE = 1.0e-9
"""Relative difference up to which a number of steps is a whole one."""


class StepCounts(NamedTuple):
    """Length of a step [s], how many there are, how many to a sample of the controller and of the recording [-]."""

    step: float
    step_count: float
    steps_per_sample: float
    record_every: float


def step_counts(duration: float, time_step: float, output_interval: float, period: float) -> StepCounts:
    """The largest steps that divide a sample of the controller, and are no longer than ``time_step``; all in [s]."""
    steps_per_sample = larger(1.0, rounded_up(period / time_step - WHOLE))
    step = period / steps_per_sample
    return StepCounts(
        step=step,
        step_count=rounded_up(duration / step - WHOLE),
        steps_per_sample=steps_per_sample,
        record_every=nearly_whole(output_interval / step),
    )


def nearly_whole(steps: Number) -> Number:
    """A number of steps [-], to the whole number where it is one to rounding."""
    counted = truncated(steps + 0.5)
    found: Number = choose(abs(steps - counted) <= WHOLE * steps, counted, steps)
    return found


def is_slow_held(plant: PlantParameters, step: float, angle: float, stiffness: float) -> bool:
    """True where plain steps [s] follow the gas of a vane that is held at an angle [rad]; see ``is_slow``."""
    return is_slow(plant, step, larger(angle, plant.angle_min), smaller(angle, plant.angle_max), stiffness)


def thermal_gas(walls: Thermal, gas: Gas) -> ThermalParameters:
    """How a gas with an energy balance takes up heat."""
    exchange = wall_exchange(
        walls.heat_transfer_coefficient, walls.area_per_volume, gas.heat_capacity_ratio, gas.specific_gas_constant
    )
    return ThermalParameters(
        heat_capacity_ratio=gas.heat_capacity_ratio, wall_exchange=exchange, temperature=gas.temperature
    )


def state_at_start(
    plant: PlantParameters, angle: Any, angular_velocity: Any, pressure_1: float, pressure_2: float
) -> PlantState:
    """The vane at an angle [rad] with a rate [rad/s], and the gas of two absolute pressures [Pa]."""
    volume_1, volume_2 = chamber_volumes(plant, angle)
    return state_with_volumes(plant, angle, angular_velocity, volume_1, volume_2, pressure_1, pressure_2)


def state_with_volumes(
    plant: PlantParameters,
    angle: Any,
    angular_velocity: Any,
    volume_1: float,
    volume_2: float,
    pressure_1: float,
    pressure_2: float,
) -> PlantState:
    """As ``state_at_start``, of chambers whose volumes [m^3] at that angle and those pressures are known."""
    return PlantState(
        angle=angle,
        angular_velocity=angular_velocity,
        mass_1=chamber_mass(pressure_1, volume_1, plant.gas_product),
        mass_2=chamber_mass(pressure_2, volume_2, plant.gas_product),
        supplied_mass=0.0,
        vented_mass=0.0,
        leaked_mass=0.0,
    )


def lines_at_start(plant: PlantParameters, lines: SupplyLines) -> LineState:
    """Both lines at the pressures that their regulators are set to, and nothing let through yet."""
    return LineState(
        mass_1=chamber_mass(plant.supply_pressure, lines.volume_1, plant.gas_product),
        mass_2=chamber_mass(plant.dorsiflexion_pressure, lines.volume_2, plant.gas_product),
        regulated_mass=0.0,
    )
