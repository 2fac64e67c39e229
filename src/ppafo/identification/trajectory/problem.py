"""Trajectory fit problem: parameters to fit, and experiments that the model must explain."""

from dataclasses import dataclass

from ppafo.errors import IdentificationError
from ppafo.identification.source import double_use
from ppafo.identification.trajectory.experiment import FittedExperiment, check_experiment, use_of
from ppafo.identification.trajectory.numbers import FitNumber, FreeParameter, number_of
from ppafo.wording import first_twice, nearest_name


@dataclass(frozen=True, slots=True)
class TrajectoryProblem:
    """Trajectory fit problem: parameters and experiments. Raises IdentificationError if inconsistent."""

    parameters: tuple[FreeParameter, ...]
    experiments: tuple[FittedExperiment, ...]
    confidence: float = 0.95

    def __post_init__(self) -> None:
        if not self.parameters or not self.experiments:
            raise IdentificationError("a trajectory fit needs at least one parameter and at least one recording")
        labels = [experiment.label for experiment in self.experiments]
        _refuse_twice("experiment", labels)
        for experiment in self.experiments:
            check_experiment(experiment)
        message = double_use(use_of(experiment) for experiment in self.experiments)
        if message:
            raise IdentificationError(message)
        for parameter in self.parameters:
            for label in parameter.recordings:
                if label not in labels:
                    hint = nearest_name(label, labels)
                    raise IdentificationError(f"{parameter.path}: there is no experiment '{label}'{hint}")
        _refuse_twice("parameter", [number.free.name for number in numbers_of(self)])


def numbers_of(problem: TrajectoryProblem) -> tuple[FitNumber, ...]:
    """Return all parameters of a problem with start and bounds resolved. Raises IdentificationError if inconsistent."""
    numbers, problems = list[FitNumber](), list[str]()
    for parameter in problem.parameters:
        labels = parameter.recordings
        acting = [experiment for experiment in problem.experiments if not labels or experiment.label in labels]
        try:
            numbers.append(number_of(parameter, acting))
        except IdentificationError as error:
            problems.append(str(error))
    if problems:
        raise IdentificationError("; ".join(problems))
    return tuple(numbers)


def _refuse_twice(kind: str, names: list[str]) -> None:
    """Raise IdentificationError for a duplicated name; ``kind`` is the noun for the message."""
    twice = first_twice(names)
    if twice is not None:
        raise IdentificationError(f"{kind} '{twice}' is given twice; rename or remove one of the two")
