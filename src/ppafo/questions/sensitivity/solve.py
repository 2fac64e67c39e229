"""Sensitivity over the distributions of a study file."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ppafo.errors import StudyError, nearest_name
from ppafo.progress import Report
from ppafo.questions.sensitivity.analyse import Sensitivity, Settings, analyse
from ppafo.questions.sensitivity.methods import METHODS
from ppafo.studies.draws import choose_configuration, study_of, uncertainty_in
from ppafo.studies.outcomes import Tally, scenario_model
from ppafo.studies.study import Study

DEFAULT_SAMPLES = {"sobol": 8192, "morris": 128, "shapley": 2048}


def sensitivity(
    study: Study | str | Path | Mapping[str, Any],
    method: str | None = None,
    metrics: Sequence[str] = (),
    samples: int | None = None,
    configuration: str | None = None,
    overrides: Sequence[str] = (),
    independent: bool = False,
    seed: int | None = None,
    confidence: float = 0.95,
    maximum_failed: float = 0.02,
    threads: int | None = None,
    progress: Report | None = None,
) -> Sensitivity:
    """Return the sensitivity of metrics with regard to everything that has a distribution in a study.

    ``method`` is a name in ``METHODS``; by default Shapley effects where values are correlated, else Sobol indices.
    ``metrics`` are those of the study by default; ``samples`` trajectories, base points or orders (8192 for Sobol,
    128 for Morris, 2048 for Shapley). ``independent`` leaves the correlations of the study out. Noise of the sensors is
    one of the values. StudyError for bad input, where SALib is missing, and where more than the fraction
    ``maximum_failed`` of the runs fails; of fewer, whole blocks are left out and counted.
    """
    if method is not None and method not in METHODS:
        raise StudyError(
            f"there is no method '{method}'{nearest_name(method, METHODS)}; available: {', '.join(METHODS)}"
        )
    chosen = study_of(study, overrides)
    base = choose_configuration(chosen, configuration)
    known = uncertainty_in(chosen, base)
    used = (replace(known, scores=None) if independent else known).with_noise_of([base.scenario])
    by = METHODS[method or ("sobol" if used.scores is None else "shapley")]
    requested = tuple(metrics) or chosen.outputs.metrics
    if not requested:
        raise StudyError(f"study '{chosen.name}' keeps no metrics; name the metric to analyse")
    count = DEFAULT_SAMPLES[by.name] if samples is None else samples
    settings = Settings(count, chosen.sample.seed if seed is None else seed, confidence, maximum_failed)
    tally = Tally(count * by.block_rows(len(used.drawn)), progress)
    model = scenario_model(base.scenario, requested, threads, tally.add, used.gauge)
    return replace(analyse(model, used, requested, by, settings), name=f"{chosen.name}, {base.name}")
