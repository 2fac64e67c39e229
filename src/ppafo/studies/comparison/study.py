"""Configurations side by side: each as it is, and all of them over the same uncertain values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.errors import StudyError
from ppafo.metrics import Metric
from ppafo.simulation.numbers import number_at
from ppafo.simulation.result import Status
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import simulate_many
from ppafo.studies.comparison.compared import COMPARED, compared_metrics
from ppafo.studies.comparison.configurations import (
    Configurations,
    Placed,
    checked_baseline,
    chosen_configurations,
    with_overrides,
)
from ppafo.studies.comparison.paired import Paired, best_shares, paired
from ppafo.studies.sweep.noise import NOISE
from ppafo.studies.sweep.sampling.distributions import Floats
from ppafo.studies.sweep.study import Study
from ppafo.studies.uncertainty.draws import Uncertainty, renoised, study_of, uncertainty_of
from ppafo.studies.uncertainty.intervals import Interval
from ppafo.studies.uncertainty.outcomes import (
    Outcomes,
    Tally,
    Watch,
    check_confidence,
    check_draws,
    check_failures,
    check_share,
    scenario_model,
)

AS_WRITTEN = "as written"
"""What the task of a configuration is called where no other is asked for."""
DEFAULT_DRAWS = 4096
FEWEST_DRAWS = 32
DEFAULT_SEED = 1
NOISE_DRAWS = 512
"""Draws that are run once more with other noise, at most."""

Source = Study | str | Path | Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Case:
    """A configuration on a task: its metrics by name, how the run ended, and its runs over the draws, if any.

    ``renoised`` are the first draws again, each with another noise stream; None where no controller hears noise.
    """

    task: str
    configuration: str
    scenario: Scenario
    metrics: Mapping[str, Metric]
    status: Status
    outcomes: Outcomes | None
    renoised: Outcomes | None = None


@dataclass(frozen=True, slots=True)
class Comparison:
    """All cases, task by task in the order of the configurations, one of which is the ``baseline``.

    ``draws`` is 0 without uncertainty; ``varied`` are the uncertain paths but the noise; ``confidence`` is that of
    the intervals.
    """

    metrics: tuple[str, ...]
    configurations: tuple[str, ...]
    baseline: str
    tasks: Mapping[str, tuple[str, ...]]
    cases: tuple[Case, ...]
    draws: int
    seed: int
    varied: tuple[str, ...]
    confidence: float

    def of_task(self, task: str) -> tuple[Case, ...]:
        """Return the cases of a task."""
        return tuple(case for case in self.cases if case.task == task)

    def pairs(self, task: str, configuration: str) -> list[Paired]:
        """Return the statistics of a configuration against the baseline on a task; none without uncertainty."""
        baseline, other = (self._case(task, name) for name in (self.baseline, configuration))
        first, second = baseline.outcomes, other.outcomes
        if first is None or second is None:
            return []
        again: dict[str, tuple[Floats, Floats]] = {}
        if baseline.renoised is not None and other.renoised is not None:
            sides = (baseline.renoised.metrics, other.renoised.metrics)
            again = {name: (sides[0][name], sides[1][name]) for name in self.metrics}
        found = [
            paired(name, first.metrics[name], second.metrics[name], COMPARED[name], self.confidence, again.get(name))
            for name in self.metrics
        ]
        return [item for item in found if item is not None]

    def best(self, task: str, metric: str) -> dict[str, Interval]:
        """Return the probability of each configuration to be the best in a metric on a task."""
        drawn = [self._case(task, name).outcomes for name in self.configurations]
        values: list[Floats] = [item.metrics[metric] for item in drawn if item is not None]
        if len(values) < len(drawn) or not COMPARED[metric]:
            return {}
        return dict(zip(self.configurations, best_shares(values, COMPARED[metric], self.confidence), strict=False))

    def _case(self, task: str, configuration: str) -> Case:
        return next(case for case in self.of_task(task) if case.configuration == configuration)


def compare(
    configurations: Configurations | None = None,
    uncertainty: Source | None = None,
    tasks: Mapping[str, Sequence[str]] | None = None,
    overrides: Sequence[str] = (),
    baseline: str | None = None,
    draws: int = DEFAULT_DRAWS,
    seed: int | None = None,
    confidence: float = 0.95,
    most_failed: float = 0.01,
    threads: int | None = None,
    watch: Watch | None = None,
) -> Comparison:
    """Compare configurations on tasks, and over the distributions of a study with common random numbers.

    ``configurations`` are scenarios by name (or a list of names, files or Scenario objects); those of the study unless
    given. ``uncertainty`` is a study file, name or Study, whose distributions hold in all of them. ``tasks`` has
    overrides by name, such as ``{"slow": ["reference.ramp_time=2 s"]}``; ``overrides`` change every configuration.
    ``baseline`` is the configuration that all others are held against, the first unless given. Draws are randomised
    Sobol replicates whatever the study's sampling method; where a controller hears noise, each has a noise stream of
    its own, the same in all configurations, and without a study the noise alone is drawn. StudyError for bad input and
    where more than the share ``most_failed`` of a configuration's runs fails; fewer are left out in pairs.
    """
    check_draws(draws, FEWEST_DRAWS)
    check_confidence(confidence)
    study = study_of(uncertainty) if uncertainty is not None else None
    chosen = chosen_configurations(configurations, study, overrides)
    names = tuple(item.name for item in chosen)
    held_against = checked_baseline(baseline, names)
    wanted = {name: tuple(texts) for name, texts in (tasks or {AS_WRITTEN: ()}).items()}
    placed = [
        Placed(task, item.name, with_overrides(item.scenario, texts))
        for task, texts in wanted.items()
        for item in chosen
    ]
    metrics = compared_metrics([place.scenario for place in placed])
    drawing = _drawing(study, placed, draws, seed, check_share(most_failed, "most_failed"))
    outcomes = _outcomes(placed, metrics, drawing, threads, watch) if drawing is not None else [_UNDRAWN] * len(placed)
    results = simulate_many([place.scenario for place in placed], threads)
    return Comparison(
        metrics=metrics,
        configurations=names,
        baseline=held_against,
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


_SAME = 1.0e-9
"""Values that differ by less than this share are one."""
_UNDRAWN = (None, None)


@dataclass(frozen=True, slots=True)
class _Drawing:
    """What is drawn: distributions, which of them hold where, how many draws, their seed, the share that may fail."""

    study: Study | None
    uncertainty: Uncertainty
    draws: int
    seed: int
    most_failed: float

    def varies(self, path: str, configuration: str) -> bool:
        """Tell whether a path is drawn in a configuration; the noise is in all of them."""
        return self.study is None or path == NOISE or self.study.varies(path, configuration)


def _drawing(
    study: Study | None, placed: Sequence[Placed], draws: int, seed: int | None, most_failed: float
) -> _Drawing | None:
    """Return what is drawn; None without a study, or where nothing in it varies, if no controller hears noise."""
    known = Uncertainty(()) if study is None or not study.paths else uncertainty_of(study)
    uncertainty = known.hearing([place.scenario for place in placed])
    if not uncertainty.drawn:
        return None
    usual = study.sample.seed if study is not None else DEFAULT_SEED
    return _Drawing(study, uncertainty, draws, usual if seed is None else seed, most_failed)


def _check_set_or_drawn(placed: Sequence[Placed], study: Study) -> None:
    """Refuse cases that differ in a value that the study draws for all of them: the difference would not count."""
    shared = [path for path in study.paths if not path.startswith("valve.") and path != NOISE]
    for path in shared:
        places = [place for place in placed if study.varies(path, place.configuration)]
        values = [value for place in places if (value := _value_at(path, place.scenario)) is not None]
        lowest, highest = min(values, default=0.0), max(values, default=0.0)
        if highest - lowest > _SAME * max(abs(lowest), abs(highest)):
            raise StudyError(
                f"the study draws '{path}' for every configuration, so values that differ ({lowest:.6g} and "
                f"{highest:.6g} in SI units) would not count; take a study that does not draw it"
            )


def _value_at(path: str, scenario: Scenario) -> float | None:
    try:
        return number_at(scenario, path)
    except (AttributeError, KeyError, TypeError):
        return None


def _outcomes(
    placed: Sequence[Placed], metrics: Sequence[str], drawing: _Drawing, threads: int | None, watch: Watch | None
) -> list[tuple[Outcomes, Outcomes | None]]:
    """Return the runs of every case, all over the same draws, and the first of them again with other noise."""
    if drawing.study is not None:
        _check_set_or_drawn(placed, drawing.study)
    columns = drawing.uncertainty.replicated_columns(0, drawing.draws, drawing.seed)
    again = renoised(columns, NOISE_DRAWS) if drawing.uncertainty.has_noise else {}
    tally = Tally((drawing.draws + (min(NOISE_DRAWS, drawing.draws) if again else 0)) * len(placed), watch)
    found: list[tuple[Outcomes, Outcomes | None]] = []
    for place in placed:
        name = place.configuration
        model = scenario_model(place.scenario, metrics, threads, tally.add)
        own = {path: column for path, column in columns.items() if drawing.varies(path, name)}
        unchanged = {"supply.pressure": np.full(drawing.draws, place.scenario.device.supply.pressure)}
        outcomes = model(own or unchanged)
        check_failures(outcomes, drawing.most_failed, f"configuration '{name}', task '{place.task}'")
        found.append((outcomes, model({path: again[path] for path in own}) if again else None))
    return found
