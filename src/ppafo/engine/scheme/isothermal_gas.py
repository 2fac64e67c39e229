"""Gas that keeps its temperature, as lines of a step: for a vane at rest or in motion, and for other actuators."""

from typing import Any

from ppafo.engine.components import GasScheme, Second
from ppafo.engine.scheme import actuators, pneumatics
from ppafo.engine.scheme.motion import with_gas
from ppafo.engine.scheme.pneumatics import GasChange, MovingGas, StillGas


def _begin(rows: Any) -> str:
    program, add, given = rows.program, rows.add, "flowing, length"
    if program.keeps_volumes:
        return f"gas = {add(pneumatics.begin_still_gas)}(state, held, {given})"
    if program.has_shape:
        return f"gas = {add(actuators.begin_shaped_gas)}(plant, state, next_angle, {given})"
    held = "held" if program.hands_chambers_on else f"{add(pneumatics.held_chambers)}(plant, state.angle)"
    return f"gas = {add(pneumatics.begin_moving_gas)}(plant, state, {held}, next_angle, {given})"


def _still(rows: Any, gas: str) -> str:
    """The part of the first stage that still and moving gas share."""
    return gas if rows.program.keeps_volumes else f"{gas}.still"


def _second(rows: Any, gas: str) -> Second:
    program, add, still = rows.program, rows.add, _still(rows, gas)
    next_angle = "state.angle" if program.is_locked else "begun.next_angle"
    is_still = program.keeps_volumes
    stage = pneumatics.second_still_stage if is_still else pneumatics.second_moving_stage
    whole = pneumatics.still_change if is_still else pneumatics.moving_change
    return Second(
        stage=f"{add(stage)}({gas}, passing)",
        change=f"{add(whole)}(plant, {still}, second, length)",
        error=f"{add(pneumatics.gas_error)}(plant, {still}, second, {next_angle}, length)",
        shifted=f"{add(pneumatics.opening_error)}(plant, {still}, shift, {next_angle}, length)",
    )


ISOTHERMAL = GasScheme(
    parameters={},
    states={},
    start=None,
    loads=(),
    stored={},
    begun=lambda program: StillGas if program.keeps_volumes else MovingGas,
    change=GasChange,
    begin=_begin,
    ends=lambda rows, gas: f"{_still(rows, gas)}.end_1, {_still(rows, gas)}.end_2",
    first=lambda rows, gas: f"{_still(rows, gas)}.first",
    second=_second,
    add=lambda rows: f"fed = {rows.add(with_gas)}(state, change)",
    move=lambda _rows, _state, _assumed, _reached: [],
    work=lambda _rows: [],
)
