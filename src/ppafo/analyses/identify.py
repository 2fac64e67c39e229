"""Identification of a parameter set from a problem file: recordings, procedures in order, new set, report, figures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.analyses import ask
from ppafo.arguments import Word, checked
from ppafo.documents.json_text import fields_of, plain
from ppafo.identification.estimate import (
    NAMED,
    Estimate,
    Identified,
    digits_of,
    in_shown_unit,
    interval_factor,
    interval_texts,
    shown_text,
)
from ppafo.plugins import Plugins
from ppafo.progress import Report, report_nothing
from ppafo.units.shown import counted_from, in_units, shown_in
from ppafo.wording import count_of, first_twice, percentage

if TYPE_CHECKING:
    from ppafo.identification.bench.law import BenchContext, BenchResult
    from ppafo.identification.new_set import NewSet
    from ppafo.identification.problem import ProblemFile, TrajectorySection
    from ppafo.identification.source import RecordingReader, UsedRecording
    from ppafo.identification.tolerances import Tolerances
    from ppafo.identification.trajectory.fitting import NuisanceParameter, TrajectoryFit
    from ppafo.parameters.parameter_set import ParameterSet
    from ppafo.report.finding import Finding
    from ppafo.signals import Recording, RecordingKind
    from ppafo.simulation.scenario import Scenario

_SIGNIFICANCE = 0.01
"""Probability by chance [-] below which two procedures contradict each other."""
_FAR = 2.0
"""Number of standard deviations above which a tolerance counts as contradicted by the recordings."""
_FAR_FROM_SET = 5.0
"""Ratio to the value of the set from which it is remarked on [-]: psi read as kPa makes 6.89."""
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
            **fields_of(fit.fit, "confidence", "evaluations", "has_converged"),
            "covariance": plain(fit.covariance),
            "tolerances": plain(fit.known),
            "channels": plain(fit.channels),
            "conflict": plain(fit.fit.conflict),
            "not_identifiable": plain(fit.fit.unidentified),
            "next_experiments": plain(fit.expected),
        }
        return document


@checked
def identify(
    problem: Annotated[str | Path, Word("PROBLEM", Path)],
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
    from ppafo.identification.bench.law import BenchContext
    from ppafo.identification.new_set import with_estimates
    from ppafo.identification.problem import load_problem
    from ppafo.identification.procedures import read_tasks, run_procedure
    from ppafo.identification.source import RecordingReader
    from ppafo.identification.tolerances import DEFAULTS
    from ppafo.parameters.loading import load_parameter_set
    from ppafo.parameters.overrides import check_valve, read_overrides, with_overrides
    from ppafo.parameters.parameter_set import atmospheric_pressure

    path = Path(problem)
    asked = load_problem(path)
    file = path.name
    device = asked.device
    tolerances = asked.bench or DEFAULTS
    beside = path.parent / device.set
    base = load_parameter_set(beside if beside.suffix == ".toml" else device.set)
    overrides = read_overrides(device.overrides)
    check_valve(overrides, device.valve, f"device.valve = '{device.valve}'")
    before = current = with_overrides(base, overrides, device.valve)
    with shown_in(counted_from(before.shown, atmospheric_pressure(before))):
        reader = RecordingReader(asked.columns, path.parent, file, before)
        tasks, used = read_tasks(asked.procedure, reader)
        results: list[BenchResult] = []
        for procedure, sources, label in tasks:
            context = BenchContext(current, device.valve, label, tolerances)
            results.append(run_procedure(sources, procedure, context))
            # Each procedure finds the estimates of earlier ones in the set.
            current = with_estimates(current, results[-1].estimates).parameter_set
        results, estimates = _compared(results, before, tolerances)
        trajectory = None
        if asked.trajectory is not None:
            context = BenchContext(current, device.valve, f"{file}: trajectory", tolerances)
            reader = reader._replace(parameter_set=current)
            known = {item.path: item for item in estimates}
            trajectory = _solve_section(asked.trajectory, context, reader, known, used, progress)
            estimates += trajectory.estimates
        new_set = with_estimates(before, estimates, device.valve)
        found = Identification(asked.name, tuple(results), trajectory, before, new_set)
        return finding_of(replace(found, new_set=_described(found, asked)))


def _compared(
    results: Sequence[BenchResult], parameter_set: ParameterSet, tolerances: Tolerances
) -> tuple[list[BenchResult], list[Estimate]]:
    """Return the results with remarks and conflicts on numbers that two of them have, and the estimates to use.

    Two values contradict each other where their difference is significant at 1 % over all numbers that two results
    have. Friction may differ from recording to recording by the tolerance of the bench.
    """
    from ppafo.simulation.recorded.usual_errors import deviation_of_limit

    compared = [*results]
    declared = parameter_set.declarations()
    pairs = [
        (first, second, one, two)
        for first, second in combinations(range(len(results)), 2)
        for one, two in product(results[first].estimates, results[second].estimates)
        if one.path == two.path in declared and one.is_usable and two.is_usable
    ]
    sentences = []
    for first, second, one, two in pairs:
        errors = []
        for each in (one, two):
            # A procedure on several recordings has the variation of their friction in its interval.
            varies = tolerances.friction if "friction." in each.path and len(each.recordings) == 1 else 0.0
            error = each.wider_half_width / interval_factor(each.confidence)
            errors.append(math.hypot(error, deviation_of_limit(varies) * each.value))
        least = interval_factor(1.0 - _SIGNIFICANCE / len(pairs)) * math.hypot(*errors)
        texts = [shown_text(each.value, each.unit, digits=4) for each in (one, two)]
        by = [f"{text} by {results[row].procedure}" for text, row in zip(texts, (first, second), strict=True)]
        is_apart = abs(one.value - two.value) > least
        sentences.append(f"{one.path} is {', '.join(by)}, which {'contradict each other' if is_apart else 'agree'}")
        for number in (first, second) if is_apart else ():
            # Which of both is wrong no procedure knows.
            if not compared[number].conflict:
                compared[number] = compared[number].for_this_model_only(sentences[-1])
    used = dict[str, Estimate]()
    for each in (estimate for result in compared for estimate in result.estimates):
        earlier = used.get(each.path, each)
        if (each.is_usable, each.is_identified) >= (earlier.is_usable, earlier.is_identified):
            used[each.path] = each
    for (_, second, one, _), sentence in zip(pairs, sentences, strict=True):
        if sentence not in compared[second].conflict:
            remark = f"{sentence}: the set takes {shown_text(used[one.path].value, one.unit, digits=4)}"
            compared[second] = replace(compared[second], remarks=(*compared[second].remarks, remark))
    return compared, [each for result in compared for each in result.estimates if used[each.path] is each]


def _solve_section(
    section: TrajectorySection,
    context: BenchContext,
    reader: RecordingReader,
    bench: Mapping[str, Estimate],
    used: tuple[UsedRecording, ...],
    report: Report,
) -> TrajectoryFit:
    """Return the fit of section [trajectory], with the benefit of the candidates, after a check of all inputs.

    Set and valve are those of all scenarios. ``bench`` are estimates of bench procedures by path, ``used`` the
    recordings from which these were obtained.
    """
    from ppafo.errors import DataError, IdentificationError
    from ppafo.identification.fit import FitNumber
    from ppafo.identification.source import RecordingSource, remarks_on_readings
    from ppafo.identification.trajectory import experiment as of_motion
    from ppafo.identification.trajectory.fitting import expected_information, fit
    from ppafo.parameters.overrides import read_overrides
    from ppafo.simulation.recorded.usual_errors import deviation_of_limit

    try:
        experiments = tuple(of_motion.experiment_of(entry, context, reader) for entry in section.experiments)
        parameters = [of_motion.parameter_of(entry, experiments, bench) for entry in section.parameters]
        for entry, experiment in zip(section.experiments, experiments, strict=True):
            free = {
                of_motion.full_path(item.path, experiment.scenario) for item in parameters if item.acts_in(entry.label)
            }
            for override in read_overrides(entry.overrides):
                if of_motion.full_path(override.typed, experiment.scenario) in free:
                    why = f"overrides: {override.typed} is fitted; give its start in [[trajectory.parameters]]"
                    raise IdentificationError(f"{experiment.where}: {why}")
            if (limit := entry.time_offset) is not None:
                # The delay of the samples of one recording is known within a limit, as a tolerance is.
                bounds = 0.0, -limit, limit, 1.0, deviation_of_limit(limit)
                parameters.append(FitNumber(of_motion.TIME_OFFSET, *bounds, (entry.label,), is_tolerance=True))
        tolerances = of_motion.tolerance_parameters(context.tolerances, experiments, parameters, context.parameter_set)
        problem = of_motion.TrajectoryProblem((*parameters, *tolerances), experiments, section.confidence, used)
        labels = [experiment.label for experiment in experiments]
        candidates: list[tuple[str, Scenario, Mapping[str, float], float]] = []
        if twice := first_twice([*labels, *(one.label for one in section.candidates)]):
            raise IdentificationError(f"candidate '{twice}': another experiment or candidate has this label")
        for one in section.candidates:
            scenario = of_motion.scenario_named(one.scenario, one.overrides, context, reader.folder)
            if one.interval > (longest := scenario.run.duration):
                raise IdentificationError(
                    f"candidate '{one.label}': interval = {one.interval:g} s must be at most {longest:g} s"
                )
            candidates.append((one.label, scenario, one.noise.by_channel(), one.interval))
        fitted = fit(problem, report)
        expected = expected_information(fitted, candidates)
    except (IdentificationError, DataError) as error:
        raise type(error)(f"{context.label}: {error}") from error
    sources = tuple(RecordingSource(experiment.recording, experiment.source) for experiment in problem.experiments)
    remarks = [*remarks_on_readings(sources), *fitted.remarks]
    for item in fitted.estimates:
        known = bench.get(item.path)
        if known is None or not (known.is_usable and item.is_usable):
            continue
        if item.low > known.high or item.high < known.low:
            ends = [in_shown_unit(number, item.unit) for number in (item.low, item.high, known.low, known.high)]
            low, high, lowest, highest = (f"{end:.4g}" for end, _ in ends)
            fitted_to = f"{low} to {high} {ends[0][1]}".rstrip(" -")
            remarks.append(f"{item.path}: fitted {fitted_to}, bench procedure {lowest} to {highest}")
    return replace(fitted, expected=expected, remarks=tuple(remarks))


def _described(identification: Identification, problem: ProblemFile) -> NewSet:
    """Return the new set with name, title, citation and notes that state the recordings behind its values.

    Values reported by others for another device are left out if the set has identified values.
    """
    from ppafo.parameters.audit import findings_of
    from ppafo.parameters.loading import list_sets

    old = identification.new_set.parameter_set
    new = identification.new_set
    named = [name for procedure in problem.procedure for name in procedure.recordings]
    if problem.trajectory is not None:
        named += [experiment.recording for experiment in problem.trajectory.experiments]
    paths = dict.fromkeys(map(Path, named))
    names = [path.name for path in paths]
    files = ["/".join(path.parts[-2:]) if names.count(path.name) > 1 else path.name for path in paths]
    outcome = "identified" if new.written or new.fitted else "no value identified"
    changes = f" with {', '.join(problem.device.overrides)}" if problem.device.overrides else ""
    origins = (
        f"Values with origin 'identified' or 'fitted' come from the problem '{problem.name}', on the set '{old.name}'"
        f"{changes} from {identification.kind} recordings: {', '.join(files)}; 'fitted' values hold for this model "
        f"only. All other values come from '{old.name}'."
    )
    if new.written or new.fitted:
        # Values reported of another device do not describe the measured one.
        reported = {
            finding.id
            for finding in findings_of(identification.before)
            if any(value.path.startswith(_REPORTED) for value in finding.values)
        }
        old = replace(
            old,
            numbers={path: entry for path, entry in old.numbers.items() if not path.startswith(_REPORTED)},
            accepted={name: why for name, why in old.accepted.items() if name not in reported},
        )
    described = replace(
        old,
        file=f"{problem.name}.toml",
        name=problem.name,
        title=problem.title or f"{old.title}, {outcome} on {old.name} from {count_of(len(files), 'recording')}",
        citation=old.citation if problem.citation is None else problem.citation,
        # The new set may go anywhere, where the path of a file would not lead to its parent.
        parent=problem.device.set if problem.device.set in list_sets() else "",
        notes=f"{old.notes.rstrip()}\n{origins}".lstrip(),
    )
    return replace(new, parameter_set=described)


@in_units(lambda identification: identification.shown)
def finding_of(identification: Identification) -> Finding[Identification]:
    """Return an identification as a finding; passed if the recordings agree and the new set is valid and consistent."""
    from ppafo.identification.bench.law import bench_figure
    from ppafo.parameters.loading import parameter_set_toml

    name = identification.name
    new_set = identification.new_set
    before = identification.before
    parts = []
    figures = []
    counts = dict[str, int]()
    for result in identification.results:
        parts.append(_part(result, before))
        number = counts[result.procedure] = counts.get(result.procedure, 0) + 1
        stem = result.procedure if number == 1 else f"{result.procedure}-{number}"
        draw = partial(bench_figure, result.panels, result.kind)
        figures.append(ask.Section(name=stem, caption=result.summary, is_detail=True, draw=draw))
    if (fit := identification.trajectory) is not None:
        more = [
            f"next experiment {number}: {item.label}: gain {item.gain:.2f}; largest for {item.most_helped}, whose "
            f"interval would shrink by {1.0 - item.shrinkage[item.most_helped]:.0%}"
            for number, item in enumerate(fit.expected, start=1)
        ]
        parts.append(_part(fit, before, fit.known, more))
        for measured, model in zip(fit.measurements, fit.models, strict=True):
            panels = partial(trajectory_panels, measured, model)
            shape = (measured.label, (5.4, 1.9))
            stem = f"trajectory-fit-{measured.label}"
            caption = f"{measured.label} and the fit."
            figures.append(
                ask.Section(name=stem, caption=caption, is_detail=True, panels=panels, title=shape[0], size=shape[1])
            )
    written = new_set.written
    fitted = new_set.fitted
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
    return ask.Finding(
        name="identify",
        kicker="Identification",
        title=f"The parameter set {name}",
        said=(),
        parts=(*parts, ask.Section(said=(f"new set '{name}': {count}{fitted_text}", *problem)), *figures),
        found=identification,
        passed=identification.is_good,
        kind=identification.kind,
        # A set without a new value would be the one before under another name.
        files={f"{name}.toml": lambda: parameter_set_toml(new_set.parameter_set).encode()} if written or fitted else {},
    )


def _part(
    part: Identified, before: ParameterSet, known: Iterable[NuisanceParameter] = (), more: Iterable[str] = ()
) -> ask.Section:
    """Return the section of a procedure or of the fit: its estimates in the units of the set, and its remarks.

    Of the tolerances ``known`` those are said that widen an interval most, and those that contradict the recordings.
    """
    from ppafo.identification.new_set import in_set_unit
    from ppafo.parameters.parameter_set import entry_text, number_in_si

    rows = []
    far = []
    said = [f"holds for this model only: {part.conflict}"] if part.conflict else []
    for item in part.estimates:
        # Of a conflict the explanation of each number is the one sentence that stands above.
        said += [f"{item.path}: {item.explanation}"] if item.explanation != part.conflict else []
        numbers = [in_set_unit(number, item.path, item.unit, before) for number in (item.value, item.low, item.high)]
        text, *ends = interval_texts(*(number for number, _ in numbers))
        shown = f"{text} {numbers[0][1]}".removesuffix(" -").rstrip()
        rows.append((item.path, shown, " to ".join(ends), item.verdict_text))
        # A value far from that of the set is right for another device, or a wrong unit; openings have none.
        entry = before.numbers.get(item.path)
        usual = number_in_si(before, item.path) or 0.0
        if entry is None or not item.is_usable or ".opening." in item.path or not (usual > 0.0 and item.value > 0.0):
            continue
        if not 1.0 / _FAR_FROM_SET < (ratio := item.value / usual) < _FAR_FROM_SET:
            far.append(f"remark: {item.path} is {ratio:.3g} times the value of the set, {entry_text(entry)}")
    tolerances = []
    by_share = sorted(known, key=lambda number: (-float(f"{number.share:.2g}"), number.name))
    for place, number in enumerate(by_share):
        if place >= NAMED and not abs(number.after - number.before) > _FAR * number.before_error:
            continue
        # With its own error, as stated and as fitted.
        texts = []
        for value, error in ((number.before, number.before_error), (number.after, number.after_error)):
            # A unit with an offset, such as degC, has none in a difference.
            (level, unit), (upper, _), (zero, _) = (
                in_set_unit(each, number.name.partition(" of ")[0], number.unit, before) for each in (value, error, 0.0)
            )
            width = upper - zero
            texts.append(f"{digits_of(level, width)} +- {digits_of(width, width)} {unit}".rstrip(" -"))
        entry = before.numbers.get(number.name)
        default = " (the set states none)" if entry is not None and not entry.uncertainty else ""
        share = f"; {percentage(number.share, 2)} of the variance of {number.widens}" if number.widens else ""
        tolerances.append(f"tolerance: {number.name}: prior {texts[0]}{default}, fitted {texts[1]}{share}")
    origin = "" if part.kind == "measured" else f" ({part.kind})"
    remarks = [*said, *far, *tolerances, *(f"remark: {remark}" for remark in part.remarks), *more]
    return ask.Section(f"{part.procedure}{origin}: {part.summary}", ask.columns_of(("",) * 4, rows), remarks=remarks)


def trajectory_panels(measurement: Recording, model: Recording) -> list[ask.Panel]:
    """Return samples, model at the same times and residuals of one experiment: two panels for each fitted channel."""
    from ppafo.report.residuals import FittedCurve, course_panels
    from ppafo.report.style import ACTUAL, CHAMBER_1, CHAMBER_2
    from ppafo.validation.settings import COMPARED

    origins = {"measured": "measured", "simulated": "simulated samples", "synthetic": "synthetic measurement"}
    panels = list[ask.Panel]()
    looks = {"pressure_1": CHAMBER_1, "pressure_2": CHAMBER_2}
    for name, channel in ((name, channel) for name, channel in COMPARED.items() if name in measurement):
        curve = FittedCurve(
            time=ask.TIME,
            level=ask.Kind(channel.title, "", "pressure" if name in looks else channel.quantity),
            change=ask.Kind("Residual (measured - model)", "", channel.quantity),
            times=measurement.time,
            samples=measurement[name],
            model=model[name],
            names=(origins[measurement.kind], "model"),
            colour=looks.get(name, ACTUAL).colour,
        )
        panels += course_panels(curve, "circles", "" if panels else "above")
    return panels
