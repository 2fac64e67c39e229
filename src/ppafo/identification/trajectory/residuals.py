"""Experiments made ready for fitting, their runs, and the weighted residuals of these with their Jacobian.

Each experiment is one block of lanes, each lane one set of numbers. One clock serves all columns: the step stays as it
is during the search. The parts in which the engine does it follow the numbers, though, and any other choice of them
moves a run a little. Runs of a fit are allowed so little error that differences hardly see it.
"""

import math
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import StepInputs, replay, run_batch
from ppafo.engine.program import Program
from ppafo.engine.rows import leaves, rebuilt, row_numbers
from ppafo.engine.run import NEVER_FAILED, Run, batches_of
from ppafo.engine.scheme.actuators import pressures_of
from ppafo.engine.scheme.pneumatics import supply_range
from ppafo.errors import IdentificationError
from ppafo.identification.linear_systems import inverse_of_steps
from ppafo.identification.trajectory.problem import (
    GAIN_OF,
    TIME_OFFSET,
    ZERO_OF,
    Experiment,
    scenario_of,
    with_numbers,
)
from ppafo.identification.trajectory.problem import Number as Range
from ppafo.model.catalog import VALVES
from ppafo.model.columns import at, over_runs
from ppafo.parameters.plant import effect_rows, plant_parameters, switches_of
from ppafo.signals.faults import MINIMUM_SAMPLES, is_at_limit, noise_of, plateaus
from ppafo.simulation.plan import (
    exact_orifice,
    initial_lines,
    initial_state,
    led_leg,
    outside_torque,
    plan_run,
    plant_behind_lines,
    thermal_parameters,
    valve_parameters,
    with_load,
)
from ppafo.simulation.recorded import ANGLE, RecordedInputs, step_inputs, with_prescribed_angle
from ppafo.simulation.scenario import FreeMotion, Scenario, vane_motion

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]

FIT_TOLERANCE = 0.02
"""Error that a run of a fit is allowed over that of any other run; columns of differences keep to 1e-3 with it."""
_FINER = 0.25
_FITS = 1.0e-6

_READ_INTERVAL = 5.0e-5
"""Seconds between two records that samples lie in between: a chamber fills within milliseconds ..."""
_MAXIMUM_RECORDS = 100_000
"""... and more where a recording is so long that memory would run out."""


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
    nothing. ``time_offset`` [s] is how much later the samples are than the run, where it is not fitted; ``of_sensors``
    has zeros and gains by path, where they are not.
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
    of_sensors: Mapping[str, float] = field(default_factory=dict)

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
    channels = []
    for name in experiment.channels:
        values = recording[name][inside]
        noise = experiment.noise[name] if name in experiment.noise else noise_of(values)
        clipped = max(plateaus(values), key=lambda item: item.count)
        if not noise > 0.0 and is_at_limit(values, clipped):
            raise IdentificationError(
                f"{said}: channel '{name}' is exactly its {clipped.word} value for {clipped.count} of {values.size} "
                "samples: its sensor is at its limit, and shows no noise there; end the recording before it, or give "
                "the standard deviation of the sensor in noise"
            )
        if not noise > 0.0:
            raise IdentificationError(
                f"{said}: channel '{name}' shows no noise from sample to sample, so its weight is "
                f"unknown: give its standard deviation in noise, for example from the sensor's data sheet"
            )
        channels.append(Measured(name, values, noise))
    scenario = replace(scenario_of(experiment), duration=float(time[-1]) + reach)
    recorded = RecordedInputs(recording, experiment.inputs, experiment.start) if experiment.inputs else None
    return prepare_samples(experiment.label, scenario, Samples(time, tuple(channels), reach), numbers, recorded)


def prepare_samples(
    label: str,
    scenario: Scenario,
    samples: Samples,
    numbers: Mapping[str, float],
    recorded: RecordedInputs | None = None,
) -> PreparedExperiment:
    """Return samples of a scenario's run made ready, at ``numbers`` [SI] by path."""
    run = replace(plan_run(with_numbers(scenario, numbers)), tolerance=FIT_TOLERANCE)
    nowhere = np.zeros(samples.time.size)
    unplaced = PreparedExperiment(label, scenario, run, samples, nowhere.astype(np.intp), nowhere, recorded)
    return _place_samples(unplaced, run)


def with_half_steps(prepared: PreparedExperiment, numbers: Mapping[str, float]) -> PreparedExperiment:
    """Return the experiment at ``numbers`` [SI] with steps half as long and a quarter of the allowed error."""
    scenario = replace(prepared.scenario, time_step=0.5 * prepared.run.step)
    run = plan_run(with_numbers(scenario, numbers))
    return _place_samples(prepared, replace(run, tolerance=_FINER * prepared.run.tolerance))


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
    read_interval = max(_READ_INTERVAL, float(samples.time[-1]) / _MAXIMUM_RECORDS)
    most = read_interval / step * (1.0 + _FITS)
    if most < 1.0:
        return 1.0 / math.ceil(1.0 / most)
    return max(count for count in range(1, int(most) + 1) if every % count == 0) if is_aligned else int(most)


def numbers_in(label: str, ranges: Sequence[Range], point: Floats) -> dict[str, float]:
    """Return the numbers in SI units, by path, that a point of coordinates gives to the experiment with a label."""
    return {path: float(column[0]) for path, column in columns_in(label, ranges, point[None, :]).items()}


def columns_in(label: str, ranges: Sequence[Range], points: Floats) -> dict[str, Floats]:
    """Return the same as columns, one number for each of many points (points, coordinates)."""
    acting = [pair for pair in zip(ranges, points.T, strict=True) if pair[0].acts_in(label)]
    return {item.path: np.array([item.number(z) for z in column.tolist()]) for item, column in acting}


def trajectories(
    experiments: Sequence[PreparedExperiment], ranges: Sequence[Range], points: Floats
) -> list[dict[str, Floats]]:
    """Return, for each experiment, its channels [SI] (samples, points) at many points (points, coordinates).

    A run that leaves what is possible is NaN throughout. Experiments run side by side, one thread each.
    """

    def one(prepared: PreparedExperiment) -> dict[str, Floats]:
        return signals_at(prepared, columns_in(prepared.label, ranges, points), len(points))

    workers = min(len(experiments), os.cpu_count() or 1)
    if workers == 1:
        return [one(prepared) for prepared in experiments]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(one, experiments))


def run_with(prepared: PreparedExperiment, numbers: Mapping[str, Any]) -> Run:
    """Return the run of an experiment with other numbers [SI], on its program and clock.

    A number may be an array (runs,), one for each of many runs. IdentificationError where a setting of the valve goes
    to or from 0.
    """
    base = prepared.run
    scenario = with_numbers(prepared.scenario, numbers)
    device, motion = scenario.device, vane_motion(scenario)
    settings: Mapping[str, Any] = device.valve.settings
    delay = base.program.valve.command_delay(settings)
    counts = [value.size for value in settings.values() if isinstance(value, np.ndarray)]
    for run in range(max(counts, default=1)):
        own = {name: at(value, run) for name, value in settings.items()}
        valve = VALVES[device.valve.kind].choose(own)
        if valve != base.program.valve or (valve.command_delay(own) > 0.0) != base.program.late_commands:
            raise IdentificationError(
                f"experiment '{prepared.label}': a setting of the valve went to or from 0, which is another "
                f"model of the valve; start above 0 and give a lower bound above 0"
            )
    if any(np.any(is_on != (effect in base.program.effects)) for effect, is_on in switches_of(device).items()):
        raise IdentificationError(
            f"experiment '{prepared.label}': an effect went on or off, which is another model; start above 0 and give "
            "a lower bound above 0"
        )
    bare = plant_behind_lines(plant_parameters(device, outside_torque(motion)), scenario.supply_lines)
    of_leg = motion.leg if isinstance(motion, FreeMotion) else None
    leg = None if of_leg is None else led_leg(bare, of_leg)
    plant = bare if leg is None else with_load(bare, leg.load)
    # The engine allows a fraction of the supply pressure. Where that is fitted, the error in pascals must stay.

    def range_of_supply(first: float, second: float, atmosphere: float) -> float:
        return supply_range(
            plant._replace(supply_pressure=first, dorsiflexion_pressure=second, atmospheric_pressure=atmosphere)
        )

    pressures = plant.supply_pressure, plant.dorsiflexion_pressure, plant.atmospheric_pressure
    allowed = supply_range(base.plant) / over_runs(range_of_supply, *pressures)
    return replace(
        base,
        plant=plant,
        tolerance=base.tolerance * allowed,
        thermal=thermal_parameters(scenario.thermal, device),
        valve_orifice=exact_orifice(device.valve.orifice, device),
        leak_orifice=exact_orifice(device.actuator.leak, device),
        initial=initial_state(scenario, plant),
        valve=valve_parameters(base.program.valve, settings),
        command_delay=delay,
        lines=initial_lines(plant, scenario.supply_lines),
        effects=effect_rows(device, scenario.effect_sections),
        leg=leg,
    )


def signals_at(prepared: PreparedExperiment, columns: Mapping[str, Floats], count: int) -> dict[str, Floats]:
    """Return the channels [SI] (samples, runs) of one experiment with other numbers [SI] in each of ``count`` runs.

    What differs only in zeros and gains of sensors is run once. A pressure sensor reads gauge pressure.
    """
    of_sensors = {path: column for path, column in columns.items() if path.startswith((ZERO_OF, GAIN_OF))}
    running = {path: column for path, column in columns.items() if path not in of_sensors}
    errors = {**prepared.of_sensors, **of_sensors}
    if not errors:
        return _run_signals(prepared, running, count)
    together = np.array([np.broadcast_to(column, (count,)) for column in running.values()]).reshape(-1, count)
    _, first, place = np.unique(together, axis=1, return_index=True, return_inverse=True)
    fewer = {path: np.broadcast_to(column, (count,))[first] for path, column in running.items()}
    found = _run_signals(prepared, fewer, len(first))
    atmosphere = prepared.scenario.device.supply.atmospheric_pressure
    for name, values in found.items():
        rest = 0.0 if name == ANGLE else atmosphere
        gain, zero = (np.asarray(errors.get(f"{path}{name}", 0.0)) for path in (GAIN_OF, ZERO_OF))
        found[name] = rest + (1.0 + gain) * (values[:, place.ravel()] - rest) + zero
    return found


def _run_signals(prepared: PreparedExperiment, columns: Mapping[str, Floats], count: int) -> dict[str, Floats]:
    """Return what ideal sensors would say."""
    run = run_with(prepared, columns)
    kept, failure = _rows_of(run.program)
    records: Floats | None = None
    failed = np.zeros(count, dtype=np.bool_)
    for members, batch in batches_of(run, count):
        outcome = run_batch(batch, threads=1) if prepared.inputs is None else replay(batch, prepared.inputs)
        ends = outcome.states
        failed[members] = (ends[failure] < NEVER_FAILED) | ~np.isfinite(ends).all(axis=0)
        if records is None:
            records = np.empty((len(kept), len(outcome.record), count))
        for place, row in enumerate(kept):
            records[place][:, members] = outcome.record[:, row]
    assert records is not None
    offsets = np.broadcast_to(columns.get(TIME_OFFSET, np.array(prepared.time_offset)), (count,))
    angle, mass_1, mass_2 = (_at_samples(one, prepared, offsets) for one in records)
    found = {name: np.full(angle.shape, np.nan) for name in ("angle", "pressure_1", "pressure_2")}
    numbers = leaves(run.plant)
    for lane in np.flatnonzero(~failed).tolist():
        plant = rebuilt(run.program.actuator.plant, [at(number, lane) for number in numbers])
        own = angle[:, lane], mass_1[:, lane], mass_2[:, lane]
        pressures = pressures_of(run.program.actuator, plant, *own)
        for name, values in zip(found, (own[0], *pressures), strict=True):
            found[name][:, lane] = values
    return {channel.name: found[channel.name] for channel in prepared.channels}


@lru_cache(maxsize=16)
def _rows_of(program: Program) -> tuple[tuple[int, ...], int]:
    """Return the rows of the state that channels are made of, and that of the time of a failure."""
    rows = row_numbers(program.state_rows())
    return tuple(rows[f"state.{name}"] for name in ("angle", "mass_1", "mass_2")), rows["result.failure_time"]


def _at_samples(values: Floats, prepared: PreparedExperiment, offsets: Floats) -> Floats:
    """Return a state at the times of the samples, by straight lines between records; each run with its offset [s]."""
    if offsets.any():
        # Before the first record the device stands still.
        position = np.clip((prepared.time[:, None] - offsets) / prepared.record_interval, 0.0, len(values) - 1.0)
        place = np.minimum(position.astype(np.intp), len(values) - 2)
        lanes = np.arange(len(offsets))
        here, following = values[place, lanes], values[place + 1, lanes]
        return np.asarray(here + (position - place) * (following - here))
    place, fraction = prepared.place, prepared.fraction
    here = values[place]
    if not fraction.any():
        return here
    following = values[np.minimum(place + 1, len(values) - 1)]
    return np.asarray(here + fraction[:, None] * (following - here))


FIRST_STEP = 1.0e-3
"""Step of a difference before standard errors are known: the fraction of a number by which it is moved."""

_TOUCH = 1.0e-9


class Whitens(Protocol):
    """A linear map that makes columns of residuals white."""

    def of(self, values: Floats) -> Floats:
        """Return columns (samples, columns) whitened [-]."""
        ...


@dataclass(frozen=True, slots=True)
class Residuals:
    """What is to be made small: (model - sample) / noise of all channels, then (coordinate - prior) / deviation.

    With ``whitening`` the former are made white by what is known of the noise of each sensor.
    """

    experiments: tuple[PreparedExperiment, ...]
    ranges: tuple[Range, ...]
    whitening: Whitens | None = None

    @property
    def start(self) -> Floats:
        """The coordinates at which the search begins, in their units."""
        return np.array([item.coordinate(item.start) for item in self.ranges])

    def of_data(self, points: Floats) -> Floats:
        """Return the samples' residuals [-] (samples, points) at points (points, coordinates); NaN if a run fails."""
        signals = trajectories(self.experiments, self.ranges, points)
        parts = [
            (of_one[channel.name] - channel.values[:, None]) / channel.noise
            for prepared, of_one in zip(self.experiments, signals, strict=True)
            for channel in prepared.channels
        ]
        values = np.concatenate(parts)
        return values if self.whitening is None else self.whitening.of(values)

    def of_priors(self, point: Floats) -> Floats:
        """Return the residuals [-] of the priors, one for each parameter that has one."""
        mean, deviation, has = prior_coordinates(self.ranges)
        return (point[has] - mean[has]) / deviation[has]

    def quick(self) -> "Residuals":
        """Return the same from runs that are allowed the usual error [-]: a third of the time, far from an optimum."""
        experiments = (
            replace(one, run=replace(one.run, tolerance=max(1.0, one.run.tolerance))) for one in self.experiments
        )
        return replace(self, experiments=tuple(experiments))

    def channel_slices(self) -> tuple[slice, ...]:
        """Return the place of each channel among the residuals of the samples."""
        lengths = [len(channel.values) for item in self.experiments for channel in item.channels]
        ends = np.cumsum(lengths).tolist()
        return tuple(slice(end - length, end) for end, length in zip(ends, lengths, strict=True))

    def around(self, point: Floats, directions: Floats) -> "Neighbourhood":
        """Return the residuals [-] at a point and a step away from it along each direction (column), all at once."""
        values = self.of_data(np.vstack([point + directions.T, point - directions.T, point]))
        return Neighbourhood(self, point, directions, values)

    def hold(self, held: Mapping[int, float]) -> "Residuals":
        """Return the residuals [-] of the other parameters, some (by place) being held at a coordinate."""
        names = {self.ranges[index]: self.ranges[index].number(at) for index, at in held.items()}

        def hold_in(prepared: PreparedExperiment) -> PreparedExperiment:
            acting = {item.path: number for item, number in names.items() if item.acts_in(prepared.label)}
            offset = acting.pop(TIME_OFFSET, prepared.time_offset)
            errors = {path: number for path, number in acting.items() if path.startswith((ZERO_OF, GAIN_OF))}
            return replace(
                prepared,
                scenario=with_numbers(prepared.scenario, acting),
                time_offset=offset,
                of_sensors={**prepared.of_sensors, **errors},
            )

        ranges = tuple(item for place, item in enumerate(self.ranges) if place not in held)
        return replace(self, experiments=tuple(hold_in(one) for one in self.experiments), ranges=ranges)


@dataclass(frozen=True, slots=True)
class Neighbourhood:
    """Residuals of the samples one step after a point along each direction, one step before it, and (last) at it."""

    residuals: Residuals
    point: Floats
    directions: Floats
    values: Floats

    @property
    def of_data(self) -> Floats:
        """Residuals [-] of the samples at the point."""
        return self.values[:, -1]

    def all_residuals(self) -> Floats:
        """Return all residuals [-] at the point, those of the priors last."""
        return np.concatenate([self.of_data, self.residuals.of_priors(self.point)])

    def jacobian_of_data(self) -> Floats:
        """Return the derivative of the samples' residuals [-] with respect to the coordinates, by central differences.

        Where a step leaves the bounds on one side, or the run there fails, the difference is one-sided.
        """
        count = self.directions.shape[1]
        above, below, centre = self.values[:, :count], self.values[:, count:-1], self.values[:, -1:]
        use_above = self._is_inside(self.directions) & np.isfinite(above).all(axis=0)
        use_below = self._is_inside(-self.directions) & np.isfinite(below).all(axis=0)
        for direction in self.directions.T[~(use_above | use_below)]:
            index = int(np.argmax(np.abs(direction)))
            item = self.residuals.ranges[index]
            raise IdentificationError(
                f"{item.name}: no run succeeds near {item.number(float(self.point[index])):.6g}, so it cannot be "
                f"determined; give other bounds or another start"
            )
        change = np.where(use_above, above, centre) - np.where(use_below, below, centre)
        return np.asarray((change / (1.0 * use_above + use_below)) @ inverse_of_steps(self.directions))

    def jacobian(self) -> Floats:
        """Return the derivative of ``all_residuals`` [-] with respect to the coordinates."""
        _, deviation, has = prior_coordinates(self.residuals.ranges)
        return np.concatenate([self.jacobian_of_data(), np.diag(1.0 / deviation)[has]])

    def _is_inside(self, directions: Floats) -> Mask:
        low, high = coordinate_bounds(self.residuals.ranges)
        reached, touch = self.point[:, None] + directions, _TOUCH * np.abs(directions)
        inside = (reached <= high[:, None] + touch) & (reached >= low[:, None] - touch)
        return np.asarray(inside.all(axis=0))


def coordinate_bounds(ranges: Sequence[Range]) -> tuple[Floats, Floats]:
    """Return the lower and upper bounds of all coordinates, in their units."""
    low = np.array([item.coordinate(item.low) for item in ranges])
    return low, np.array([item.coordinate(item.high) for item in ranges])


def prior_coordinates(ranges: Sequence[Range]) -> tuple[Floats, Floats, Mask]:
    """Return mean and deviation of the priors [unit], infinitely wide without one, and which coordinates have one."""
    mean, deviation = np.zeros(len(ranges)), np.full(len(ranges), np.inf)
    for index, item in enumerate(ranges):
        if item.prior is not None:
            mean[index] = item.coordinate(item.prior.mean)
            deviation[index] = item.prior.standard_deviation / abs(item.slope(float(mean[index])))
    return mean, deviation, np.isfinite(deviation)
