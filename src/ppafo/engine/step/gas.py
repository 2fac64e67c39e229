"""Gas in the chambers in an integration step, isothermal or with an energy balance."""

from ppafo.engine.program import Program
from ppafo.engine.scheme import pneumatics, thermal_gas
from ppafo.engine.scheme.pneumatics import OF_OPENING, STILL, Flows
from ppafo.engine.step.lane import Lane
from ppafo.model.plant import PlantState


def begin(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage of the step for fixed volumes, or for volumes that change up to ``next_angle`` [rad]."""
    functions = parts.functions
    if parts.is_thermal:
        lane.gas_stage = thermal_gas.begin_thermal_gas(
            lane.plant, lane.thermal, lane.state, lane.masses, next_angle, lane.flowing, length, parts=functions
        )
    elif parts.keeps_volumes:
        lane.gas_stage = pneumatics.begin_still_gas(
            lane.plant, lane.state, lane.held, lane.flowing, length, parts=functions
        )
    else:
        lane.gas_stage = pneumatics.begin_moving_gas(
            lane.plant, lane.state, next_angle, lane.flowing, length, parts=functions
        )


def first(parts: Program, lane: Lane) -> Flows:
    """Return the rates of the first stage [kg/s], of true masses."""
    rates: Flows = lane.gas_stage.first.gas if parts.is_thermal else lane.gas_stage.first
    return rates


def changes(parts: Program, lane: Lane) -> Flows:
    """Return the changes in the step [kg], of true masses."""
    changed: Flows = lane.change.gas if parts.is_thermal else lane.change
    return changed


def change(parts: Program, lane: Lane, length: float) -> None:
    """Set the second stage, and the changes from both stages."""
    if parts.is_thermal:
        lane.second = thermal_gas.second_thermal_stage(lane.thermal, lane.gas_stage, lane.passing)
        lane.change = thermal_gas.thermal_change(lane.plant, lane.thermal, lane.gas_stage, lane.second, length)
    else:
        drift = STILL if parts.keeps_volumes else lane.gas_stage.drift
        lane.second = pneumatics.second_stage(lane.gas_stage, drift, lane.passing)
        lane.change = pneumatics.gas_change(lane.plant, lane.gas_stage.first, lane.second, length)


def error(parts: Program, lane: Lane, ahead: float, length: float) -> float:
    """Return the pressure error divided by the allowed error [-]; the volumes end at the angle ``ahead`` [rad]."""
    found = thermal_gas.thermal_error if parts.is_thermal else pneumatics.gas_error
    return found(lane.plant, lane.gas_stage, lane.second, ahead, length, parts=parts.functions)


def shift_error(parts: Program, lane: Lane, shift: float, ahead: float, length: float) -> float:
    """Return the error due to a moving valve in a part of a step, divided by the allowed error [-].

    ``shift`` [-] is the relative change of the opening. Opening and flow change together; the matrix of the step gives
    the change of the flow.
    """
    return pneumatics.pressure_error(
        lane.plant,
        OF_OPENING * shift,
        (lane.gas_stage.linear.a - 1.0) * lane.gas_stage.first.mass_1,
        (lane.gas_stage.linear.d - 1.0) * lane.gas_stage.first.mass_2,
        lane.gas_stage.end_1,
        lane.gas_stage.end_2,
        ahead,
        length,
        parts=parts.functions,
    )


def add(parts: Program, lane: Lane) -> None:
    """Set the state, and the true masses of thermal gas, after adding the gas of the step."""
    if parts.is_thermal:
        lane.fed, lane.warmed = thermal_gas.with_thermal_gas(lane.state, lane.masses, lane.change)
    else:
        lane.fed = pneumatics.with_gas(lane.state, lane.change)


def move(parts: Program, lane: Lane, state: PlantState, assumed: float, reached: float) -> PlantState:
    """Return the state for the angle reached [rad] instead of the assumed one [rad], with the work of thermal gas."""
    if not parts.is_thermal:
        return state
    return thermal_gas.after_motion(lane.plant, lane.thermal, state, assumed, reached, parts=parts.functions)


def work(parts: Program, lane: Lane) -> None:
    """Add the work of thermal gas on shaft and walls; a locked joint with rigid chambers does no work."""
    if parts.is_thermal and (not parts.is_locked or parts.actuator.gives):
        lane.warmed = thermal_gas.with_work(lane.plant, lane.warmed, lane.state, lane.after, parts=parts.functions)
