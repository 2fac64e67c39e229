"""Many variants of one scenario, with metrics computed inside the lanes and no trajectory stored."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.channels import TRACED
from ppafo.engine.lanes import Floats
from ppafo.engine.run import TOO_MANY_PARTS
from ppafo.errors import ScenarioError
from ppafo.metrics import MetricKind, metric_kind
from ppafo.model.controlled import CONTROLLED
from ppafo.signals.recording import OF_SECOND_CHAMBER
from ppafo.simulation.check import MARGIN, finer
from ppafo.simulation.ensemble.columns import check_columns
from ppafo.simulation.ensemble.planning import EnsemblePlan, plan_ensemble
from ppafo.simulation.ensemble.running import MeteredRuns, OutputRequest, intervals, offered
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import REMEDY
from ppafo.wording import nearest_name

COMPLETED, DIVERGED, REFUSED = 0, 1, 2
"""End of a run of an ensemble; refused: a combination of values that no run can have."""

_ROUNDING = 1.0e-9
"""Fraction by which rounding may put the end of a run before the last time of its traces."""


@dataclass(frozen=True, slots=True)
class EnsembleResult:
    """Results of the runs of an ensemble, in the order of the columns.

    ``status`` (runs,) is COMPLETED, DIVERGED or REFUSED; ``failure_time`` (runs,) [s] is nan where a run did not
    diverge; ``reasons`` has one line for each run, by its index, that diverged or was refused. ``metrics`` maps a name
    to values (runs,) in SI units, nan where a run failed or has no such metric. ``times`` (times,) [s] and ``traces``,
    channel to values (times, runs), are there for the channels that were requested; nan where a run failed. ``errors``
    has the estimated error of each metric from the steps (runs,), where it was requested: inf where the run with finer
    steps failed.
    """

    status: NDArray[np.int8]
    failure_time: Floats
    reasons: dict[int, str]
    metrics: dict[str, Floats]
    times: Floats
    traces: dict[str, Floats]
    errors: dict[str, Floats]


def run_ensemble(
    base: Scenario,
    columns: Mapping[str, Floats],
    meters: Sequence[str],
    bands: Sequence[str] = (),
    every: float = 0.0,
    threads: int | None = None,
    gauge: Collection[str] = (),
    errors: bool = False,
) -> EnsembleResult:
    """Run ``base`` once for each row of values; each run gives exactly what it gives alone.

    ``columns`` maps dotted paths, as in overrides (``supply.pressure``, ``valve.area``, ``reference.level``), to values
    in SI units, shape (runs,), pressures absolute but for the paths in ``gauge``, which count from the
    atmosphere of their run. ``meters`` names metrics of ``ppafo.metrics``; ``bands`` names
    channels whose traces are kept every ``every`` [s] (the output interval unless given) to the end of the longest run.
    ScenarioError for unknown paths, metrics and channels, or for columns of different lengths; a run whose values are
    out of range is REFUSED and the others go on. Memory grows with the number of runs: give chunks of some ten
    thousand. ``errors`` runs all once more with a sixteenth of the error, which takes four times as long again.

    Where a Python object controls ``base``, the runs are made one after the other: some 30 ms each.

    What follows a number that varies moves with it, as it does in a file: a gauge pressure with the atmosphere, a
    pressure at the start with the supply which it names, the second regulator with the first.
    """
    metrics: dict[str, MetricKind] = {}
    for name in meters:
        kind = metric_kind(name)
        if kind is None:
            raise ScenarioError(f"{base.name}: there is no metric '{name}'{_hint(name, offered(base))}")
        metrics[name] = kind
    for name in bands:
        _check_channel(base, name)
    interval = every or base.run.output_interval
    if not interval > 0.0:
        raise ScenarioError(f"{base.name}: the interval of traces is {interval:g} s; it must be above 0 s")
    checked = check_columns(base, columns, gauge)
    plan = plan_ensemble(checked)
    times: Floats = np.empty(0)
    if bands and plan.batches:
        longest = max(float((intervals(batch) * (batch.clock.samples - 1)).max()) for _, batch in plan.batches)
        times = np.arange(int(longest / interval * (1.0 + _ROUNDING)) + 1, dtype=np.float64) * interval
    request = OutputRequest(metrics, tuple(dict.fromkeys(bands)), interval, times, base.controller.custom)
    outcome = MeteredRuns(checked.runs, request)
    outcome.run_all(plan.batches, threads)
    estimated = {}
    if errors:
        # For the metrics alone: nobody asks for the error of a trace.
        alone = OutputRequest(metrics, (), interval, np.empty(0), base.controller.custom)
        fine = MeteredRuns(checked.runs, alone)
        fine.run_all(plan_ensemble(checked, finer).batches, threads)
        for name, values in outcome.metrics.items():
            # Where the finer run has no value this one may be wrong by anything; without a value it has no error.
            changes = np.where(np.isfinite(fine.metrics[name]), np.abs(fine.metrics[name] - values), np.inf)
            estimated[name] = np.where(np.isfinite(values), MARGIN * changes, np.nan)
    return _result(plan, outcome, estimated)


def _result(plan: EnsemblePlan, outcome: MeteredRuns, errors: dict[str, Floats]) -> EnsembleResult:
    status = np.where(outcome.is_completed, COMPLETED, DIVERGED).astype(np.int8)
    # Runs that were refused are in no batch, so that until here they count as diverged.
    status[list(plan.reasons)] = REFUSED
    reasons = dict(plan.reasons)
    for run in np.flatnonzero(status == DIVERGED).tolist():
        remedy = TOO_MANY_PARTS if outcome.too_many_parts[run] else REMEDY
        reasons[run] = f"diverged at t = {outcome.failure_time[run]:.6g} s; {remedy}"
    times = outcome.request.times
    return EnsembleResult(
        status, outcome.failure_time, dict(sorted(reasons.items())), outcome.metrics, times, outcome.traces, errors
    )


def _check_channel(base: Scenario, name: str) -> None:
    if name not in TRACED:
        raise ScenarioError(f"{base.name}: the channel '{name}' cannot be traced{_hint(name, TRACED)}")
    controlled = next((kind.name for kind in CONTROLLED.values() if kind.reference == name), base.controlled)
    if controlled != base.controlled:
        raise ScenarioError(f"{base.name}: there is no '{name}' to trace: reference.of is '{base.controlled}'")
    if name == CONTROLLED[controlled].reference and base.controller.is_open_loop:
        raise ScenarioError(f"{base.name}: a constant command follows no reference, so there is none to trace")
    if name in OF_SECOND_CHAMBER and base.device.actuator.has_one_chamber:
        raise ScenarioError(f"{base.name}: there is no '{name}' to trace: {base.device.name} has one chamber")
    if name.startswith("temperature_") and base.gas_model is None:
        raise ScenarioError(f"{base.name}: '{name}' needs gas with an energy balance ([gas_model] kind = \"thermal\")")


def _hint(name: str, known: Mapping[str, object]) -> str:
    return nearest_name(name, known) or f"; known are {', '.join(known)}"
