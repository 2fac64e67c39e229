"""``ppafo gait``: lists, shows, imports, records, exports, and refuses in one line."""

import json
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.gait import load_gait


@pytest.fixture
def walk(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    path = tmp_path / "walk.csv"
    assert main(["gait", "record", "falisse2019-subject1", "--strides", "4", "--out", str(path)]) == 0
    capsys.readouterr()
    return path


def test_a_gait_is_shown_in_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gait", "show", "falisse2019-subject1", "--speed", "1.2 m/s", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["walking_speed"] == 1.2
    assert document["recorded_speed"] == 1.33
    assert len(document["curves"]["ankle_angle"]["series"]) == len(document["phases"]) == 101


def test_an_imported_gait_is_written_whole_and_can_be_used_by_its_file(
    walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "gait"
    words = ["gait", "import", str(walk), "--body-mass", "62 kg", "--name", "mine", "--out", str(out), "--json"]
    assert main(words) == 0
    document = json.loads(capsys.readouterr().out)
    assert {path.name for path in out.iterdir()} == {
        "mine.toml",
        "gait.json",
        "gait.png",
        "gait.svg",
        "gait.txt",
        "ppafo.json",
        "report.html",
    }
    assert {**json.loads((out / "gait.json").read_text()), "folder": str(out)} == document
    assert document["origin"] == "synthetic"
    assert len(document["imported"]["strides"]) == document["strides"] == 3
    gait = load_gait(out / "mine.toml")
    assert (gait.origin, gait.strides) == ("synthetic", 3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["import", "WALK", "--body-mass", "62 kg", "--minimum-strides", "9"], "but --minimum-strides is 9"),
        (["import", "WALK"], "does not state the body mass, and --body-mass is not given"),
        (["import", "WALK", "--body-mass", "62 kg", "--map", "none.toml"], "none.toml: cannot be read"),
    ],
)
def test_what_is_wrong_is_said_in_one_line_and_nothing_is_written(
    walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], message: str
) -> None:
    given = [str(walk) if word == "WALK" else word for word in words]
    assert main(["gait", *given, "--out", str(tmp_path / "gait")]) == 2
    assert not (tmp_path / "gait").exists()
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert message in said
