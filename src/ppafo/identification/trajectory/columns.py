"""Many sets of numbers at once: each experiment is one block of lanes, each lane one set of numbers."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from ppafo.engine.lanes import Batch, BatchResult, run_batch
from ppafo.engine.replay import StepInputs, replay
from ppafo.engine.run import NEVER_FAILED, Run, batch_of
from ppafo.engine.scheme.pneumatics import supplied_range
from ppafo.errors import IdentificationError
from ppafo.identification.trajectory.paths import TIME_OFFSET, with_numbers
from ppafo.identification.trajectory.preparation import Floats, Prepared
from ppafo.identification.trajectory.ranges import Range
from ppafo.model.chambers import chamber_1_volume, chamber_2_volume, chamber_pressure
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.plan import exact_orifice, initial_state, thermal_parameters
from ppafo.simulation.sampled import state_row_numbers
from ppafo.simulation.scenario import FreeMotion

_OF_PRESSURE = ("gas_product", "volume_per_angle", "angle_min", "angle_max", "dead_volume_1", "dead_volume_2")


def numbers_in(prepared: Prepared, ranges: Sequence[Range], point: Floats) -> dict[str, float]:
    """Return the numbers in SI units, by path, that a point of coordinates gives to one experiment."""
    acting = [pair for pair in zip(ranges, point, strict=True) if pair[0].acts_in(prepared.label)]
    return {item.path: item.number(float(z)) for item, z in acting}


def trajectories(experiments: Sequence[Prepared], ranges: Sequence[Range], points: Floats) -> list[dict[str, Floats]]:
    """Return, for each experiment, its channels (samples, points) at many points (points, coordinates).

    A run that leaves what is possible is NaN throughout. Experiments run side by side, one thread each.
    """

    def one(prepared: Prepared) -> dict[str, Floats]:
        return _trajectories(prepared, [numbers_in(prepared, ranges, point) for point in points])

    workers = min(len(experiments), os.cpu_count() or 1)
    if workers == 1:
        return [one(prepared) for prepared in experiments]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(one, experiments))


def run_with(prepared: Prepared, numbers: Mapping[str, float]) -> Run:
    """Return the run of an experiment with other numbers, on the program and clock of all columns."""
    base = prepared.run
    scenario = with_numbers(prepared.scenario, numbers)
    device, motion = scenario.device, scenario.motion
    kind = VALVES[device.valve.kind]
    valve = kind.choose(device.valve.settings)
    delay = valve.command_delay(device.valve.settings)
    if valve != base.program.valve or (delay > 0.0) != base.program.late_commands:
        raise IdentificationError(
            f"experiment '{prepared.label}': a setting of the valve went to or from 0, which is another "
            f"model of the valve; start above 0 and give a lower bound above 0"
        )
    plant = plant_parameters(device, motion.external_torque if isinstance(motion, FreeMotion) else 0.0)
    # The engine allows a share of the supply pressure. Where that pressure is fitted, the error in pascals must stay.
    allowed = supplied_range(base.plant) / supplied_range(plant)
    return replace(
        base,
        plant=plant,
        tolerance=base.tolerance * allowed,
        thermal=thermal_parameters(scenario),
        valve_orifice=exact_orifice(device.valve.orifice, device),
        leak_orifice=exact_orifice(device.actuator.leak, device),
        initial=initial_state(scenario, plant),
        valve=valve.prepare(device.valve.settings),
        command_delay=delay,
    )


def _trajectories(prepared: Prepared, columns: Sequence[Mapping[str, float]]) -> dict[str, Floats]:
    runs = [run_with(prepared, numbers) for numbers in columns]
    outcomes = _outcomes(runs, prepared.inputs)
    rows = state_row_numbers(prepared.run)
    ends = np.concatenate([outcome.states for outcome in outcomes], axis=1)
    failed = (ends[rows["result.failure_time"]] < NEVER_FAILED) | ~np.isfinite(ends).all(axis=0)
    offsets = np.array([numbers.get(TIME_OFFSET, prepared.time_offset) for numbers in columns])

    def at_samples(name: str) -> Floats:
        whole = [outcome.record[:, rows[f"state.{name}"]] for outcome in outcomes]
        return _at_samples(whole[0] if len(whole) == 1 else np.concatenate(whole, axis=1), prepared, offsets)

    found = _signals(runs, at_samples("angle"), at_samples("mass_1"), at_samples("mass_2"))
    return {channel.name: np.where(failed, np.nan, found[channel.name]) for channel in prepared.channels}


def _outcomes(runs: Sequence[Run], inputs: StepInputs | None) -> list[BatchResult]:
    """Return all outcomes in order; neighbours of one clock share a block, and a fitted dead time changes the clock."""
    batches = [batch_of(run) for run in runs]
    outcomes, first = [], 0
    for last in range(1, len(batches) + 1):
        if last < len(batches) and batches[last].clock == batches[first].clock:
            continue
        members = batches[first:last]
        parameters = np.concatenate([batch.parameters for batch in members], axis=1)
        states = np.concatenate([batch.states for batch in members], axis=1)
        joint = Batch(members[0].program, members[0].clock, parameters, states)
        outcomes.append(run_batch(joint, threads=1) if inputs is None else replay(joint, inputs))
        first = last
    return outcomes


def _signals(runs: Sequence[Run], angle: Any, mass_1: Any, mass_2: Any) -> dict[str, Floats]:
    """Return angle and pressures from angle and masses, all (samples, runs)."""
    plant: dict[str, Any] = {name: np.array([getattr(run.plant, name) for run in runs]) for name in _OF_PRESSURE}
    volume_1 = chamber_1_volume(angle, plant["angle_min"], plant["volume_per_angle"], plant["dead_volume_1"])
    volume_2 = chamber_2_volume(angle, plant["angle_max"], plant["volume_per_angle"], plant["dead_volume_2"])
    pressure_1: Any = chamber_pressure(mass_1, volume_1, plant["gas_product"])
    pressure_2: Any = chamber_pressure(mass_2, volume_2, plant["gas_product"])
    return {"angle": angle, "pressure_1": pressure_1, "pressure_2": pressure_2}


def _at_samples(values: Floats, prepared: Prepared, offsets: Floats) -> Floats:
    """Return a state at the times of the samples, by straight lines between records; each run with its offset [s]."""
    if offsets.any():
        return _at_moved_samples(values, prepared, offsets)
    place, share = prepared.place, prepared.share
    here = values[place]
    if not share.any():
        return here
    following = values[np.minimum(place + 1, len(values) - 1)]
    return np.asarray(here + share[:, None] * (following - here))


def _at_moved_samples(values: Floats, prepared: Prepared, offsets: Floats) -> Floats:
    """Return a state where samples are later than the run; before its first record the device stands still."""
    position = np.clip((prepared.time[:, None] - offsets) / prepared.record_interval, 0.0, len(values) - 1.0)
    place = np.minimum(position.astype(np.intp), len(values) - 2)
    lanes = np.arange(len(offsets))
    here, following = values[place, lanes], values[place + 1, lanes]
    return np.asarray(here + (position - place) * (following - here))
