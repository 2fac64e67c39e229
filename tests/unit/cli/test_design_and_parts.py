"""``ppafo design`` and ``ppafo sets parts``, from files to files."""

import json
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.parameters.parts import load_catalogue

SIZING = """
schema_version = 1
name = "tiny"
scenario = "torque-task-proportional"
simulated = 1
gain_factors = [1.0]

[profile]
time = ["0 s", "0.3 s", "0.6 s", "1 s"]
torque = ["0 N m", "3 N m", "3 N m", "0 N m"]

[use]
repetitions = 50

[limits]
rms_error = "0.7 N m"

[parts]
valves = ["enfield-ls-v05s"]
bottles = ["pipeline-jacpac-9oz"]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "sizing.toml").write_text(SIZING)
    return tmp_path


def test_a_sizing_is_printed_and_written(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = folder / "out"
    assert main(["design", str(folder / "sizing.toml"), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "(typed, not measured)" in printed
    assert "\n*  enfield-ls-v05s " in printed
    assert "suggested: enfield-ls-v05s at " in printed
    names = ["design.json", "design.txt", "ppafo.json", "profile.png", "profile.svg", "report.html", "suggested.csv"]
    names += ["torque.png", "torque.svg"]
    assert sorted(path.name for path in out.iterdir()) == names
    document = json.loads((out / "design.json").read_text())
    assert document["suggested"] == "enfield-ls-v05s"
    assert document["valves"][0]["bottle"] == "pipeline-jacpac-9oz"
    assert (out / "suggested.csv").read_text().startswith("# simulated")
    report = (out / "report.html").read_text()
    assert "mass 300\N{NO-BREAK SPACE}g is assumed" in report
    assert "Enfield Technologies LS-V05s" in report


def test_a_sizing_without_a_suggestion_ends_with_1_and_says_why(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "hard.toml").write_text(SIZING.replace("0.7 N m", "0.001 N m"))
    assert main(["design", str(folder / "hard.toml"), "--out", str(folder / "out")]) == 1
    assert "no suggestion: no valve keeps the error limit" in capsys.readouterr().out
    assert "no valve keeps the error limit" in (folder / "out" / "report.html").read_text()


def test_parts_are_listed_with_what_is_doubtful_and_what_is_not_known(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sets", "parts"]) == 0
    printed = capsys.readouterr().out
    assert all(part.name in printed for part in load_catalogue().parts)
    # All figures of this bottle are known, and none is doubtful.
    assert "SodaStream 60 L cylinder" in printed
    (row,) = [line for line in printed.splitlines() if line.startswith("sodastream-60l")]
    assert row.split()[-2:] == ["none", "none"]
    assert main(["sets", "parts", "enfield-ls-v05s"]) == 0
    printed = capsys.readouterr().out
    assert "31.6 mm^2  published" in printed
    assert "unknown figures: largest_pressure, nominal_flow, spool_frequency" in printed


def test_a_figure_that_is_left_out_of_a_catalogue_is_listed_as_unknown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figure = '= { value = %s, unit = "%s", origin = "datasheet", source = "its sheet" }'
    lines = ["schema_version = 1", 'name = "own"', 'title = "own"', "[valves.both]", 'kind = "solenoid"']
    lines += ['maker = "Acme"', 'model = "S2"', f"mass {figure % (120.0, 'g')}", f"area {figure % (3.0, 'mm^2')}"]
    lines += [f"discharge_coefficient {figure % (0.6, '')}", f"closing_delay {figure % (6.0, 'ms')}"]
    (tmp_path / "own.toml").write_text("\n".join([*lines, f"switching_interval {figure % (5.0, 'ms')}\n"]))
    missing = "opening_delay, largest_pressure"
    assert main(["sets", "parts", "--catalogue", str(tmp_path / "own.toml")]) == 0
    (row,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("both ")]
    assert row.endswith(f"none              {missing}")
    assert main(["sets", "parts", "--catalogue", str(tmp_path / "own.toml"), "both"]) == 0
    assert f"\nunknown figures: {missing}\n" in capsys.readouterr().out
