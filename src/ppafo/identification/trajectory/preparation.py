"""Makes an experiment ready for fitting: its samples with their noise, and one clock for all columns.

The step stays as it is during the search. The parts in which the engine does it follow the numbers, though, and
any other choice of them moves a run a little. Runs of a fit are allowed so little error that differences hardly see it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.replay import StepInputs
from ppafo.engine.run import Run
from ppafo.errors import IdentificationError
from ppafo.identification.trajectory.experiment import Experiment, scenario_of, with_numbers
from ppafo.simulation.plan import plan_run
from ppafo.simulation.recorded.inputs import ANGLE, RecordedInputs, step_inputs, with_prescribed_angle
from ppafo.simulation.scenario import FreeMotion, Scenario

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

MINIMUM_SAMPLES = 10
FIT_TOLERANCE = 0.02
"""Error that a run of a fit is allowed over that of any other run; columns of differences keep to 1e-3 with it."""
_FINER = 0.25
_FITS = 1.0e-6
_SPREAD_OF_MEDIAN = 1.4826
_KEPT = 3.0
_SHARE_OF_KEPT = 0.98658
"""Standard deviation of a normal distribution cut at 3 standard deviations, over that of the whole."""

_READ_INTERVAL = 5.0e-5
"""Seconds between two records that samples lie in between: a chamber fills within milliseconds ..."""
_MAXIMUM_RECORDS = 100_000
"""... and more where a recording is so long that memory would run out."""

_GAIN_OF_DIFFERENCES = math.sqrt(20.0)
"""Standard deviation of the third difference of white noise over that of the noise."""


@dataclass(frozen=True, slots=True)
class Measured:
    """One channel of an experiment: samples [rad] or [Pa] and the standard deviation of their noise."""

    name: str
    values: Floats
    noise: float


@dataclass(frozen=True, slots=True)
class Samples:
    """What a run is compared with: times [s] of the run, channels, and how far [s] a fitted offset may move them."""

    time: Floats
    channels: tuple[Measured, ...]
    reach: float = 0.0


@dataclass(frozen=True, slots=True)
class PreparedExperiment:
    """An experiment by its label, with its scenario completed and its samples placed in the record of a run.

    ``run`` has the step and the clock of all columns; a sample is ``fraction`` [-] of the way from record ``place`` to
    the next. ``inputs`` are what the run follows at each step, made of what ``recorded`` has; None where it follows
    nothing. ``time_offset`` [s] is how much later the samples are than the run, where it is not fitted.
    """

    label: str
    scenario: Scenario
    run: Run
    samples: Samples
    place: Indices
    fraction: Floats
    recorded: RecordedInputs | None = None
    inputs: StepInputs | None = None
    time_offset: float = 0.0

    @property
    def time(self) -> Floats:
        """Times of the samples in the time of the run [s]."""
        return self.samples.time

    @property
    def channels(self) -> tuple[Measured, ...]:
        """The channels that are compared."""
        return self.samples.channels

    @property
    def record_interval(self) -> float:
        """Time between two records of the run [s]."""
        return self.run.step * self.run.record_every


def prepare(experiment: Experiment, numbers: Mapping[str, float], reach: float = 0.0) -> PreparedExperiment:
    """Return the experiment made ready.

    ``numbers`` by path are the start values; ``reach`` [s] is the largest time offset that is tried.
    IdentificationError for a recording with too few samples or a channel whose noise is unknown.
    """
    recording, said = experiment.recording, f"experiment '{experiment.label}'"
    inside = recording.time >= experiment.start - _FITS
    time = np.maximum(recording.time[inside] - experiment.start, 0.0)
    if time.size < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{said}: {recording.label} has {time.size} samples after {experiment.start:g} s, "
            f"at least {MINIMUM_SAMPLES} are needed"
        )
    channels = tuple(_measured_channel(experiment, name, inside) for name in experiment.channels)
    scenario = replace(scenario_of(experiment), duration=float(time[-1]) + reach)
    recorded = RecordedInputs(recording, experiment.inputs, experiment.start) if experiment.inputs else None
    return _plan(experiment.label, scenario, Samples(time, channels, reach), numbers, recorded)


def prepare_times(label: str, scenario: Scenario, samples: Samples, numbers: Mapping[str, float]) -> PreparedExperiment:
    """Return samples of a scenario's run made ready, at ``numbers`` [SI] by path."""
    return _plan(label, scenario, samples, numbers, None)


def with_half_steps(prepared: PreparedExperiment, numbers: Mapping[str, float]) -> PreparedExperiment:
    """Return the experiment at ``numbers`` [SI] with steps half as long and a quarter of the allowed error."""
    scenario = replace(prepared.scenario, time_step=0.5 * prepared.run.step)
    run = plan_run(with_numbers(scenario, numbers))
    return _place_samples(prepared, replace(run, tolerance=_FINER * prepared.run.tolerance))


def noise_of(values: Floats) -> float:
    """Return the standard deviation of white noise [unit of the signal], from third differences that are not unusual.

    What the signal itself does between four samples counts as noise where it is larger; a few jumps do not matter.
    """
    if values.size < MINIMUM_SAMPLES:
        return 0.0
    differences = np.abs(np.diff(values, n=3))
    most = _KEPT * _SPREAD_OF_MEDIAN * float(np.median(differences))
    inner = differences[differences <= most]
    return float(np.sqrt(np.mean(inner * inner)) / _SHARE_OF_KEPT / _GAIN_OF_DIFFERENCES)


def _plan(
    label: str,
    scenario: Scenario,
    samples: Samples,
    numbers: Mapping[str, float],
    recorded: RecordedInputs | None,
) -> PreparedExperiment:
    run = replace(plan_run(with_numbers(scenario, numbers)), tolerance=FIT_TOLERANCE)
    nowhere = np.zeros(samples.time.size)
    return _place_samples(
        PreparedExperiment(label, scenario, run, samples, nowhere.astype(np.intp), nowhere, recorded), run
    )


def _place_samples(prepared: PreparedExperiment, run: Run) -> PreparedExperiment:
    """Return the samples placed in a record of a run that is no finer than they need."""
    samples, recorded = prepared.samples, prepared.recorded
    every = _steps_between_samples(samples, run.step)
    records = math.ceil((float(samples.time[-1]) + samples.reach) / (run.step * every) - _FITS)
    position = samples.time / (run.step * every)
    place = np.minimum(np.floor(position + _FITS), records).astype(np.intp)
    fraction = np.maximum(position - place, 0.0)
    fraction[fraction < _FITS] = 0.0
    frozen = replace(run, record_every=every, step_count=math.ceil(records * every - _FITS), needs_parts=True)
    if recorded is not None and recorded.has(ANGLE) and isinstance(prepared.scenario.motion, FreeMotion):
        frozen = with_prescribed_angle(frozen, prepared.scenario.motion.angle)
    inputs = None if recorded is None else step_inputs(recorded, prepared.scenario.device, frozen)
    return replace(prepared, run=frozen, place=place, fraction=fraction, inputs=inputs)


def _steps_between_samples(samples: Samples, step: float) -> float:
    """Return the steps between two records: as many as between two samples, fewer where these are read in between.

    A fraction of a step where a whole one is too long to be read in between.
    """
    every = max(1, round(float(np.min(np.diff(samples.time))) / step))
    position = samples.time / (step * every)
    is_aligned = bool(np.all(np.abs(position - np.round(position)) < _FITS * np.maximum(position, 1.0)))
    if is_aligned and samples.reach == 0.0:
        return every
    most = _read_interval(samples) / step * (1.0 + _FITS)
    if most < 1.0:
        return 1.0 / math.ceil(1.0 / most)
    return max(count for count in range(1, int(most) + 1) if every % count == 0) if is_aligned else int(most)


def _read_interval(samples: Samples) -> float:
    """Return the longest time [s] between two records that are read at any time."""
    return max(_READ_INTERVAL, float(samples.time[-1]) / _MAXIMUM_RECORDS)


def _measured_channel(experiment: Experiment, name: str, inside: NDArray[np.bool_]) -> Measured:
    values = experiment.recording[name][inside]
    noise = experiment.noise[name] if name in experiment.noise else noise_of(values)
    if not noise > 0.0:
        raise IdentificationError(
            f"experiment '{experiment.label}': channel '{name}' shows no noise from sample to sample, so its weight is "
            f"unknown: give its standard deviation in noise, for example from the sensor's data sheet"
        )
    return Measured(name, values, noise)
