"""Faults of a recording, through both commands and with or without a column map: refused or flagged, and named.

A refusal is one line with the file, the column and the line or sample, exit code 2. A flag is a note or a failed check.
Every fault of a file is in tests/unit/validation/test_bad_recordings.py and tests/unit/identification.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.identification.bench.free_decay import Slowing, course

AT = 37
"""Index of the sample that is spoilt."""

Columns = dict[str, np.ndarray]
UNITS = {
    "time": "s",
    "angle": "deg",
    "command": "-",
    "supply_pressure": "psi_g",
    "pressure_1": "psi_g",
    "pressure_2": "psi_g",
}


@dataclass(frozen=True)
class Table:
    """Columns by name in the order of the file, and their units."""

    columns: Columns
    units: dict[str, str] = field(default_factory=lambda: dict(UNITS))


def decay() -> Table:
    """A free decay for ``identify``."""
    time = np.arange(400) * 0.01
    angle = np.degrees(0.4 + course(np.maximum(time - 0.2, 0.0), 2.5, Slowing(0.4, 0.3)).swept)
    return Table({"time": time, "angle": angle + np.random.default_rng(1).normal(0.0, 0.1, time.size)})


def step() -> Table:
    """A step response for ``validate``."""
    time, draw = np.arange(400) * 0.001, np.random.default_rng(2)
    columns = {
        "time": time,
        "command": np.where(time < 0.01, 0.0, 1.0),
        "supply_pressure": np.full(time.size, 50.0) + draw.normal(0.0, 0.1, time.size),
        "angle": np.linspace(60.0, 110.0, time.size) + draw.normal(0.0, 0.1, time.size),
        "pressure_1": 50.0 * (1.0 - np.exp(-time / 0.1)) + draw.normal(0.0, 0.1, time.size),
        "pressure_2": 50.0 * np.exp(-time / 0.1) + draw.normal(0.0, 0.1, time.size),
    }
    return Table(columns)


def changed(table: Table, name: str, values: np.ndarray) -> Table:
    return Table({**table.columns, name: values}, table.units)


def with_value(name: str, value: float) -> Callable[[Table], Table]:
    def spoil(table: Table) -> Table:
        values = table.columns[name].copy()
        values[AT] = value
        return changed(table, name, values)

    return spoil


def with_earlier_time(back: int) -> Callable[[Table], Table]:
    """The clock of one sample is that of an earlier one."""

    def spoil(table: Table) -> Table:
        time = table.columns["time"].copy()
        time[AT] = time[AT - back]
        return changed(table, "time", time)

    return spoil


def gap(table: Table) -> Table:
    time = table.columns["time"].copy()
    time[AT:] += 90.0
    return changed(table, "time", time)


def saturated(table: Table) -> Table:
    angle = table.columns["angle"]
    return changed(table, "angle", np.minimum(angle, np.quantile(angle, 0.3)))


def short(table: Table) -> Table:
    return Table({name: values[:7] for name, values in table.columns.items()}, table.units)


def quiet(table: Table) -> Table:
    noise = np.random.default_rng(3).normal(0.0, 0.1, 400)
    still = {name: noise + 25.0 for name in ("angle", "pressure_1", "pressure_2") if name in table.columns}
    return Table({**table.columns, **still}, table.units)


def without(name: str) -> Callable[[Table], Table]:
    return lambda table: Table({key: item for key, item in table.columns.items() if key != name}, table.units)


def in_unit(name: str, unit: str) -> Callable[[Table], Table]:
    return lambda table: Table(table.columns, {**table.units, name: unit})


def text(table: Table, header: bool) -> str:
    rows = [",".join(repr(float(value)) for value in row) for row in zip(*table.columns.values(), strict=True)]
    names = [",".join(f"{name} [{table.units[name]}]" for name in table.columns)] if header else []
    return "\n".join([*names, *rows, ""])


def mapped(table: Table, names: list[str]) -> str:
    """The column map of the table as it should be: a missing column is missed by the map, not left out of it."""
    lines = ["[columns.logger]", "header = false"]
    for number, name in enumerate(names, start=1):
        lines.append(f'channels.{name} = {{ column = {number}, unit = "{table.units[name]}" }}')
    return "\n".join([*lines, ""])


@dataclass(frozen=True)
class FinishedRun:
    """How a command ended."""

    code: int
    out: str
    err: str
    first_line: int


Run = Callable[[str, Table, bool], FinishedRun]


@pytest.fixture
def run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Run:
    """Run a command on a table as a file with a header, or without one and through a column map."""

    def command(name: str, table: Table, through_map: bool) -> FinishedRun:
        (tmp_path / "bench.csv").write_text(text(table, not through_map))
        whole = list((decay() if name == "identify" else step()).columns)
        maps = mapped(table, whole)
        if name == "identify":
            head = 'schema_version = 1\nname = "twin"\ndevice.set = "ppafo2011"\n'
            use = '[[procedure]]\nkind = "free-decay"\nrecordings = ["bench.csv"]\n'
            problem = f'{head}{use}columns = "logger"\n{maps}' if through_map else head + use
            (tmp_path / "problem.toml").write_text(problem)
            words = ["identify", str(tmp_path / "problem.toml")]
        else:
            (tmp_path / "maps.toml").write_text(maps)
            words = ["validate", "ppafo2011", str(tmp_path / "bench.csv"), "--threshold", "1000%"]
            words += ["--columns", str(tmp_path / "maps.toml")] if through_map else []
        code = main(words)
        printed = capsys.readouterr()
        return FinishedRun(code, printed.out, printed.err, 1 if through_map else 2)

    return command


BOTH = [False, True]
UNIT = re.compile(r"UNIT (\w+) (.+)")
UNIT_IN_MAP, UNIT_IN_HEADER = r"channels.\1.unit = '\2'", r"column '\1 [\2]'"
REFUSED = {
    "missing column": ("identify", without("angle"), ["angle"]),
    "missing command": ("validate", without("pressure_2"), ["pressure_2"]),
    "unit": ("identify", in_unit("angle", "N m"), ["UNIT angle N m", "an angle is needed"]),
    "unit of a pressure": ("validate", in_unit("pressure_1", "psi"), ["UNIT pressure_1 psi", "psi_g"]),
    "gap": ("identify", gap, ["gap of 90.01 s", f"sample {AT}"]),
    "NaN in a command": ("validate", with_value("command", np.nan), ["LINE", "column", "'nan'"]),
    "clock back": ("identify", with_earlier_time(2), ["LINE", "column 'time'", "goes backwards"]),
    "duplicate time in a step": ("validate", with_earlier_time(1), ["LINE", "column 'time'", "stands still"]),
    "saturated": ("identify", saturated, ["'angle' stays at exactly", "from sample", "saturated"]),
    "too short a step": ("validate", short, ["has 7 samples; at least 10"]),
    "no excitation in a step": (
        "validate",
        quiet,
        ["angle, pressure_1, pressure_2 change by less than 1%"],
    ),
}


@pytest.mark.parametrize("through_map", BOTH, ids=["header", "column map"])
@pytest.mark.parametrize("fault", REFUSED)
def test_a_fault_is_refused_in_one_line_that_names_its_place(run: Run, fault: str, through_map: bool) -> None:
    command, spoil, words = REFUSED[fault]
    table = spoil(decay() if command == "identify" else step())
    ran = run(command, table, through_map)
    if fault == "missing command" and not through_map:
        assert "--initial" in ran.err
    assert ran.code == 2, ran.out
    lines = [line for line in ran.err.splitlines() if not line.endswith(" ...")]
    assert len(lines) == 1
    assert "bench.csv: " in lines[0]
    wanted = [word.replace("LINE", f"line {AT + ran.first_line}") for word in words]
    wanted = [UNIT.sub(UNIT_IN_MAP if through_map else UNIT_IN_HEADER, word) for word in wanted]
    assert all(word in lines[0] for word in wanted), lines[0]
    assert not (through_map and "UNIT" in words[0]) or ".toml" in lines[0]


@pytest.mark.parametrize(("command", "through_map"), [("identify", False), ("validate", True)])
def test_the_same_recording_without_a_fault_is_taken_without_a_remark(
    run: Run, command: str, through_map: bool
) -> None:
    ran = run(command, decay() if command == "identify" else step(), through_map)
    assert ran.code == 0, ran.err + ran.out
    assert "FAILS" not in ran.out
    assert "note: '" not in ran.out
