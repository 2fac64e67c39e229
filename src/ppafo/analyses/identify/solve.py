"""From a problem to a parameter set: read the recordings, apply the procedures in order, put the values in."""

from dataclasses import dataclass, replace
from pathlib import Path

from ppafo.analyses.identify.answer import Identification
from ppafo.errors import IdentificationError
from ppafo.identification.bench.result import BenchResult
from ppafo.identification.new_set import with_estimates
from ppafo.identification.problem import (
    PROCEDURES,
    ProblemFile,
    ProcedureProblem,
    Setting,
    run_procedure,
    window_of,
)
from ppafo.identification.source import Source, Use, double_use, source_of
from ppafo.identification.tolerances import tolerances_of
from ppafo.identification.trajectory.section import Setting as FitSetting
from ppafo.identification.trajectory.section import solve_section
from ppafo.parameters.audit import audit
from ppafo.parameters.loading import list_sets, load_parameter_set
from ppafo.parameters.overrides import check_valve, read_overrides, with_overrides
from ppafo.parameters.parameter_set import ParameterSet, atmospheric_pressure, chosen_valve, number_in_si
from ppafo.progress import Report, report_nothing
from ppafo.storage.foreign import read_foreign
from ppafo.storage.result_folder import read_recording
from ppafo.units.shown import shown_in


def solve_problem(problem: ProblemFile, folder: Path, file: str, progress: Report = report_nothing) -> Identification:
    """Return the outcome of a problem whose paths begin in ``folder``; ``file`` is what messages call it.

    Raises the errors of ``identify``.
    """
    before = _base_set(problem, folder)
    with shown_in(before.shown):
        return _solved(problem, before, folder, file, progress)


def _solved(problem: ProblemFile, before: ParameterSet, folder: Path, file: str, progress: Report) -> Identification:
    valve = chosen_valve(before, problem.device.valve)
    current, results = before, list[BenchResult]()
    tasks = [
        _Task(
            use,
            tuple(_source(folder, name, use.columns, problem, before, file) for name in use.recordings),
            f"{file}: procedure {number}, {use.kind}",
        )
        for number, use in sorted(
            enumerate(problem.procedure, start=1), key=lambda pair: PROCEDURES.index(pair[1].kind)
        )
    ]
    # One recording may serve two procedures, which ask it other things, but not one procedure twice.
    found: list[Use] = []
    for kind in PROCEDURES:
        uses = [
            Use(f"recording {number} of procedure {kind}", source.trace, source.recording, frozenset(), *times)
            for task in tasks
            if task.item.kind == kind
            for times in [window_of(task.item, Setting(before, valve, task.place))]
            for number, source in enumerate(task.sources, start=1)
        ]
        twice = double_use(uses)
        if twice:
            raise IdentificationError(f"{file}: {twice}")
        found += uses
    used = tuple(found)
    stated = tolerances_of(problem.bench, file)
    for task in tasks:
        result = run_procedure(task.sources, task.item, Setting(current, valve, task.place, stated))
        results.append(result)
        # The next procedure leans on what this one found; the new set is made of the old one at the end.
        current = with_estimates(current, result.estimates).parameter_set
    of_bench = [estimate for result in results for estimate in result.estimates]
    setting = FitSetting(
        lambda use: _source(folder, use.recording, use.columns, problem, current, file),
        folder,
        f"{file}: trajectory",
        current,
        problem.device.valve,
        {estimate.path: estimate for estimate in of_bench},
        used,
        stated,
    )
    fitted = None if problem.trajectory is None else solve_section(problem.trajectory, setting, progress)
    estimates = (*of_bench, *(() if fitted is None else fitted.fit.estimates))
    new_set = with_estimates(before, estimates, valve)
    outcome = Identification(problem.name, tuple(results), fitted, before, new_set)
    return replace(outcome, new_set=replace(new_set, parameter_set=_name_set(outcome, problem)))


@dataclass(frozen=True, slots=True)
class _Task:
    """A procedure with its recordings, and what messages call it."""

    item: ProcedureProblem
    sources: tuple[Source, ...]
    place: str


def _base_set(problem: ProblemFile, folder: Path) -> ParameterSet:
    name = problem.device.set
    beside = folder / name
    base = load_parameter_set(beside if beside.suffix == ".toml" else name)
    valve, overrides = problem.device.valve, read_overrides(problem.device.overrides)
    check_valve(overrides, valve, f"device.valve = '{valve}'")
    return with_overrides(base, overrides, valve)


def _source(
    folder: Path, name: str, columns: str | None, problem: ProblemFile, parameter_set: ParameterSet, file: str
) -> Source:
    path = folder / name
    atmosphere = atmospheric_pressure(parameter_set)
    if path.is_dir():
        raise IdentificationError(f"{path}: is a folder, which has no hash; name the recording in it")
    if columns is not None:
        molar_mass = number_in_si(parameter_set, "gas.molar_mass")
        gas = "" if molar_mass is None else f"{molar_mass!r} kg/mol"
        recording = read_foreign(path, problem.columns[columns], None, atmosphere, f"{file}:{columns}", gas)
    else:
        recording = read_recording(path, atmosphere=atmosphere)
    return source_of(path, recording)


_FILES_IN_TITLE = 4
_REPORTED = "reported."


def _name_set(identification: Identification, problem: ProblemFile) -> ParameterSet:
    old, new = identification.new_set.parameter_set, identification.new_set
    files = recording_files(problem)
    left_out = len(files) - _FILES_IN_TITLE
    shown = ", ".join(files[:_FILES_IN_TITLE]) + (f" and {left_out} more" if left_out > 0 else "")
    is_changed = "identified" if new.written or new.fitted else "no value identified"
    changes = f" with {', '.join(problem.device.overrides)}" if problem.device.overrides else ""
    origins = (
        f"Values with origin 'identified' or 'fitted' come from the problem '{problem.name}', on the set '{old.name}'"
        f"{changes} from {identification.kind} recordings: {', '.join(files)}; the fitted are true for this model "
        f"only, the others from '{old.name}'."
    )
    if new.written or new.fitted:
        # Of a device that was measured, what others report of another one says nothing.
        is_of_report = {
            finding.id
            for finding in audit(identification.before)
            if any(value.path.startswith(_REPORTED) for value in finding.values)
        }
        old = replace(
            old,
            numbers={path: entry for path, entry in old.numbers.items() if not path.startswith(_REPORTED)},
            accepted={name: why for name, why in old.accepted.items() if name not in is_of_report},
        )
    return replace(
        old,
        file=f"{problem.name}.toml",
        name=problem.name,
        title=problem.title or f"{old.title}, {is_changed} on {old.name} from {shown}",
        citation=problem.citation or old.citation,
        # The new set may go anywhere, where the path of a file would not lead to its parent.
        parent=problem.device.set if problem.device.set in list_sets() else "",
        notes=f"{old.notes.rstrip()}\n{origins}".lstrip(),
    )


def recording_files(problem: ProblemFile) -> list[str]:
    """Return the names of the recordings of a problem, with the folder where two have one name."""
    named = [name for use in problem.procedure for name in use.recordings]
    named += (
        [] if problem.trajectory is None else [experiment.recording for experiment in problem.trajectory.experiments]
    )
    paths = dict.fromkeys(map(Path, named))
    names = [path.name for path in paths]
    return ["/".join(path.parts[-2:]) if names.count(path.name) > 1 else path.name for path in paths]
