"""Fits any numbers of a device to any recordings: how well they fix each, and what stays unexplained by channel."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.estimate import Estimate
from ppafo.identification.trajectory.directions.gain_drift import LARGEST_DRIFT
from ppafo.identification.trajectory.doubt import Doubt, doubt_of
from ppafo.identification.trajectory.information import autocorrelation, correlation
from ppafo.identification.trajectory.problem import (
    Experiment,
    TrajectoryProblem,
    broken_rule,
    full_path,
    impossible_start,
    ranges_of,
    reach_of,
    with_numbers,
)
from ppafo.identification.trajectory.residuals import (
    Floats,
    PreparedExperiment,
    Residuals,
    coordinate_bounds,
    numbers_in,
    prepare,
    prior_coordinates,
    trajectories,
    with_half_steps,
)
from ppafo.identification.trajectory.search import Optimum, Sensor, optimum, weigh
from ppafo.identification.trajectory.uncertainty import Evidence, Misfit, Uncertainty, estimate_of, uncertainty_of
from ppafo.parameters.device import Device
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.recording import CHANNELS, Channel, Recording, RecordingKind
from ppafo.simulation.scenario import Scenario

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

_MUCH = 1.5
_TOGETHER = 0.2
_OF_NO_SENSOR = 10.0
"""What is left over the noise from sample to sample: more than an autoregression of 0.98 makes is no sensor's."""
PREDICTED = 0.95
"""Fraction of the samples of a new recording that a prediction holds."""


@dataclass(frozen=True, slots=True)
class ChannelFit:
    """How one channel of one experiment is explained, in its SI unit.

    ``noise`` is the standard deviation that weighs it, ``is_given`` False where it was estimated from the recording;
    ``rms``, ``bias`` (model less sample) and ``largest`` describe what is left; ``chi_square`` is the mean square over
    the noise and ``autocorrelation`` that of neighbouring residuals, 1 and 0 for a model that explains all but noise.
    ``span`` is the range that the samples cover. ``prediction`` is the distance from the fitted run within which 95 %
    of the samples of a new recording like this one are expected.
    """

    experiment: str
    channel: str
    unit: str
    noise: float
    is_given: bool
    rms: float
    bias: float
    largest: float
    chi_square: float
    autocorrelation: float
    span: float
    prediction: float

    @property
    def is_explained(self) -> bool:
        """True where the model leaves nothing but white noise."""
        return self.chi_square <= _MUCH**2 and self.autocorrelation <= _TOGETHER

    @property
    def fraction(self) -> float:
        """RMS of what is left over the range that the samples cover [-]."""
        return self.rms / self.span if self.span > 0.0 else 0.0


def channel_fits(
    requested: Sequence[Experiment], experiments: Sequence[PreparedExperiment], signals: Sequence[dict[str, Floats]]
) -> tuple[ChannelFit, ...]:
    """Return what is left in every channel [SI]; ``signals`` are those of the fitted runs, by channel."""
    found = []
    for experiment, prepared, values in zip(requested, experiments, signals, strict=True):
        for channel in prepared.channels:
            left = values[channel.name] - channel.values
            # 95 % of new samples keep the distance that those at hand keep, less one, for they were fitted.
            within = min(len(left) - 1, math.ceil(PREDICTED * (len(left) + 1)))
            fit = ChannelFit(
                experiment=experiment.label,
                channel=channel.name,
                unit=CHANNELS[channel.name].unit,
                noise=channel.noise,
                is_given=channel.name in experiment.noise,
                rms=float(np.sqrt(np.mean(left * left))),
                bias=float(np.mean(left)),
                largest=float(np.max(np.abs(left))),
                chi_square=float(np.mean(np.square(left / channel.noise))),
                autocorrelation=autocorrelation(left),
                span=float(np.ptp(channel.values)),
                prediction=float(np.sort(np.abs(left))[within]),
            )
            found.append(fit)
    return tuple(found)


def reason_of_misfit(misfit: Misfit, channels: Sequence[ChannelFit], sensors: Sequence[Sensor]) -> str:
    """Return why the model does not explain the recordings, empty where it does.

    Parts want different numbers, or a channel leaves more than its sensor can be blamed for.
    """
    if misfit.is_found:
        return misfit.in_words
    of_gain = {one.channel: LARGEST_DRIFT * one.noise.size_of_level for one in sensors if one.noise.has_gain}
    for channel in channels:
        size = float(np.sqrt(channel.chi_square))
        if size > (_MUCH if channel.is_given else max(_OF_NO_SENSOR, of_gain.get(channel.channel, 0.0))):
            noise = "the noise that was given for it" if channel.is_given else "its noise from sample to sample"
            return f"{channel.channel} of {channel.experiment} leaves {size:.2g} times {noise}"
    return ""


def predictions(channels: Sequence[ChannelFit]) -> tuple[str, ...]:
    """Return a sentence for each recording: how near a new one like it is expected to the fitted run."""
    found = []
    for label in dict.fromkeys(channel.experiment for channel in channels):
        widths = []
        for channel in channels:
            width, unit = channel.prediction, channel.unit
            shown = f"{math.degrees(width):.3g} deg" if unit == "rad" else f"{width:.3g} {unit}"
            widths += [f"{channel.channel} +- {shown}"] if channel.experiment == label else []
        found.append(
            f"95 % of the samples of a new recording like '{label}', by sensors whose zeros have not moved since, lie "
            f"within {', '.join(widths)} of its run"
        )
    return tuple(found)


@dataclass(frozen=True, slots=True)
class TrajectoryFit:
    """Estimates with verdicts, their covariance in SI units and correlation, and what is left unexplained.

    Matrices are in the order of ``estimates``; those of the coordinates are in ``uncertainty``. ``models`` are the
    fitted runs at the times of the samples, ``measurements`` the samples, both by experiment over the time of the run.
    ``remarks`` are sentences about the fit as a whole. ``misfit`` says why the model does not explain the recordings,
    so that what they fix holds for it only; empty if it does. ``doubt`` has what they say of effects that the model
    lacks, None where that was not searched.
    """

    problem: TrajectoryProblem
    estimates: tuple[Estimate, ...]
    covariance: Floats
    correlation: Floats
    uncertainty: Uncertainty
    cost: float
    evaluations: int
    channels: tuple[ChannelFit, ...]
    models: tuple[Recording, ...]
    measurements: tuple[Recording, ...]
    scenarios: tuple[Scenario, ...]
    remarks: tuple[str, ...]
    optimum: Optimum
    misfit: str
    doubt: Doubt | None

    def estimate(self, name: str) -> Estimate:
        """Return the estimate of a parameter by its path; ``valve.area`` means the valve of the first experiment.

        IdentificationError where it was not fitted.
        """
        full = full_path(name, self.scenarios[0])
        for estimate in self.estimates:
            if estimate.path == full:
                return estimate
        hint = nearest_name(full, [item.path for item in self.estimates])
        raise IdentificationError(f"'{name}' was not fitted{hint}")

    def posterior(self) -> "DataTree":
        """Return draws of the numbers and the recordings as a tree of datasets, laid out as ArviZ reads it; SI units.

        ``posterior`` has a variable for each number over ``chain`` and ``draw``, ``observed_data`` the samples and
        ``fitted_data`` the fitted runs, each channel over the time of its recording.
        """
        import numpy as np
        from xarray import Dataset, DataTree

        mixture, ranges = self.uncertainty.mixture, self.optimum.residuals.ranges
        chains = len(np.unique(mixture.chain))
        points = np.clip(self.optimum.point + mixture.draws, *coordinate_bounds(ranges))
        posterior = {
            item.name: (
                ("chain", "draw"),
                np.array([item.number(float(one)) for one in points[:, index]]).reshape(chains, -1),
                {"unit": item.unit},
            )
            for index, item in enumerate(ranges)
        }
        kind = {"kind": self.measurements[0].kind}
        groups = {
            "posterior": Dataset(posterior, attrs=kind),
            "observed_data": _dataset(self.measurements),
            "fitted_data": _dataset(self.models),
        }
        labels = {name: np.arange(size) for name, size in groups["posterior"].sizes.items()}
        groups["posterior"] = groups["posterior"].assign_coords(labels)
        return DataTree.from_dict(groups)

    @property
    def values(self) -> dict[str, float]:
        """The estimates in SI units by path."""
        return {estimate.path: estimate.value for estimate in self.estimates}


def _dataset(recordings: "tuple[Recording, ...]") -> "Dataset":
    """Return all channels of recordings, each over the time of its own."""
    from xarray import Dataset

    labelled = {one.label.removeprefix("model of "): one for one in recordings}
    channels = {
        f"{label}.{name}": (f"time of {label}", one[name], {"unit": one.unit(name)})
        for label, one in labelled.items()
        for name in one.names
    }
    return Dataset(channels, coords={f"time of {label}": one.time for label, one in labelled.items()})


LARGE = 0.3
"""RMS change over the noise, when steps are halved, from which the steps are reported as too long."""


def step_remarks(residuals: Residuals, point: Floats, signals: list[dict[str, Floats]]) -> tuple[str, ...]:
    """Return a sentence for each experiment whose steps are too long; ``signals`` are its runs by channel.

    ``point`` is in coordinates, signals are in SI units.
    """
    remarks = []
    for prepared, coarse in zip(residuals.experiments, signals, strict=True):
        finer = with_half_steps(prepared, numbers_in(prepared.label, residuals.ranges, point))
        fine = trajectories([finer], residuals.ranges, point[None, :])[0]
        moved = {
            channel.name: float(np.sqrt(np.mean(np.square(fine[channel.name][:, 0] - coarse[channel.name]))))
            / channel.noise
            for channel in prepared.channels
        }
        worst = max(moved, key=lambda name: moved[name])
        if moved[worst] > LARGE:
            remarks.append(
                f"{prepared.label}: steps of {1e3 * prepared.run.step:.3g} ms are too long for so little noise: half "
                f"of that changes {worst} by {moved[worst]:.2g} times its noise; "
                f"give step = '{1e3 * finer.run.step:.3g} ms' or less"
            )
    return tuple(remarks)


def fit(problem: TrajectoryProblem, report: Report = report_nothing) -> TrajectoryFit:
    """Return the numbers of a problem that explain its recordings best, each with interval and verdict.

    Estimates are in SI units; matrices (parameters, parameters) follow their order. Residuals are weighted with the
    noise of their channel. ``report`` hears what is being done. IdentificationError where it cannot be run, or where a
    fitted start cannot be.
    """
    first = optimum(residuals_of(problem), problem.search, report)
    report(Progress("trajectory fit: noise of the sensors"))
    whole = weigh(first, [frozenset(item.noise) for item in problem.experiments])
    found = whole.optimum
    prepared, ranges = found.residuals.experiments, found.residuals.ranges
    uncertainty = uncertainty_of(whole, problem.search, *coordinate_bounds(ranges))
    centre = uncertainty.centre
    signals = [
        {name: values[:, 0] for name, values in of_one.items()}
        for of_one in trajectories(prepared, ranges, centre[None, :])
    ]
    channels = channel_fits(problem.experiments, prepared, signals)
    low, high = coordinate_bounds(ranges)
    highest = [item.number(float(end)) for item, end in zip(ranges, uncertainty.high, strict=True)]
    atmosphere = prepared[0].scenario.device.supply.atmospheric_pressure
    impossible = impossible_start(ranges, highest, atmosphere)
    if impossible:
        raise IdentificationError(impossible)
    doubt = None
    if problem.search.directions:
        report(Progress("trajectory fit: what the model may lack"))
        doubt = doubt_of(whole, uncertainty.low, uncertainty.high, uncertainty.misfit.is_doubtful)
    reasons = (
        "" if doubt is None else doubt.misfit,
        reason_of_misfit(uncertainty.misfit, channels, uncertainty.sensors),
    )
    evidence = Evidence(
        ranges=ranges,
        point=centre,
        interval=(uncertainty.low, uncertainty.high),
        information=uncertainty.curvature,
        covariance=uncertainty.covariance,
        correlation=correlation(uncertainty.covariance),
        low=low,
        high=high,
        prior_deviation=prior_coordinates(ranges)[1],
        inflation=uncertainty.inflation,
        residual_check=uncertainty.residual_check,
        misfit="; ".join(reason for reason in reasons if reason),
        alone=uncertainty.misfit.alone,
        sources=tuple(
            tuple(one.source or one.recording.label for one in problem.experiments if item.acts_in(one.label))
            for item in ranges
        ),
        search=problem.search,
        conditions=() if doubt is None else doubt.conditions,
        beside=None if doubt is None else (doubt.low, doubt.high),
        with_effect=None if doubt is None else doubt.with_effect,
    )
    slopes = np.array([item.slope(float(z)) for item, z in zip(ranges, centre, strict=True)])
    scenarios = tuple(with_numbers(item.scenario, numbers_in(item.label, ranges, centre)) for item in prepared)
    models, measurements = [], []
    for experiment, one, values in zip(problem.experiments, prepared, signals, strict=True):
        samples = {channel.name: channel.values for channel in one.channels}
        models.append(_recording(f"model of {one.label}", one, values, "simulated"))
        measurements.append(_recording(experiment.label, one, samples, experiment.recording.kind))
    return TrajectoryFit(
        problem=problem,
        estimates=tuple(estimate_of(evidence, index) for index in range(len(ranges))),
        covariance=uncertainty.covariance * np.outer(slopes, slopes),
        correlation=evidence.correlation,
        uncertainty=uncertainty,
        cost=first.cost,
        evaluations=found.evaluations,
        channels=channels,
        models=tuple(models),
        measurements=tuple(measurements),
        scenarios=scenarios,
        remarks=_remarks(problem, found, evidence.misfit, uncertainty, channels, scenarios[0].device)
        + step_remarks(found.residuals, centre, signals),
        optimum=found,
        misfit=evidence.misfit,
        doubt=doubt,
    )


def residuals_of(problem: TrajectoryProblem) -> Residuals:
    """Return the residuals of a problem."""
    ranges = ranges_of(problem)
    start = np.array([item.coordinate(item.start) for item in ranges])
    prepared = []
    for item in problem.experiments:
        reach = reach_of([one for one in ranges if one.acts_in(item.label)])
        prepared.append(prepare(item, numbers_in(item.label, ranges, start), reach))
    return Residuals(tuple(prepared), ranges)


def noise_in(problem: TrajectoryProblem) -> dict[str, float]:
    """Return the noise [rad], [Pa] of each channel, of the first recording that has it; estimated if not given."""
    found: dict[str, float] = {}
    for experiment in residuals_of(problem).experiments:
        found = {channel.name: channel.noise for channel in experiment.channels} | found
    return found


def _recording(label: str, prepared: PreparedExperiment, values: dict[str, Floats], kind: RecordingKind) -> Recording:
    channels = {name: Channel(series, CHANNELS[name].unit) for name, series in values.items()}
    return Recording(label, prepared.time, channels, kind)


def _remarks(
    problem: TrajectoryProblem,
    found: Optimum,
    misfit: str,
    uncertainty: Uncertainty,
    channels: Sequence[ChannelFit],
    device: Device,
) -> tuple[str, ...]:
    remarks = []
    if not found.has_converged:
        remarks.append(
            f"the search stopped after {problem.search.maximum_evaluations} evaluations before it converged: "
            f"start closer to the solution, or allow more evaluations"
        )
    if misfit:
        text = f"the model does not explain the recordings: {misfit}; what it determines holds for this model only"
        remarks += [text, *predictions(channels)]
    else:
        noises = {sensor.channel: sensor.in_words for sensor in uncertainty.sensors}
        remarks += [
            f"{one.experiment}: what is left of {one.channel} is {np.sqrt(one.chi_square):.2g} times its noise from "
            f"sample to sample (neighbours are correlated by {one.autocorrelation:+.2f}) and was attributed to the "
            f"sensor: {noises[one.channel]}; if the sensor has no such noise, the model is incomplete"
            for one in channels
            if not one.is_explained
        ]
    broken = broken_rule(device)
    return (*remarks, *([broken] if broken else []))
