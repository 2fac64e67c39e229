"""Fits any numbers of a device to any recordings and says of each how well they fix it."""

from collections.abc import Sequence

import numpy as np

from ppafo.identification.trajectory.experiment import Experiment, broken_rule, with_numbers
from ppafo.identification.trajectory.information import correlation
from ppafo.identification.trajectory.preparation import Floats, PreparedExperiment, prepare, with_half_steps
from ppafo.identification.trajectory.problem import Range, TrajectoryProblem, ranges_of, reach_of
from ppafo.identification.trajectory.residuals import (
    Residuals,
    coordinate_bounds,
    numbers_in,
    prior_coordinates,
    trajectories,
)
from ppafo.identification.trajectory.result import (
    ChannelFit,
    TrajectoryFit,
    channel_fits,
    noise_remark,
    predictions,
    reason_of_misfit,
)
from ppafo.identification.trajectory.search import Optimum, optimum
from ppafo.identification.trajectory.uncertainty import Evidence, Uncertainty, estimate_of, uncertainty_of
from ppafo.identification.trajectory.weighing import weigh
from ppafo.parameters.device import Device
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.channels import CHANNELS
from ppafo.signals.recording import Channel, Recording, RecordingKind

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
            remarks.append(_remark(prepared, finer, worst, moved[worst]))
    return tuple(remarks)


def _remark(prepared: PreparedExperiment, finer: PreparedExperiment, channel: str, moved: float) -> str:
    return (
        f"{prepared.label}: steps of {1e3 * prepared.run.step:.3g} ms are too long for so little noise: half of that "
        f"changes {channel} by {moved:.2g} times its noise; give step = '{1e3 * finer.run.step:.3g} ms' or less"
    )


def fit(problem: TrajectoryProblem, report: Report = report_nothing) -> TrajectoryFit:
    """Return the numbers of a problem that explain its recordings best, each with interval and verdict.

    Estimates are in SI units; matrices (parameters, parameters) follow their order. Residuals are weighted with the
    noise of their channel. ``report`` hears what is being done. IdentificationError where it cannot be run.
    """
    found = optimum(residuals_of(problem), problem.search, report)
    report(Progress("trajectory fit: noise of the sensors"))
    given = [frozenset(item.noise) for item in problem.experiments]
    whole = weigh(found, given)
    uncertainty = uncertainty_of(whole, problem.search, *coordinate_bounds(found.residuals.ranges))
    residuals = whole.optimum.residuals
    signals = [
        {name: values[:, 0] for name, values in of_one.items()}
        for of_one in trajectories(residuals.experiments, residuals.ranges, uncertainty.centre[None, :])
    ]
    channels = channel_fits(problem.experiments, residuals.experiments, signals)
    return _result(problem, found.cost, whole.optimum, uncertainty, channels, signals)


def residuals_of(problem: TrajectoryProblem) -> Residuals:
    """Return the residuals of a problem."""
    ranges = ranges_of(problem)
    start = np.array([item.coordinate(item.start) for item in ranges])
    return Residuals(tuple(_prepare(item, ranges, start) for item in problem.experiments), ranges)


def noise_in(problem: TrajectoryProblem) -> dict[str, float]:
    """Return the noise [rad], [Pa] of each channel, of the first recording that has it; estimated if not given."""
    found: dict[str, float] = {}
    for experiment in residuals_of(problem).experiments:
        found = {channel.name: channel.noise for channel in experiment.channels} | found
    return found


def _prepare(experiment: Experiment, ranges: Sequence[Range], point: Floats) -> PreparedExperiment:
    reach = reach_of([item for item in ranges if item.acts_in(experiment.label)])
    return prepare(experiment, numbers_in(experiment.label, ranges, point), reach)


def _result(
    problem: TrajectoryProblem,
    cost: float,
    found: Optimum,
    uncertainty: Uncertainty,
    channels: tuple[ChannelFit, ...],
    signals: list[dict[str, Floats]],
) -> TrajectoryFit:
    prepared, ranges, centre = found.residuals.experiments, found.residuals.ranges, uncertainty.centre
    evidence = _evidence(problem, found, uncertainty, channels)
    slopes = np.array([item.slope(float(z)) for item, z in zip(ranges, centre, strict=True)])
    scenarios = tuple(with_numbers(item.scenario, numbers_in(item.label, ranges, centre)) for item in prepared)
    return TrajectoryFit(
        problem=problem,
        estimates=tuple(estimate_of(evidence, index) for index in range(len(ranges))),
        covariance=uncertainty.covariance * np.outer(slopes, slopes),
        correlation=evidence.correlation,
        uncertainty=uncertainty,
        cost=cost,
        evaluations=found.evaluations,
        channels=channels,
        models=tuple(_model(item, values) for item, values in zip(prepared, signals, strict=True)),
        measurements=tuple(_measurement(*pair) for pair in zip(problem.experiments, prepared, strict=True)),
        scenarios=scenarios,
        remarks=_remarks(problem, found, evidence, uncertainty, channels, scenarios[0].device)
        + step_remarks(found.residuals, centre, signals),
        optimum=found,
    )


def _evidence(
    problem: TrajectoryProblem, found: Optimum, uncertainty: Uncertainty, channels: Sequence[ChannelFit]
) -> Evidence:
    ranges, misfit = found.residuals.ranges, uncertainty.misfit
    low, high = coordinate_bounds(ranges)
    return Evidence(
        ranges=ranges,
        point=uncertainty.centre,
        interval=(uncertainty.low, uncertainty.high),
        information=uncertainty.curvature,
        covariance=uncertainty.covariance,
        correlation=correlation(uncertainty.covariance),
        low=low,
        high=high,
        prior_deviation=prior_coordinates(ranges)[1],
        inflation=uncertainty.inflation,
        residual_check=uncertainty.residual_check,
        misfit=reason_of_misfit(misfit, channels),
        alone=misfit.alone,
        sources=tuple(_sources(problem, item) for item in ranges),
        search=problem.search,
    )


def _sources(problem: TrajectoryProblem, item: Range) -> tuple[str, ...]:
    acting = [one for one in problem.experiments if item.acts_in(one.label)]
    return tuple(one.source or one.recording.label for one in acting)


def _model(prepared: PreparedExperiment, values: dict[str, Floats]) -> Recording:
    return _recording(f"model of {prepared.label}", prepared, values, "simulated")


def _measurement(experiment: Experiment, prepared: PreparedExperiment) -> Recording:
    values = {channel.name: channel.values for channel in prepared.channels}
    return _recording(experiment.label, prepared, values, experiment.recording.kind)


def _recording(label: str, prepared: PreparedExperiment, values: dict[str, Floats], kind: RecordingKind) -> Recording:
    channels = {name: Channel(series, CHANNELS[name].unit) for name, series in values.items()}
    return Recording(label, prepared.time, channels, kind)


def _remarks(
    problem: TrajectoryProblem,
    found: Optimum,
    evidence: Evidence,
    uncertainty: Uncertainty,
    channels: Sequence[ChannelFit],
    device: Device,
) -> tuple[str, ...]:
    stopped = (
        f"the search stopped after {problem.search.maximum_evaluations} evaluations before it converged: "
        f"start closer to the solution, or allow more evaluations"
    )
    broken = broken_rule(device)
    misfit = (
        f"the model does not explain the recordings: {evidence.misfit}; what it determines holds for this model only"
    )
    return (
        *([] if found.has_converged else [stopped]),
        *([misfit, *predictions(channels)] if evidence.misfit else _noise_remarks(channels, uncertainty)),
        *([broken] if broken else []),
    )


def _noise_remarks(channels: Sequence[ChannelFit], uncertainty: Uncertainty) -> list[str]:
    noises = {sensor.channel: sensor.in_words for sensor in uncertainty.sensors}
    return [noise_remark(one, noises[one.channel]) for one in channels if not one.is_explained]
