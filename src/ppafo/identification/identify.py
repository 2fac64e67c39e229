"""From a problem to a parameter set: read the recordings, apply the procedures in order, put the values in."""

import hashlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from ppafo.errors import IdentificationError
from ppafo.identification.bench.result import BenchResult
from ppafo.identification.check import Prospect
from ppafo.identification.estimate import Estimate
from ppafo.identification.new_set import NewSet, with_estimates
from ppafo.identification.problem import ProblemFile, ProcedureProblem, load_problem
from ppafo.identification.procedures import RECOMMENDED_ORDER, Setting, prospects_of, run_procedure, window_of
from ppafo.identification.source import Source, Use, used_twice
from ppafo.identification.trajectory.outcome import TrajectoryOutcome, solve_section
from ppafo.identification.trajectory.section import ExperimentSection
from ppafo.identification.trajectory.setting import Setting as FitSetting
from ppafo.parameters.loading import load_parameter_set
from ppafo.parameters.overrides import apply_overrides
from ppafo.parameters.parameter_set import ParameterSet, atmospheric_pressure, chosen_valve
from ppafo.storage.files import read_bytes
from ppafo.storage.foreign import read_foreign
from ppafo.storage.recordings import read_recording

Tell = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Beforehand:
    """What the recordings of a procedure can give and what not, said before anything was fitted."""

    procedure: str
    prospects: tuple[Prospect, ...]


@dataclass(frozen=True, slots=True)
class Identification:
    """The outcome of a problem: what could be had, results in the order of making, the set before and after."""

    name: str
    beforehand: tuple[Beforehand, ...]
    results: tuple[BenchResult, ...]
    trajectory: TrajectoryOutcome | None
    before: ParameterSet
    new_set: NewSet

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """All estimates of all procedures, those of the trajectory fit last."""
        fitted = () if self.trajectory is None else self.trajectory.fit.estimates
        return (*_bench_estimates(self.results), *fitted)

    @property
    def is_good(self) -> bool:
        """Whether every check holds and the new set makes a device where the old one did."""
        fitted = () if self.trajectory is None else self.trajectory.failed
        return not self.new_set.problem and not fitted and not any(result.failed for result in self.results)


def identify(path: str | Path, tell: Tell = lambda _text: None) -> Identification:
    """Return what the problem file's procedures make of its recordings, in the recommended order.

    The trajectory fit comes last and starts from what they found. ``tell`` is called with what is being done.
    """
    problem, folder = load_problem(path), Path(path).parent
    return solve_problem(problem, folder, Path(path).name, tell)


def solve_problem(problem: ProblemFile, folder: Path, file: str, tell: Tell = lambda _text: None) -> Identification:
    """Return the outcome of a problem whose paths begin in ``folder``; ``file`` is what messages call it."""
    before = _base_set(problem, folder)
    valve = chosen_valve(before, problem.device.valve)
    current, results = before, list[BenchResult]()
    tasks = _tasks(problem, folder, file, before)
    _refuse_twice(tasks, before, valve, file)
    beforehand = tuple(_look(task, Setting(before, valve, task.place), tell) for task in tasks)
    for task in tasks:
        result = run_procedure(task.sources, task.item, Setting(current, valve, task.place))
        results.append(result)
        current = with_estimates(current, result.estimates).parameter_set
    bench = {estimate.path: estimate for estimate in _bench_estimates(results)}
    fitted = _trajectory(problem, folder, f"{file}: trajectory", current, bench, tell)
    estimates = (*_bench_estimates(results), *(() if fitted is None else fitted.fit.estimates))
    new_set = with_estimates(before, estimates, valve)
    named = replace(new_set, parameter_set=_named(new_set, problem))
    return Identification(problem.name, beforehand, tuple(results), fitted, before, named)


@dataclass(frozen=True, slots=True)
class _Task:
    """A procedure with its recordings, and what messages call it."""

    item: ProcedureProblem
    sources: tuple[Source, ...]
    place: str


def _tasks(problem: ProblemFile, folder: Path, file: str, before: ParameterSet) -> list[_Task]:
    """Return the procedures in the recommended order, all recordings read; two of one kind stay in the file's order."""
    return [
        _Task(
            item,
            tuple(_source(folder, name, item.columns, problem, before) for name in item.recordings),
            f"{file}: procedure {number}, {item.kind}",
        )
        for number, item in sorted(enumerate(problem.procedure, start=1), key=lambda pair: _place(pair[1]))
    ]


def _refuse_twice(tasks: list[_Task], before: ParameterSet, valve: str, file: str) -> None:
    """Refuse samples that two recordings of one kind of procedure have in common."""
    for kind in RECOMMENDED_ORDER:
        uses = [
            Use(
                f"recording {number} of procedure {task.item.kind}",
                source.trace,
                source.recording,
                frozenset({kind}),
                *times,
            )
            for task in tasks
            if task.item.kind == kind
            for times in [window_of(task.item, Setting(before, valve, task.place))]
            for number, source in enumerate(task.sources, start=1)
        ]
        twice = used_twice(uses)
        if twice:
            raise IdentificationError(f"{file}: {twice}")


def _look(task: _Task, setting: Setting, tell: Tell) -> Beforehand:
    found = Beforehand(task.item.kind, prospects_of(task.sources, task.item, setting))
    missing = [prospect for prospect in found.prospects if not prospect.can_be_had]
    for prospect in missing:
        tell(f"{found.procedure}: cannot be had: {prospect.name}: {prospect.statement}")
    return found


def _bench_estimates(results: Iterable[BenchResult]) -> list[Estimate]:
    return [estimate for result in results for estimate in result.estimates]


def _trajectory(
    problem: ProblemFile,
    folder: Path,
    file: str,
    current: ParameterSet,
    bench: Mapping[str, Estimate],
    tell: Tell,
) -> TrajectoryOutcome | None:
    """Return the trajectory fit, on the device as the bench procedures left it; None where none is asked for."""
    if problem.trajectory is None:
        return None

    def read(item: ExperimentSection) -> Source:
        return _source(folder, item.recording, item.columns, problem, current)

    setting = FitSetting(read, folder, file, current, problem.device.valve, bench)
    return solve_section(problem.trajectory, setting, tell)


def _place(item: ProcedureProblem) -> int:
    return RECOMMENDED_ORDER.index(item.kind)


def _base_set(problem: ProblemFile, folder: Path) -> ParameterSet:
    name = problem.device.set
    beside = folder / name
    base = load_parameter_set(beside if beside.suffix == ".toml" else name)
    return apply_overrides(base, problem.device.overrides, problem.device.valve)


def _source(folder: Path, name: str, columns: str | None, problem: ProblemFile, parameter_set: ParameterSet) -> Source:
    path = folder / name
    atmosphere = atmospheric_pressure(parameter_set)
    if path.is_dir():
        raise IdentificationError(f"{path}: is a folder, which has no hash; name the recording in it")
    if columns is not None:
        recording = read_foreign(path, problem.columns[columns], atmosphere=atmosphere)
    else:
        recording = read_recording(path, atmosphere)
    return Source(recording, f"{path.name} sha256:{hashlib.sha256(read_bytes(path)).hexdigest()}")


def _named(new_set: NewSet, problem: ProblemFile) -> ParameterSet:
    old = new_set.parameter_set
    told = (
        f"Values with origin 'identified' or 'fitted' come from the problem '{problem.name}', the fitted ones being "
        f"weak or true for this model only; the others are those of '{old.name}'."
    )
    return replace(
        old,
        file=f"{problem.name}.toml",
        name=problem.name,
        title=problem.title or f"{old.title}, identified",
        notes=f"{old.notes.rstrip()}\n{told}".lstrip(),
    )
