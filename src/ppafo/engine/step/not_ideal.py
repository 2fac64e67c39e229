"""Real gas in an integration step: stages and error estimates as for ideal gas, applied to true masses."""

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
    """Groups for real gas: true masses, first stage, and changes in a step."""
    return {
        "masses": kept(TrueMasses),
        "real_gas": handed(RealGas),
        **({"real_change": handed(RealChange)} if parts.angle is None else {}),
    }


def begin(parts: Program, lane: Lane, next_angle: float, length: float) -> None:
    """Set the first stage of the step: flows and pressures at the start, and pressures after the stage."""
    lane.real_gas = real_gas.begin_real_gas(
        lane.plant, lane.state, lane.masses, next_angle, lane.flowing, length, parts=parts.functions
    )


def change(parts: Program, lane: Lane, length: float) -> None:
    """Set the second stage, and the changes of gas content and true mass from both stages."""
    lane.second = pneumatics.second_moving_stage(lane.real_gas.moving, lane.passing)
    lane.real_change = real_gas.real_change(lane.plant, lane.state, lane.masses, lane.real_gas, lane.second, length)


def add(parts: Program, lane: Lane) -> None:
    """Set the state and the true masses after adding the gas of the step."""
    lane.fed, lane.warmed = real_gas.with_real_gas(lane.state, lane.masses, lane.real_change)


def move(parts: Program, lane: Lane, state: PlantState, assumed: float, reached: float) -> PlantState:
    """Return the state with the gas contents at the angle [rad] reached by the vane."""
    return real_gas.at_angle(lane.plant, state, lane.warmed, reached, parts=parts.functions)


def work(parts: Program, lane: Lane) -> None:
    """Do nothing: the work of isothermal gas is not recorded."""
