"""Sensitivity of a model's metrics: the design is run once, and its beginnings show how the indices settle.

Policy for runs that fail: where more than a fraction of all runs has no value it is refused, because the indices
would be those of the survivors. Otherwise every block (trajectory or base point) with such a run is left out whole,
since the formulas need whole blocks, and counted; the indices then hold for values with which the model runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ppafo.answers import Solved
from ppafo.errors import StudyError
from ppafo.questions.sensitivity.methods import TAIL, Evaluated, Indices, Method
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import Uncertainty
from ppafo.studies.noise import NOISE
from ppafo.studies.outcomes import Model, Outcomes, check_confidence, check_failures, check_fraction

_ENDS = (TAIL, 1.0 - TAIL)
_NEGLIGIBLE = 0.01
_FEWEST_WHOLE = 4
_SIZES = 6
"""Sizes at which the indices are shown: all blocks, and halved again and again."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Number of blocks, seed, confidence of the bands, fraction of the runs that may fail."""

    samples: int
    seed: int = 1
    confidence: float = 0.95
    maximum_failed: float = 0.02


@dataclass(frozen=True, slots=True)
class Settling:
    """The indices of one metric from the first ``blocks`` blocks, of which ``used`` had values in all runs."""

    blocks: int
    used: int
    indices: Indices


@dataclass(frozen=True, slots=True)
class OfMetric:
    """The indices of a metric at growing sizes, the last the result. ``mean`` and ``sd`` [SI] are of all runs."""

    metric: str
    settling: tuple[Settling, ...]
    dropped_runs: int
    mean: float
    sd: float

    @property
    def indices(self) -> Indices:
        """The indices from all blocks."""
        return self.settling[-1].indices

    @property
    def dropped_blocks(self) -> int:
        """Number of blocks that were left out."""
        return self.settling[-1].blocks - self.settling[-1].used


@dataclass(frozen=True, slots=True)
class Sensitivity(Solved):
    """Indices of some metrics with regard to some paths; ``runs`` were made, ``failures`` of them failed."""

    method: Method
    settings: Settings
    paths: tuple[str, ...]
    metrics: tuple[OfMetric, ...]
    runs: int
    failures: int
    name: str = ""

    def overlapping_pairs(self, metric: OfMetric) -> list[tuple[str, str]]:
        """Return neighbours in the order of the first index whose bands overlap: which of the two matters more is open.

        Nothing is said of two that both are surely below a hundredth of the largest: neither matters.
        """
        name = self.method.shown[0]
        values, bands = metric.indices.values[name], metric.indices.bands[name]
        order = np.argsort(-values)
        order = order[(values + bands)[order] >= _NEGLIGIBLE * np.max(values)]
        return [
            (self.paths[first], self.paths[second])
            for first, second in pairwise(order)
            if values[first] - bands[first] < values[second] + bands[second]
        ]


def analyse(
    model: Model, uncertainty: Uncertainty, metrics: Sequence[str], method: Method, settings: Settings
) -> Sensitivity:
    """Return the indices of a model's metrics; StudyError for bad settings, dependent values or too many failures."""
    _check(uncertainty, method, settings)
    design = method.design(uncertainty, settings.samples, settings.seed)
    columns = uncertainty.columns(design)
    outcomes = model(columns)
    check_failures(outcomes, settings.maximum_failed, "sensitivity")
    ends = [
        np.array([item.distribution.values(np.array(fraction)) for item in uncertainty.drawn]) for fraction in _ENDS
    ]
    inputs = np.stack([columns[path] for path in uncertainty.paths], axis=1)
    rows = design.shape[0] // settings.samples
    blocks = np.repeat(np.arange(settings.samples), rows)
    whole = Evaluated(design, inputs, np.empty(0), blocks, ends[1] - ends[0], settings.seed)
    found = tuple(_of_metric(name, outcomes, whole, method, settings) for name in metrics)
    paths = tuple(path for path in uncertainty.paths if method.follows_noise or path != NOISE)
    return Sensitivity(method, settings, paths, found, outcomes.runs, outcomes.failures)


def _check(uncertainty: Uncertainty, method: Method, settings: Settings) -> None:
    if uncertainty.scores is not None and not method.takes_dependent:
        raise StudyError(
            f"sensitivity: the indices of {method.name} need values that are independent, and the study has "
            "[[correlations]]; use '--method shapley', or treat the values as independent (--independent)"
        )
    if len(uncertainty.drawn) - (uncertainty.has_noise and not method.follows_noise) < 2:
        raise StudyError("sensitivity: there is only one uncertain value; vary two or more")
    if not method.fewest <= settings.samples <= method.most:
        raise StudyError(
            f"samples = {settings.samples}: {method.name} needs {method.fewest} to {method.most:,} {method.sizes_label}"
        )
    if settings.seed < 0:
        raise StudyError(f"seed = {settings.seed}: must be 0 or more")
    check_confidence(settings.confidence)
    check_fraction(settings.maximum_failed, "maximum_failed")


def _of_metric(name: str, outcomes: Outcomes, design: Evaluated, method: Method, settings: Settings) -> OfMetric:
    values = outcomes.metrics[name]
    known = np.isfinite(values)
    missing = int(np.count_nonzero(~known))
    if missing > settings.maximum_failed * values.size:
        raise StudyError(f"sensitivity: {missing:,} of {values.size:,} runs have no '{name}'; choose another metric")
    if float(np.ptp(values[known])) == 0.0:
        raise StudyError(f"sensitivity: '{name}' is {values[known][0]:g} in every run, so no value influences it")
    rows = values.size // settings.samples
    whole = np.all(known.reshape(-1, rows), axis=1)
    sizes = [size for size in _sizes(whole.size, method.fewest) if _varies(values, whole, size, rows)]
    if whole.size not in sizes:
        raise StudyError(
            f"sensitivity: {int(np.count_nonzero(whole)):,} of {whole.size:,} {method.sizes_label} have '{name}' in "
            "all their runs, which is too few; use more samples, or fix what makes the runs fail"
        )
    return OfMetric(
        name,
        tuple(_settling(design, values, whole, size, method, settings) for size in sizes),
        missing,
        float(np.mean(values[known])),
        float(np.std(values[known], ddof=1)),
    )


def _sizes(blocks: int, fewest: int) -> list[int]:
    sizes = [blocks >> halvings for halvings in range(_SIZES)]
    return sorted({size for size in sizes if size >= fewest} | {blocks})


def _varies(values: Floats, whole: NDArray[np.bool_], size: int, rows: int) -> bool:
    """Tell whether the first blocks say anything: many may be left out, and a metric that counts may be the same."""
    kept = values.reshape(-1, rows)[:size][whole[:size]]
    return len(kept) >= _FEWEST_WHOLE and float(np.ptp(kept)) > 0.0


def _settling(
    design: Evaluated, values: Floats, whole: NDArray[np.bool_], size: int, method: Method, settings: Settings
) -> Settling:
    kept = np.flatnonzero(whole[:size])
    rows = np.flatnonzero(np.isin(design.blocks, kept))
    found = Evaluated(design.fractions[rows], design.inputs[rows], values[rows], kept, design.ranges, design.seed)
    return Settling(size, kept.size, method.indices(found, settings.confidence))
