"""A key of an earlier version is answered with what it is called now, wherever a user may write it."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

import ppafo
from ppafo.cli.main import main
from ppafo.errors import PpafoError

PACKAGE = Path(ppafo.__file__).parent
NOW = "which is now called 'actuator.displacement_per_radian'"


@pytest.mark.parametrize(
    ("shipped", "load", "key", "old_key", "now"),
    [
        (
            "parameters/sets/ppafo2011-printed.toml",
            ppafo.load_parameter_set,
            "displacement_per_radian",
            "volume_per_angle",
            "which is now called 'displacement_per_radian'",
        ),
        (
            "studies/library/torque-task-uncertainty.toml",
            ppafo.load_study,
            "actuator.torque_constant",
            "actuator.volume_per_angle",
            NOW,
        ),
    ],
)
def test_a_file_names_the_new_key(
    shipped: str, load: Callable[[Path], object], key: str, old_key: str, now: str, tmp_path: Path
) -> None:
    old = tmp_path / "old.toml"
    text = (PACKAGE / shipped).read_text(encoding="utf-8")
    assert key in text
    old.write_text(text.replace(key, old_key), encoding="utf-8")
    with pytest.raises(PpafoError, match=now) as refused:
        load(old)
    assert "volume_per_angle'" in str(refused.value)
    assert str(old) in str(refused.value)


def test_an_override_names_the_new_key() -> None:
    with pytest.raises(PpafoError, match=NOW):
        ppafo.simulate("step-response", ["actuator.volume_per_angle=30 cm^3/rad"])


@pytest.mark.parametrize("place", ["course", "motion.course"])
def test_a_walk_names_the_task_sequence(place: str, tmp_path: Path) -> None:
    now = f"which is now called '{place.replace('course', 'task_sequence')}'"
    with pytest.raises(PpafoError, match=now):
        ppafo.load_walk("solenoid", [f"{place}=stairs"])
    old = tmp_path / "old.toml"
    text = (PACKAGE / "walking/configurations/solenoid.toml").read_text(encoding="utf-8")
    line = 'course = "stairs"\n'
    old.write_text(text.replace("[motion]\n", f"[motion]\n{line}") if "." in place else line + text, encoding="utf-8")
    with pytest.raises(PpafoError, match=rf"unknown key '{place}'") as refused:
        ppafo.load_walk(old)
    assert "which is now called 'task_sequence'" in str(refused.value)


@pytest.mark.parametrize(
    ("words", "now"),
    [
        (["walk", "--course", "stairs"], "--course is now called --task-sequence"),
        (["new", "course", "mine"], "which is now called 'task-sequence'"),
        (["doctor", "--schema", "course"], "which is now called 'task-sequence'"),
    ],
)
def test_a_command_names_the_task_sequence(words: list[str], now: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    assert now in capsys.readouterr().err


def test_the_folder_of_a_walk_of_an_earlier_version_is_to_be_written_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    walked = {"format": "ppafo walk", "configuration": {"course": {"name": "stairs"}}}
    (tmp_path / "walk.json").write_text(json.dumps(walked), encoding="utf-8")
    assert main(["bottle", str(tmp_path)]) == 2
    assert "'course', which is now called 'task_sequence'; write the walk again" in capsys.readouterr().err
