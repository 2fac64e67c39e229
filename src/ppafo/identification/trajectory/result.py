"""What a trajectory fit gives back, and what it leaves unexplained, channel by channel."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.estimate import Estimate
from ppafo.identification.trajectory.experiment import Experiment, full_path
from ppafo.identification.trajectory.information import autocorrelation
from ppafo.identification.trajectory.misfit import Misfit
from ppafo.identification.trajectory.preparation import Floats, Measured, PreparedExperiment
from ppafo.identification.trajectory.problem import TrajectoryProblem
from ppafo.identification.trajectory.residuals import coordinate_bounds
from ppafo.identification.trajectory.search import Optimum
from ppafo.identification.trajectory.uncertainty import Uncertainty
from ppafo.signals import Recording
from ppafo.signals.channels import CHANNELS
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
    return tuple(
        _channel_fit(experiment, channel, values[channel.name] - channel.values)
        for experiment, prepared, values in zip(requested, experiments, signals, strict=True)
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
        span=float(np.ptp(channel.values)),
        prediction=_prediction_width(left),
    )


def _prediction_width(left: Floats) -> float:
    """Return the distance that 95 % of new samples keep: as those at hand, less one, for they were fitted."""
    count = len(left)
    return float(np.sort(np.abs(left))[min(count - 1, math.ceil(PREDICTED * (count + 1)))])


def noise_remark(channel: ChannelFit, noise: str) -> str:
    """Return the sentence on a channel that holds more than white noise; ``noise`` says what it was taken for."""
    return (
        f"{channel.experiment}: what is left of {channel.channel} is "
        f"{np.sqrt(channel.chi_square):.2g} times its noise from sample to sample (neighbours are "
        f"correlated by {channel.autocorrelation:+.2f}) and was attributed to the "
        f"sensor: {noise}; if the sensor has no such noise, the model is incomplete"
    )


def reason_of_misfit(misfit: Misfit, channels: Sequence[ChannelFit]) -> str:
    """Return why the model does not explain the recordings, empty where it does.

    Parts want different numbers, or a channel leaves more than its sensor can be blamed for.
    """
    if misfit.is_found:
        return misfit.in_words
    for channel in channels:
        size = float(np.sqrt(channel.chi_square))
        if size > (_MUCH if channel.is_given else _OF_NO_SENSOR):
            noise = "the noise that was given for it" if channel.is_given else "its noise from sample to sample"
            return f"{channel.channel} of {channel.experiment} leaves {size:.2g} times {noise}"
    return ""


def predictions(channels: Sequence[ChannelFit]) -> tuple[str, ...]:
    """Return a sentence for each recording: how near a new one like it is expected to the fitted run."""
    found = []
    for label in dict.fromkeys(channel.experiment for channel in channels):
        widths = [
            f"{channel.channel} +- {_with_unit(channel.prediction, channel.unit)}"
            for channel in channels
            if channel.experiment == label
        ]
        found.append(
            f"95 % of the samples of a new recording like '{label}', by sensors whose zeros have not moved since, lie "
            f"within {', '.join(widths)} of its run"
        )
    return tuple(found)


def _with_unit(number: float, unit: str) -> str:
    return f"{math.degrees(number):.3g} deg" if unit == "rad" else f"{number:.3g} {unit}"


@dataclass(frozen=True, slots=True)
class TrajectoryFit:
    """Estimates with verdicts, their covariance in SI units and correlation, and what is left unexplained.

    Matrices are in the order of ``estimates``; those of the coordinates are in ``uncertainty``. ``models`` are the
    fitted runs at the times of the samples, ``measurements`` the samples, both by experiment over the time of the run.
    ``remarks`` are sentences about the fit as a whole.
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

    @property
    def misfit(self) -> str:
        """Why the model does not explain the recordings, so that what they fix holds for it only; empty if it does."""
        return reason_of_misfit(self.uncertainty.misfit, self.channels)

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
