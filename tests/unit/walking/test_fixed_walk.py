"""Walks whose controller computes with whole numbers: what they cost, that the law decides, when it stops."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.control.fixed.walking_law import read_gait
from ppafo.engine.lanes import run_batch
from ppafo.engine.rows import leaf_paths, numbers, row_numbers
from ppafo.engine.run import batch_of
from ppafo.errors import ProgramError, ScenarioError
from ppafo.exports.c_library import c_library
from ppafo.exports.firmware.lock_step import PythonChip
from ppafo.exports.firmware.walking import walk_chip
from ppafo.model.sensors import Fault, GaitMeasurement, GaitSensors
from ppafo.model.valves.kind import VENT
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.sampled import run_sampled, state_row_numbers
from ppafo.walking.events import SAFE_ROW
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.person import draw_gaits
from ppafo.walking.planning import batch_of_many, converter_of_walk, gait_sensors_of, plan_walk
from ppafo.walking.walk import walk, with_device_off
from ppafo.walking.wearer import draw_builds

FIXED = "controller.arithmetic=fixed"


class InPython:
    """The integer controller as a Python object."""

    def __init__(self) -> None:
        self.chip = walk_chip(load_walk("solenoid", (FIXED,)))
        self.law = PythonChip(self.chip)

    def reset(self) -> None:
        self.law.begin()

    def update(self, time: float, reference: float, measurement: GaitMeasurement) -> float:
        return self.law.sample(read_gait(self.chip.converter, measurement))[0] / 1000 or VENT


@pytest.mark.parametrize("valve", ["solenoid", "proportional"])
def test_whole_numbers_cost_less_than_one_percent_of_gas_and_angle_with_either_valve(valve: str) -> None:
    floats, fixed = (walk("solenoid", 0.2, (f"device.valve={valve}", *further)) for further in ((), (FIXED,)))
    for name in ("gas", "angle_difference"):
        assert fixed.metrics[name].value == pytest.approx(floats.metrics[name].value, rel=0.01)
    assert fixed.metrics["vented_strides"].value == floats.metrics["vented_strides"].value == 0.0
    assert fixed.recording["command"].tolist() != floats.recording["command"].tolist()


def test_the_thresholds_of_many_wearers_vary_on_whole_numbers_as_in_floats() -> None:
    tables = {}
    for name, given in (("floats", ()), ("fixed", (FIXED,))):
        configuration = load_walk("solenoid", given)
        generator = np.random.default_rng(3)
        build = draw_builds(40, generator)
        gaits = draw_gaits(walk_of(configuration).gait, build.stature, generator)
        run = plan_walk(with_duration(configuration, 4.0))
        found = batch_of_many(with_duration(configuration, 4.0), build, gaits, generator)
        tables[name] = {path: found.parameters[row] for path, row in row_numbers(run.program.parameter_rows()).items()}
        alone = batch_of(run).parameters
        paths = [path for path in tables[name] if path.startswith("controller.")]
        assert all(tables[name][path][0] == alone[row_numbers(run.program.parameter_rows())[path], 0] for path in paths)
    converter = converter_of_walk(load_walk("solenoid", (FIXED,)))
    for whole, name in (("load", "load_threshold"), ("unload", "unload_threshold")):
        force = tables["floats"][f"controller.phases.{name}"]
        counts = tables["fixed"][f"controller.numbers.phase.{whole}"]
        shown = converter.force_zero + counts * converter.force_step / converter.scale
        assert np.allclose(shown, force, atol=0.51 * converter.force_step / converter.scale)
        assert np.unique(counts).size > 1
        assert np.array_equal(counts, np.rint(counts))
    starts = tables["fixed"]["controller.numbers.phase.push_off_start"] / 2.0**14
    assert np.allclose(starts, tables["floats"]["controller.phases.push_off_start"], atol=2.0**-15)


def test_the_lanes_decide_as_python_does() -> None:
    walked = with_duration(load_walk("solenoid", (FIXED,)), 4.0)
    run, own_controller = plan_walk(walked), InPython()
    inside = run_batch(batch_of(run))
    outside = run_sampled(batch_of(plan_walk(walked.controlled_by(own_controller))), own_controller)
    rows, own = state_row_numbers(run), row_numbers(replace(run.program, controller=None).state_rows())
    for path in ("result.command", "state.angle", "state.mass_1", "state.mass_2", "state.supplied_mass"):
        assert np.array_equal(inside.record[:, rows[path], 0], outside.record[:, own[path], 0])
    assert set(inside.record[:, rows["result.command"], 0]) == {-1.0, 1.0, VENT}


def found_at(configuration_overrides: tuple[str, ...], faults: list[dict[str, Any]]) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] at which each fault makes the controller help less, inf for never, and the levels at the end."""
    fault = ("faults.heel.kind=frozen", "faults.heel.time=99 s")
    configuration = load_walk("solenoid", (*configuration_overrides, *fault))
    run = plan_walk(with_duration(configuration, 9.0))
    single, rows = batch_of(run), state_row_numbers(run)
    paths = [path for group, row in single.program.parameter_rows().items() for path in leaf_paths(row, group)]
    places = [paths.index(path) for path in leaf_paths(GaitSensors, "gait_sensors")]
    sound = gait_sensors_of(configuration)._replace(heel_fault=gait_sensors_of(configuration).toe_fault)
    sensors = [sound._replace(**{f"{name}_fault": value for name, value in one.items()}) for one in faults]
    parameters = np.repeat(single.parameters, len(sensors), axis=1)
    parameters[places] = np.array([numbers(one) for one in sensors]).T
    states = np.repeat(single.states, len(sensors), axis=1)
    level = run_batch(replace(single, parameters=parameters, states=states)).record[:, rows[SAFE_ROW]]
    time = np.arange(level.shape[0]) * run.step * run.record_every
    return np.where(level.any(axis=0), time[np.argmax(level > 0.0, axis=0)], np.inf), level[-1]


def test_faults_are_found_as_soon_as_with_floats_and_end_in_the_same_state() -> None:
    faults = []
    for at in (3.6, 4.1):
        dead, held = Fault(at, 0.0, 0.0), Fault(at, 1.0, 0.0)
        faults += [{sensor: dead} for sensor in ("heel", "toe", "angle", "pressure_1", "pressure_2")]
        faults += [{sensor: held} for sensor in ("heel", "toe", "angle", "pressure_1", "pressure_2")]
        faults += [{sensor: Fault(at, 0.0, 5.0e6)} for sensor in ("heel", "toe", "angle", "pressure_1", "pressure_2")]
        faults += [{"heel": Fault(at, 0.0, 900.0)}, {"heel": dead, "toe": dead}, {}]
    floats, level = found_at((), faults)
    fixed, level_of_fixed = found_at((FIXED,), faults)
    assert np.array_equal(level, level_of_fixed)
    assert np.array_equal(np.isfinite(floats), np.isfinite(fixed))
    assert not np.isfinite(floats[[17, 35]]).any()
    seen = np.isfinite(floats)
    assert seen.sum() >= 30
    # The residual of an angle or a pressure that freezes grows slowly: where it passes its limit depends on the steps.
    held = np.isin(np.arange(len(faults)), [7, 8, 9, 25, 26, 27])
    assert np.abs(fixed[seen & ~held] - floats[seen & ~held]).max() <= 0.02
    assert np.abs(fixed[held] - floats[held]).max() <= 0.05


@pytest.mark.parametrize(
    ("fault", "kind", "sign", "within"),
    [
        ("regulator_1", "high", "supply_high", 0.02),
        ("valve_1", "stuck", "valve_open", 0.02),
        ("bottle", "empty", "supply_lost", 0.02),
        ("vane", "leaking", "valve_open", 0.2),  # its residual grows slowly
    ],
)
def test_a_fault_of_the_plant_has_the_sign_of_the_floats_in_the_same_stride(
    fault: str, kind: str, sign: str, within: float
) -> None:
    broken = (f"faults.{fault}.kind={kind}", f"faults.{fault}.time=3 s")
    floats, fixed = (walk("solenoid", 0.09, (*further, *broken)).events[0] for further in ((), (FIXED,)))
    assert floats.sign is not None
    assert fixed.sign is not None
    assert floats.sign.name == fixed.sign.name == sign
    assert fixed.time == pytest.approx(floats.time, abs=within)


def test_whole_numbers_climb_stairs_at_the_speed_that_fixed_limits_took_for_a_stuck_valve(tmp_path: Path) -> None:
    course = tmp_path / "stairs.toml"
    parts = [("stand", 'duration = "1 s"'), ("walk", "strides = 4"), ("stairs", "strides = 4"), ("walk", "strides = 2")]
    segments = (f'[[segment]]\nkind = "{kind}"\n{value}\n' for kind, value in parts)
    course.write_text('schema_version = 1\nname = "to-a-landing"\n' + "".join(segments))
    found = walk("solenoid", None, (FIXED,), course=course)
    assert not [event for event in found.events if event.sign is not None and event.sign.name != "no_heel"]
    assert found.recording["safe_state"].max() < 3.0


def test_what_stops_is_told_with_its_sign_and_readings() -> None:
    found = walk("solenoid", 0.1, (FIXED, "faults.pressure_1.kind=stuck", "faults.pressure_1.time=3 s"))
    event = found.events[-1]
    assert event.sign is not None
    assert (event.sign.name, event.readings["pressure_1"]) == ("pressure_range", 0.0)
    assert event.time == pytest.approx(3.0, abs=2.0e-3)


@pytest.mark.parametrize(
    ("name", "overrides", "said"),
    [
        ("solenoid", (FIXED, "controller.converter_bits=9.5"), "controller.converter_bits = 9.5: must be whole"),
        ("solenoid", (FIXED, "controller.converter_bits=15"), "must be at least 8 and at most 14"),
        ("solenoid", (FIXED, "controller.rate=8 kHz"), "first_stride .* would be 17600, beyond 0 to 16382"),
        ("solenoid", (FIXED, "controller.longest_phase=3"), "longest_phase .* would be 49152, beyond 0 to 32767"),
        ("solenoid", (FIXED, "timing.kind=fractional"), "know the time in the stride by thresholds only"),
        ("solenoid", ("controller.converter_bits=10",), r'needs controller.arithmetic = "fixed"'),
        ("proportional", (FIXED,), "no value 'controller.arithmetic'"),
    ],
)
def test_what_whole_numbers_cannot_hold_is_refused(name: str, overrides: tuple[str, ...], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        load_walk(name, overrides)


def test_the_device_off_and_another_controller_have_no_whole_numbers() -> None:
    configuration = load_walk("solenoid", (FIXED,))
    assert configuration.control.is_fixed
    assert not with_device_off(configuration).control.is_fixed
    given = ("controller.kind=event_on_off", FIXED, "controller.kind=event_pid")
    assert not load_walk("proportional", given).control.is_fixed


def test_whole_numbers_have_no_exported_library() -> None:
    with pytest.raises(ProgramError, match="no library yet; 'ppafo firmware' writes it"):
        c_library(load_walk("solenoid", (FIXED,)))


def test_a_late_sensor_has_no_controller_outside_the_lanes() -> None:
    late = load_walk(
        "solenoid", (FIXED, "faults.heel.kind=distorted", "faults.heel.time=1 s", "faults.heel.delay=9 ms")
    )
    with pytest.raises(ScenarioError, match="no controller outside the lanes"):
        walk(with_duration(late, 6.0).controlled_by(InPython()))


def test_an_object_of_ones_own_walks_as_the_law_that_it_is() -> None:
    base = with_duration(load_walk("solenoid", (FIXED,)), 6.0)
    own, lanes = walk(base.controlled_by(InPython())), walk(base)
    assert own.recording["angle"].tolist() == lanes.recording["angle"].tolist()
    assert own.metrics["gas"].value == pytest.approx(lanes.metrics["gas"].value, rel=1e-12)
    rows = run_ensemble(base.controlled_by(InPython()), {"wearer.body_mass": np.array([72.5, 80.0])}, ["total_gas"])
    assert rows.metrics["total_gas"][0] == pytest.approx(lanes.metrics["total_gas"].value, rel=1e-12)
