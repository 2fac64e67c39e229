"""Experiments prepared for fitting, and their runs: residuals of all recordings at many points, in one batch.

Each experiment is one batch of runs, one per point. All runs of a batch share one time step, fixed during the search.
The error tolerance of the runs is so small that it hardly affects finite differences.
"""

import math
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from ppafo.engine.lanes import run_batch
from ppafo.engine.replay import StepInputs, replay
from ppafo.engine.rows import leaves, rebuilt
from ppafo.engine.run import NEVER_FAILED, Run, batches_of, state_row_numbers
from ppafo.engine.scheme.actuators import pressures_of
from ppafo.engine.scheme.pneumatics import supply_range
from ppafo.errors import IdentificationError
from ppafo.identification.least_squares import ResidualBlock
from ppafo.identification.trajectory.experiment import (
    GAIN_OF,
    LAG_OF,
    TIME_OFFSET,
    ZERO_OF,
    FitNumber,
    FittedExperiment,
    scenario_of,
    with_numbers,
)
from ppafo.model.catalog import VALVES
from ppafo.model.columns import at, over_runs
from ppafo.parameters.device import Device
from ppafo.parameters.effects import switches_of
from ppafo.signals.faults import MINIMUM_SAMPLES, is_at_limit, noise_of, plateaus, resolution_of, rounding_of
from ppafo.simulation.plan import plan_run
from ppafo.simulation.recorded.channels import ANGLE, DORSIFLEXION_SUPPLY, SUPPLY, sample_period
from ppafo.simulation.recorded.inputs import RecordedInputs, step_inputs, with_prescribed_angle
from ppafo.simulation.scenario import FreeMotion, Scenario

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

FIT_TOLERANCE = 0.02
"""Error tolerance of a run of a fit, relative to a normal run [-]; finite differences are then accurate to 1e-3."""
_FINER = 0.25
"""Relative tolerance [-] of the finer runs by which the integration error is estimated."""
_FITS = 1.0e-6
"""Rounding tolerance of sample times, as a fraction of a record interval [-], and in seconds."""

_ZERO_OF_ANGLE = math.radians(1.0)
"""Largest distance of a reading from a stop [rad] at which the vane counts as resting at the stop."""

_READ_INTERVAL = 5.0e-5
"""Record interval for interpolation at samples [s]; a chamber fills within milliseconds."""
_MAXIMUM_RECORDS = 100_000
"""Largest number of records, above which the record interval is lengthened to limit memory."""


@dataclass(frozen=True, slots=True)
class FitChannel:
    """Channel of an experiment: samples [rad] or [Pa], and their noise floor."""

    name: str
    values: Floats
    floor: float = 0.0


@dataclass(frozen=True, slots=True)
class PreparedExperiment:
    """Experiment prepared for fitting: completed scenario, planned run, and samples located between its records.

    ``time`` has the sample times in the run [s]; a fitted offset may shift them by up to ``reach`` [s]. ``run`` has the
    time step and clock of all runs. A sample lies a ``fraction`` [-] of the interval after the record ``before``.
    ``inputs`` are the inputs at each step, computed from ``recorded``; None without recorded inputs.
    """

    label: str
    scenario: Scenario
    run: Run
    time: Floats
    channels: tuple[FitChannel, ...]
    reach: float
    before: Indices
    fraction: Floats
    recorded: RecordedInputs | None = None
    inputs: StepInputs | None = None


def prepare(experiment: FittedExperiment, numbers: Mapping[str, float], reach: float = 0.0) -> PreparedExperiment:
    """Return an experiment prepared for fitting.

    ``numbers`` are the start values by path; ``reach`` [s] is the largest time offset that may be tried. Raises
    IdentificationError for a recording with too few samples or a saturated sensor.
    """
    recording, where = experiment.recording, f"experiment '{experiment.label}'"
    inside = recording.time >= experiment.start - _FITS
    # Rounding may put the first sample just before the start.
    time = np.maximum(recording.time[inside] - experiment.start, 0.0)
    if time.size < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{where}: {recording.label} has {time.size} samples from the start at {experiment.start:g} s on, but "
            f"needs at least {MINIMUM_SAMPLES}"
        )
    channels = [
        FitChannel(name, recording[name][inside], experiment.noise.get(name, 0.0)) for name in experiment.channels
    ]
    actuator = experiment.scenario.device.actuator
    stops = actuator.angle_min, actuator.angle_max
    for channel in channels:
        clipped = max(plateaus(channel.values), key=lambda plateau: plateau.count)
        # With a coarse converter, a vane that rests at its stop repeats one value without saturation of the sensor.
        rests = channel.name == ANGLE and any(abs(clipped.value - stop) < _ZERO_OF_ANGLE for stop in stops)
        has_noise = channel.floor > 0.0 or noise_of(channel.values) > 0.0
        if is_at_limit(channel.values, clipped) and not (rests or has_noise):
            raise IdentificationError(
                f"{where}: channel '{channel.name}' stays at its {clipped.word} value for {clipped.count} of "
                f"{channel.values.size} samples: the sensor is probably saturated; else give its noise"
            )
    scenario = scenario_of(experiment)
    scenario = replace(scenario, run=replace(scenario.run, duration=float(time[-1]) + reach))
    recorded = RecordedInputs(recording, experiment.inputs, experiment.start) if experiment.inputs else None
    return prepare_samples(experiment.label, scenario, time, channels, reach, numbers, recorded)


def prepare_samples(
    label: str,
    scenario: Scenario,
    time: Floats,
    channels: Sequence[FitChannel],
    reach: float,
    numbers: Mapping[str, float],
    recorded: RecordedInputs | None = None,
) -> PreparedExperiment:
    """Return a prepared experiment from samples, at ``numbers`` [SI], with time offsets up to ``reach`` [s]."""
    run = replace(plan_run(with_numbers(scenario, numbers)), tolerance=FIT_TOLERANCE)
    unlocated = np.zeros(time.size)
    before = unlocated.astype(np.intp)
    prepared = PreparedExperiment(label, scenario, run, time, tuple(channels), reach, before, unlocated, recorded)
    return _locate_samples(prepared, run)


def _locate_samples(prepared: PreparedExperiment, run: Run) -> PreparedExperiment:
    """Locate the samples of an experiment between records that are no finer than needed."""
    time, recorded = prepared.time, prepared.recorded
    every = _steps_between_samples(time, prepared.reach, run.step)
    records = math.ceil((float(time[-1]) + prepared.reach) / (run.step * every) - _FITS)
    position = time / (run.step * every)
    before = np.minimum(np.floor(position + _FITS), records).astype(np.intp)
    fraction = np.maximum(position - before, 0.0)
    # Rounding of the clock must not make a sample lie between two records.
    fraction[fraction < _FITS] = 0.0
    frozen = replace(run, record_every=every, step_count=math.ceil(records * every - _FITS), needs_parts=True)
    if recorded is not None and ANGLE in recorded.names and isinstance(prepared.scenario.motion, FreeMotion):
        frozen = with_prescribed_angle(frozen, prepared.scenario.motion.angle)
    inputs = None if recorded is None else step_inputs(recorded, prepared.scenario.device, frozen)
    return replace(prepared, run=frozen, before=before, fraction=fraction, inputs=inputs)


def _steps_between_samples(time: Floats, reach: float, step: float) -> float:
    """Return the number of steps between records: a sample interval, or less if samples must be interpolated.

    The result is a fraction of a step if a whole step is too long for interpolation.
    """
    every = max(1, round(float(np.min(np.diff(time))) / step))
    position = time / (step * every)
    is_aligned = bool(np.all(np.abs(position - np.round(position)) < _FITS * np.maximum(position, 1.0)))
    if is_aligned and reach == 0.0:
        return every
    read_interval = max(_READ_INTERVAL, float(time[-1]) / _MAXIMUM_RECORDS)
    most = read_interval / step * (1.0 + _FITS)
    if most < 1.0:
        return 1.0 / math.ceil(1.0 / most)
    return max(count for count in range(1, int(most) + 1) if every % count == 0) if is_aligned else int(most)


def columns_in(label: str, numbers: Sequence[FitNumber], points: Floats) -> dict[str, Floats]:
    """Return the parameters [SI] by path that act in an experiment, at points [SI] (numbers, points)."""
    acting = ((item, row) for item, row in zip(numbers, points, strict=True) if item.acts_in(label))
    return {item.path: np.exp(row) if item.is_logarithm else row for item, row in acting}


def numbers_in(label: str, numbers: Sequence[FitNumber], point: Floats) -> dict[str, float]:
    """Return the parameters [SI] by path that act in an experiment, at one point [SI] (numbers,)."""
    return {path: float(row[0]) for path, row in columns_in(label, numbers, point[:, None]).items()}


def signals_of(
    experiments: Sequence[PreparedExperiment], numbers: Sequence[FitNumber], points: Floats
) -> list[dict[str, Floats]]:
    """Return the channels of each experiment [SI] (samples, points) at points [SI] (numbers, points).

    A failed run is NaN throughout. Experiments run in parallel, one thread each.
    """
    columns = [columns_in(prepared.label, numbers, points) for prepared in experiments]
    arguments = experiments, columns, [points.shape[1]] * len(experiments)
    workers = min(len(experiments), os.cpu_count() or 1)
    if workers == 1:
        return list(map(signals_at, *arguments))
    # Threads run at the same time, because compiled runs release the lock of the interpreter.
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(signals_at, *arguments))


def residuals_of(experiments: Sequence[PreparedExperiment], numbers: Sequence[FitNumber], points: Floats) -> Floats:
    """Return residuals, measured - model [SI] (samples of all channels, points), at points [SI] (numbers, points)."""
    signals = signals_of(experiments, numbers, points)
    return np.concatenate(
        [
            channel.values[:, None] - modelled[channel.name]
            for prepared, modelled in zip(experiments, signals, strict=True)
            for channel in prepared.channels
        ]
    )


def blocks_of(
    experiments: Sequence[PreparedExperiment], numbers: Sequence[FitNumber], point: Floats
) -> tuple[ResidualBlock, ...]:
    """Return the residual rows of each channel of each recording, with noise floor and integration error.

    The floor is the given noise, the integration error or the rounding of the converter, whichever is largest. The
    integration error is not independent noise: all samples of a recording share it.
    """
    blocks, first = [], 0
    coarse = signals_of(experiments, numbers, point[:, None])
    # The error is nearly proportional to the tolerance, so that finer runs show most of the error.
    halved = []
    for prepared in experiments:
        scenario = replace(prepared.scenario, run=replace(prepared.scenario.run, step=0.5 * prepared.run.step))
        run = plan_run(with_numbers(scenario, numbers_in(prepared.label, numbers, point)))
        halved.append(_locate_samples(prepared, replace(run, tolerance=_FINER * prepared.run.tolerance)))
    fine = signals_of(halved, numbers, point[:, None])
    for prepared, coarse_signals, fine_signals in zip(experiments, coarse, fine, strict=True):
        for channel in prepared.channels:
            error = (fine_signals[channel.name][:, 0] - coarse_signals[channel.name][:, 0]) / (1.0 - _FINER)
            error = error if np.isfinite(error).all() else np.zeros_like(error)
            rounded = rounding_of(channel.values, resolution_of(channel.values))
            floor = np.maximum(max(channel.floor, float(np.sqrt(np.mean(np.square(error))))), rounded)
            last = first + len(channel.values)
            blocks.append(ResidualBlock(prepared.label, channel.name, slice(first, last), floor, error))
            first = last
    return tuple(blocks)


_NUMBERS_OF_RUN = (
    *("plant", "thermal", "initial"),
    *("valve", "command_delay", "lines", "effects", "leg"),
)
"""Fields of a run that depend on the parameters of its scenario; program, clock and prescribed motion do not."""


def run_with(prepared: PreparedExperiment, numbers: Mapping[str, Any]) -> Run:
    """Return the run of an experiment with changed parameters [SI], on the same program and clock.

    A parameter may be an array (runs,). Raises IdentificationError if a valve setting or an effect changes to or from
    0, which would need another program.
    """
    base, scenario = prepared.run, with_numbers(prepared.scenario, numbers)
    _check_same_program(prepared, scenario.device, numbers)
    planned, _ = scenario.motion.motion_kind.plan(scenario)
    # The tolerance is a fraction of the supply pressure: with a fitted pressure, the error in pascals must stay.
    plant = planned.plant
    supply_ranges = over_runs(
        lambda first, second, atmosphere: supply_range(
            plant._replace(supply_pressure=first, dorsiflexion_pressure=second, atmospheric_pressure=atmosphere)
        ),
        *(plant.supply_pressure, plant.dorsiflexion_pressure, plant.atmospheric_pressure),
    )
    tolerance = base.tolerance * (supply_range(base.plant) / supply_ranges)
    return replace(base, tolerance=tolerance, **{name: getattr(planned, name) for name in _NUMBERS_OF_RUN})


def _check_same_program(prepared: PreparedExperiment, device: Device, numbers: Mapping[str, Any]) -> None:
    """Raise IdentificationError if a device with changed parameters needs another program than was prepared.

    A setting of the valve, or a parameter of an effect, that changes to or from 0 selects another model. ``numbers``
    are the changed parameters [SI] by path, each a number or an array (runs,).
    """
    program, planned_settings = prepared.run.program, prepared.scenario.device.valve.settings
    settings: Mapping[str, Any] = device.valve.settings
    fitted = {path.rpartition(".")[2] for path in numbers if path.startswith(("valve.", "valves."))}
    kind = VALVES[device.valve.kind]
    for run in range(max((value.size for value in settings.values() if isinstance(value, np.ndarray)), default=1)):
        values = {name: at(value, run) for name, value in settings.items()}
        of_run = kind.settings(**values)
        if kind.choose(of_run) != program.valve or (program.valve.command_delay(of_run) > 0.0) != program.late_commands:
            switched = [name for name in values if name in fitted and 0.0 in (values[name], planned_settings[name])]
            raise IdentificationError(
                f"experiment '{prepared.label}': the fit changed {' or '.join(f'valve.{name}' for name in switched)} "
                "to or from 0, which changes the valve model; give a start and a lower bound above 0"
            )
    if any(np.any(is_on != (effect in program.effects)) for effect, is_on in switches_of(device).items()):
        raise IdentificationError(
            f"experiment '{prepared.label}': the fit changed a parameter of an effect to or from 0, which changes the "
            "model; give this parameter a start and a lower bound above 0"
        )


def signals_at(prepared: PreparedExperiment, columns: Mapping[str, Floats], count: int) -> dict[str, Floats]:
    """Return the channels [SI] (samples, runs) of one experiment for ``count`` runs with parameters [SI] by path.

    Runs that differ only in zeros, gains and lags of compared sensors are simulated once. A pressure sensor reads gauge
    pressure.
    """
    of_sensors = {f"{kind}{channel.name}" for channel in prepared.channels for kind in (ZERO_OF, GAIN_OF, LAG_OF)}
    errors = {path: column for path, column in columns.items() if path in of_sensors}
    running = {path: column for path, column in columns.items() if path not in errors}
    table = np.array([np.broadcast_to(column, (count,)) for column in running.values()]).reshape(-1, count)
    _, first, run_of = np.unique(table, axis=1, return_index=True, return_inverse=True)
    distinct = {path: np.broadcast_to(column, (count,))[first] for path, column in running.items()}
    signals = _with_inputs(prepared, distinct, len(first))
    atmosphere = prepared.scenario.device.supply.atmospheric_pressure
    for name, values in signals.items():
        rest = 0.0 if name == ANGLE else atmosphere
        gain, zero = (np.asarray(errors.get(f"{path}{name}", 0.0)) for path in (GAIN_OF, ZERO_OF))
        read = values[:, run_of.ravel()]
        if (lags := errors.get(f"{LAG_OF}{name}")) is not None:
            read = _lagging(read, np.broadcast_to(lags, (count,)), sample_period(prepared.time))
        signals[name] = rest + (1.0 + gain) * (read - rest) + zero
    return signals


def _lagging(values: Floats, lags: Floats, interval: float) -> Floats:
    """Return samples (samples, runs) behind first-order lags [s] (runs,): exact for straight lines between samples.

    A lag below 0 adds what the same lag above 0 takes away, so that a search can pass 0.
    """
    lagging = values.copy()
    for lag in np.unique(lags[lags != 0.0]).tolist():
        runs, left = lags == lag, math.exp(-interval / abs(lag))
        straight = abs(lag) / interval * (1.0 - left)
        from_start = values[:, runs] - values[:1, runs]
        behind = lfilter([1.0 - straight, straight - left], [1.0, -left], from_start, axis=0) - from_start
        lagging[:, runs] += math.copysign(1.0, lag) * behind
    return lagging


def _with_inputs(prepared: PreparedExperiment, columns: Mapping[str, Floats], count: int) -> dict[str, Floats]:
    """Return ideal sensor signals; runs with different zero errors of recorded inputs form separate batches."""
    zeros = {path: column for path, column in columns.items() if path.startswith(ZERO_OF)}
    others = {path: column for path, column in columns.items() if path not in zeros}
    if not zeros or prepared.inputs is None:
        return _run_signals(prepared, others, count)
    distinct, group = np.unique(np.array(list(zeros.values())), axis=1, return_inverse=True)
    signals: dict[str, Floats] = {}
    for number, values_of_group in enumerate(distinct.T.tolist()):
        members = np.flatnonzero(group.ravel() == number)
        zero_of = {path.removeprefix(ZERO_OF): zero for path, zero in zip(zeros, values_of_group, strict=True)}
        # Zero errors [rad], [Pa] are subtracted from recorded inputs; one sensor may measure both inlets.
        both = zero_of.get(SUPPLY, 0.0)
        offsets = {
            "path.level": zero_of.get(ANGLE, 0.0),
            "plant.supply_pressure": both,
            "plant.dorsiflexion_pressure": zero_of.get(DORSIFLEXION_SUPPLY, both),
        }
        corrected = {path: values - offsets.get(path, 0.0) for path, values in prepared.inputs.parameters.items()}
        inputs = StepInputs(prepared.inputs.command, corrected)
        of_group = {path: column[members] for path, column in others.items()}
        for name, values in _run_signals(replace(prepared, inputs=inputs), of_group, len(members)).items():
            signals.setdefault(name, np.empty((len(values), count)))[:, members] = values
    return signals


def _run_signals(prepared: PreparedExperiment, columns: Mapping[str, Floats], count: int) -> dict[str, Floats]:
    """Return the signals of ideal sensors [SI] (samples, runs)."""
    run = run_with(prepared, columns)
    rows = state_row_numbers(run)
    channel_rows = [rows[f"state.{name}"] for name in ("angle", "mass_1", "mass_2")]
    records: Floats | None = None
    failed = np.zeros(count, dtype=np.bool_)
    # A program has up to 32 lanes; more runs are several batches.
    for members, batch in batches_of(run, count):
        outcome = run_batch(batch, threads=1) if prepared.inputs is None else replay(batch, prepared.inputs)
        ends = outcome.states
        # A failed run, or one with states that are no numbers, has no residuals.
        failed[members] = (ends[rows["result.failure_time"]] < NEVER_FAILED) | ~np.isfinite(ends).all(axis=0)
        if records is None:
            records = np.empty((len(channel_rows), len(outcome.record), count))
        for record, row in zip(records, channel_rows, strict=True):
            record[:, members] = outcome.record[:, row]
    assert records is not None
    offsets = np.broadcast_to(columns.get(TIME_OFFSET, np.array(0.0)), (count,))
    angle, mass_1, mass_2 = (_at_samples(record, prepared, offsets) for record in records)
    signals = {name: np.full(angle.shape, np.nan) for name in ("angle", "pressure_1", "pressure_2")}
    numbers = leaves(run.plant)
    # Pressures follow from mass and angle by the plant, whose numbers differ from run to run.
    for element in np.flatnonzero(~failed).tolist():
        plant = rebuilt(run.program.actuator.plant, [at(number, element) for number in numbers])
        states = angle[:, element], mass_1[:, element], mass_2[:, element]
        pressure_1, pressure_2 = pressures_of(run.program.actuator, plant, *states)
        signals["angle"][:, element] = angle[:, element]
        signals["pressure_1"][:, element], signals["pressure_2"][:, element] = pressure_1, pressure_2
    return {channel.name: signals[channel.name] for channel in prepared.channels}


def _at_samples(values: Floats, prepared: PreparedExperiment, offsets: Floats) -> Floats:
    """Return a state at the sample times, interpolated linearly between records; each run has its time offset [s]."""
    if offsets.any():
        # Before the first record the device stands still.
        interval = prepared.run.step * prepared.run.record_every
        position = np.clip((prepared.time[:, None] - offsets) / interval, 0.0, len(values) - 1.0)
        before = np.minimum(position.astype(np.intp), len(values) - 2)
        elements = np.arange(len(offsets))
        previous, following = values[before, elements], values[before + 1, elements]
        return np.asarray(previous + (position - before) * (following - previous))
    previous = values[prepared.before]
    if not prepared.fraction.any():
        return previous
    following = values[np.minimum(prepared.before + 1, len(values) - 1)]
    return np.asarray(previous + prepared.fraction[:, None] * (following - previous))
