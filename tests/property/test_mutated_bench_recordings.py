"""A damaged bench recording is identified from or refused in one line, with a header or through a column map."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from ppafo.errors import PpafoError
from ppafo.identification.bench.flow import GasAt
from ppafo.identification.source import RecordingSource
from ppafo.parameters.records import record_from
from ppafo.storage import read_csv
from ppafo.storage.column_map import ColumnMap
from ppafo.storage.foreign import read_foreign
from tests.repeatable import TOO_SLOW
from tests.unit.identification.planted import free_decay, open_valve_flow, static_torque, valve_map, vane_leak

CO2 = GasAt(0.044, 1.3, 298.0)
RUNS = {
    "static-torque": static_torque,
    "free-decay": free_decay,
    "open-valve-flow": lambda sources: open_valve_flow(sources, CO2),
    "valve-map": lambda sources: valve_map(sources, CO2),
    "vane-leak": lambda sources: vane_leak(sources, CO2, 4e-5, 4e-5, discharge_coefficient=0.1),
}
UNITS = {
    "static-torque": {"time": "s", "torque": "N m", "pressure_difference": "psi_d", "direction": "-"},
    "free-decay": {"time": "s", "angle": "deg", "angular_velocity": "deg/s"},
    "open-valve-flow": {"time": "s", "upstream_pressure": "psi_g", "downstream_pressure": "psi_g", "mass_flow": "g/s"},
    "valve-map": {
        "time": "s",
        "command": "-",
        "mass_flow": "g/s",
        "upstream_pressure": "psi_g",
        "downstream_pressure": "psi_g",
    },
    "vane-leak": {"time": "s", "pressure_1": "psi_g", "pressure_2": "psi_g"},
}
CELLS = st.sampled_from(
    ["", "nan", "inf", "-1", "1e300", "-1e-300", "0", "130", "1e9", "x", '"', "\0", "½", ",", "\n", "1_0", "#"]
)


def columns(kind: str) -> list[np.ndarray]:
    """Numbers as that bench would give them, in the units of the file."""
    draw = np.random.default_rng(1)
    if kind == "static-torque":
        pressure = np.tile([10.0, 30.0, 50.0, 70.0, 70.0, 50.0, 30.0, 10.0], 3)
        way = np.tile([1.0] * 4 + [-1.0] * 4, 3)
        return [10.0 * np.arange(24.0), 0.1 * pressure - 0.45 * way + draw.normal(0.0, 0.02, 24), pressure, way]
    if kind == "free-decay":
        time = np.arange(60) * 0.02
        angle = 100.0 * (1.0 - np.exp(-2.0 * time)) - 10.0 * time + draw.normal(0.0, 0.1, 60)
        return [time, angle, 200.0 * np.exp(-2.0 * time) - 10.0 + draw.normal(0.0, 1.0, 60)]
    if kind == "open-valve-flow":
        down = np.linspace(0.0, 48.0, 20)
        return [np.arange(20.0), np.full(20, 50.0), down, 4.0 * np.sqrt(1.0 - down / 50.0) + draw.normal(0.0, 0.02, 20)]
    if kind == "valve-map":
        command = np.concatenate([np.linspace(-1.0, 1.0, 15), np.linspace(1.0, -1.0, 15)])
        flow = 4.0 * command + draw.normal(0.0, 0.02, 30)
        return [np.arange(30.0), command, flow, np.full(30, 50.0), np.zeros(30)]
    fall = np.exp(-0.1 * np.arange(50))
    return [np.arange(50.0), *(25.0 + sign * 25.0 * fall + draw.normal(0.0, 0.05, 50) for sign in (1.0, -1.0))]


def table(kind: str) -> str:
    header = ",".join(f"{name} [{unit}]" for name, unit in UNITS[kind].items())
    rows = [",".join(f"{value:.6g}" for value in row) for row in zip(*columns(kind), strict=True)]
    return "\n".join([header, *rows, ""])


TABLES = {kind: table(kind) for kind in RUNS}


def read(path: Path, kind: str, through_map: bool) -> RecordingSource:
    if not through_map:
        return RecordingSource(read_csv(path))
    channels = {name: {"column": number, "unit": unit} for number, (name, unit) in enumerate(UNITS[kind].items(), 1)}
    return RecordingSource(read_foreign(path, record_from(ColumnMap, {"channels": channels})))


@pytest.mark.parametrize("kind", RUNS)
def test_the_recording_that_is_damaged_is_taken_as_it_is(tmp_path: Path, kind: str) -> None:
    (tmp_path / "bench.csv").write_text(TABLES[kind])
    for through_map in (False, True):
        assert RUNS[kind]((read(tmp_path / "bench.csv", kind, through_map),)).estimates


@given(st.sampled_from(sorted(RUNS)), st.floats(0.0, 1.0), st.integers(0, 60), CELLS, st.booleans())
@example("free-decay", 0.5, 8, "1e300", True)
@example("free-decay", 0.3984375, 1, "1e300", False)
@example("vane-leak", 0.041015625, 3, "nan", False)
@settings(max_examples=70, suppress_health_check=[HealthCheck.function_scoped_fixture, TOO_SLOW])
def test_a_damaged_recording_gives_numbers_or_one_line(
    tmp_path: Path, kind: str, place: float, length: int, cell: str, through_map: bool
) -> None:
    path = tmp_path / "bench.csv"
    text = TABLES[kind]
    start = int(place * (len(text) - 1))
    path.write_text(text[:start] + cell + text[start + length :], encoding="utf-8")
    try:
        result = RUNS[kind]((read(path, kind, through_map),))
    except PpafoError as error:
        assert "bench" in str(error)
        assert "\n" not in str(error)
        return
    for estimate in result.estimates:
        assert not estimate.is_usable or np.isfinite([estimate.value, estimate.low, estimate.high]).all()


@given(st.binary(max_size=200) | st.text(max_size=200).map(str.encode), st.booleans())
@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture, TOO_SLOW])
def test_any_bytes_are_a_recording_or_one_line_that_names_the_file(
    tmp_path: Path, content: bytes, through_map: bool
) -> None:
    path = tmp_path / "bench.csv"
    path.write_bytes(content)
    try:
        recording = read(path, "vane-leak", through_map).recording
    except PpafoError as error:
        assert str(error).startswith(str(path))
        assert "\n" not in str(error)
        return
    assert all(np.isfinite(recording[name]).all() for name in recording.names)


@given(st.lists(st.lists(st.sampled_from(["0", "1", "2.5", "-3", "nan", "", "1e9", "x"]), max_size=4), max_size=6))
@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture, TOO_SLOW])
def test_any_table_of_cells_is_a_recording_or_names_line_or_header(tmp_path: Path, rows: list[list[str]]) -> None:
    path = tmp_path / "bench.csv"
    path.write_text("\n".join(["time [s],angle [deg]", *(",".join(row) for row in rows), ""]))
    try:
        recording = read_csv(path)
    except PpafoError as error:
        assert str(error).startswith(f"{path}: ")
        assert "line " in str(error) or "no samples" in str(error)
        return
    assert len(recording) == len([row for row in rows if ",".join(row)])
