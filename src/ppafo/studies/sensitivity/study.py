"""Sensitivity over the distributions of a study file."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ppafo.errors import StudyError, nearest_name
from ppafo.studies.sensitivity.analyse import Sensitivity, Settings, analyse
from ppafo.studies.sensitivity.methods import METHODS
from ppafo.studies.sweep.study import Study
from ppafo.studies.uncertainty.draws import chosen_configuration, study_of, uncertainty_in
from ppafo.studies.uncertainty.outcomes import Tally, Watch, scenario_model

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
    most_failed: float = 0.02,
    threads: int | None = None,
    watch: Watch | None = None,
) -> Sensitivity:
    """Return the sensitivity of metrics with regard to everything that has a distribution in a study.

    ``method`` is a name in ``METHODS``; unless given Shapley effects where values are correlated, else Sobol indices.
    ``metrics`` are those of the study unless given; ``samples`` trajectories, base points or orders (8192 for Sobol,
    128 for Morris, 2048 for Shapley). ``independent`` leaves the correlations of the study out. Noise of the sensors is
    one of the values. StudyError for bad input, where SALib is missing, and where more than the share ``most_failed``
    of the runs fails; of fewer, whole blocks are left out and counted.
    """
    if method is not None and method not in METHODS:
        raise StudyError(
            f"there is no method '{method}'{nearest_name(method, METHODS)}; known are {', '.join(METHODS)}"
        )
    chosen = study_of(study, overrides)
    base = chosen_configuration(chosen, configuration)
    known = uncertainty_in(chosen, base)
    used = (replace(known, scores=None) if independent else known).hearing([base.scenario])
    by = METHODS[method or ("sobol" if used.scores is None else "shapley")]
    asked = tuple(metrics) or chosen.outputs.metrics
    if not asked:
        raise StudyError(f"study '{chosen.name}' keeps no metrics; name the one that is asked about")
    count = DEFAULT_SAMPLES[by.name] if samples is None else samples
    settings = Settings(count, chosen.sample.seed if seed is None else seed, confidence, most_failed)
    tally = Tally(count * by.block_rows(len(used.drawn)), watch)
    model = scenario_model(base.scenario, asked, threads, tally.add)
    return replace(analyse(model, used, asked, by, settings), name=f"{chosen.name}, {base.name}")
