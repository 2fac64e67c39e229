"""Agreement of the model with a recording, replayed on the recorded inputs: errors channel by channel."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import minimize_scalar

from ppafo.errors import DataError, PpafoError
from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.signals.faults import lasting_noise_of, resolution_of
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.channels import DORSIFLEXION_SUPPLY, SUPPLY, regular_interval
from ppafo.simulation.recorded.replay import with_fixed_volume
from ppafo.simulation.recorded.rest import start_of
from ppafo.units.shown import in_units, shown_text
from ppafo.validation.measured import MeasuredRecording, supply_gauge
from ppafo.validation.replay import Replay, Replayed, replay_together
from ppafo.validation.settings import (
    ACCEPTABLE_FRACTION,
    ANGLE,
    COMPARED,
    EXPLAINED_FRACTION,
    PRESSURE_1,
    PRESSURE_2,
    PRESSURE_DIFFERENCE,
    ReplaySettings,
    full_range,
    usual_zero,
)
from ppafo.wording import argument_text

ENGINE_ERROR = 3.0e-5
"""Integration error of the engine as a fraction of the full range [-] (tests/convergence)."""
LEAST_NOISE = 1.0e-4
"""Lower bound of the estimated sample noise as a fraction of the full range [-]."""
_OF_RANGE = 0.01
"""Largest noise of a sensor as a fraction of the range of its signal [-]."""
_UNMOVED = 1.0e-3
"""Accepted error of a constant signal, as a fraction of the full range [-]: the zero error of its sensor."""
_WITHIN_NOISE = 1.5
"""Largest ratio of RMS error to estimated white noise [-] at which the error may be noise."""
_LONGEST_WEIGHT = 3.0
"""Largest weight of one sample, in usual sample intervals [-], so that a gap in time gets no weight."""
_OTHER_SUPPLY = 0.05
"""Relative difference of recorded and model supply pressure (gauge) [-] from which a remark is made."""
_SHIFTS = 81
"""Number of delays on the initial search grid between both limits."""
_MAXIMUM_SAMPLES = 4000
"""Largest number of samples of a channel used to estimate the delay."""
_MINIMUM_GAIN = 25.0
"""Least reduction of the squared error for a delay, in sample variances: five standard deviations of white noise."""
_SMALLEST_GAIN = 1.0e-12
"""Reduction of the squared error below which two curves are equal to engine accuracy."""
_RESOLUTION = 0.02
"""Smallest detectable delay, as a fraction of the sample interval [-]; smaller delays count as 0."""
_ACCURACY = 1.0e-7
"""Accuracy of the estimated delay as a fraction of the limit [-]."""
_AT_LIMIT = 0.99
"""Fraction of the limit [-] from which a delay counts as being at the limit."""


@dataclass(frozen=True, slots=True, eq=False)
class ChannelAgreement:
    """Errors of the model in one channel, in the SI unit of ``COMPARED``.

    ``values``: samples; ``model``: replay at their times, later by the common delay; ``residuals``: measured - model
    ``full_range``: full range of the channel
    ``noise``: standard deviation of the measurement noise, white or correlated
    ``variation``: standard deviation of the signal without noise, which no model explains
    ``rms``, ``rms_unaligned``: root mean square of the residuals, and without correction of the delay
    ``bias``, ``largest``, ``largest_time``: mean, residual of largest magnitude with its sign, and its time [s]
    ``limit``: largest RMS error that passes, as a fraction of the full range [-]
    """

    channel: str
    values: Floats = field(repr=False)
    model: Floats = field(repr=False)
    residuals: Floats = field(repr=False)
    full_range: float
    noise: float
    variation: float
    rms: float
    rms_unaligned: float
    bias: float
    largest: float
    largest_time: float
    limit: float

    @property
    def fraction(self) -> float:
        """RMS error divided by the full range [-]."""
        return self.rms / self.full_range

    @property
    def in_noise(self) -> float:
        """RMS error divided by the noise of the samples [-]: 1 if the model explains the whole signal."""
        return self.rms / self.noise

    @property
    def passes(self) -> bool:
        """True if the RMS error is within its limit."""
        return self.fraction <= self.limit


@dataclass(frozen=True, slots=True)
class RecordingAgreement:
    """Recording, model replayed on the recorded inputs, and errors of each channel.

    ``request``: recording, device, start and settings of the replay
    ``replayed``: model on the clock of the recording, with its time step
    ``lag``: common delay of the measurement behind the model [s], below 0 if it leads, 0 if undetectable
    ``delay``: delay that was removed [s]; 0 at the limit and for a lead, where the best fit is no sensor's delay
    ``remarks``: sentences for the report
    """

    request: Replay
    replayed: Replayed
    lag: float
    delay: float
    channels: tuple[ChannelAgreement, ...]
    remarks: tuple[str, ...]

    @property
    def file(self) -> str:
        """Name of the recording's file."""
        return self.request.measured.file

    @property
    def measured(self) -> Recording:
        """Recording that was compared."""
        return self.request.measured.recording

    @property
    def model(self) -> Recording:
        """Model on the recorded inputs, at its own times."""
        return self.replayed.recording

    @property
    def is_at_limit(self) -> bool:
        """True if the lag is at the limit of its search."""
        return abs(self.lag) > _AT_LIMIT * self.request.settings.longest_delay

    @property
    def passes(self) -> bool:
        """True if every channel is within its limit."""
        return all(channel.passes for channel in self.channels)


def noise_in(values: Floats, full_range: float) -> float:
    """Return the noise of samples [their unit], including the rounding of a converter with resolution / sqrt(8)."""
    # At rest a coarse converter repeats one value, and third differences see no noise at all. It is then off by up to
    # half a step throughout, whose square is twice this one's, and not by what rounding leaves on average.
    lasting = lasting_noise_of(values, _OF_RANGE * float(np.ptp(values)) if values.size else 0.0)
    return max(math.hypot(lasting, resolution_of(values) / math.sqrt(8.0)), LEAST_NOISE * full_range)


def replay_of(measured: MeasuredRecording, device: Device, settings: ReplaySettings) -> Replay:
    """Return the replay of a recording on a device, or on a fixed volume if the settings have one."""
    if settings.volume is not None:
        device, beside = with_fixed_volume(device, settings.volume)
        settings = replace(settings, motion="locked", initial={**settings.initial, **beside})
    if settings.motion == "measured" and ANGLE not in measured.recording:
        prescribed = argument_text("motion", "measured")
        raise DataError(f"{measured.file}: {prescribed} needs a channel '{ANGLE}', which the recording does not have")
    return Replay(measured, device, start_of(measured.recording, device, settings.initial, measured.file), settings)


def compare_recording(measured: MeasuredRecording, device: Device, settings: ReplaySettings) -> RecordingAgreement:
    """Return the comparison of a recording with the model of a device, replayed on the recorded inputs."""
    request = replay_of(measured, device, settings)
    replayed = replay_together([request])[0]
    if isinstance(replayed, PpafoError):
        raise replayed
    return agreement_of(request, replayed)


@in_units(lambda request, *_: request.device.shown)
def agreement_of(request: Replay, replayed: Replayed, known_delay: float = 0.0) -> RecordingAgreement:
    """Return the comparison of a recording with its replay; a ``known_delay`` [s] takes the place of the estimate.

    Raises DataError if no channel can be compared.
    """
    measured = request.measured
    device = request.device
    settings = request.settings
    model = replayed.recording
    recorded = measured.recording
    longest = settings.longest_delay
    supply = device.supply
    read = {name: recorded[name] for name in recorded.names}
    if PRESSURE_1 in recorded and PRESSURE_2 in recorded:
        read[PRESSURE_DIFFERENCE] = recorded[PRESSURE_1] - recorded[PRESSURE_2]
    # Where the vane is locked, or where there is none, some channels carry no information.
    of_volume = settings.volume is not None
    is_locked = settings.motion == "locked"
    informative = [PRESSURE_1] if of_volume else [name for name in COMPARED if not is_locked or name != ANGLE]
    samples = {name: read[name] for name in informative if name in read and name not in request.inputs}
    if not samples:
        needed = "pressure_1" if of_volume else "a channel other than the prescribed angle"
        raise DataError(f"{measured.file}: no channel can be compared; the recording needs {needed}")
    gauge = supply_gauge(recorded, device)
    gauge_of_set = supply.pressure - supply.atmospheric_pressure
    remarks = list(measured.remarks)
    if SUPPLY in recorded and abs(gauge - gauge_of_set) > _OTHER_SUPPLY * gauge_of_set:
        times = f"{gauge / gauge_of_set:.3g} times the gauge pressure of" if gauge_of_set > 0.0 else "not"
        remarks.append(f"the recorded supply pressure is {times} supply.pressure; the recorded values were used")
    if SUPPLY not in recorded:
        # Shown as values, for they may be the set's or given in its place.
        used = {"supply.pressure": supply.pressure}
        if not (of_volume or DORSIFLEXION_SUPPLY in recorded or supply.has_one_pressure):
            used["supply.dorsiflexion_pressure"] = supply.dorsiflexion_pressure
        atmosphere = supply.atmospheric_pressure
        shown = [f"{path} = {shown_text(value, 'Pa_a', '.4g', atmosphere)}" for path, value in used.items()]
        verb = "was" if len(shown) == 1 else "were"
        remarks.append(f"the supply pressure was not recorded; {' and '.join(shown)} {verb} used")
    if regular_interval(recorded.time) is None:
        remarks.append("samples are not equally spaced in time; changes of the command were moved to the nearest step")
    spans = {name: full_range(name, device, gauge) for name in samples}
    # Sums and multiples of two others do not count twice.
    sensed = [name for name in (ANGLE, PRESSURE_1, PRESSURE_2) if name in samples] or list(samples)[:1]
    lag = 0.0
    delay = known_delay
    if not known_delay and longest > 0.0:
        curves = [(samples[name], model[name], spans[name]) for name in sensed]
        lag = _estimated_lag(recorded.time, model.time, curves, longest)
        delay = max(lag, 0.0) if abs(lag) <= _AT_LIMIT * longest else 0.0
        if abs(lag) > _AT_LIMIT * longest:
            remarks.append(f"model and measurement differ in time by more than {longest:g} s; no delay was removed")
        elif lag < 0.0:
            remarks.append(
                f"the recorded signals lead the model by {1.0e3 * -lag:.3g} ms; sensors lag, so this was not removed"
            )
    channels = tuple(_channel(request, model, delay, name, values, spans[name]) for name, values in samples.items())
    return RecordingAgreement(request, replayed, lag, delay, channels, tuple(remarks))


def _channel(
    request: Replay, replay: Recording, delay: float, name: str, values: Floats, span: float
) -> ChannelAgreement:
    """Return the errors of a ``replay`` in a channel of a full range ``span`` [SI], with the recorded ``values``.

    Unless the user sets a limit, it is 3 % of full range or half of the signal variance, whichever is less, combined
    with the noise and with the usual zero error of sensors (the only visible error of a constant signal).
    """
    times = request.measured.recording.time
    intervals = np.diff(times)
    # Each sample speaks for its time, by the trapezoidal rule, and none for a gap.
    intervals = np.minimum(intervals, _LONGEST_WEIGHT * np.median(intervals))
    weights = 0.5 * (np.append(intervals, 0.0) + np.insert(intervals, 0, 0.0))
    weights = weights / weights.sum()
    model, unaligned = (np.interp(times - late, replay.time, replay[name]) for late in (delay, 0.0))
    residuals = values - model
    noise = noise_in(values, span)
    deviation = values - weights @ values
    variation = math.sqrt(max(float(weights @ deviation**2) - noise * noise, 0.0))
    worst = int(np.argmax(np.abs(residuals)))
    thresholds = request.settings.thresholds
    if (allowed := thresholds.get(name, thresholds.get(""))) is not None:
        limit = allowed.value if allowed.is_fraction else allowed.value / span
    else:
        explained = min(ACCEPTABLE_FRACTION * span, math.sqrt(1.0 - EXPLAINED_FRACTION) * variation)
        # Of a low supply the usual zero is much of the range: there the limit stays a fraction of it.
        zero = min(max(usual_zero(name, request.device), _UNMOVED * span), ACCEPTABLE_FRACTION * span)
        limit = math.hypot(explained, zero, _WITHIN_NOISE * noise) / span
    return ChannelAgreement(
        channel=name,
        values=values,
        model=model,
        residuals=residuals,
        full_range=span,
        noise=noise,
        variation=variation,
        rms=float(np.sqrt(weights @ residuals**2)),
        rms_unaligned=float(np.sqrt(weights @ (values - unaligned) ** 2)),
        bias=float(weights @ residuals),
        largest=float(residuals[worst]),
        largest_time=float(times[worst]),
        limit=limit,
    )


def _estimated_lag(
    times: Floats, model_times: Floats, curves: Sequence[tuple[Floats, Floats, float]], limit: float
) -> float:
    """Return the lag within +-``limit`` [s] with the least mean squared error, 0 if none is seen.

    ``curves`` are samples at ``times``, model at ``model_times`` and full range of each channel.
    """
    # No more measured samples than the search needs.
    thinned = slice(None, None, -(-times.size // _MAXIMUM_SAMPLES))

    def cost(delay: float) -> float:
        """Return the mean squared error over all samples and channels, in units of full range squared [-]."""
        errors = [
            (np.interp(times[thinned] - delay, model_times, model) - values[thinned]) / span
            for values, model, span in curves
        ]
        return sum(float(np.square(error).mean()) for error in errors) / len(errors)

    shifts = np.linspace(-limit, limit, _SHIFTS).tolist()
    best = int(np.argmin([cost(shift) for shift in shifts]))
    bounds = shifts[max(0, best - 1)], shifts[min(_SHIFTS - 1, best + 1)]
    value = float(minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": _ACCURACY * limit}).x)
    # A delay counts where it explains more than noise and the accuracy of the engine could.
    least = cost(value)
    gain = cost(0.0) - least
    samples = len(curves) * times[thinned].size
    is_significant = gain > _SMALLEST_GAIN and gain * samples > _MINIMUM_GAIN * least
    is_seen = abs(value) >= _RESOLUTION * float(np.median(np.diff(times[thinned])))
    return value if is_significant and is_seen else 0.0
