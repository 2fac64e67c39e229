"""Experiments prepared for fitting, and their runs: residuals of all recordings at many points, in one batch.

Each experiment is one batch of runs, one per point. All runs of a batch share one time step, fixed during the search.
The error tolerance of the runs is so small that it hardly affects finite differences.
"""

import math
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import run_batch
from ppafo.engine.program import Program
from ppafo.engine.replay import StepInputs, replay
from ppafo.engine.rows import leaves, rebuilt, row_numbers
from ppafo.engine.run import NEVER_FAILED, Run, batches_of
from ppafo.engine.scheme.actuators import pressures_of
from ppafo.engine.scheme.pneumatics import supply_range
from ppafo.errors import IdentificationError
from ppafo.identification.residuals import ResidualBlock
from ppafo.identification.trajectory.experiment import FittedExperiment, scenario_of
from ppafo.identification.trajectory.numbers import GAIN_OF, TIME_OFFSET, ZERO_OF, FitNumber, with_numbers
from ppafo.model.catalog import VALVES
from ppafo.model.columns import at, over_runs
from ppafo.parameters.effects import switches_of
from ppafo.signals.faults import MINIMUM_SAMPLES, is_at_limit, noise_of, plateaus, resolution_of, rounding_of
from ppafo.simulation.plan import plan_run
from ppafo.simulation.recorded.channels import ANGLE, DORSIFLEXION_SUPPLY, SUPPLY
from ppafo.simulation.recorded.inputs import RecordedInputs, step_inputs, with_prescribed_angle
from ppafo.simulation.scenario import FreeMotion, Scenario

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

FIT_TOLERANCE = 0.02
"""Error tolerance of a run of a fit, relative to other runs [-]; finite differences are then accurate to 1e-3."""
_FINER = 0.25
"""Relative tolerance [-] of the second run that serves to estimate the error of the first."""
_FITS = 1.0e-6
"""Rounding tolerance of sample times, as a fraction of a record interval [-] and in seconds."""

_ZERO_OF_ANGLE = math.radians(1.0)
"""Largest distance of a reading from a stop [rad] at which the vane counts as resting at the stop."""

_READ_INTERVAL = 5.0e-5
"""Record interval for interpolation at samples [s]; a chamber fills within milliseconds."""
_MAXIMUM_RECORDS = 100_000
"""Number of records above which the interval is lengthened, to limit memory for long recordings."""


@dataclass(frozen=True, slots=True)
class FitChannel:
    """Channel of an experiment: samples [rad] or [Pa], and least noise assumed for them."""

    name: str
    values: Floats
    floor: float = 0.0


@dataclass(frozen=True, slots=True)
class PreparedExperiment:
    """Experiment prepared for fitting: completed scenario, planned run, and samples located between its records.

    ``time`` has the sample times in the run [s]; a fitted offset may shift them by up to ``reach`` [s]. ``run`` has the
    time step and clock of all runs. A sample lies a ``fraction`` [-] of the interval after the record ``place``.
    ``inputs`` are the inputs at each step, computed from ``recorded``; None without recorded inputs.
    """

    label: str
    scenario: Scenario
    run: Run
    time: Floats
    channels: tuple[FitChannel, ...]
    reach: float
    place: Indices
    fraction: Floats
    recorded: RecordedInputs | None = None
    inputs: StepInputs | None = None


def prepare(experiment: FittedExperiment, numbers: Mapping[str, float], reach: float = 0.0) -> PreparedExperiment:
    """Return an experiment prepared for fitting.

    ``numbers`` are the start values by path; ``reach`` [s] is the largest time offset that may be tried. Raises
    IdentificationError for a recording with too few samples or a saturated sensor.
    """
    recording, said = experiment.recording, f"experiment '{experiment.label}'"
    inside = recording.time >= experiment.start - _FITS
    # A sample that rounding puts before the start is the one at the start.
    time = np.maximum(recording.time[inside] - experiment.start, 0.0)
    if time.size < MINIMUM_SAMPLES:
        raise IdentificationError(
            f"{said}: {recording.label} has {time.size} samples after {experiment.start:g} s, "
            f"at least {MINIMUM_SAMPLES} are needed"
        )
    channels = [
        FitChannel(name, recording[name][inside], experiment.noise.get(name, 0.0)) for name in experiment.channels
    ]
    actuator = experiment.scenario.device.actuator
    stops = actuator.angle_min, actuator.angle_max
    for channel in channels:
        clipped = max(plateaus(channel.values), key=lambda item: item.count)
        # A vane that rests at its stop repeats one value on a coarse converter, and is at no limit of a sensor.
        rests = channel.name == ANGLE and any(abs(clipped.value - stop) < _ZERO_OF_ANGLE for stop in stops)
        if (
            not rests
            and channel.floor == 0.0
            and is_at_limit(channel.values, clipped)
            and not noise_of(channel.values) > 0.0
        ):
            raise IdentificationError(
                f"{said}: channel '{channel.name}' is exactly its {clipped.word} value for {clipped.count} of "
                f"{channel.values.size} samples: its sensor is at its limit; end the recording before it, or give the "
                "standard deviation of the sensor in noise"
            )
    before = scenario_of(experiment)
    scenario = replace(before, run=replace(before.run, duration=float(time[-1]) + reach))
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
    """Return samples of a scenario prepared for fitting, at ``numbers`` [SI], with time offsets up to ``reach`` [s]."""
    run = replace(plan_run(with_numbers(scenario, numbers)), tolerance=FIT_TOLERANCE)
    nowhere = np.zeros(time.size)
    place = nowhere.astype(np.intp)
    unplaced = PreparedExperiment(label, scenario, run, time, tuple(channels), reach, place, nowhere, recorded)
    return _place_samples(unplaced, run)


def _place_samples(prepared: PreparedExperiment, run: Run) -> PreparedExperiment:
    """Return the experiment with its samples located in a record that is only as fine as they need."""
    time, recorded = prepared.time, prepared.recorded
    every = _steps_between_samples(time, prepared.reach, run.step)
    records = math.ceil((float(time[-1]) + prepared.reach) / (run.step * every) - _FITS)
    position = time / (run.step * every)
    place = np.minimum(np.floor(position + _FITS), records).astype(np.intp)
    fraction = np.maximum(position - place, 0.0)
    # Rounding of the clock must not make a sample lie between two records.
    fraction[fraction < _FITS] = 0.0
    frozen = replace(run, record_every=every, step_count=math.ceil(records * every - _FITS), needs_parts=True)
    if recorded is not None and recorded.has(ANGLE) and isinstance(prepared.scenario.motion, FreeMotion):
        frozen = with_prescribed_angle(frozen, prepared.scenario.motion.angle)
    inputs = None if recorded is None else step_inputs(recorded, prepared.scenario.device, frozen)
    return replace(prepared, run=frozen, place=place, fraction=fraction, inputs=inputs)


def _steps_between_samples(time: Floats, reach: float, step: float) -> float:
    """Return the steps between two records: a sample interval, or less if samples must be interpolated.

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

    def one(prepared: PreparedExperiment) -> dict[str, Floats]:
        return signals_at(prepared, columns_in(prepared.label, numbers, points), points.shape[1])

    # Compiled runs release the interpreter.
    workers = min(len(experiments), os.cpu_count() or 1)
    if workers == 1:
        return [one(prepared) for prepared in experiments]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(one, experiments))


def residuals_of(experiments: Sequence[PreparedExperiment], numbers: Sequence[FitNumber], points: Floats) -> Floats:
    """Return residuals, measured - model [SI] (samples of all channels, points), at points [SI] (numbers, points)."""
    signals = signals_of(experiments, numbers, points)
    return np.concatenate(
        [
            channel.values[:, None] - of_one[channel.name]
            for prepared, of_one in zip(experiments, signals, strict=True)
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
    # The error is about in proportion to what is allowed, so that half as long steps show most of it.
    halved = []
    for one in experiments:
        scenario = replace(one.scenario, run=replace(one.scenario.run, step=0.5 * one.run.step))
        run = plan_run(with_numbers(scenario, numbers_in(one.label, numbers, point)))
        halved.append(_place_samples(one, replace(run, tolerance=_FINER * one.run.tolerance)))
    fine = signals_of(halved, numbers, point[:, None])
    for prepared, before, after in zip(experiments, coarse, fine, strict=True):
        for channel in prepared.channels:
            error = (after[channel.name][:, 0] - before[channel.name][:, 0]) / (1.0 - _FINER)
            error = error if np.isfinite(error).all() else np.zeros_like(error)
            rounded = rounding_of(channel.values, resolution_of(channel.values))
            floor = np.maximum(max(channel.floor, float(np.sqrt(np.mean(np.square(error))))), rounded)
            last = first + len(channel.values)
            blocks.append(ResidualBlock(prepared.label, channel.name, slice(first, last), floor, error))
            first = last
    return tuple(blocks)


_NUMBERS_OF_RUN = (
    "plant",
    "thermal",
    "valve_orifice",
    "leak_orifice",
    "initial",
    "valve",
    "command_delay",
    "lines",
    "effects",
    "leg",
)
"""Fields of a run that depend on the parameters of its scenario; program, clock and prescribed motion do not."""


def run_with(prepared: PreparedExperiment, numbers: Mapping[str, Any]) -> Run:
    """Return the run of an experiment with changed parameters [SI], on the same program and clock.

    A parameter may be an array (runs,). Raises IdentificationError if a valve setting or an effect changes to or from
    0, which would need another program.
    """
    base = prepared.run
    scenario = with_numbers(prepared.scenario, numbers)
    device = scenario.device
    said, before = f"experiment '{prepared.label}'", prepared.scenario.device.valve.settings
    settings: Mapping[str, Any] = device.valve.settings
    own = {path.rpartition(".")[2] for path in numbers if path.startswith("valves.")}
    kind = VALVES[device.valve.kind]
    for run in range(max((value.size for value in settings.values() if isinstance(value, np.ndarray)), default=1)):
        now = {name: at(value, run) for name, value in settings.items()}
        given = kind.settings(**now)
        valve = kind.choose(given)
        if valve != base.program.valve or (valve.command_delay(given) > 0.0) != base.program.late_commands:
            moved = " or ".join(f"valve.{name}" for name in now if name in own and 0.0 in (now[name], before[name]))
            raise IdentificationError(
                f"{said}: {moved} changed to or from 0, which is another model of the valve; give a start and a "
                f"lower bound above 0"
            )
    if any(np.any(is_on != (effect in base.program.effects)) for effect, is_on in switches_of(device).items()):
        raise IdentificationError(
            f"{said}: an effect was switched on or off by the fit, which is another model; give a start and a lower "
            f"bound above 0"
        )
    planned, _ = scenario.motion.motion_kind.plan(scenario)
    # The engine allows a fraction of the supply pressure. Where that is fitted, the error in pascals must stay.
    supplied = planned.plant

    def range_of_supply(first: float, second: float, atmosphere: float) -> float:
        return supply_range(
            supplied._replace(supply_pressure=first, dorsiflexion_pressure=second, atmospheric_pressure=atmosphere)
        )

    pressures = supplied.supply_pressure, supplied.dorsiflexion_pressure, supplied.atmospheric_pressure
    allowed = supply_range(base.plant) / over_runs(range_of_supply, *pressures)
    of_numbers = {name: getattr(planned, name) for name in _NUMBERS_OF_RUN}
    return replace(base, tolerance=base.tolerance * allowed, **of_numbers)


def signals_at(prepared: PreparedExperiment, columns: Mapping[str, Floats], count: int) -> dict[str, Floats]:
    """Return the channels [SI] (samples, runs) of one experiment for ``count`` runs with parameters [SI] by path.

    Runs that differ only in zeros and gains of compared sensors are simulated once. A pressure sensor reads gauge
    pressure.
    """
    compared = [channel.name for channel in prepared.channels]
    errors = {
        path: column
        for path, column in columns.items()
        if path.removeprefix(ZERO_OF).removeprefix(GAIN_OF) in compared and path.startswith((ZERO_OF, GAIN_OF))
    }
    running = {path: column for path, column in columns.items() if path not in errors}
    together = np.array([np.broadcast_to(column, (count,)) for column in running.values()]).reshape(-1, count)
    # A zero or a gain of a compared sensor needs no run of its own.
    _, first, place = np.unique(together, axis=1, return_index=True, return_inverse=True)
    fewer = {path: np.broadcast_to(column, (count,))[first] for path, column in running.items()}
    found = _with_inputs(prepared, fewer, len(first))
    atmosphere = prepared.scenario.device.supply.atmospheric_pressure
    for name, values in found.items():
        rest = 0.0 if name == ANGLE else atmosphere
        gain, zero = (np.asarray(errors.get(f"{path}{name}", 0.0)) for path in (GAIN_OF, ZERO_OF))
        found[name] = rest + (1.0 + gain) * (values[:, place.ravel()] - rest) + zero
    return found


def _with_inputs(prepared: PreparedExperiment, columns: Mapping[str, Floats], count: int) -> dict[str, Floats]:
    """Return ideal sensor signals; runs with different zeros of recorded inputs are simulated in separate groups."""
    zeros = {path: column for path, column in columns.items() if path.startswith(ZERO_OF)}
    rest = {path: column for path, column in columns.items() if path not in zeros}
    if not zeros or prepared.inputs is None:
        return _run_signals(prepared, rest, count)
    table = np.array(list(zeros.values()))
    kinds, group = np.unique(table, axis=1, return_inverse=True)
    found: dict[str, Floats] = {}
    for number, kind in enumerate(kinds.T):
        members = np.flatnonzero(group.ravel() == number)
        zero_of = {path.removeprefix(ZERO_OF): float(one) for path, one in zip(zeros, kind, strict=True)}
        # What a run follows less the zeros [rad], [Pa] of the sensors that recorded it; both inlets may have one.
        both = zero_of.get(SUPPLY, 0.0)
        off = {
            "path.level": zero_of.get(ANGLE, 0.0),
            "plant.supply_pressure": both,
            "plant.dorsiflexion_pressure": zero_of.get(DORSIFLEXION_SUPPLY, both),
        }
        moved = {path: values - off.get(path, 0.0) for path, values in prepared.inputs.parameters.items()}
        own = {path: column[members] for path, column in rest.items()}
        inputs = StepInputs(prepared.inputs.command, moved)
        part = _run_signals(replace(prepared, inputs=inputs), own, len(members))
        for name, values in part.items():
            found.setdefault(name, np.empty((len(values), count)))[:, members] = values
    return found


def _run_signals(prepared: PreparedExperiment, columns: Mapping[str, Floats], count: int) -> dict[str, Floats]:
    """Return the signals of ideal sensors [SI] (samples, runs)."""
    run = run_with(prepared, columns)
    kept, failure = _rows_of(run.program)
    records: Floats | None = None
    failed = np.zeros(count, dtype=np.bool_)
    # A program has up to 32 lanes; more runs are several batches.
    for members, batch in batches_of(run, count):
        outcome = run_batch(batch, threads=1) if prepared.inputs is None else replay(batch, prepared.inputs)
        ends = outcome.states
        # A run that leaves what is possible, or is no number, tells the search nothing.
        failed[members] = (ends[failure] < NEVER_FAILED) | ~np.isfinite(ends).all(axis=0)
        if records is None:
            records = np.empty((len(kept), len(outcome.record), count))
        for place, row in enumerate(kept):
            records[place][:, members] = outcome.record[:, row]
    assert records is not None
    offsets = np.broadcast_to(columns.get(TIME_OFFSET, np.array(0.0)), (count,))
    angle, mass_1, mass_2 = (_at_samples(one, prepared, offsets) for one in records)
    found = {name: np.full(angle.shape, np.nan) for name in ("angle", "pressure_1", "pressure_2")}
    numbers = leaves(run.plant)
    # Pressures follow from mass and angle by the plant, whose numbers differ from run to run.
    for element in np.flatnonzero(~failed).tolist():
        plant = rebuilt(run.program.actuator.plant, [at(number, element) for number in numbers])
        own = angle[:, element], mass_1[:, element], mass_2[:, element]
        pressures = pressures_of(run.program.actuator, plant, *own)
        for name, values in zip(found, (own[0], *pressures), strict=True):
            found[name][:, element] = values
    return {channel.name: found[channel.name] for channel in prepared.channels}


@lru_cache(maxsize=16)
def _rows_of(program: Program) -> tuple[tuple[int, ...], int]:
    """Return the rows of the state from which channels are computed, and the row with the time of a failure."""
    rows = row_numbers(program.state_rows())
    return tuple(rows[f"state.{name}"] for name in ("angle", "mass_1", "mass_2")), rows["result.failure_time"]


def _at_samples(values: Floats, prepared: PreparedExperiment, offsets: Floats) -> Floats:
    """Return a state at the sample times, interpolated linearly between records; each run has a time offset [s]."""
    if offsets.any():
        # Before the first record the device stands still.
        interval = prepared.run.step * prepared.run.record_every
        position = np.clip((prepared.time[:, None] - offsets) / interval, 0.0, len(values) - 1.0)
        place = np.minimum(position.astype(np.intp), len(values) - 2)
        elements = np.arange(len(offsets))
        here, following = values[place, elements], values[place + 1, elements]
        return np.asarray(here + (position - place) * (following - here))
    place, fraction = prepared.place, prepared.fraction
    here = values[place]
    if not fraction.any():
        return here
    following = values[np.minimum(place + 1, len(values) - 1)]
    return np.asarray(here + fraction[:, None] * (following - here))
