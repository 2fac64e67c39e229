"""A trajectory fit as values: which numbers are free, which recordings they are to explain, and how to search."""

from dataclasses import dataclass
from typing import Literal

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.source import Use, used_twice
from ppafo.identification.trajectory.experiment import Experiment, check_experiment
from ppafo.identification.trajectory.ranges import FreeParameter, Range, range_of

Loss = Literal["linear", "soft_l1", "huber"]


@dataclass(frozen=True, slots=True)
class Search:
    """How to look for the optimum: loss, number of starts besides the first, seed of their draws, and limits.

    A robust loss counts residuals beyond 1.345 standard deviations less. ``identified`` and ``weak`` are the half
    widths of an interval, relative to the number, up to which it is called so.
    """

    loss: Loss = "linear"
    other_starts: int = 0
    seed: int = 1
    most_evaluations: int = 60
    confidence: float = 0.95
    identified: float = 0.2
    weak: float = 1.0


@dataclass(frozen=True, slots=True)
class TrajectoryProblem:
    """Numbers to be fitted to recordings. IdentificationError for a problem that makes no sense."""

    parameters: tuple[FreeParameter, ...]
    experiments: tuple[Experiment, ...]
    search: Search = Search()

    def __post_init__(self) -> None:
        if not self.parameters or not self.experiments:
            raise IdentificationError("a trajectory fit needs at least one parameter and at least one recording")
        _refuse_twice("experiment", [item.label for item in self.experiments])
        for experiment in self.experiments:
            check_experiment(experiment)
        twice = used_twice(_use(item) for item in self.experiments)
        if twice:
            raise IdentificationError(twice)
        labels = [item.label for item in self.experiments]
        for parameter in self.parameters:
            for label in parameter.recordings:
                if label not in labels:
                    hint = nearest_name(label, labels)
                    raise IdentificationError(f"{parameter.path}: there is no experiment '{label}'{hint}")
        _refuse_twice("parameter", [item.name for item in ranges_of(self)])

    def experiments_with(self, parameter: FreeParameter) -> tuple[Experiment, ...]:
        """Return the experiments in which a parameter acts."""
        return tuple(
            item for item in self.experiments if not parameter.recordings or item.label in parameter.recordings
        )


def ranges_of(problem: TrajectoryProblem) -> tuple[Range, ...]:
    """Return all parameters of a problem with start, bounds and scale settled; refuses those that contradict."""
    return tuple(range_of(parameter, problem.experiments_with(parameter)) for parameter in problem.parameters)


def _use(item: Experiment) -> Use:
    """Return what of its recording an experiment is compared with."""
    last = item.start + item.scenario.duration
    trace = item.source or item.recording.label
    return Use(f"experiment '{item.label}'", trace, item.recording, frozenset(item.channels), item.start, last)


def _refuse_twice(what: str, names: list[str]) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise IdentificationError(f"{what} '{twice[0]}' is named twice")
