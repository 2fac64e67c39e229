"""What a walk, a bottle and their files say of the other volumes that the chambers may have."""

import json
from pathlib import Path

import pytest

import ppafo
from ppafo.answers.text import text_of
from ppafo.errors import DataError
from ppafo.questions.endurance.draw import read_walk_gas
from ppafo.questions.endurance.solve import Endurance, endurance
from ppafo.questions.walk.solve import WalkPair, walk_with_and_without

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


def test_volumes_of_ones_own_and_a_walk_without_gas_have_no_other_rows() -> None:
    for name, changes in (("solenoid", ["actuator.volume_per_angle=20 cm^3/rad"]), ("off", [])):
        found = walk_with_and_without(name, MINUTES, overrides=changes)
        assert isinstance(found, WalkPair)
        assert found.volumes == ()
        assert "What rests on the volume" not in text_of(found.answer())


def test_a_bottle_that_is_asked_about_the_folder_says_the_same(pair: WalkPair, folder: Path) -> None:
    life = endurance(folder)
    assert isinstance(life, Endurance)
    _, *others = pair.volumes
    assert list(life.others) == [one.chambers.name for one in others]
    for one, other in zip(others, life.others.values(), strict=True):
        assert one.life is not None
        assert other.discharge.walking_time == pytest.approx(one.life.discharge.walking_time)
    assert "with ppafo2011-consistent" in text_of(life.answer())


@pytest.mark.parametrize("listed", ["none", [1], [{"volume_per_angle": 1.0}], [{"gas_per_stride": "0.4 g"}]], ids=repr)
def test_volumes_that_are_no_list_of_numbers_are_refused_in_one_line(folder: Path, listed: object) -> None:
    path = folder / "walk.json"
    text = path.read_text(encoding="utf-8")
    path.write_text(json.dumps(json.loads(text) | {"volumes": listed}), encoding="utf-8")
    try:
        with pytest.raises(DataError, match="write the walk again") as caught:
            read_walk_gas(folder)
        assert "\n" not in str(caught.value)
    finally:
        path.write_text(text, encoding="utf-8")


def test_chambers_with_which_no_gas_was_taken_are_left_out(folder: Path) -> None:
    path = folder / "walk.json"
    text = path.read_text(encoding="utf-8")
    document = json.loads(text)
    document["volumes"][1] |= {"gas_per_stride": 0.0, "peak_flow": None}
    path.write_text(json.dumps(document), encoding="utf-8")
    try:
        assert len(read_walk_gas(folder).others) == 1
    finally:
        path.write_text(text, encoding="utf-8")


def test_a_folder_of_an_earlier_version_has_no_others(folder: Path, tmp_path: Path) -> None:
    document = json.loads((folder / "walk.json").read_text(encoding="utf-8"))
    del document["volumes"]
    for name in ("recording.nc",):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    (tmp_path / "walk.json").write_text(json.dumps(document), encoding="utf-8")
    assert read_walk_gas(tmp_path).others == {}
