"""Isothermal gas in an integration step, for a vane at rest or in motion and for other actuators."""

from ppafo.engine.groups import Groups, handed
from ppafo.engine.program import Program
from ppafo.engine.scheme import pneumatics
from ppafo.engine.scheme.actuators import begin_shaped_gas
from ppafo.engine.scheme.motion import with_gas
from ppafo.engine.scheme.pneumatics import GasChange, MovingGas, StillGas
from ppafo.engine.step.lane import Lane
from ppafo.model.plant import PlantState

IS_THERMAL = False
START = None


def groups(parts: Program) -> Groups:
    """Groups for isothermal gas: first stage, and changes in a step."""
    stage = {"still_gas": handed(StillGas)} if parts.keeps_volumes else {"moving_gas": handed(MovingGas)}
    return {
        **(stage if parts.feed is None else {}),
        **({"change": handed(GasChange)} if parts.angle is None else {}),
    }


def begin(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage of the step for fixed volumes, or for volumes that change up to ``next_angle`` [rad]."""
    functions = parts.functions
    if parts.keeps_volumes:
        lane.still_gas = pneumatics.begin_still_gas(
            lane.plant, lane.state, lane.held, lane.flowing, length, parts=functions
        )
    elif parts.has_vane:
        is_held = parts.hands_chambers_on
        held = lane.held if is_held else pneumatics.held_chambers(lane.plant, lane.state.angle, parts=functions)
        linear = pneumatics.linearise(held.per_mass_1, held.per_mass_2, lane.flowing, length)
        lane.moving_gas = pneumatics.begin_moving_gas(
            lane.plant, lane.state, held, next_angle, linear, lane.flowing.flows, length, parts=functions
        )
    else:
        lane.moving_gas = begin_shaped_gas(lane.plant, lane.state, next_angle, lane.flowing, length, parts=functions)


def moving(parts: Program, lane: Lane) -> MovingGas:
    """Return the first stage with moving volumes, without the additional data for supply lines."""
    return lane.moving_gas if parts.feed is None else lane.fed_gas.chambers


def still(parts: Program, lane: Lane) -> StillGas:
    """Return the part of the first stage that fixed and moving volumes have in common."""
    return lane.still_gas if parts.keeps_volumes else moving(parts, lane).still


def ends(parts: Program, lane: Lane) -> tuple[float, float]:
    """Return the pressures [Pa] of both chambers after the first stage."""
    begun = still(parts, lane)
    return begun.end_1, begun.end_2


def first_flows(parts: Program, lane: Lane) -> tuple[float, float, float]:
    """Return the flows of the first stage [kg/s]: from the supplies, and into both chambers."""
    begun = still(parts, lane)
    return begun.first.supplied, begun.first.mass_1, begun.first.mass_2


def change(parts: Program, lane: Lane, length: float) -> None:
    """Set the second stage, and the mass changes from both stages."""
    if parts.keeps_volumes:
        lane.second = pneumatics.second_still_stage(lane.still_gas, lane.passing)
        lane.change = pneumatics.still_change(lane.plant, lane.still_gas, lane.second, length)
    else:
        lane.second = pneumatics.second_moving_stage(moving(parts, lane), lane.passing)
        lane.change = pneumatics.moving_change(lane.plant, still(parts, lane), lane.second, length)


def error(parts: Program, lane: Lane, ahead: float, length: float) -> float:
    """Return the pressure error divided by the allowed error [-]; the volumes end at the angle ``ahead`` [rad]."""
    return pneumatics.gas_error(lane.plant, still(parts, lane), lane.second, ahead, length, parts=parts.functions)


def shift_error(parts: Program, lane: Lane, shift: float, ahead: float, length: float) -> float:
    """Return the error due to a moving valve in a part of a step, divided by the allowed error [-]."""
    return pneumatics.opening_error(lane.plant, still(parts, lane), shift, ahead, length, parts=parts.functions)


def add(parts: Program, lane: Lane) -> None:
    """Set the state after the step by adding the gas of the step to the state before the step."""
    lane.fed = with_gas(lane.state, lane.change)


def move(parts: Program, lane: Lane, state: PlantState, assumed: float, reached: float) -> PlantState:
    """Return the state unchanged, because motion does not change the energy of isothermal gas."""
    return state


def work(parts: Program, lane: Lane) -> None:
    """Do nothing: the work of isothermal gas is not recorded."""
