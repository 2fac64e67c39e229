"""Runs of trials in every stream of sensor noise, as many at once as memory allows."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ppafo.signals.recording import Floats
from ppafo.simulation.ensemble import COMPLETED, run_ensemble
from ppafo.simulation.scenario import Scenario
from ppafo.studies.sampling import NOISE
from ppafo.study.runs import oscillating, with_companions

STREAMS = 16
"""Noise streams in each of which a limit must be kept, the same for all trials, where sensors are noisy."""
_AT_ONCE = 16_384
"""Runs handed over at once: enough to fill the batches of all threads, little enough memory."""


OSCILLATES = "the torque loop oscillates"


class TrialMetrics(NamedTuple):
    """Metrics (streams, trials) by name, nan where a run failed or oscillates; runs, failures, why."""

    metrics: dict[str, Floats]
    runs: int
    failed: int
    reasons: list[str]


def run_trials(
    scenario: Scenario, columns: Mapping[str, Floats], metrics: Sequence[str], seeds: Floats, threads: int | None
) -> TrialMetrics:
    """Return what came of trials with columns (trials,) of numbers [SI] by path.

    ``seeds`` (streams,) name the streams of noise, the same for every trial, so that trials differ by what is tried and
    not by luck; none where no controller receives noise, which counts as one stream.
    """
    streams, count = max(1, seeds.size), next(iter(columns.values())).size
    chunk = max(1, _AT_ONCE // streams)
    parts: list[dict[str, Floats]] = []
    reasons: list[str] = []
    failed = 0
    for start in range(0, count, chunk):
        part = {path: values[start : start + chunk] for path, values in columns.items()}
        size = next(iter(part.values())).size
        if seeds.size:
            part = {path: np.tile(values, streams) for path, values in part.items()}
            part[NOISE] = np.repeat(seeds, size)
        result = run_ensemble(scenario, part, with_companions(metrics, scenario), threads=threads)
        # A loop that oscillates is no design, whatever its error is; how far it may lag is the limit of the design.
        turns = oscillating(result.metrics, scenario)
        failed += int(np.count_nonzero((result.status != COMPLETED) | turns))
        reasons += [*result.reasons.values(), *([OSCILLATES] if turns.any() else [])]
        parts.append({name: np.where(turns, np.nan, result.metrics[name]).reshape(streams, size) for name in metrics})
    values = {name: np.concatenate([part[name] for part in parts], axis=1) for name in metrics}
    return TrialMetrics(metrics=values, runs=streams * count, failed=failed, reasons=reasons)
