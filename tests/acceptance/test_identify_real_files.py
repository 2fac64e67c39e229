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


def test_the_known_area_lies_inside_the_interval_and_within_half_a_percent(cylinder: Identification) -> None:
    area = cylinder.results[0]["static_torque.area"]
    assert area.low <= KNOWN_AREA <= area.high
    assert abs(area.value / KNOWN_AREA - 1.0) < 0.005
    assert area.relative_half_width < 0.005


def test_friction_of_the_cylinder_grows_with_pressure(cylinder: Identification) -> None:
    growth = cylinder.results[0]["static_torque.friction_per_pressure"]
    assert growth.low > 2.0e-6
    assert growth.value == pytest.approx(5.07e-6, rel=0.02)
    assert "grows" in cylinder.results[0]["static_torque.dynamic_friction"].explanation


def test_friction_of_the_cylinder_says_its_pressure_and_nothing_of_it_counts_as_identified(
    cylinder: Identification,
) -> None:
    friction = cylinder.results[0]["static_torque.dynamic_friction"]
    assert friction.verdict_in_words.startswith("holds for this model only, at 431.6 kPa")
    assert [check.name for check in cylinder.results[0].failed] == ["friction over pressure"]
    assert cylinder.new_set.written == ()
    assert cylinder.new_set.fitted == (), "a set has no place for newtons"
    left = cylinder.results[0]["static_torque.friction_at_no_pressure"]
    assert left.low < friction.value - 5.07e-6 * 4.316e5 < left.high


def test_with_its_lever_arm_the_friction_of_a_sliding_cylinder_is_friction_in_motion(raw_files: Path) -> None:
    text = blocks("toml")[0].replace(
        'force = { column = 7, unit = "N" }', 'torque = { column = 7, unit = "N", times = "22 mm" }'
    )
    (raw_files / "lever.toml").write_text(text, encoding="utf-8")
    found = identify(raw_files / "lever.toml")
    assert set(found.new_set.fitted) == {"actuator.torque_constant", "friction.dynamic_torque"}
    assert found.results[0]["friction.dynamic_torque"].value == pytest.approx(0.022 * 6.42, rel=1e-3)
    assert found.new_set.parameter_set.numbers["friction.static_torque"].origin != "fitted"


def test_mean_forces_alone_would_count_the_regulator_as_friction(cylinder: Identification) -> None:
    friction = cylinder.results[0]["static_torque.dynamic_friction"].value
    growth = cylinder.results[0]["static_torque.friction_per_pressure"].value
    at_1_bar = friction + growth * (1.0e5 - 4.3e5)
    assert at_1_bar == pytest.approx(4.7, abs=0.2)
    assert "6.6 N at 1 bar" in PAGE.read_text(encoding="utf-8")


def test_a_wrong_sign_of_the_direction_is_found_in_the_real_data(raw_files: Path) -> None:
    text = blocks("toml")[0].replace("sign = -1", "sign = 1")
    (raw_files / "turned.toml").write_text(text, encoding="utf-8")
    assert main(["identify", str(raw_files / "turned.toml")]) == 2


def test_the_printed_chamber_gets_no_area(raw_files: Path) -> None:
    (raw_files / "chamber-problem.toml").write_text(blocks("toml")[1], encoding="utf-8")
    result = identify(raw_files / "chamber-problem.toml").results[0]
    assert result["actuator.leak.area"].verdict == "law does not describe the data"
    assert "vane_leak.relaxation_rate" in [item.path for item in result.estimates]
    plateau = result["vane_leak.plateau"]
    assert 7.4e5 < plateau.low < plateau.high < 7.55e5, "below the last readings, 7.55 bar"
    told = next(check for check in result.failed if check.name == "leak or relaxation")
    assert "give the same curve" in told.statement


def test_a_chamber_whose_laws_cannot_be_told_apart_gets_no_area_either(raw_files: Path) -> None:
    text = blocks("toml")[1].replace("Prusa", "Formlabs").replace("10 s", "25 s")
    (raw_files / "formlabs-problem.toml").write_text(text, encoding="utf-8")
    outcome = identify(raw_files / "formlabs-problem.toml")
    assert outcome.new_set.written == ()
    assert outcome.results[0]["vane_leak.area_over_volume"].verdict == "weak"
    assert "which law" in [check.name for check in outcome.results[0].failed]
    missing = {item.name for item in outcome.beforehand[0].prospects if not item.can_be_had}
    assert missing == {"area of the leak", "law of the leak", "plateau or leak"}


@pytest.mark.parametrize("number", [0, 1])
def test_the_page_shows_what_the_command_prints(
    raw_files: Path, number: int, capsys: pytest.CaptureFixture[str]
) -> None:
    (raw_files / "problem.toml").write_text(blocks("toml")[number], encoding="utf-8")
    assert main(["identify", str(raw_files / "problem.toml")]) == 1
    assert capsys.readouterr().out.strip() == blocks("text")[number].strip()


def test_the_command_of_the_page_leaves_what_the_page_says(
    raw_files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = blocks("sh")[0].split()
    monkeypatch.chdir(tmp_path)
    (raw_files / "problem.toml").write_text(blocks("toml")[0], encoding="utf-8")
    assert main([str(raw_files / word) if word == "problem.toml" else word for word in words[1:]]) == 1
    made = {path.name for path in (tmp_path / "identified").iterdir()}
    assert {"cylinder.toml", "identify.json", "identify.txt", "static-torque.png"} <= made
