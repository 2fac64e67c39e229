"""Configurations side by side: each as it is, and all of them over the same uncertain values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.analyses.compare.answer import Case, Compared, OnTask, finding_of, front_of, remarks_of
from ppafo.analyses.compare.pairs import COMPARED, Paired, best_probabilities, compare_pairs
from ppafo.errors import StudyError
from ppafo.metrics import METRICS
from ppafo.progress import Report
from ppafo.report.finding import Finding
from ppafo.report.kind import Interval
from ppafo.simulation.ensemble.running import lacking
from ppafo.simulation.numbers import number_at
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate_many
from ppafo.studies.draws import (
    Uncertainty,
    check_confidence,
    check_draws,
    check_fraction,
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
from ppafo.study.runs import Rows, Runs, Tally, failures_of

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
) -> Finding[Compared]:
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
    drawn = [_UNDRAWN] * len(placed)
    if drawing is not None:
        drawn = _runs(placed, metrics, drawing, threads, progress)
    results = simulate_many([place.scenario for place in placed], threads)
    cases = [
        (
            place.task,
            Case(
                place.configuration,
                result.status,
                {name: metric for name, metric in result.metrics.items() if name in COMPARED},
                0 if rows is None else failures_of(rows),
                reason,
                place.scenario,
                rows,
                renoised,
            ),
        )
        for place, result, (rows, renoised, reason) in zip(placed, results, drawn, strict=True)
    ]
    found = Compared(
        units="SI: N m, kg, J; fractions from 0 to 1",
        configurations=list(names),
        baseline=reference,
        draws=drawing.draws if drawing is not None else 0,
        seed=drawing.seed if drawing is not None else 0,
        remarks=[],
        varied=[path for path in drawing.uncertainty.paths if path != NOISE] if drawing is not None else [],
        confidence=confidence,
        tasks=[
            _on_task(task, texts, [case for name, case in cases if name == task], reference, metrics, confidence)
            for task, texts in wanted.items()
        ],
        metrics=metrics,
    )
    return finding_of(replace(found, remarks=remarks_of(found, found.tasks)))


def _on_task(
    task: str, overrides: Sequence[str], cases: list[Case], baseline: str, metrics: Sequence[str], confidence: float
) -> OnTask:
    """Return the cases of a task with their statistics."""
    first = next(case for case in cases if case.configuration == baseline)
    others = [case for case in cases if case is not first]
    pairs = {case.configuration: _pairs(first, case, metrics, confidence) for case in others}
    best: dict[str, dict[str, Interval]] = {}
    rows = [case.rows for case in cases if case.rows is not None]
    for name in metrics if rows else ():
        if COMPARED[name]:
            shares = best_probabilities([each[name] for each in rows], COMPARED[name], confidence)
            best[name] = dict(zip([case.configuration for case in cases], shares, strict=False))
    return OnTask(task, list(overrides), cases, front_of(cases), pairs, best)


def _pairs(first: Case, other: Case, metrics: Sequence[str], confidence: float) -> list[Paired]:
    """Return the statistics of a configuration against the baseline; none without draws."""
    if first.rows is None or other.rows is None:
        return []
    found = []
    for name in metrics:
        again = None
        if first.renoised is not None and other.renoised is not None:
            again = (first.renoised[name], other.renoised[name])
        found.append(compare_pairs(name, first.rows[name], other.rows[name], COMPARED[name], confidence, again))
    return [item for item in found if item is not None]


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
Drawn = tuple[Rows | None, Rows | None, str]
"""The runs of a case over the draws, the first of them again with other noise, and why the first failed."""
_UNDRAWN: Drawn = (None, None, "")


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


def _runs(
    placed: Sequence[ConfiguredTask],
    metrics: Sequence[str],
    drawing: _Drawing,
    threads: int | None,
    progress: Report | None,
) -> list[Drawn]:
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
    found: list[Drawn] = []
    for place in placed:
        name = place.configuration
        runs = Runs(place.scenario, metrics, tally, drawing.uncertainty.gauge, threads)
        own = {path: column for path, column in columns.items() if drawing.varies(path, name)}
        unchanged = {"supply.pressure": np.full(drawing.draws, place.scenario.device.supply.pressure)}
        rows = runs.run(own or unchanged)
        runs.check(rows, drawing.maximum_failed, f"configuration '{name}', task '{place.task}'")
        reason = runs.reason
        found.append((rows, runs.run({path: again[path] for path in own}) if again else None, reason))
    return found
