"""A loop over the runs of a program: what it is handed, and how many go through their steps side by side."""

from functools import lru_cache

from ppafo.engine.entries import ENTRY
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths

COMPILED = ENTRY.format(
    "float64[:, ::1], float64[:, ::1], float64[:, :, ::1], float64[:, ::1], float64[:, :, ::1], "
    "float64[:, :, ::1], int64, int64, int64, int64, float64, int64, int64, int64, int64, int64"
)
"""The mark of a loop, with the types of its ``ARGUMENTS``."""
ARGUMENTS = (
    "states, parameters, signal_history, command_history, record, trace, "
    "first_step, step_count, steps_in_all, steps_per_sample, interval, last_record, next_record, trace_every, "
    "signal_delay, command_delay"
)

LANES = 32
"""Most runs of a block."""

VECTOR = 8
"""Lanes that the widest processors take at once, and the fewest of a block: its columns are a whole number of these."""

FIRST_CACHE = 48 * 1024
"""Bytes of the first-level data cache of a core; a block that does not fit takes fewer runs."""


HANDED = ("held.", "carried.")
"""Groups of rows that a step is handed by the one before."""


@lru_cache(maxsize=64)
def lanes_of(program: Program) -> int:
    """Number of runs that a block of a program takes side by side: all lanes, or half where rows would spill."""
    groups = (program.state_rows(), program.parameter_rows(), program.step_rows())
    # Fewer lanes rather than a block that spills: a miss of the first cache costs more than half-used loops.
    rows = sum(len(leaf_paths(row, name)) for group in groups for name, row in group.items())
    return next((lanes for lanes in (LANES, LANES // 2) if 8 * lanes * rows <= FIRST_CACHE), VECTOR)
