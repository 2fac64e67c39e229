"""Search for a single cause that explains recordings whose residuals exceed noise.

A cause is a row of the table below: a sensor, y = h(model; a) + e, or another value of a parameter. Its rows are tried
in stages, from errors that the samples themselves show to effects that the model lacks; the first stage with a cause
that explains all recordings ends the search. All changes are compared on the same recorded samples; a common delay, and
the error of initial values read from noisy samples, are fitted anew for every change.

G = sum over channels of n [ln max(MS0/s^2, 1) - ln max(MSc/s^2, 1)] - k ln N, with MS0 and MSc the mean squared
residuals without and with a change, s the noise of the n samples of a channel, N the number of all samples, and k = 1
for a change with a fitted magnitude, else 0.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial, reduce
from itertools import chain, islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.stats import chi2

from ppafo.errors import ParameterError, PpafoError
from ppafo.linear_algebra import on_one_thread
from ppafo.model.declaration import Quantity
from ppafo.parameters.building import contradictions
from ppafo.parameters.device import Device
from ppafo.parameters.graph import ATMOSPHERE_PATH, PRESSURE_PATH, SECOND_PRESSURE_PATH
from ppafo.progress import Progress, Report, report_nothing
from ppafo.report.kind import Kind
from ppafo.signals.faults import isolated_samples
from ppafo.signals.recording import Floats, Recording
from ppafo.simulation.numbers import declared_numbers, number_at, other_form, with_numbers
from ppafo.simulation.recorded.channels import COMMAND, DORSIFLEXION_SUPPLY, EXTERNAL_TORQUE, SUPPLY
from ppafo.simulation.recorded.rest import samples_at_rest
from ppafo.simulation.recorded.usual_errors import SUPPLY_ERROR, deviation_of_limit, misread_units, usual_errors
from ppafo.units.shown import quantity_of_unit, shown_in, shown_unit, shown_value
from ppafo.validation.agreement import (
    ENGINE_ERROR,
    ChannelAgreement,
    RecordingAgreement,
    agreement_of,
    compare_recording,
    noise_in,
    replay_of,
)
from ppafo.validation.replay import Replay, Replayed, replay_together, replayed_scenario
from ppafo.validation.settings import ANGLE, EXPLAINED_FRACTION, PRESSURE_1, PRESSURE_2, Motion, usual_zero
from ppafo.wording import argument_text

ONLY_NOISE = 2.0
"""Largest ratio of mean squared residual to noise variance [-] that counts as noise; above 1 for correlated noise."""
STEPS = 2
"""Number of Gauss-Newton steps from the best trial magnitude."""
_BY_CHANCE = 1.0e-3
"""Probability [-] below which a run of equal extreme samples counts as clipping."""
_FEW_OUTLIERS = 0.01
"""Largest usual fraction of isolated outliers in a channel [-]."""

_OF_MOTION = {COMMAND, ANGLE, "friction", "foot_plate", "stribeck", "seal_friction"}
"""Inputs, and sections and effects that act on the motion of the vane alone."""
SENSORS = (ANGLE, PRESSURE_1, PRESSURE_2)
"""Channels with a sensor on the device; torque and pressure difference are computed from them."""
SWAPPED = {PRESSURE_1: PRESSURE_2, PRESSURE_2: PRESSURE_1}
"""Channel recorded under each name when the two chamber pressures are swapped."""
_STARTS = (-0.05, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.05)
"""Trial initial values of a channel whose first samples are wrong, as fractions of its range [-].

The two outermost values lie outside the range, and a best fit there is rejected.
"""
_AT_REST = 2.0
"""Ratio of the angle's standard deviation to its noise [-] below which the vane may be locked."""
_ZEROS = (-0.6, -0.3, -0.1, -0.03, -0.01, -0.003, 0.003, 0.01, 0.03, 0.1, 0.3, 0.6)
"""Trial zero offsets of angle [rad], command [full openings] and pressures [gauge supply pressures].

Grids are so fine that two Gauss-Newton steps reach the least squares, and no likely fault lies at one of their ends.
"""
_GAINS = (0.3, 0.6, 0.8, 0.95, 0.98, 1.02, 1.05, 1.25, 1.6, 3.0)
"""Trial gains of a sensor [-]."""
_DELAYS = (-0.025, -0.012, -0.006, -0.003, -0.001, 0.001, 0.003, 0.006, 0.012, 0.025)
"""Trial delays of a sensor relative to the other sensors [s]."""
_LONG_DELAYS = (0.015, 0.03, 0.05, 0.08, 0.12)
"""Trial delays [s] of all sensors with respect to the command, beyond the common delay that is removed."""
_SHIFTS = (0.0005, 0.001, 0.003, 0.008, 0.015, 0.03, 0.05, 0.08, 0.12)
"""Trial times [s] by which all sensors lead the command, of which none is removed, and delays of a valve with none."""
_RATES = (0.7, 0.85, 0.94, 0.98, 0.995, 1.005, 1.02, 1.06, 1.15, 1.4)
"""Trial rates [-] of the clock of a recording."""
_FACTORS: tuple[float, ...] = (0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 1.05, 1.25, 2.0, 5.0, 20.0)
"""Trial values of a parameter divided by its value in the set [-]."""
_OF_GASES = {
    "gas.molar_mass": (0.0039, 0.046),
    "gas.heat_capacity_ratio": (1.05, 1.68),
    "gas.temperature": (250.0, 340.0),
}
"""Ends of what gases in use and rooms have [SI], with five trial values between them; other values are no cause."""
_ATMOSPHERES = (0.6, 0.7, 0.8, 0.9, 0.95, 1.03, 1.1)
"""Trial atmospheric pressures divided by the pressure in the set [-]: from a high mountain to a deep mine."""
_SECTIONS = ("valve", "actuator", "friction", "foot_plate", "supply", "gas", "effects")
"""Sections of the parameter set whose parameters are tried, in this order; effects that the set names alone."""
_NOT_TRIED = "actuator.restitution"
"""Parameter observable only when the vane reaches a stop; a replay starts between the stops."""
_POWERS = (0.4, 0.7, 1.4, 2.0, 3.0)
"""Trial powers of the command to which an opening is proportional [-]."""
_OFF = {
    "s": _SHIFTS,
    "": (0.002, 0.006, 0.02, 0.06, 0.2, 0.6),
    "Hz": (3.0, 8.0, 20.0, 50.0, 130.0, 350.0),
    "1/s": (0.5, 2.0, 8.0, 30.0, 120.0, 500.0),
    "m^2": (1e-8, 1e-7, 1e-6, 1e-5),
    "kg m^2": (1e-4, 1e-3, 1e-2, 1e-1),
    "N m": (-3.0, -0.8, -0.3, -0.1, -0.02, 0.02, 0.1, 0.3, 0.8, 3.0),
    "N m s/rad": (1e-3, 1e-2, 1e-1, 0.9),
    "N m/rad": (0.03, 0.15, 0.8, 4.0, 20.0),
    "N m s^2/rad^2": (1e-4, 1e-3, 1e-2, 1e-1),
    "kg/(s Pa^2)": (1e-18, 1e-17, 1e-16, 1e-15, 1e-14),
    "rad/s": (0.02, 0.08, 0.35, 1.5, 6.0),
    "N m/Pa": (1e-8, 5e-8, 2e-7, 1e-6, 5e-6),
}
"""Trial values of a number that is 0 in the set, by its unit."""
_LACKING = {
    "stribeck": ("rad/s", "friction seems to be higher up to {:.2g} rad/s (Stribeck)"),
    "seal_friction": ("N m/Pa", "friction seems to grow with pressure by {:.2g} N m/Pa"),
    "joint_load.stiffness": ("N m/rad", "a spring of {:.2g} N m/rad seems to act at the joint"),
    "joint_load.drag": ("N m s^2/rad^2", "a drag of {:.2g} N m s^2/rad^2 seems to act at the joint"),
    "laminar_leak.coefficient": ("kg/(s Pa^2)", "a laminar leak of {:.2g} kg/(s Pa^2) seems to pass the seal"),
    "line_resistance.area": ("m^2", "lines seem to throttle as an orifice of {:.2g} mm^2 does"),
}
"""Effects that a device may lack, by name and setting, or by name alone for several: unit and words."""
_OF_SUPPLY = {PRESSURE_PATH: SUPPLY, SECOND_PRESSURE_PATH: DORSIFLEXION_SUPPLY}
_TIMES = {"milliseconds read as seconds": 1.0e3, "seconds read as milliseconds": 1.0e-3}
"""Clock rate [-] that corrects misread times, by kind of mistake."""
_LESS = 0.5
"""Largest remaining fraction of an error above its limit [-] for times in another unit to explain the error."""
_SHORT_INTERVAL = 2.0e-5
"""Longest sample interval [s] that may be milliseconds read as seconds: 50 samples per second or more in truth."""
_LONGEST_SEARCHED = 10.0
"""Duration [s] of all recordings up to which a device with a measured angle is searched for causes beside samples."""
_TRIED_WITH_MEASURED_ANGLE = "faulty samples, errors and units of the pressures, numbers of the set, effects"
_TRIED_IN_LONG_RECORDINGS = "faulty samples alone (the angle is measured, over more than 10 s)"
_NAMED = 3
"""Number of causes that are named where none explains the recordings, the nearest ones."""
_TOGETHER = 32
"""Number of changes replayed in a batch, which limits memory and sets the rate of progress reports."""
_DIFFERENCE = 0.02
"""Step of a finite difference as a fraction of the distance between two trial magnitudes [-]."""
_FINE_DIFFERENCE = 0.002
"""The same after a step that made the error worse [-]: a valve may have switched once more, which is no slope."""
# Number of candidates that are nearest after the steps of all, and their further Gauss-Newton steps. Of these a
# candidate takes up to four more while each gains more than separates two causes: else a true cause that is not yet
# at its best would lose to one that explains almost as much.
_BEST = 6
_OF_BEST = 2
_OF_RISING = 4
_SHORTER = 0.35
"""Length of a step divided by that of one that went too far [-]."""
_SMALL = 0.1
"""Trial magnitude of a second change, relative to the smallest magnitude on its grid [-]."""
_PARTING = 1.0e-4
"""Least squared fraction of a slope [-] orthogonal to the first change, for a second change to be distinct."""
_UNUSUAL = 0.01
"""Probability [-] below which several usual sensor errors together are unusual."""
_SMALLEST = 1.0e-300
"""Lower bound of a sum of squares used as a divisor."""


@dataclass(frozen=True, slots=True)
class SensorModel:
    """Sensor model: gain [-] about the value ``about``, zero offset (both in the channel's unit), delay [s]."""

    gain: float = 1.0
    zero: float = 0.0
    about: float = 0.0
    delay: float = 0.0

    def of(self, true: Floats) -> Floats:
        """Return the readings of true values [unit of the channel]."""
        return self.about + self.gain * (true - self.about) + self.zero

    def true(self, readings: Floats) -> Floats:
        """Return the true values of readings [unit of the channel]."""
        return self.about + (readings - self.zero - self.about) / self.gain


@dataclass(frozen=True, slots=True)
class ModelChange:
    """Difference between the recorded device and its parameter set; by default no difference.

    ``sensors``: sensor models by channel. ``numbers``: changed parameters by path [SI]. ``effects``: settings of
    effects by the name of the effect. ``is_swapped``: pressures 1 and 2 are exchanged. ``delay``: delay [s] of all
    sensors with respect to the command. ``clock``: true rate of the recording's clock [-]. ``motion``: motion of the
    vane, if another. ``start``: if not None, faulty samples are ignored, and a channel whose first samples are faulty
    starts at this fraction [-] of its range.
    """

    sensors: Mapping[str, SensorModel] = field(default_factory=dict)
    numbers: Mapping[str, float] = field(default_factory=dict)
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    is_swapped: bool = False
    delay: float = 0.0
    clock: float = 1.0
    motion: Motion | None = None
    start: float | None = None

    @property
    def has_delay(self) -> bool:
        """True if all sensors lag behind the command, by a sensor delay or the delay of the valve."""
        return self.delay != 0.0 or any(path.endswith("delay") for path in self.numbers)

    @property
    def is_of_motion(self) -> bool:
        """True if it changes an input, a time or the motion of the vane, hidden by a prescribed angle."""
        is_late = self.has_delay or self.clock != 1.0 or any(sensor.delay for sensor in self.sensors.values())
        sections = (path.partition(".")[0] for path in (*self.numbers, *self.effects))
        return is_late or not _OF_MOTION.isdisjoint((*self.sensors, *sections))


def joined(first: ModelChange, second: ModelChange) -> ModelChange:
    """Return the combination of two changes; ``first`` has precedence for parameters and settings in both."""
    sensors = dict(first.sensors)
    for name, other in second.sensors.items():
        sensor = sensors.get(name, SensorModel())
        sensors[name] = SensorModel(
            gain=sensor.gain * other.gain,
            zero=sensor.zero + other.zero,
            # A zero and a delay turn about nothing, so that the gain's point stays.
            about=other.about if other.gain != 1.0 else sensor.about,
            delay=sensor.delay + other.delay,
        )
    numbers = {**second.numbers, **first.numbers}
    effects = {**second.effects, **first.effects}
    delay = first.delay + second.delay
    clock = first.clock * second.clock
    return replace(first, sensors=sensors, numbers=numbers, effects=effects, delay=delay, clock=clock)


class Record(NamedTuple):
    """Recording prepared for the search: its compared channels and their values divided by noise (channels, samples).

    ``noise`` [SI] and ``engine``, the integration error divided by the noise [-], are by channel. ``good`` is 1 for
    valid samples and 0 for faulty ones, which ``words`` describes; ``has_few`` is true if the faulty samples are
    isolated and no more than usual. ``starts`` are the changes of the readings for one standard error of each initial
    value.
    """

    agreement: RecordingAgreement
    channels: tuple[str, ...]
    values: Floats
    noise: Floats
    engine: Floats
    good: Floats
    words: tuple[str, ...]
    has_few: bool
    starts: tuple[Floats, ...] = ()


class ScaledResiduals(NamedTuple):
    """Residuals under a change, divided by noise [-]: mean square by channel and recording, and all errors."""

    squares: Floats
    errors: Floats

    @property
    def is_noise(self) -> bool:
        """True if the residuals of every channel are noise."""
        return float(self.squares.max()) < ONLY_NOISE


UNTRIED = ScaledResiduals(np.zeros(0), np.zeros(0))
"""Residuals of a change that was not tried yet."""


def record_of(agreement: RecordingAgreement) -> Record:
    """Prepare a recording: faulty samples marked, sensitivity of the readings to each initial value."""
    compared = [channel for channel in agreement.channels if channel.channel in SENSORS] or agreement.channels[:1]
    noise = np.array([channel.noise for channel in compared])
    good = np.ones((len(compared), len(agreement.measured)))
    words = []
    has_few = True
    for row, channel in enumerate(compared):
        values = channel.values
        residuals = channel.residuals
        # Samples in a channel that the model explains are right, however they look; so are those of one that stands
        # still with the model, but for its zero.
        zero = usual_zero(channel.channel, agreement.request.device)
        if (np.ptp(values) == 0.0 and np.ptp(residuals) < zero) or channel.in_noise**2 < ONLY_NOISE:
            continue
        said, is_wrong, is_isolated = _wrong_samples(channel, agreement.measured.time)
        if said:
            words.append(f"{channel.channel} {said}")
            has_few = has_few and is_isolated and float(is_wrong.mean()) < _FEW_OUTLIERS
            good[row] -= is_wrong
            noise[row] = noise_in(values[~is_wrong], channel.full_range)
    record = Record(
        agreement=agreement,
        channels=tuple(channel.channel for channel in compared),
        values=np.stack([channel.values for channel in compared]) / noise[:, None],
        noise=noise,
        engine=ENGINE_ERROR * np.array([channel.full_range for channel in compared]) / noise,
        good=good,
        words=tuple(words),
        has_few=has_few,
    )
    request = agreement.request
    starts = []
    for name, error in zip(record.channels, noise / math.sqrt(samples_at_rest(agreement.measured)), strict=True):
        if name in SENSORS and name not in request.settings.initial:
            # A vane at its upper stop can only move down.
            is_at_stop = name == ANGLE and request.start.angle > request.device.actuator.angle_max - error
            starts.append({name: getattr(request.start, name) + float(-error if is_at_stop else error)})
    if (error := request.start.velocity_error) > 0.0:
        starts.append({"angular_velocity": request.start.angular_velocity + error})
    moved = [replace(request, start=replace(request.start, **start)) for start in starts]
    readings = [
        readings_of(record, replayed, ModelChange(), 0.0)
        for replayed in (agreement.replayed, *replay_together(moved))
        if isinstance(replayed, Replayed)
    ]
    return record._replace(starts=tuple(other - readings[0] for other in readings[1:]))


def _wrong_samples(channel: ChannelAgreement, times: Floats) -> tuple[str, NDArray[np.bool_], bool]:
    """Return words on faulty samples, empty without any, their flags, and True for isolated outliers.

    Samples are clipped at the least or largest value if it is repeated more often than by chance. A coarse converter
    repeats inner values too. Agreement of the other channels tells a stop of the vane from clipping.
    """
    values = channel.values
    count = len(channel.values)
    if np.ptp(values) == 0.0:
        locked = argument_text("motion", "locked")
        other_cause = f"the vane was locked ({locked}), or " if channel.channel == ANGLE else ""
        return f"never changes: {other_cause}the sensor is dead or not connected", np.ones(count, dtype=bool), False
    run_ends = np.append(np.flatnonzero(np.diff(values)), count - 1)
    lengths = np.diff(run_ends, prepend=-1)
    levels = values[run_ends]
    ends = {"least": values.min(), "largest": values.max()}
    inner = lengths[(levels > ends["least"]) & (levels < ends["largest"])]
    # Chance that a sample repeats the one before it.
    repeated = max(1.0 - len(inner) / max(int(inner.sum()), 1), 1.0 / count)
    clipped = {
        word: values == end
        for word, end in ends.items()
        if count * repeated ** (int(lengths[levels == end].max()) - 1) < _BY_CHANCE
    }
    if clipped:
        counts = " and ".join(
            f"{int(flags.sum())} samples are exactly its {word} value" for word, flags in clipped.items()
        )
        return f"is clipped: {counts}", np.any([*clipped.values()], axis=0), False
    is_out, is_out_on_flank = (isolated_samples(one, channel.noise) for one in (values, channel.residuals))
    # On a flank an outlier shows only beside a model that follows it; at the ends a delay makes one of a step.
    is_out[1:-1] |= is_out_on_flank[1:-1]
    outliers = int(is_out.sum())
    first = f"{float(times[int(np.argmax(is_out))]):.6g} s"
    said = f"has {outliers} isolated outlier{'s' if outliers > 1 else ''}, the first at {first}"
    return said if outliers else "", is_out, True


def at_rate(recording: Recording, rate: float) -> Recording:
    """Return a recording in true time, given the ``rate`` of its clock relative to true time [-]."""
    first = recording.time[0]
    return replace(recording, time=first + (recording.time - first) / rate)


def readings_of(record: Record, replayed: Replayed, change: ModelChange, offset: float) -> Floats:
    """Return modelled readings divided by noise (channels, samples) under a change, delayed by ``offset`` [s]."""
    time = record.agreement.measured.time
    model = replayed.recording
    true_time = time[0] + (time - time[0]) / change.clock
    rows = []
    for name in record.channels:
        sensor = change.sensors.get(name, SensorModel())
        source = model[SWAPPED.get(name, name) if change.is_swapped else name]
        delay = offset + change.delay + sensor.delay
        rows.append(sensor.of(np.interp(true_time - delay, model.time, source)))
    return np.asarray(np.stack(rows) / record.noise[:, None])


def residuals_of(record: Record, replayed: Replayed, change: ModelChange) -> ScaledResiduals:
    """Return the residuals after fitting the common delay, within its limit, and the initial values.

    Each Gauss-Newton step fits both; the initial values have a prior with a standard deviation of one standard error.
    The fit starts both from no delay and from that of the unchanged model, which a wrong model may distort.
    """
    good = np.ones_like(record.good) if change.start is None else record.good
    interval = float(np.median(np.diff(record.agreement.measured.time)))
    # No quantity stands twice in one fit: beside a delay of its own a change gets no free one, which would take a part.
    longest = 0.0 if change.has_delay else record.agreement.request.settings.longest_delay
    options = []
    for start in {0.0, record.agreement.delay} if longest > 0.0 else {0.0}:
        delay = start
        errors = np.zeros(0)
        for _ in range(STEPS + 1 if longest > 0.0 else 1):
            readings = readings_of(record, replayed, change, delay)
            by_delay = [np.gradient(readings, axis=1)] if longest > 0.0 else []
            errors = ((record.values - readings) * good).ravel()
            columns = [(column * good).ravel() for column in (*by_delay, *record.starts)]
            sizes = _ridge_fit(columns, errors)
            if by_delay:
                last = delay
                free = delay - interval * float(sizes[0])
                delay = min(max(free, 0.0), longest)
                if delay != free:
                    # At an end of its range the delay is known, and the initial values alone are fitted.
                    errors = errors - (last - delay) / interval * columns[0]
                    columns = columns[1:]
                    sizes = _ridge_fit(columns, errors)
            errors = errors - sum(size * column for size, column in zip(sizes, columns, strict=True))
        options.append(errors)
    errors = min(options, key=lambda option: float(option @ option))
    squares = np.square(errors.reshape(good.shape)).sum(axis=1) / np.maximum(good.sum(axis=1), 1.0)
    return ScaledResiduals(squares, errors)


def _ridge_fit(columns: Sequence[Floats], errors: Floats) -> Floats:
    """Return the coefficients of ``columns`` that fit ``errors``, each with a prior of 0 +- 1."""
    matrix = np.reshape(columns, (len(columns), errors.size))
    return np.asarray(np.linalg.solve(matrix @ matrix.T + np.eye(len(columns)), matrix @ errors))


@dataclass(frozen=True, slots=True, eq=False)
class Cause:
    """Row of the table of causes; once tried, with its best magnitude, residuals and gain G [-].

    ``words``: message with a placeholder for ``shown`` times the magnitude. ``change``: function from magnitude to
    change. ``sizes``: trial magnitudes; a single one is not fitted, and several above 0 are ratios, fitted as their
    logarithms. ``usual``: largest usual error on any bench (of a ratio, its logarithm). ``is_of_unit``: misread unit,
    reported only if it explains the recordings. ``is_off``: the model lacks the number or effect, so that a ratio of 1
    is a change too. ``unit``: unit of the changed parameter.

    ``size``: magnitude, for ratios its logarithm. ``slope``: derivative of all errors by it, divided by noise [-].
    ``left``: largest RMS error of any channel divided by its noise [-] under the cause. ``delay``: common delay [s] of
    the measurement beside a cause that was found, 0 if the cause is a delay itself. ``same``: other causes that the
    recordings cannot distinguish from this one; of the nearest cause, the two next ones.
    """

    name: str
    words: str
    change: Callable[[float], ModelChange]
    sizes: tuple[float, ...] = (0.0,)
    usual: float = 0.0
    shown: float = 1.0
    is_of_unit: bool = False
    is_off: bool = False
    unit: str = ""
    size: float = math.nan
    residuals: ScaledResiduals = UNTRIED
    gain: float = 0.0
    left: float = math.nan
    slope: Floats = field(default_factory=lambda: np.zeros(0))
    delay: float = 0.0
    same: "tuple[Cause, ...]" = ()

    @property
    def has_size(self) -> bool:
        """True if the magnitude is fitted; a swap or a wrong sign has no magnitude."""
        return len(self.sizes) > 1

    @property
    def is_ratio(self) -> bool:
        """True if the magnitude is fitted as a logarithm."""
        return self.has_size and min(self.sizes) > 0.0

    @property
    def grid(self) -> list[float]:
        """Trial magnitudes, as logarithms if they are ratios."""
        return [math.log(size) if self.is_ratio else size for size in self.sizes]

    def at(self, size: float) -> ModelChange:
        """Return the change of the model for a fitted magnitude (for ratios, its logarithm)."""
        return self.change(math.exp(size) if self.is_ratio else size)

    @property
    def first(self) -> ModelChange:
        """Change of the model at the first trial magnitude, which shows what the cause changes."""
        return self.at(self.grid[0])

    @property
    def numbers(self) -> dict[str, tuple[float, str]]:
        """Changed parameters by path, each a value with its SI unit."""
        return {path: (value, self.unit) for path, value in self.at(self.size).numbers.items() if self.unit}

    @property
    def in_words(self) -> str:
        """Message, with values of the set in display units."""
        said = self.words.format(self.shown * (math.exp(self.size) if self.is_ratio else self.size))
        for value, unit in self.numbers.values():
            # An atmosphere in gauge pressure says nothing.
            quantity = "pressure change" if unit == "Pa_a" else quantity_of_unit(unit)
            said += f" ({Kind('', '' if unit == '-' else unit, quantity).text(value).removesuffix('_d')})"
        return said

    @property
    def is_of_bench(self) -> bool:
        """True for a usual error of a single sensor; an error of a sensor group is a sum of single errors."""
        return self.usual > 0.0 and len(self.first.sensors) <= 1

    @property
    def is_of_samples(self) -> bool:
        """True for faulty samples, which are visible without a model."""
        return self.first.start is not None

    @property
    def neighbours(self) -> tuple[float, float]:
        """Trial magnitudes below and above the one nearest to the magnitude, or that one at an end of the grid."""
        grid = sorted(self.grid)
        nearest = int(np.argmin(np.abs(np.array(grid) - self.size)))
        return grid[max(0, nearest - 1)], grid[min(len(grid) - 1, nearest + 1)]

    @property
    def is_inside(self) -> bool:
        """True if the magnitude is inside its grid; at an end, a better magnitude may lie beyond."""
        return min(self.grid) < self.size < max(self.grid)

    @property
    def is_usual(self) -> bool:
        """True if the magnitude is within what is usual on any bench."""
        return self.usual > 0.0 and abs(self.size) <= self.usual

    @property
    def explains(self) -> bool:
        """True if the residuals of every channel are noise and G is positive."""
        return self.residuals.is_noise and self.gain > 0.0


def visible(records: Sequence[Record], motion: Motion) -> Iterator[Cause]:
    """Yield what is seen without a model: faulty samples of all channels, and another motion of the vane."""
    faulty = [record for record in records if record.words]
    if faulty:
        of_file = {True: " ({})", False: ""}[len(records) > 1]
        texts = [words + of_file.format(record.agreement.file) for record in faulty for words in record.words]
        channels = dict.fromkeys(words.split()[0] for record in faulty for words in record.words)
        # Every channel has a sample that a sensor made among those of the start.
        has_start = all(
            bool(record.good[:, : samples_at_rest(record.agreement.measured)].any(axis=1).all()) for record in faulty
        )
        yield Cause(
            f"samples of {' and '.join(channels)}",
            # No size is shown, and a file's name may have a brace.
            "; ".join(texts).replace("{", "{{").replace("}", "}}"),
            lambda share: ModelChange(start=share),
            (0.0,) if has_start else _STARTS,
            usual=math.inf if all(record.has_few for record in faulty) else 0.0,
        )
    angles = [record.values[record.channels.index(ANGLE)] for record in records if ANGLE in record.channels]
    is_at_rest = all(float(np.std(angle)) < _AT_REST for angle in angles)
    if angles and (motion == "free" or (motion == "leg" and is_at_rest)):
        other: Motion = "locked" if is_at_rest else "leg"
        seems = "be locked, because its recorded angle is constant" if is_at_rest else "be coupled to a leg"
        words = f"the vane seems to {seems} ({argument_text('motion', other)})"
        yield Cause("motion", words, lambda _: ModelChange(motion=other))


def of_sensors(agreements: Sequence[RecordingAgreement]) -> Iterator[Cause]:
    """Yield errors of sensors and clock: zero, gain, unit, sign and delay, swapped channels, rate of the clock.

    Units are not tried for a chamber that stays at atmospheric pressure, which shows no factor, nor against a unit that
    a file declares.
    """
    recordings = [agreement.measured for agreement in agreements]
    device = agreements[0].request.device
    names = set.intersection(*(set(recording.names) for recording in recordings))
    atmosphere = device.supply.atmospheric_pressure
    # A channel moves that departs, measured or modelled, from the atmosphere by more than a zero error.
    stated_of_moving = {
        name: {item.channels[name].stated for item in recordings if name in item}
        for recording in (*recordings, *(agreement.model for agreement in agreements))
        for name in recording.names
        if float(np.abs(recording[name] - atmosphere).max()) > usual_errors(name).zero
    }

    def row(channels: Sequence[str], kind: str, name: str, words: str, *sizes: float, **of_row: Any) -> Cause:
        about = of_row.pop("about", 0.0)
        return Cause(
            name,
            words,
            lambda size: ModelChange(dict.fromkeys(channels, replace(SensorModel(about=about), **{kind: size}))),
            sizes,
            **of_row,
        )

    gauge = max(device.supply.pressure, device.supply.dorsiflexion_pressure) - atmosphere
    chambers = tuple(name for name in (PRESSURE_1, PRESSURE_2) if name in names)
    supplies = tuple(name for name in (SUPPLY, DORSIFLEXION_SUPPLY) if name in names)
    pressures = (*chambers, *supplies)
    # Pressure sensors may share an error: each, both chambers, both supplies, and all, the largest group first.
    groups = {(name,) for name in pressures} | {chambers, supplies, pressures} - {()}
    # Sensors of one kind: their SI unit, the point [SI] about which a gain turns, the size of a zero of 1 [SI], or 0
    # where none is tried, its unit and how many of that are 1 in SI, and the errors of any bench; a command has none.
    of_pressure = ("Pa", atmosphere, gauge, *_unit_of_pressure(device), usual_errors(PRESSURE_1))
    exact = usual_errors(ANGLE)._replace(zero=0.0, gain=0.0)
    sensed = [(group, *of_pressure) for group in sorted(groups, key=lambda group: (-len(group), group))]
    sensed += [
        ((ANGLE,), "rad", 0.0, 1.0, "deg", math.degrees(1.0), usual_errors(ANGLE)),
        ((COMMAND,), "", 0.0, 1.0, "of full opening", 1.0, exact),
        ((EXTERNAL_TORQUE,), "N m", 0.0, 0.0, "", 1.0, exact),
    ]
    for channels, si_unit, about, size, unit, shown, usual in sensed:
        if not names.issuperset(channels):
            continue
        several = len(channels) > 1
        group = "all pressures" if several and channels == pressures else " and ".join(channels)
        seems = f"{group} {'seem' if several else 'seems'}"
        if size:
            words = f"the zero of {group} seems to be off by {{:+.3g}} {unit}"
            zeros = [size * part for part in _ZEROS]
            yield row(channels, "zero", f"zero of {group}", words, *zeros, shown=shown, usual=usual.zero)
            words = f"{seems} to read {{:.4g}} times the true value"
            yield row(channels, "gain", f"gain of {group}", words, *_GAINS, about=about, usual=usual.gain)
        read_as = ("gauge read as absolute", -about), ("absolute read as gauge", about)
        for kind, zero in read_as if si_unit == "Pa" else ():
            yield row(channels, "zero", f"{seems} to be {kind}", f"{seems} to be {kind}", zero, is_of_unit=True)
        stated = set[str]().union(*(stated_of_moving.get(name, ()) for name in channels))
        is_moving = si_unit and not stated_of_moving.keys().isdisjoint(channels)
        for mistake, factor in misread_units(si_unit, stated) if is_moving else ():
            name = f"{seems} to be {mistake}"
            words = f"{name}: the unit is probably wrong, by a factor of {max(factor, 1.0 / factor):.4g}"
            yield row(channels, "gain", name, words, factor, about=about, is_of_unit=True)
    sensors = [name for name in SENSORS if name in names]
    # Of one sensor alone the delay is the one of all, which is taken out.
    for name in sensors if len(sensors) > 1 else ():
        words = f"{name} seems to lag the other channels by {{:.3g}} ms"
        usual_delay = usual_errors(name).delay
        yield row([name], "delay", f"delay of {name}", words, *_DELAYS, shown=1.0e3, usual=usual_delay)
    # A delay is no ratio: its magnitude is below 0, as that of a lead is.
    delays, leads = (tuple(-time for time in times) for times in (_LONG_DELAYS, _SHIFTS))
    words = "all sensors seem to lag the command by {:.3g} ms"
    yield Cause("delay of all sensors", words, lambda time: ModelChange(delay=-time), delays, shown=-1.0e3)
    words = "all sensors seem to lead the command by {:.3g} ms"
    yield Cause("lead of all sensors", words, lambda time: ModelChange(delay=time), leads, shown=-1.0e3)
    words = "the clock of the recording seems to run {:.4g} times as fast"
    yield Cause("rate of the clock", words, lambda rate: ModelChange(clock=rate), _RATES)
    swapped = ModelChange(is_swapped=True)
    has_both = len(chambers) > 1
    if has_both:
        yield Cause("swap", "pressure_1 and pressure_2 seem to be swapped", lambda _: swapped)
    for name in (COMMAND, EXTERNAL_TORQUE):
        if name in names:
            yield row([name], "gain", f"sign of {name}", f"{name} seems to have the wrong sign", -1.0)
    if has_both:
        # A symmetric device mirrors both by an angle from the other end, and no recording tells these apart.
        words = "command seems to have the wrong sign, and pressure_1 and pressure_2 to be swapped"
        mirrored = replace(swapped, sensors={COMMAND: SensorModel(gain=-1.0)})
        yield Cause("sign of command and swap", words, lambda _: mirrored)
    if ANGLE in names:
        middle = 0.5 * (device.actuator.angle_min + device.actuator.angle_max)
        words = "the angle seems to be counted from the other end"
        yield row([ANGLE], "gain", "end of angle", words, -1.0, about=middle)


def of_numbers(request: Replay) -> Iterator[Cause]:
    """Yield every number of the set, 0 or not, with trial values, and a wrong atmosphere under gauge sensors."""
    device = request.device
    recording = request.measured.recording
    scenario = replace(replayed_scenario(request), device=device)
    # Supply pressures that a replay follows in the recording, whatever the set has.
    followed = (
        set(_OF_SUPPLY)
        if SUPPLY in recording and device.supply.has_one_pressure
        else {path for path, channel in _OF_SUPPLY.items() if channel in recording}
    )
    other_forms = {f"{part}.{name}" for part in ("actuator.leak", "valve") for name in other_form(device, part)}
    by_section: dict[str, list[tuple[str, Quantity]]] = {section: [] for section in _SECTIONS}
    for path, quantity in declared_numbers(scenario).items():
        section, name, *_ = path.split(".")
        is_off = section == "effects" and name not in device.effects
        if section in by_section and not is_off and path not in {_NOT_TRIED, *other_forms, *followed}:
            by_section[section].append((path, quantity))
    for path, quantity in chain.from_iterable(by_section.values()):
        value = number_at(scenario, path)
        words = "{} seems to be {{:.3g}} times the model's value"
        base = value
        trials = _FACTORS
        if value == 0.0:
            sign = "above" if quantity.minimum == 0.0 else "other than"
            words = f"{{}} seems to be {sign} 0"
            base = 1.0
            trials = _OFF.get(quantity.unit, ())
        elif path in _OF_GASES:
            trials = tuple((np.geomspace(*_OF_GASES[path], 5) / value).tolist())
        trials = tuple(size for size in trials if quantity.minimum <= size * base <= quantity.maximum)
        # Two regulators of one pressure are set together; one of them may be off alone.
        is_first = path == PRESSURE_PATH and device.supply.has_one_pressure
        for name, others in ((path, {}), (f"{path} alone", {SECOND_PRESSURE_PATH: value}))[: 1 + is_first]:
            if len(trials) > 2:
                yield Cause(
                    name,
                    words.format(name),
                    partial(_with_number, path, base, others),
                    trials,
                    usual=math.log1p(SUPPLY_ERROR / value) if path in _OF_SUPPLY else 0.0,
                    is_off=value == 0.0 and min(trials) > 0.0,
                    unit="" if others else quantity.unit or "-",
                )
    pressures = {path: number_at(scenario, path) for path in _OF_SUPPLY if path not in followed}
    atmosphere = device.supply.atmospheric_pressure

    def under_atmosphere(factor: float) -> ModelChange:
        higher = (factor - 1.0) * atmosphere
        sensors = dict.fromkeys((PRESSURE_1, PRESSURE_2, *_OF_SUPPLY.values()), SensorModel(zero=-higher))
        moved = {path: pressure + higher for path, pressure in pressures.items()}
        return ModelChange(sensors, {ATMOSPHERE_PATH: atmosphere + higher, **moved})

    unit, per_pascal = _unit_of_pressure(device)
    words = f"the atmosphere under gauge pressures seems to be {{:.4g}} {unit}"
    yield Cause("atmosphere", words, under_atmosphere, _ATMOSPHERES, shown=per_pascal * atmosphere)


def _with_number(path: str, base: float, others: Mapping[str, float], size: float) -> ModelChange:
    """Return a change of a number of the set to a multiple of ``base``, and of ``others`` to their values [SI]."""
    return ModelChange(numbers={**others, path: size * base})


def _unit_of_pressure(device: Device) -> tuple[str, float]:
    """Return the display unit of a pressure difference, and the number of these units in 1 Pa."""
    with shown_in(device.shown):
        return shown_unit("Pa_d").removesuffix("_d"), shown_value(1.0, "Pa_d")


def of_effects(device: Device) -> Iterator[Cause]:
    """Yield other openings of the valve, and every effect that is off in the model of the device."""
    if "opening" in device.effects:
        straight = ModelChange(effects={"opening": {}})
        yield Cause("opening", "the valve seems to open by a straight line, not by its table", lambda _: straight)
    elif device.valve.kind == "proportional":
        words = "the valve seems to open by the power {:.2g} of its command"
        yield Cause("opening", words, partial(_with_effect, "opening"), _POWERS)
    for name, (unit, words) in _LACKING.items():
        if name.partition(".")[0] not in device.effects:
            shown = 1.0e6 if unit == "m^2" else 1.0
            yield Cause(name, words, partial(_with_effect, name), _OFF[unit], shown=shown, is_off=True)


def _with_effect(name: str, size: float) -> ModelChange:
    """Return a change of the effect ``name``, or of its setting of a full name, to a magnitude."""
    effect, _, setting = name.partition(".")
    settings = {
        "opening": {f"command_{node:02}": node / 10 for node in range(1, 10)}
        | {f"opening_{node:02}": (node / 10) ** size for node in range(1, 10)},
        "stribeck": {"velocity": size, "share": 0.9},
        "seal_friction": {"static_per_pressure": size, "dynamic_per_pressure": size},
    }
    return ModelChange(effects={effect: {setting: size} if setting else settings[effect]})


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Result of the search for a cause of a disagreement.

    ``found`` is the cause, if any; ``nearest`` is the best candidate if none explains the recordings, ``has_second``
    true if it leaves noise with a second change in it. ``tried`` is the number of candidates compared, ``kinds`` the
    kinds of causes where not all were tried. ``is_noise`` is true if the residuals are noise, so that no cause is
    needed.
    """

    found: Cause | None = None
    nearest: Cause | None = None
    tried: int = 0
    is_noise: bool = False
    kinds: str = ""
    has_second: bool = False


@on_one_thread
def causes_of(agreements: Sequence[RecordingAgreement], report: Report = report_nothing) -> Diagnosis:
    """Return the single cause that explains all recordings together, or a diagnosis without a cause."""
    if (other_unit := _in_other_unit(agreements)) is not None:
        return Diagnosis(other_unit, None, 1)
    records = [record_of(agreement) for agreement in agreements]
    search = CauseSearch(records, report)
    none = search.evaluated([ModelChange()])[0]
    if none is None or none.is_noise:
        return Diagnosis(is_noise=none is not None)
    search = replace(search, none=none)
    tried = []
    request = agreements[0].request
    is_measured = request.settings.motion == "measured"
    for row in visible(records, request.settings.motion):
        tried += search.compared([row])
        if any(cause.explains for cause in tried):
            return search.explained(tried, [])
    if is_measured and sum(agreement.measured.duration for agreement in agreements) > _LONGEST_SEARCHED:
        # Hundreds of replays of a minute each would take minutes of computing time.
        return Diagnosis(tried=len(tried), kinds=_TRIED_IN_LONG_RECORDINGS)
    # Numbers of the set are compared with sensors: the gain of a command is the area of its valve.
    rows = [*of_sensors(agreements), *of_numbers(request)]
    lacking = [*of_effects(request.device)]
    if is_measured:
        rows, lacking = ([row for row in each if not row.first.is_of_motion] for each in (rows, lacking))
    sized = [row for row in rows if row.has_size]
    # Errors that any bench has come before a fault, a mistake without a size too: they need no cause.
    of_bench = search.compared([row for row in sized if row.usual])
    explaining = [cause for cause in of_bench if cause.explains]
    usual = [cause for cause in explaining if cause.is_usual]
    # A delay that ends at its limit is longer than that, and no error of any bench.
    is_late = any(agreement.is_at_limit for agreement in agreements)
    if not usual and not is_late:
        # Beside pressures that are nearly equal a flow bends: what is small together may fail on straight lines, and
        # not alone. One error beyond its limit explains more than several that strain to add up to it.
        least = max((cause.gain for cause in explaining), default=0.0) - search.penalty
        together = search.compared(search.together(of_bench))
        usual = [cause for cause in together if cause.explains and cause.gain > least]
    if usual and not is_late:
        return Diagnosis(search.best_of(usual), None, len(tried) + len(of_bench))
    exchanges = [row for row in rows if not row.has_size]
    not_of_bench = [row for row in sized if not row.usual]
    for compared, untried in (([], exchanges), (of_bench, [*not_of_bench, *lacking])):
        tried += [*compared, *search.compared(untried)]
        if any(cause.explains for cause in tried):
            return search.explained(tried, sized)
    return search.unexplained(tried, _TRIED_WITH_MEASURED_ANGLE if is_measured else "")


def _in_other_unit(agreements: Sequence[RecordingAgreement]) -> Cause | None:
    """Return milliseconds read as seconds (or the reverse) as cause if the model agrees only with the corrected times.

    With corrected times the model must explain half of the variance of every signal that moves, and every error above
    its limit must fall to less than half. This cause is tried first: with wrong times, all other trials would simulate
    a thousand times, or a thousandth of, the true duration.
    """
    if all(agreement.passes for agreement in agreements):
        return None
    # Hardly any bench samples so often, and a run a thousand times as long is not made for others.
    is_short = max(np.median(np.diff(agreement.measured.time)) for agreement in agreements) <= _SHORT_INTERVAL
    name = "seconds read as milliseconds" if is_short else "milliseconds read as seconds"
    pairs = list[tuple[ChannelAgreement, ChannelAgreement]]()
    for as_read in agreements:
        request = as_read.request
        in_other = replace(request.measured, recording=at_rate(as_read.measured, _TIMES[name]))
        try:
            other = compare_recording(in_other, request.device, request.settings)
        except PpafoError:
            return None
        pairs += zip(as_read.channels, other.channels, strict=True)
    explains_all = all(
        (before.passes or after.rms < _LESS * before.rms)
        and (after.passes or after.rms**2 < (1.0 - EXPLAINED_FRACTION) * after.variation**2)
        for before, after in pairs
    )
    left = max(after.in_noise for _, after in pairs)
    words = f"times seem to be in {name}"
    cause = Cause(name, words, lambda rate: ModelChange(clock=rate), size=_TIMES[name], left=left)
    return cause if explains_all else None


_Trial = tuple[Cause, ModelChange, float]
"""Cause with the residuals without it, and the change that moves its magnitude by a step."""


@dataclass(frozen=True, slots=True)
class CauseSearch:
    """Recordings on which changes are tried; ``report`` receives the progress.

    ``none`` are the residuals without a change.
    """

    records: list[Record]
    report: Report
    none: ScaledResiduals = UNTRIED

    @property
    def counts(self) -> list[int]:
        """Number of samples by channel and recording."""
        return [record.values.shape[1] for record in self.records for _ in record.channels]

    @property
    def penalty(self) -> float:
        """Logarithm of the number of samples: penalty of a fitted magnitude, and least difference of two gains."""
        return math.log(sum(self.counts))

    @property
    def of_engine(self) -> float:
        """Squared integration error of the engine, divided by noise and summed over all samples [-]."""
        return sum(float(np.square(record.engine) @ record.good.sum(axis=1)) for record in self.records)

    def evaluated(self, changes: Sequence[ModelChange]) -> list[ScaledResiduals | None]:
        """Return the residuals under each change; None for a device that cannot produce the recordings."""
        evaluated: list[ScaledResiduals | None] = []
        for start in range(0, len(changes), _TOGETHER):
            self.report(Progress("searching for causes", start, len(changes), noun="changes"))
            batch = changes[start : start + _TOGETHER]
            for change, replays in zip(batch, self._replays(batch), strict=True):
                residuals = [residuals_of(record, replayed, change) for record, _, replayed in replays]
                joint = map(np.concatenate, zip(*residuals, strict=True))
                evaluated.append(ScaledResiduals(*joint) if len(residuals) == len(self.records) else None)
        return evaluated

    def _replays(self, changes: Sequence[ModelChange]) -> list[list[tuple[Record, Replay, Replayed]]]:
        """Return, for each change, the corrected recordings replayed on the changed device, as far as it can."""
        rows = []
        for change in changes:
            rows.append(list[Replay]())
            with suppress(PpafoError):
                rows[-1] += [_request(record, change) for record in self.records]
        replayed = iter(replay_together([*chain.from_iterable(rows)]))
        return [
            [
                (record, request, result)
                for request, record, result in zip(row, self.records, islice(replayed, len(row)), strict=False)
                if isinstance(result, Replayed)
            ]
            for row in rows
        ]

    def _at(self, cause: Cause, size: float, residuals: ScaledResiduals) -> Cause:
        """Return a cause at a magnitude, with its residuals and its gain G [-]."""
        squares = [np.log(np.maximum(item.squares, 1.0)) for item in (self.none, residuals)]
        gain = float(np.array(self.counts) @ (squares[0] - squares[1])) - self.penalty * cause.has_size
        left = math.sqrt(float(residuals.squares.max()))
        return replace(cause, size=size, residuals=residuals, gain=gain, left=left)

    def compared(self, rows: Sequence[Cause]) -> list[Cause]:
        """Return each cause at its best magnitude: the best of a grid, refined by two Gauss-Newton steps.

        Causes whose best magnitude is at an end of the grid are rejected.
        """
        best = dict[str, Cause]()
        worse = dict[str, float]()
        rising = set[str]()
        trials = [(row, size) for row in rows for size in row.grid]
        for step in range(STEPS + _OF_BEST + _OF_RISING + 1):
            rising.clear()
            changes = [row.at(size) for row, size in trials]
            for (row, size), residuals in zip(trials, self.evaluated(changes), strict=True):
                if residuals is not None:
                    cause = self._at(row, size, residuals)
                    previous = best.get(row.name)
                    # Sizes that leave nothing but noise are equal: one inside the grid is known better than its ends.
                    if previous is None or (cause.gain, cause.is_inside) > (previous.gain, previous.is_inside):
                        best[row.name] = cause
                        worse.pop(row.name, None)
                        if previous is not None and cause.gain - previous.gain > self.penalty:
                            rising.add(row.name)
                    elif step:
                        worse[row.name] = size
            improved = [cause for cause in best.values() if cause.has_size]
            if step >= STEPS:
                improved = sorted(improved, key=lambda cause: -cause.gain)[:_BEST]
            is_last = step >= STEPS + _OF_BEST
            if is_last:
                improved = [cause for cause in improved if cause.name in rising or cause is improved[0]]
            if step == STEPS + _OF_BEST + _OF_RISING:
                break
            # A step that went too far is taken again, shorter; at last from a finer difference, which may see another
            # slope. The others end between neighbours on their grids.
            again = [cause for cause in improved if cause.name in worse and not is_last]
            trials = [(cause, cause.size + _SHORTER * (worse[cause.name] - cause.size)) for cause in again]
            moved = []
            for cause in (cause for cause in improved if cause not in again):
                share = _FINE_DIFFERENCE if is_last else _DIFFERENCE
                length = share * (cause.neighbours[1] - cause.neighbours[0])
                moved.append((cause, cause.at(cause.size + length), length))
            for cause in self._slopes(moved):
                low, high = cause.neighbours
                full = float(cause.slope @ cause.residuals.errors) / max(float(cause.slope @ cause.slope), _SMALLEST)
                trials.append((cause, min(max(cause.size - full, low), high)))
        return [cause for cause in best.values() if cause.is_inside or not cause.has_size]

    def _slopes(self, trials: Sequence[_Trial]) -> list[Cause]:
        """Return each cause that can be replayed with the derivative of its errors by its magnitude."""
        moved = self.evaluated([change for _, change, _ in trials])
        return [
            replace(cause, slope=(residuals.errors - cause.residuals.errors) / step)
            for (cause, _, step), residuals in zip(trials, moved, strict=True)
            if residuals is not None
        ]

    def slopes(self, change: ModelChange, residuals: ScaledResiduals, rows: Sequence[Cause]) -> list[Cause]:
        """Return each additional cause with the derivative of the ``residuals`` under a change by its magnitude."""
        # A delay of all sensors is free already, unless the change has one itself.
        is_free = self.records[0].agreement.request.settings.longest_delay > 0.0 and not change.has_delay
        trials = []
        for row in rows:
            # From what is off no straight line leads to a ratio.
            if not (row.is_off or (is_free and row.first.has_delay)):
                step = _SMALL * min(map(abs, row.grid))
                trials.append((replace(row, residuals=residuals), joined(change, row.at(step)), step))
        return self._slopes(trials)

    def together(self, of_bench: Sequence[Cause]) -> list[Cause]:
        """Return the likeliest usual errors of all sensors as a single change; empty if together they are unusual.

        Only errors of single sensors are used; errors of groups would add to them beyond their limits. In each channel
        the sum of the explained errors, squared and divided by its variance, is chi-square distributed; many errors at
        their limits with the same sign are as unlikely as one error beyond its limit.
        """
        rows = self.slopes(ModelChange(), self.none, [cause for cause in of_bench if cause.is_of_bench])
        if not rows:
            return []
        fitted = _bounded(rows, self.none.errors)
        sums = np.add.reduceat(np.stack([cause.slope for cause in rows], axis=1), np.cumsum([0, *self.counts[:-1]]))
        deviations = [deviation_of_limit(cause.usual) for cause in rows]
        explained = np.square(sums @ [cause.size for cause in fitted])
        squares = explained / np.maximum(np.square(sums * deviations).sum(axis=1), _SMALLEST)
        if len(self.counts) * float(chi2.sf(squares.max(), 1)) < _UNUSUAL:
            return []
        change = reduce(joined, [cause.at(cause.size) for cause in fitted])
        words = "zeros, gains and delays of several sensors seem to be off"
        return [Cause("several sensors", words, lambda _: change, (1.0,), usual=1.0)]

    def needs_another(self, first: Cause, others: Sequence[Cause]) -> bool:
        """Return whether the residuals left by the first change need a second, unusually large change.

        The test is linear in both magnitudes. The squared error explained by the second change must exceed 2 (ln N + ln
        p) m^2 + e^2, with N samples, p candidates (extended BIC, Chen and Chen 2008), m >= 1 the mean square of the
        errors that remain [-], above 1 for correlated noise, and e^2 the squared integration error of the engine. The
        penalty has ln N for the fitted magnitude and ln N to separate two causes.
        """
        if not others:
            return False
        # A tangent: of a logarithm the sizes themselves are no measure.
        errors = first.residuals.errors
        step = _DIFFERENCE * float(np.diff(sorted(first.grid)).min())
        moved = self._slopes([(first, first.at(first.size + step), 1.0)])
        along_first = moved[0].slope if moved else np.zeros_like(errors)
        along_first /= max(float(np.linalg.norm(along_first)), _SMALLEST)
        # Beside a second change the first would have another size: what it can take over is no merit of the second.
        rest = errors - (along_first @ errors) * along_first
        threshold = 2.0 * (self.penalty + math.log(len(others)))
        for cause in others:
            across = cause.slope - (along_first @ cause.slope) * along_first
            across_square = float(across @ across)
            # A cause with the effect of the first leaves rounding, along which anything may seem to be explained.
            if across_square > _PARTING * float(cause.slope @ cause.slope):
                along = float(across @ rest)
                explained = along * along / across_square
                noise = max((float(rest @ rest) - explained) / len(errors), 1.0)
                is_larger = abs(along / across_square) > cause.usual
                if is_larger and explained > self.of_engine + threshold * noise * noise:
                    return True
        return False

    def explained(self, tried: Sequence[Cause], sized: Sequence[Cause]) -> Diagnosis:
        """Return the best cause with its alternatives, or a diagnosis without a cause if a second one is needed.

        Some of the causes ``tried`` explain the recordings; ``sized`` are causes with a magnitude, to combine with one.
        Alternatives are also unusually large changes that explain the recordings together with usual sensor errors,
        which cost no penalty: their magnitudes come from a linear fit, and a replay verifies each.
        """
        explaining = [cause for cause in tried if cause.explains]
        first = max(explaining, key=lambda cause: cause.gain)
        known = {cause.name for cause in explaining}
        # One Jacobian, at the first cause, shows what a second one would add and what could replace it. A cause without
        # a size to fit, a swap or a sign, cannot pass for two other changes.
        is_fitted = first.has_size and not first.is_of_samples
        slopes = self.slopes(first.at(first.size), first.residuals, sized) if is_fitted else []
        if self.needs_another(first, slopes):
            return Diagnosis(None, first, len(tried), has_second=True)
        none = self.none.errors
        larger = []
        changes = []
        for cause in (cause for cause in slopes if cause.name not in known):
            usual = [other for other in slopes if other.is_of_bench and other is not cause]
            fitted = _bounded([replace(cause, usual=math.inf), *usual], none)
            errors = none + sum(each.size * each.slope for each in fitted)
            # A straight line leaves some more; what leaves far more is no small change, nor is what its grid does not
            # reach: of a logarithm such a size would be no number any more.
            is_small = float(errors @ errors) < 2.0 * ONLY_NOISE * len(errors)
            if fitted[0].is_inside and is_small and abs(fitted[0].size) > cause.usual:
                larger.append(replace(cause, size=fitted[0].size))
                changes.append(reduce(joined, [each.at(each.size) for each in fitted]))
        beside = [
            self._at(cause, cause.size, residuals)
            for cause, residuals in zip(larger, self.evaluated(changes), strict=True)
            if residuals is not None
        ]
        return Diagnosis(self.best_of(explaining, [cause for cause in beside if cause.explains]), None, len(tried))

    def best_of(self, named: Sequence[Cause], others: Sequence[Cause] = ()) -> Cause:
        """Return the best of the ``named`` causes, with all causes that the recordings cannot distinguish from it.

        These have about the same gain, or differ by no more than the engine errs. ``others`` explain the recordings
        only together with usual sensor errors, and are listed last.
        """
        best = max(named, key=lambda cause: cause.gain)
        alone = {cause.name for cause in named}
        alike = [
            cause
            for cause in (*named, *others)
            for apart in (cause.residuals.errors - best.residuals.errors,)
            if cause.gain > best.gain - self.penalty or float(apart @ apart) <= self.of_engine
        ]
        # Of those that the recordings cannot tell apart, numbers of the set come first.
        first, *rest = sorted(
            alike,
            key=lambda cause: (cause.name not in alone, not cause.at(cause.size).numbers, -cause.gain),
        )
        # Without the cause, a delay stands for a part of it.
        return replace(first, same=tuple(rest), delay=self.mended([first])[0].delay)

    def unexplained(self, tried: Sequence[Cause], kinds: str) -> Diagnosis:
        """Return the diagnosis without a cause, with the best of the causes ``tried``, of the ``kinds`` in words."""
        # Wrong samples are seen in themselves, whatever else is wrong; a misread unit is no hint beside others.
        hinting = [cause for cause in tried if not cause.is_of_unit and (cause.gain > 0.0 or cause.is_of_samples)]
        hints = sorted(
            self.mended(hinting),
            # Of those that leave the same, numbers of the set come first.
            key=lambda cause: (not cause.is_of_samples, float(f"{cause.left:.2g}"), not cause.numbers, cause.left),
        )
        alike = [hint for hint in hints if hint.is_of_samples == hints[0].is_of_samples][:_NAMED]
        nearest = replace(alike[0], same=tuple(alike[1:])) if alike else None
        return Diagnosis(nearest=nearest, tried=len(tried), kinds=kinds)

    def mended(self, causes: Sequence[Cause]) -> list[Cause]:
        """Return each cause with the delay and the largest RMS error [noise] that a validation finds once it is mended.

        The common delay is by its rule: none at its limit, and none beside a cause that is a delay itself.
        """
        found = []
        for cause, replays in zip(causes, self._replays([cause.at(cause.size) for cause in causes]), strict=True):
            change = cause.at(cause.size)
            agreements = []
            for record, request, replayed in replays:
                recording = request.measured.recording
                for name, sensor in change.sensors.items():
                    if sensor.delay and name in recording:
                        values = np.interp(recording.time + sensor.delay, recording.time, recording[name])
                        recording = recording.with_channel(name, values, recording.unit(name))
                in_step = replace(request.measured, recording=recording)
                corrected = replace(request, measured=in_step, settings=record.agreement.request.settings)
                agreements.append(agreement_of(corrected, replayed, change.delay))
            delay = 0.0 if change.has_delay else max(agreement.delay for agreement in agreements)
            left = max(channel.in_noise for agreement in agreements for channel in agreement.channels)
            # Wrong samples are left out of the errors of the search alone.
            found.append(replace(cause, left=cause.left if cause.is_of_samples else left, delay=delay))
        return found


def _request(record: Record, change: ModelChange) -> Replay:
    """Return the replay of a corrected recording on the changed device. Raises PpafoError for an invalid device.

    Without its faulty samples a channel starts from the mean of the valid ones, or from the share of its range that the
    change states.
    """
    request = record.agreement.request
    measured = request.measured
    device = request.device
    settings = request.settings
    recording = measured.recording
    initial = dict(settings.initial)
    for name, sensor in change.sensors.items():
        if name in recording:
            values = sensor.true(recording[name])
            values = np.clip(values, -1.0, 1.0) if name == COMMAND else values
            recording = recording.with_channel(name, values, recording.unit(name))
    if change.is_swapped:
        swapped = {name: recording.channels[of] for name, of in SWAPPED.items()}
        recording = replace(recording, channels={**recording.channels, **swapped})
    if change.clock != 1.0:
        recording = at_rate(recording, change.clock)
    if change.start is not None:
        actuator = device.actuator
        supply = device.supply
        count = samples_at_rest(measured.recording)
        for name, values, good in zip(record.channels, record.values * record.noise[:, None], record.good, strict=True):
            valid = values[:count][good[:count] > 0.0]
            if name in SENSORS and len(valid) < count:
                stops = (actuator.angle_min, actuator.angle_max)
                highest = max(supply.pressure, supply.dorsiflexion_pressure)
                low, high = stops if name == ANGLE else (supply.atmospheric_pressure, highest)
                initial.setdefault(name, float(valid.mean()) if len(valid) else low + change.start * (high - low))
    started = replace(settings, initial=initial, motion=change.motion or settings.motion)
    request = replay_of(replace(measured, recording=recording), device, started)
    device = replace(request.device, effects={**request.device.effects, **change.effects})
    if change.numbers:
        scenario = replace(replayed_scenario(request), device=device)
        device = with_numbers(scenario, change.numbers).device
        for _, (is_bad, line) in contradictions(device):
            if is_bad:
                raise ParameterError(line(0))
    # Stops that a change moves hold the joint from the start.
    angle = min(max(request.start.angle, device.actuator.angle_min), device.actuator.angle_max)
    return replace(request, device=device, start=replace(request.start, angle=angle))


def _bounded(causes: Sequence[Cause], errors: Floats) -> list[Cause]:
    """Return each cause with its most likely magnitude within its usual limit, from a linear fit of their slopes.

    Each usual limit acts as a prior, so that a magnitude on which the errors carry no information stays small. A cause
    with an infinite usual magnitude is not bounded.
    """
    limits = np.array([cause.usual for cause in causes])
    # In units of its limit, or of its slope, each has one size, whatever its own unit is.
    norms = np.array([max(float(np.linalg.norm(cause.slope)), _SMALLEST) for cause in causes])
    scales = np.where(np.isfinite(limits), limits, 1.0 / norms)
    limits = np.where(np.isfinite(limits), 1.0, math.inf)
    columns = np.stack([cause.slope for cause in causes], axis=1) * scales
    prior = np.diag(np.where(np.isfinite(limits), 1.0 / deviation_of_limit(1.0), 0.0))
    rows = np.concatenate([columns, prior])
    right_side = np.concatenate([-errors, np.zeros(len(limits))])
    sizes = (lsq_linear(rows, right_side, (-limits, limits)).x * scales).tolist()
    return [replace(cause, size=size) for cause, size in zip(causes, sizes, strict=True)]
