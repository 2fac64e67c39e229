"""Isothermal gas in an integration step, for a vane at rest or in motion and for other actuators."""

from ppafo.engine.groups import Groups, handed
from ppafo.engine.program import Program
from ppafo.engine.scheme import pneumatics
from ppafo.engine.scheme.motion import with_gas
from ppafo.engine.scheme.pneumatics import STILL, Flows, GasStage
from ppafo.engine.step.lane import Lane
from ppafo.model.plant import PlantState

IS_THERMAL = False
START = None


def groups(parts: Program) -> Groups:
    """Groups for isothermal gas: first stage, and changes in a step."""
    return {"gas_stage": handed(GasStage), **({"change": handed(Flows)} if parts.angle is None else {})}


def begin(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage of the step for fixed volumes, or for volumes that change up to ``next_angle`` [rad]."""
    if parts.keeps_volumes:
        lane.gas_stage = pneumatics.begin_still_gas(
            lane.plant, lane.state, lane.held, lane.flowing, length, parts=parts.functions
        )
    else:
        lane.gas_stage = pneumatics.begin_moving_gas(
            lane.plant, lane.state, next_angle, lane.flowing, length, parts=parts.functions
        )


def ends(parts: Program, lane: Lane) -> tuple[float, float]:
    """Return the pressures [Pa] of both chambers after the first stage."""
    return lane.gas_stage.end_1, lane.gas_stage.end_2


def first(parts: Program, lane: Lane) -> Flows:
    """Return the rates of the first stage [kg/s]."""
    return lane.gas_stage.first


def changes(parts: Program, lane: Lane) -> Flows:
    """Return the changes in the step [kg]."""
    return lane.change


def change(parts: Program, lane: Lane, length: float) -> None:
    """Set the second stage, and the mass changes from both stages."""
    drift = STILL if parts.keeps_volumes else lane.gas_stage.drift
    lane.second = pneumatics.second_stage(lane.gas_stage, drift, lane.passing)
    lane.change = pneumatics.gas_change(lane.plant, lane.gas_stage, lane.second, length)


def error(parts: Program, lane: Lane, ahead: float, length: float) -> float:
    """Return the pressure error divided by the allowed error [-]; the volumes end at the angle ``ahead`` [rad]."""
    return pneumatics.gas_error(lane.plant, lane.gas_stage, lane.second, ahead, length, parts=parts.functions)


def shift_error(parts: Program, lane: Lane, shift: float, ahead: float, length: float) -> float:
    """Return the error due to a moving valve in a part of a step, divided by the allowed error [-]."""
    return pneumatics.opening_error(lane.plant, lane.gas_stage, shift, ahead, length, parts=parts.functions)


def add(parts: Program, lane: Lane) -> None:
    """Set the state after the step by adding the gas of the step to the state before the step."""
    lane.fed = with_gas(lane.state, lane.change)


def move(parts: Program, lane: Lane, state: PlantState, assumed: float, reached: float) -> PlantState:
    """Return the state unchanged, because motion does not change the energy of isothermal gas."""
    return state


def work(parts: Program, lane: Lane) -> None:
    """Do nothing: the work of isothermal gas is not recorded."""
