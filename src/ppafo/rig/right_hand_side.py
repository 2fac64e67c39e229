"""The equations of the rig as compiled code, and the arrays through which Python calls it.

They are the same functions as all compiled physics. The valve and a prescribed angle of the vane stay outside, in
Python: what they ask for comes in as numbers. So there is one program for all devices and experiments, and a new
computer compiles once.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.entries import with_arrays
from ppafo.engine.row_functions import row_functions
from ppafo.engine.rows import leaf_paths, numbers
from ppafo.model.plant import Openings
from ppafo.rig.dynamics import RigNumbers, RigState, observables, rig_rates

Floats = NDArray[np.float64]


class VaneInputs(NamedTuple):
    """Inputs of the equations for the vane: angle [rad], prescribed rate [rad/s] and torque of a leg [N m].

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


def slopes_of(given: RigNumbers, state: RigState, inputs: Inputs, direction: float) -> RigState:
    """Slopes of the unknowns [SI/s] of a vane that slides towards ``direction`` (1 or -1), or is held (0)."""
    vane = inputs.vane
    return rig_rates(given, inputs.openings, state, vane.angle, vane.rate, vane.added_torque, direction)


def observed_in(given: RigNumbers, state: RigState, inputs: Inputs) -> Observed:
    """Observable quantities of a bench in a state."""
    now = observables(given, state, inputs.vane.angle, inputs.vane.added_torque)
    return Observed(
        pressure_1=now.node_1.pressure,
        pressure_2=now.node_2.pressure,
        torque=now.torque,
        static_limit=now.static_limit,
    )


class CompiledRig:
    """The compiled equations with the numbers of one run. A call leaves nothing behind that a later one reads."""

    def __init__(self, given: RigNumbers) -> None:
        parameters = np.array(numbers(given))
        self._state, self._rates = np.empty(len(RigState._fields)), np.empty(len(RigState._fields))
        self._observed, self._inputs = np.empty(len(Observed._fields)), np.zeros(len(leaf_paths(Inputs, "inputs")))
        slopes, observed = row_functions(slopes_of, observed_in)
        self._fill = with_arrays(slopes, parameters, self._state, self._inputs, self._rates)
        self._show = with_arrays(observed, parameters, self._state, self._inputs, self._observed)

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
        self._show()
        return Observed._make(self._observed.tolist())
