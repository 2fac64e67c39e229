"""``ppafo sweep``, from a study file to files."""

import json
from importlib import resources
from pathlib import Path

import pytest

import ppafo
from ppafo.cli.main import main
from ppafo.study import store

STUDY = """
schema_version = 1
name = "mine"
description = "A few runs."
[[configurations]]
name = "base"
scenario = "scenarios/base.toml"
[sample]
method = "latin_hypercube"
runs = 6
[[vary]]
path = "reference.level"
kind = "uniform"
minimum = "3 N m"
maximum = "5 N m"
[outputs]
metrics = ["rms_error"]
bands = ["torque"]
every = "20 ms"
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    """A study file beside its scenario, to which its path is relative."""
    shipped = resources.files("ppafo") / "scenarios" / "torque-task-proportional.toml"
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "base.toml").write_bytes(shipped.read_bytes())
    path = tmp_path / "mine.toml"
    path.write_text(STUDY, encoding="utf-8")
    return path


def swept(study: Path, out: Path, *words: str) -> int:
    """The exit code of the command, with short runs."""
    return main(["sweep", str(study), "--out", str(out), "--set", "run.duration=0.2 s", *words])


def test_a_study_is_run_printed_and_written(study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert swept(study, out) == 0
    printed = capsys.readouterr()
    assert "mine: 6 runs: 6 completed" in printed.out
    assert "rms_error" in printed.out
    assert "ppafo: 6 of 6 runs (100 %)" in printed.err
    names = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert {
        "report.html",
        "summary.txt",
        "figure.png",
        "figure.svg",
        "summary.json",
        "study.toml",
        "study.json",
    } <= names
    assert f"report: {out}/report.html" in printed.out
    assert (out / "study.toml").read_bytes() == study.read_bytes()
    drawn = (out / "figure.svg").read_bytes()
    (out / "figure.svg").unlink()
    assert main(["export", "figure", str(out)]) == 0
    assert (out / "figure.svg").read_bytes() == drawn


def test_an_interruption_says_that_the_command_goes_on(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*words: object, **more: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(store, "compute_chunk", interrupted)
    assert swept(study, tmp_path / "out") == 130
    assert capsys.readouterr().err.endswith(
        "interrupted before the first chunk was finished; the same command starts the study again\n"
    )
    monkeypatch.undo()
    assert swept(study, tmp_path / "out") == 0


def test_the_share_of_runs_that_do_not_follow_is_said_and_the_share_without_a_verdict(tmp_path: Path) -> None:
    def said(
        name: str, *overrides: str, task: str = "torque-task-proportional"
    ) -> tuple[list[str], dict[str, dict[str, int]]]:
        # The torque at most is 0.1 N m per psi: 4.8 N m lack 17 and 6 % at 40 and 45 psi, where 5 % are allowed.
        study = {
            "schema_version": 1,
            "name": name,
            "configurations": [
                {"name": "task", "scenario": task, "overrides": list(overrides)},
                {"name": "open", "scenario": "torque-task-proportional", "overrides": ["controller.kind=constant"]},
            ],
            "vary": [{"path": "supply.pressure", "kind": "list", "values": [f"{at} psi_g" for at in (40, 45, 52, 60)]}],
            "outputs": {"metrics": ["peak_torque"]},
        }
        finding = ppafo.sweep(study, out=tmp_path / name)
        return list(finding.said[1:]), json.loads((tmp_path / name / "summary.json").read_text(encoding="utf-8"))

    exact = ("sensors.angle_noise=0 deg", "sensors.pressure_noise=0 Pa_d", "valve.dead_band=0")
    lines, summary = said("share", "reference.level=4.8 N m", *exact, task="torque-task-slow-valve")
    assert lines == ["task: the reference is followed in 2 of 4 runs, not in 2; beyond reach on purpose: 0"]
    assert (summary["tracking"]["task"]["do_not_follow"], list(summary["tracking"])) == (2, ["task"])
    wave = ("reference.kind=sine", "reference.level=2 N m", "reference.amplitude=1 N m", "reference.frequency=0.1 Hz")
    # Less than half a period of 10 s in the judged half of 3 s.
    lines, summary = said("short", *wave)
    assert lines[0].endswith("in 0 of 4 runs, not in 0; beyond reach on purpose: 0; without a verdict: 4")
