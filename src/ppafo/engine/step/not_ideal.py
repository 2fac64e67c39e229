"""Gas that is not ideal in a step: its stages are those of an ideal one, on true masses."""

from collections.abc import Mapping

from ppafo.engine.program import Program
from ppafo.engine.scheme import pneumatics, real_gas
from ppafo.engine.scheme.pneumatics import StillGas
from ppafo.engine.scheme.real_gas import RealChange, RealGas
from ppafo.engine.step.lane import Lane
from ppafo.model.plant import PlantState, TrueMasses

PARAMETERS: Mapping[str, type] = {}
STATES: Mapping[str, type] = {"masses": TrueMasses}
CHANGE: Mapping[str, type] = {"real_change": RealChange}
START = real_gas.masses_at_start


def stage(parts: Program) -> Mapping[str, type]:
    """What the first stage leaves for later phases."""
    return {"real_gas": RealGas}


def begin(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """The first stage."""
    lane.real_gas = real_gas.begin_real_gas(lane.plant, lane.state, lane.masses, next_angle, lane.flowing, length)


def still(parts: Program, lane: Lane) -> StillGas:
    """The part of the first stage that is as in an ideal gas that stands still."""
    return lane.real_gas.moving.still


def ends(parts: Program, lane: Lane) -> tuple[float, float]:
    """Pressures [Pa] to which the first stage leads."""
    begun = still(parts, lane)
    return begun.end_1, begun.end_2


def first_flows(parts: Program, lane: Lane) -> tuple[float, float, float]:
    """Flows of the first stage [kg/s]: from the supplies, and into both chambers."""
    begun = still(parts, lane)
    return begun.first.supplied, begun.first.mass_1, begun.first.mass_2


def change(parts: Program, lane: Lane, length: float) -> None:
    """The second stage, and what both change."""
    lane.second = pneumatics.second_moving_stage(lane.real_gas.moving, lane.passing)
    lane.real_change = real_gas.real_change(lane.plant, lane.state, lane.masses, lane.real_gas, lane.second, length)


def error(parts: Program, lane: Lane, ahead: float, length: float) -> float:
    """Error of the pressures over what is allowed [-]; ``ahead`` is the angle [rad] to which the volumes run."""
    return pneumatics.gas_error(lane.plant, still(parts, lane), lane.second, ahead, length)


def shift_error(parts: Program, lane: Lane, shift: float, ahead: float, length: float) -> float:
    """Error of a valve that moves, over what is allowed [-]."""
    return pneumatics.opening_error(lane.plant, still(parts, lane), shift, ahead, length)


def add(parts: Program, lane: Lane) -> None:
    """Set state and true masses with the gas of the step."""
    lane.fed, lane.warmed = real_gas.with_real_gas(lane.state, lane.masses, lane.real_change)


def move(parts: Program, lane: Lane, state: PlantState, assumed: float, reached: float) -> PlantState:
    """The gas contents at the angle [rad] that the vane reached."""
    return real_gas.at_angle(lane.plant, state, lane.warmed, reached)


def work(parts: Program, lane: Lane) -> None:
    """Gas of one temperature counts no work."""
