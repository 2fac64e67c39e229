"""``ppafo sets``, ``ppafo audit`` and ``ppafo schema``."""

import json
from pathlib import Path

import pytest

from ppafo.cli.main import main


def test_the_list_names_every_set(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sets"]) == 0
    printed = capsys.readouterr().out
    assert "ppafo2011 " in printed
    assert "ppafo2011-printed" in printed


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
    assert main(["audit", "ppafo2011-printed"]) == 1
    assert "ppafo2011-printed: 9 errors" in capsys.readouterr().out
    assert main(["audit", "ppafo2011"]) == 0


def test_the_audit_takes_overrides_and_prints_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["audit", "ppafo2011", "--json", "--set", "friction.static_torque=9 N m"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert [finding["id"] for finding in document["findings"] if finding["severity"] == "error"] == ["torque-ceiling"]


def test_out_writes_text_and_json_and_leaves_nothing_else(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    main(["audit", "ppafo2011", "--out", str(folder)])
    assert sorted(item.name for item in folder.iterdir()) == ["audit-ppafo2011.json", "audit-ppafo2011.txt"]


def test_an_unwritable_folder_is_one_line_and_exit_code_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "file"
    file.write_text("")
    assert main(["audit", "ppafo2011", "--out", str(file)]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith(f"ppafo: --out {file}: cannot be written")
    assert captured.err.count("\n") == 1
    assert captured.out == ""


@pytest.mark.parametrize(
    "words",
    [
        ["sets", "show", "ppafo"],
        ["audit", "nothing.toml"],
        ["audit", "ppafo2011", "--set", "valve.area=12.6"],
        ["schema", "paramters"],
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    error = capsys.readouterr().err
    assert error.startswith("ppafo: ")
    assert error.count("\n") == 1


def test_the_schema_is_printed_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "parameters"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "ppafo parameter set"
