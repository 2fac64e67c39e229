"""Timing errors of a walking controller: detected gait events on strides of varying duration."""

from dataclasses import replace

import numpy as np

from ppafo.engine.lanes import run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, batch_of
from ppafo.errors import SimulationError
from ppafo.simulation.scenario import Scenario
from ppafo.walking.evaluation import REMEDY
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import plan_walk, task_sequence_of_walk
from ppafo.walking.stride_events import EVENTS, event_errors, known_events, true_events, within
from ppafo.walking.task_sequence import TaskSegment, TaskSequence

WEARERS = {"healthy": ("wearer.keeps_gait=1",), "impaired": ("wearer.keeps_gait=0",)}
"""Overrides of a wearer whose muscles keep the measured gait, and of the walk file's wearer, who has drop foot."""
LONGEST = 60.0
"""Longest simulated time [s] of a walk."""
SETTLED = 6.0
"""Time [s] after which events count, when the stride estimate has settled."""
UNEVEN_STRIDES = 24
VARIATION = 0.025
"""Standard deviation of stride times over their mean in steady walking, as published for healthy adults (Hausdorff
et al. 1995, J Appl Physiol 78:349, and later: 1 to 3 %)."""
SEED = 20110501


def uneven_task_sequence(cadence: float) -> TaskSequence:
    """Return a task sequence whose stride times vary as in healthy walking, about a cadence of steps [1/s]."""
    generator = np.random.default_rng(SEED)
    paces = cadence / (1.0 + VARIATION * np.clip(generator.standard_normal(UNEVEN_STRIDES), -2.0, 2.0))
    # Each stride is a segment of its own, since a segment has one pace.
    strides = (TaskSegment("walk", {"cadence": pace, "strides": 1.0}) for pace in paces.tolist())
    begin = (TaskSegment("start", {"strides": 1.0}), TaskSegment("walk", {"strides": 6.0}))
    return TaskSequence("uneven", "Strides of uneven time.", (*begin, *strides), "uneven")


def event_error(configuration: Scenario) -> float:
    """Return the RMS time error [s] of the gait events of a walk over a task sequence.

    Raises SimulationError if the walk diverges.
    """
    sequence = task_sequence_of_walk(configuration)
    assert sequence is not None, "its strides are uneven"
    duration = min(float(sequence.duration), LONGEST)
    run = plan_walk(replace(configuration, run=replace(configuration.run, duration=duration, output_interval=1.0e-3)))
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
    errors = [event_errors(true[name], known[name], interval, stride_time).errors for name in EVENTS]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
