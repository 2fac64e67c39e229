"""``ppafo devices``: sets, folders and recordings of several devices become mean, spread and the next one."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

import ppafo
from ppafo.cli.main import main
from ppafo.errors import IdentificationError, PpafoError
from ppafo.parameters.loading import load_parameter_set, parameter_set_toml
from ppafo.parameters.parameter_set import Entry
from ppafo.questions.devices.answer import draw

AREA, SUPPLY = "actuator.leak.area", "supply.pressure"


def write_set(folder: Path, name: str, **numbers: tuple[float, float, str] | tuple[float, float, str, str]) -> str:
    """A set with identified values: path (``__`` for a dot) to value, half width, unit and, if need be, origin."""
    base = load_parameter_set("ppafo2011")
    entries = {}
    for key, (value, half, unit, *origin) in numbers.items():
        path = key.replace("__", ".")
        source = f"{name}-{path}.csv sha256:{name.encode().hex():0>64}"
        entries[path] = Entry(
            value=value, unit=unit, origin=(origin or ["identified"])[0], source=source, uncertainty=half
        )
    made = replace(base, name=name, numbers={**base.numbers, **entries})
    path = folder / f"{name}.toml"
    path.write_text(parameter_set_toml(made))
    return str(path)


def test_areas_are_pooled_by_ratios_and_a_number_that_may_be_zero_by_differences(tmp_path: Path) -> None:
    areas, halves = (0.02, 0.03, 0.025, 0.04), (0.001, 0.002, 0.001, 0.003)
    sets = [
        write_set(
            tmp_path,
            f"d{number}",
            actuator__leak__area=(area, half, "mm^2"),
            friction__dynamic_torque=(torque, 0.1, "N m"),
        )
        for number, (area, half, torque) in enumerate(zip(areas, halves, (0.05, 0.1, 0.15, 0.12), strict=True))
    ]
    found = ppafo.pool_devices(sets)
    numbers = {one.path: one for one in found.numbers}
    area, torque = numbers[AREA], numbers["friction.dynamic_torque"]
    assert area.is_logarithmic
    assert area.next_device[0] > 0.0
    assert 0.02e-6 < area.mean < 0.04e-6
    assert found.shown(area, area.mean) == pytest.approx(1e6 * area.mean)
    assert not torque.is_logarithmic
    assert torque.pooled.is_common
    assert torque.pooled.next_device[0] < 0.0
    assert torque.next_device[0] == 0.0
    assert "no difference between 4 devices shows" in found.answer().lead[1]
    # A picture says what people call a number, with its unit.
    assert [panel.get_title(loc="left") for panel in draw(found).axes] == [
        "Leak area (mm$^2$)",
        "Dynamic friction (N m)",
    ]


def test_gauge_pressures_are_pooled_as_pressures(tmp_path: Path) -> None:
    sets = [
        write_set(tmp_path, f"d{number}", supply__pressure=(value, 0.5, "psi_g"))
        for number, value in enumerate((88.0, 90.0, 92.0))
    ]
    (one,) = ppafo.pool_devices(sets).numbers
    assert one.values[1].value == pytest.approx(101325.0 + 90.0 * 6894.757, rel=1e-6)
    assert one.values[1].half_width == pytest.approx(0.5 * 6894.757, rel=1e-6)


def test_what_sets_have_from_the_set_they_began_with_is_not_pooled(tmp_path: Path) -> None:
    sets = [
        write_set(tmp_path, f"d{number}", actuator__leak__area=(0.02 + 0.001 * number, 0.001, "mm^2"))
        for number in range(3)
    ]
    for file in sets:
        text = Path(file).read_text()
        made = load_parameter_set(file)
        common = Entry(value=8.0, unit="g m^2", origin="identified", source="the other bench", uncertainty=0.1)
        made = replace(made, numbers={**made.numbers, "foot_plate.inertia": common})
        Path(file).write_text(parameter_set_toml(made))
        assert Path(file).read_text() != text
    found = ppafo.pool_devices(sets)
    assert [one.path for one in found.numbers] == [AREA]
    assert found.inherited == ("foot_plate.inertia",)


def test_values_that_some_devices_lack_or_that_are_weak_are_named(tmp_path: Path) -> None:
    sets = [
        write_set(tmp_path, "a", actuator__leak__area=(0.02, 0.001, "mm^2"), foot_plate__inertia=(8.0, 0.1, "g m^2")),
        write_set(tmp_path, "b", actuator__leak__area=(0.021, 0.001, "mm^2", "fitted")),
        write_set(tmp_path, "c", actuator__leak__area=(0.024, 0.001, "mm^2")),
        write_set(tmp_path, "d", foot_plate__inertia=(8.2, 0.1, "g m^2")),
    ]
    (section,) = ppafo.pool_devices(sets).answer().sections
    assert section.remarks == (
        "remark: foot_plate.inertia: fewer than three devices have a value of their own: no spread",
        "remark: actuator.leak.area: no value of its own: d; the mean is that of the others",
        "remark: actuator.leak.area: weak, or valid for its model only: b",
    )


def test_bad_devices_are_refused_in_one_line(tmp_path: Path) -> None:
    sets = [
        write_set(tmp_path, f"d{number}", actuator__leak__area=(0.02 + 0.001 * number, 0.001, "mm^2"))
        for number in range(3)
    ]
    copied = tmp_path / "copy.toml"
    copied.write_text(Path(sets[0]).read_text().replace("value = 0.02\n", "value = 0.0201\n"))
    (tmp_path / "empty").mkdir()
    for words, said in (
        ([*sets, sets[0]], "the same device is named twice"),
        (sets[:2], "at least 3 devices are needed"),
        ([*sets, str(copied)], "was identified from a recording of d0"),
        ([*sets[:2], str(tmp_path / "empty")], "the folder has no parameter set"),
        (["ppafo2011", "ppafo2011-fitted", "ppafo2011-consistent"], "no parameter was identified on at least 3"),
    ):
        with pytest.raises(PpafoError, match=said) as caught:
            ppafo.pool_devices(words)
        assert "\n" not in str(caught.value)
    with pytest.raises(IdentificationError, match="must lie between 0 and 1"):
        ppafo.pool_devices(sets, confidence=1.0)


def test_the_set_of_the_next_device_is_drawn_from_in_a_study(tmp_path: Path) -> None:
    sets = [
        write_set(tmp_path, f"d{number}", actuator__leak__area=(area, 0.001, "mm^2"))
        for number, area in enumerate((0.02, 0.03, 0.025, 0.04))
    ]
    found = ppafo.pool_devices(sets)
    (tmp_path / "next-device.toml").write_bytes(found.answer().files["next-device.toml"]())
    made = load_parameter_set(tmp_path / "next-device.toml").numbers[AREA]
    (one,) = found.numbers
    assert made.value == pytest.approx(1e6 * one.mean)
    assert made.uncertainty == pytest.approx(1e6 * (one.next_device[1] - one.mean))


@pytest.mark.long
def test_recorded_valves_are_identified_and_pooled_and_the_next_ones_lie_in_the_interval(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    planted = {"v1": 0.125, "v2": 0.131, "v3": 0.128, "v4": 0.136, "v5": 0.130}
    for seed, (name, coefficient) in enumerate(planted.items(), start=1):
        words = ["--preset", "ideal-laboratory", "--seed", str(seed), "--out", name]
        change = f"valve.discharge_coefficient={coefficient}"
        assert main(["rig", "record", "open-valve-flow", *words, "--set", change]) == 0
    Path("valve.toml").write_text(
        'schema_version = 1\nname = "valve"\ndevice.set = "ppafo2011"\n'
        '[[procedure]]\nkind = "open-valve-flow"\nrecordings = ["open-valve-flow.csv"]\n'
    )
    capsys.readouterr()
    assert main(["devices", *planted, "--problem", "valve.toml", "--json", "--out", "kind"]) == 0
    (number,) = json.loads(capsys.readouterr().out)["numbers"]
    assert number["path"] == "valves.proportional.discharge_coefficient"
    for item in number["values"]:
        assert item["low"] <= planted[item["device"]] <= item["high"]
    low, high = number["next_device"]
    assert low < min(planted.values())
    assert high > max(planted.values())
    assert "synthetic" in Path("kind/report.html").read_text()
    # The same from the folders of single identifications.
    for name in planted:
        shutil.copy("valve.toml", name)
        assert main(["identify", f"{name}/valve.toml", "--out", f"set-{name}"]) == 0
    capsys.readouterr()
    assert main(["devices", *(f"set-{name}" for name in planted), "--json"]) == 0
    (again,) = json.loads(capsys.readouterr().out)["numbers"]
    # A set has one half width, a little wider than either side of an interval that is not even.
    assert again["mean"] == pytest.approx(number["mean"], rel=1e-9)


def test_what_was_made_of_other_devices_is_no_device(tmp_path: Path) -> None:
    sets = [write_set(tmp_path, name, actuator__leak__area=(value, 0.001, "mm^2")) for name, value in LEAKS.items()]
    ppafo.pool_devices(sets).save(tmp_path / "found")
    with pytest.raises(PpafoError, match="is what this command made of other devices"):
        ppafo.pool_devices([*sets, str(tmp_path / "found" / "next-device.toml")])


LEAKS = {"a": 0.02, "b": 0.021, "c": 0.024}
