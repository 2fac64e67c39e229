"""Integrates a stretch between two instants with LSODA of SciPy, up to the first root that ends it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import SimulationError

Floats = NDArray[np.float64]
Slopes = Callable[[float, Floats], Floats]
Roots = Callable[[float, Floats], tuple[float, float]]

TOLERANCE = 1.0e-8
MAXIMUM_STEPS = 100_000
_WITHIN = 4.0 * float(np.finfo(np.float64).eps)


class Stretch(NamedTuple):
    """Unknowns (times, unknowns) at the times [s] that were wanted and at the last one, where it ended."""

    t: Floats
    y: Floats


def solve_stretch(
    slopes: Slopes, tolerances: Floats, roots: Roots | None, y: Floats, time: float, end: float, wanted: Floats
) -> Stretch:
    """Unknowns from ``time`` to ``end`` [s], or to where one of two roots falls to 0, also at the ``wanted`` times.

    A root that is 0 at the start ends nothing. SimulationError where the solver gives up.
    """
    from scipy.integrate import LSODA

    solver = LSODA(slopes, time, y, end, rtol=TOLERANCE, atol=tolerances)
    times, states = [time], [np.array(y)]
    before = None if roots is None else roots(time, y)
    # The ends are states of the solver itself, not of its interpolant.
    waiting = list(wanted[(wanted > time) & (wanted < end)])
    for _ in range(MAXIMUM_STEPS):
        said = solver.step()
        if solver.status == "failed":
            raise SimulationError(f"the rig's solver stopped at t = {solver.t:.6g} s: {said}")
        after, found = float(solver.t), None
        # The interpolant is valid in the last step only, so it is asked for in each.
        inside = solver.dense_output()
        if roots is not None and before is not None:
            now = roots(after, solver.y)
            # Strictly above 0 before: a vane that just came to rest has not done so again.
            crossed = [place for place in (0, 1) if before[place] > 0.0 >= now[place]]
            found = min((_root(roots, place, inside, float(solver.t_old), after) for place in crossed), default=None)
            before = now
        last = after if found is None else found
        while waiting and waiting[0] < last:
            moment = waiting.pop(0)
            times.append(moment)
            states.append(inside(moment))
        if found is not None or solver.status == "finished":
            times.append(last)
            states.append(inside(last) if found is not None else np.array(solver.y))
            return Stretch(np.array(times), np.array(states))
    raise SimulationError(f"the rig's solver took {MAXIMUM_STEPS} steps up to t = {solver.t:.6g} s")


def _root(roots: Roots, place: int, inside: Callable[[float], Floats], start: float, end: float) -> float:
    """Where a root falls to 0 within a step [s]."""
    from scipy.optimize import brentq

    found: float = brentq(lambda t: roots(t, inside(t))[place], start, end, xtol=1.0e-15, rtol=_WITHIN)
    return found
