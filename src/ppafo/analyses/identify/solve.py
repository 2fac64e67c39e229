"""Identification of a parameter set from a problem file: recordings, procedures in order, new parameter set."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from ppafo.analyses.identify.answer import Identification
from ppafo.errors import IdentificationError, PpafoError, noted_in, raise_noted
from ppafo.identification.bench.law import BenchResult
from ppafo.identification.new_set import with_estimates
from ppafo.identification.problem import DeviceProblem, ExperimentSection, ProblemFile
from ppafo.identification.procedures import (
    PROCEDURES,
    FlowProblem,
    ProcedureContext,
    ProcedureProblem,
    check_needed_channels,
    run_procedure,
    window_of,
)
from ppafo.identification.source import RecordingSource, UsedRecording, double_use, source_of
from ppafo.identification.tolerances import Tolerances, tolerances_of
from ppafo.identification.trajectory.section import SectionContext, solve_section
from ppafo.parameters.audit import findings_of
from ppafo.parameters.loading import list_sets, load_parameter_set
from ppafo.parameters.overrides import check_valve, read_overrides, with_overrides
from ppafo.parameters.parameter_set import Citation, ParameterSet, atmospheric_pressure, chosen_valve, number_in_si
from ppafo.progress import Report, report_nothing
from ppafo.signals.recording import TIME
from ppafo.storage.column_map import MappedChannel
from ppafo.storage.comma_separated import read_csv
from ppafo.storage.foreign import read_trials
from ppafo.storage.reading import TEXT_SUFFIXES, read_recording
from ppafo.storage.result_folder import RUN_FILE
from ppafo.units.shown import counted_from, shown_in

_FILES_IN_TITLE = 4
"""Largest number of recordings named in the title of the new set; the notes of the set name all."""
_REPORTED = "reported."
"""Prefix of the paths of values that a publication reports about its own device."""


def solve_problem(problem: ProblemFile, folder: Path, file: str, progress: Report = report_nothing) -> Identification:
    """Solve an identification problem: procedures in order, trajectory fit, new parameter set.

    Paths are relative to ``folder``; ``file`` is the name used in error messages. The procedures run first, in the
    order in which each depends on the earlier ones, then the section [trajectory]. Raises the errors of ``identify``.
    """
    device = problem.device
    before = _set_of_device(device, folder)
    with shown_in(counted_from(before.shown, atmospheric_pressure(before))):
        valve = chosen_valve(before, device.valve)
        reader = _RecordingReader(problem=problem, folder=folder, file=file, parameter_set=before)
        tasks = _tasks_in_order(reader)
        used = _used_recordings(tasks, before, valve, file)
        tolerances = tolerances_of(problem.bench, file)
        results, current = _bench_results(tasks, before, valve, tolerances)
        estimates = [estimate for result in results for estimate in result.estimates]
        trajectory = None
        if problem.trajectory is not None:
            section = SectionContext(
                read=reader._replace(parameter_set=current).read_experiment,
                folder=folder,
                file=f"{file}: trajectory",
                parameter_set=current,
                valve=device.valve,
                bench={estimate.path: estimate for estimate in estimates},
                used=used,
                tolerances=tolerances,
            )
            trajectory = solve_section(problem.trajectory, section, progress)
            estimates += trajectory.fit.estimates
        new_set = with_estimates(before, estimates, valve)
        identification = Identification(problem.name, results, trajectory, before, new_set)
        described = replace(new_set, parameter_set=_described_set(identification, problem))
        return replace(identification, new_set=described)


def _set_of_device(device: DeviceProblem, folder: Path) -> ParameterSet:
    """Return the parameter set of the measured device, with the overrides of the problem file."""
    beside = folder / device.set
    base = load_parameter_set(beside if beside.suffix == ".toml" else device.set)
    overrides = read_overrides(device.overrides)
    check_valve(overrides, device.valve, f"device.valve = '{device.valve}'")
    return with_overrides(base, overrides, device.valve)


_ROW_TIMES = dict.fromkeys(("static-torque", "open-valve-flow", "valve-map"), 1.0)
"""Time between rows of a table without a time column [s], for procedures whose laws do not depend on time."""


class _RecordingReader(NamedTuple):
    """Reader of the recordings that a problem file names.

    ``folder`` is the base of relative paths, ``file`` the name of the problem file in messages. ``parameter_set``
    provides the atmosphere for gauge pressures, and the gas for volume flows if the reader is not given one.
    """

    problem: ProblemFile
    folder: Path
    file: str
    parameter_set: ParameterSet

    def read(
        self, name: str, columns: str | None, row_time: float | None = None, gas: str | None = None
    ) -> tuple[RecordingSource, ...]:
        """Return the recordings in a file, read through the column map ``columns`` if one is given.

        ``row_time`` [s] is the time between the rows of a table of text, or of a column map, without a time column;
        None requires the column. ``gas`` is the gas of volume flows.
        """
        path, atmosphere = self.folder / name, atmospheric_pressure(self.parameter_set)
        if path.is_dir():
            raise IdentificationError(f"{path}: is a folder, not a recording; give the recording in the folder")
        is_text = path.suffix.lower() in TEXT_SUFFIXES and not (path.parent / RUN_FILE).exists()
        if columns is None and row_time is not None and is_text:
            return (source_of(path, read_csv(path, atmosphere=atmosphere, row_time=row_time)),)
        if columns is None:
            return (source_of(path, read_recording(path, atmosphere=atmosphere)),)
        molar_mass = number_in_si(self.parameter_set, "gas.molar_mass")
        flowing = gas or ("" if molar_mass is None else f"{molar_mass!r} kg/mol")
        column_map = self.problem.columns[columns]
        # A direction from a rate, and trials that begin anew, need the times of the bench.
        if row_time is not None and not (TIME in column_map.channels or column_map.direction or column_map.trial):
            time = MappedChannel(rate=f"{1.0 / row_time!r} Hz")
            column_map = column_map.model_copy(update={"channels": {TIME: time, **column_map.channels}})
        recordings = read_trials(path, column_map, atmosphere, f"{self.file}:{columns}", flowing)
        return tuple(source_of(path, recording, recording.label.removeprefix(path.stem)) for recording in recordings)

    def read_experiment(self, experiment: ExperimentSection) -> RecordingSource:
        """Return the recording of an experiment; IdentificationError for a file with several recordings."""
        source, *others = self.read(experiment.recording, experiment.columns)
        if others:
            raise IdentificationError(
                f"{experiment.recording}: columns.{experiment.columns}.trial selects {1 + len(others)} trials, but an "
                "experiment has one recording; name one trial"
            )
        return source


@dataclass(frozen=True, slots=True)
class _Task:
    """Identification procedure with its recordings, and the name used in error messages."""

    procedure: ProcedureProblem
    sources: tuple[RecordingSource, ...]
    label: str


def _tasks_in_order(reader: _RecordingReader) -> list[_Task]:
    """Return the procedures of a problem with their recordings, each after the procedures whose results it uses."""
    tasks = []
    for number, procedure in enumerate(reader.problem.procedure, start=1):
        row_time, gas = _ROW_TIMES.get(procedure.kind), procedure.gas if isinstance(procedure, FlowProblem) else None
        sources = list[RecordingSource]()
        for recording in procedure.recordings:
            wrong: list[PpafoError] = []
            with noted_in(wrong):
                sources += reader.read(recording, procedure.columns, row_time, gas)
            if wrong and procedure.columns is not None:
                # What the map lacks is said with what is wrong in it.
                with noted_in(wrong):
                    mapped = reader.problem.columns[procedure.columns]
                    derived = {} if mapped.direction is None else {"direction": None}
                    names = [name for name in mapped.channels | derived if name != TIME]
                    check_needed_channels(recording, procedure, names)
            raise_noted(wrong)
        tasks.append(_Task(procedure, tuple(sources), f"{reader.file}: procedure {number}, {procedure.kind}"))
    return sorted(tasks, key=lambda task: PROCEDURES.index(task.procedure.kind))


def _bench_results(
    tasks: Sequence[_Task], before: ParameterSet, valve: str, tolerances: Tolerances
) -> tuple[tuple[BenchResult, ...], ParameterSet]:
    """Return the results of bench procedures in order, and the set in which each found the earlier estimates."""
    results, current = list[BenchResult](), before
    for task in tasks:
        context = ProcedureContext(current, valve, task.label, tolerances)
        found = run_procedure(task.sources, task.procedure, context)
        results.append(found)
        current = with_estimates(current, found.estimates).parameter_set
    return tuple(results), current


def _used_recordings(tasks: Sequence[_Task], before: ParameterSet, valve: str, file: str) -> tuple[UsedRecording, ...]:
    """Return the use of each recording by each procedure.

    A recording may serve two different procedures. Raises IdentificationError if a procedure uses a recording twice.
    """
    by_procedure: dict[str, list[UsedRecording]] = {}
    for task in tasks:
        kind = task.procedure.kind
        window = window_of(task.procedure, ProcedureContext(before, valve, task.label))
        for number, source in enumerate(task.sources, start=1):
            name = f"recording {number} of procedure {kind}"
            used = UsedRecording(name, source.trace, source.recording, frozenset(), *window)
            by_procedure.setdefault(kind, []).append(used)
    for recordings in by_procedure.values():
        if used_twice := double_use(recordings):
            raise IdentificationError(f"{file}: {used_twice}")
    return tuple(used for recordings in by_procedure.values() for used in recordings)


def _described_set(identification: Identification, problem: ProblemFile) -> ParameterSet:
    """Return the new set with name, title, citation and notes that state the recordings behind its values.

    Values reported by others for another device are left out if the set has identified values.
    """
    old, new = identification.new_set.parameter_set, identification.new_set
    named = [name for procedure in problem.procedure for name in procedure.recordings]
    if problem.trajectory is not None:
        named += [experiment.recording for experiment in problem.trajectory.experiments]
    paths = dict.fromkeys(map(Path, named))
    names = [path.name for path in paths]
    files = ["/".join(path.parts[-2:]) if names.count(path.name) > 1 else path.name for path in paths]
    more = len(files) - _FILES_IN_TITLE
    shown = ", ".join(files[:_FILES_IN_TITLE]) + (f" and {more} more" if more > 0 else "")
    outcome = "identified" if new.written or new.fitted else "no value identified"
    changes = f" with {', '.join(problem.device.overrides)}" if problem.device.overrides else ""
    origins = (
        f"Values with origin 'identified' or 'fitted' come from the problem '{problem.name}', on the set '{old.name}'"
        f"{changes} from {identification.kind} recordings: {', '.join(files)}; 'fitted' values hold for this model "
        f"only. All other values come from '{old.name}'."
    )
    if new.written or new.fitted:
        # Values reported of another device do not describe the measured one.
        reported_findings = {
            finding.id
            for finding in findings_of(identification.before)
            if any(value.path.startswith(_REPORTED) for value in finding.values)
        }
        old = replace(
            old,
            numbers={path: entry for path, entry in old.numbers.items() if not path.startswith(_REPORTED)},
            accepted={name: why for name, why in old.accepted.items() if name not in reported_findings},
        )
    return replace(
        old,
        file=f"{problem.name}.toml",
        name=problem.name,
        title=problem.title or f"{old.title}, {outcome} on {old.name} from {shown}",
        citation=old.citation if (cited := problem.citation) is None else Citation(**cited.model_dump()),
        # The new set may go anywhere, where the path of a file would not lead to its parent.
        parent=problem.device.set if problem.device.set in list_sets() else "",
        notes=f"{old.notes.rstrip()}\n{origins}".lstrip(),
    )
