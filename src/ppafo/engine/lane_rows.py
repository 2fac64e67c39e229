"""Signature of the compiled loop over runs, and the number of runs processed side by side."""

from functools import lru_cache

from ppafo.engine.entries import FLOAT, INT
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths

LOOP = {
    **dict.fromkeys(("states", "parameters"), "float64[:, ::1]"),
    "signal_history": "float64[:, :, ::1]",
    "command_history": "float64[:, ::1]",
    **dict.fromkeys(("record", "trace"), "float64[:, :, ::1]"),
    **dict.fromkeys(("first_step", "step_count", "steps_in_all", "steps_per_sample"), INT),
    "interval": FLOAT,
    **dict.fromkeys(("last_record", "next_record", "trace_every", "signal_delay", "command_delay"), INT),
}
"""Arguments of a loop in order, with their types."""

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
