"""Readings of a bench without a column of times, where the law has no time in it."""

import math
from pathlib import Path

import numpy as np
import pytest

from ppafo.analyses.identify import identify
from ppafo.errors import DataError

HEAD = 'schema_version = 1\nname = "bench"\ndevice.set = "ppafo2011"\n'
BRANCH = np.tile(np.repeat([1.0, -1.0], 6), 3)
PRESSURE = np.tile(np.concatenate((np.linspace(0.0, 50.0, 6), np.linspace(50.0, 0.0, 6))), 3)
NOISE = 0.003 * np.random.default_rng(7).standard_normal(PRESSURE.size)
TORQUE = 0.1 * PRESSURE - 0.45 * BRANCH + NOISE


def problem(folder: Path, columns: str, kind: str = "static-torque") -> Path:
    rows = "".join(f"75,{p},{t},{b}\n" for p, t, b in zip(PRESSURE, TORQUE, BRANCH, strict=True))
    (folder / "readings.csv").write_text(f"{columns}\n{rows}", encoding="utf-8")
    file = folder / "problem.toml"
    file.write_text(f'{HEAD}[[procedure]]\nkind = "{kind}"\nrecordings = ["readings.csv"]\n', encoding="utf-8")
    return file


def test_a_steady_leak_needs_no_column_of_times(tmp_path: Path) -> None:
    file = problem(tmp_path, "", "vane-leak-steady")
    # Choked throughout, through Cd A of 1 mm^2, which the set of CO2 at 298 K has with its Cd of 0.113.
    choked = 1.0e-6 * math.sqrt(0.044 * 1.3 / (8.314 * 298.0) * (2.0 / 2.3) ** (2.3 / 0.3))
    rows = "".join(f"{p},0,{choked * (1.0e5 * p + 101325.0)}\n" for p in np.linspace(2.0, 5.0, 20))
    columns = "pressure_1 [bar_g],pressure_2 [bar_g],mass_flow [kg/s]"
    (tmp_path / "readings.csv").write_text(f"{columns}\n{rows}", encoding="utf-8")
    assert 0.113 * identify(file).found.results[0].estimates[0].value == pytest.approx(1.0e-6, rel=1e-3)


def test_a_decay_needs_times_and_the_message_says_how_a_table_without_them_is_read(tmp_path: Path) -> None:
    columns = "angle [deg],pressure_difference [psi_d],torque [N m],direction [-]"
    with pytest.raises(
        DataError, match=r'not \'angle\'; .*give the sample rate in the map: time = \{ rate = "100 Hz" \}'
    ):
        identify(problem(tmp_path, columns, "free-decay"))


MAP = """
[columns.bench.channels]
pressure_difference = { column = "dp", unit = "psi_d" }
torque = { column = "scale", unit = "kgf", times = "0.2 m" }
direction = { column = "stroke" }
"""


@pytest.mark.parametrize(
    "end", ["", 'direction = { of = "pressure_difference", threshold = "1 psi/s", window = "3 s" }']
)
def test_a_column_map_needs_no_times_either_unless_a_rate_is_asked_of_it(tmp_path: Path, end: str) -> None:
    # A scale in kilograms at a lever of 0.2 m: 9.80665 N for each.
    rows = "".join(f"{p},{t / 0.2 / 9.80665},{b}\n" for p, t, b in zip(PRESSURE, TORQUE, BRANCH, strict=True))
    (tmp_path / "readings.csv").write_text(f"dp,scale,stroke\n{rows}", encoding="utf-8")
    file = tmp_path / "problem.toml"
    procedure = '[[procedure]]\nkind = "static-torque"\nrecordings = ["readings.csv"]\ncolumns = "bench"\n'
    direction = f"[columns.bench]\n{end}\n" if end else ""
    channels = MAP.replace('direction = { column = "stroke" }\n', "") if end else MAP
    file.write_text(f"{HEAD}{procedure}{direction}{channels}", encoding="utf-8")
    if end:
        with pytest.raises(DataError, match=r'channels.time is missing; .* time = \{ rate = "100 Hz" \}'):
            identify(file)
        return
    found = identify(file).found.results[0]
    assert found["friction.static_torque"].value == pytest.approx(0.45, rel=0.03)
    assert found["actuator.torque_constant"].value == pytest.approx(0.1 / 6894.757, rel=0.02)
