"""The trajectory fit: runs as residuals of the one estimator, and what comes of it as values of the device."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.estimate import Estimate, Verdict
from ppafo.identification.fit import Fit
from ppafo.identification.fit import fit as estimate
from ppafo.identification.residuals import Block
from ppafo.identification.trajectory.problem import (
    ZERO_OF,
    Number,
    TrajectoryProblem,
    broken_rule,
    full_path,
    numbers_of,
    reach_of,
    with_numbers,
)
from ppafo.identification.trajectory.runs import (
    Floats,
    Measured,
    blocks_of,
    numbers_in,
    prepare,
    residuals_of,
    signals_of,
)
from ppafo.identification.wording import conflict_in_words, in_shown_unit, widened_by
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.recording import CHANNELS, Channel, Recording
from ppafo.simulation.scenario import Scenario


@dataclass(frozen=True, slots=True)
class ChannelFit:
    """What one channel of one experiment leaves, in its SI unit.

    ``noise`` is the standard deviation that weighs it and ``order`` the order of the autoregression that makes it
    white, both of its sensor; ``rms`` and ``largest`` are of this recording, ``span`` is the range that the samples
    cover.
    """

    experiment: str
    channel: str
    unit: str
    noise: float
    order: int
    rms: float
    largest: float
    span: float

    @property
    def fraction(self) -> float:
        """RMS of what is left over the range that the samples cover [-]."""
        return self.rms / self.span if self.span > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class Known:
    """A tolerance in the SI unit of its number: what it was thought to be, and what the recordings make of it.

    ``widens`` is the number that is sought whose interval it widens most, ``share`` its fraction of the variance there.
    """

    name: str
    unit: str
    before: float
    before_error: float
    after: float
    after_error: float
    widens: str
    share: float


@dataclass(frozen=True, slots=True)
class TrajectoryFit:
    """Estimates of the numbers that were sought, each with verdict and sentence, and what was not known exactly.

    ``covariance`` [SI] and ``correlation`` are in the order of ``estimates``. ``models`` are the fitted runs at the
    times of the samples, ``measurements`` the samples, both by experiment over the time of the run. ``conflict`` says
    which recordings or channels alone give other values than all together, empty where they agree; ``remarks`` are
    sentences about the fit as a whole, ``outliers`` about samples that were left out.
    """

    problem: TrajectoryProblem
    numbers: tuple[Number, ...]
    fit: Fit
    estimates: tuple[Estimate, ...]
    covariance: Floats
    correlation: Floats
    known: tuple[Known, ...]
    channels: tuple[ChannelFit, ...]
    models: tuple[Recording, ...]
    measurements: tuple[Recording, ...]
    scenarios: tuple[Scenario, ...]
    conflict: str
    remarks: tuple[str, ...]
    outliers: tuple[str, ...] = ()

    def estimate(self, name: str) -> Estimate:
        """Return the estimate of a number by its path; ``valve.area`` means the valve of the first experiment.

        IdentificationError where it was not sought.
        """
        full = full_path(name, self.scenarios[0])
        for one in self.estimates:
            if one.path == full:
                return one
        hint = nearest_name(full, [item.path for item in self.estimates])
        raise IdentificationError(f"'{name}' was not fitted{hint}")

    @property
    def values(self) -> dict[str, float]:
        """The estimates in SI units by path."""
        return {one.path: one.value for one in self.estimates}


def fit(problem: TrajectoryProblem, report: Report = report_nothing) -> TrajectoryFit:
    """Return the numbers of a problem that explain its recordings best, each with interval [SI] and verdict.

    ``report`` hears what is being done. IdentificationError where it cannot be run.
    """
    numbers = numbers_of(problem)
    free = [number.free for number in numbers]
    start = np.array([number.start for number in free])
    prepared = tuple(
        prepare(
            experiment,
            numbers_in(experiment.label, numbers, start),
            reach_of([number for number in numbers if number.acts_in(experiment.label)]),
        )
        for experiment in problem.experiments
    )
    report(Progress(f"trajectory fit: {len(free)} numbers, {len(prepared)} recordings"))
    blocks = blocks_of(prepared, numbers, start)
    fitted = estimate(
        lambda points: residuals_of(prepared, numbers, points),
        free,
        blocks,
        problem.confidence,
        report,
        is_motion=True,
    )
    conflict = conflict_in_words(fitted, "the model lacks something") or _wandering(fitted, numbers)
    sought = [row for row, number in enumerate(numbers) if not number.is_tolerance]
    estimates = tuple(_estimate(problem, fitted, numbers[row], row, conflict) for row in sought)
    tolerated = [row for row, number in enumerate(numbers) if number.is_tolerance]
    errors = np.sqrt(np.diag(fitted.covariance))
    # Tolerances are marginalised: their rows are left out, their share of the variance stays.
    part = fitted.covariance[np.ix_(sought, sought)]
    signals = signals_of(prepared, numbers, fitted.values[:, None])
    scenarios = tuple(
        with_numbers(experiment.scenario, numbers_in(experiment.label, numbers, fitted.values))
        for experiment in prepared
    )
    models, measurements, channels = [], [], []
    for experiment, run, columns in zip(problem.experiments, prepared, signals, strict=True):
        modelled = {name: Channel(column[:, 0], CHANNELS[name].unit) for name, column in columns.items()}
        samples = {channel.name: Channel(channel.values, CHANNELS[channel.name].unit) for channel in run.channels}
        models.append(Recording(f"model of {run.label}", run.time, modelled, kind="simulated"))
        measurements.append(Recording(experiment.label, run.time, samples, kind=experiment.recording.kind))
        channels += [
            _channel(fitted, experiment.label, channel, columns[channel.name][:, 0]) for channel in run.channels
        ]
    remarks = [text for text in dict.fromkeys(broken_rule(scenario.device) for scenario in scenarios) if text]
    if not fitted.has_converged:
        starts = ", ".join(map(_start_of, estimates))
        remarks.append(
            f"the search stopped after {fitted.evaluations} runs before it converged; give the parameters {starts}, "
            "where it ended"
        )
    return TrajectoryFit(
        problem=problem,
        numbers=numbers,
        fit=fitted,
        estimates=estimates,
        covariance=part,
        correlation=part / np.outer(errors[sought], errors[sought]),
        known=tuple(_known(fitted, numbers[row], row, float(errors[row]), estimates) for row in tolerated),
        channels=tuple(channels),
        models=tuple(models),
        measurements=tuple(measurements),
        scenarios=scenarios,
        conflict=conflict,
        remarks=tuple(remarks),
        outliers=tuple(_left_out(fitted, blocks, {one.label: one.time for one in prepared})),
    )


def _left_out(fitted: Fit, blocks: Sequence[Block], times: Mapping[str, Floats]) -> Iterator[str]:
    """Return what is said of the outliers of each channel of each recording; ``times`` [s] are those of the samples."""
    for one in blocks:
        own = [row - one.rows.start for row in fitted.outliers if one.rows.start <= row < one.rows.stop]
        if own:
            count, first = ("1 sample" if len(own) == 1 else f"{len(own)} samples"), times[one.recording][own[0]]
            verb = "stands out by itself and was" if len(own) == 1 else "stand out by themselves and were"
            yield f"experiment '{one.recording}': {count} of {one.channel}, at {first:.6g} s first, {verb} left out"


def _start_of(item: Estimate) -> str:
    """Return an estimate as the start that a problem file may give for it."""
    text = f"{item.value:.4g}" if item.unit in ("", "-") else f"{item.value:.4g} {item.unit}"
    return f'start = "{text}" of {item.path}'


def _known(fitted: Fit, number: Number, row: int, error: float, estimates: Sequence[Estimate]) -> Known:
    """Return what a fit says of a number that is known to a tolerance, and whose interval that widens most."""
    name, free = number.free.name, number.free
    shares = {item.path: dict(fitted.shares[item.path]).get(name, 0.0) for item in estimates}
    widens = max(shares, key=lambda path: shares[path], default="")
    before, before_error = _in_its_unit(number, free.start, free.deviation)
    after, after_error = _in_its_unit(number, float(fitted.values[row]), error)
    return Known(
        name=name,
        unit=number.unit,
        before=before,
        before_error=before_error,
        after=after,
        after_error=after_error,
        widens=widens,
        share=shares.get(widens, 0.0),
    )


def _in_its_unit(number: Number, value: float, error: float) -> tuple[float, float]:
    """Return a number and its standard error in its unit [SI]; the fit may have moved its logarithm."""
    if not number.is_logarithm:
        return value, error
    return math.exp(value), math.exp(value) * error


def _wandering(found: Fit, numbers: tuple[Number, ...]) -> str:
    """Return which channel leaves noise that wanders by more than its zero may be off; empty where none does.

    A sensor whose zero is known within a limit does not leave it from sample to sample: what does is the model's.
    """
    for item in numbers:
        noise = found.sensors.get(item.path.removeprefix(ZERO_OF)) if item.path.startswith(ZERO_OF) else None
        limit = math.sqrt(3.0) * item.free.deviation
        if noise is not None and math.isfinite(limit):
            wander = noise.deviation * math.sqrt(max(1.0 - noise.innovation**2, 0.0))
            if wander > limit:
                shown, unit = in_shown_unit(wander, item.unit.removesuffix("_d"))
                most, _ = in_shown_unit(limit, item.unit.removesuffix("_d"))
                return (
                    f"what is left of {item.path.removeprefix(ZERO_OF)} wanders by {shown:.2g} {unit}, and its zero by "
                    f"{most:.2g} {unit} at most; the model lacks something"
                )
    return ""


_OWN_SHARE = 0.2
_AT_BOUND = 1.0e-6


def _estimate(problem: TrajectoryProblem, fitted: Fit, number: Number, row: int, conflict: str) -> Estimate:
    """Return one estimate with its verdict and sentence."""
    value, low, high = (float(column[row]) for column in (fitted.values, fitted.low, fitted.high))
    name, free = number.free.name, number.free
    bound = next((end for end in (free.low, free.high) if abs(value - end) <= _AT_BOUND * abs(end or 1.0)), None)
    # A number with a small weight only accompanies a combination that is open.
    combination = next((weights for weights in fitted.unidentified if abs(weights.get(name, 0.0)) >= _OWN_SHARE), None)
    verdict: Verdict = "identified"
    if combination is not None:
        verdict = "not identifiable"
        # So far from where it was linearised the interval of a straight line means nothing.
        low, high = min(low, free.low), max(high, free.high)
        others = [other for other in combination if other != name]
        remedy = "fix it, give a prior, or make another recording"
        text = f"trades off against {' and '.join(others)}; {remedy}"
        if not others:
            # Where the model lacks something, that may be what moves a number so far from its start.
            text = conflict or f"the recordings are hardly sensitive to it; {remedy}"
    elif bound is not None:
        end, unit = in_shown_unit(bound, number.unit)
        verdict, text = "at its bound", f"the recordings want a value at or beyond {end:.6g} {unit}".rstrip(" -")
    elif conflict:
        # Said of every number: which of them the missing physics moves is not known.
        verdict, text = "holds for this model only", conflict
    else:
        text = widened_by(fitted, name)
    recordings = tuple(
        experiment.source or experiment.recording.label
        for experiment in problem.experiments
        if number.acts_in(experiment.label)
    )
    return Estimate(
        path=name,
        value=value,
        unit=number.unit,
        low=low,
        high=high,
        verdict=verdict,
        explanation=text,
        recordings=recordings,
        confidence=problem.confidence,
    )


def _channel(fitted: Fit, experiment: str, measured: Measured, model: Floats) -> ChannelFit:
    left = measured.values - model
    return ChannelFit(
        experiment=experiment,
        channel=measured.name,
        unit=CHANNELS[measured.name].unit,
        noise=fitted.noise[measured.name],
        order=fitted.correlation[measured.name],
        rms=float(np.sqrt(np.mean(left * left))),
        largest=float(np.max(np.abs(left))),
        span=float(np.ptp(measured.values)),
    )
