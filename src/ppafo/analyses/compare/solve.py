"""Configurations side by side: each as it is, and all of them over the same uncertain values."""

from collections.abc import Iterable, Mapping, Sequence

from ppafo.analyses.compare.answer import Case, OnTask, front_of
from ppafo.analyses.compare.pairs import COMPARED, Paired, best_probabilities, compare_pairs
from ppafo.errors import StudyError, first_twice
from ppafo.progress import Report
from ppafo.report.kind import Interval
from ppafo.simulation.scenario import Scenario
from ppafo.studies.draws import Uncertainty
from ppafo.studies.sampling import NOISE, with_new_noise
from ppafo.studies.study import Study
from ppafo.studies.varying import value_at
from ppafo.study.runs import Rows, Runs, Tally, unvaried

AS_WRITTEN = "as written"
"""What the task of a configuration is called where no other is requested."""
DEFAULT_SEED = 1
_SAME = 1.0e-9
"""Values that differ by less than this fraction are one."""


def overrides_by_task(pairs: Iterable[tuple[str, Sequence[str]]]) -> dict[str, Sequence[str]]:
    """Return the overrides of each task by its name; as the scenarios are written where there is none."""
    pairs = list(pairs) or [(AS_WRITTEN, ())]
    repeated = first_twice([name for name, _ in pairs])
    if repeated is not None:
        raise StudyError(f"there are two tasks named '{repeated}'; give each its own name")
    return dict(pairs)


Scenarios = Mapping[tuple[str, str], Scenario]
"""Scenarios by task and configuration."""
_Drawn = tuple[Rows, Rows | None, str]
"""The runs of a case over the draws, the first of them again with other noise, and why the first failed."""


def drawn_runs(
    scenarios: Scenarios,
    metrics: Sequence[str],
    study: Study | None,
    uncertainty: Uncertainty,
    draws: int,
    seed: int,
    maximum_failed: float,
    threads: int | None,
    progress: Report | None,
) -> dict[tuple[str, str], _Drawn]:
    """Return the runs of every case, all over the same draws; nothing where nothing is drawn."""
    if not uncertainty.drawn:
        return {}
    if study is not None:
        _check_same(study, scenarios)
    columns = uncertainty.replicated_columns(0, draws, seed)
    again = with_new_noise(columns) if uncertainty.has_noise else {}
    tally = Tally((draws + len(again.get(NOISE, ()))) * len(scenarios), progress)
    drawn: dict[tuple[str, str], _Drawn] = {}
    for (task, name), scenario in scenarios.items():
        runs = Runs(scenario, metrics, tally, uncertainty.gauge, threads)
        # The noise is in all configurations, whatever a study says of its paths.
        own = [path for path in columns if study is None or path == NOISE or study.varies(path, name)]
        rows = runs.run({path: columns[path] for path in own} or unvaried(scenario, draws))
        runs.check(rows, maximum_failed, f"configuration '{name}', task '{task}'")
        reason = runs.reason
        drawn[task, name] = rows, runs.run({path: again[path] for path in own}) if again else None, reason
    return drawn


def _check_same(study: Study, scenarios: Scenarios) -> None:
    """Refuse cases that differ in a value that the study draws for all of them: the difference would not count."""
    # Orifices of different valves are meant to differ: what the study draws replaces each one's own.
    for path in (path for path in study.paths if not path.startswith("valve.") and path != NOISE):
        own = [value_at(path, scenario) for (_, name), scenario in scenarios.items() if study.varies(path, name)]
        values = [value for value in own if value is not None]
        lowest, highest = min(values, default=0.0), max(values, default=0.0)
        if highest - lowest > _SAME * max(abs(lowest), abs(highest)):
            raise StudyError(
                f"the study draws '{path}' for every configuration, so the different values of the configurations "
                f"({lowest:.6g} and {highest:.6g} in SI units) would be ignored; use a study that does not draw it"
            )


def on_task(
    task: str, overrides: Sequence[str], cases: list[Case], baseline: str, metrics: Sequence[str], confidence: float
) -> OnTask:
    """Return the cases of a task with their statistics."""
    first = next(case for case in cases if case.configuration == baseline)
    pairs: dict[str, list[Paired]] = {case.configuration: [] for case in cases if case is not first}
    for other in cases:
        if other is first or first.rows is None or other.rows is None:
            continue
        for name in metrics:
            again = None
            if first.renoised is not None and other.renoised is not None:
                again = (first.renoised[name], other.renoised[name])
            compared = compare_pairs(name, first.rows[name], other.rows[name], COMPARED[name], confidence, again)
            pairs[other.configuration] += [] if compared is None else [compared]
    best: dict[str, dict[str, Interval]] = {}
    judged = [case for case in cases if case.oscillation is None]
    rows = [case.rows for case in judged if case.rows is not None]
    for name in metrics if rows else ():
        if COMPARED[name]:
            # All at once: no pair says which of three is the best.
            shares = best_probabilities([each[name] for each in rows], COMPARED[name], confidence)
            best[name] = dict(zip([case.configuration for case in judged], shares, strict=False))
    return OnTask(task, list(overrides), cases, front_of(cases), pairs, best)
