"""Faults of the plant in ``[faults]`` of a walk, and the shut-off valve of its safe state."""

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.rows import leaf_paths
from ppafo.engine.run import batch_of
from ppafo.errors import ScenarioError
from ppafo.model.fault_catalogue import PLANT_FAULTS
from ppafo.model.helping import STOPPED
from ppafo.model.plant_faults import SOUND, PlantFaults
from ppafo.model.shut_off import NOT_FITTED
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.planning import failing_of, plan_walk
from ppafo.walking.walk import WalkResult, walk

FAILS = 4.3
SHUT_OFF = "shut_off.area=10 mm^2"


def broken(name: str, part: str, kind: str, *more: str) -> WalkResult:
    given = [f"faults.{part}.kind={kind}", f"faults.{part}.time={FAILS} s", *more]
    return walk(load_walk(name, given), minutes=0.16)


def test_every_fault_of_the_catalogue_sets_fields_that_there_are() -> None:
    known = {path.lstrip(".") for path in leaf_paths(PlantFaults, "")}
    for part, kinds in PLANT_FAULTS.items():
        for kind, fault in kinds.items():
            assert (fault.part, fault.kind) == (part, kind)
            assert set(fault.fields) == {item.name for item in fault.quantities}
            assert set(fault.fields.values()) <= known
            assert fault.summary


def test_a_walk_without_faults_is_composed_without_them_and_sound_numbers_change_no_bit() -> None:
    sound = plan_walk(with_duration(load_walk("solenoid"), 6.0))
    assert not sound.program.faults
    assert sound.walk is not None
    never = plan_walk(with_duration(load_walk("solenoid", ["faults.vane.kind=leaking", "faults.vane.time=1e5 s"]), 6.0))
    assert never.program.faults
    first, second = (run_batch(batch_of(run)).states[:, 0] for run in (sound, never))
    for path, row in rows_of(sound).items():
        assert first[row] == second[rows_of(never)[path]], path


def rows_of(run) -> dict[str, int]:  # type: ignore[no-untyped-def]
    paths = [path for name, row in run.program.state_rows().items() for path in leaf_paths(row, name)]
    return {path: place for place, path in enumerate(paths)}


@pytest.mark.parametrize("part", ["valve_1", "valve_2"])
def test_a_valve_stuck_open_is_found_and_only_a_shut_off_takes_its_torque_away(part: str) -> None:
    bare, safe = broken("proportional", part, "stuck"), broken("proportional", part, "stuck", SHUT_OFF)
    for result in (bare, safe):
        assert result.events[0].fault_flag is not None
        assert result.events[0].fault_flag.name in ("valve_open", "valve_shut")
        assert result.events[0].time < FAILS + 2.0 * walk_of(result.scenario).gait.stride_time
    settled = bare.recording.time > bare.events[0].time + 0.5
    device = bare.scenario.device
    held = device.actuator.torque_constant * (device.supply.pressure - device.supply.atmospheric_pressure)
    # The leg turns the vane against gas that cannot leave, which gives more than the supply holds.
    assert np.abs(bare.recording["torque"][settled]).max() > 1.2 * held
    assert np.abs(safe.recording["torque"][safe.recording.time > safe.events[0].time + 0.5]).max() < 2.0


@pytest.mark.parametrize("name", ["solenoid", "proportional"])
def test_the_sign_names_the_cause(name: str) -> None:
    for part, kind, names in (
        ("regulator_1", "high", ("supply_high",)),
        ("regulator_2", "creeping", ("supply_high",)),
        ("regulator_2", "frozen", ("supply_low",)),
        ("bottle", "empty", ("supply_low", "supply_lost")),
        ("hose_1", "off", ("supply_lost",)),
        # It fills too little and vents too slowly: both flags name a kinked hose.
        ("hose_2", "kinked", ("supply_low", "valve_shut")),
        ("vane", "leaking", ("leak",)),
        # What one chamber gains the other one loses here too, but none of it came there.
        ("valve", "swapped", ("valve_open", "supply_lost")),
    ):
        (event, *_) = broken(name, part, kind).events
        assert event.fault_flag is not None
        assert event.fault_flag.name in names, (part, kind)


def test_help_comes_back_after_a_brown_out() -> None:
    result = broken("solenoid", "controller", "brown_out")
    dark = (result.recording.time > FAILS + 0.02) & (result.recording.time < FAILS + 0.28)
    assert (result.recording["command"][dark] == 2.0).all()
    assert result.helped[-1]


def test_a_fault_that_a_part_does_not_have_and_a_regulator_behind_lines_are_refused() -> None:
    with pytest.raises(ScenarioError, match="burst"):
        load_walk("solenoid", ["faults.hose_1.kind=burst", "faults.hose_1.time=1 s"])
    with pytest.raises(ScenarioError, match="supply_line"):
        load_walk("solenoid-regulators", ["faults.regulator_1.kind=high", "faults.regulator_1.time=1 s"])
    with pytest.raises(ScenarioError, match=r"shut_off\.area"):
        load_walk("solenoid", ["shut_off.delay=10 ms"])


def test_a_controller_that_is_silent_for_too_long_is_shut_off_by_the_watchdog_and_a_shorter_silence_is_not() -> None:
    late = ("faults.controller.kind=late", "faults.controller.time=3.2 s", SHUT_OFF)
    patient, watched = (
        walk("solenoid", minutes=0.12, overrides=(*late, *more)) for more in (("shut_off.silence=1 s",), ())
    )
    seen = [
        [(event.time, event.fault_flag.name) for event in found.events if event.fault_flag]
        for found in (patient, watched)
    ]
    assert seen[1] == [(pytest.approx(3.21, abs=2e-3), "silent_controller")]
    assert watched.events[-1].level == STOPPED
    assert "silent_controller" not in [name for _, name in seen[0]]
    time, commands = watched.recording.time, [found.recording["command"] for found in (patient, watched)]
    # It sends no command any more, and what is left is the pinch of vented chambers.
    assert [np.unique(command[time > 3.22]).size for command in commands] == [2, 1]
    assert np.abs(watched.recording["torque"][time > 3.21 + 0.5]).max() < 1.0


def test_without_a_fault_and_a_shut_off_valve_there_is_nothing_that_fails() -> None:
    assert failing_of(load_walk("solenoid")) is None
    found = failing_of(load_walk("solenoid", ["faults.vane.kind=leaking", "faults.vane.time=1 s"]))
    assert found == (replace_leak(1.0), NOT_FITTED)


def replace_leak(time: float) -> PlantFaults:
    return SOUND._replace(leak_time=time, leak_factor=50.0)
