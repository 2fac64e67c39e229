"""Identification of a parameter set from a problem file: recordings, procedures in order, new set, report, figures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from ppafo.arguments import Word, checked
from ppafo.errors import IdentificationError, PpafoError, noted_in, raise_noted
from ppafo.identification.estimate import Estimate, Identified
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Report, report_nothing
from ppafo.units.shown import counted_from, in_units, shown_in
from ppafo.wording import count_of, percentage

if TYPE_CHECKING:
    from ppafo.identification.bench.law import BenchResult
    from ppafo.identification.new_set import NewSet
    from ppafo.identification.problem import ExperimentSection, ProblemFile
    from ppafo.identification.procedures import BenchProblem
    from ppafo.identification.source import RecordingSource, UsedRecording
    from ppafo.identification.trajectory.fitting import NuisanceParameter, TrajectoryFit
    from ppafo.parameters.parameter_set import ParameterSet
    from ppafo.report.finding import Finding, Section
    from ppafo.report.panels import Panel
    from ppafo.signals import Recording, RecordingKind

Problem = Annotated[str | Path, Word("PROBLEM", Path)]
_FAR = 2.0
"""Number of standard deviations above which a tolerance counts as contradicted by the recordings."""
_FAR_FROM_SET = 5.0
"""Ratio to the value of the set from which it is remarked on [-]: psi read as kPa makes 6.89."""
_FILES_IN_TITLE = 4
"""Largest number of recordings named in the title of the new set; the notes of the set name all."""
_ROW_TIME = 1.0
"""Time between the rows of a table of steady readings without times [s]."""
_REPORTED = "reported."
"""Prefix of the paths of values that a publication reports about its own device."""


@dataclass(frozen=True, slots=True)
class Identification:
    """Result of an identification: estimates of procedures and trajectory fit, and the new parameter set.

    ``name``: name of the problem
    ``results``: results of the procedures, in the order of their evaluation
    ``trajectory``: result of the trajectory fit; None without one
    ``before``: parameter set before the identification
    ``new_set``: parameter set with the identified values
    """

    name: str
    results: tuple[BenchResult, ...]
    trajectory: TrajectoryFit | None
    before: ParameterSet
    new_set: NewSet

    @property
    def shown(self) -> dict[str, str]:
        """Display units of the set before, by SI unit."""
        from ppafo.parameters.parameter_set import atmospheric_pressure

        return counted_from(self.before.shown, atmospheric_pressure(self.before))

    @property
    def parts(self) -> tuple[Identified, ...]:
        """Results of all procedures, followed by that of the trajectory fit."""
        return (*self.results, *(() if self.trajectory is None else (self.trajectory,)))

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """Estimates of all procedures, followed by the estimates of the trajectory fit."""
        return tuple(estimate for part in self.parts for estimate in part.estimates)

    @property
    def is_good(self) -> bool:
        """True if the recordings agree, no unit is probably wrong, and the new set is a valid, consistent device."""
        return not self.new_set.problem and not self.kept_beside_fitted and all(part.is_good for part in self.parts)

    @property
    def kept_beside_fitted(self) -> list[str]:
        """Paths that the new set keeps as they were, although its new values were fitted together with them."""
        from ppafo.parameters.parameter_set import number_in_si

        fitted_together = () if self.trajectory is None else self.trajectory.estimates
        new = {*self.new_set.written, *self.new_set.fitted}
        if not any(estimate.path in new for estimate in fitted_together):
            return []
        return sorted(
            estimate.path
            for estimate in fitted_together
            if estimate.path in self.before.declarations().keys() - new
            # A set without the number has none of the effect, as a fit that ends at zero.
            and estimate.value != (number_in_si(self.before, estimate.path) or 0.0)
        )

    @property
    def kind(self) -> RecordingKind:
        """Common origin of all recordings: measured, simulated or synthetic."""
        from ppafo.identification.source import kind_of

        return kind_of(part.kind for part in self.parts)

    def json_document(self) -> dict[str, Any]:
        """Return estimates, checks and the new set as plain data in SI; rows of matrices follow the estimates."""
        from ppafo.documents.json_text import fields_of, plain

        parts = [
            {
                **fields_of(part, "procedure", "summary", "conflict"),
                "recordings_are": part.kind,
                "estimates": [plain(item) | {"verdict_text": item.verdict_text} for item in part.estimates],
                "remarks": list(part.remarks),
            }
            for part in self.parts
        ]
        document = {
            "problem": self.name,
            "started_from": self.before.name,
            "is_good": self.is_good,
            "procedures": parts[: len(self.results)],
            "new_set": {
                "file": f"{self.name}.toml",
                "identified": list(self.new_set.written),
                "fitted": list(self.new_set.fitted),
                "problem": self.new_set.problem,
            },
        }
        # A problem without a fit has no such key, so that its document says what was asked.
        if self.trajectory is None:
            return document
        fit = self.trajectory
        recordings = [
            {
                **fields_of(experiment, "label", "source"),
                "kind": experiment.recording.kind,
                "scenario": experiment.scenario.name,
                "inputs": list(experiment.inputs),
                # Those of the window that was fitted, not of the file.
                "samples": len(measurement),
            }
            for experiment, measurement in zip(fit.problem.experiments, fit.measurements, strict=True)
        ]
        document["trajectory"] = {
            **parts[-1],
            "recordings": recordings,
            "confidence": fit.problem.confidence,
            **fields_of(fit.fit, "evaluations", "has_converged"),
            "covariance": fit.covariance.tolist(),
            "correlation": fit.correlation.tolist(),
            "tolerances": [plain(tolerance) for tolerance in fit.known],
            "channels": [plain(channel) for channel in fit.channels],
            "conflict": None if fit.fit.conflict is None else plain(fit.fit.conflict),
            "not_identifiable": [dict(combination) for combination in fit.fit.unidentified],
            "next_experiments": [plain(experiment) for experiment in fit.expected],
        }
        return document


@checked
def identify(
    problem: Problem,
    *,
    plugins: Plugins = (),
    progress: Report = report_nothing,
) -> Finding[Identification]:
    """Identify a parameter set, with uncertainty, from bench recordings.

    The procedures of the problem file run in the recommended order; the trajectory fit comes last and starts from the
    estimates of the procedures.

    Arguments:
        problem: a problem file (.toml); see 'ppafo doctor --schema identification'
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is an Identification: estimates in SI units with their uncertainty, and the new
        parameter set

    Raises:
        IdentificationError: a problem that makes no sense
        ParameterError: a parameter set that makes no sense
        DataError: a recording that cannot be read

    >>> import ppafo
    >>> from ppafo.cli.new import new
    >>> written = new("example", "measured-cylinder")
    >>> print(str(ppafo.identify("measured-cylinder/cylinder.toml")).splitlines()[0])
    static-torque: 80 readings, 80 repetitions; scatter 0.233 N
    """
    name_plugins(plugins)
    from ppafo.identification.problem import load_problem

    path = Path(problem)
    return finding_of(_solved(load_problem(path), path.parent, path.name, progress))


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
        from ppafo.identification.source import source_of
        from ppafo.parameters.parameter_set import atmospheric_pressure, number_in_si
        from ppafo.signals.recording import TIME
        from ppafo.storage.column_map import MappedChannel
        from ppafo.storage.comma_separated import read_csv
        from ppafo.storage.foreign import read_trials
        from ppafo.storage.reading import TEXT_SUFFIXES, read_recording
        from ppafo.storage.result_folder import RUN_FILE

        path, atmosphere = self.folder / name, atmospheric_pressure(self.parameter_set)
        if columns is None:
            is_text = path.suffix.lower() in TEXT_SUFFIXES and not (path.parent / RUN_FILE).exists()
            if row_time is not None and is_text:
                return (source_of(path, read_csv(path, atmosphere=atmosphere, row_time=row_time)),)
            return (source_of(path, read_recording(path, atmosphere=atmosphere)),)
        molar_mass = number_in_si(self.parameter_set, "gas.molar_mass")
        flowing = gas or ("" if molar_mass is None else f"{molar_mass!r} kg/mol")
        column_map = self.problem.columns[columns]
        # A direction from a rate, and trials that begin anew, need the times of the bench.
        if row_time is not None and not (TIME in column_map.channels or column_map.direction or column_map.trial):
            time = MappedChannel(rate=f"{1.0 / row_time!r} Hz")
            column_map = replace(column_map, channels={TIME: time, **column_map.channels})
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


class _Task(NamedTuple):
    """Identification procedure with its recordings, and the name used in error messages."""

    procedure: BenchProblem
    sources: tuple[RecordingSource, ...]
    label: str


def _solved(problem: ProblemFile, folder: Path, file: str, progress: Report) -> Identification:
    """Solve an identification problem: procedures, each after those whose results it uses, trajectory fit, new set.

    Paths are relative to ``folder``; ``file`` is the name used in error messages.
    """
    from ppafo.identification.bench.law import BenchContext
    from ppafo.identification.new_set import with_estimates
    from ppafo.identification.procedures import run_procedure
    from ppafo.identification.tolerances import DEFAULTS
    from ppafo.identification.trajectory.section import SectionContext, solve_section
    from ppafo.parameters.loading import load_parameter_set
    from ppafo.parameters.overrides import check_valve, read_overrides, with_overrides
    from ppafo.parameters.parameter_set import atmospheric_pressure

    device = problem.device
    beside = folder / device.set
    base = load_parameter_set(beside if beside.suffix == ".toml" else device.set)
    overrides = read_overrides(device.overrides)
    check_valve(overrides, device.valve, f"device.valve = '{device.valve}'")
    before = current = with_overrides(base, overrides, device.valve)
    with shown_in(counted_from(before.shown, atmospheric_pressure(before))):
        reader = _RecordingReader(problem=problem, folder=folder, file=file, parameter_set=before)
        tasks = _tasks_in_order(reader)
        used = _used_recordings(tasks, file)
        tolerances = problem.bench or DEFAULTS
        results: list[BenchResult] = []
        for task in tasks:
            context = BenchContext(current, device.valve, task.label, tolerances)
            results.append(run_procedure(task.sources, task.procedure, context))
            # Each procedure finds the estimates of earlier ones in the set.
            current = with_estimates(current, results[-1].estimates).parameter_set
        estimates = [estimate for result in results for estimate in result.estimates]
        trajectory = None
        if problem.trajectory is not None:
            section = SectionContext(
                *(current, device.valve, f"{file}: trajectory", tolerances),
                read=reader._replace(parameter_set=current).read_experiment,
                folder=folder,
                bench={estimate.path: estimate for estimate in estimates},
                used=used,
            )
            trajectory = solve_section(problem.trajectory, section, progress)
            estimates += trajectory.estimates
        new_set = with_estimates(before, estimates, device.valve)
        identification = Identification(problem.name, tuple(results), trajectory, before, new_set)
        described = replace(new_set, parameter_set=_described_set(identification, problem))
        return replace(identification, new_set=described)


def _tasks_in_order(reader: _RecordingReader) -> list[_Task]:
    """Return the procedures of a problem with their recordings, each after the procedures whose results it uses."""
    from ppafo.identification.procedures import LAWS, check_needed_channels
    from ppafo.signals.recording import TIME

    tasks = []
    for number, procedure in enumerate(reader.problem.procedure, start=1):
        row_time = _ROW_TIME if procedure.kind in procedure.steady else None
        gas = getattr(procedure, "gas", None)
        sources: list[RecordingSource] = []
        for recording in procedure.recordings:
            wrong = list[PpafoError]()
            with noted_in(wrong):
                sources += reader.read(recording, procedure.columns, row_time, gas)
            if wrong and procedure.columns is not None:
                # Missing channels of the map are said with what is wrong in it.
                mapped = reader.problem.columns[procedure.columns]
                names = [name for name in mapped.channels if name != TIME]
                with noted_in(wrong):
                    check_needed_channels(recording, procedure, [*names, *(["direction"] if mapped.direction else [])])
            raise_noted(wrong)
        tasks.append(_Task(procedure, tuple(sources), f"{reader.file}: procedure {number}, {procedure.kind}"))
    return sorted(tasks, key=lambda task: [*LAWS].index(task.procedure.kind))


def _used_recordings(tasks: Sequence[_Task], file: str) -> tuple[UsedRecording, ...]:
    """Return the use of each recording by each procedure.

    A recording may serve two different procedures. Raises IdentificationError if a procedure uses a recording twice.
    """
    from ppafo.identification.source import UsedRecording, double_use

    used = list[UsedRecording]()
    for task in tasks:
        kind = task.procedure.kind
        # Steady readings have no times: each counts by itself.
        first, last = (getattr(task.procedure, name, None) for name in ("start", "end"))
        window = -math.inf if first is None else first, math.inf if last is None else last
        for number, source in enumerate(task.sources, start=1):
            name = f"recording {number} of procedure {kind}"
            used.append(UsedRecording(name, source.trace, source.recording, frozenset(), *window, kind))
    if used_twice := double_use(used):
        raise IdentificationError(f"{file}: {used_twice}")
    return tuple(used)


def _described_set(identification: Identification, problem: ProblemFile) -> ParameterSet:
    """Return the new set with name, title, citation and notes that state the recordings behind its values.

    Values reported by others for another device are left out if the set has identified values.
    """
    from ppafo.parameters.audit import findings_of
    from ppafo.parameters.loading import list_sets

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
        citation=old.citation if problem.citation is None else problem.citation,
        # The new set may go anywhere, where the path of a file would not lead to its parent.
        parent=problem.device.set if problem.device.set in list_sets() else "",
        notes=f"{old.notes.rstrip()}\n{origins}".lstrip(),
    )


@in_units(lambda identification: identification.shown)
def finding_of(identification: Identification) -> Finding[Identification]:
    """Return an identification as a finding; passed if the recordings agree and the new set is valid and consistent."""
    from ppafo.parameters.loading import parameter_set_toml
    from ppafo.report.finding import Finding, Section

    name, new_set, before = identification.name, identification.new_set, identification.before
    fit = identification.trajectory
    parts, more = [_part(result, (), before) for result in identification.results], list[str]()
    if fit is not None:
        for number, item in enumerate(fit.expected, start=1):
            fraction = 1.0 - item.shrinkage[item.most_helped]
            more.append(
                f"next experiment {number}: {item.label}: gain {item.gain:.2f}; largest for {item.most_helped}, "
                f"whose interval would shrink by {fraction:.0%}"
            )
        shown = _part(fit, _tolerances(fit.known, before), before)
        parts.append(replace(shown, remarks=[*shown.remarks, *more]))
    written, fitted = new_set.written, new_set.fitted
    # A value that holds for this model only is in the set as well, and is never counted as identified.
    # Other numbers may be identified too, such as the zero of a scale, for which a set has no place.
    count = "no value of the set identified" if fitted else "not written, since no value was identified"
    if written:
        count = f"{count_of(len(written), 'value')} of the set identified: {', '.join(written)}"
    fitted_text = f"; for this model only: {', '.join(fitted)}" if fitted else ""
    problem = [f"the new set is not a complete device yet: {new_set.problem}"] if new_set.problem else []
    if kept := identification.kept_beside_fitted:
        problem.append(
            f"not passed (exit code 1): the new set keeps its own {' and '.join(kept)}, with which its other values "
            "were not fitted"
        )
    # As they are remarks among others, these that prevent a pass are repeated at the end.
    problem += [f"not passed (exit code 1): {fault}" for part in identification.parts for fault in part.faults]
    return Finding(
        name="identify",
        kicker="Identification",
        title=f"The parameter set {name}",
        said=(),
        parts=(*parts, Section(said=(f"new set '{name}': {count}{fitted_text}", *problem)), *_figures(identification)),
        found=identification,
        passed=identification.is_good,
        kind=identification.kind,
        # A set without a new value would be the one before under another name.
        files={f"{name}.toml": lambda: parameter_set_toml(new_set.parameter_set).encode()} if written or fitted else {},
    )


def _part(part: Identified, tolerances: Iterable[str], before: ParameterSet) -> Section:
    """Return the section of a procedure or of the fit: its estimates in the units of the set, and its remarks."""
    from ppafo.identification.estimate import interval_texts
    from ppafo.identification.new_set import in_set_unit
    from ppafo.report.finding import Section, columns_of

    rows = list[tuple[str, ...]]()
    said = [f"holds for this model only: {part.conflict}"] if part.conflict else []
    far = list[str]()
    for item in part.estimates:
        # Of a conflict the explanation of each number is the one sentence that stands above.
        said += [f"{item.path}: {item.explanation}"] if item.explanation != part.conflict else []
        numbers = [_shown(number, item.path, item.unit, before) for number in (item.value, item.low, item.high)]
        text, *ends = interval_texts(*(number for number, _ in numbers))
        shown = f"{text} {numbers[0][1]}".removesuffix(" -").rstrip()
        rows.append((item.path, shown, " to ".join(ends), item.verdict_text))
        # A value far from that of the set is right for another device, or a wrong unit; openings have none.
        entry = before.numbers.get(item.path)
        value, unit = in_set_unit(item.value, item.path, item.unit, before)
        if entry is None or not item.is_usable or ".opening." in item.path or not (entry.value > 0.0 and value > 0.0):
            continue
        if not 1.0 / _FAR_FROM_SET < (ratio := value / entry.value) < _FAR_FROM_SET:
            times = f"{ratio:.3g} times the value of the set, {entry.value:.4g} {unit}".rstrip()
            far.append(f"remark: {item.path} is {times}")
    origin = "" if part.kind == "measured" else f" ({part.kind})"
    remarks = [*said, *far, *tolerances, *(f"remark: {remark}" for remark in part.remarks)]
    return Section(f"{part.procedure}{origin}: {part.summary}", columns_of(("",) * 4, rows), remarks=remarks)


def _tolerances(known: Sequence[NuisanceParameter], before: ParameterSet) -> list[str]:
    """Return sentences on the tolerances that widen an interval most, and on those that contradict the recordings."""
    from ppafo.identification.estimate import NAMED, digits_of

    is_far = {number.name: abs(number.after - number.before) > _FAR * number.before_error for number in known}
    by_share = sorted(known, key=lambda number: (-float(f"{number.share:.2g}"), number.name))
    rows = []
    for tolerance in (*by_share[:NAMED], *(number for number in by_share[NAMED:] if is_far[number.name])):
        # With its own error, as stated and as fitted.
        pairs = ((tolerance.before, tolerance.before_error), (tolerance.after, tolerance.after_error))
        texts = []
        for value, error in pairs:
            # A unit with an offset, such as degC, has none in a difference.
            (level, unit), (upper, _), (zero, _) = (
                _shown(number, tolerance.name.partition(" of ")[0], tolerance.unit, before)
                for number in (value, error, 0.0)
            )
            width = upper - zero
            texts.append(f"{digits_of(level, width)} +- {digits_of(width, width)} {unit}".rstrip(" -"))
        entry = before.numbers.get(tolerance.name)
        default = " (the set states none)" if entry is not None and not entry.uncertainty else ""
        text = f"tolerance: {tolerance.name}: prior {texts[0]}{default}, fitted {texts[1]}"
        if tolerance.widens:
            text += f"; {percentage(tolerance.share, 2)} of the variance of {tolerance.widens}"
        rows.append(text)
    return rows


def _shown(number: float, path: str, unit: str, before: ParameterSet) -> tuple[float, str]:
    """Convert a number [SI] to the unit of the parameter set, or to the display unit if the set does not have it."""
    from ppafo.identification.estimate import in_shown_unit
    from ppafo.identification.new_set import in_set_unit

    reported, set_unit = in_set_unit(number, path, unit, before)
    return in_shown_unit(number, unit) if set_unit == unit else (reported, set_unit)


def _figures(identification: Identification) -> list[Section]:
    """Return a figure for each procedure and recording, and figure 3 if both of its panels are available."""
    from ppafo.identification.bench.law import bench_figure, figure_3
    from ppafo.report.finding import Section

    figures = []
    counts: dict[str, int] = {}
    for result in identification.results:
        counts[result.procedure] = counts.get(result.procedure, 0) + 1
        number = counts[result.procedure]
        name = result.procedure if number == 1 else f"{result.procedure}-{number}"
        draw = partial(bench_figure, result.panels, result.kind)
        figures.append(Section(name=name, caption=result.summary, is_detail=True, draw=draw))
    fit = identification.trajectory
    for measurement, model in zip(fit.measurements, fit.models, strict=True) if fit else ():
        label = measurement.label
        panels = partial(trajectory_panels, measurement, model)
        name, caption = f"trajectory-fit-{label}", f"{label} and the fit."
        figures.append(Section(name=name, caption=caption, is_detail=True, panels=panels, title=label, size=(5.4, 1.9)))
    by_procedure = {result.procedure: result for result in reversed(identification.results)}
    if {"static-torque", "free-decay"} <= by_procedure.keys():
        draw = partial(figure_3, by_procedure["static-torque"], by_procedure["free-decay"])
        figures.append(Section(name="figure-3", caption="Like figure 3 of the paper.", is_detail=True, draw=draw))
    return figures


def trajectory_panels(measurement: Recording, model: Recording) -> list[Panel]:
    """Return samples, model at the same times and residuals of one experiment: two panels for each fitted channel."""
    from ppafo.report.kind import TIME, Kind
    from ppafo.report.residuals import FittedCurve, course_panels
    from ppafo.report.style import ACTUAL, CHAMBER_1, CHAMBER_2

    origins = {"measured": "measured", "simulated": "simulated samples", "synthetic": "synthetic measurement"}
    panels: list[Panel] = []
    for name, kind, style in (
        ("angle", Kind("Vane angle", "rad", "angle"), ACTUAL),
        ("pressure_1", Kind("Pressure in chamber 1", "Pa_a", "pressure"), CHAMBER_1),
        ("pressure_2", Kind("Pressure in chamber 2", "Pa_a", "pressure"), CHAMBER_2),
    ):
        if name in measurement:
            curve = FittedCurve(
                time=TIME,
                level=kind,
                change=Kind("Residual (measured - model)", quantity="angle" if name == "angle" else "pressure change"),
                times=measurement.time,
                samples=measurement[name],
                model=model[name],
                names=(origins[measurement.kind], "model"),
                colour=style.colour,
            )
            panels += course_panels(curve, "circles", "" if panels else "above")
    return panels
