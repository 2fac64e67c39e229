"""Gas with an energy balance in an integration step."""

from ppafo.engine.groups import Groups, given, handed, kept
from ppafo.engine.program import Program
from ppafo.engine.scheme import thermal_gas
from ppafo.engine.scheme.thermal_gas import ThermalFlows, ThermalGas
from ppafo.engine.step.lane import Lane
from ppafo.model.plant import PlantState, ThermalParameters, ThermalState

IS_THERMAL = True
START = thermal_gas.masses_at_start


def groups(parts: Program) -> Groups:
    """Groups for gas with an energy balance: heat capacity and walls, true masses, first stage, changes in a step."""
    return {
        "thermal": given(ThermalParameters),
        "masses": kept(ThermalState),
        "thermal_gas": handed(ThermalGas),
        **({"thermal_change": handed(ThermalFlows)} if parts.angle is None else {}),
    }


def begin(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage of the step: flows and pressures at the start, and pressures after the stage."""
    lane.thermal_gas = thermal_gas.begin_thermal_gas(
        lane.plant,
        lane.thermal,
        lane.state,
        lane.masses,
        next_angle,
        lane.flowing,
        length,
        parts=parts.functions,
    )


def ends(parts: Program, lane: Lane) -> tuple[float, float]:
    """Return the pressures [Pa] of both chambers after the first stage."""
    return thermal_gas.end_pressures(lane.plant, lane.thermal_gas)


def first(parts: Program, lane: Lane) -> ThermalFlows:
    """Return the rates of the first stage [kg/s]."""
    return lane.thermal_gas.first


def changes(parts: Program, lane: Lane) -> ThermalFlows:
    """Return the changes in the step [kg]."""
    return lane.thermal_change


def change(parts: Program, lane: Lane, length: float) -> None:
    """Set the second stage, and the changes of mass and energy from both stages."""
    lane.thermal_second = thermal_gas.second_thermal_stage(lane.thermal, lane.thermal_gas, lane.passing)
    lane.thermal_change = thermal_gas.thermal_change(
        lane.plant, lane.thermal, lane.thermal_gas, lane.thermal_second, length
    )


def error(parts: Program, lane: Lane, ahead: float, length: float) -> float:
    """Return the error of the chamber pressures in a part of a step, divided by the allowed error [-]."""
    return thermal_gas.thermal_error(lane.plant, lane.thermal_gas, lane.thermal_second, length)


def shift_error(parts: Program, lane: Lane, shift: float, ahead: float, length: float) -> float:
    """Return the error due to a moving valve in a part of a step, divided by the allowed error [-]."""
    return thermal_gas.thermal_opening_error(lane.plant, lane.thermal_gas, shift, length)


def add(parts: Program, lane: Lane) -> None:
    """Set the state and the true masses after adding the gas of the step."""
    lane.fed, lane.warmed = thermal_gas.with_thermal_gas(lane.state, lane.masses, lane.thermal_change)


def move(parts: Program, lane: Lane, state: PlantState, assumed: float, reached: float) -> PlantState:
    """Return the state with the work of the gas up to the angle reached [rad] instead of the assumed angle [rad]."""
    return thermal_gas.after_motion(lane.plant, lane.thermal, state, assumed, reached, parts=parts.functions)


def work(parts: Program, lane: Lane) -> None:
    """Add the work of the gas on shaft and walls; a locked joint with rigid chambers does no work."""
    if not parts.is_locked or parts.actuator.gives:
        lane.warmed = thermal_gas.with_work(lane.plant, lane.warmed, lane.state, lane.after, parts=parts.functions)
