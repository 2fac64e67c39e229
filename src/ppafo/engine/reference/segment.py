"""One stretch of a CVODE solution, between two events: the times requested, and its failure as one line."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.reference.sampling import SAME_TIME
from ppafo.errors import SimulationError

Floats = NDArray[np.float64]


def solve_segment(solver: Any, y: Floats, time: float, end: float, wanted: Floats, name: str) -> Any:
    """Solution from ``time`` to ``end`` [s], or to an event before, also at the ``wanted`` times that lie ahead.

    ``wanted`` may hold times before ``time`` and after ``end``. SimulationError, which calls the solver ``name``, where
    the solver gives up.
    """
    inside = wanted[(wanted > time + SAME_TIME) & (wanted < end - SAME_TIME)]
    grid = np.unique(np.concatenate([[time], inside, [end]]))
    # With only two times the solver would return its own steps instead of the end.
    times = grid if grid.size > 2 else np.array([grid[0], 0.5 * (grid[0] + grid[1]), grid[1]])
    solution = solver.solve(times, y)
    if not solution.success:
        raise SimulationError(f"{name} stopped at t = {solution.t[-1]:.6g} s: {solution.message}")
    return solution
