"""The user's guide on raw files, run on the real measurements that it is about."""

import re
import shutil
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.questions.identify.answer import Identification
from ppafo.questions.identify.solve import identify

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "identify-from-raw-files.md"
FILES = (
    *(f"zillen2021_cylinder_friction/O-ring257_{bar}bar.csv" for bar in (1, 3, 5, 7)),
    "zillen2021_chamber_leak/Prusa.csv",
    "zillen2021_chamber_leak/Formlabs.csv",
)
"""Those of the page, and the other chamber; the folder of measurements has more."""
KNOWN_AREA = 5.1875e-4


CHAMBER = """
schema_version = 1
name = "chamber"
device.set = "ppafo2011"

[[procedure]]
kind = "vane-leak"
columns = "logger"
gas = "air"
start = "10 s"                         # the supply was shut before
recordings = ["Prusa.csv"]

[columns.logger]
delimiter = "semicolon"
header = false

[columns.logger.channels]
time = { column = 1, unit = "s", factor = 1e-6, thousands = "point" }
pressure_1 = { column = 3, unit = "bar_g" }
pressure_2 = { constant = "0 bar_g" }  # the room
"""
"""The printed chamber of the same author: gas and walls come to rest, and the pressure falls."""


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def raw_files(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the raw files of the page."""
    folder = tmp_path_factory.mktemp("raw")
    for name in FILES:
        shutil.copy(shared_data / "pneumatic" / name, folder)
    return folder


@pytest.fixture(scope="module")
def cylinder(raw_files: Path) -> Identification:
    """What the first problem of the page gives."""
    (raw_files / "cylinder-problem.toml").write_text(blocks("toml")[0], encoding="utf-8")
    return identify(raw_files / "cylinder-problem.toml")


def test_the_known_area_lies_inside_the_interval_and_within_a_quarter_percent(cylinder: Identification) -> None:
    area = cylinder.results[0]["static_torque.area"]
    assert area.low <= KNOWN_AREA <= area.high
    assert abs(area.value / KNOWN_AREA - 1.0) < 0.0025
    assert area.half_width < 0.01 * area.value


def test_friction_of_the_cylinder_grows_with_pressure(cylinder: Identification) -> None:
    growth = cylinder.results[0]["static_torque.friction_per_pressure"]
    assert growth.low > 2.0e-6
    assert growth.value == pytest.approx(5.07e-6, rel=0.02)


def test_recordings_that_do_not_agree_hold_for_this_model_only_and_nothing_of_newtons_is_written(
    cylinder: Identification,
) -> None:
    result = cylinder.results[0]
    assert {item.verdict for item in result.estimates} == {"holds for this model only"}
    assert "alone want other numbers" in result.conflict
    assert cylinder.new_set.written == ()
    assert cylinder.new_set.fitted == (), "a set has no place for newtons"


def test_with_its_lever_arm_the_friction_of_a_sliding_cylinder_is_friction_in_motion(raw_files: Path) -> None:
    text = blocks("toml")[0].replace(
        'force = { column = 7, unit = "N" }', 'torque = { column = 7, unit = "N", times = "22 mm" }'
    )
    (raw_files / "lever.toml").write_text(text, encoding="utf-8")
    found = identify(raw_files / "lever.toml")
    growth = "effects.seal_friction.dynamic_per_pressure"
    assert set(found.new_set.fitted) == {"actuator.torque_constant", "friction.dynamic_torque", growth}
    assert found.results[0]["friction.dynamic_torque"].value == pytest.approx(0.022 * 4.23, rel=0.01)
    assert found.new_set.parameter_set.numbers["friction.static_torque"].origin != "fitted"


def test_a_wrong_sign_of_the_direction_is_found_in_the_real_data(raw_files: Path) -> None:
    text = blocks("toml")[0].replace("sign = -1", "sign = 1")
    (raw_files / "turned.toml").write_text(text, encoding="utf-8")
    assert main(["identify", str(raw_files / "turned.toml")]) == 2


@pytest.mark.parametrize(("name", "start"), [("Prusa", "10 s"), ("Formlabs", "25 s")])
def test_a_chamber_whose_gas_comes_to_rest_gets_no_area(raw_files: Path, name: str, start: str) -> None:
    text = CHAMBER.replace("Prusa", name).replace("10 s", start)
    (raw_files / "chamber-problem.toml").write_text(text, encoding="utf-8")
    outcome = identify(raw_files / "chamber-problem.toml")
    assert outcome.new_set.written == ()
    (area,) = outcome.results[0].estimates
    assert area.path == "vane_leak.area_over_volume"
    assert not area.is_identified


def test_the_page_shows_what_the_command_prints(raw_files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (raw_files / "problem.toml").write_text(blocks("toml")[0], encoding="utf-8")
    assert main(["identify", str(raw_files / "problem.toml")]) == 1
    assert capsys.readouterr().out.strip() == blocks("text")[0].strip()


def test_the_command_of_the_page_leaves_what_the_page_says(
    raw_files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = blocks("sh")[0].split()
    monkeypatch.chdir(tmp_path)
    (raw_files / "problem.toml").write_text(blocks("toml")[0], encoding="utf-8")
    assert main([str(raw_files / word) if word == "problem.toml" else word for word in words[1:]]) == 1
    made = {path.name for path in (tmp_path / "identified").iterdir()}
    assert {"cylinder.toml", "identify.json", "identify.txt", "static-torque.png"} <= made
