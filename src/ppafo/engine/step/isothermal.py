"""Gas that keeps its temperature in a step: of a vane at rest or in motion, and of other actuators."""

from ppafo.engine.groups import Groups, handed
from ppafo.engine.program import Program
from ppafo.engine.scheme import pneumatics
from ppafo.engine.scheme.actuators import begin_shaped_gas
from ppafo.engine.scheme.motion import with_gas
from ppafo.engine.scheme.pneumatics import GasChange, MovingGas, StillGas
from ppafo.engine.step.lane import Lane
from ppafo.model.plant import PlantState

IS_THERMAL = False
HAS_TRUE_MASSES = False
START = None


def groups(parts: Program) -> Groups:
    """Groups of a lane: the first stage, and what a step adds to the gas."""
    stage = {"still_gas": handed(StillGas)} if parts.keeps_volumes else {"moving_gas": handed(MovingGas)}
    return {
        **(stage if parts.feed is None else {}),
        **({"change": handed(GasChange)} if parts.angle is None else {}),
    }


def begin(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage of the step, of chambers that stand still or move, which run to ``next_angle`` [rad]."""
    if parts.keeps_volumes:
        lane.still_gas = pneumatics.begin_still_gas(lane.state, lane.held, lane.flowing, length)
    elif parts.has_vane:
        functions = parts.functions
        is_held = parts.hands_chambers_on
        held = lane.held if is_held else pneumatics.held_chambers(lane.plant, lane.state.angle, parts=functions)
        lane.moving_gas = pneumatics.begin_moving_gas(
            lane.plant, lane.state, held, next_angle, lane.flowing, length, parts=functions
        )
    else:
        lane.moving_gas = begin_shaped_gas(
            lane.plant, lane.state, next_angle, lane.flowing, length, parts=parts.functions
        )


def moving(parts: Program, lane: Lane) -> MovingGas:
    """The first stage of chambers that move; lines, and a gas that is not ideal, have more around it."""
    if parts.has_true_masses:
        return lane.real_gas.moving
    return lane.moving_gas if parts.feed is None else lane.fed_gas.chambers


def still(parts: Program, lane: Lane) -> StillGas:
    """The part of the first stage that still and moving gas share."""
    return lane.still_gas if parts.keeps_volumes else moving(parts, lane).still


def ends(parts: Program, lane: Lane) -> tuple[float, float]:
    """Pressures [Pa] to which the first stage leads."""
    begun = still(parts, lane)
    return begun.end_1, begun.end_2


def first_flows(parts: Program, lane: Lane) -> tuple[float, float, float]:
    """Flows of the first stage [kg/s]: from the supplies, and into both chambers."""
    begun = still(parts, lane)
    return begun.first.supplied, begun.first.mass_1, begun.first.mass_2


def change(parts: Program, lane: Lane, length: float) -> None:
    """Set the second stage, and the change of mass by both."""
    if parts.keeps_volumes:
        lane.second = pneumatics.second_still_stage(lane.still_gas, lane.passing)
        lane.change = pneumatics.still_change(lane.plant, lane.still_gas, lane.second, length)
    else:
        lane.second = pneumatics.second_moving_stage(moving(parts, lane), lane.passing)
        lane.change = pneumatics.moving_change(lane.plant, still(parts, lane), lane.second, length)


def error(parts: Program, lane: Lane, ahead: float, length: float) -> float:
    """Error of the pressures over what is allowed [-]; ``ahead`` is the angle [rad] to which the volumes run."""
    return pneumatics.gas_error(lane.plant, still(parts, lane), lane.second, ahead, length, parts=parts.functions)


def shift_error(parts: Program, lane: Lane, shift: float, ahead: float, length: float) -> float:
    """Error that a moving valve makes in a part of a step, over what is allowed [-]."""
    return pneumatics.opening_error(lane.plant, still(parts, lane), shift, ahead, length, parts=parts.functions)


def add(parts: Program, lane: Lane) -> None:
    """Set the state after the step to the state before it with the gas of the step."""
    lane.fed = with_gas(lane.state, lane.change)


def move(parts: Program, lane: Lane, state: PlantState, assumed: float, reached: float) -> PlantState:
    """Return the state as it is: motion changes no energy of a gas that keeps its temperature."""
    return state


def work(parts: Program, lane: Lane) -> None:
    """Count nothing: the work of a gas that keeps its temperature is not followed."""
