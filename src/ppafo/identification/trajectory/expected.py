"""Choice of the next experiment: expected information of its samples, added to the present fit (D-optimality)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.errors import IdentificationError, refused_as
from ppafo.identification.noise import Noise, whiten
from ppafo.identification.residuals import FitRuns
from ppafo.identification.trajectory.experiment import FITTED_CHANNELS
from ppafo.identification.trajectory.fitting import TrajectoryFit
from ppafo.identification.trajectory.numbers import FitNumber, reach_of
from ppafo.identification.trajectory.runs import FitChannel, columns_in, numbers_in, prepare_samples, signals_at
from ppafo.progress import report_nothing
from ppafo.signals.recording import Floats
from ppafo.simulation.scenario import Scenario

_WHOLE = 1.0e-6
"""Rounding tolerance of the last sample interval, as a fraction of an interval [-]."""


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
