"""What a fit leaves unexplained, channel by channel."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ppafo.identification.trajectory.experiment import Experiment
from ppafo.identification.trajectory.information import autocorrelation
from ppafo.identification.trajectory.preparation import Floats, Measured, Prepared
from ppafo.signals.channels import CHANNELS

_MUCH = 1.5
_TOGETHER = 0.2


@dataclass(frozen=True, slots=True)
class ChannelFit:
    """How one channel of one experiment is explained, in its SI unit.

    ``noise`` is the standard deviation that weighs it, ``is_given`` False where it was estimated from the recording;
    ``rms``, ``bias`` (model less sample) and ``largest`` describe what is left; ``chi_square`` is the mean square over
    the noise and ``autocorrelation`` that of neighbouring residuals, 1 and 0 for a model that explains all but noise.
    ``span`` is the range that the samples cover.
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

    @property
    def is_explained(self) -> bool:
        """True where the model leaves nothing but noise."""
        return self.chi_square <= _MUCH**2 and self.autocorrelation <= _TOGETHER

    @property
    def share(self) -> float:
        """RMS of what is left over the range that the samples cover [-]."""
        return self.rms / self.span if self.span > 0.0 else 0.0


def channel_fits(
    asked: Sequence[Experiment], experiments: Sequence[Prepared], signals: Sequence[dict[str, Floats]]
) -> tuple[ChannelFit, ...]:
    """Return what is left in every channel; ``signals`` are those of the fitted runs, by channel."""
    return tuple(
        _channel_fit(experiment, channel, values[channel.name] - channel.values)
        for experiment, prepared, values in zip(asked, experiments, signals, strict=True)
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
    )


def unexplained(channel: ChannelFit) -> str:
    """Return the sentence on a channel that holds more than noise."""
    return (
        f"{channel.experiment}: {channel.channel} is not explained down to its noise (residuals "
        f"{np.sqrt(channel.chi_square):.2g} times the noise, neighbours correlate {channel.autocorrelation:+.2f}): the "
        f"model lacks something that acts on it"
    )
