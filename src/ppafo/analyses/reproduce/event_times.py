"""Timing errors of a walking controller: detected gait events on strides of varying duration."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ppafo.engine.lanes import Floats, run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, batch_of
from ppafo.errors import SimulationError
from ppafo.simulation.scenario import Scenario
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import plan_walk, task_sequence_of_walk
from ppafo.walking.result import REMEDY
from ppafo.walking.stride_events import EVENTS, EventErrors, event_errors, known_events, true_events, within
from ppafo.walking.task_sequence import TaskSegment, TaskSequence
from ppafo.walking.walk import lasting

WEARERS = {"healthy": ("wearer.keeps_gait=1",), "impaired": ("wearer.keeps_gait=0",)}
"""A wearer whose muscles keep the measured gait, and the one of the walk file, whose foot drops."""
SETTLED = 6.0
"""Time [s] from which events count: strides are learnt by then."""
UNEVEN_STRIDES = 24
VARIATION = 0.025
"""Standard deviation of stride times over their mean in steady walking, as published for healthy adults (Hausdorff
et al. 1995, J Appl Physiol 78:349, and later: 1 to 3 %)."""
SEED = 20110501


def rms_of(parts: Sequence[Floats]) -> float:
    """Root mean square of several arrays together; nan without any number."""
    every = np.concatenate([np.asarray(part) for part in parts]) if parts else np.empty(0)
    return float(np.sqrt(np.mean(every**2))) if every.size else float("nan")


def uneven_task_sequence(cadence: float) -> TaskSequence:
    """Strides whose times vary as people's do, about a cadence [1/s] of steps."""
    generator = np.random.default_rng(SEED)
    paces = cadence / (1.0 + VARIATION * np.clip(generator.standard_normal(UNEVEN_STRIDES), -2.0, 2.0))
    # Each stride is a segment of its own, since a segment has one pace.
    strides = (TaskSegment("walk", {"cadence": pace, "strides": 1.0}) for pace in paces.tolist())
    begin = (TaskSegment("start", {"strides": 1.0}), TaskSegment("walk", {"strides": 6.0}))
    return TaskSequence("uneven", "Strides of uneven time.", (*begin, *strides), "uneven")


def timed_events(configuration: Scenario, minutes: float) -> Mapping[str, EventErrors]:
    """Errors of the events of one walk of at most so many minutes; SimulationError where it diverges."""
    sequence = task_sequence_of_walk(configuration)
    longest = lasting(configuration, minutes).run.duration if sequence is None else float(sequence.duration)
    run = plan_walk(
        replace(
            configuration, run=replace(configuration.run, duration=min(longest, 60.0 * minutes), output_interval=1.0e-3)
        )
    )
    # The states themselves: what the controller takes for an event is no channel of a recording.
    outcome = run_batch(batch_of(run))
    rows = row_numbers(run.program.state_rows())
    if outcome.states[rows["result.failure_time"], 0] < NEVER_FAILED or not np.isfinite(outcome.states).all():
        raise SimulationError(f"{configuration.name} diverged; {REMEDY}")
    record = {name: outcome.record[:, row, 0] for name, row in rows.items()}
    interval = run.step * run.record_every
    settled = slice(round(SETTLED / interval), outcome.record.shape[0])
    true = within(true_events(record["walk.contact"]), settled)
    known = within(known_events(record), settled)
    stride_time = walk_of(configuration).gait.stride_time
    return {name: event_errors(true[name], known[name], interval, stride_time) for name in EVENTS}
