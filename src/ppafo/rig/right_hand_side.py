"""The equations of the rig as compiled code, and the arrays through which Python calls it.

The text is composed of the same functions as all compiled physics. The valve and a prescribed angle of the vane stay
outside, in Python: what they ask for comes in as numbers. So there is one program for all devices and experiments, and
a new computer compiles once.
"""

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.entries import ARRAY, FLOAT, HEADER, INLINE, entry_text, with_arrays
from ppafo.engine.loading import load_source
from ppafo.engine.rows import leaf_paths, numbers, row_expression
from ppafo.engine.source_text import SourceCollector
from ppafo.model.plant import Openings
from ppafo.rig.dynamics import RigNumbers, RigState, observables, rig_rates

Floats = NDArray[np.float64]


class VaneInputs(NamedTuple):
    """What the equations are told of the vane: angle [rad], prescribed rate [rad/s] and torque of a leg [N m].

    The rate of an unconstrained vane is one of the unknowns; ``rate`` is 0 then.
    """

    angle: float
    rate: float
    added_torque: float


class Inputs(NamedTuple):
    """Numbers that come from outside with each call, in the order of their array."""

    openings: Openings
    vane: VaneInputs


class Observed(NamedTuple):
    """Both pressures [Pa, absolute], driving torque and static limit of friction [N m] in one state."""

    pressure_1: float
    pressure_2: float
    torque: float
    static_limit: float


_OBSERVED_PATHS = ("node_1.pressure", "node_2.pressure", "torque", "static_limit")
"""Where ``Observables`` has the numbers of ``Observed``, in their order."""


@functools.cache
def rig_source() -> str:
    """Return the module of the entries ``fill`` and ``show``.

    ``fill(y, slopes, parameters, inputs, direction)`` writes the slopes of the unknowns ``y`` of ``RigState``;
    ``show(y, outputs, parameters, inputs, direction)`` writes the numbers of ``Observed``.
    """
    collector = SourceCollector(INLINE)
    add = collector.add
    arrays = {"given": ("parameters", RigNumbers), "state": ("y", RigState), "inputs": ("inputs", Inputs)}
    cells = {
        path: f"{array}[{number}]"
        for name, (array, row) in arrays.items()
        for number, path in enumerate(leaf_paths(row, name))
    }
    angle, rate, added_torque = (cells[f"inputs.vane.{field}"] for field in VaneInputs._fields)
    begin = [
        f"given = {row_expression(RigNumbers, 'given', cells, add)}",
        f"state = {row_expression(RigState, 'state', cells, add)}",
        f"openings = {row_expression(Openings, 'inputs.openings', cells, add)}",
    ]
    fill = [
        f"rates = {add(rig_rates)}(given, openings, state, {angle}, {rate}, {added_torque}, direction)",
        *(f"slopes[{number}] = rates.{field}" for number, field in enumerate(RigState._fields)),
    ]
    show = [
        f"now = {add(observables)}(given, state, {angle}, {added_torque})",
        *(f"outputs[{number}] = now.{path}" for number, path in enumerate(_OBSERVED_PATHS)),
    ]
    entries = []
    for name, output, lines in (("fill", "slopes", fill), ("show", "outputs", show)):
        types = dict.fromkeys(("y", output, "parameters", "inputs"), ARRAY) | {"direction": FLOAT}
        entries.append(entry_text(name, types, begin + lines))
    return "\n\n\n".join([HEADER, collector.text(), *entries])


class CompiledRig:
    """The compiled equations with the numbers of one run. A call leaves nothing behind that a later one reads."""

    def __init__(self, given: RigNumbers) -> None:
        parameters = np.array(numbers(given))
        self._state, self._rates = np.empty(len(RigState._fields)), np.empty(len(RigState._fields))
        self._observed, self._inputs = np.empty(len(Observed._fields)), np.zeros(len(leaf_paths(Inputs, "inputs")))
        module = load_source(rig_source())
        self._fill = with_arrays(module.fill, self._state, self._rates, parameters, self._inputs)
        self._show = with_arrays(module.show, self._state, self._observed, parameters, self._inputs)

    def rates(self, state: Floats, openings: Openings, vane: VaneInputs, direction: float) -> Floats:
        """Return the slopes of the unknowns of ``RigState`` (unknowns,) [SI]; the array is written anew by each call.

        ``openings`` of the valve [-]; the vane slides towards ``direction`` (1 or -1), or is held or prescribed (0).
        """
        self._state[:] = state
        self._inputs[:] = (*openings, *vane)
        self._fill(direction)
        return self._rates

    def observe(self, state: Floats, vane: VaneInputs) -> Observed:
        """Return what a bench could observe in a state, the unknowns of ``RigState`` (unknowns,) [SI]."""
        self._state[:] = state
        self._inputs[len(Openings._fields) :] = vane
        self._show(0.0)
        return Observed._make(self._observed.tolist())
