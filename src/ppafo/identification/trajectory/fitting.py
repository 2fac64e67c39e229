"""Trajectory fit: simulated runs as residuals of the common estimator, and results as estimates of the device.

Each experiment is one batch of runs, one per point of the search. All runs of a batch share one time step, fixed during
the search; their error tolerance is so small that it hardly affects finite differences.
"""

import math
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
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
from ppafo.identification.estimate import Identified, shown_text
from ppafo.identification.fit import Fit, FitNumber, FitRuns, ResidualBlock, estimate_of
from ppafo.identification.fit import fit as fit_residuals
from ppafo.identification.noise import Noise, whiten
from ppafo.identification.source import kind_of
from ppafo.identification.trajectory.experiment import (
    FITTED_CHANNELS,
    GAIN_OF,
    LAG_OF,
    TIME_OFFSET,
    ZERO_OF,
    FittedExperiment,
    TrajectoryProblem,
    broken_rule,
    reach_of,
    with_numbers,
)
from ppafo.model.columns import at, over_runs
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.faults import is_at_limit, lasting_noise_of, noise_of, plateaus, resolution_of, rounding_of
from ppafo.signals.recording import CHANNELS, Channel, Floats, Recording
from ppafo.simulation.plan import plan_run
from ppafo.simulation.recorded.channels import ANGLE, DORSIFLEXION_SUPPLY, SUPPLY, sample_period
from ppafo.simulation.recorded.inputs import RecordedInputs, step_inputs, with_prescribed_angle
from ppafo.simulation.scenario import FreeMotion, Scenario
from ppafo.wording import count_of

_STATIC = "friction.static_torque"
_DYNAMIC = "friction.dynamic_torque"
_DEAD_TIMES = "delay", "time_offset"
"""Last words of the paths of dead times."""
_LAGS = 10.0
"""Least increase of the log-likelihood [-] by which lags of sensors are found."""
# Lengths of runs of residuals [samples], and size of their sum that no white noise has [standard deviations].
_WINDOWS = (3, 6, 12, 24, 48)
_RUN = 6.0
_FELT = 1.0e-3
"""Least residuals that are tested as bursts [ranges of the samples]; smaller ones are the engine's."""
_BURST = 6.0
"""Ratio of residuals to the noise that lasts [-] from which they are no noise; slow noise has up to 5.5."""
FIT_TOLERANCE = 0.02
"""Error tolerance of a run of a fit, relative to a normal run [-]; finite differences are then accurate to 1e-3."""
_FINER = 0.25
"""Relative tolerance [-] of the finer runs by which the integration error is estimated."""
_FITS = 1.0e-6
"""Rounding tolerance of sample times, as a fraction of an interval [-], and in seconds."""
_ZERO_OF_ANGLE = math.radians(1.0)
"""Largest distance of a reading from a stop [rad] at which the vane counts as resting at the stop."""
_READ_INTERVAL = 5.0e-5
"""Record interval for interpolation at samples [s]; a chamber fills within milliseconds."""
_MAXIMUM_RECORDS = 100_000
"""Largest number of records, above which the record interval is lengthened to limit memory."""


@dataclass(frozen=True, slots=True)
class PreparedExperiment:
    """Experiment prepared for fitting: completed scenario, planned run, and samples located between its records.

    ``measured`` has the samples at their times in the run. ``run`` has the time step and clock of all runs. ``inputs``
    are those of each step; None without recorded inputs.
    """

    scenario: Scenario
    run: Run
    measured: Recording
    inputs: StepInputs | None


def prepare(
    experiment: FittedExperiment, numbers: Mapping[str, float], reach: float = 0.0, fine_step: float | None = None
) -> PreparedExperiment:
    """Return an experiment prepared for fitting, with records that are no finer than its samples need.

    ``numbers`` are the start values by path; ``reach`` [s] is the largest time offset that may be tried, ``fine_step``
    [s] the longest step of a finer run. Raises IdentificationError for a saturated sensor.
    """
    recording = experiment.recording
    scenario = experiment.begun
    inside = recording.time >= experiment.start - _FITS
    # Rounding may put the first sample just before the start.
    time = np.maximum(recording.time[inside] - experiment.start, 0.0)
    channels = {name: Channel(recording[name][inside], CHANNELS[name].unit) for name in experiment.channels}
    actuator = scenario.device.actuator
    for name, channel in channels.items():
        clipped = max(plateaus(channel.values), key=lambda plateau: plateau.count)
        # With a coarse converter, a vane that rests at its stop repeats one value without saturation of the sensor.
        stops = (actuator.angle_min, actuator.angle_max) if name == ANGLE else ()
        rests = any(abs(clipped.value - stop) < _ZERO_OF_ANGLE for stop in stops)
        has_noise = name in experiment.noise or noise_of(channel.values) > 0.0
        if is_at_limit(channel.values, clipped) and not (rests or has_noise):
            times = f"{clipped.count} of {channel.values.size} samples: the sensor is probably saturated"
            level = f"its {clipped.word} value for {times}"
            raise IdentificationError(f"{experiment.where}: channel '{name}' stays at {level}")
    scenario = replace(
        scenario, run=replace(scenario.run, duration=float(time[-1]) + reach, step=fine_step or scenario.run.step)
    )
    run = plan_run(with_numbers(scenario, numbers))
    # Steps between records: those of a sample interval, or fewer if samples must be interpolated, and a fraction of a
    # step if a whole one is too long for that.
    every: float = max(1, round(float(np.min(np.diff(time))) / run.step))
    position = time / (run.step * every)
    is_aligned = bool(np.all(np.abs(position - np.round(position)) < _FITS * np.maximum(position, 1.0)))
    if not is_aligned or reach > 0.0:
        most = max(_READ_INTERVAL, float(time[-1]) / _MAXIMUM_RECORDS) / run.step * (1.0 + _FITS)
        if most < 1.0:
            every = 1.0 / math.ceil(1.0 / most)
        else:
            counts = range(1, int(most) + 1)
            every = max(count for count in counts if every % count == 0) if is_aligned else counts[-1]
    records = math.ceil((float(time[-1]) + reach) / (run.step * every) - _FITS)
    steps = math.ceil(records * every - _FITS)
    tolerance = FIT_TOLERANCE if fine_step is None else _FINER * FIT_TOLERANCE
    run = replace(run, tolerance=tolerance, record_every=every, step_count=steps, needs_parts=True)
    if ANGLE in experiment.inputs and isinstance(scenario.motion, FreeMotion):
        run = with_prescribed_angle(run, scenario.motion.angle)
    recorded = RecordedInputs(recording, experiment.inputs, experiment.start)
    inputs = step_inputs(recorded, scenario.device, run) if experiment.inputs else None
    return PreparedExperiment(scenario, run, Recording(experiment.label, time, channels, kind=recording.kind), inputs)


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
    # Threads run at the same time, because compiled runs release the lock of the interpreter.
    with ThreadPoolExecutor(min(len(experiments), os.cpu_count() or 1)) as pool:
        return list(pool.map(signals_at, experiments, columns, [points.shape[1]] * len(experiments)))


_NUMBERS_OF_RUN = ("plant", "thermal", "initial", "valve", "command_delay", "lines", "effects", "leg")
"""Fields of a run that depend on the parameters of its scenario; program, clock and prescribed motion do not."""


def run_with(prepared: PreparedExperiment, numbers: Mapping[str, Any]) -> Run:
    """Return the run of an experiment with changed parameters [SI], on the same program and clock.

    A parameter may be an array (runs,). No number goes to or from 0, which would need another program.
    """
    base = prepared.run
    scenario = with_numbers(prepared.scenario, numbers)
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

    Runs that differ only in zeros, gains and lags of compared sensors are simulated once; runs with other zeros of
    inputs are other batches. A pressure sensor reads gauge pressure.
    """
    measured = prepared.measured
    inputs = prepared.inputs
    of_sensors = {f"{kind}{name}" for name in measured.names for kind in (ZERO_OF, GAIN_OF, LAG_OF)}
    running = {path: np.broadcast_to(column, (count,)) for path, column in columns.items() if path not in of_sensors}
    table = np.array([*running.values()]).reshape(-1, count)
    _, first, run_of = np.unique(table, axis=1, return_index=True, return_inverse=True)
    others = {path: column[first] for path, column in running.items() if not path.startswith(ZERO_OF)}
    followed = {path: column[first] for path, column in running.items() if path.startswith(ZERO_OF)}
    zeros = np.array([] if inputs is None else [*followed.values()]).reshape(-1, len(first))
    distinct, group = np.unique(zeros, axis=1, return_inverse=True)
    signals = {name: np.full((len(measured), len(first)), np.nan) for name in measured.names}
    for number, zeros_of_batch in enumerate(distinct.T.tolist()):
        chosen = np.flatnonzero(group.ravel() == number)
        run = run_with(prepared, {path: column[chosen] for path, column in others.items()})
        read = inputs
        if inputs is not None and zeros_of_batch:
            # Zero errors [rad], [Pa] are subtracted from recorded inputs; one sensor may measure both inlets.
            zero_of = dict(zip(followed, zeros_of_batch, strict=True))
            both = zero_of.get(f"{ZERO_OF}{SUPPLY}", 0.0)
            offsets = {
                "path.level": zero_of.get(f"{ZERO_OF}{ANGLE}", 0.0),
                "plant.supply_pressure": both,
                "plant.dorsiflexion_pressure": zero_of.get(f"{ZERO_OF}{DORSIFLEXION_SUPPLY}", both),
            }
            parameters = {path: values - offsets.get(path, 0.0) for path, values in inputs.parameters.items()}
            read = replace(inputs, parameters=parameters)
        rows = state_row_numbers(run)
        channel_rows = [rows[f"state.{name}"] for name in ("angle", "mass_1", "mass_2")]
        records: Floats | None = None
        failed = np.zeros(len(chosen), dtype=np.bool_)
        # A program has up to 32 lanes; more runs are several batches.
        for members, batch in batches_of(run, len(chosen)):
            outcome = run_batch(batch, threads=1) if read is None else replay(batch, read)
            ends = outcome.states
            # A failed run, or one with states that are no numbers, has no residuals.
            failed[members] = (ends[rows["result.failure_time"]] < NEVER_FAILED) | ~np.isfinite(ends).all(axis=0)
            if records is None:
                records = np.empty((len(channel_rows), len(outcome.record), len(chosen)))
            for record, row in zip(records, channel_rows, strict=True):
                record[:, members] = outcome.record[:, row]
        assert records is not None
        late = others[TIME_OFFSET][chosen] if TIME_OFFSET in others else np.zeros(len(chosen))
        states = [_at_samples(record, prepared, late) for record in records]
        numbers = leaves(run.plant)
        # Pressures follow from mass and angle by the plant, whose numbers differ from run to run.
        for element in np.flatnonzero(~failed).tolist():
            plant = rebuilt(run.program.actuator.plant, [at(number, element) for number in numbers])
            angle, mass_1, mass_2 = (state[:, element] for state in states)
            pressures = pressures_of(run.program.actuator, plant, angle, mass_1, mass_2)
            for name, values in zip(FITTED_CHANNELS, (angle, *pressures), strict=True):
                if name in signals:
                    signals[name][:, chosen[element]] = values
    interval = sample_period(measured.time)
    for name, ideal in signals.items():
        rest = 0.0 if name == ANGLE else prepared.scenario.device.supply.atmospheric_pressure
        gain, zero = (np.asarray(columns.get(f"{path}{name}", 0.0)) for path in (GAIN_OF, ZERO_OF))
        sensed = ideal[:, run_of.ravel()]
        lags = np.broadcast_to(columns.get(f"{LAG_OF}{name}", 0.0), (count,))
        # First-order lags, exact for straight lines between samples. A lag below 0 adds what the same lag above 0 takes
        # away, so that a search can pass 0.
        for lag in np.unique(lags[lags != 0.0]).tolist():
            runs = lags == lag
            left = math.exp(-interval / abs(lag))
            straight = abs(lag) / interval * (1.0 - left)
            from_start = sensed[:, runs] - sensed[:1, runs]
            behind = lfilter([1.0 - straight, straight - left], [1.0, -left], from_start, axis=0) - from_start
            sensed[:, runs] += math.copysign(1.0, lag) * behind
        signals[name] = rest + (1.0 + gain) * (sensed - rest) + zero
    return signals


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
    previous = values[before, runs]
    following = values[np.minimum(before + 1, len(values) - 1), runs]
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

    ``covariance`` [SI] is in the order of ``estimates``. ``channels`` are residual statistics.
    ``models`` are the fitted runs at the sample times and ``measurements`` the samples, both by experiment with the
    time of the run. ``scenarios`` have the fitted values. ``expected`` has the benefit of candidates, best first.
    """

    problem: TrajectoryProblem
    fit: Fit
    covariance: Floats
    known: tuple[NuisanceParameter, ...]
    channels: tuple[ChannelFit, ...]
    models: tuple[Recording, ...]
    measurements: tuple[Recording, ...]
    scenarios: tuple[Scenario, ...]
    expected: "tuple[ExpectedBenefit, ...]" = ()


def fit(problem: TrajectoryProblem, report: Report = report_nothing) -> TrajectoryFit:
    """Fit the parameters of a problem to its recordings; each estimate has an interval [SI] and a verdict.

    ``report`` receives the progress. Raises IdentificationError if the problem cannot be simulated.
    """
    numbers = problem.numbers
    # Beside a lag a steep signal says little of other numbers, so it is a tolerance where recordings ask for it, and of
    # a dead time always, which it resembles so much that small residuals would not show it.
    steady = tuple(number for number in numbers if not (number.is_tolerance and number.path.startswith(LAG_OF)))
    if any(not number.is_tolerance and number.path.endswith(_DEAD_TIMES) for number in numbers):
        return _fit_of(problem, numbers, report)
    found = _fit_of(problem, steady, report)
    is_lagging = bool(found.conflict)
    for _, _, residuals in _residuals(found.measurements, found.models):
        # Residuals of some part of a recording have one sign, as white noise has not.
        noise = max(noise_of(residuals), 1.0e-300)
        sums = np.cumsum(residuals, dtype=float)
        runs = ((np.abs(sums[width:] - sums[:-width]).max(initial=0.0), width) for width in _WINDOWS)
        is_lagging |= any(float(run) > _RUN * noise * math.sqrt(width) for run, width in runs)
    if len(steady) < len(numbers) and is_lagging:
        report(Progress("trajectory fit: again, with sensors that lag"))
        lagging = _fit_of(problem, numbers, report)
        if lagging.fit.log_likelihood > found.fit.log_likelihood + _LAGS:
            return lagging
    return found


def _residuals(measurements: Sequence[Recording], models: Sequence[Recording]) -> list[tuple[Recording, str, Floats]]:
    """Return the residuals [SI], measured - model, of each channel of each measurement."""
    pairs = zip(measurements, models, strict=True)
    return [(measured, name, measured[name] - model[name]) for measured, model in pairs for name in measured.names]


def _fit_of(problem: TrajectoryProblem, numbers: tuple[FitNumber, ...], report: Report) -> TrajectoryFit:
    """Return the fit of some numbers of a problem; those that are left out stay at their start values.

    Friction at rest is fitted as the excess over friction in motion, since it is at least as large.
    """
    start = np.array([number.start for number in numbers])
    sought = list(numbers)
    unknown = {(item.path, item.recordings): item for item in numbers if not item.is_tolerance}
    for row, static in enumerate(numbers):
        dynamic = unknown.get((_DYNAMIC, static.recordings))
        if static.path != _STATIC or static.is_tolerance or math.isfinite(static.deviation) or dynamic is None:
            continue
        low = max(static.low - dynamic.high, 0.0)
        high = static.high - dynamic.low
        if not low < high:
            least = f"low = {dynamic.low:.6g} N m of {dynamic.name}"
            raise IdentificationError(f"{static.name}: high = {static.high:.6g} N m must be above {least}")
        excess = min(max(static.start - dynamic.start, low), high)
        sought[row] = replace(static, start=excess, low=low, high=high, scale=dynamic.scale, base=dynamic.name)
    runs = []
    finer = []
    for experiment in problem.experiments:
        reach = reach_of([number for number in numbers if number.acts_in(experiment.label)])
        values = numbers_in(experiment.label, numbers, start)
        runs.append(prepare(experiment, values, reach))
        # The error of the integration is nearly proportional to the tolerance, so that finer runs show most of it. It
        # is no independent noise: all samples of a recording share it.
        finer.append(prepare(experiment, values, reach, 0.5 * runs[-1].run.step))
    report(Progress(f"trajectory fit: {count_of(len(numbers), 'number')}, {count_of(len(runs), 'recording')}"))
    blocks = []
    first = 0
    for experiment, run, *both in zip(
        problem.experiments, runs, *(signals_of(each, numbers, start[:, None]) for each in (runs, finer)), strict=True
    ):
        for name in run.measured.names:
            samples = run.measured[name]
            coarse, fine = (signals[name][:, 0] for signals in both)
            error = (fine - coarse) / (1.0 - _FINER)
            error = error if np.isfinite(error).all() else np.zeros_like(error)
            floor = max(experiment.noise.get(name, 0.0), float(np.sqrt(np.mean(np.square(error)))))
            least = np.maximum(floor, rounding_of(samples, resolution_of(samples)))
            blocks.append(ResidualBlock(experiment.label, name, slice(first, first + len(samples)), least, error))
            first += len(samples)

    def residuals(points: Floats) -> Floats:
        pairs = zip(runs, signals_of(runs, numbers, points), strict=True)
        return np.concatenate(
            [run.measured[name][:, None] - model[name] for run, model in pairs for name in run.measured.names]
        )

    for variables in (sought, numbers):
        fitted = fit_residuals(residuals, variables, blocks, problem.confidence, report, is_motion=True)
        # Bounds of friction at rest that its excess does not keep are kept by a search within them.
        excesses = [row for row, variable in enumerate(variables) if variable.base]
        if all(numbers[row].low <= fitted.values[row] <= numbers[row].high for row in excesses):
            break
    for row in excesses:
        # Of friction at rest the bounds are its own; that it is above friction in motion stays.
        fitted.low[row] = max(fitted.low[row], numbers[row].low)
        fitted.high[row] = min(fitted.high[row], numbers[row].high)
    own = tuple(replace(number, base=searched.base) for number, searched in zip(numbers, fitted.numbers, strict=True))
    return _result(problem, runs, blocks, replace(fitted, numbers=own))


def _result(
    problem: TrajectoryProblem, runs: Sequence[PreparedExperiment], blocks: Sequence[ResidualBlock], fitted: Fit
) -> TrajectoryFit:
    """Return the result of a finished search: estimates, updated tolerances, and the model beside each recording."""
    numbers = fitted.numbers
    measurements = [run.measured for run in runs]
    models = []
    for measured, signals in zip(measurements, signals_of(runs, numbers, fitted.values[:, None]), strict=True):
        modelled = {name: Channel(column[:, 0], measured.unit(name)) for name, column in signals.items()}
        models.append(Recording(f"model of {measured.label}", measured.time, modelled, kind="simulated"))
    channels = []
    outliers = []
    conflicts = [] if fitted.conflict is None else [fitted.conflict.words]
    for number in (number for number in numbers if number.path.startswith(ZERO_OF)):
        # The zero error of a sensor stays within its limit, so a larger drift is due to the model.
        name = number.path.removeprefix(ZERO_OF)
        limit = math.sqrt(3.0) * number.deviation
        noise = fitted.sensors.get(name, Noise(0.0))
        wander = noise.deviation * math.sqrt(max(1.0 - noise.innovation**2, 0.0))
        if wander > limit:
            drift, most = (shown_text(size, number.unit, digits=2) for size in (wander, limit))
            conflicts.append(f"the residual of {name} drifts by {drift}, but the zero of its sensor by at most {most}")
    for (measured, name, residuals), block in zip(_residuals(measurements, models), blocks, strict=True):
        sensor = fitted.sensors[name]
        lasting = lasting_noise_of(residuals)
        rms = float(np.sqrt(np.mean(np.square(residuals))))
        span = float(np.ptp(measured[name]))
        sizes = sensor.deviation, sensor.order, rms, float(np.max(np.abs(residuals))), span
        channels.append(ChannelFit(measured.label, name, measured.unit(name), *sizes))
        if rms > _BURST * lasting and rms > _FELT * span:
            times = f"{rms / max(lasting, 1.0e-300):.0f} times the noise that lasts"
            conflicts.append(f"the residual of {name} of {measured.label} is {times}")
        left_out = [row - block.rows.start for row in fitted.outliers if block.rows.start <= row < block.rows.stop]
        if left_out:
            count = count_of(len(left_out), "outlier")
            first = measured.time[left_out[0]]
            outliers.append(f"experiment '{measured.label}': {count} of {name} left out, the first at {first:.6g} s")
    conflict = next(iter(conflicts), "")
    # Tolerances are marginalised: their rows are left out, their share of the variance stays.
    rows = [row for row, number in enumerate(numbers) if not number.is_tolerance]
    estimates = []
    for row in rows:
        acting = [one for one in problem.experiments if numbers[row].acts_in(one.label)]
        estimates.append(estimate_of(fitted, row, [one.trace for one in acting], conflict))
    errors = np.sqrt(np.diag(fitted.covariance))
    known = []
    for number, value, error in zip(numbers, fitted.values.tolist(), errors.tolist(), strict=True):
        if number.is_tolerance:
            shares = {item.path: dict(fitted.shares[item.path]).get(number.name, 0.0) for item in estimates}
            widens = max(shares, key=lambda path: shares[path], default="")
            pairs = [(number.start, number.deviation), (value, error)]
            if number.is_logarithm:
                pairs = [(math.exp(mean), math.exp(mean) * deviation) for mean, deviation in pairs]
            share = shares.get(widens, 0.0)
            known.append(NuisanceParameter(number.name, number.unit, *pairs[0], *pairs[1], widens, share))
    scenarios = tuple(
        with_numbers(run.scenario, numbers_in(run.measured.label, numbers, fitted.values)) for run in runs
    )
    faults = [text for text in dict.fromkeys(broken_rule(scenario.device) for scenario in scenarios) if text]
    if fitted.edge:
        wanted = [
            f"{item.path} {'above' if fitted.edge[item.path] > 0 else 'below'} "
            f"{f'{item.value:.4g} {item.unit}'.rstrip(' -')}"
            for item in estimates
            if item.path in fitted.edge
        ]
        faults.append(f"the recordings favour {' and '.join(wanted)}, where every run fails")
    elif not fitted.has_converged:
        faults.append(f"the search stopped after {fitted.evaluations} runs before it converged")
    recordings = count_of(len(runs), "recording")
    tolerances = count_of(len(known), "tolerance")
    return TrajectoryFit(
        procedure="trajectory",
        summary=f"{count_of(len(rows), 'number')} fitted to {recordings}, {tolerances}",
        estimates=tuple(estimates),
        kind=kind_of(measured.kind for measured in measurements),
        conflict=conflict,
        remarks=(*outliers, *faults),
        faults=tuple(faults),
        problem=problem,
        fit=fitted,
        covariance=fitted.covariance[np.ix_(rows, rows)],
        known=tuple(known),
        channels=tuple(channels),
        models=tuple(models),
        measurements=tuple(measurements),
        scenarios=scenarios,
    )


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


def expected_information(
    fit: TrajectoryFit, candidates: Sequence[tuple[str, Scenario, Mapping[str, float], float]]
) -> tuple[ExpectedBenefit, ...]:
    """Return the expected benefit of each candidate experiment, the most informative first.

    A candidate is its label, scenario, noise of each compared channel [rad], [Pa], and sample interval [s]; without
    noise, all channels of the fit are compared, each with its estimated noise. The whitened Jacobian of a candidate is
    added to the information of the fit.
    """
    benefits = []
    found = fit.fit
    sensors = fit.fit.sensors
    # Another experiment says nothing of a number of one recording, such as its trigger.
    common = [index for index, number in enumerate(found.numbers) if not number.recordings]
    numbers = tuple(replace(found.numbers[index], base="") for index in common)
    point = found.values[common]
    unknowns = [index for index, number in enumerate(found.numbers) if not number.is_tolerance]
    # In units of today's standard errors, for pascals and radians differ by many powers of ten.
    errors = np.sqrt(np.diag(found.covariance))
    rows = np.ix_(unknowns, unknowns)
    before = found.covariance / np.outer(errors, errors)
    for label, scenario, given, interval in candidates:
        noise = dict(given) or {name: model.deviation for name, model in sensors.items()}
        times = interval * np.arange(math.floor(scenario.run.duration / interval + _FITS) + 1, dtype=np.float64)
        samples = {name: Channel(np.zeros(times.size), CHANNELS[name].unit) for name in noise}
        candidate = FittedExperiment(label, scenario, Recording(label, times, samples), 0.0, tuple(noise), noise)
        run = prepare(candidate, numbers_in(label, numbers, point), reach_of(numbers))

        def signals(points: Floats, run: PreparedExperiment = run) -> Floats:
            (modelled,) = signals_of([run], numbers, points)
            return np.concatenate([modelled[name] for name in run.measured.names])

        runs = FitRuns(signals, numbers, (), report_nothing, 0, is_motion=True)
        with refused_as(IdentificationError, f"candidate '{label}'", IdentificationError):
            # As in the fit, a difference is as long as changes the samples by three units of noise in all.
            deviations = np.repeat(list(noise.values()), len(run.measured))
            runs.adapt_steps(runs.jacobian(point / runs.scale), 1.0 / deviations)
            slopes = np.asarray(runs.jacobian(point / runs.scale) / runs.scale)
        blocks = []
        for block, (name, deviation) in zip(np.split(slopes, len(noise)), noise.items(), strict=True):
            sensor = sensors.get(name)
            blocks.append(whiten(block, replace(sensor, deviation=deviation) if sensor else Noise(deviation)))
        jacobian = np.concatenate(blocks) * errors[common]
        information = np.linalg.inv(before)
        information[np.ix_(common, common)] += jacobian.T @ jacobian
        after = np.linalg.inv(information)
        gain = 0.5 * float(np.linalg.slogdet(before[rows])[1] - np.linalg.slogdet(after[rows])[1])
        shrinkage = {found.numbers[index].name: math.sqrt(max(after[index, index], 0.0)) for index in unknowns}
        benefits.append(ExpectedBenefit(label, gain, shrinkage, min(shrinkage, key=shrinkage.__getitem__)))
    return tuple(sorted(benefits, key=lambda benefit: -benefit.gain))
