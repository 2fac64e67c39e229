"""Trajectory fit problem: parameters to fit, and experiments that the model must explain."""

from dataclasses import dataclass

from ppafo.errors import IdentificationError, PpafoError, noted_in, raise_noted
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
        if message := double_use(use_of(experiment) for experiment in self.experiments):
            raise IdentificationError(message)
        for parameter in self.parameters:
            for label in parameter.recordings:
                if label not in labels:
                    hint = nearest_name(label, labels)
                    raise IdentificationError(f"{parameter.path}: there is no experiment '{label}'{hint}")
        _refuse_twice("parameter", [number.free.name for number in numbers_of(self)])


def numbers_of(problem: TrajectoryProblem) -> tuple[FitNumber, ...]:
    """Return all parameters of a problem with start and bounds resolved. Raises IdentificationError if inconsistent."""
    numbers, wrong = list[FitNumber](), list[PpafoError]()
    for parameter in problem.parameters:
        labels = parameter.recordings
        acting = [experiment for experiment in problem.experiments if not labels or experiment.label in labels]
        with noted_in(wrong):
            numbers.append(number_of(parameter, acting))
    raise_noted(wrong)
    return tuple(numbers)


def _refuse_twice(kind: str, names: list[str]) -> None:
    """Raise IdentificationError for a duplicated name; ``kind`` is the noun for the message."""
    if (twice := first_twice(names)) is not None:
        raise IdentificationError(f"{kind} '{twice}' is given twice; rename or remove one of the two")
