"""Ensemble: many variants of one scenario, with metrics computed during the runs and no trajectory stored."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.channels import TRACED
from ppafo.engine.lanes import Count, Floats
from ppafo.engine.run import TOO_MANY_PARTS
from ppafo.errors import ScenarioError
from ppafo.metrics import MetricKind, metric_kind
from ppafo.model.controlled import CONTROLLED
from ppafo.progress import report_nothing
from ppafo.signals.recording import OF_SECOND_CHAMBER
from ppafo.simulation.check import MARGIN, finer
from ppafo.simulation.ensemble.planning import check_columns, plan_ensemble
from ppafo.simulation.ensemble.running import MeteredRuns, OutputRequest, intervals, offered
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import REMEDY
from ppafo.wording import nearest_name

COMPLETED, DIVERGED, REFUSED = 0, 1, 2
"""End of a run of an ensemble; REFUSED for an impossible combination of values."""

_ROUNDING = 1.0e-9
"""Relative tolerance for the end of a run that rounding puts before the last time of its traces."""


@dataclass(frozen=True, slots=True)
class EnsembleResult:
    """Results of the runs of an ensemble, in the order of the columns.

    ``status`` (runs,) is COMPLETED, DIVERGED or REFUSED. ``failure_time`` (runs,) [s] is nan for runs that did not
    diverge. ``reasons`` maps the index of each run that diverged or was refused to a line that says why. ``metrics``
    maps a name to values (runs,) in SI units, nan for failed runs and runs without this metric. ``times`` (times,) [s]
    and ``traces``, channel to values (times, runs), are for the requested channels; nan for failed runs. ``errors``
    maps a metric to its estimated time-stepping error (runs,), if requested: inf if the run with finer steps failed.
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
    count: Count = report_nothing,
) -> EnsembleResult:
    """Run ``base`` once for each row of values; each run gives exactly the same result as alone.

    ``columns`` maps dotted paths, as in overrides (``supply.pressure``, ``valve.area``, ``reference.level``), to values
    in SI units, shape (runs,). Pressures are absolute, except for the paths in ``gauge``, which are relative to the
    atmosphere of each run. ``meters`` names metrics of ``ppafo.metrics``. ``bands`` names channels whose traces are
    kept every ``every`` [s] (default: the output interval) up to the end of the longest run. Raises ScenarioError for
    unknown paths, metrics and channels, and for columns of different lengths; a run whose values are out of range is
    REFUSED and the others continue. Memory grows with the number of runs: use chunks of some ten thousand runs.
    ``errors`` repeats all runs with a sixteenth of the allowed error, which takes four times as long again.
    ``count`` is called in between with the number of runs that have ended since the last call.

    If a Python object controls ``base``, the runs are made one after the other: some 30 ms each.

    Numbers that follow a varied number change with it, as in a file: a gauge pressure with the atmosphere, an initial
    pressure with the supply that it names, the second regulator with the first.
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
    # The runs with finer steps take most of the time.
    runs = MeteredRuns(checked.runs, request, report_nothing if errors else count)
    runs.run_all(plan.batches, threads)
    estimated = {}
    if errors:
        # For the metrics alone: nobody asks for the error of a trace.
        metrics_alone = OutputRequest(metrics, (), interval, np.empty(0), base.controller.custom)
        fine = MeteredRuns(checked.runs, metrics_alone, count)
        fine.run_all(plan_ensemble(checked, finer).batches, threads)
        for name, values in runs.metrics.items():
            # Where the finer run has no value this one may be wrong by anything; without a value it has no error.
            changes = np.where(np.isfinite(fine.metrics[name]), np.abs(fine.metrics[name] - values), np.inf)
            estimated[name] = np.where(np.isfinite(values), MARGIN * changes, np.nan)
    status = np.where(runs.is_completed, COMPLETED, DIVERGED).astype(np.int8)
    # Runs that were refused are in no batch, so that until here they count as diverged.
    status[list(plan.reasons)] = REFUSED
    reasons = dict(plan.reasons)
    for run in np.flatnonzero(status == DIVERGED).tolist():
        remedy = TOO_MANY_PARTS if runs.too_many_parts[run] else REMEDY
        reasons[run] = f"diverged at t = {runs.failure_time[run]:.6g} s; {remedy}"
    return EnsembleResult(
        status=status,
        failure_time=runs.failure_time,
        reasons=dict(sorted(reasons.items())),
        metrics=runs.metrics,
        times=times,
        traces=runs.traces,
        errors=estimated,
    )


def _check_channel(base: Scenario, name: str) -> None:
    if name not in TRACED:
        raise ScenarioError(f"{base.name}: the channel '{name}' cannot be traced{_hint(name, TRACED)}")
    controlled = next((kind.name for kind in CONTROLLED.values() if kind.reference == name), base.controlled)
    if controlled != base.controlled:
        raise ScenarioError(f"{base.name}: '{name}' cannot be traced: reference.of = '{base.controlled}'")
    if name == CONTROLLED[controlled].reference and base.controller.is_open_loop:
        raise ScenarioError(f"{base.name}: '{name}' cannot be traced: a constant command has no reference")
    if name in OF_SECOND_CHAMBER and base.device.actuator.has_one_chamber:
        raise ScenarioError(f"{base.name}: '{name}' cannot be traced: {base.device.name} has only one chamber")
    if name.startswith("temperature_") and base.gas_model is None:
        raise ScenarioError(f"{base.name}: '{name}' needs an energy balance: gas_model.kind = 'thermal'")


def _hint(name: str, known: Mapping[str, object]) -> str:
    return nearest_name(name, known) or f"; available: {', '.join(known)}"
