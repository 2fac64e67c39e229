"""Fits any numbers of a device to any recordings and says of each how well they fix it."""

from collections.abc import Sequence

import numpy as np

from ppafo.identification.trajectory.columns import numbers_in, trajectories
from ppafo.identification.trajectory.information import (
    autocorrelation,
    correlation,
    covariance,
    inflation,
    loss_weights,
)
from ppafo.identification.trajectory.paths import broken_order
from ppafo.identification.trajectory.preparation import Floats, Measured, Prepared, prepare
from ppafo.identification.trajectory.problem import Experiment, Range, TrajectoryProblem, ranges_of
from ppafo.identification.trajectory.residuals import Residuals, coordinate_bounds, prior_coordinates
from ppafo.identification.trajectory.result import ChannelFit, TrajectoryFit
from ppafo.identification.trajectory.search import Optimum, optimum
from ppafo.identification.trajectory.verdicts import Evidence, estimate_of
from ppafo.parameters.device import Device
from ppafo.signals.channels import CHANNELS
from ppafo.signals.recording import Channel, Recording, RecordingKind
from ppafo.simulation.numbers import with_numbers

_MUCH = 1.5
_TOGETHER = 0.2


def fit(problem: TrajectoryProblem) -> TrajectoryFit:
    """Return the numbers of a problem that explain its recordings best, each with interval and verdict.

    Residuals are weighted with the noise of their channel. IdentificationError where the problem cannot be run.
    """
    found = optimum(residuals_of(problem), problem.search)
    residuals = found.residuals
    signals = [
        {name: values[:, 0] for name, values in of_one.items()}
        for of_one in trajectories(residuals.experiments, residuals.ranges, found.point[None, :])
    ]
    channels = _channel_fits(problem, residuals.experiments, signals)
    return _result(problem, found, channels, signals)


def residuals_of(problem: TrajectoryProblem) -> Residuals:
    """Return the residuals of a problem, with the step divided as its start values need it."""
    ranges = ranges_of(problem)
    start = np.array([item.coordinate(item.start) for item in ranges])
    return Residuals(tuple(prepare(item, _numbers(item, ranges, start)) for item in problem.experiments), ranges)


def _numbers(experiment: Experiment, ranges: Sequence[Range], point: Floats) -> dict[str, float]:
    return {
        item.path: item.number(float(z))
        for item, z in zip(ranges, point, strict=True)
        if not item.recordings or experiment.label in item.recordings
    }


def _result(
    problem: TrajectoryProblem, found: Optimum, channels: tuple[ChannelFit, ...], signals: Sequence[dict[str, Floats]]
) -> TrajectoryFit:
    residuals, ranges = found.residuals, found.residuals.ranges
    left = residuals.of_data(found.point[None, :])[:, 0]
    weights = loss_weights(left, problem.search.loss)
    information = found.information
    chi_square = float(np.sum(weights * left * left) / max(1, left.size - len(ranges)))
    neighbours = float(np.mean([channel.autocorrelation for channel in channels]))
    factor = inflation(chi_square, neighbours, left.size)
    matrix = factor * covariance(information)
    slopes = np.array([item.slope(float(z)) for item, z in zip(ranges, found.point, strict=True)])
    scenarios = tuple(
        with_numbers(item.scenario, numbers_in(item, ranges, found.point)) for item in residuals.experiments
    )
    evidence = Evidence(
        ranges=ranges,
        point=found.point,
        information=information,
        covariance=matrix,
        correlation=correlation(matrix),
        low=coordinate_bounds(ranges)[0],
        high=coordinate_bounds(ranges)[1],
        prior_deviation=prior_coordinates(ranges)[1],
        inflation=factor,
        residual_check=_residual_check(chi_square, neighbours, factor),
        sources=tuple(_sources(problem, item) for item in ranges),
        search=problem.search,
    )
    return TrajectoryFit(
        problem=problem,
        estimates=tuple(estimate_of(evidence, index) for index in range(len(ranges))),
        covariance=matrix * np.outer(slopes, slopes),
        correlation=evidence.correlation,
        information=information,
        inflation=factor,
        cost=found.cost,
        evaluations=found.evaluations,
        channels=channels,
        models=tuple(_model(item, values) for item, values in zip(residuals.experiments, signals, strict=True)),
        measurements=tuple(
            _measurement(one, item) for one, item in zip(problem.experiments, residuals.experiments, strict=True)
        ),
        scenarios=scenarios,
        remarks=_remarks(problem, found, channels, scenarios[0].device),
        optimum=found,
    )


def _residual_check(chi_square: float, neighbours: float, factor: float) -> str:
    text = f"residuals are {np.sqrt(chi_square):.2f} times the noise, neighbours correlate {neighbours:+.2f}"
    return (
        text
        if factor < _MUCH
        else f"{text}, so the interval is {np.sqrt(factor):.2g} times as wide as noise alone asks"
    )


def _sources(problem: TrajectoryProblem, item: Range) -> tuple[str, ...]:
    acting = [one for one in problem.experiments if not item.recordings or one.label in item.recordings]
    return tuple(one.source or one.recording.label for one in acting)


def _channel_fits(
    problem: TrajectoryProblem, experiments: Sequence[Prepared], signals: Sequence[dict[str, Floats]]
) -> tuple[ChannelFit, ...]:
    return tuple(
        _channel_fit(experiment, channel, values[channel.name] - channel.values)
        for experiment, prepared, values in zip(problem.experiments, experiments, signals, strict=True)
        for channel in prepared.channels
    )


def _channel_fit(experiment: Experiment, channel: Measured, left: Floats) -> ChannelFit:
    return ChannelFit(
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
    )


def _model(prepared: Prepared, values: dict[str, Floats]) -> Recording:
    return _recording(f"model of {prepared.label}", prepared, values, "simulated")


def _measurement(experiment: Experiment, prepared: Prepared) -> Recording:
    values = {channel.name: channel.values for channel in prepared.channels}
    return _recording(experiment.label, prepared, values, experiment.recording.kind)


def _recording(label: str, prepared: Prepared, values: dict[str, Floats], kind: RecordingKind) -> Recording:
    channels = {name: Channel(series, CHANNELS[name].unit) for name, series in values.items()}
    return Recording(label, prepared.time, channels, kind)


def _remarks(
    problem: TrajectoryProblem, found: Optimum, channels: Sequence[ChannelFit], device: Device
) -> tuple[str, ...]:
    stopped = (
        f"the search stopped after {problem.search.most_evaluations} evaluations before it settled: start nearer, or "
        f"allow more"
    )
    broken = broken_order(device)
    return (
        *([] if found.has_converged else [stopped]),
        *(_unexplained(channel) for channel in channels if _is_unexplained(channel)),
        *([broken] if broken else []),
    )


def _is_unexplained(channel: ChannelFit) -> bool:
    return channel.chi_square > _MUCH**2 or channel.autocorrelation > _TOGETHER


def _unexplained(channel: ChannelFit) -> str:
    return (
        f"{channel.experiment}: {channel.channel} is not explained down to its noise (residuals "
        f"{np.sqrt(channel.chi_square):.2g} times the noise, neighbours correlate {channel.autocorrelation:+.2f}): the "
        f"model lacks something that acts on it"
    )
