"""Writes and loads the compiled right-hand side of the rig, from the same source text as all compiled physics.

The valve and a path of the vane stay outside, in Python: what they ask for comes in as numbers. So there is one
program for all devices and experiments, and a new computer compiles once.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

from ppafo.engine.entries import ARRAY, FLOAT, HEADER, INLINE, entry_text
from ppafo.engine.loading import load_source
from ppafo.engine.reference.derivative import ExactOrifice
from ppafo.engine.rows import leaf_paths, row_expression
from ppafo.engine.source_text import SourceCollector
from ppafo.model.plant import Openings, PlantParameters
from ppafo.rig.dynamics import observables, rig_rates
from ppafo.rig.rows import RigPhysics, RigState

UNKNOWNS = len(RigState._fields)
OUTPUTS = 4
"""Numbers that ``show`` writes: both pressures [Pa], driving torque and static limit of friction [N m]."""

ANGLE, RATE = 4, 5
INPUTS = 6
"""Numbers that come from outside: four openings, angle [rad] and prescribed rate [rad/s] of the vane."""

PARAMETER_GROUPS = {
    "plant": PlantParameters,
    "rig": RigPhysics,
    "valve_orifice": ExactOrifice,
    "leak_orifice": ExactOrifice,
    "line_orifice": ExactOrifice,
}
"""Groups of numbers that both functions need, in order."""


class RigProgram(NamedTuple):
    """``fill(y, slopes, parameters, inputs, direction)`` and ``show(y, outputs, parameters, inputs, direction)``.

    ``y`` and ``slopes`` are those of the unknowns of ``RigState``.
    """

    fill: Callable[..., None]
    show: Callable[..., None]


def load_rig_program() -> RigProgram:
    """Return the compiled right-hand side and observables of the rig."""
    module = load_source(rig_source())
    return RigProgram(module.fill, module.show)


@functools.cache
def rig_source() -> str:
    """Source of the module."""
    collector = SourceCollector(INLINE)
    add = collector.add
    cells: dict[str, str] = {}
    for name, row in PARAMETER_GROUPS.items():
        for path in leaf_paths(row, name):
            cells[path] = f"parameters[{len(cells)}]"
    cells |= {f"state.{field}": f"y[{number}]" for number, field in enumerate(RigState._fields)}
    cells |= {f"openings.{field}": f"inputs[{number}]" for number, field in enumerate(Openings._fields)}
    rows = PARAMETER_GROUPS | {"state": RigState, "openings": Openings}
    given = [f"{name} = {row_expression(row, name, cells, add)}" for name, row in rows.items()]
    orifices = "valve_orifice, leak_orifice, line_orifice"
    motion = f"inputs[{ANGLE}], inputs[{RATE}], direction"
    fill = [f"rates = {add(rig_rates)}(plant, rig, {orifices}, openings, state, {motion})"]
    fill += [f"slopes[{number}] = rates.{field}" for number, field in enumerate(RigState._fields)]
    show = [f"now = {add(observables)}(plant, rig, state, inputs[{ANGLE}])"]
    outputs = ("node_1.pressure", "node_2.pressure", "torque", "static_limit")
    show += [f"outputs[{number}] = now.{path}" for number, path in enumerate(outputs)]
    functions = [_function("fill", "slopes", given + fill), _function("show", "outputs", given + show)]
    return "\n\n\n".join([HEADER, collector.text(), *functions])


def _function(name: str, output: str, lines: list[str]) -> str:
    arrays = dict.fromkeys(("y", output, "parameters", "inputs"), ARRAY)
    return entry_text(name, arrays | {"direction": FLOAT}, lines)
