"""Runs of a function of the columns in place of a scenario."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ppafo.studies.distributions import Floats
from ppafo.study.runs import FAILED, Rows, RunCounter, Runs


def model_runs(model: Callable[[Mapping[str, Floats]], Mapping[str, Any]], metrics: Sequence[str]) -> Runs:
    """Runs of a model; one without a finite metric has failed."""

    def evaluate(columns: Mapping[str, Floats]) -> tuple[Rows, str]:
        rows = {name: np.asarray(values) for name, values in model(columns).items()}
        failed = rows.get(FAILED, ~np.any([np.isfinite(rows[name]) for name in metrics], axis=0))
        return {**rows, FAILED: failed}, "diverged" if failed.any() else ""

    return Runs(evaluate, metrics, RunCounter(1, None), 16_384)
