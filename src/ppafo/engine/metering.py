"""Batches with meters in place of records."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.engine.lanes import Batch, Floats
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, rebuilt
from ppafo.signals.meter import MeterKind


def add_meters(batch: Batch, meters: Sequence[MeterKind], traced: Sequence[str] = (), trace_every: int = 0) -> Batch:
    """The batch with meters at every sample that it would record, and traces of channels every so many samples."""
    program = replace(batch.program, meters=tuple(meters), traced=tuple(traced))
    clock, interval = batch.clock, batch.clock.record_every
    clock = replace(clock, record_every=0, measure_every=interval, trace_every=trace_every)
    rows = sum(len(leaf_paths(row, name)) for name, row in program.state_rows().items())
    states = np.zeros((rows, batch.states.shape[1]))
    states[: batch.states.shape[0]] = batch.states
    return Batch(program, clock, batch.parameters, states)


def group_of(name: str, groups: dict[str, type], rows: Floats) -> Any:
    """The NamedTuple of a group of rows (rows, runs), such as ``Program.state_rows`` names, with arrays (runs,).

    KeyError where no group has that name.
    """
    start = 0
    for group, row in groups.items():
        count = len(leaf_paths(row, group))
        if group == name:
            return rebuilt(row, rows[start : start + count])
        start += count
    raise KeyError(name)


def meters_of(program: Program, states: Floats) -> dict[str, Any]:
    """The last state of each meter by its name, with arrays (runs,), in the units of the meter."""
    groups = program.state_rows()
    return {kind.name: group_of(group, groups, states) for group, kind in program.meter_groups.items()}
