"""Weighted residuals and their Jacobian: each experiment is one block of lanes, each lane one set of numbers."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.lanes import run_batch
from ppafo.engine.program import Program
from ppafo.engine.replay import replay
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, Run, batches_of
from ppafo.engine.scheme.pneumatics import supply_range
from ppafo.errors import IdentificationError
from ppafo.identification.trajectory.experiment import TIME_OFFSET, with_numbers
from ppafo.identification.trajectory.preparation import Floats, PreparedExperiment
from ppafo.identification.trajectory.problem import Range
from ppafo.model.chambers import chamber_1_volume, chamber_2_volume, chamber_pressure
from ppafo.model.columns import at, over_runs
from ppafo.model.plant import PlantParameters
from ppafo.model.valves.catalog import VALVES
from ppafo.model.valves.kind import ValveKind
from ppafo.parameters.effects import effect_rows, switches_of
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.plan import (
    exact_orifice,
    initial_lines,
    initial_state,
    plant_behind_lines,
    thermal_parameters,
    valve_parameters,
)
from ppafo.simulation.scenario import FreeMotion

_KEPT = ("angle", "mass_1", "mass_2")


def numbers_in(label: str, ranges: Sequence[Range], point: Floats) -> dict[str, float]:
    """Return the numbers in SI units, by path, that a point of coordinates gives to the experiment with a label."""
    return {path: float(column[0]) for path, column in _columns_in(label, ranges, point[None, :]).items()}


def _columns_in(label: str, ranges: Sequence[Range], points: Floats) -> dict[str, Floats]:
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
        return _trajectories(prepared, _columns_in(prepared.label, ranges, points), len(points))

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
    device, motion = scenario.device, scenario.motion
    settings = device.valve.settings
    delay = base.program.valve.command_delay(settings)
    if not _keeps_program(base, VALVES[device.valve.kind], settings):
        raise IdentificationError(
            f"experiment '{prepared.label}': a setting of the valve went to or from 0, which is another "
            f"model of the valve; start above 0 and give a lower bound above 0"
        )
    if any(np.any(is_on != (effect in base.program.effects)) for effect, is_on in switches_of(device).items()):
        raise IdentificationError(
            f"experiment '{prepared.label}': an effect went on or off, which is another model; start above 0 and give "
            "a lower bound above 0"
        )
    bare = plant_parameters(device, motion.external_torque if isinstance(motion, FreeMotion) else 0.0)
    plant = plant_behind_lines(bare, scenario.supply_lines)
    # The engine allows a fraction of the supply pressure. Where that is fitted, the error in pascals must stay.
    allowed = supply_range(base.plant) / _supply_ranges(plant)
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
        effects=effect_rows(device),
    )


def _keeps_program(base: Run, kind: ValveKind, settings: Mapping[str, Any]) -> bool:
    """Return whether all runs with these settings of the valve have the program of another run."""
    counts = [value.size for value in settings.values() if isinstance(value, np.ndarray)]
    for run in range(max(counts, default=1)):
        own = {name: at(value, run) for name, value in settings.items()}
        valve = kind.choose(own)
        if valve != base.program.valve or (valve.command_delay(own) > 0.0) != base.program.late_commands:
            return False
    return True


def _supply_ranges(plant: PlantParameters) -> Any:
    """Return the pressure [Pa] of the higher supply over the atmosphere, an array where any of them is one."""
    pressures = plant.supply_pressure, plant.dorsiflexion_pressure, plant.atmospheric_pressure

    def one(first: float, second: float, atmosphere: float) -> float:
        return supply_range(
            plant._replace(supply_pressure=first, dorsiflexion_pressure=second, atmospheric_pressure=atmosphere)
        )

    return over_runs(one, *pressures)


def _trajectories(prepared: PreparedExperiment, columns: Mapping[str, Floats], count: int) -> dict[str, Floats]:
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
    found = _signals(run, *(_at_samples(one, prepared, offsets) for one in records))
    return {channel.name: np.where(failed, np.nan, found[channel.name]) for channel in prepared.channels}


@lru_cache(maxsize=16)
def _rows_of(program: Program) -> tuple[tuple[int, ...], int]:
    """Return the rows of the state that channels are made of, and that of the time of a failure."""
    rows = row_numbers(program.state_rows())
    return tuple(rows[f"state.{name}"] for name in _KEPT), rows["result.failure_time"]


def _signals(run: Run, angle: Any, mass_1: Any, mass_2: Any) -> dict[str, Floats]:
    """Return angle and pressures from angle and masses, all (samples, runs)."""
    plant = run.plant
    volume_1 = chamber_1_volume(angle, plant.angle_min, plant.volume_per_angle, plant.dead_volume_1)
    volume_2 = chamber_2_volume(angle, plant.angle_max, plant.volume_per_angle, plant.dead_volume_2)
    pressure_1: Any = chamber_pressure(mass_1, volume_1, plant.gas_product)
    pressure_2: Any = chamber_pressure(mass_2, volume_2, plant.gas_product)
    return {"angle": angle, "pressure_1": pressure_1, "pressure_2": pressure_2}


def _at_samples(values: Floats, prepared: PreparedExperiment, offsets: Floats) -> Floats:
    """Return a state at the times of the samples, by straight lines between records; each run with its offset [s]."""
    if offsets.any():
        return _at_moved_samples(values, prepared, offsets)
    place, fraction = prepared.place, prepared.fraction
    here = values[place]
    if not fraction.any():
        return here
    following = values[np.minimum(place + 1, len(values) - 1)]
    return np.asarray(here + fraction[:, None] * (following - here))


def _at_moved_samples(values: Floats, prepared: PreparedExperiment, offsets: Floats) -> Floats:
    """Return a state where samples are later than the run; before its first record the device stands still."""
    position = np.clip((prepared.time[:, None] - offsets) / prepared.record_interval, 0.0, len(values) - 1.0)
    place = np.minimum(position.astype(np.intp), len(values) - 2)
    lanes = np.arange(len(offsets))
    here, following = values[place, lanes], values[place + 1, lanes]
    return np.asarray(here + (position - place) * (following - here))


Mask = NDArray[np.bool_]

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
            return replace(prepared, scenario=with_numbers(prepared.scenario, acting), time_offset=offset)

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
        self._refuse_hopeless(~(use_above | use_below))
        change = np.where(use_above, above, centre) - np.where(use_below, below, centre)
        return np.asarray((change / (1.0 * use_above + use_below)) @ np.linalg.inv(self.directions))

    def jacobian(self) -> Floats:
        """Return the derivative of ``all_residuals`` [-] with respect to the coordinates."""
        _, deviation, has = prior_coordinates(self.residuals.ranges)
        return np.concatenate([self.jacobian_of_data(), np.diag(1.0 / deviation)[has]])

    def _is_inside(self, directions: Floats) -> Mask:
        low, high = coordinate_bounds(self.residuals.ranges)
        reached, touch = self.point[:, None] + directions, _TOUCH * np.abs(directions)
        inside = (reached <= high[:, None] + touch) & (reached >= low[:, None] - touch)
        return np.asarray(inside.all(axis=0))

    def _refuse_hopeless(self, hopeless: Mask) -> None:
        for direction in self.directions.T[hopeless]:
            index = int(np.argmax(np.abs(direction)))
            item = self.residuals.ranges[index]
            raise IdentificationError(
                f"{item.name}: no run succeeds near {item.number(float(self.point[index])):.6g}, so it cannot be "
                f"determined; give other bounds or another start"
            )


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
