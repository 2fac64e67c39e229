"""Carries out a design study: problem in, front with table, knee and doubts out."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ppafo.constants import GRAMS_PER_KILOGRAM
from ppafo.errors import StudyError
from ppafo.studies.design.candidates import Candidates
from ppafo.studies.design.choosing import knee, representatives
from ppafo.studies.design.columns import values_of
from ppafo.studies.design.evaluation import Evaluation
from ppafo.studies.design.problem import GAS, DesignProblem, load_design
from ppafo.studies.design.result import Design, DesignPoint, objective_table
from ppafo.studies.design.search import Front, search_front

Watch = Callable[[int, float], None]


def run_design(problem: DesignProblem | str | Path, threads: int | None = None, watch: Watch | None = None) -> Design:
    """Return the designs that no other one found beats in error, gas per task and mass.

    ``problem`` may be a design file. ``watch`` is told designs evaluated and hypervolume from time to time. StudyError
    where no design keeps the constraints.
    """
    chosen = problem if isinstance(problem, DesignProblem) else load_design(problem)
    begun = time.perf_counter()
    evaluation = Evaluation(chosen, threads)
    front = search_front(evaluation, len(chosen.combinations), len(chosen.variables), chosen.search, watch)
    if len(front.candidates) == 0:
        raise StudyError(_nothing_found(chosen, evaluation, front))
    points = _points(evaluation, front)
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
    )


def _points(evaluation: Evaluation, front: Front) -> tuple[DesignPoint, ...]:
    """Return the front in order of error, with what each task says of each design."""
    problem = evaluation.problem
    order = np.lexsort(front.worth.objectives.T[::-1])
    candidates, objectives = front.candidates.at(order), front.worth.objectives[order]
    numbers = values_of(problem, candidates)
    tasks = {task.name: evaluation.metrics(task, candidates) for task in problem.tasks}
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
            tasks={name: (float(found[problem.error][row]), float(found[GAS][row])) for name, found in tasks.items()},
        )
        for row in range(len(candidates))
    )


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
            said.append(f"no design has 10 % less {name}")
            continue
        nearest = min(better, key=lambda point: _loss(chosen, point, index))
        said.append(f"10 % less {name} would cost {_cost(chosen, nearest, index)}")
    return (
        "it has the smallest sum of error, gas and mass, each counted as a share of its range on the front: what "
        f"another design gains in some it loses at least as much of in the rest; {'; '.join(said)}"
    )


def _loss(chosen: DesignPoint, other: DesignPoint, index: int) -> float:
    """Return the sum of relative increases of the other objectives."""
    pairs = zip(other.objectives, chosen.objectives, strict=True)
    return sum(max(0.0, new / old - 1.0) for place, (new, old) in enumerate(pairs) if place != index and old > 0.0)


def _cost(chosen: DesignPoint, other: DesignPoint, index: int) -> str:
    names = (("error", "N m", 1.0), ("gas", "g", GRAMS_PER_KILOGRAM), ("mass", "g", GRAMS_PER_KILOGRAM))
    costs = [
        f"{scale * (new - old):.3g} {unit} more {name}"
        for place, ((name, unit, scale), new, old) in enumerate(
            zip(names, other.objectives, chosen.objectives, strict=True)
        )
        if place != index and new > old * (1.0 + 1.0e-3)
    ]
    return " and ".join(costs) or "next to nothing"


def _nothing_found(problem: DesignProblem, evaluation: Evaluation, front: Front) -> str:
    if evaluation.failed == evaluation.runs:
        reason = next(iter(evaluation.reasons), "no reason was given")
        return f"{problem.file}: every one of {evaluation.runs} runs failed; the first: {reason}"
    names = ", ".join(item.name for item in problem.constraints) or "the pressure that the parts are made for"
    return (
        f"{problem.file}: none of {front.growth[-1][0]} designs keeps the constraints ({names}); "
        f"loosen them, widen the variables or name other parts, and see that every task has these metrics"
    )
