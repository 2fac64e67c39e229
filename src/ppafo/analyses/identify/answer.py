"""Report of an identification: estimates and checks in the units of the parameter set, new set, figures."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ppafo.documents.json_text import fields_of, plain
from ppafo.errors import DataError
from ppafo.identification.bench.law import BenchResult, bench_figure, figure_3
from ppafo.identification.estimate import WRONG_UNIT, Estimate
from ppafo.identification.new_set import NewSet, in_set_unit
from ppafo.identification.source import kind_of
from ppafo.identification.trajectory.fitting import NuisanceParameter, TrajectoryFit
from ppafo.identification.trajectory.section import TrajectoryOutcome
from ppafo.identification.wording import NAMED, in_shown_unit, interval_texts, with_error
from ppafo.parameters.loading import parameter_set_toml
from ppafo.parameters.parameter_set import ParameterSet, atmospheric_pressure, number_in_si
from ppafo.report.finding import Finding, Section, columns_of
from ppafo.report.kind import TIME, Kind
from ppafo.report.panels import Panel
from ppafo.report.residuals import FittedCurve, course_panels
from ppafo.report.style import ACTUAL, CHAMBER_1, CHAMBER_2
from ppafo.signals import Recording, RecordingKind
from ppafo.units.shown import counted_from, in_units
from ppafo.wording import count_of, percentage

_FAR = 2.0
"""Number of standard deviations above which a tolerance counts as contradicted by the recordings."""
_FAR_FROM_SET = 5.0
"""Ratio to the value of the set from which it is remarked on [-]: psi read as kPa makes 6.89."""
_ROW_HEAD = ("",) * 4
"""Empty column heads for the rows of ``estimate_row``."""
_KIND_WORDS = {"measured": "measured", "simulated": "simulated samples", "synthetic": "synthetic measurement"}
_CHANNELS = {
    "angle": (Kind("Vane angle", "rad", "angle"), ACTUAL),
    "pressure_1": (Kind("Pressure in chamber 1", "Pa_a", "pressure"), CHAMBER_1),
    "pressure_2": (Kind("Pressure in chamber 2", "Pa_a", "pressure"), CHAMBER_2),
}


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
    trajectory: TrajectoryOutcome | None
    before: ParameterSet
    new_set: NewSet

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """Estimates of all procedures, followed by the estimates of the trajectory fit."""
        fitted = () if self.trajectory is None else self.trajectory.fit.estimates
        return (*(estimate for result in self.results for estimate in result.estimates), *fitted)

    @property
    def is_good(self) -> bool:
        """True if the recordings agree, no unit is probably wrong, and the new set is a valid, consistent device."""
        is_fitted = self.trajectory is None or self.trajectory.is_good
        is_fitted &= all(estimate.verdict != WRONG_UNIT for estimate in self.estimates)
        is_valid = not self.new_set.problem and not self.kept_beside_fitted
        return is_fitted and is_valid and not any(result.conflict for result in self.results)

    @property
    def kept_beside_fitted(self) -> list[str]:
        """Paths that the new set keeps as they were, although its new values were fitted together with them."""
        fitted_together = () if self.trajectory is None else self.trajectory.fit.estimates
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
        kinds = [result.kind for result in self.results]
        return kind_of([*kinds, *(() if self.trajectory is None else (kind_of_fit(self.trajectory.fit),))])

    def json_document(self) -> dict[str, Any]:
        """Return estimates, checks and the new set as plain data in SI."""
        procedures = [
            {
                **fields_of(result, "procedure", "summary", "conflict"),
                "recordings_are": result.kind,
                "estimates": [plain(item) | {"verdict_text": item.verdict_text} for item in result.estimates],
                "remarks": list(result.remarks),
            }
            for result in self.results
        ]
        return {
            "problem": self.name,
            "started_from": self.before.name,
            "is_good": self.is_good,
            "procedures": procedures,
            # A problem without a fit has no such key, so that its document says what was asked.
            **({} if self.trajectory is None else {"trajectory": _trajectory_data(self.trajectory)}),
            "new_set": {
                "file": f"{self.name}.toml",
                "identified": list(self.new_set.written),
                "fitted": list(self.new_set.fitted),
                "problem": self.new_set.problem,
            },
        }


def trajectory_panels(measurement: Recording, model: Recording) -> list[Panel]:
    """Return samples, model and residuals of one experiment over time, two panels for each fitted channel.

    Both recordings have the same times.
    """
    if not np.array_equal(measurement.time, model.time):
        raise DataError(
            f"{model.label}: its times differ from {measurement.label}; give both recordings the same times"
        )
    panels: list[Panel] = []
    for name in (name for name in _CHANNELS if name in measurement):
        kind, style = _CHANNELS[name]
        is_angle = name == "angle"
        curve = FittedCurve(
            time=TIME,
            level=kind,
            change=Kind("Residual (measured - model)", quantity="angle" if is_angle else "pressure change"),
            times=measurement.time,
            samples=measurement[name],
            model=model[name],
            names=(_KIND_WORDS[measurement.kind], "model"),
            colour=style.colour,
        )
        panels += course_panels(curve, "circles", "" if panels else "above")
    return panels


@in_units(lambda found: counted_from(found.before.shown, atmospheric_pressure(found.before)))
def finding_of(identification: Identification) -> Finding[Identification]:
    """Return an identification as a finding; passed if the recordings agree and the new set is valid and consistent."""
    name, new_set, before = identification.name, identification.new_set, identification.before
    parts = []
    for result in identification.results:
        kind = "" if result.kind == "measured" else f" ({result.kind})"
        remarks = [
            *([f"holds for this model only: {result.conflict}"] if result.conflict else []),
            *(f"{estimate.path}: {estimate.explanation}" for estimate in result.estimates),
        ]
        remarks += _far_from_set(result.estimates, before)
        remarks += [f"remark: {remark}" for remark in result.remarks]
        rows = [estimate_row(estimate, before) for estimate in result.estimates]
        heading = f"{result.procedure}{kind}: {result.summary}"
        parts.append(Section(heading, columns_of(_ROW_HEAD, rows), remarks=remarks))
    if identification.trajectory is not None:
        parts.append(_trajectory_part(identification.trajectory, before))
    written, fitted = new_set.written, new_set.fitted
    # What holds for this model only is in the set as well, and is never counted with what is identified.
    # Other numbers may be identified too, such as the zero of a scale, for which a set has no place.
    count = "no value of the set identified" if fitted else "not written, since no value was identified"
    if written:
        count = f"{count_of(len(written), 'value')} of the set identified: {', '.join(written)}"
    fitted_text = f"; for this model only: {', '.join(fitted)}" if fitted else ""
    problem = [f"the new set is not a complete device yet: {new_set.problem}"] if new_set.problem else []
    if kept := identification.kept_beside_fitted:
        problem.append(
            f"not passed (exit code 1): the new set keeps its own {' and '.join(kept)}, with which its other values "
            "were not fitted: fix these by device.overrides, and fit the others again"
        )
    # As they are remarks among others, these that prevent a pass are repeated at the end.
    of_fit = () if identification.trajectory is None else identification.trajectory.fit.remarks
    problem += [f"not passed (exit code 1): {remark}" for remark in of_fit]
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


def _far_from_set(estimates: Iterable[Estimate], before: ParameterSet) -> list[str]:
    """Return a remark on each value far from that of the set, which is right for another device or a wrong unit."""
    remarks = []
    for estimate in estimates:
        entry = before.numbers.get(estimate.path)
        value, unit = in_set_unit(estimate.value, estimate.path, estimate.unit, before)
        if entry is None or not estimate.is_usable or not (entry.value > 0.0 and value > 0.0):
            continue
        ratio = value / entry.value
        if not 1.0 / _FAR_FROM_SET < ratio < _FAR_FROM_SET:
            times = f"{ratio:.3g} times the value of the set, {entry.value:.4g} {unit}".rstrip()
            remarks.append(f"remark: {estimate.path} is {times}; if the devices are alike, check the units")
    return remarks


def _trajectory_part(outcome: TrajectoryOutcome, before: ParameterSet) -> Section:
    """Return the section of the trajectory fit: estimates, tolerances, remarks and proposed next experiments."""
    kind, fit = kind_of_fit(outcome.fit), outcome.fit
    origin = "" if kind == "measured" else f" ({kind})"
    remarks = [
        *([f"holds for this model only: {fit.conflict}"] if fit.conflict else []),
        # Of a conflict the explanation of each number is the one sentence that stands above.
        *(
            f"{estimate.path}: {estimate.explanation}"
            for estimate in fit.estimates
            if estimate.explanation != fit.conflict
        ),
        *_far_from_set(fit.estimates, before),
        *_tolerances(fit.known, before),
        *(f"remark: {remark}" for remark in outcome.remarks),
    ]
    for number, experiment in enumerate(outcome.expected, start=1):
        fraction = 1.0 - experiment.shrinkage[experiment.most_helped]
        remarks.append(
            f"next experiment {number}: {experiment.label}: gain {experiment.gain:.2f}; largest for "
            f"{experiment.most_helped}, whose interval would shrink by {fraction:.0%}"
        )
    heading = (
        f"trajectory{origin}: {count_of(len(fit.estimates), 'number')} fitted to "
        f"{count_of(len(fit.measurements), 'recording')}, {count_of(len(fit.known), 'tolerance')}"
    )
    rows = [estimate_row(estimate, before) for estimate in fit.estimates]
    return Section(heading, columns_of(_ROW_HEAD, rows), remarks=remarks)


def _tolerances(known: Sequence[NuisanceParameter], before: ParameterSet) -> list[str]:
    """Return sentences on the tolerances that widen an interval most, and on those that contradict the recordings."""
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
            texts.append(f"{with_error(level, upper - zero)} {unit}".rstrip(" -"))
        entry = before.numbers.get(tolerance.name)
        default = " (the set states none)" if entry is not None and not entry.uncertainty else ""
        text = f"tolerance: {tolerance.name}: prior {texts[0]}{default}, fitted {texts[1]}"
        if tolerance.widens:
            text += f"; {percentage(tolerance.share, 2)} of the variance of {tolerance.widens}"
        rows.append(text)
    if rest := len(known) - len(rows):
        do = "affects" if rest == 1 else "affect"
        rows.append(f"{count_of(rest, 'other tolerance')} {do} the intervals less")
    return rows


def _shown(number: float, path: str, unit: str, before: ParameterSet) -> tuple[float, str]:
    """Convert a number [SI] to the unit of the parameter set, or to the display unit if the set does not have it."""
    reported, set_unit = in_set_unit(number, path, unit, before)
    return in_shown_unit(number, unit) if set_unit == unit else (reported, set_unit)


def estimate_row(estimate: Estimate, before: ParameterSet) -> tuple[str, ...]:
    """Return path, value, interval and verdict of an estimate in the unit of the set."""
    if math.isnan(estimate.value):
        return estimate.path, "no value", "", estimate.verdict
    numbers = [
        _shown(number, estimate.path, estimate.unit, before) for number in (estimate.value, estimate.low, estimate.high)
    ]
    (value, unit), (low, _), (high, _) = numbers
    text, low_text, high_text = interval_texts(value, low, high)
    return (
        estimate.path,
        f"{text} {unit}".removesuffix(" -").rstrip(),
        f"{low_text} to {high_text}",
        estimate.verdict_text,
    )


def _figures(identification: Identification) -> list[Section]:
    """Return a figure for each procedure and recording, and figure 3 if both of its panels are available."""
    figures = []
    counts: dict[str, int] = {}
    for result in identification.results:
        counts[result.procedure] = counts.get(result.procedure, 0) + 1
        number = counts[result.procedure]
        name = result.procedure if number == 1 else f"{result.procedure}-{number}"
        draw = partial(bench_figure, result.panels, result.kind)
        figures.append(Section(name=name, caption=result.summary, is_detail=True, draw=draw))
    fit = None if identification.trajectory is None else identification.trajectory.fit
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


def kind_of_fit(fit: TrajectoryFit) -> RecordingKind:
    """Return the common origin of all recordings of a fit: measured, simulated or synthetic."""
    return kind_of([recording.kind for recording in fit.measurements])


def _trajectory_data(outcome: TrajectoryOutcome) -> dict[str, Any]:
    """Return a trajectory fit as plain data in SI; rows and columns of matrices follow the estimates."""
    fit = outcome.fit
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
    return {
        "recordings_are": kind_of_fit(fit),
        "recordings": recordings,
        "confidence": fit.problem.confidence,
        **fields_of(fit.fit, "evaluations", "has_converged"),
        "estimates": [plain(item) | {"verdict_text": item.verdict_text} for item in fit.estimates],
        "covariance": fit.covariance.tolist(),
        "correlation": fit.correlation.tolist(),
        "tolerances": [plain(tolerance) for tolerance in fit.known],
        "channels": [plain(channel) for channel in fit.channels],
        "conflict": None if fit.fit.conflict is None else plain(fit.fit.conflict),
        "not_identifiable": [dict(combination) for combination in fit.fit.unidentified],
        "remarks": list(outcome.remarks),
        "next_experiments": [plain(experiment) for experiment in outcome.expected],
    }
