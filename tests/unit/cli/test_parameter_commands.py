"""``ppafo sets list``, ``ppafo sets audit`` and ``ppafo doctor --schema``."""

import importlib
import json
from pathlib import Path

import pytest

from ppafo.cli.main import main


def test_a_set_is_shown_with_the_source_of_every_value(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sets", "show", "ppafo2011", "--set", "valve.area=12.6mm^2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    row = next(line for line in lines if line.startswith("valves.proportional.area "))
    assert row.split() == ["valves.proportional.area", "12.6", "mm^2", "assumed", "override"]


def test_the_audit_takes_overrides_and_prints_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sets", "audit", "ppafo2011", "--json", "--set", "friction.static_torque=9 N m"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert [finding["id"] for finding in document["findings"] if finding["severity"] == "error"] == ["torque-ceiling"]


@pytest.mark.parametrize(
    ("words", "work"),
    [
        (["sets", "audit", "ppafo2011"], "ppafo.parameters.load_parameter_set"),
        (["sets", "list"], "ppafo.parameters.load_parameter_set"),
        (["sets", "show", "ppafo2011"], "ppafo.parameters.load_parameter_set"),
        (["doctor", "--schema", "scenario"], "ppafo.loading.json_schema"),
        (["reproduce"], "ppafo.analyses.reproduce.paper.reproduce_paper"),
        (["simulate", "step-response"], "ppafo.simulation.simulate.simulate"),
    ],
)
def test_a_place_that_cannot_be_written_is_found_before_any_work(
    words: list[str], work: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def never(*arguments: object) -> None:
        raise AssertionError("it ran")

    importlib.import_module(work.rpartition(".")[0])
    monkeypatch.setattr(work, never)
    file = tmp_path / "file"
    file.write_text("mine")
    assert main([*words, "--out", str(file / "deeper")]) == 2
    captured = capsys.readouterr()
    assert f"{file / 'deeper'}: cannot be written: '{file}' is a file, not a folder" in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""
    assert file.read_text() == "mine"


def test_several_sets_are_audited_side_by_side(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sets", "audit", "ppafo2011", "ppafo2011-printed"]) == 1
    head, *rows = (line.split() for line in capsys.readouterr().out.splitlines())
    assert head == ["finding", "ppafo2011", "ppafo2011-printed"]
    assert ["virtual-work", "-", "warning"] in rows
    assert ["flow-of-solenoid", "accepted", "error"] in rows
    assert main(["sets", "audit", "ppafo2011", "ppafo2011-printed", "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert [one["set"] for one in document["sets"]] == ["ppafo2011", "ppafo2011-printed"]
    assert document["sets"][1]["counts"]["error"] == 9
