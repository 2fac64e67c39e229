"""Carries out a design study: problem in, front with table, knee and doubts out."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ppafo.answers import Solved
from ppafo.answers.display_units import change_text
from ppafo.errors import StudyError
from ppafo.parameters.parts import Part
from ppafo.progress import Report, report_nothing
from ppafo.questions.design.evaluation import (
    FRESH_STREAMS,
    SEARCHED_STREAMS,
    Evaluation,
    Judged,
    noise_streams,
    values_of,
)
from ppafo.questions.design.file import GAS, DesignProblem, load_design, with_seed
from ppafo.questions.design.front import Candidates, Floats, knee, non_dominated, representatives
from ppafo.questions.design.search import Front, search_front

SHOWN_OBJECTIVES = {"error": "torque", "gas": "gas mass", "mass": "part mass"}
"""What a design is judged by, with the kind of quantity as which a person is shown it."""


@dataclass(frozen=True, slots=True)
class DesignPoint:
    """A design that no other design found beats: parts, chosen numbers [SI] by path, error [N m], gas and mass [kg].

    ``tasks`` has error and gas of each task by its name. Where sensors are noisy all are means over ``FRESH_STREAMS``
    new streams of noise, and ``spread`` has the standard deviations of error and gas from one stream to another.
    """

    valve: Part
    actuator: Part
    numbers: Mapping[str, float]
    error: float
    gas: float
    mass: float
    tasks: Mapping[str, tuple[float, float]]
    spread: tuple[float, float] | None = None

    @property
    def objectives(self) -> tuple[float, float, float]:
        """Error [N m], gas per task [kg], mass [kg]."""
        return self.error, self.gas, self.mass


@dataclass(frozen=True, slots=True)
class Design(Solved):
    """The result of a design study.

    ``front`` is in order of error. ``shown`` are places in it that stand for all of it in a table, ``knee`` is the
    place of the suggestion and ``reason`` states why. ``growth`` has pairs of designs evaluated and hypervolume [-];
    ``failures`` maps the reason of a failed run to the task it failed in. ``streams`` is how many new streams of noise
    the front was judged over, 0 without noise, and ``fallen`` how many of its designs did not stand there.
    """

    problem: DesignProblem
    front: tuple[DesignPoint, ...]
    shown: tuple[int, ...]
    knee: int
    reason: str
    growth: tuple[tuple[int, float], ...]
    settled: bool
    designs: int
    runs: int
    failed: int
    failures: Mapping[str, str]
    seconds: float
    streams: int = 0
    fallen: int = 0

    @property
    def doubtful(self) -> tuple[tuple[Part, str], ...]:
        """Figures that are quoted or assumed, of the parts on the front and of those that every design carries."""
        used = {part.name for point in self.front for part in (point.valve, point.actuator)}
        used |= {part.name for part in self.problem.carried}
        return tuple((part, name) for part in self.problem.parts if part.name in used for name in part.doubtful)


def objective_table(front: tuple[DesignPoint, ...]) -> Floats:
    """Return the objectives of designs, (designs, 3)."""
    return np.array([point.objectives for point in front]).reshape(-1, 3)


def design(
    problem: DesignProblem | str | Path,
    seed: int | None = None,
    threads: int | None = None,
    progress: Report | None = None,
) -> Design:
    """Return the designs that no other design found beats in error, gas per task and mass.

    ``problem`` may be the name or path of a design file; ``seed`` replaces its random seed. StudyError or
    ParameterError for bad input, and StudyError where no design satisfies the constraints.
    """
    chosen = problem if isinstance(problem, DesignProblem) else load_design(problem)
    chosen = chosen if seed is None else with_seed(chosen, seed)
    begun = time.perf_counter()
    report = progress or report_nothing
    evaluation = Evaluation(chosen, threads)
    front = search_front(evaluation, len(chosen.combinations), len(chosen.variables), chosen.search, report)
    if len(front.candidates) == 0:
        raise StudyError(_reason_for_no_design(chosen, evaluation, front))
    candidates, judged = _standing(evaluation, front)
    if len(candidates) == 0:
        raise StudyError(
            f"{chosen.file}: none of {len(front.candidates)} designs of the front keeps the constraints in "
            f"{FRESH_STREAMS} new streams of sensor noise; relax them"
        )
    points = _points(evaluation.problem, candidates, judged)
    table = objective_table(points)
    return Design(
        problem=chosen,
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
    )


def _standing(evaluation: Evaluation, front: Front) -> tuple[Candidates, Judged]:
    """Return the designs of a front in order of error, as they are judged; with noise over streams that are new.

    The search chose what was good in its own streams, by luck too; of the new ones the front is made again.
    """
    chosen = front.candidates
    judged = evaluation.judge(chosen, noise_streams(evaluation.problem, SEARCHED_STREAMS, FRESH_STREAMS))
    worth = judged.worth
    stand = (
        np.flatnonzero(non_dominated(worth) & worth.is_feasible) if evaluation.seeds.size else np.arange(len(chosen))
    )
    order = stand[np.lexsort(worth.objectives[stand].T[::-1])]
    tasks = tuple({name: values[:, order] for name, values in task.items()} for task in judged.tasks)
    return chosen.at(order), Judged(worth.at(order), tasks, judged.error[:, order], judged.gas[:, order])


def _points(problem: DesignProblem, candidates: Candidates, judged: Judged) -> tuple[DesignPoint, ...]:
    """Return designs with what each task reports of each."""
    objectives, numbers = judged.worth.objectives, values_of(problem, candidates)
    means = {
        task.name: (found[problem.error].mean(axis=0), found[GAS].mean(axis=0))
        for task, found in zip(problem.tasks, judged.tasks, strict=True)
    }
    is_noisy = len(judged.error) > 1
    return tuple(
        DesignPoint(
            valve=problem.combinations[int(candidates.choice[row])].valve,
            actuator=problem.combinations[int(candidates.choice[row])].actuator,
            numbers={
                path: float(values[row]) for path, values in numbers.items() if _applies(problem, candidates, row, path)
            },
            error=float(objectives[row, 0]),
            gas=float(objectives[row, 1]),
            mass=float(objectives[row, 2]),
            tasks={name: (float(error[row]), float(gas[row])) for name, (error, gas) in means.items()},
            spread=_spread(judged, row) if is_noisy else None,
        )
        for row in range(len(candidates))
    )


def _spread(judged: Judged, row: int) -> tuple[float, float]:
    return float(judged.error[:, row].std(ddof=1)), float(judged.gas[:, row].std(ddof=1))


def _applies(problem: DesignProblem, candidates: Candidates, row: int, path: str) -> bool:
    """Tell whether a number means something for the kind of valve of a candidate."""
    variable = next(item for item in problem.variables if item.path == path)
    return not variable.kinds or problem.combinations[int(candidates.choice[row])].valve.kind in variable.kinds


def _reason(points: tuple[DesignPoint, ...], place: int) -> str:
    """Return why the knee is suggested, with what the nearest better designs of each objective cost."""
    chosen = points[place]
    said = []
    for name, index in (("error", 0), ("gas", 1), ("mass", 2)):
        better = [point for point in points if point.objectives[index] < 0.9 * chosen.objectives[index]]
        if not better:
            said.append(f"no design on the front has 10 % less {name}")
            continue
        nearest = min(better, key=lambda point: _loss(chosen, point, index))
        said.append(f"10 % less {name} would cost {_cost(chosen, nearest, index)}")
    return (
        "it has the smallest sum of error, gas and mass, each as a fraction of its range on the front: any other "
        "design loses at least as much in some of them as it gains in the others; {'; '.join(said)}"
    )


def _loss(chosen: DesignPoint, other: DesignPoint, index: int) -> float:
    """Return the sum of relative increases of the other objectives."""
    pairs = zip(other.objectives, chosen.objectives, strict=True)
    return sum(max(0.0, new / old - 1.0) for place, (new, old) in enumerate(pairs) if place != index and old > 0.0)


def _cost(chosen: DesignPoint, other: DesignPoint, index: int) -> str:
    pairs = zip(SHOWN_OBJECTIVES.items(), other.objectives, chosen.objectives, strict=True)
    costs = [
        f"{change_text(new - old, quantity)} more {name}"
        for place, ((name, quantity), new, old) in enumerate(pairs)
        if place != index and new > old * (1.0 + 1.0e-3)
    ]
    return " and ".join(costs) or "almost nothing"


def _reason_for_no_design(problem: DesignProblem, evaluation: Evaluation, front: Front) -> str:
    if evaluation.failed == evaluation.runs:
        reason = next(iter(evaluation.reasons), "no reason was given")
        return f"{problem.file}: all {evaluation.runs} runs failed; the first: {reason}"
    names = ", ".join(item.name for item in problem.constraints) or "the rated pressure of the parts"
    return (
        f"{problem.file}: none of {front.growth[-1][0]} designs satisfies the constraints ({names}); relax them, "
        "widen the variables or name other parts, and check that every task has these metrics"
    )
