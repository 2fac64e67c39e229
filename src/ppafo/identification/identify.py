"""From a problem to a parameter set: read the recordings, apply the procedures in order, put the values in."""

import hashlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from ppafo.errors import IdentificationError
from ppafo.identification.bench.result import BenchResult
from ppafo.identification.estimate import Estimate
from ppafo.identification.new_set import NewSet, with_estimates
from ppafo.identification.problem import ProblemFile, ProcedureProblem, load_problem
from ppafo.identification.procedures import RECOMMENDED_ORDER, Setting, run_procedure
from ppafo.identification.source import Source
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
class Identification:
    """The outcome of a problem: results in the order in which they were made, the set before and after."""

    name: str
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
    current, results = before, []
    # The sort is stable: two procedures of one kind stay in the order of the file.
    for number, item in sorted(enumerate(problem.procedure, start=1), key=lambda pair: _place(pair[1])):
        sources = tuple(_source(folder, name, item.columns, problem, current) for name in item.recordings)
        result = run_procedure(sources, item, Setting(current, valve, f"{file}: procedure {number}, {item.kind}"))
        results.append(result)
        current = with_estimates(current, result.estimates).parameter_set
    bench = {estimate.path: estimate for estimate in _bench_estimates(results)}
    fitted = _trajectory(problem, folder, f"{file}: trajectory", current, bench, tell)
    estimates = (*_bench_estimates(results), *(() if fitted is None else fitted.fit.estimates))
    new_set = with_estimates(before, estimates, valve)
    named = replace(new_set, parameter_set=_named(new_set, problem))
    return Identification(problem.name, tuple(results), fitted, before, named)


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
        f"Values with origin 'identified' come from the problem '{problem.name}'; the others are those of '{old.name}'."
    )
    return replace(
        old,
        file=f"{problem.name}.toml",
        name=problem.name,
        title=problem.title or f"{old.title}, identified",
        notes=f"{old.notes.rstrip()}\n{told}".lstrip(),
    )
