"""Every fault of every sensor, in every part of the stride, against the table of the page of evidence."""

import re
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.engine.lanes import Batch, run_batch
from ppafo.engine.rows import leaf_paths, numbers
from ppafo.engine.run import batch_of, state_row_numbers
from ppafo.model.contact import TOE
from ppafo.model.helping import HELPS, LIFTS
from ppafo.model.plant import chamber_pressures
from ppafo.model.sensors import Fault, GaitSensors
from ppafo.units import parse_quantity
from ppafo.walking import load_walk, walk_population
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.planning import gait_sensors_of, plan_walk
from ppafo.walking.safety_events import SAFE_ROW
from ppafo.walking.walk import walk

PAGE = (Path(__file__).parents[3] / "docs" / "evidence.md").read_text(encoding="utf-8")
SECTION = PAGE.partition("## Sensor faults")[2].partition("\n## ")[0]
CONFIGURATIONS = (
    *("solenoid", "proportional"),
    *(pytest.param(f"{valve}-regulators", marks=pytest.mark.thorough) for valve in ("solenoid", "proportional")),
)
PHASES = 20
"""Instants of a stride at which each fault begins."""
FIRST_FAULT = 3.0
"""Strides before the first fault."""
AFTER = 1.6
"""Strides that are watched after the latest fault."""
LIFTED_PUSH = 0.7 / 1.451e-5
"""Pressure over the other chamber [Pa] with the largest torque that may press the toes down in the air, 0.7 N m."""
LANES = 32
RECORD_EVERY = 2

Floats = NDArray[np.float64]


def rows_of(first: str) -> list[list[str]]:
    """Cells of the rows of the section's table whose head begins with ``first``."""
    table = re.search(rf"^\| {first}.*?\n\|[-|]+\n((?:\|.*\n)+)", SECTION, re.MULTILINE)
    assert table is not None
    return [[cell.strip().replace("`", "") for cell in line.strip("|\n").split("|")] for line in table[1].splitlines()]


FAULTS = {f"{sensor} {fault}": (sensor, fault, float(strides)) for sensor, fault, strides in rows_of("Sensor")}
VENTED = {
    name: (parse_quantity(pressure, "Pa_d", STANDARD_ATMOSPHERE), parse_quantity(time, "s", STANDARD_ATMOSPHERE))
    for name, pressure, time in rows_of("Configuration")
}


def sensors_of(name: str, what: str) -> GaitSensors:
    """Sensors of the configuration with the fault as the table gives it, from the beginning of the walk."""
    return gait_sensors_of(load_walk(name, fault_words(what)))


def fault_words(what: str) -> list[str]:
    sensor, fault, _ = FAULTS[what]
    kind, _, reading = fault.partition(" at ")
    given = [f"faults.{sensor}.kind={kind}", f"faults.{sensor}.time=0 s"]
    return given + ([f"faults.{sensor}.reading={reading}"] if reading else [])


def beginning(sensors: GaitSensors, time: float) -> GaitSensors:
    """The same sensors with their fault from a time [s] on."""
    late = {name: fault._replace(time=time) for name, fault in sensors._asdict().items() if fault_at_once(fault)}
    assert len(late) == 1
    return sensors._replace(**late)


def fault_at_once(value: object) -> bool:
    return isinstance(value, Fault) and value.time == 0.0


@dataclass(frozen=True)
class Injected:
    """Samples [s], when each fault begins and is found [s] (faults, PHASES), and the pressures that may be left.

    ``pressure`` [Pa] is (samples, faults, PHASES): the higher gauge pressure or, where the foot is lifted only, that of
    chamber 1 over chamber 2, which pushes; ``lifted`` is True for these runs. ``stride`` is the stride time [s].
    """

    time: Floats
    begins: Floats
    found: Floats
    pressure: Floats
    stride: float
    lifted: NDArray[np.bool_]


@lru_cache
def injected(name: str) -> Injected:
    configuration = load_walk(name)
    stride = walk_of(configuration).gait.stride_time
    begins = (FIRST_FAULT + np.arange(PHASES) / PHASES) * stride
    sensors = [beginning(sensors_of(name, what), time) for what in FAULTS for time in begins.tolist()]
    faulty = load_walk(name, fault_words(next(iter(FAULTS))))
    run = plan_walk(with_duration(faulty, (FIRST_FAULT + 1.0 + AFTER) * stride))
    single = batch_of(run)
    paths = [path for group, row in single.program.parameter_rows().items() for path in leaf_paths(row, group)]
    places = [paths.index(path) for path in leaf_paths(GaitSensors, "gait_sensors")]
    parameters = np.repeat(single.parameters, len(sensors), axis=1)
    parameters[places] = np.array([numbers(one) for one in sensors]).T
    states = np.repeat(single.states, len(sensors), axis=1)
    rows, clock = state_row_numbers(run), replace(single.clock, record_every=RECORD_EVERY)
    names = (SAFE_ROW, "state.angle", "state.mass_1", "state.mass_2")
    records = []
    for first in range(0, len(sensors), LANES):
        part = slice(first, first + LANES)
        record = run_batch(Batch(single.program, clock, parameters[:, part], states[:, part])).record
        records.append(record[:, [rows[item] for item in names]])
    level, *state = np.concatenate(records, axis=2).transpose(1, 0, 2)
    chambers = chamber_pressures(run.plant, *state)
    lifted = level[-1] == LIFTS
    vented = np.maximum(*chambers) - run.plant.atmospheric_pressure
    pressure = np.where(lifted & (level > HELPS), np.subtract(*chambers), vented)
    time = np.arange(level.shape[0]) * run.step * RECORD_EVERY
    found = np.where(level[-1] > HELPS, time[np.argmax(level > HELPS, axis=0)], np.inf)
    shape = (len(FAULTS), PHASES)
    tiled = np.tile(begins, (len(FAULTS), 1))
    return Injected(time, tiled, found.reshape(shape), pressure.reshape(-1, *shape), stride, lifted.reshape(shape))


@pytest.mark.parametrize("name", CONFIGURATIONS)
@pytest.mark.parametrize("what", FAULTS)
def test_a_fault_is_found_within_the_stated_time_wherever_in_the_stride_it_begins(name: str, what: str) -> None:
    walks, row = injected(name), list(FAULTS).index(what)
    late = (walks.found[row] - walks.begins[row]) / walks.stride
    assert late.min() >= 0.0, "nothing is found before it happens"
    assert late.max() <= FAULTS[what][2]


@pytest.mark.parametrize("name", CONFIGURATIONS)
@pytest.mark.parametrize("what", FAULTS)
def test_both_chambers_then_lose_their_pressure_for_good_or_what_pushes_where_the_heel_is_missed(
    name: str, what: str
) -> None:
    walks, row = injected(name), list(FAULTS).index(what)
    most, within = VENTED[name]
    due = walks.time[:, None] >= walks.found[row] + within
    assert due.sum(axis=0).min() * walks.time[1] > 0.2 * walks.stride, "there is something to see"
    limit = np.where(walks.lifted[row], LIFTED_PUSH, most)
    assert (walks.pressure[:, row] - limit)[due].max() <= 0.0
    missed = (
        "heel stuck at 0 N",
        "heel stuck at 20 N",
        "heel frozen",
    )  # One that freezes in the air shows no load from then on.
    assert walks.lifted[row].any() <= (what in missed), "a foot is lifted where the heel is missed"
    assert walks.pressure[walks.time < walks.begins.min(), row].max() > 5.0 * most, "the device worked before"


def test_the_table_has_every_sensor_dead_frozen_and_beyond_its_range() -> None:
    sensors = {"heel", "toe", "angle", "pressure_1", "pressure_2"}
    kinds = {(sensor, fault.partition(" ")[0]) for sensor, fault, _ in FAULTS.values()}
    assert kinds == {(sensor, kind) for sensor in sensors for kind in ("stuck", "frozen")}
    at_once = {sensor for sensor, _, strides in FAULTS.values() if strides <= 0.01}
    assert at_once == sensors


IDEAL: list[str] = []
STEPS = ["force_resolution=15 N", "angle_resolution=2 deg", "pressure_resolution=5 kPa_d"]
NOISE = [
    *("force_noise=10 N", "angle_noise=0.5 deg", "pressure_noise=2 kPa_d"),
    *("lost_share=0.1", "angle_lost_share=0.1", "pressure_lost_share=0.1"),
    *("angle_bandwidth=30 Hz", "pressure_bandwidth=50 Hz"),
]


@pytest.mark.parametrize("name", CONFIGURATIONS)
@pytest.mark.parametrize(
    "sensors", [pytest.param(IDEAL, marks=pytest.mark.thorough), STEPS, NOISE], ids=["ideal", "steps", "noise"]
)
def test_nobody_of_two_hundred_wearers_is_vented_without_a_fault(name: str, sensors: list[str]) -> None:
    configuration = load_walk(name, [f"sensors.{text}" for text in sensors])
    people = walk_population(configuration, minutes=0.4, wearers=200, seed=1)
    assert (people.count, people.diverged, people.vented, people.paused) == (200, 0, 0, 0)
    assert people.outcomes["gas"].min() > 1.0e-4


def test_wearers_whose_controller_paused_or_stopped_are_counted_with_the_sign() -> None:
    given = ["faults.heel.kind=stuck", "faults.heel.time=3 s", "controller.largest_drop=10000 N"]
    people = walk_population(load_walk("solenoid", given), minutes=0.15, wearers=9)
    assert (people.vented, people.paused) == (0, 9)
    assert sum(people.fault_flags.values()) == 9
    assert set(people.fault_flags) <= {"no_heel", "toe_strides"}
    configuration = load_walk("solenoid", ["faults.toe.kind=frozen", "faults.toe.time=3.2 s"])
    people = walk_population(configuration, minutes=0.15, wearers=9)
    assert people.vented + people.paused == 9
    assert people.vented >= 5


def test_a_toe_channel_that_shows_the_heel_brakes_no_push_off() -> None:
    fault = ["faults.toe.kind=distorted", "faults.toe.time=0 s", "faults.toe.crosstalk=1"]
    result = walk(load_walk("proportional", fault), minutes=0.09)
    on_toes = result.recording["contact"] == TOE
    assert -result.recording["torque"][on_toes].min() < 0.5
    assert [event.fault_flag.name for event in result.events if event.fault_flag is not None][:1] == ["no_toe_off"]
