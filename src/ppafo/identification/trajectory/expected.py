"""Choice of the most informative next experiment: expected information of its samples, added to the present fit."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ppafo.errors import IdentificationError, refused_as
from ppafo.identification.noise import Noise, whiten
from ppafo.identification.residuals import FitRuns
from ppafo.identification.trajectory.experiment import FITTED_CHANNELS
from ppafo.identification.trajectory.fitting import TrajectoryFit
from ppafo.identification.trajectory.numbers import reach_of
from ppafo.identification.trajectory.runs import FitChannel, columns_in, numbers_in, prepare_samples, signals_at
from ppafo.progress import report_nothing
from ppafo.signals.recording import Floats
from ppafo.simulation.scenario import Scenario


@dataclass(frozen=True, slots=True)
class CandidateExperiment:
    """Possible further experiment: scenario, noise of each channel [rad], [Pa], and sample interval [s].

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
    return tuple(sorted((_benefit(fit, one) for one in candidates), key=lambda one: -one.gain))


def _benefit(fit: TrajectoryFit, candidate: CandidateExperiment) -> ExpectedBenefit:
    noise = dict(candidate.noise) or dict(fit.fit.noise)
    if not noise or any(name not in FITTED_CHANNELS or not one > 0.0 for name, one in noise.items()):
        raise IdentificationError(
            f"candidate '{candidate.label}': noise must be above 0 for at least one of {', '.join(FITTED_CHANNELS)}"
        )
    # What belongs to one recording, such as its trigger, another experiment says nothing of.
    place = [index for index, item in enumerate(fit.numbers) if not item.recordings]
    acting = [fit.numbers[index] for index in place]
    point, scale = fit.fit.values[place], np.array([item.free.scale for item in acting])
    count = math.floor(candidate.scenario.run.duration / candidate.interval + 1.0e-6)
    times = candidate.interval * np.arange(count + 1, dtype=np.float64)
    channels = [FitChannel(name, np.zeros(times.size)) for name in noise]
    given = numbers_in("", acting, point)
    prepared = prepare_samples(candidate.label, candidate.scenario, times, channels, reach_of(acting), given)

    def samples(points: Floats) -> Floats:
        signals = signals_at(prepared, columns_in("", acting, points), points.shape[1])
        return np.concatenate([signals[name] for name in noise])

    work = FitRuns(samples, tuple(item.free for item in acting), (), report_nothing, 0, is_motion=True)
    weight = 1.0 / np.repeat(list(noise.values()), times.size)
    with refused_as(IdentificationError, f"candidate '{candidate.label}'", IdentificationError):
        # As in the fit, the second differences are as long as changes the samples by three units of noise in all.
        *_, slopes = (work.jacobian(point / scale, weight) for _ in range(2))
    rows = []
    for own, (name, deviation) in zip(np.split(slopes / scale, len(noise)), noise.items(), strict=True):
        known = fit.fit.sensors.get(name)
        rows.append(whiten(own, replace(known, deviation=deviation) if known else Noise(deviation)))
    whole = fit.fit.covariance
    sizes = np.sqrt(np.diag(whole))
    jacobian = np.concatenate(rows) * sizes[place]
    before = whole / np.outer(sizes, sizes)
    # In units of today's standard errors, for pascals and radians differ by many powers of ten.
    information = np.linalg.inv(before)
    information[np.ix_(place, place)] += jacobian.T @ jacobian
    after = np.linalg.inv(information)
    sought = [index for index, item in enumerate(fit.numbers) if not item.is_tolerance]
    shrinkage = {fit.numbers[index].free.name: math.sqrt(max(after[index, index], 0.0)) for index in sought}
    part = np.ix_(sought, sought)
    gain = 0.5 * float(np.linalg.slogdet(before[part])[1] - np.linalg.slogdet(after[part])[1])
    return ExpectedBenefit(candidate.label, gain, shrinkage, min(shrinkage, key=lambda name: shrinkage[name]))
