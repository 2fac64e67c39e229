"""Coverage: how often the interval of a fit holds the planted value, over many synthetic repetitions."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.intervals.planted import (
    Planted,
    eight_parameters,
    noisy_recordings,
    planted_problem,
    two_step_responses,
)
from ppafo.errors import IdentificationError
from ppafo.identification.trajectory import FreeParameter, Search, TrajectoryFit, TrajectoryProblem, fit

REPETITIONS = 200


@dataclass(frozen=True, slots=True)
class Coverage:
    """What the repetitions gave, by parameter in the order of ``paths``.

    ``scores`` (repetitions, parameters) are errors over their standard errors, in the coordinates of the fit: normal
    with mean 0 and standard deviation 1 where the intervals are right. ``inside`` counts intervals that hold the truth,
    ``seconds`` is the median time of a fit.
    """

    paths: tuple[str, ...]
    confidence: float
    repetitions: int
    inside: tuple[int, ...]
    scores: "np.ndarray[tuple[int, int], np.dtype[np.float64]]"
    verdicts: tuple[str, ...]
    seconds: float

    @property
    def share(self) -> float:
        """Share of all intervals that hold the planted value."""
        return sum(self.inside) / (self.repetitions * len(self.paths))


def coverage(
    planted: Planted | None = None,
    choose: Callable[[Planted, np.random.Generator], tuple[FreeParameter, ...]] = eight_parameters,
    repetitions: int = REPETITIONS,
    seed: int = 1,
    search: Search = Search(),  # noqa: B008  # a frozen value
) -> Coverage:
    """Return how often intervals hold the planted values, by default for eight parameters from two step responses.

    Every repetition has noise and start values of its own, drawn from ``seed``.
    """
    if repetitions < 1:
        raise IdentificationError(f"a coverage study needs at least one repetition, not {repetitions}")
    chosen = planted or two_step_responses()
    random = np.random.default_rng(seed)
    fits, seconds = [], []
    for _ in range(repetitions):
        problem = planted_problem(chosen, choose(chosen, random), noisy_recordings(chosen, random), search)
        found, duration = _timed(problem)
        fits.append(found)
        seconds.append(duration)
    paths = tuple(estimate.path for estimate in fits[0].estimates)
    truth = [chosen.truth(path) for path in paths]
    held = [[one.low <= true <= one.high for one, true in zip(found.estimates, truth, strict=True)] for found in fits]
    return Coverage(
        paths=paths,
        confidence=fits[0].problem.search.confidence,
        repetitions=repetitions,
        inside=tuple(int(count) for count in np.sum(held, axis=0)),
        scores=np.array([_scores(found, truth) for found in fits]),
        verdicts=tuple(_usual([found.estimates[index].verdict for found in fits]) for index in range(len(paths))),
        seconds=float(np.median(seconds)),
    )


def coverage_text(result: Coverage) -> str:
    """Return the table of a coverage study, one parameter a line, the share over all of them last."""
    width = max(len(path) for path in result.paths)
    head = f"{100.0 * result.confidence:g} % intervals, {result.repetitions} synthetic repetitions"
    lines = [head, f"{'parameter':<{width}}  held   share  mean score  sd of score  verdict"]
    for index, path in enumerate(result.paths):
        scores, held = result.scores[:, index], result.inside[index]
        lines.append(
            f"{path:<{width}}  {held:>4}  {100.0 * held / result.repetitions:5.1f} %  {scores.mean():+10.2f}  "
            f"{scores.std():11.2f}  {result.verdicts[index]}"
        )
    total = sum(result.inside)
    lines.append(f"{'all':<{width}}  {total:>4}  {100.0 * result.share:5.1f} %")
    lines.append(f"median time of a fit: {result.seconds:.2f} s")
    return "\n".join(lines)


def _timed(problem: TrajectoryProblem) -> tuple[TrajectoryFit, float]:
    start = time.perf_counter()
    return fit(problem), time.perf_counter() - start


def _scores(found: TrajectoryFit, truth: list[float]) -> list[float]:
    """Return errors over standard errors; on a log scale both are those of the logarithm."""
    scores = []
    for index, (item, true) in enumerate(zip(found.optimum.residuals.ranges, truth, strict=True)):
        error = math.sqrt(found.covariance[index, index]) / item.slope(float(found.optimum.point[index]))
        scores.append((float(found.optimum.point[index]) - item.coordinate(true)) / error)
    return scores


def _usual(words: list[str]) -> str:
    return max(sorted(set(words)), key=words.count)
