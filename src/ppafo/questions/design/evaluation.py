"""What designs are worth: every candidate runs every task; error, gas, mass and violated constraints."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from ppafo.parameters.graph import ATMOSPHERE_PATH, PRESSURE_PATH, SECOND_PRESSURE_PATH
from ppafo.parameters.parts import Part
from ppafo.questions.design.file import GAS, OBJECTIVES, DesignProblem, Task
from ppafo.questions.design.front import Candidates, Floats, Worth
from ppafo.questions.design.variables import DEAD_VOLUME, OWN, SIZE
from ppafo.simulation.ensemble import COMPLETED, run_ensemble
from ppafo.simulation.numbers import TIMES, declared_numbers, moving_together, number_at
from ppafo.simulation.scenario import Scenario
from ppafo.studies.draws import Uncertainty
from ppafo.studies.noise import NOISE, with_noise

Members = NDArray[np.intp]

SEARCHED_STREAMS, FRESH_STREAMS = 16, 64
"""Noise streams over which every candidate of a noisy task is judged, and those, all new, over which a front is."""
SUPPLIES = (PRESSURE_PATH, SECOND_PRESSURE_PATH, ATMOSPHERE_PATH)
"""What decides about the pressures that parts must stand."""
_MAXIMUM_REASONS = 20
_CHUNK = 16_384
"""Runs handed to the lanes at once: enough to fill them, little enough memory."""


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
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
        self.seeds = noise_streams(problem, 0, SEARCHED_STREAMS)
        self._threads = threads
        own = (item.name for item in problem.constraints if item.name not in OBJECTIVES)
        self._metrics = tuple(dict.fromkeys([problem.error, GAS, *own]))

    def __call__(self, candidates: Candidates) -> Worth:
        """Return objectives (error [N m], gas [kg], mass [kg]) and the violation of the constraints."""
        return self.judge(candidates, self.seeds).worth

    def judge(self, candidates: Candidates, seeds: Floats) -> Judged:
        """Return what candidates are worth over streams of noise: means of error and gas, constraints kept in each."""
        problem = self.problem
        metrics = tuple(self.metrics(task, candidates, seeds) for task in problem.tasks)
        weights = [task.weight for task in problem.tasks]
        error, gas = (
            np.sum([weight * found[name] for weight, found in zip(weights, metrics, strict=True)], axis=0)
            for name in (problem.error, GAS)
        )
        objectives = np.stack([error.mean(axis=0), gas.mean(axis=0), self.masses(candidates)], axis=1)
        worth = Worth(objectives, self._violation(candidates, objectives, metrics))
        return Judged(worth, metrics, error, gas)

    def metrics(self, task: Task, candidates: Candidates, seeds: Floats) -> dict[str, Floats]:
        """Return the metrics (streams, candidates) of a task by name; nan where a run failed."""
        streams = max(1, seeds.size)
        found = {name: np.full((streams, len(candidates)), np.nan) for name in self._metrics}
        for valve, members in self._by_valve(candidates):
            scenario = task.scenarios[valve.kind]
            for start in range(0, members.size, max(1, _CHUNK // streams)):
                part = members[start : start + max(1, _CHUNK // streams)]
                self._run(task, scenario, candidates.at(part), part, seeds, found)
        return found

    def masses(self, candidates: Candidates) -> Floats:
        """Return the mass [kg] (candidates,) of all that is carried."""
        problem = self.problem
        valves = np.array([item.valve.full_mass for item in problem.combinations])
        actuators = np.array([item.actuator.full_mass for item in problem.combinations])
        size = values_of(problem, candidates).get(SIZE, np.ones(len(candidates)))
        fixed = problem.other_mass + sum(part.full_mass for part in problem.carried)
        return np.asarray(valves[candidates.choice] + size * actuators[candidates.choice] + fixed)

    def _by_valve(self, candidates: Candidates) -> list[tuple[Part, Members]]:
        """Return each valve with its candidates: those of one valve have one kind and one form of orifice."""
        names = np.array([item.valve.name for item in self.problem.combinations])[candidates.choice]
        valves = {item.valve.name: item.valve for item in self.problem.combinations}
        return [(valves[str(name)], np.flatnonzero(names == name)) for name in np.unique(names)]

    def _run(
        self,
        task: Task,
        scenario: Scenario,
        candidates: Candidates,
        members: Members,
        seeds: Floats,
        found: dict[str, Floats],
    ) -> None:
        columns = design_columns(self.problem, scenario, candidates)
        streams = max(1, seeds.size)
        if seeds.size:
            columns = {path: np.tile(values, streams) for path, values in columns.items()}
            columns[NOISE] = np.repeat(seeds, members.size)
        result = run_ensemble(scenario, columns, self._metrics, threads=self._threads)
        for name, values in result.metrics.items():
            found[name][:, members] = values.reshape(streams, members.size)
        self.runs += streams * members.size
        self.failed += int(np.count_nonzero(result.status != COMPLETED))
        for reason in list(result.reasons.values())[: _MAXIMUM_REASONS - len(self.reasons)]:
            self.reasons.setdefault(reason, task.name)

    def _violation(self, candidates: Candidates, objectives: Floats, metrics: Sequence[Mapping[str, Floats]]) -> Floats:
        total = np.zeros(len(candidates))
        own: Mapping[str, Floats] = dict(zip(OBJECTIVES, objectives.T[:, None, :], strict=True))
        for item in self.problem.constraints:
            series = [own[item.name]] if item.name in own else [found[item.name] for found in metrics]
            for values in series:
                beyond = _excess(values, item.most, 1.0) + _excess(values, item.least, -1.0)
                total += beyond.max(axis=0)
        total += self._over_rating(candidates)
        return np.where(np.isfinite(objectives).all(axis=1) & np.isfinite(total), total, np.inf)

    def _over_rating(self, candidates: Candidates) -> Floats:
        """Return by what fraction (candidates,) the highest supply pressure is above what the parts are made for."""
        problem = self.problem
        ratings = np.array(
            [
                min(
                    part.values.get("largest_pressure", np.inf)
                    for part in (item.valve, item.actuator, *problem.carried)
                )
                for item in problem.combinations
            ]
        )[candidates.choice]
        chosen = values_of(problem, candidates)
        highest = np.zeros(len(candidates))
        for task in problem.tasks:
            for scenario in task.scenarios.values():
                found = moving_together(scenario, {path: chosen[path] for path in SUPPLIES if path in chosen})
                for path in SUPPLIES[:2]:
                    highest = np.maximum(highest, found.get(path, number_at(scenario, path)))
        return np.asarray(np.maximum(0.0, highest / ratings - 1.0))


def _excess(values: Floats, limit: float | None, sign: float) -> Floats:
    """Return by what fraction of a limit values are beyond it, each; 0 where they keep it or there is none."""
    if limit is None:
        return np.zeros_like(values)
    return np.maximum(0.0, sign * (values - limit) / max(abs(limit), 1.0e-12))


def noise_streams(problem: DesignProblem, first: int, count: int) -> Floats:
    """Return the seeds of streams of noise, from number ``first`` on; none where no controller receives noise."""
    scenarios = [scenario for task in problem.tasks for scenario in task.scenarios.values()]
    noise = Uncertainty(with_noise((), None, scenarios, [item.path for item in problem.variables])[0])
    return noise.random_columns(first, count, problem.search.seed)[NOISE] if noise.has_noise else np.zeros(0)


def values_of(problem: DesignProblem, candidates: Candidates) -> dict[str, Floats]:
    """Return the chosen numbers (candidates,) in SI, by path."""
    return {item.path: item.value(candidates.places[:, index]) for index, item in enumerate(problem.variables)}


def design_columns(problem: DesignProblem, scenario: Scenario, candidates: Candidates) -> dict[str, Floats]:
    """Return the columns of candidates that have one valve and run in one scenario."""
    chosen = values_of(problem, candidates)
    combinations = [problem.combinations[choice] for choice in candidates.choice.tolist()]
    count = len(candidates)
    columns = {path: np.full(count, number) for path, number in combinations[0].valve.model_numbers.items()}
    size = chosen.get(SIZE, np.ones(count))
    for name in ("torque_constant", "volume_per_angle"):
        columns[f"actuator.{name}"] = size * np.array([item.actuator.values[name] for item in combinations])
    if DEAD_VOLUME in chosen:
        columns |= {f"{DEAD_VOLUME}_{chamber}": chosen[DEAD_VOLUME] for chamber in (1, 2)}
    known = declared_numbers(scenario)
    columns |= {path: values for path, values in chosen.items() if path not in OWN and (path in known or path in TIMES)}
    return columns
