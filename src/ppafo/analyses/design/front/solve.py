"""What designs are worth on every task and in every noise stream, and the study: problem in, front out."""

import shlex
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from ppafo.analyses.design.front.answer import Design, DesignPoint, Rerun
from ppafo.analyses.design.front.problem import (
    DEAD_VOLUME,
    GAS,
    OBJECTIVES,
    OWN,
    SIZE,
    DesignProblem,
    Task,
)
from ppafo.analyses.design.front.search import (
    Candidates,
    Front,
    Worth,
    knee,
    non_dominated,
    representatives,
    search_front,
)
from ppafo.analyses.design.trials import STREAMS, run_trials
from ppafo.errors import ScenarioError, StudyError
from ppafo.linear_algebra import on_one_thread
from ppafo.parameters.graph import ATMOSPHERE_PATH, PRESSURE_PATH, SECOND_PRESSURE_PATH
from ppafo.parameters.overrides import over
from ppafo.parameters.parts import rated_pressure
from ppafo.progress import Report, report_nothing
from ppafo.running import simulate
from ppafo.signals.recording import Floats
from ppafo.simulation.clock import TIMES
from ppafo.simulation.declaration import PLAIN
from ppafo.simulation.numbers import declared_numbers, moving_together, number_at
from ppafo.simulation.scenario import Scenario
from ppafo.studies.draws import seeds_of_noise

Members = NDArray[np.intp]
SUPPLIES = (PRESSURE_PATH, SECOND_PRESSURE_PATH, ATMOSPHERE_PATH)
"""What decides about the pressures that parts must stand."""
FRESH_STREAMS = 64
"""Noise streams, all new, over which a front is assessed: what was chosen in the searched ones was lucky there too."""
_MAXIMUM_REASONS = 20
"""Reasons of failed runs that are kept: each names its own moment, so they are nearly as many as the runs."""


@dataclass(frozen=True, slots=True, eq=False)
class Assessed:
    """What candidates are worth over all streams of noise, and what each task says of them.

    ``tasks`` has the metrics (streams, candidates) by name for each task, ``error`` and ``gas`` (streams, candidates)
    their weighted means over the tasks [N m], [kg]. There is one stream where no sensor is noisy.
    """

    worth: Worth
    tasks: tuple[Mapping[str, Floats], ...]
    error: Floats
    gas: Floats


@final
class Evaluation:
    """Evaluates candidates of a problem and remembers how many runs that took and why some failed.

    ``seeds`` (streams,) name the streams of noise that every candidate meets, the same for all; none where no
    controller receives noise.
    """

    def __init__(self, problem: DesignProblem, threads: int | None = None) -> None:
        self.problem = problem
        self.runs = 0
        self.failed = 0
        self.reasons: dict[str, str] = {}
        self.seeds = noise_streams(problem, 0, STREAMS)
        self._threads = threads
        own = (constraint.name for constraint in problem.constraints if constraint.name not in OBJECTIVES)
        self._metrics = tuple(dict.fromkeys([problem.error, GAS, *own]))

    def __call__(self, candidates: Candidates) -> Worth:
        """Return objectives (error [N m], gas [kg], mass [kg]) and the violation of the constraints."""
        return self.assess(candidates, self.seeds).worth

    def assess(self, candidates: Candidates, seeds: Floats) -> Assessed:
        """Return what candidates are worth over streams of noise: means of error and gas, constraints kept in each."""
        problem = self.problem
        metrics = tuple(self.metrics(task, candidates, seeds) for task in problem.tasks)
        weights = [task.weight for task in problem.tasks]
        error, gas = (
            np.sum([weight * found[name] for weight, found in zip(weights, metrics, strict=True)], axis=0)
            for name in (problem.error, GAS)
        )
        valves = np.array([combination.valve.full_mass for combination in problem.combinations])
        actuators = np.array([combination.actuator.full_mass for combination in problem.combinations])
        size = values_of(problem, candidates).get(SIZE, np.ones(len(candidates)))
        fixed = problem.other_mass + sum(part.full_mass for part in problem.carried)
        # All that is carried; an actuator that is scaled has its part's mass times the scale.
        mass = valves[candidates.choice] + size * actuators[candidates.choice] + fixed
        objectives = np.stack([error.mean(axis=0), gas.mean(axis=0), mass], axis=1)
        worth = Worth(objectives, self._violation(candidates, objectives, metrics))
        return Assessed(worth, metrics, error, gas)

    def metrics(self, task: Task, candidates: Candidates, seeds: Floats) -> dict[str, Floats]:
        """Return the metrics (streams, candidates) of a task by name; nan where a run failed."""
        found = {name: np.full((max(1, seeds.size), len(candidates)), np.nan) for name in self._metrics}
        names = np.array([combination.valve.name for combination in self.problem.combinations])[candidates.choice]
        valves = {combination.valve.name: combination.valve for combination in self.problem.combinations}
        # Valve by valve: all runs of one have one kind of valve and one form of orifice, so one program.
        for name in np.unique(names):
            scenario, members = task.scenarios[valves[str(name)].kind], np.flatnonzero(names == name)
            columns = design_columns(self.problem, scenario, candidates.at(members))
            outcome = run_trials(scenario, columns, self._metrics, seeds, self._threads)
            for metric, values in outcome.metrics.items():
                found[metric][:, members] = values
            self.runs += outcome.runs
            self.failed += outcome.failed
            for reason in outcome.reasons[: _MAXIMUM_REASONS - len(self.reasons)]:
                self.reasons.setdefault(reason, task.name)
        return found

    def _violation(self, candidates: Candidates, objectives: Floats, metrics: Sequence[Mapping[str, Floats]]) -> Floats:
        total = np.zeros(len(candidates))
        own: Mapping[str, Floats] = dict(zip(OBJECTIVES, objectives.T[:, None, :], strict=True))
        for constraint in self.problem.constraints:
            series = [own[constraint.name]] if constraint.name in own else [found[constraint.name] for found in metrics]
            for values in series:
                beyond = _excess(values, constraint.most, 1.0) + _excess(values, constraint.least, -1.0)
                total += beyond.max(axis=0)
        # By what fraction (candidates,) the highest supply pressure is above what the parts are made for.
        problem = self.problem
        ratings = np.array(
            [
                rated_pressure(combination.valve, combination.actuator, *problem.carried)
                for combination in problem.combinations
            ]
        )[candidates.choice]
        chosen = values_of(problem, candidates)
        highest = np.zeros(len(candidates))
        for task in problem.tasks:
            for scenario in task.scenarios.values():
                moved = moving_together(scenario, {path: chosen[path] for path in SUPPLIES if path in chosen})
                for path in SUPPLIES[:2]:
                    # One pressure may follow the other: all pressures are read, not the variables alone.
                    highest = np.maximum(highest, moved.get(path, number_at(scenario, path)))
        total += np.asarray(np.maximum(0.0, highest / ratings - 1.0))
        return np.where(np.isfinite(objectives).all(axis=1) & np.isfinite(total), total, np.inf)


def _excess(values: Floats, limit: float | None, sign: float) -> Floats:
    """Return by what fraction of a limit values are beyond it, each; 0 where they keep it or there is none."""
    if limit is None:
        return np.zeros_like(values)
    return np.maximum(0.0, sign * (values - limit) / max(abs(limit), 1.0e-12))


def noise_streams(problem: DesignProblem, first: int, count: int) -> Floats:
    """Return the seeds of streams of noise, from number ``first`` on; none where no controller receives noise."""
    scenarios = [scenario for task in problem.tasks for scenario in task.scenarios.values()]
    return seeds_of_noise(
        scenarios, [variable.path for variable in problem.variables], first, count, problem.search.seed
    )


def values_of(problem: DesignProblem, candidates: Candidates) -> dict[str, Floats]:
    """Return the chosen numbers (candidates,) in SI, by path."""
    return {
        variable.path: variable.value(candidates.places[:, index]) for index, variable in enumerate(problem.variables)
    }


def design_columns(problem: DesignProblem, scenario: Scenario, candidates: Candidates) -> dict[str, Floats]:
    """Return the columns of candidates that have one valve and run in one scenario."""
    chosen = values_of(problem, candidates)
    combinations = [problem.combinations[choice] for choice in candidates.choice.tolist()]
    count = len(candidates)
    columns = {path: np.full(count, number) for path, number in combinations[0].valve.model_numbers.items()}
    size = chosen.get(SIZE, np.ones(count))
    for name in ("torque_constant", "displacement_per_radian"):
        columns[f"actuator.{name}"] = size * np.array(
            [combination.actuator.values[name] for combination in combinations]
        )
    if DEAD_VOLUME in chosen:
        columns |= {f"{DEAD_VOLUME}_{chamber}": chosen[DEAD_VOLUME] for chamber in (1, 2)}
    known = declared_numbers(scenario)
    columns |= {path: values for path, values in chosen.items() if path not in OWN and (path in known or path in TIMES)}
    return columns


@on_one_thread
def find_front(problem: DesignProblem, threads: int | None = None, report: Report = report_nothing) -> Design:
    """Return the designs that no other design found beats in error, gas per task and mass.

    StudyError where no design satisfies the constraints.
    """
    begun = time.perf_counter()
    evaluation = Evaluation(problem, threads)
    front = search_front(evaluation, len(problem.combinations), len(problem.variables), problem.search, report)
    if len(front.candidates) == 0:
        if evaluation.failed == evaluation.runs:
            reason = next(iter(evaluation.reasons), "no reason was given")
            raise StudyError(f"{problem.file}: all {evaluation.runs} runs failed; the first: {reason}")
        names = ", ".join(constraint.name for constraint in problem.constraints) or "the rated pressure of the parts"
        raise StudyError(
            f"{problem.file}: none of {front.growth[-1][0]} designs satisfies the constraints ({names}); relax them, "
            "widen the variables or name other parts, and check that every task has these metrics"
        )
    candidates, assessed = _standing(evaluation, front)
    if len(candidates) == 0:
        raise StudyError(
            f"{problem.file}: none of {len(front.candidates)} designs of the front keeps the constraints in "
            f"{FRESH_STREAMS} new streams of sensor noise; relax them"
        )
    points = _points(problem, candidates, assessed)
    table = np.array([point.objectives for point in points])
    suggested = candidates.at(np.array([knee(table)]))
    return Design(
        problem=problem,
        front=points,
        shown=representatives(table),
        knee=knee(table),
        reason=_reason(points, knee(table)),
        growth=front.growth,
        settled=front.settled,
        designs=front.growth[-1][0],
        runs=evaluation.runs,
        failed=evaluation.failed,
        failures=dict(evaluation.reasons),
        seconds=time.perf_counter() - begun,
        streams=FRESH_STREAMS if evaluation.seeds.size else 0,
        fallen=len(front.candidates) - len(points),
        suggested=tuple(_run_again(problem, task, suggested) for task in problem.tasks),
    )


def _run_again(problem: DesignProblem, task: Task, chosen: Candidates) -> Rerun:
    """Return one design run in a task as its files and the command line have it."""
    scenario = task.scenarios[problem.combinations[int(chosen.choice[0])].valve.kind]
    origin, columns = scenario.origin, design_columns(problem, scenario, chosen)
    known = {path: quantity.unit for path, quantity in declared_numbers(scenario).items()}
    units = known | {variable.path: variable.unit for variable in problem.variables}
    texts = [
        f"{path}={values[0]:.6g} {'' if units[path] in PLAIN else units[path]}".strip()
        for path, values in columns.items()
    ]
    overrides = over(origin.overrides, texts, ScenarioError, valve=origin.valve)
    sets = " ".join(f"--set {shlex.quote(text)}" for text in overrides)
    return Rerun(task.name, f"ppafo simulate {origin.file} {sets}", simulate(origin.file or "", overrides))


def _standing(evaluation: Evaluation, front: Front) -> tuple[Candidates, Assessed]:
    """Return the designs of a front in order of error, as they are assessed; with noise over streams that are new.

    The search chose what was good in its own streams, by luck too; of the new ones the front is made again.
    """
    chosen = front.candidates
    assessed = evaluation.assess(chosen, noise_streams(evaluation.problem, STREAMS, FRESH_STREAMS))
    worth = assessed.worth
    stand = (
        np.flatnonzero(non_dominated(worth) & worth.is_feasible) if evaluation.seeds.size else np.arange(len(chosen))
    )
    # By error, then gas, then mass: ``lexsort`` takes the last key first.
    order = stand[np.lexsort(worth.objectives[stand].T[::-1])]
    tasks = tuple({name: values[:, order] for name, values in task.items()} for task in assessed.tasks)
    return chosen.at(order), Assessed(worth.at(order), tasks, assessed.error[:, order], assessed.gas[:, order])


def _points(problem: DesignProblem, candidates: Candidates, assessed: Assessed) -> tuple[DesignPoint, ...]:
    """Return designs with what each task reports of each, and the numbers that mean something for its kind of valve."""
    numbers, is_noisy = values_of(problem, candidates), len(assessed.error) > 1
    means = {
        task.name: (metrics[problem.error].mean(axis=0), metrics[GAS].mean(axis=0))
        for task, metrics in zip(problem.tasks, assessed.tasks, strict=True)
    }
    points = []
    for row, choice in enumerate(candidates.choice.tolist()):
        valve, actuator = problem.combinations[choice].valve, problem.combinations[choice].actuator
        paths = [variable.path for variable in problem.variables if not variable.kinds or valve.kind in variable.kinds]
        error, gas, mass = assessed.worth.objectives[row].tolist()
        spread = [float(series[:, row].std(ddof=1)) for series in (assessed.error, assessed.gas)] if is_noisy else None
        points.append(
            DesignPoint(
                valve,
                actuator,
                {path: float(numbers[path][row]) for path in paths},
                error,
                gas,
                mass,
                {name: (float(errors[row]), float(gases[row])) for name, (errors, gases) in means.items()},
                None if spread is None else (spread[0], spread[1]),
            )
        )
    return tuple(points)


def _reason(points: tuple[DesignPoint, ...], number: int) -> str:
    """Return why the knee is suggested, with what the nearest better designs of each objective cost."""
    chosen = points[number].objectives
    said = []
    for index, name in enumerate(OBJECTIVES):
        others = [other for other in range(len(chosen)) if other != index]
        better = [point.objectives for point in points if point.objectives[index] < 0.9 * chosen[index]]
        if not better:
            said.append(f"no design on the front has 10 % less {name}")
            continue
        # The nearest has the smallest sum of relative increases of the other objectives.
        increases = [
            sum(max(0.0, new[other] / chosen[other] - 1.0) for other in others if chosen[other] > 0.0) for new in better
        ]
        nearest = better[increases.index(min(increases))]
        costs = [
            f"{kind.change(nearest[other] - chosen[other])} more {words}"
            for other, (words, kind) in enumerate(OBJECTIVES.items())
            if other != index and nearest[other] > chosen[other] * (1.0 + 1.0e-3)
        ]
        said.append(f"10 % less {name} would cost {' and '.join(costs) or 'almost nothing'}")
    return (
        "it has the smallest sum of error, gas and mass, each as a fraction of its range on the front: any other "
        f"design loses at least as much in some of them as it gains in the others; {'; '.join(said)}"
    )
