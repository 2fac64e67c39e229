"""Trajectory fit: simulated runs as residuals of the common estimator, and results as estimates of the device."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ppafo.errors import IdentificationError, refused_as
from ppafo.identification.estimate import UNKNOWN, Estimate, Verdict, in_shown_unit, relative_half_width
from ppafo.identification.fit import Fit, conflict_in_words, widened_by
from ppafo.identification.fit import fit as fit_residuals
from ppafo.identification.least_squares import FitRuns, FitVariable, ResidualBlock
from ppafo.identification.noise import Noise, whiten
from ppafo.identification.source import kind_of
from ppafo.identification.trajectory.experiment import (
    FITTED_CHANNELS,
    LAG_OF,
    ZERO_OF,
    FitNumber,
    TrajectoryProblem,
    broken_rule,
    full_path,
    numbers_of,
    reach_of,
    with_numbers,
)
from ppafo.identification.trajectory.runs import (
    FitChannel,
    PreparedExperiment,
    blocks_of,
    columns_in,
    numbers_in,
    prepare,
    prepare_samples,
    residuals_of,
    signals_at,
    signals_of,
)
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.faults import correlated_noise_of, noise_of
from ppafo.signals.recording import CHANNELS, Channel, Floats, Recording, RecordingKind
from ppafo.simulation.scenario import Scenario
from ppafo.wording import count_of, nearest_name

_STATIC, _DYNAMIC = "friction.static_torque", "friction.dynamic_torque"
_DEAD_TIMES = "delay", "time_offset"
"""Last words of the paths of dead times."""
_LAGS = 10.0
"""Least increase of the log-likelihood [-] by which lags of sensors are found."""
_WINDOWS, _RUN = (3, 6, 12, 24, 48), 6.0
"""Lengths of runs of residuals [samples], and size of their sum that no white noise has [standard deviations]."""
_FELT = 1.0e-3
"""Least residuals that are tested as bursts [ranges of the samples]; smaller ones are the engine's."""
_BURST = 6.0
"""Ratio of residuals to the noise that lasts [-] from which they are no noise; slow noise has up to 5.5."""
_OWN_SHARE = 0.2
"""Weight in an undetermined combination [-] from which a parameter itself counts as not identifiable."""
_AT_BOUND = 1.0e-6
"""Relative distance from a bound [-] up to which an estimate counts as at its bound."""
_NEAR = 1.0e-3
"""Same distance, as a fraction of the width of the interval [-]."""
_WHOLE = 1.0e-6
"""Rounding tolerance of the last sample interval, as a fraction of an interval [-]."""


@dataclass(frozen=True, slots=True)
class ChannelFit:
    """Residual statistics of one channel of one experiment, in its SI unit.

    ``noise`` is the estimated standard deviation and ``order`` the order of the autoregression, both common to all
    recordings of the sensor. ``rms`` and ``largest`` are the RMS and largest magnitude of the residuals of this
    recording, ``span`` is the range of its samples.
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
        """RMS of the residuals divided by the range of the samples [-]."""
        return self.rms / self.span if self.span > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class NuisanceParameter:
    """Uncertain quantity of bench or device (tolerance) [SI]: value and standard error before and after the fit.

    ``widens`` is the unknown whose interval depends most on this quantity, ``share`` the fraction of its variance [-].
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
    """Result of a trajectory fit: estimates of the unknowns, and the updated tolerances (``known``).

    ``covariance`` [SI] and ``correlation`` are in the order of ``estimates``. ``channels`` are residual statistics.
    ``models`` are the fitted runs at the sample times and ``measurements`` the samples, both by experiment with the
    time of the run. ``scenarios`` have the fitted values. ``conflict`` is a sentence on recordings or channels whose
    separate estimates differ from the common estimates, empty if all agree. ``remarks`` are sentences on the fit as a
    whole, ``outliers`` on samples left out.
    """

    problem: TrajectoryProblem
    numbers: tuple[FitNumber, ...]
    fit: Fit
    estimates: tuple[Estimate, ...]
    covariance: Floats
    correlation: Floats
    known: tuple[NuisanceParameter, ...]
    channels: tuple[ChannelFit, ...]
    models: tuple[Recording, ...]
    measurements: tuple[Recording, ...]
    scenarios: tuple[Scenario, ...]
    conflict: str
    remarks: tuple[str, ...]
    outliers: tuple[str, ...] = ()

    def estimate(self, name: str) -> Estimate:
        """Return the estimate at a path; ``valve.area`` means the valve of the first experiment.

        Raises IdentificationError if the parameter was not fitted.
        """
        full = full_path(name, self.scenarios[0])
        for estimate in self.estimates:
            if estimate.path == full:
                return estimate
        hint = nearest_name(full, [estimate.path for estimate in self.estimates])
        raise IdentificationError(f"'{name}' was not fitted{hint}")

    @property
    def kind(self) -> RecordingKind:
        """Common origin of all recordings: measured, simulated or synthetic."""
        return kind_of(recording.kind for recording in self.measurements)

    @property
    def values(self) -> dict[str, float]:
        """Estimated values by path [SI]."""
        return {estimate.path: estimate.value for estimate in self.estimates}


def fit(problem: TrajectoryProblem, report: Report = report_nothing) -> TrajectoryFit:
    """Fit the parameters of a problem to its recordings; each estimate has an interval [SI] and a verdict.

    ``report`` receives the progress. Raises IdentificationError if the problem cannot be simulated.
    """
    numbers = numbers_of(problem)
    # Beside a lag a steep signal says little of other numbers, so it is a tolerance where recordings ask for it, and of
    # a dead time always, which it resembles so much that small residuals would not show it.
    steady = tuple(number for number in numbers if not (number.is_tolerance and number.path.startswith(LAG_OF)))
    if any(not number.is_tolerance and number.path.endswith(_DEAD_TIMES) for number in numbers):
        return _fit_of(problem, numbers, report)
    found = _fit_of(problem, steady, report)
    if len(steady) < len(numbers) and (found.conflict or any(map(_follow_each_other, _residuals_in(found)))):
        report(Progress("trajectory fit: again, with sensors that lag"))
        lagging = _fit_of(problem, numbers, report)
        if lagging.fit.log_likelihood > found.fit.log_likelihood + _LAGS:
            return lagging
    return found


def _residuals_in(found: TrajectoryFit) -> Iterator[Floats]:
    """Yield the residuals [SI] of each channel of each experiment."""
    for measured, model in zip(found.measurements, found.models, strict=True):
        yield from (measured[name] - model[name] for name in measured.names if name in model)


def _follow_each_other(residuals: Floats) -> bool:
    """Return whether the residuals of some part of a recording have one sign, as white noise has not."""
    noise = max(noise_of(residuals), 1.0e-300)
    sums = np.cumsum(residuals, dtype=float)
    return any(
        float(np.abs(sums[width:] - sums[:-width]).max(initial=0.0)) > _RUN * noise * math.sqrt(width)
        for width in _WINDOWS
    )


def _fit_of(problem: TrajectoryProblem, numbers: tuple[FitNumber, ...], report: Report) -> TrajectoryFit:
    """Return the fit of some numbers of a problem; those that are left out stay at their start values."""
    free = [number.free for number in numbers]
    start = np.array([number.start for number in free])
    rows = {(item.path, item.recordings): row for row, item in enumerate(numbers) if not item.is_tolerance}
    sought = list(free)
    for (path, labels), row in rows.items():
        dynamic = rows.get((_DYNAMIC, labels))
        if path == _STATIC and dynamic is not None and math.isinf(free[row].deviation):
            sought[row] = _excess(free[row], free[dynamic])
    runs = []
    for experiment in problem.experiments:
        reach = reach_of([number for number in numbers if number.acts_in(experiment.label)])
        runs.append(prepare(experiment, numbers_in(experiment.label, numbers, start), reach))
    report(Progress(f"trajectory fit: {len(free)} numbers, {len(runs)} recordings"))
    blocks = blocks_of(runs, numbers, start)
    residuals = partial(residuals_of, runs, numbers)
    for variables in (sought, free):
        fitted = fit_residuals(residuals, variables, blocks, problem.confidence, report, is_motion=True)
        # Bounds of friction at rest that its excess does not keep are kept by a search within them.
        excesses = [row for row, variable in enumerate(variables) if variable.base]
        if all(free[row].low <= fitted.values[row] <= free[row].high for row in excesses):
            break
    return _result(problem, numbers, runs, blocks, fitted)


def _excess(static: FitVariable, dynamic: FitVariable) -> FitVariable:
    """Return friction at rest as the excess over friction in motion, since it is at least as large."""
    low, high = max(static.low - dynamic.high, 0.0), static.high - dynamic.low
    if not low < high:
        raise IdentificationError(
            f"{static.name}: high = {static.high:.6g} N m must be above low = {dynamic.low:.6g} N m of {dynamic.name}, "
            "for friction at rest is at least friction in motion"
        )
    start = min(max(static.start - dynamic.start, low), high)
    return replace(static, start=start, low=low, high=high, scale=dynamic.scale, base=dynamic.name)


def _result(
    problem: TrajectoryProblem,
    numbers: tuple[FitNumber, ...],
    runs: Sequence[PreparedExperiment],
    blocks: Sequence[ResidualBlock],
    fitted: Fit,
) -> TrajectoryFit:
    """Return the result of a finished search: estimates, updated tolerances, and the model beside each recording."""
    models, measurements, channels, outliers = list[Recording](), list[Recording](), list[ChannelFit](), list[str]()
    signals = signals_of(runs, numbers, fitted.values[:, None])
    for experiment, run, columns in zip(problem.experiments, runs, signals, strict=True):
        units = {name: CHANNELS[name].unit for name in columns}
        modelled = {name: Channel(column[:, 0], units[name]) for name, column in columns.items()}
        samples = {channel.name: Channel(channel.values, units[channel.name]) for channel in run.channels}
        models.append(Recording(f"model of {run.label}", run.time, modelled, kind="simulated"))
        measurements.append(Recording(experiment.label, run.time, samples, kind=experiment.recording.kind))
        for channel in run.channels:
            residuals = channel.values - columns[channel.name][:, 0]
            channels.append(
                ChannelFit(
                    experiment=run.label,
                    channel=channel.name,
                    unit=units[channel.name],
                    noise=fitted.noise[channel.name],
                    order=fitted.correlation[channel.name],
                    rms=float(np.sqrt(np.mean(residuals * residuals))),
                    largest=float(np.max(np.abs(residuals))),
                    span=float(np.ptp(channel.values)),
                )
            )
    times = {run.label: run.time for run in runs}
    for block in blocks:
        left_out = [row - block.rows.start for row in fitted.outliers if block.rows.start <= row < block.rows.stop]
        if left_out:
            count, first = count_of(len(left_out), "outlier"), times[block.recording][left_out[0]]
            text = f"{count} of {block.channel} left out, the first at {first:.6g} s"
            outliers.append(f"experiment '{block.recording}': {text}")
    remedy = "the model is incomplete"
    is_free = any(number.path == _STATIC and not number.is_tolerance for number in numbers)
    if fitted.conflict is not None and fitted.conflict.group == "angle" and not is_free:
        remedy += f", or {_STATIC} is to be fitted too"
    conflict = conflict_in_words(fitted, remedy) or _wandering(fitted, numbers) or _bursting(measurements, models)
    # Tolerances are marginalised: their rows are left out, their share of the variance stays.
    rows = [row for row, number in enumerate(numbers) if not number.is_tolerance]
    estimates = tuple(_estimate(problem, fitted, numbers[row], row, conflict) for row in rows)
    errors = np.sqrt(np.diag(fitted.covariance))
    covariance = fitted.covariance[np.ix_(rows, rows)]
    known = list[NuisanceParameter]()
    for row, number in enumerate(numbers):
        if number.is_tolerance:
            name, free = number.free.name, number.free
            shares = {estimate.path: dict(fitted.shares[estimate.path]).get(name, 0.0) for estimate in estimates}
            widens = max(shares, key=lambda path: shares[path], default="")
            pairs = [(free.start, free.deviation), (float(fitted.values[row]), float(errors[row]))]
            if number.is_logarithm:
                pairs = [(math.exp(value), math.exp(value) * deviation) for value, deviation in pairs]
            known.append(NuisanceParameter(name, number.unit, *pairs[0], *pairs[1], widens, shares.get(widens, 0.0)))
    scenarios = tuple(with_numbers(run.scenario, numbers_in(run.label, numbers, fitted.values)) for run in runs)
    remarks = [text for text in dict.fromkeys(broken_rule(scenario.device) for scenario in scenarios) if text]
    texts = {item.path: f"{item.value:.4g} {item.unit}".rstrip(" -") for item in estimates}
    if fitted.edge:
        sides = {path: "above" if side > 0 else "below" for path, side in fitted.edge.items()}
        wanted = " and ".join(f"{path} {sides[path]} {text}" for path, text in texts.items() if path in sides)
        remarks.append(f"the recordings favour {wanted}, where every run fails; check recordings, scenario and set")
    elif not fitted.has_converged:
        reached = ", ".join(f'start = "{text}" of {path}' for path, text in texts.items())
        remarks.append(
            f"the search stopped after {fitted.evaluations} runs before it converged; it goes on from {reached}"
        )
    return TrajectoryFit(
        problem=problem,
        numbers=numbers,
        fit=fitted,
        estimates=estimates,
        covariance=covariance,
        correlation=covariance / np.outer(errors[rows], errors[rows]),
        known=tuple(known),
        channels=tuple(channels),
        models=tuple(models),
        measurements=tuple(measurements),
        scenarios=scenarios,
        conflict=conflict,
        remarks=tuple(remarks),
        outliers=tuple(outliers),
    )


def _wandering(fitted: Fit, numbers: tuple[FitNumber, ...]) -> str:
    """Return a sentence on a channel whose residual drifts beyond the limit of its zero error; empty if none does.

    The zero error of a sensor stays within its limit, so a larger drift is due to the model.
    """
    for number in (number for number in numbers if number.path.startswith(ZERO_OF)):
        channel = number.path.removeprefix(ZERO_OF)
        noise, limit = fitted.sensors.get(channel), math.sqrt(3.0) * number.free.deviation
        if noise is None or not math.isfinite(limit):
            continue
        wander = noise.deviation * math.sqrt(max(1.0 - noise.innovation**2, 0.0))
        if wander > limit:
            shown, unit = in_shown_unit(wander, number.unit.removesuffix("_d"))
            most, _ = in_shown_unit(limit, number.unit.removesuffix("_d"))
            return (
                f"the residual of {channel} drifts by {shown:.2g} {unit}, but the zero of its sensor by at most "
                f"{most:.2g} {unit}; the model is incomplete"
            )
    return ""


def _bursting(measurements: Sequence[Recording], models: Sequence[Recording]) -> str:
    """Return a sentence on a channel whose residuals are far above the noise that lasts; empty if there is none."""
    for measured, model in zip(measurements, models, strict=True):
        for name in (name for name in measured.names if name in model):
            residuals = measured[name] - model[name]
            size, noise = float(np.sqrt(np.mean(np.square(residuals)))), correlated_noise_of(residuals)
            if size > _BURST * noise and size > _FELT * float(np.ptp(measured[name])):
                return (
                    f"the residual of {name} of {measured.label} is {size / max(noise, 1.0e-300):.0f} times the noise "
                    "that lasts; the model is incomplete"
                )
    return ""


def _estimate(problem: TrajectoryProblem, fitted: Fit, number: FitNumber, row: int, conflict: str) -> Estimate:
    """Return the estimate of one parameter with its verdict and explanation."""
    value, low, high = (float(column[row]) for column in (fitted.values, fitted.low, fitted.high))
    name, free = number.free.name, fitted.numbers[row]
    base = fitted.by_name.get(free.base, 0.0)
    bounds = [max(base + free.low, number.free.low), min(base + free.high, number.free.high)]
    if free.base:
        low, high = max(low, number.free.low), min(high, number.free.high)
    bound = next(
        (end for end in bounds if abs(value - end) <= max(_AT_BOUND * abs(end or 1.0), _NEAR * (high - low))), None
    )
    combination = next((weights for weights in fitted.unidentified if abs(weights.get(name, 0.0)) >= _OWN_SHARE), None)
    verdict: Verdict = "identified"
    # Of a quantity of either sign, such as the zero of a sensor, the value may be zero.
    size = free.scale if free.low < 0.0 < free.high else None
    remedy = "fix this parameter, give a prior, or make another recording"
    if combination is not None:
        verdict = "not identifiable"
        # So far from where it was linearised the interval of a straight line means nothing.
        low, high = min(low, bounds[0]), max(high, bounds[1])
        others = [other for other in combination if other != name]
        text = f"trades off against {' and '.join(others)}; {remedy}"
        if not others:
            # Where the model lacks something, that may be what moves a number so far from its start.
            text = conflict or f"the recordings are hardly sensitive to this parameter; {remedy}"
    elif bound is not None and not free.base:
        end, unit = in_shown_unit(bound, number.unit)
        verdict, text = "at its bound", f"the recordings favour a value at or beyond {end:.6g} {unit}".rstrip(" -")
    elif relative_half_width(value, low, high, size) >= UNKNOWN:
        verdict = "not identifiable"
        text = f"{widened_by(fitted, name)}; the interval includes zero or twice the value; {remedy}"
    elif conflict:
        # Said of every number: which of them the missing physics moves is not known.
        verdict, text = "holds for this model only", conflict
    else:
        text = widened_by(fitted, name)
        cut = [
            bound for bound, end in zip(bounds, (low, high), strict=True) if abs(end - bound) <= _AT_BOUND * abs(end)
        ]
        if free.base and low <= base:
            text += f"; the interval contains its bound, {free.base}"
        elif cut:
            end, unit = in_shown_unit(cut[0], number.unit)
            text += f"; the interval ends at its bound, {end:.4g} {unit}".rstrip(" -")
    recordings = tuple(
        experiment.source or experiment.recording.label
        for experiment in problem.experiments
        if number.acts_in(experiment.label)
    )
    return Estimate(name, value, number.unit, low, high, verdict, text, recordings, problem.confidence, size)


@dataclass(frozen=True, slots=True)
class CandidateExperiment:
    """Candidate for the next experiment: scenario, noise of each channel [rad], [Pa], and sample interval [s].

    The device comes from the scenario, with the fitted values inserted. Without ``noise``, all channels of the fit are
    compared, each with its estimated noise; otherwise only the channels in ``noise``.
    """

    label: str
    scenario: Scenario
    noise: Mapping[str, float]
    interval: float = 1.0e-3


@dataclass(frozen=True, slots=True)
class ExpectedBenefit:
    """Expected benefit of a candidate experiment.

    ``gain`` is half the increase of the log-determinant of the information on the unknowns [-] (D-optimality): the
    volume of their confidence region shrinks by exp(gain). ``shrinkage`` is, for each unknown, the standard error after
    the experiment divided by the present one. ``most_helped`` names the unknown that shrinks most.
    """

    label: str
    gain: float
    shrinkage: Mapping[str, float]
    most_helped: str


def expected_information(fit: TrajectoryFit, candidates: Sequence[CandidateExperiment]) -> tuple[ExpectedBenefit, ...]:
    """Return the expected benefit of each candidate experiment, the most informative first.

    Raises IdentificationError for a candidate without noise in any channel that can be fitted.
    """
    benefits = [_benefit(fit, candidate) for candidate in candidates]
    return tuple(sorted(benefits, key=lambda benefit: -benefit.gain))


def _benefit(fit: TrajectoryFit, candidate: CandidateExperiment) -> ExpectedBenefit:
    """Return the expected benefit of a candidate, from its whitened Jacobian added to the information of the fit."""
    noise = dict(candidate.noise) or dict(fit.fit.noise)
    if not noise or any(name not in FITTED_CHANNELS or not deviation > 0.0 for name, deviation in noise.items()):
        raise IdentificationError(
            f"candidate '{candidate.label}': noise must be above 0 for at least one of {', '.join(FITTED_CHANNELS)}"
        )
    # What belongs to one recording, such as its trigger, another experiment says nothing of.
    common = [index for index, number in enumerate(fit.numbers) if not number.recordings]
    slopes = _slopes(candidate, noise, [fit.numbers[index] for index in common], fit.fit.values[common])
    blocks = []
    for block, (name, deviation) in zip(np.split(slopes, len(noise)), noise.items(), strict=True):
        sensor = fit.fit.sensors.get(name)
        blocks.append(whiten(block, replace(sensor, deviation=deviation) if sensor else Noise(deviation)))
    # In units of today's standard errors, for pascals and radians differ by many powers of ten.
    errors = np.sqrt(np.diag(fit.fit.covariance))
    jacobian = np.concatenate(blocks) * errors[common]
    before = fit.fit.covariance / np.outer(errors, errors)
    information = np.linalg.inv(before)
    information[np.ix_(common, common)] += jacobian.T @ jacobian
    after = np.linalg.inv(information)
    unknowns = [index for index, number in enumerate(fit.numbers) if not number.is_tolerance]
    shrinkage = {fit.numbers[index].free.name: math.sqrt(max(after[index, index], 0.0)) for index in unknowns}
    rows = np.ix_(unknowns, unknowns)
    gain = 0.5 * float(np.linalg.slogdet(before[rows])[1] - np.linalg.slogdet(after[rows])[1])
    return ExpectedBenefit(candidate.label, gain, shrinkage, min(shrinkage, key=lambda name: shrinkage[name]))


def _slopes(
    candidate: CandidateExperiment, noise: Mapping[str, float], numbers: Sequence[FitNumber], point: Floats
) -> Floats:
    """Return the Jacobian [SI] (samples of all channels, numbers) of the samples of a candidate at a point [SI]."""
    count = math.floor(candidate.scenario.run.duration / candidate.interval + _WHOLE)
    times = candidate.interval * np.arange(count + 1, dtype=np.float64)
    channels = [FitChannel(name, np.zeros(times.size)) for name in noise]
    values = numbers_in("", numbers, point)
    prepared = prepare_samples(candidate.label, candidate.scenario, times, channels, reach_of(numbers), values)

    def samples(points: Floats) -> Floats:
        signals = signals_at(prepared, columns_in("", numbers, points), points.shape[1])
        return np.concatenate([signals[name] for name in noise])

    runs = FitRuns(samples, tuple(number.free for number in numbers), (), report_nothing, 0, is_motion=True)
    with refused_as(IdentificationError, f"candidate '{candidate.label}'", IdentificationError):
        # As in the fit, a difference is as long as changes the samples by three units of noise in all.
        weight = 1.0 / np.repeat(list(noise.values()), times.size)
        runs.adapt_steps(runs.jacobian(point / runs.scale), weight)
        return np.asarray(runs.jacobian(point / runs.scale) / runs.scale)
