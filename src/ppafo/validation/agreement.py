"""Agreement of the model with a recording, replayed on the recorded inputs: errors channel by channel."""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.optimize import minimize_scalar

from ppafo.errors import DataError, PpafoError
from ppafo.parameters.device import Device
from ppafo.signals import Recording
from ppafo.signals.faults import correlated_noise_of, noise_of, resolution_of
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
    ErrorLimit,
    ReplaySettings,
)
from ppafo.wording import argument_text

ENGINE_ERROR = 3.0e-5
"""Integration error of the engine as a fraction of the full range [-] (tests/convergence)."""
LEAST_NOISE = 1.0e-4
"""Lower bound of the estimated sample noise as a fraction of the full range [-]."""
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


@dataclass(frozen=True, eq=False)
class ChannelAgreement:
    """Measured and modelled values of one channel, and its residuals (measured - model) in its SI unit.

    ``times`` [s], ``values``: samples, of which the model is shifted by ``delay`` [s]. ``model_times``,
    ``model_values``: replay. ``unit`` is the SI unit of an error, ``full_range`` the full range of the channel,
    ``usual_zero`` the usual zero error of a sensor. ``allowed`` is the error limit set by the user, if any.
    """

    channel: str
    unit: str
    times: Floats = field(repr=False)
    values: Floats = field(repr=False)
    model_times: Floats = field(repr=False)
    model_values: Floats = field(repr=False)
    full_range: float
    usual_zero: float
    allowed: ErrorLimit | None = None
    delay: float = 0.0

    def shift(self, delay: float) -> Floats:
        """Return the model delayed by ``delay`` [s] at the sample times, constant outside the range of the model."""
        return np.interp(self.times - delay, self.model_times, self.model_values)

    @cached_property
    def residuals(self) -> Floats:
        """Residuals after correction of the common delay."""
        return np.asarray(self.values - self.shift(self.delay))

    @cached_property
    def weights(self) -> Floats:
        """Weights of the samples, whose sum is 1: the time for which each speaks, by the trapezoidal rule."""
        intervals = np.diff(self.times)
        # No sample speaks for a gap.
        intervals = np.minimum(intervals, _LONGEST_WEIGHT * np.median(intervals))
        weights = 0.5 * (np.append(intervals, 0.0) + np.insert(intervals, 0, 0.0))
        return np.asarray(weights / weights.sum())

    @cached_property
    def noise(self) -> float:
        """Standard deviation of the measurement noise, white or correlated."""
        return max(noise_in(self.values, self.full_range), correlated_noise_of(self.residuals))

    @cached_property
    def variation(self) -> float:
        """Standard deviation of the signal without noise, which no model explains."""
        deviation = self.values - self.weights @ self.values
        return math.sqrt(max(float(self.weights @ deviation**2) - self.noise * self.noise, 0.0))

    @cached_property
    def rms(self) -> float:
        """Root mean square of the residuals."""
        return float(np.sqrt(self.weights @ self.residuals**2))

    @property
    def rms_unaligned(self) -> float:
        """Root mean square of the residuals without correction of the delay."""
        return float(np.sqrt(self.weights @ (self.values - self.shift(0.0)) ** 2))

    @property
    def bias(self) -> float:
        """Mean of the residuals."""
        return float(self.weights @ self.residuals)

    @property
    def largest(self) -> float:
        """Residual of largest magnitude, with its sign."""
        return float(self.residuals[np.argmax(np.abs(self.residuals))])

    @property
    def largest_time(self) -> float:
        """Time [s] of the largest residual."""
        return float(self.times[np.argmax(np.abs(self.residuals))])

    @cached_property
    def limit(self) -> float:
        """Largest RMS error that passes, as a fraction of the full range [-].

        Unless the user sets a limit, it is 3 % of full range or half of the signal variance, whichever is less,
        combined with the noise and with the usual zero error of sensors (the only visible error of a constant signal).
        """
        if self.allowed is not None:
            return self.allowed.fraction_of(self.full_range)
        explained = min(ACCEPTABLE_FRACTION * self.full_range, math.sqrt(1.0 - EXPLAINED_FRACTION) * self.variation)
        # Of a low supply the usual zero is much of the range: there the limit stays a fraction of it.
        zero = min(max(self.usual_zero, _UNMOVED * self.full_range), ACCEPTABLE_FRACTION * self.full_range)
        return math.hypot(explained, zero, _WITHIN_NOISE * self.noise) / self.full_range

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
class Delay:
    """Delay of the measurement behind the model [s], below 0 if it leads, 0 if undetectable; flag of the limit."""

    value: float
    is_at_limit: bool

    @property
    def correction(self) -> float:
        """Delay to correct [s]; 0 at the search limit and below 0, where the best fit is no delay of a sensor."""
        return 0.0 if self.is_at_limit else max(self.value, 0.0)


def estimate_delay(curves: list[ChannelAgreement], limit: float) -> Delay:
    """Return the delay within +-``limit`` [s] with the least mean squared error over all channels."""
    if limit <= 0.0 or not curves:
        return Delay(0.0, is_at_limit=False)
    # No more measured samples than the search needs.
    steps = [-(-curve.times.size // _MAXIMUM_SAMPLES) for curve in curves]
    thinned = [
        replace(curve, times=curve.times[::step], values=curve.values[::step])
        for curve, step in zip(curves, steps, strict=True)
    ]

    def cost(delay: float) -> float:
        """Return the mean squared error over all samples and channels, in units of full range squared [-]."""
        errors = [(curve.shift(delay) - curve.values) / curve.full_range for curve in thinned]
        return sum(float(np.square(error).mean()) for error in errors) / len(errors)

    shifts = np.linspace(-limit, limit, _SHIFTS).tolist()
    best = int(np.argmin([cost(shift) for shift in shifts]))
    bounds = shifts[max(0, best - 1)], shifts[min(_SHIFTS - 1, best + 1)]
    value = float(minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": _ACCURACY * limit}).x)
    # A delay counts where it explains more than noise and the accuracy of the engine could.
    least = cost(value)
    gain, samples = cost(0.0) - least, sum(curve.times.size for curve in thinned)
    is_significant = gain > _SMALLEST_GAIN and gain * samples > _MINIMUM_GAIN * least
    if abs(value) < _RESOLUTION * float(np.median(np.diff(curves[0].times))) or not is_significant:
        return Delay(0.0, is_at_limit=False)
    return Delay(value, abs(value) > _AT_LIMIT * limit)


@dataclass(frozen=True, slots=True)
class RecordingAgreement:
    """Recording, model replayed on the recorded inputs, and residuals of each channel.

    ``file`` and ``sha256`` identify the file; ``inputs`` are the recorded channels that drive the model, ``step`` is
    the time step of the engine [s], ``delay`` the common delay of the measurement, ``remarks`` are sentences for the
    report.
    """

    file: str
    sha256: str
    measured: Recording
    model: Recording
    motion: str
    inputs: tuple[str, ...]
    step: float
    delay: Delay
    channels: tuple[ChannelAgreement, ...]
    remarks: tuple[str, ...]

    @property
    def passes(self) -> bool:
        """True if every channel is within its limit."""
        return all(channel.passes for channel in self.channels)


def noise_in(values: Floats, full_range: float) -> float:
    """Return the noise of samples [their unit], including the rounding of a converter with resolution / sqrt(8)."""
    # At rest a coarse converter repeats one value, and third differences see no noise at all. It is then off by up to
    # half a step throughout, whose square is twice this one's, and not by what rounding leaves on average.
    return max(math.hypot(noise_of(values), resolution_of(values) / math.sqrt(8.0)), LEAST_NOISE * full_range)


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


def agreement_of(request: Replay, replayed: Replayed, known_delay: float | None = None) -> RecordingAgreement:
    """Return the comparison of a recording with its replay; a ``known_delay`` [s] takes the place of the estimate."""
    measured, longest_delay = request.measured, request.settings.longest_delay
    curves = _curves(request, replayed)
    # Sums and multiples of two others do not count twice.
    sensed = [curve for curve in curves if curve.channel in (ANGLE, PRESSURE_1, PRESSURE_2)]
    delay = Delay(known_delay or 0.0, is_at_limit=False)
    if known_delay is None:
        delay = estimate_delay(sensed or curves[:1], longest_delay)
    remarks = [*measured.remarks, *_remarks(measured, request.device, request.settings)]
    if delay.is_at_limit:
        remarks.append(f"model and measurement differ in time by more than {longest_delay:g} s; no delay was removed")
    elif delay.value < 0.0:
        remarks.append(
            f"the recorded signals lead the model by {1.0e3 * -delay.value:.3g} ms; sensors lag, so this was not "
            "removed"
        )
    return RecordingAgreement(
        file=measured.file,
        sha256=measured.sha256,
        measured=measured.recording,
        model=replayed.recording,
        motion=request.settings.motion,
        inputs=replayed.inputs,
        step=replayed.step,
        delay=delay,
        channels=tuple(replace(curve, delay=delay.correction) for curve in curves),
        remarks=tuple(remarks),
    )


def _curves(request: Replay, replayed: Replayed) -> list[ChannelAgreement]:
    """Return measured and modelled curves of the recorded channels, without inputs. Raises DataError if none remain."""
    recorded, device, settings = request.measured.recording, request.device, request.settings
    gauge = supply_gauge(recorded, device)
    # Where the vane is locked, or where there is none, some channels carry no information.
    informative = {name for name in COMPARED if settings.motion != "locked" or name != ANGLE}
    if settings.volume is not None:
        informative = {PRESSURE_1}
    curves, model = [], replayed.recording
    for name, channel in COMPARED.items():
        is_of_both = name == PRESSURE_DIFFERENCE and PRESSURE_1 in recorded and PRESSURE_2 in recorded
        if name in informative and name not in replayed.inputs and (is_of_both or name in recorded):
            values = recorded[PRESSURE_1] - recorded[PRESSURE_2] if is_of_both else recorded[name]
            curves.append(
                ChannelAgreement(
                    channel=name,
                    unit=channel.unit,
                    times=recorded.time,
                    values=values,
                    model_times=model.time,
                    model_values=model[name],
                    full_range=channel.full_range(device, gauge),
                    usual_zero=channel.usual_zero(device),
                    allowed=settings.thresholds.get(name, settings.thresholds.get("")),
                )
            )
    if not curves:
        needed = "pressure_1" if settings.volume is not None else "a channel other than the prescribed angle"
        raise DataError(f"{request.measured.file}: no channel can be compared; the recording needs {needed}")
    return curves


@in_units(lambda _, device, *__: device.shown)
def _remarks(measured: MeasuredRecording, device: Device, settings: ReplaySettings) -> tuple[str, ...]:
    """Return remarks on assumptions that differ from set or recording: supply pressure, sample times."""
    remarks = []
    gauge_of_set = device.supply.pressure - device.supply.atmospheric_pressure
    recorded_gauge = supply_gauge(measured.recording, device)
    if SUPPLY in measured.recording and abs(recorded_gauge - gauge_of_set) > _OTHER_SUPPLY * gauge_of_set:
        relation = "not"
        if gauge_of_set > 0.0:
            relation = f"{recorded_gauge / gauge_of_set:.3g} times the gauge pressure of"
        remarks.append(f"the recorded supply pressure is {relation} supply.pressure; the recorded values were used")
    if SUPPLY not in measured.recording:
        # Shown as values, for they may be the set's or given in its place.
        used = {"supply.pressure": device.supply.pressure}
        has_second = DORSIFLEXION_SUPPLY in measured.recording or device.supply.has_one_pressure
        if settings.volume is None and not has_second:
            used["supply.dorsiflexion_pressure"] = device.supply.dorsiflexion_pressure
        atmosphere = device.supply.atmospheric_pressure
        shown = [f"{path} = {shown_text(value, 'Pa_a', '.4g', atmosphere)}" for path, value in used.items()]
        verb = "was" if len(shown) == 1 else "were"
        remarks.append(f"the supply pressure was not recorded; {' and '.join(shown)} {verb} used")
    if regular_interval(measured.recording.time) is None:
        remarks.append("samples are not equally spaced in time; changes of the command were moved to the nearest step")
    return tuple(remarks)
