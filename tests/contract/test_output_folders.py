"""``--out`` means the same in every command: absent, empty or its own earlier result; nothing of others is replaced."""

from pathlib import Path

import pytest

from ppafo.cli.commands import COMMANDS
from ppafo.cli.main import main
from ppafo.storage.owned_folder import MARK

FOLDERS: dict[str, list[str]] = {
    "reproduce": [],
    "simulate": ["step-response"],
    "sweep": ["pressure-and-area"],
    "compare": ["step-response"],
    "sensitivity": ["torque-task-uncertainty"],
    "find": ["step-response", "--vary", "supply.pressure=20..90 psi_g", "--such-that", "arrival_time <= 0.3 s"],
    "tune": ["pid-gains"],
    "linearise": ["torque-task-proportional"],
    "walk": ["--minutes", "0.1"],
    "validate": ["ppafo2011", "bench.csv"],
    "rig": ["simulate", "step-response"],
    "identify": ["problem.toml"],
    "gait": ["show", "falisse2019-subject1"],
    "gait import": ["import", "walk.mot", "--body-mass", "62 kg"],
    "bottle": ["--gas-per-stride", "0.3 g"],
    "design": ["push-off"],
    "sets list": ["list"],
    "sets show": ["show", "ppafo2011"],
    "sets audit": ["audit", "ppafo2011"],
    "doctor --schema": ["--schema", "scenario"],
    "doctor": [],
    "export c": ["c", "step-response"],
    "export fmu": ["fmu", "step-response"],
    "export opensim": ["opensim", "solenoid", "--minutes", "0.05"],
    "export firmware": ["firmware", "torque-task-solenoid"],
    "export firmware --try": ["firmware", "torque-task-solenoid", "--try"],
}
"""The words of every command that writes a folder."""

FILES = {
    "export figure": (["{result}"], "figure.png"),
    "new scenario": (["mine"], "mine.toml"),
    "gait record": (["falisse2019-subject1", "--strides", "1"], "walk.csv"),
    "workbench": (["step-response"], "page.html"),
}
"""The words of every command that writes one file, and the file."""

QUICK = (
    *("sets list", "sets show", "sets audit", "doctor --schema", "doctor", "gait", "bottle"),
    *("export c", "export firmware"),
)


def words_of(name: str, out: Path) -> list[str]:
    words = FOLDERS[name]
    return [name.partition(" ")[0], *words, "--out", str(out)]


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_every_command_is_here() -> None:
    tried = {name.partition(" ")[0] for name in (*FOLDERS, *FILES)}
    missing = [f'    "{name}": ["the words", "that it needs"],' for name in COMMANDS if name not in tried]
    assert missing == [], "paste into FOLDERS of tests/contract/test_output_folders.py:\n" + "\n".join(missing)
    assert tried == set(COMMANDS)


@pytest.mark.parametrize("theirs", ["notes.txt", MARK])
@pytest.mark.parametrize("name", FOLDERS)
def test_folder_of_others_is_refused_before_anything_runs(
    name: str, theirs: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "out"
    out.mkdir()
    (out / theirs).write_text("mine")
    assert main(words_of(name, out)) == 2
    said = capsys.readouterr().err
    assert str(out) in said
    assert len(said.splitlines()) == 1
    assert contents(tmp_path) == {f"out/{theirs}": b"mine"}


@pytest.mark.parametrize("name", FOLDERS)
def test_result_of_another_command_is_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    other = "sets show" if name != "sets show" else "sets list"
    assert main(words_of(other, tmp_path / "out")) == 0
    before = contents(tmp_path)
    assert main(words_of(name, tmp_path / "out")) == 2
    assert contents(tmp_path) == before


@pytest.mark.parametrize("name", QUICK)
def test_own_earlier_result_is_replaced_whole_and_holds_nothing_else(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    assert main(words_of(name, out)) == 0
    first = contents(out)
    (stray,) = [path for path in sorted(out.iterdir()) if path.name != MARK][:1]
    stray.write_text("mine now")
    assert main(words_of(name, out)) == 2
    assert f"({stray.name})" in capsys.readouterr().err
    assert stray.read_text() == "mine now"
    stray.unlink()
    assert main(words_of(name, out)) == 0
    assert set(contents(out)) == set(first)
    (out / "notes.txt").write_text("mine")
    before = contents(out)
    assert main(words_of(name, out)) == 2
    assert "notes.txt" in capsys.readouterr().err
    assert contents(out) == before


def test_rig_adds_an_experiment_and_replaces_nothing_of_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    record = ["rig", "simulate", "valve-map", "--preset", "ideal-laboratory", "--out", str(out)]
    assert main(record) == 0
    (out / "problem.toml").write_text("mine")
    assert main(record) == 0
    (out / "step-response.csv").write_text("mine")
    capsys.readouterr()
    assert main(["rig", "simulate", "step-response", "--out", str(out)]) == 2
    assert (
        "contains 'step-response.csv', which was not written by the simulated test bench; move"
        in capsys.readouterr().err
    )
    assert (out / "step-response.csv").read_text() == "mine"


@pytest.mark.parametrize("name", FILES)
def test_file_that_is_there_is_not_replaced(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words, file = FILES[name]
    result, out = tmp_path / "result", tmp_path / file
    if "{result}" in words:
        assert main(["simulate", "torque-task-proportional", "--set", "run.duration=0.1 s", "--out", str(result)]) == 0
    out.write_text("mine")
    given = [word.format(result=result) for word in words]
    assert main([*name.split(), *given, "--out", str(out)]) == 2
    assert "already exists" in capsys.readouterr().err
    assert out.read_text() == "mine"
    out.unlink()
    assert main([*name.split(), *given, "--out", str(out)]) == 0
    assert out.read_bytes() not in (b"", b"mine")


@pytest.mark.parametrize("inside", ["runs", "finished"])
def test_results_of_a_study_follow_no_link(inside: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    out.mkdir()
    elsewhere.mkdir()
    (out / inside).symlink_to(elsewhere)
    assert main(["sweep", "pressure-and-area", "--out", str(out)]) == 2
    assert f"{inside}: is a link" in capsys.readouterr().err
    assert not list(elsewhere.iterdir())
