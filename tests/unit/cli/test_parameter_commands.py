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


def test_json_holds_every_value_and_is_the_only_thing_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sets", "show", "ppafo2011", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    paths = [value["path"] for value in document["values"]]
    assert paths[0] == "gas.species"
    assert {"actuator.torque_constant", "reported.choked_flow_constant"} <= set(paths)


def test_the_audit_fails_on_the_printed_set_and_passes_on_the_completed_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sets", "audit", "ppafo2011-printed"]) == 1
    assert "ppafo2011-printed: 9 errors" in capsys.readouterr().out
    assert main(["sets", "audit", "ppafo2011"]) == 0


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
        (["reproduce"], "ppafo.analyses.reproduce.solve.reproduce_paper"),
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


def test_an_audit_shows_first_what_the_set_changes_of_its_parent(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sets", "audit", "ppafo2011"]) == 0
    shown = "\n".join(capsys.readouterr().out.splitlines()[:6])
    page = (Path(__file__).parents[3] / "docs/how-to/add-a-parameter-set.md").read_text(encoding="utf-8")
    assert shown.startswith("ppafo2011 changes 19 values of its parent ppafo2011-printed\n")
    assert f"```text\n{shown}\n```" in page


def test_a_set_without_a_parent_begins_with_its_findings_and_may_be_compared_with_any(
    capsys: pytest.CaptureFixture[str],
) -> None:
    main(["sets", "audit", "cylinder-lever", "--json"])
    assert json.loads(capsys.readouterr().out)["parent"] is None
    main(
        ["sets", "audit", "cylinder-lever", "--parent", "cylinder-lever", "--set", "gas.temperature=30 degC", "--json"]
    )
    document = json.loads(capsys.readouterr().out)
    assert document["parent"] == "cylinder-lever"
    (change,) = document["changes"]
    assert change == {"path": "gas.temperature", "before": "293.15 K", "after": "30 degC", "origin": "assumed"}


def test_the_copy_of_a_set_names_it_as_parent_from_wherever_it_lies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "below").mkdir()
    main(["new", "set", "first", "--from", "ppafo2011"])
    file = tmp_path / "first.toml"
    file.write_text(file.read_text().replace("value = 36.0", "value = 31.5", 1))
    main(["new", "set", "second", "--from", "first.toml", "--out", "below/second.toml"])
    capsys.readouterr()
    main(["sets", "audit", "first.toml"])
    assert capsys.readouterr().out.startswith("first changes 1 value of its parent ppafo2011\n")
    main(["sets", "audit", "below/second.toml"])
    assert capsys.readouterr().out.startswith("second changes nothing of its parent first\n")
    file.unlink()
    assert main(["sets", "audit", "below/second.toml"]) == 2
    assert "below/second.toml: parent: below/../first.toml: cannot be read" in capsys.readouterr().err


def test_placeholders_of_the_template_are_a_warning_and_a_source_mended_is_a_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    main(["new", "set", "mine"])
    main(["new", "set", "mended", "--from", "mine.toml"])
    text = Path("mended.toml").read_text(encoding="utf-8")
    placeholder = 'origin = "assumed"\nsource = "template"'
    text = text.replace(placeholder, 'origin = "datasheet"\nsource = "page 3"', 3)
    Path("mended.toml").write_text(text.replace("value = 60.0", "value = 61.0"), encoding="utf-8")
    capsys.readouterr()
    main(["sets", "audit", "mine.toml"])
    assert "the source of 20 values is the template's" in capsys.readouterr().out
    main(["sets", "audit", "mended.toml"])
    assert capsys.readouterr().out.startswith(
        "mended changes 1 value and the origin or source of 2 values of its parent mine\n"
    )
