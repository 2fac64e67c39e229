"""Signature of the compiled loop over runs, and the number of runs processed side by side."""

from functools import lru_cache

from ppafo.engine.entries import ENTRY
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths

COMPILED = ENTRY.format(
    "float64[:, ::1], float64[:, ::1], float64[:, :, ::1], float64[:, ::1], float64[:, :, ::1], "
    "float64[:, :, ::1], int64, int64, int64, int64, float64, int64, int64, int64, int64, int64"
)
"""Decorator of a loop, with the types of its ``ARGUMENTS``."""
ARGUMENTS = (
    "states, parameters, signal_history, command_history, record, trace, "
    "first_step, step_count, steps_in_all, steps_per_sample, interval, last_record, next_record, trace_every, "
    "signal_delay, command_delay"
)

LANES = 32
"""Largest number of runs in a block."""

VECTOR = 8
"""Vector width of the widest processors, and smallest block; the number of columns of a block is a multiple of it."""

FIRST_CACHE = 48 * 1024
"""Size [byte] of the first-level data cache of a core; a block that does not fit takes fewer runs."""


HANDED = ("held.", "carried.")
"""Prefixes of the groups of intermediate values that are passed from one step to the next."""


@lru_cache(maxsize=64)
def lanes_of(program: Program) -> int:
    """Return the number of runs in a block of a program: ``LANES``, or fewer if the rows would not fit the cache."""
    groups = (program.state_rows(), program.parameter_rows(), program.step_rows())
    # Fewer lanes rather than a block that spills: a miss of the first cache costs more than half-used loops.
    rows = sum(len(leaf_paths(row, name)) for group in groups for name, row in group.items())
    return next((lanes for lanes in (LANES, LANES // 2) if 8 * lanes * rows <= FIRST_CACHE), VECTOR)
