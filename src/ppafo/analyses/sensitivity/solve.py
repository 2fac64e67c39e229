"""Sensitivity of metrics to the distributions of a study, for growing sample sizes.

Failed runs: the analysis is refused if more than a given fraction of all runs has no value, because the indices would
describe only the remaining ones. Otherwise every block (base point or order) with such a run is left out and counted,
since the formulas need complete blocks; the indices then hold for values at which the model runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ppafo.analyses.sensitivity.methods import EvaluatedBlocks, Indices, Method, changes
from ppafo.errors import StudyError
from ppafo.linear_algebra import on_one_thread
from ppafo.simulation.gains import remark_on_following_gains
from ppafo.simulation.numbers import NOISE_SEED
from ppafo.simulation.scenario import Scenario
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import Uncertainty
from ppafo.studies.limits import CONFIDENCE, check_fraction
from ppafo.study.runs import Runs, tracking_violation
from ppafo.wording import argument_text

_ENDS = (0.05, 0.95)
"""Quantiles of a varied value between which the change of a metric is computed."""
DEFAULT_SAMPLES = {"sobol": 8192, "shapley": 2048}
"""Default number of blocks by method: tens of thousands of runs for a few values."""
_FEWEST_WHOLE = 4
"""Smallest number of complete blocks for an estimate."""
_SIZES = 6
"""Number of sample sizes at which the indices are shown: all blocks, and repeated halves."""


@dataclass(frozen=True, slots=True)
class SensitivitySettings:
    """Number of blocks, random seed, confidence level of the bands, maximum fraction of failed runs."""

    samples: int
    seed: int = 1
    confidence: float = 0.95
    maximum_failed: float = 0.02


@dataclass(frozen=True, slots=True)
class IndexConvergence:
    """Sensitivity indices of a metric from the first blocks of the sample.

    ``blocks``: number of blocks
    ``used``: number of blocks without a missing value
    ``indices``, ``bands``: indices and half widths of their bands, by name
    """

    blocks: int
    used: int
    indices: dict[str, list[float]]
    bands: dict[str, list[float]]


@dataclass(frozen=True, slots=True)
class MetricSensitivity:
    """Sensitivity of a metric at growing sample sizes.

    ``mean``, ``standard_deviation``: over all runs [SI]
    ``change_from_5_to_95_percent``: signed change of the metric from the 5 to the 95 % quantile of each value [SI], nan
        for noise
    ``band_of_change``: half width of the band of this change [SI]
    ``settling``: indices at growing sample sizes; the last is the result
    """

    metric: str
    mean: float
    standard_deviation: float
    runs_without_value: int
    change_from_5_to_95_percent: list[float]
    band_of_change: list[float]
    settling: list[IndexConvergence]

    @property
    def indices(self) -> Indices:
        """Sensitivity indices of the metric from all blocks."""
        last = self.settling[-1]
        values, bands = (
            {name: np.array(numbers) for name, numbers in by_name.items()} for by_name in (last.indices, last.bands)
        )
        return Indices(values, bands)

    @property
    def dropped_blocks(self) -> int:
        """Number of blocks left out because of a failed run."""
        return self.settling[-1].blocks - self.settling[-1].used


@dataclass(frozen=True, slots=True)
class Influences:
    """Sensitivity indices of metrics with respect to uncertain values.

    ``paths``: paths of the uncertain values
    ``runs``, ``failed``: number of runs, and of failed runs
    ``not_following``: number of completed runs that do not follow their reference
    ``gains``: remarks on controller gains that follow the uncertain values or are kept from another kind; or empty
    """

    study: str
    method: str
    settings: SensitivitySettings
    paths: list[str]
    runs: int
    failed: int
    not_following: int
    policy: str
    metrics: list[MetricSensitivity]
    gains: tuple[str, ...] = ()


_POLICY = "above the maximum fraction refused; below, every block with a failed run is left out"


@on_one_thread
def analyse(
    runs: Runs,
    uncertainty: Uncertainty,
    method: Method,
    settings: SensitivitySettings,
    study: str = "",
    scenario: Scenario | None = None,
    metrics: Sequence[str] = (),
) -> Influences:
    """Return the sensitivity indices of metrics.

    ``scenario`` is the scenario of the runs, None for a model; ``metrics`` are the metrics to analyse, () for all.
    Raises StudyError for invalid settings, dependent values or too many failures.
    """
    if uncertainty.scores is not None and not method.takes_dependent:
        raise StudyError(
            f"sensitivity: {method.name} assumes independent values, but the study has [[correlations]]; use "
            f"{argument_text('method', 'shapley')}, or ignore the correlations with {argument_text('independent')}"
        )
    if len(uncertainty.drawn) < 2:
        raise StudyError("sensitivity: the study has only one uncertain value; vary two or more")
    if not method.fewest <= settings.samples <= method.most:
        raise StudyError(
            f"samples = {settings.samples}: {method.name} needs {method.fewest} to {method.most:,} {method.sizes_label}"
        )
    if settings.seed < 0:
        raise StudyError(f"seed = {settings.seed}: must be 0 or more")
    check_fraction(settings.confidence, *CONFIDENCE)
    check_fraction(settings.maximum_failed, "maximum_failed")
    # Checked before anything runs: a design takes thousands of runs.
    design = method.design(uncertainty, settings.samples, settings.seed)
    columns = uncertainty.columns(design)
    rows = runs.run(columns)
    requested = tuple(metrics) or runs.metrics
    runs.check(rows, settings.maximum_failed, "sensitivity", requested)
    ends = np.array([number.distribution.values(np.array(_ENDS)) for number in uncertainty.drawn]).T
    # A seed has no order: from its 5 to its 95 % quantile nothing changes.
    ends[:, [path == NOISE_SEED for path in uncertainty.paths]] = np.nan
    inputs = np.stack([columns[path] for path in uncertainty.paths], axis=1)
    blocks = np.repeat(np.arange(settings.samples), design.shape[0] // settings.samples)
    # The design of all metrics, without the values of one.
    evaluated = EvaluatedBlocks(
        fractions=design, inputs=inputs, values=np.empty(0), blocks=blocks, ends=ends, seed=settings.seed
    )
    off = 0 if scenario is None else np.count_nonzero(tracking_violation(rows, scenario, columns, uncertainty.gauge))
    return Influences(
        study=study,
        method=method.name,
        settings=settings,
        paths=list(uncertainty.paths),
        runs=runs.count,
        failed=runs.failures,
        not_following=int(off),
        policy=_POLICY,
        metrics=[_metric_sensitivity(name, rows[name], evaluated, method, settings) for name in requested],
        gains=()
        if scenario is None
        else (remark_on_following_gains(scenario, uncertainty.paths), scenario.origin.replaced),
    )


def _metric_sensitivity(
    name: str, values: Floats, design: EvaluatedBlocks, method: Method, settings: SensitivitySettings
) -> MetricSensitivity:
    """Return the sensitivity of a metric with ``values`` (rows,), for growing parts of the sample.

    Raises StudyError if the metric is equal in every run, or if too few blocks are complete.
    """
    known = np.isfinite(values)
    if float(np.ptp(values[known])) == 0.0:
        raise StudyError(
            f"sensitivity: '{name}' is {values[known][0]:g} in every run, so no value influences it; "
            "choose another metric"
        )
    # The formulas need whole blocks: one run without a value takes its block with it.
    is_whole = np.all(known.reshape(settings.samples, -1), axis=1)
    # All blocks, and halves, and halves of halves, as far as they say something: many of the first may be left out, and
    # a metric that counts may be the same in all.
    halved = {settings.samples >> halvings for halvings in range(_SIZES)}
    sizes = []
    for size in sorted({size for size in halved if size >= method.fewest} | {settings.samples}):
        complete = values.reshape(settings.samples, -1)[:size][is_whole[:size]]
        if len(complete) >= _FEWEST_WHOLE and float(np.ptp(complete)) > 0.0:
            sizes.append(size)
    if settings.samples not in sizes:
        raise StudyError(
            f"sensitivity: only {int(np.count_nonzero(is_whole)):,} of {is_whole.size:,} {method.sizes_label} "
            f"have '{name}' in all their runs; use more samples, or correct the runs that fail"
        )
    settling = []
    for size in sizes:
        complete_blocks = np.flatnonzero(is_whole[:size])
        estimated = method.indices(_part_of(design, values, complete_blocks), settings.confidence)
        indices, bands = (
            {name: numbers.tolist() for name, numbers in by_name.items()}
            for by_name in (estimated.values, estimated.bands)
        )
        settling.append(IndexConvergence(blocks=size, used=complete_blocks.size, indices=indices, bands=bands))
    change, band = changes(_part_of(design, values, np.flatnonzero(is_whole)), settings.confidence)
    return MetricSensitivity(
        metric=name,
        mean=float(np.mean(values[known])),
        standard_deviation=float(np.std(values[known], ddof=1)),
        runs_without_value=int(np.count_nonzero(~known)),
        change_from_5_to_95_percent=change.tolist(),
        band_of_change=band.tolist(),
        settling=settling,
    )


def _part_of(design: EvaluatedBlocks, values: Floats, blocks: NDArray[np.intp]) -> EvaluatedBlocks:
    """Return the rows of the given blocks of a design, with the values of a metric."""
    rows = np.flatnonzero(np.isin(design.blocks, blocks))
    return replace(
        design, fractions=design.fractions[rows], inputs=design.inputs[rows], values=values[rows], blocks=blocks
    )
