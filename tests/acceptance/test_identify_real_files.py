"""The user's guide on raw files, run on the real measurements that it is about."""

import re
import shutil
from importlib import resources
from pathlib import Path

import pytest

from ppafo.analyses.identify import Identification, identify
from ppafo.cli.main import main
from tests.page_code import assert_shows

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "identify.md"
EXAMPLE = Path(str(resources.files("ppafo"))) / "examples" / "measured-cylinder"
KNOWN_AREA = 5.1875e-4


CHAMBER = (EXAMPLE / "chamber.toml").read_text(encoding="utf-8")
"""The printed chamber of the same author: gas and walls come to rest, and the pressure falls."""


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def raw_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the recordings of the page."""
    return Path(shutil.copytree(EXAMPLE, tmp_path_factory.mktemp("raw") / "files"))


@pytest.fixture(scope="module")
def cylinder(raw_files: Path) -> Identification:
    """What the first problem of the page gives."""
    (raw_files / "cylinder-problem.toml").write_text(blocks("toml")[0], encoding="utf-8")
    return identify(raw_files / "cylinder-problem.toml").found


def test_the_known_area_lies_inside_the_interval_and_within_three_tenths_of_a_percent(cylinder: Identification) -> None:
    area = cylinder.results[0]["static_torque.area"]
    assert area.low <= KNOWN_AREA <= area.high
    assert abs(area.value / KNOWN_AREA - 1.0) < 0.003
    assert area.wider_half_width < 0.01 * area.value


def test_friction_of_the_cylinder_grows_with_pressure(cylinder: Identification) -> None:
    growth = cylinder.results[0]["static_torque.friction_per_pressure"]
    assert growth.low > 2.0e-6
    assert growth.value == pytest.approx(5.30e-6, rel=0.02)


def test_recordings_agree_where_their_zeros_may_differ_and_nothing_of_newtons_is_written(
    cylinder: Identification, raw_files: Path
) -> None:
    assert {item.verdict for item in cylinder.results[0].estimates} == {"identified"}
    assert cylinder.new_set.written == cylinder.new_set.fitted == (), "a set has no place for newtons"
    text = blocks("toml")[0].replace('each_recording = ["zero"]', "")
    (raw_files / "one-zero.toml").write_text(text, encoding="utf-8")
    result = identify(raw_files / "one-zero.toml").found.results[0]
    assert {item.verdict for item in result.estimates} == {"holds for this model only"}
    assert "fitted alone, " in result.conflict


def test_with_its_lever_arm_the_friction_of_a_sliding_cylinder_is_friction_in_motion(raw_files: Path) -> None:
    text = blocks("toml")[0].replace(
        'force = { column = 7, unit = "N" }', 'torque = { column = 7, unit = "N", times = "22 mm" }'
    )
    (raw_files / "lever.toml").write_text(text, encoding="utf-8")
    found = identify(raw_files / "lever.toml").found
    growth = "effects.seal_friction.dynamic_per_pressure"
    assert set(found.new_set.written) == {"actuator.torque_constant", "friction.dynamic_torque", growth}
    assert found.results[0]["friction.dynamic_torque"].value == pytest.approx(0.022 * 4.14, rel=0.01)
    assert found.new_set.parameter_set.numbers["friction.static_torque"].origin != "identified"


@pytest.mark.parametrize(("name", "start"), [("Prusa", "10 s"), ("Formlabs", "25 s")])
def test_a_chamber_whose_gas_comes_to_rest_gets_no_area(raw_files: Path, name: str, start: str) -> None:
    text = CHAMBER.replace("Prusa", name).replace("10 s", start)
    (raw_files / "chamber-problem.toml").write_text(text, encoding="utf-8")
    outcome = identify(raw_files / "chamber-problem.toml").found
    assert outcome.new_set.written == ()
    (area,) = outcome.results[0].estimates
    assert area.path == "vane_leak.area_over_volume"
    assert not area.is_identified


def test_the_page_shows_what_the_command_prints(raw_files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (raw_files / "problem.toml").write_text(blocks("toml")[0], encoding="utf-8")
    assert main(["identify", str(raw_files / "problem.toml")]) == 0
    assert_shows(blocks("text")[0], capsys.readouterr().out)
