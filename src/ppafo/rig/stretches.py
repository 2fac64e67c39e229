"""Integration between two events with LSODA, to the end time or to the first zero of a root function."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.continuous_time import Roots
from ppafo.errors import SimulationError
from ppafo.rig.dynamics import RigState

Floats = NDArray[np.float64]

Slopes = Callable[[float, Floats], Floats]
"""Right-hand side: time derivatives [SI/s] of the unknowns (unknowns,) at a time [s]."""
Distances = Callable[[float, Floats], Roots]
"""Root functions of time [s] and unknowns (unknowns,), positive until the event."""

RELATIVE_TOLERANCE = 1.0e-8
"""Relative tolerance of a step [-], five digits below the accuracy of 1e-3 of comparisons with the model."""

ABSOLUTE_TOLERANCES = RigState(
    angle=1e-10,
    angular_velocity=1e-9,
    mass_1=1e-13,
    energy_1=1e-8,
    mass_2=1e-13,
    energy_2=1e-8,
    line_mass_1=1e-13,
    line_energy_1=1e-8,
    line_mass_2=1e-13,
    line_energy_2=1e-8,
    supplied_mass=1e-13,
    vented_mass=1e-13,
    leaked_mass=1e-13,
    supply_drop_1=1e-2,
    supply_drop_2=1e-2,
    enthalpy_in=1e-8,
    work_done=1e-8,
    heat_in=1e-8,
    sensor_angle=1e-9,
    sensor_pressure_1=1e-2,
    sensor_pressure_2=1e-2,
)
"""Absolute tolerances [SI], below 1e-6 of usual values: 1e-4 kg and 10 J in a chamber, 1e5 Pa of supply."""

VALVE_TOLERANCE = 1e-10
"""Absolute tolerance of each unknown of the valve, for which 1 is fully open [-]."""

MAXIMUM_STEPS = 100_000
"""Largest number of solver steps between two events; a few hundred are usual."""

_ROOT_TOLERANCE = 4.0 * float(np.finfo(np.float64).eps)
"""Smallest relative tolerance [-] that ``scipy.optimize.brentq`` accepts."""


def solve_stretch(
    slopes: Slopes, distances: Distances | None, unknowns: Floats, start: float, end: float, wanted: Floats
) -> tuple[Floats, Floats]:
    """Integrate from ``start`` to ``end`` [s], or to the first root of ``distances``.

    Returns times [s] and unknowns (times, unknowns). The unknowns of ``RigState`` come first, then the unknowns of the
    valve; rows at the ``wanted`` times [s] are included. A root function that is 0 at the start does not end the
    integration. Raises SimulationError if the solver fails.
    """
    from scipy.integrate import LSODA

    of_valve = [VALVE_TOLERANCE] * (unknowns.size - len(ABSOLUTE_TOLERANCES))
    tolerances = np.array([*ABSOLUTE_TOLERANCES, *of_valve])
    solver = LSODA(slopes, start, unknowns, end, rtol=RELATIVE_TOLERANCE, atol=tolerances)
    times, states = [start], [np.array(unknowns)]
    before = None if distances is None else distances(start, unknowns)
    # The ends are states of the solver itself, not of its interpolant.
    waiting = list(wanted[(wanted > start) & (wanted < end)])
    for _ in range(MAXIMUM_STEPS):
        message = solver.step()
        if solver.status == "failed":
            raise SimulationError(f"the solver of the simulated test bench stopped at t = {solver.t:.6g} s: {message}")
        reached, event = float(solver.t), None
        # The interpolant is valid in the last step only, so it is asked for in each.
        interpolant = solver.dense_output()
        if distances is not None and before is not None:
            after = distances(reached, solver.y)
            # Strictly above 0 before: a vane that just came to rest has not done so again.
            crossed = [number for number in range(len(after)) if before[number] > 0.0 >= after[number]]
            roots = [_root(distances, number, interpolant, float(solver.t_old), reached) for number in crossed]
            event = min(roots, default=None)
            before = after
        last = reached if event is None else event
        while waiting and waiting[0] < last:
            times.append(waiting.pop(0))
            states.append(interpolant(times[-1]))
        if event is not None or solver.status == "finished":
            times.append(last)
            states.append(interpolant(last) if event is not None else np.array(solver.y))
            return np.array(times), np.array(states)
    raise SimulationError(
        f"the solver of the simulated test bench stopped at t = {solver.t:.6g} s after {MAXIMUM_STEPS} steps; check "
        "the values of device and preset"
    )


def _root(distances: Distances, number: int, interpolant: Callable[[float], Floats], start: float, end: float) -> float:
    """Return the time [s] at which a root function is 0, within a solver step from ``start`` to ``end`` [s].

    ``number`` is the index of the root function.
    """
    from scipy.optimize import brentq

    root = brentq(
        lambda time: distances(time, interpolant(time))[number], start, end, xtol=1.0e-15, rtol=_ROOT_TOLERANCE
    )
    return float(root)
