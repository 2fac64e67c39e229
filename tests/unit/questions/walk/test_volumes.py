"""What a walk, a bottle and their files say of the other volumes that the chambers may have."""

import json
from pathlib import Path

import pytest

import ppafo
from ppafo.answers.writing import text_of
from ppafo.questions.endurance.answer import Endurance
from ppafo.questions.endurance.solve import endurance
from ppafo.questions.walk.answer import WalkPair, Wearers, walk_with_and_without
from ppafo.walking.bottle import minutes_text

MINUTES = 0.1


@pytest.fixture(scope="module")
def pair() -> WalkPair:
    found = walk_with_and_without("solenoid", MINUTES)
    assert isinstance(found, WalkPair)
    return found


@pytest.fixture(scope="module")
def folder(pair: WalkPair, tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("walk") / "out"
    pair.save(place)
    return place


def test_the_other_rows_are_walks_with_the_other_set(pair: WalkPair) -> None:
    own, consistent, short = pair.volumes
    assert own.result is pair.comparison.with_device
    again = ppafo.walk("solenoid", MINUTES, overrides=["device.set=ppafo2011-consistent"])
    assert consistent.result.metrics["gas"].value == again.metrics["gas"].value
    gas = [one.result.metrics["gas"].value for one in (short, own, consistent)]
    assert gas == sorted(gas)
    assert short.peak_torque > consistent.peak_torque > own.peak_torque


def test_shaft_and_gas_differ_by_the_stated_loss_where_virtual_work_holds(pair: WalkPair) -> None:
    own, *others = pair.volumes
    assert [one.shaft_work / one.gas_work for one in others] == pytest.approx([0.8, 0.8], rel=0.01)
    assert own.shaft_work / own.gas_work == pytest.approx(14.51 / 51.0)


def test_the_work_of_the_gas_is_that_of_its_energy_balance() -> None:
    gas = ["gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=50 W/(m^2 K)"]
    changes = [*gas, "gas_model.wall_area_per_volume=100 1/m"]
    found = walk_with_and_without("solenoid", MINUTES, overrides=changes)
    assert isinstance(found, WalkPair)
    own = found.volumes[0]
    first, last = (int(own.result.starts[place]) for place in (2, -1))
    work = own.result.recording["gas_work"]
    strides = own.result.starts.size - 3
    assert own.gas_work == pytest.approx((work[last] - work[first]) / strides, rel=0.01)


def test_the_interval_of_a_bottle_has_the_chambers_that_outlast_the_walk() -> None:
    small = ["bottle.gas_mass=6 g", "bottle.volume=30 cm^3"]
    found = walk_with_and_without("solenoid", 0.25, bottle="paper-co2-9oz", overrides=small)
    assert isinstance(found, WalkPair)
    short = found.volumes[2]
    assert short.result.supply is not None
    assert short.result.supply.ending.kind == "walk's end"
    assert short.on_bottle is not None
    assert short.on_bottle.ending.kind == "empty"
    assert 15.0 < short.on_bottle.ending.time < 20.0
    lasts = minutes_text(short.on_bottle.ending.time)
    assert f" to {lasts} depending on the volume of the chambers" in text_of(found.answer())


def test_volumes_of_ones_own_and_a_walk_without_gas_have_no_other_rows() -> None:
    for name, changes in (("solenoid", ["actuator.volume_per_angle=20 cm^3/rad"]), ("off", [])):
        found = walk_with_and_without(name, MINUTES, overrides=changes)
        assert isinstance(found, WalkPair)
        assert found.volumes == ()
        assert "What rests on the volume" not in text_of(found.answer())


@pytest.fixture(scope="module")
def course() -> WalkPair:
    found = walk_with_and_without("solenoid", course="stairs")
    assert isinstance(found, WalkPair)
    return found


def test_a_course_is_walked_again_with_the_other_chambers(course: WalkPair) -> None:
    gas = course.comparison.with_device.metrics["course_gas"].value
    taken = [one.result.metrics["course_gas"].value for one in course.volumes]
    assert taken[0] == gas
    assert taken[2] < 0.8 * taken[1]


def test_a_bottle_takes_the_folder_of_a_course(course: WalkPair, tmp_path: Path) -> None:
    # What a bottle reads of the folder of a walk; the rest is figures.
    answer = course.answer()
    (tmp_path / "walk.json").write_text(json.dumps(answer.data), encoding="utf-8")
    (tmp_path / "recording.nc").write_bytes(answer.files["recording.nc"]())
    life = endurance(tmp_path, longest=30.0)
    assert isinstance(life, Endurance)
    time = course.comparison.with_device.metrics["course_time"].value
    assert life.discharge.walking_time == pytest.approx(30.0, abs=0.2)
    assert life.discharge.strides == pytest.approx(life.discharge.walking_time / time, rel=1e-2)
    assert len(life.others) == 2


def test_wearers_walk_again_with_the_other_chambers() -> None:
    found = walk_with_and_without("solenoid", MINUTES, wearers=20, seed=4)
    assert isinstance(found, Wearers)
    again = walk_with_and_without(
        "solenoid", MINUTES, wearers=20, seed=4, overrides=["device.set=ppafo2011-consistent"]
    )
    assert isinstance(again, Wearers)
    own, consistent, _ = found.volumes.values()
    assert own is found.population
    assert (consistent.outcomes["gas"] == again.population.outcomes["gas"]).all()
    assert "What rests on the volume of the chambers" in text_of(found.answer())
    own_chambers = walk_with_and_without(
        "solenoid", MINUTES, wearers=2, overrides=["actuator.volume_per_angle=20 cm^3/rad"]
    )
    assert isinstance(own_chambers, Wearers)
    assert own_chambers.volumes == {}


def test_a_run_is_run_again_from_its_folder_with_the_other_chambers(tmp_path: Path) -> None:
    scenario = "torque-task-solenoid"
    ppafo.simulate(ppafo.load_scenario(scenario, ["run.duration=0.3 s"])).save(tmp_path / "out")
    life = endurance(tmp_path / "out")
    assert isinstance(life, Endurance)
    other = life.others["ppafo2011-consistent"]
    volumes = ["actuator.volume_per_angle=18.1 cm^3/rad", "actuator.dead_volume_1=32 cm^3"]
    again = ppafo.simulate(
        ppafo.load_scenario(scenario, ["run.duration=0.3 s", *volumes, "actuator.dead_volume_2=32 cm^3"])
    )
    assert other.draw.mass_per_stride == pytest.approx(again.recording["supplied_mass"][-1], rel=2e-3)
    (tmp_path / "out" / "run.json").write_text(
        (tmp_path / "out" / "run.json").read_text(encoding="utf-8").replace("1.451e-05", "1.551e-05"), encoding="utf-8"
    )
    changed = endurance(tmp_path / "out")
    assert isinstance(changed, Endurance)
    assert changed.others == {}, "the device of the folder is not what its file says"
