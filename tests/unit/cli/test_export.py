"""``ppafo export c``."""

import json
import math
import re
import shlex
import zipfile
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.controllers.switching import CONSTANT, ConstantParameters
from ppafo.model.sensors import Measurement

PAGE = (Path(__file__).parents[3] / "docs" / "how-to" / "export.md").read_text(encoding="utf-8")


def test_the_commands_of_the_page_write_libraries(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    commands = re.findall(r"^ppafo (export c .*)$", PAGE, re.MULTILINE)
    for command in commands:
        assert main([*shlex.split(command), "--json"]) == 0
    documents = capsys.readouterr().out.split("\n}\n")
    files = json.loads(documents[0] + "\n}")["files"]
    assert files == [
        "CMakeLists.txt",
        "LICENSE",
        "Makefile",
        "README.md",
        "check.c",
        "main.c",
        "torque_task_proportional.c",
        "torque_task_proportional.h",
        "expected.csv",
    ]
    assert all((tmp_path / "out" / "c" / file).stat().st_size > 0 for file in files)
    assert '{"valve_area", 1.26e-05,' in (tmp_path / "out" / "wide" / "step_response.c").read_text()


def test_the_commands_of_the_page_write_units(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("ppafo.exports.fmu.unit.build", lambda *given: str(given[0]).encode())
    monkeypatch.setattr("ppafo.exports.fmu.unit.check_unit", lambda *_given: None)
    for command in re.findall(r"^ppafo (export fmu .*)$", PAGE, re.MULTILINE):
        assert main(shlex.split(command)) == 0
    (unit,) = (tmp_path / "out" / "unit").glob("*.fmu")
    assert str(unit.relative_to(tmp_path)) in PAGE
    assert (tmp_path / "out" / "plant" / "torque_task_proportional_plant.fmu").exists()
    with zipfile.ZipFile(unit) as archive:
        names = archive.namelist()
        assert archive.read("sources/torque_task_proportional.c").startswith(b"#include")
    assert {"modelDescription.xml", "documentation/index.html", "sources/fmi2.c", "sources/unit.c"} <= set(names)
    assert "next: fmpy simulate out/unit/torque_task_proportional.fmu" in capsys.readouterr().out


def test_a_name_that_ends_in_fmu_is_the_unit_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("ppafo.exports.fmu.unit.build", lambda *given: str(given[0]).encode())
    monkeypatch.setattr("ppafo.exports.fmu.unit.check_unit", lambda *_given: None)
    file = tmp_path / "out" / "a.fmu"
    assert main(["export", "fmu", "step-response", "--out", str(file)]) == 0
    said = capsys.readouterr().out
    assert f"written: {file}; next: fmpy simulate {file}" in said
    assert ": outputs compared with Python, to the bit; 'pip install fmpy' gives the command fmpy" in said
    with zipfile.ZipFile(file) as archive:
        assert "modelDescription.xml" in archive.namelist()
    assert main(["export", "fmu", "step-response", "--out", str(file)]) == 2
    assert f"--out {file}: already exists" in capsys.readouterr().err
    assert list(file.parent.iterdir()) == [file]


def with_exponential(
    law: ConstantParameters, state: tuple[()], wanted: float, seen: Measurement, period: float
) -> tuple[float, tuple[()]]:
    """A law that C has no bits for."""
    return law.command * math.exp(-wanted), state


def test_what_cannot_be_translated_is_refused_by_file_and_line_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    law = CONTROLLERS["constant"].__class__
    given = {name: getattr(CONSTANT, name) for name in ("summary", "source", "quantities", "parameters", "initial")}
    monkeypatch.setitem(
        CONTROLLERS, "exponential", law(name="exponential", update=with_exponential, needs_reference=False, **given)
    )
    folder = tmp_path / "library"
    changed = ["--set", "controller.kind=exponential"]
    assert main(["export", "c", "step-response", *changed, "--out", str(folder)]) == 2
    line = with_exponential.__code__.co_firstlineno + 4
    assert (
        f"test_export.py:{line}: cannot be translated to C: the function 'math.exp' is not supported"
        in capsys.readouterr().err
    )
    assert not folder.exists()
