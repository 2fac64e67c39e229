"""Runs of a function of the columns in place of a scenario."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ppafo.loading import load_scenario
from ppafo.studies.distributions import Floats
from ppafo.study.runs import FAILED, Rows, RunCounter, Runs, verdicts


def model_runs(model: Callable[[Mapping[str, Floats]], Mapping[str, Any]], metrics: Sequence[str]) -> Runs:
    """Runs of a model without verdicts; one without a finite metric has failed."""

    def evaluate(columns: Mapping[str, Floats]) -> Rows:
        rows = {name: np.asarray(values) for name, values in model(columns).items()}
        failed = rows.get(FAILED, ~np.any([np.isfinite(rows[name]) for name in metrics], axis=0))
        rows |= verdicts({}, load_scenario("torque-task-proportional"), columns)
        judged = {f"judged_{name}": rows[name] for name in metrics}
        return {**rows, **judged, FAILED: failed, "reason": np.where(failed, "diverged", None)}

    return Runs(evaluate, RunCounter(1, None), 16_384)
