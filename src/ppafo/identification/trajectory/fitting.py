"""Trajectory fit: simulated runs as residuals of the common estimator, and results as estimates of the device.

Each experiment is one batch of runs, one per point of the search. All runs of a batch share one time step, fixed during
the search; their error tolerance is so small that it hardly affects finite differences.
"""

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.signal import lfilter

from ppafo.engine.lanes import run_batch
from ppafo.engine.replay import StepInputs, replay
from ppafo.engine.rows import leaves, rebuilt
from ppafo.engine.run import NEVER_FAILED, Run, batches_of, state_row_numbers
from ppafo.engine.scheme.actuators import pressures_of
from ppafo.engine.scheme.pneumatics import supply_range
from ppafo.errors import IdentificationError, refused_as
from ppafo.identification.estimate import Estimate, Identified, in_shown_unit
from ppafo.identification.fit import Fit, conflict_in_words, estimate_of
from ppafo.identification.fit import fit as fit_residuals
from ppafo.identification.least_squares import FitNumber, FitRuns, ResidualBlock
from ppafo.identification.noise import Noise, whiten
from ppafo.identification.source import kind_of
from ppafo.identification.trajectory.experiment import (
    GAIN_OF,
    LAG_OF,
    TIME_OFFSET,
    ZERO_OF,
    FittedExperiment,
    TrajectoryProblem,
    broken_rule,
    full_path,
    numbers_of,
    reach_of,
    scenario_of,
    with_numbers,
)
from ppafo.model.columns import at, over_runs
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.faults import (
    MINIMUM_SAMPLES,
    correlated_noise_of,
    is_at_limit,
    noise_of,
    plateaus,
    resolution_of,
    rounding_of,
)
from ppafo.signals.recording import CHANNELS, Channel, Floats, Recording
from ppafo.simulation.plan import plan_run
from ppafo.simulation.recorded.channels import ANGLE, DORSIFLEXION_SUPPLY, SUPPLY, sample_period
from ppafo.simulation.recorded.inputs import RecordedInputs, step_inputs, with_prescribed_angle
from ppafo.simulation.scenario import FreeMotion, Scenario
from ppafo.wording import count_of

_STATIC, _DYNAMIC = "friction.static_torque", "friction.dynamic_torque"
_DEAD_TIMES = "delay", "time_offset"
"""Last words of the paths of dead times."""
_LAGS = 10.0
"""Least increase of the log-likelihood [-] by which lags of sensors are found."""
_WINDOWS, _RUN = (3, 6, 12, 24, 48), 6.0
"""Lengths of runs of residuals [samples], and size of their sum that no white noise has [standard deviations]."""
_FELT = 1.0e-3
"""Least residuals that are tested as bursts [ranges of the samples]; smaller ones are the engine's."""
_BURST = 6.0
"""Ratio of residuals to the noise that lasts [-] from which they are no noise; slow noise has up to 5.5."""
_WHOLE = 1.0e-6
"""Rounding tolerance of the last sample interval, as a fraction of an interval [-]."""

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
class PreparedExperiment:
    """Experiment prepared for fitting: completed scenario, planned run, and samples located between its records.

    ``measured`` has the samples at their times in the run; a fitted offset may shift them by up to ``reach`` [s].
    ``run`` has the time step and clock of all runs. ``floors`` are the least noise by channel. ``inputs`` are those of
    each step, computed from ``recorded``; None without recorded inputs.
    """

    scenario: Scenario
    run: Run
    measured: Recording
    floors: Mapping[str, float]
    reach: float
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
    channels = {name: Channel(recording[name][inside], CHANNELS[name].unit) for name in experiment.channels}
    actuator = experiment.scenario.device.actuator
    stops = actuator.angle_min, actuator.angle_max
    for name, channel in channels.items():
        clipped = max(plateaus(channel.values), key=lambda plateau: plateau.count)
        # With a coarse converter, a vane that rests at its stop repeats one value without saturation of the sensor.
        rests = name == ANGLE and any(abs(clipped.value - stop) < _ZERO_OF_ANGLE for stop in stops)
        has_noise = name in experiment.noise or noise_of(channel.values) > 0.0
        if is_at_limit(channel.values, clipped) and not (rests or has_noise):
            raise IdentificationError(
                f"{where}: channel '{name}' stays at its {clipped.word} value for {clipped.count} of "
                f"{channel.values.size} samples: the sensor is probably saturated"
            )
    scenario = scenario_of(experiment)
    scenario = replace(scenario, run=replace(scenario.run, duration=float(time[-1]) + reach))
    recorded = RecordedInputs(recording, experiment.inputs, experiment.start) if experiment.inputs else None
    measured = Recording(experiment.label, time, channels, kind=recording.kind)
    return prepare_samples(scenario, measured, experiment.noise, reach, numbers, recorded)


def prepare_samples(
    scenario: Scenario,
    measured: Recording,
    floors: Mapping[str, float],
    reach: float,
    numbers: Mapping[str, float],
    recorded: RecordedInputs | None = None,
) -> PreparedExperiment:
    """Return a prepared experiment from samples, at ``numbers`` [SI], with time offsets up to ``reach`` [s]."""
    run = replace(plan_run(with_numbers(scenario, numbers)), tolerance=FIT_TOLERANCE)
    return _with_run(PreparedExperiment(scenario, run, measured, floors, reach, recorded), run)


def _with_run(prepared: PreparedExperiment, run: Run) -> PreparedExperiment:
    """Return an experiment with a run whose records are no finer than the samples need."""
    time, recorded = prepared.measured.time, prepared.recorded
    every = _steps_between_samples(time, prepared.reach, run.step)
    records = math.ceil((float(time[-1]) + prepared.reach) / (run.step * every) - _FITS)
    frozen = replace(run, record_every=every, step_count=math.ceil(records * every - _FITS), needs_parts=True)
    if recorded is not None and ANGLE in recorded.names and isinstance(prepared.scenario.motion, FreeMotion):
        frozen = with_prescribed_angle(frozen, prepared.scenario.motion.angle)
    inputs = None if recorded is None else step_inputs(recorded, prepared.scenario.device, frozen)
    return replace(prepared, run=frozen, inputs=inputs)


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
    columns = [columns_in(prepared.measured.label, numbers, points) for prepared in experiments]
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
            prepared.measured[name][:, None] - modelled[name]
            for prepared, modelled in zip(experiments, signals, strict=True)
            for name in prepared.measured.names
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
        run = plan_run(with_numbers(scenario, numbers_in(prepared.measured.label, numbers, point)))
        halved.append(_with_run(prepared, replace(run, tolerance=_FINER * prepared.run.tolerance)))
    fine = signals_of(halved, numbers, point[:, None])
    for prepared, coarse_signals, fine_signals in zip(experiments, coarse, fine, strict=True):
        for name in prepared.measured.names:
            samples = prepared.measured[name]
            error = (fine_signals[name][:, 0] - coarse_signals[name][:, 0]) / (1.0 - _FINER)
            error = error if np.isfinite(error).all() else np.zeros_like(error)
            rounded = rounding_of(samples, resolution_of(samples))
            floor = max(prepared.floors.get(name, 0.0), float(np.sqrt(np.mean(np.square(error)))))
            last = first + len(samples)
            rows = slice(first, last)
            blocks.append(ResidualBlock(prepared.measured.label, name, rows, np.maximum(floor, rounded), error))
            first = last
    return tuple(blocks)


_NUMBERS_OF_RUN = (
    *("plant", "thermal", "initial"),
    *("valve", "command_delay", "lines", "effects", "leg"),
)
"""Fields of a run that depend on the parameters of its scenario; program, clock and prescribed motion do not."""


def run_with(prepared: PreparedExperiment, numbers: Mapping[str, Any]) -> Run:
    """Return the run of an experiment with changed parameters [SI], on the same program and clock.

    A parameter may be an array (runs,). No number goes to or from 0, which would need another program.
    """
    base, scenario = prepared.run, with_numbers(prepared.scenario, numbers)
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


def signals_at(prepared: PreparedExperiment, columns: Mapping[str, Floats], count: int) -> dict[str, Floats]:
    """Return the channels [SI] (samples, runs) of one experiment for ``count`` runs with parameters [SI] by path.

    Runs that differ only in zeros, gains and lags of compared sensors are simulated once. A pressure sensor reads gauge
    pressure.
    """
    of_sensors = {f"{kind}{name}" for name in prepared.measured.names for kind in (ZERO_OF, GAIN_OF, LAG_OF)}
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
            read = _lagging(read, np.broadcast_to(lags, (count,)), sample_period(prepared.measured.time))
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
        inputs = replace(prepared.inputs, parameters=corrected)
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
    return {name: signals[name] for name in prepared.measured.names}


def _at_samples(values: Floats, prepared: PreparedExperiment, offsets: Floats) -> Floats:
    """Return a state at the sample times, interpolated linearly between records; each run has its time offset [s]."""
    position = (prepared.measured.time[:, None] - offsets) / (prepared.run.step * prepared.run.record_every)
    # Before the first record the device stands still.
    position = np.clip(position, 0.0, len(values) - 1.0)
    # Rounding of the clock must not make a sample lie between two records.
    is_moved = bool(offsets.any())
    rounding = 0.0 if is_moved else _FITS
    before = np.minimum(np.floor(position + rounding).astype(np.intp), len(values) - 1 - is_moved)
    fraction = np.maximum(position - before, 0.0)
    fraction[fraction < rounding] = 0.0
    runs = np.arange(len(offsets))
    previous, following = values[before, runs], values[np.minimum(before + 1, len(values) - 1), runs]
    return np.asarray(previous + fraction * (following - previous))


@dataclass(frozen=True, slots=True)
class ChannelFit:
    """Residual statistics of one channel of one experiment, in its SI unit.

    ``noise`` is the estimated standard deviation and ``order`` the order of the autoregression, both common to all
    recordings of the sensor. ``rms`` and ``largest`` are the RMS and largest magnitude of the residuals of this
    recording, ``span`` is the range of its samples.
    """

    experiment: str
    channel: str
    unit: str
    noise: float
    order: int
    rms: float
    largest: float
    span: float


@dataclass(frozen=True, slots=True)
class NuisanceParameter:
    """Uncertain quantity of bench or device (tolerance) [SI]: value and standard error before and after the fit.

    ``widens`` is the unknown whose interval depends most on this quantity, ``share`` the fraction of its variance [-].
    """

    name: str
    unit: str
    before: float
    before_error: float
    after: float
    after_error: float
    widens: str
    share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TrajectoryFit(Identified):
    """Result of a trajectory fit: estimates of the unknowns, and the updated tolerances (``known``).

    ``covariance`` [SI] and ``correlation`` are in the order of ``estimates``. ``channels`` are residual statistics.
    ``models`` are the fitted runs at the sample times and ``measurements`` the samples, both by experiment with the
    time of the run. ``scenarios`` have the fitted values. ``expected`` has the benefit of candidates, best first.
    """

    problem: TrajectoryProblem
    numbers: tuple[FitNumber, ...]
    fit: Fit
    covariance: Floats
    correlation: Floats
    known: tuple[NuisanceParameter, ...]
    channels: tuple[ChannelFit, ...]
    models: tuple[Recording, ...]
    measurements: tuple[Recording, ...]
    scenarios: tuple[Scenario, ...]
    expected: "tuple[ExpectedBenefit, ...]" = ()

    def estimate(self, name: str) -> Estimate:
        """Return the estimate at a path; ``valve.area`` means the valve of the first experiment."""
        return {estimate.path: estimate for estimate in self.estimates}[full_path(name, self.scenarios[0])]


def fit(problem: TrajectoryProblem, report: Report = report_nothing) -> TrajectoryFit:
    """Fit the parameters of a problem to its recordings; each estimate has an interval [SI] and a verdict.

    ``report`` receives the progress. Raises IdentificationError if the problem cannot be simulated.
    """
    numbers = numbers_of(problem)
    # Beside a lag a steep signal says little of other numbers, so it is a tolerance where recordings ask for it, and of
    # a dead time always, which it resembles so much that small residuals would not show it.
    steady = tuple(number for number in numbers if not (number.is_tolerance and number.path.startswith(LAG_OF)))
    if any(not number.is_tolerance and number.path.endswith(_DEAD_TIMES) for number in numbers):
        return _fit_of(problem, numbers, report)
    found = _fit_of(problem, steady, report)
    if len(steady) < len(numbers) and (found.conflict or any(map(_follow_each_other, _residuals_in(found)))):
        report(Progress("trajectory fit: again, with sensors that lag"))
        lagging = _fit_of(problem, numbers, report)
        if lagging.fit.log_likelihood > found.fit.log_likelihood + _LAGS:
            return lagging
    return found


def _residuals_in(found: TrajectoryFit) -> Iterator[Floats]:
    """Yield the residuals [SI] of each channel of each experiment."""
    for measured, model in zip(found.measurements, found.models, strict=True):
        yield from (measured[name] - model[name] for name in measured.names if name in model)


def _follow_each_other(residuals: Floats) -> bool:
    """Return whether the residuals of some part of a recording have one sign, as white noise has not."""
    noise = max(noise_of(residuals), 1.0e-300)
    sums = np.cumsum(residuals, dtype=float)
    return any(
        float(np.abs(sums[width:] - sums[:-width]).max(initial=0.0)) > _RUN * noise * math.sqrt(width)
        for width in _WINDOWS
    )


def _fit_of(problem: TrajectoryProblem, numbers: tuple[FitNumber, ...], report: Report) -> TrajectoryFit:
    """Return the fit of some numbers of a problem; those that are left out stay at their start values."""
    start = np.array([number.start for number in numbers])
    rows = {(item.path, item.recordings): row for row, item in enumerate(numbers) if not item.is_tolerance}
    sought = list(numbers)
    for (path, labels), row in rows.items():
        dynamic = rows.get((_DYNAMIC, labels))
        if path == _STATIC and dynamic is not None and math.isinf(numbers[row].deviation):
            sought[row] = _excess(numbers[row], numbers[dynamic])
    runs = []
    for experiment in problem.experiments:
        reach = reach_of([number for number in numbers if number.acts_in(experiment.label)])
        runs.append(prepare(experiment, numbers_in(experiment.label, numbers, start), reach))
    report(Progress(f"trajectory fit: {len(numbers)} numbers, {len(runs)} recordings"))
    blocks = blocks_of(runs, numbers, start)
    residuals = partial(residuals_of, runs, numbers)
    for variables in (sought, numbers):
        fitted = fit_residuals(residuals, variables, blocks, problem.confidence, report, is_motion=True)
        # Bounds of friction at rest that its excess does not keep are kept by a search within them.
        excesses = [row for row, variable in enumerate(variables) if variable.base]
        if all(numbers[row].low <= fitted.values[row] <= numbers[row].high for row in excesses):
            break
    for row in excesses:
        # Of friction at rest the bounds are its own; that it is above friction in motion stays.
        fitted.low[row], fitted.high[row] = (
            max(fitted.low[row], numbers[row].low),
            min(fitted.high[row], numbers[row].high),
        )
    own = tuple(replace(number, base=searched.base) for number, searched in zip(numbers, fitted.numbers, strict=True))
    return _result(problem, numbers, runs, blocks, replace(fitted, numbers=own))


def _excess(static: FitNumber, dynamic: FitNumber) -> FitNumber:
    """Return friction at rest as the excess over friction in motion, since it is at least as large."""
    low, high = max(static.low - dynamic.high, 0.0), static.high - dynamic.low
    if not low < high:
        raise IdentificationError(
            f"{static.name}: high = {static.high:.6g} N m must be above low = {dynamic.low:.6g} N m of {dynamic.name}, "
            "for friction at rest is at least friction in motion"
        )
    start = min(max(static.start - dynamic.start, low), high)
    return replace(static, start=start, low=low, high=high, scale=dynamic.scale, base=dynamic.name)


def _result(
    problem: TrajectoryProblem,
    numbers: tuple[FitNumber, ...],
    runs: Sequence[PreparedExperiment],
    blocks: Sequence[ResidualBlock],
    fitted: Fit,
) -> TrajectoryFit:
    """Return the result of a finished search: estimates, updated tolerances, and the model beside each recording."""
    models, channels, outliers = list[Recording](), list[ChannelFit](), list[str]()
    measurements = [run.measured for run in runs]
    for measured, signals in zip(measurements, signals_of(runs, numbers, fitted.values[:, None]), strict=True):
        modelled = {name: Channel(column[:, 0], measured.unit(name)) for name, column in signals.items()}
        model = Recording(f"model of {measured.label}", measured.time, modelled, kind="simulated")
        models.append(model)
        for name in measured.names:
            residuals, sensor = measured[name] - model[name], fitted.sensors[name]
            channels.append(
                ChannelFit(
                    experiment=measured.label,
                    channel=name,
                    unit=measured.unit(name),
                    noise=sensor.deviation,
                    order=sensor.order,
                    rms=float(np.sqrt(np.mean(residuals * residuals))),
                    largest=float(np.max(np.abs(residuals))),
                    span=float(np.ptp(measured[name])),
                )
            )
    times = {measured.label: measured.time for measured in measurements}
    for block in blocks:
        left_out = [row - block.rows.start for row in fitted.outliers if block.rows.start <= row < block.rows.stop]
        if left_out:
            count, first = count_of(len(left_out), "outlier"), times[block.recording][left_out[0]]
            text = f"{count} of {block.channel} left out, the first at {first:.6g} s"
            outliers.append(f"experiment '{block.recording}': {text}")
    conflict = conflict_in_words(fitted) or _wandering(fitted, numbers) or _bursting(measurements, models)
    # Tolerances are marginalised: their rows are left out, their share of the variance stays.
    rows = [row for row, number in enumerate(numbers) if not number.is_tolerance]
    estimates = tuple(
        estimate_of(fitted, row, [one.source or one.recording.label for one in experiments], conflict)
        for row in rows
        for experiments in [[one for one in problem.experiments if numbers[row].acts_in(one.label)]]
    )
    errors = np.sqrt(np.diag(fitted.covariance))
    covariance = fitted.covariance[np.ix_(rows, rows)]
    known = list[NuisanceParameter]()
    for row, number in enumerate(numbers):
        if number.is_tolerance:
            name = number.name
            shares = {estimate.path: dict(fitted.shares[estimate.path]).get(name, 0.0) for estimate in estimates}
            widens = max(shares, key=lambda path: shares[path], default="")
            pairs = [(number.start, number.deviation), (float(fitted.values[row]), float(errors[row]))]
            if number.is_logarithm:
                pairs = [(math.exp(value), math.exp(value) * deviation) for value, deviation in pairs]
            known.append(NuisanceParameter(name, number.unit, *pairs[0], *pairs[1], widens, shares.get(widens, 0.0)))
    scenarios = tuple(
        with_numbers(run.scenario, numbers_in(run.measured.label, numbers, fitted.values)) for run in runs
    )
    faults = [text for text in dict.fromkeys(broken_rule(scenario.device) for scenario in scenarios) if text]
    if fitted.edge:
        texts = {item.path: f"{item.value:.4g} {item.unit}".rstrip(" -") for item in estimates}
        sides = {path: "above" if side > 0 else "below" for path, side in fitted.edge.items()}
        wanted = " and ".join(f"{path} {sides[path]} {text}" for path, text in texts.items() if path in sides)
        faults.append(f"the recordings favour {wanted}, where every run fails")
    elif not fitted.has_converged:
        faults.append(f"the search stopped after {fitted.evaluations} runs before it converged")
    tolerances = count_of(len(known), "tolerance")
    return TrajectoryFit(
        procedure="trajectory",
        summary=f"{count_of(len(rows), 'number')} fitted to {count_of(len(runs), 'recording')}, {tolerances}",
        kind=kind_of(recording.kind for recording in measurements),
        problem=problem,
        numbers=numbers,
        fit=fitted,
        estimates=estimates,
        covariance=covariance,
        correlation=covariance / np.outer(errors[rows], errors[rows]),
        known=tuple(known),
        channels=tuple(channels),
        models=tuple(models),
        measurements=tuple(measurements),
        scenarios=scenarios,
        conflict=conflict,
        remarks=(*outliers, *faults),
        faults=tuple(faults),
    )


def _wandering(fitted: Fit, numbers: tuple[FitNumber, ...]) -> str:
    """Return a sentence on a channel whose residual drifts beyond the limit of its zero error; empty if none does.

    The zero error of a sensor stays within its limit, so a larger drift is due to the model.
    """
    for number in (number for number in numbers if number.path.startswith(ZERO_OF)):
        channel = number.path.removeprefix(ZERO_OF)
        noise, limit = fitted.sensors.get(channel), math.sqrt(3.0) * number.deviation
        if noise is None or not math.isfinite(limit):
            continue
        wander = noise.deviation * math.sqrt(max(1.0 - noise.innovation**2, 0.0))
        if wander > limit:
            shown, unit = in_shown_unit(wander, number.unit.removesuffix("_d"))
            most, _ = in_shown_unit(limit, number.unit.removesuffix("_d"))
            return (
                f"the residual of {channel} drifts by {shown:.2g} {unit}, but the zero of its sensor by at most "
                f"{most:.2g} {unit}"
            )
    return ""


def _bursting(measurements: Sequence[Recording], models: Sequence[Recording]) -> str:
    """Return a sentence on a channel whose residuals are far above the noise that lasts; empty if there is none."""
    for measured, model in zip(measurements, models, strict=True):
        for name in (name for name in measured.names if name in model):
            residuals = measured[name] - model[name]
            size, noise = float(np.sqrt(np.mean(np.square(residuals)))), correlated_noise_of(residuals)
            if size > _BURST * noise and size > _FELT * float(np.ptp(measured[name])):
                return (
                    f"the residual of {name} of {measured.label} is {size / max(noise, 1.0e-300):.0f} times the noise "
                    "that lasts"
                )
    return ""


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
    """Return the expected benefit of each candidate experiment, the most informative first."""
    benefits = [_benefit(fit, candidate) for candidate in candidates]
    return tuple(sorted(benefits, key=lambda benefit: -benefit.gain))


def _benefit(fit: TrajectoryFit, candidate: CandidateExperiment) -> ExpectedBenefit:
    """Return the expected benefit of a candidate, from its whitened Jacobian added to the information of the fit."""
    noise = dict(candidate.noise) or {name: model.deviation for name, model in fit.fit.sensors.items()}
    # Another experiment says nothing of a number of one recording, such as its trigger.
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
    shrinkage = {fit.numbers[index].name: math.sqrt(max(after[index, index], 0.0)) for index in unknowns}
    rows = np.ix_(unknowns, unknowns)
    gain = 0.5 * float(np.linalg.slogdet(before[rows])[1] - np.linalg.slogdet(after[rows])[1])
    return ExpectedBenefit(candidate.label, gain, shrinkage, min(shrinkage, key=lambda name: shrinkage[name]))


def _slopes(
    candidate: CandidateExperiment, noise: Mapping[str, float], numbers: Sequence[FitNumber], point: Floats
) -> Floats:
    """Return the Jacobian [SI] (samples of all channels, numbers) of the samples of a candidate at a point [SI]."""
    count = math.floor(candidate.scenario.run.duration / candidate.interval + _WHOLE)
    times = candidate.interval * np.arange(count + 1, dtype=np.float64)
    samples = {name: Channel(np.zeros(times.size), CHANNELS[name].unit) for name in noise}
    values = numbers_in("", numbers, point)
    measured = Recording(candidate.label, times, samples)
    prepared = prepare_samples(candidate.scenario, measured, noise, reach_of(numbers), values)

    def signals_of_points(points: Floats) -> Floats:
        signals = signals_at(prepared, columns_in("", numbers, points), points.shape[1])
        return np.concatenate([signals[name] for name in noise])

    runs = FitRuns(signals_of_points, tuple(numbers), (), report_nothing, 0, is_motion=True)
    with refused_as(IdentificationError, f"candidate '{candidate.label}'", IdentificationError):
        # As in the fit, a difference is as long as changes the samples by three units of noise in all.
        weight = 1.0 / np.repeat(list(noise.values()), times.size)
        runs.adapt_steps(runs.jacobian(point / runs.scale), weight)
        return np.asarray(runs.jacobian(point / runs.scale) / runs.scale)
