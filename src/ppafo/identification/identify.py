"""From a problem to a parameter set: read the recordings, apply the procedures in order, put the values in."""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

from ppafo.errors import IdentificationError
from ppafo.identification.bench.result import BenchResult
from ppafo.identification.estimate import Estimate
from ppafo.identification.new_set import NewSet, with_estimates
from ppafo.identification.problem import ProblemFile, ProcedureProblem, load_problem
from ppafo.identification.procedures import RECOMMENDED_ORDER, Setting, run_procedure
from ppafo.identification.source import Source
from ppafo.parameters.loading import load_parameter_set
from ppafo.parameters.overrides import apply_overrides
from ppafo.parameters.parameter_set import ParameterSet, atmospheric_pressure, chosen_valve
from ppafo.storage.column_map import ColumnMap
from ppafo.storage.files import read_bytes
from ppafo.storage.foreign import read_foreign
from ppafo.storage.recordings import read_recording


@dataclass(frozen=True, slots=True)
class Identification:
    """The outcome of a problem: results in the order in which they were made, the set before and after."""

    name: str
    results: tuple[BenchResult, ...]
    before: ParameterSet
    new_set: NewSet

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """All estimates of all procedures."""
        return tuple(estimate for result in self.results for estimate in result.estimates)

    @property
    def is_good(self) -> bool:
        """Whether every check holds and the new set makes a device where the old one did."""
        return not self.new_set.problem and not any(result.failed for result in self.results)


def identify(path: str | Path) -> Identification:
    """Return what the problem file's procedures make of its recordings, in the recommended order."""
    problem, folder = load_problem(path), Path(path).parent
    return solve_problem(problem, folder, Path(path).name)


def solve_problem(problem: ProblemFile, folder: Path, file: str) -> Identification:
    """Return the outcome of a problem whose paths begin in ``folder``; ``file`` is what messages call it."""
    before = _base_set(problem, folder)
    valve = chosen_valve(before, problem.device.valve)
    current, results = before, []
    # The sort is stable: two procedures of one kind stay in the order of the file.
    for number, item in sorted(enumerate(problem.procedure, start=1), key=lambda pair: _place(pair[1])):
        sources = tuple(_source(folder, name, item, problem.columns, current) for name in item.recordings)
        result = run_procedure(sources, item, Setting(current, valve, f"{file}: procedure {number}, {item.kind}"))
        results.append(result)
        current = with_estimates(current, result.estimates).parameter_set
    new_set = with_estimates(before, [item for result in results for item in result.estimates], valve)
    return Identification(
        problem.name, tuple(results), before, replace(new_set, parameter_set=_named(new_set, problem))
    )


def _place(item: ProcedureProblem) -> int:
    return RECOMMENDED_ORDER.index(item.kind)


def _base_set(problem: ProblemFile, folder: Path) -> ParameterSet:
    name = problem.device.set
    beside = folder / name
    base = load_parameter_set(beside if beside.suffix == ".toml" else name)
    return apply_overrides(base, problem.device.overrides, problem.device.valve)


def _source(
    folder: Path, name: str, item: ProcedureProblem, columns: dict[str, ColumnMap], parameter_set: ParameterSet
) -> Source:
    path = folder / name
    atmosphere = atmospheric_pressure(parameter_set)
    if path.is_dir():
        raise IdentificationError(f"{path}: is a folder, which has no hash; name the recording in it")
    if item.columns is not None:
        recording = read_foreign(path, columns[item.columns], atmosphere=atmosphere)
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
