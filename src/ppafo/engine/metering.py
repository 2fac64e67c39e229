"""Meters of a batch: added to its program instead of a recording, and read after the run."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.engine.lanes import Batch
from ppafo.engine.program import Program
from ppafo.engine.rows import group_of, row_numbers
from ppafo.signals.meter import MeterKind
from ppafo.signals.recording import Floats


def add_meters(batch: Batch, meters: Sequence[MeterKind], traced: Sequence[str] = (), trace_every: int = 0) -> Batch:
    """Return the batch with meters at every sample that it would have recorded, and without recording.

    The ``traced`` channels are stored every ``trace_every`` samples, 0 for never.
    """
    program = replace(batch.program, meters=tuple(meters), traced=tuple(traced))
    clock = replace(batch.clock, record_every=0, measure_every=batch.clock.record_every, trace_every=trace_every)
    rows = len(row_numbers(program.state_rows()))
    # Meters begin with zeros; their first sample fills them.
    states = np.zeros((rows, batch.states.shape[1]))
    states[: batch.states.shape[0]] = batch.states
    return Batch(program, clock, batch.parameters, states)


def meters_of(program: Program, states: Floats) -> dict[str, Any]:
    """Return the final state of each meter by name, from final states (rows, runs): arrays (runs,) in meter units."""
    groups = program.state_rows()
    return {kind.name: group_of(group, groups, states) for group, kind in program.meter_groups.items()}
