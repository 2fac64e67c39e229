"""The answer of an identification: estimates and checks in the units of the set, the new set, the figures."""

import math
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ppafo.answers import Answer, Figure, Section, Table
from ppafo.identification.bench.result import BenchResult, count_of, figure_3, procedure_figure
from ppafo.identification.estimate import Check, Estimate
from ppafo.identification.new_set import in_set_unit
from ppafo.identification.trajectory.fitting import TrajectoryFit
from ppafo.identification.trajectory.follow_up import Expected, Profile
from ppafo.identification.trajectory.section import TrajectoryOutcome
from ppafo.parameters.parameter_set import ParameterSet
from ppafo.parameters.writing import parameter_set_toml
from ppafo.questions.identify.profile_figure import profile_figure
from ppafo.questions.identify.solve import Beforehand, Identification
from ppafo.questions.identify.trajectory_figure import correlation_figure, trajectory_fit_figure
from ppafo.signals import RecordingKind
from ppafo.simulation.document import plain

_NO_VALUE = "no value"
_MINIMUM_DIGITS, _MAXIMUM_DIGITS = 4, 9
POSTERIOR = "posterior.nc"


def answer_of(identification: Identification) -> Answer:
    """Return the answer; it has passed where every check holds and the new set makes a device."""
    name, new_set, fitted = identification.name, identification.new_set, identification.trajectory
    problem = (f"it makes no device yet: {new_set.problem}",) if new_set.problem else ()
    files = {f"{name}.toml": lambda: parameter_set_toml(new_set.parameter_set).encode()}
    if fitted is not None:
        files[POSTERIOR] = partial(_posterior, fitted.fit)
    return Answer(
        name="identify",
        kicker="Identification",
        title=f"The parameter set {name}",
        lead=(),
        sections=(
            *(_beforehand_section(item) for item in identification.beforehand),
            *(_procedure_section(result, identification.before) for result in identification.results),
            *((_trajectory_section(fitted, identification.before),) if fitted else ()),
            Section(paragraphs=(f"new set '{name}': {_count_sentence(identification)}", *problem)),
            *(Section(figure=figure, is_detail=True) for figure in _figures(identification)),
        ),
        data=_data(identification),
        passed=identification.is_good,
        kind=_kind(identification),
        files=files,
    )


def _kind(identification: Identification) -> RecordingKind:
    """Return the kind of all recordings together: one synthetic recording makes the whole synthetic."""
    kinds = {result.kind for result in identification.results}
    if identification.trajectory is not None:
        kinds.add(kind_of_fit(identification.trajectory.fit))
    return next((kind for kind in _KINDS if kind in kinds), "measured")


def _count_sentence(identification: Identification) -> str:
    """Return how many values are identified, and apart from them which are fitted only."""
    written, fitted = identification.new_set.written, identification.new_set.fitted
    found = f"{count_of(len(written), 'value')} identified: {', '.join(written)}" if written else "no value identified"
    rest = f"; fitted only, weak or for this model only: {', '.join(fitted)}" if fitted else ""
    return f"{found}{rest}"


def _beforehand_section(item: Beforehand) -> Section:
    """Return what was known of a procedure before anything was fitted."""
    words = {True: "sufficient", False: "INSUFFICIENT"}
    remarks = tuple(f"{words[one.can_be_had]}: {one.name}: {one.statement}" for one in item.prospects)
    return Section(f"before {item.procedure}, from the recordings alone:", remarks=remarks)


def _procedure_section(result: BenchResult, before: ParameterSet) -> Section:
    kind = "" if result.kind == "measured" else f" ({result.kind})"
    return Section(
        f"{result.procedure}{kind}: {result.summary}",
        table=Table((), tuple(_estimate_row(item, before) for item in result.estimates)),
        remarks=(*_checks(result.checks), *(f"remark: {remark}" for remark in result.remarks)),
    )


def _trajectory_section(outcome: TrajectoryOutcome, before: ParameterSet) -> Section:
    """Return estimates, each that is not simply identified with its sentence, then checks, profiles and candidates."""
    kind, fit = kind_of_fit(outcome.fit), outcome.fit
    origin = "" if kind == "measured" else f" ({kind})"
    missing = [one for one in outcome.beforehand if not one.can_be_had]
    doubtful = [item for item in fit.estimates if item.verdict != "identified"]
    candidates = enumerate(outcome.expected, start=1)
    return Section(
        f"trajectory{origin}: {count_of(len(fit.estimates), 'number')} fitted to "
        f"{count_of(len(fit.measurements), 'recording')}",
        paragraphs=tuple(f"beforehand: INSUFFICIENT: {one.name}: {one.statement}" for one in missing),
        table=Table((), tuple(_estimate_row(item, before) for item in fit.estimates)),
        remarks=(
            *(f"{item.path}: {item.explanation}" for item in doubtful),
            *_checks(outcome.checks),
            *(f"remark: {remark}" for remark in outcome.remarks),
            *(f"profile: {_profile(curve, before)}" for curve in outcome.profiles),
            *(f"next experiment {number}: {_candidate(candidate)}" for number, candidate in candidates),
        ),
    )


def _checks(checks: Iterable[Check]) -> list[str]:
    return [f"{'holds' if check.holds else 'FAILS'}: {check.name}: {check.statement}" for check in checks]


def _estimate_row(item: Estimate, before: ParameterSet) -> tuple[str, ...]:
    path, value, unit, interval = _row(item, before)
    return path, f"{value} {unit}".rstrip(), interval, item.verdict_in_words


def _profile(one: Profile, before: ParameterSet) -> str:
    """Return the interval of a profile in words."""
    sides = [None if side is None else in_set_unit(side, one.path, one.unit, before) for side in (one.low, one.high)]
    known = [side[0] for side in sides if side is not None]
    digits = _digits(known[0], 0.5 * (known[-1] - known[0])) if known else _MINIMUM_DIGITS
    low, high = ("not bounded" if side is None else f"{side[0]:#.{digits}g}" for side in sides)
    unit = next((side[1] for side in sides if side is not None), "")
    return f"{one.path}: {low} to {high} {unit}".rstrip()


def _candidate(one: Expected) -> str:
    fraction = 1.0 - one.shrinkage[one.most_helped]
    return (
        f"{one.label}: gain {one.gain:.2f}; largest for {one.most_helped}, "
        f"whose interval would shrink by {fraction:.0%}"
    )


def _row(estimate: Estimate, before: ParameterSet) -> tuple[str, str, str, str]:
    """Return path, value, unit and interval."""
    if math.isnan(estimate.value):
        return estimate.path, _NO_VALUE, "", ""
    numbers = (estimate.value, estimate.low, estimate.high)
    shown = [in_set_unit(one, estimate.path, estimate.unit, before) for one in numbers]
    value, low, high = (number for number, _ in shown)
    digits = _digits(value, 0.5 * abs(high - low))
    return estimate.path, f"{value:#.{digits}g}", shown[0][1], f"{low:#.{digits}g} to {high:#.{digits}g}"


def _digits(value: float, half_width: float) -> int:
    """Return the digits that a number needs so that its interval can be distinguished from it, at least four."""
    if not (half_width > 0.0 and math.isfinite(half_width) and value != 0.0):
        return _MINIMUM_DIGITS
    needed = math.ceil(math.log10(abs(value) / half_width)) + 1
    return min(max(needed, _MINIMUM_DIGITS), _MAXIMUM_DIGITS)


def _figures(identification: Identification) -> list[Figure]:
    """Return a figure for each procedure and recording, figure 3 where both of its panels are there."""
    figures = []
    counts: dict[str, int] = {}
    for result in identification.results:
        counts[result.procedure] = counts.get(result.procedure, 0) + 1
        number = counts[result.procedure]
        name = result.procedure if number == 1 else f"{result.procedure}-{number}"
        figures.append(Figure(name, result.summary, partial(procedure_figure, result)))
    if identification.trajectory is not None:
        figures += _trajectory_figures(identification.trajectory, identification.before)
    both = figure_3(identification.results)
    return figures if both is None else [*figures, Figure("figure-3", "Like figure 3 of the paper.", lambda: both)]


def _trajectory_figures(outcome: TrajectoryOutcome, before: ParameterSet) -> list[Figure]:
    fit, kind = outcome.fit, kind_of_fit(outcome.fit)
    figures = []
    for measurement, model, scenario in zip(fit.measurements, fit.models, fit.scenarios, strict=True):
        draw = partial(trajectory_fit_figure, measurement, model, scenario.device.supply.atmospheric_pressure)
        figures.append(Figure(f"trajectory-fit-{measurement.label}", f"{measurement.label} and the fit.", draw))
    if len(fit.estimates) > 1:
        draw = partial(correlation_figure, [item.path for item in fit.estimates], fit.correlation, kind)
        figures.append(Figure("trajectory-correlation", "Correlations of the estimates.", draw))
    if outcome.profiles:
        draw = partial(profile_figure, outcome, before, kind)
        figures.append(Figure("trajectory-profiles", "Profile likelihoods.", draw))
    return figures


_KINDS: tuple[RecordingKind, ...] = ("synthetic", "simulated", "measured")


def kind_of_fit(fit: TrajectoryFit) -> RecordingKind:
    """Return the kind of all recordings together: one synthetic recording makes the fit synthetic."""
    kinds = {recording.kind for recording in fit.measurements}
    return next(kind for kind in _KINDS if kind in kinds)


def _data(identification: Identification) -> dict[str, Any]:
    """Return the outcome as plain data in SI units; a value that could not be found is null."""
    return {
        "problem": identification.name,
        "started_from": identification.before.name,
        "is_good": identification.is_good,
        "beforehand": [plain(item) for item in identification.beforehand],
        "procedures": [_procedure_data(result) for result in identification.results],
        **_trajectory_data(identification.trajectory),
        "new_set": {
            "file": f"{identification.name}.toml",
            "identified": list(identification.new_set.written),
            "fitted": list(identification.new_set.fitted),
            "problem": identification.new_set.problem,
        },
    }


def _procedure_data(result: BenchResult) -> dict[str, Any]:
    return {
        "procedure": result.procedure,
        "summary": result.summary,
        "recordings_are": result.kind,
        "estimates": [plain(item) for item in result.estimates],
        "checks": [plain(item) for item in result.checks],
        "remarks": list(result.remarks),
    }


def _trajectory_data(outcome: TrajectoryOutcome | None) -> dict[str, Any]:
    """Return the part ``trajectory`` of the data, empty without a fit; matrices are in the order of estimates."""
    if outcome is None:
        return {}
    fit = outcome.fit
    return {
        "trajectory": {
            "recordings_are": kind_of_fit(fit),
            "recordings": [_recording(fit, index) for index in range(len(fit.measurements))],
            "parameters": [plain(item) for item in fit.optimum.residuals.ranges],
            "search": plain(fit.problem.search),
            "evaluations": fit.evaluations,
            "cost": fit.cost,
            "variance_inflation": fit.uncertainty.inflation,
            "estimates": [plain(item) for item in fit.estimates],
            "covariance": fit.covariance.tolist(),
            "correlation": fit.correlation.tolist(),
            "channels": [plain(item) for item in fit.channels],
            "noise": [{"channel": one.channel, "is_like": one.in_words} for one in fit.uncertainty.sensors],
            "misfit": {
                "reason": fit.misfit,
                "comparisons": [plain(item) for item in fit.uncertainty.misfit.comparisons],
            },
            "beforehand": [plain(item) for item in outcome.beforehand],
            "remarks": list(outcome.remarks),
            "checks": [plain(item) for item in outcome.checks],
            "profiles": [_profile_data(item) for item in outcome.profiles],
            "next_experiments": [plain(item) for item in outcome.expected],
        }
    }


def _posterior(fit: TrajectoryFit) -> bytes:
    """Return the draws of a trajectory fit as a NetCDF file that ArviZ and xarray read."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / POSTERIOR
        fit.posterior().to_netcdf(path, engine="h5netcdf")
        return path.read_bytes()


def _recording(fit: TrajectoryFit, index: int) -> dict[str, Any]:
    experiment = fit.problem.experiments[index]
    return {
        "label": experiment.label,
        "source": experiment.source,
        "kind": experiment.recording.kind,
        "scenario": experiment.scenario.name,
        "inputs": list(experiment.inputs),
        "samples": len(fit.measurements[index]),
    }


def _profile_data(one: Profile) -> dict[str, Any]:
    return {**plain(one), "numbers": one.numbers.tolist(), "rises": one.rises.tolist()}
