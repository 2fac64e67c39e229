"""Gas that is not ideal in a step: its stages, and their errors, are those of an ideal one, on true masses."""

from ppafo.engine.groups import Groups, handed, kept
from ppafo.engine.program import Program
from ppafo.engine.scheme import pneumatics, real_gas
from ppafo.engine.scheme.real_gas import RealChange, RealGas
from ppafo.engine.step import isothermal
from ppafo.engine.step.lane import Lane
from ppafo.model.plant import PlantState, TrueMasses

IS_THERMAL = False
HAS_TRUE_MASSES = True
START = real_gas.masses_at_start

ends, first_flows = isothermal.ends, isothermal.first_flows
error, shift_error = isothermal.error, isothermal.shift_error
"""Error estimates of the first stage, as for an ideal gas."""


def groups(parts: Program) -> Groups:
    """Groups of a lane: true masses, the first stage, and what a step adds to the gas."""
    return {
        "masses": kept(TrueMasses),
        "real_gas": handed(RealGas),
        **({"real_change": handed(RealChange)} if parts.angle is None else {}),
    }


def begin(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage of the step: flows and pressures at its begin, and the pressures to which they lead."""
    lane.real_gas = real_gas.begin_real_gas(
        lane.plant, lane.state, lane.masses, next_angle, lane.flowing, length, parts=parts.functions
    )


def change(parts: Program, lane: Lane, length: float) -> None:
    """Set the second stage, and the change of gas content and true mass by both."""
    lane.second = pneumatics.second_moving_stage(lane.real_gas.moving, lane.passing)
    lane.real_change = real_gas.real_change(lane.plant, lane.state, lane.masses, lane.real_gas, lane.second, length)


def add(parts: Program, lane: Lane) -> None:
    """Set state and true masses with the gas of the step."""
    lane.fed, lane.warmed = real_gas.with_real_gas(lane.state, lane.masses, lane.real_change)


def move(parts: Program, lane: Lane, state: PlantState, assumed: float, reached: float) -> PlantState:
    """The gas contents at the angle [rad] that the vane reached."""
    return real_gas.at_angle(lane.plant, state, lane.warmed, reached, parts=parts.functions)


def work(parts: Program, lane: Lane) -> None:
    """Count nothing: the work of a gas that keeps its temperature is not followed."""
