"""Configurations side by side: each as it is, and all of them over the same uncertain values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.errors import StudyError
from ppafo.metrics import METRICS
from ppafo.progress import Report
from ppafo.questions.compare.answer import COMPARED, Case, Comparison
from ppafo.simulation.ensemble.running import lacking
from ppafo.simulation.numbers import number_at
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate_many
from ppafo.studies.draws import (
    Outcomes,
    Tally,
    Uncertainty,
    check_confidence,
    check_draws,
    check_failures,
    check_fraction,
    scenario_model,
    study_of,
    uncertainty_of,
    with_new_noise,
)
from ppafo.studies.sampling import NOISE
from ppafo.studies.study import (
    Configurations,
    ConfiguredTask,
    Study,
    choose_configurations,
    valid_baseline,
    with_overrides,
)

AS_WRITTEN = "as written"
"""What the task of a configuration is called where no other is requested."""
DEFAULT_DRAWS = 4096
FEWEST_DRAWS = 32
DEFAULT_SEED = 1
NOISE_DRAWS = 512
"""Draws that are run once more with other noise, at most."""
Source = Study | str | Path | Mapping[str, Any]


def compare(
    configurations: Configurations | None = None,
    study: Source | None = None,
    tasks: Mapping[str, Sequence[str]] | Sequence[tuple[str, Sequence[str]]] = (),
    overrides: Sequence[str] = (),
    baseline: str | None = None,
    draws: int = DEFAULT_DRAWS,
    seed: int | None = None,
    confidence: float = 0.95,
    maximum_failed: float = 0.01,
    threads: int | None = None,
    progress: Report | None = None,
) -> Comparison:
    """Compare configurations on tasks, and over the distributions of a study with common random numbers.

    ``configurations`` are scenarios by name (or a list of names, files or Scenario objects); those of the study by
    default. ``study`` is a study file, name or Study, whose distributions hold in all of them. ``tasks`` has
    overrides by name, such as ``{"slow": ["reference.ramp_time=2 s"]}``; ``overrides`` change every configuration.
    ``baseline`` is the configuration that all others are compared with, by default the first. Draws are randomised
    Sobol replicates whatever the study's sampling method; where a controller receives noise, each has a noise stream of
    its own, the same in all configurations, and without a study the noise alone is drawn. StudyError for bad input and
    where more than the fraction ``maximum_failed`` of a configuration's runs fails; fewer are left out in pairs.
    """
    check_draws(draws, FEWEST_DRAWS)
    check_confidence(confidence)
    known = study_of(study) if study is not None else None
    chosen = choose_configurations(configurations or None, known, overrides)
    names = tuple(item.name for item in chosen)
    reference = valid_baseline(baseline, names)
    wanted = _tasks(tasks)
    placed = [
        ConfiguredTask(task, item.name, with_overrides(item.scenario, texts))
        for task, texts in wanted.items()
        for item in chosen
    ]
    # Those metrics of the table that all scenarios can have: without a reference there is no error.
    scenarios = [place.scenario for place in placed]
    metrics = tuple(name for name in COMPARED if not any(lacking(scenario, METRICS[name]) for scenario in scenarios))
    drawing = _drawing(known, placed, draws, seed, check_fraction(maximum_failed, "maximum_failed"))
    outcomes = (
        _outcomes(placed, metrics, drawing, threads, progress) if drawing is not None else [_UNDRAWN] * len(placed)
    )
    results = simulate_many([place.scenario for place in placed], threads)
    return Comparison(
        metrics=metrics,
        configurations=names,
        baseline=reference,
        tasks=wanted,
        cases=tuple(
            Case(place.task, place.configuration, place.scenario, result.metrics, result.status, *runs)
            for place, result, runs in zip(placed, results, outcomes, strict=True)
        ),
        draws=drawing.draws if drawing is not None else 0,
        seed=drawing.seed if drawing is not None else 0,
        varied=tuple(path for path in drawing.uncertainty.paths if path != NOISE) if drawing is not None else (),
        confidence=confidence,
    )


def _tasks(tasks: Mapping[str, Sequence[str]] | Sequence[tuple[str, Sequence[str]]]) -> dict[str, tuple[str, ...]]:
    """Return the overrides of each task by its name; as the scenarios are written where there is none."""
    pairs = list(tasks.items() if isinstance(tasks, Mapping) else tasks) or [(AS_WRITTEN, ())]
    names = [name for name, _ in pairs]
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated is not None:
        raise StudyError(f"there are two tasks named '{repeated}'; give each its own name")
    return {name: tuple(texts) for name, texts in pairs}


_SAME = 1.0e-9
"""Values that differ by less than this fraction are one."""
_UNDRAWN = (None, None)


@dataclass(frozen=True, slots=True)
class _Drawing:
    """What is drawn: distributions, where they hold, number of draws, random seed, fraction that may fail."""

    study: Study | None
    uncertainty: Uncertainty
    draws: int
    seed: int
    maximum_failed: float

    def varies(self, path: str, configuration: str) -> bool:
        """Tell whether a path is drawn in a configuration; the noise is in all of them."""
        return self.study is None or path == NOISE or self.study.varies(path, configuration)


def _drawing(
    study: Study | None, placed: Sequence[ConfiguredTask], draws: int, seed: int | None, maximum_failed: float
) -> _Drawing | None:
    """Return what is drawn; None without a study, or where nothing in it varies, if no controller receives noise."""
    known = Uncertainty(()) if study is None or not study.paths else uncertainty_of(study)
    uncertainty = known.with_noise_of([place.scenario for place in placed])
    if not uncertainty.drawn:
        return None
    usual = study.sample.seed if study is not None else DEFAULT_SEED
    return _Drawing(study, uncertainty, draws, usual if seed is None else seed, maximum_failed)


def _value_at(path: str, scenario: Scenario) -> float | None:
    try:
        return number_at(scenario, path)
    except (AttributeError, KeyError, TypeError):
        return None


def _outcomes(
    placed: Sequence[ConfiguredTask],
    metrics: Sequence[str],
    drawing: _Drawing,
    threads: int | None,
    progress: Report | None,
) -> list[tuple[Outcomes, Outcomes | None]]:
    """Return the runs of every case, all over the same draws, and the first of them again with other noise."""
    if drawing.study is not None:
        # Refuse cases that differ in a value that the study draws for all of them: the difference would not count.
        shared = [path for path in drawing.study.paths if not path.startswith("valve.") and path != NOISE]
        for path in shared:
            places = [place for place in placed if drawing.study.varies(path, place.configuration)]
            values = [value for place in places if (value := _value_at(path, place.scenario)) is not None]
            lowest, highest = min(values, default=0.0), max(values, default=0.0)
            if highest - lowest > _SAME * max(abs(lowest), abs(highest)):
                raise StudyError(
                    f"the study draws '{path}' for every configuration, so the different values of the configurations "
                    f"({lowest:.6g} and {highest:.6g} in SI units) would be ignored; use a study that does not draw it"
                )
    columns = drawing.uncertainty.replicated_columns(0, drawing.draws, drawing.seed)
    again = with_new_noise(columns, NOISE_DRAWS) if drawing.uncertainty.has_noise else {}
    tally = Tally((drawing.draws + (min(NOISE_DRAWS, drawing.draws) if again else 0)) * len(placed), progress)
    found: list[tuple[Outcomes, Outcomes | None]] = []
    for place in placed:
        name = place.configuration
        model = scenario_model(place.scenario, metrics, threads, tally.add, drawing.uncertainty.gauge)
        own = {path: column for path, column in columns.items() if drawing.varies(path, name)}
        unchanged = {"supply.pressure": np.full(drawing.draws, place.scenario.device.supply.pressure)}
        outcomes = model(own or unchanged)
        check_failures(outcomes, drawing.maximum_failed, f"configuration '{name}', task '{place.task}'")
        found.append((outcomes, model({path: again[path] for path in own}) if again else None))
    return found
