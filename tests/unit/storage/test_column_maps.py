"""Files from elsewhere: units, signs, marks and constants; and what is wrong is named with line and column."""

import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import ppafo
from ppafo.errors import DataError
from ppafo.parameters.records import record_from
from ppafo.storage.column_map import ColumnMap, load_column_map
from ppafo.storage.foreign import read_foreign, read_trials
from tests.repeatable import TOO_SLOW

TIME = {"column": 1, "unit": "ms"}


def mapped(**keys: Any) -> ColumnMap:
    channels = {"time": TIME, **keys.pop("channels", {})}
    return record_from(ColumnMap, {"header": False, "channels": channels, **keys})


def written(folder: Path, text: str | bytes) -> Path:
    path = folder / "raw.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_units_sign_factor_and_offset_are_applied_in_that_order(tmp_path: Path) -> None:
    angle = {"column": 2, "unit": "deg", "sign": -1, "factor": 10.0, "offset": 5.0}
    recording = read_foreign(written(tmp_path, "0,1\n10,2\n"), mapped(channels={"angle": angle}))
    assert np.allclose(recording.time, [0.0, 0.01])
    assert np.allclose(recording["angle"], np.radians([-15.0, -25.0]))


def test_a_force_and_a_lever_arm_make_a_torque(tmp_path: Path) -> None:
    torque = {"column": 2, "unit": "N", "times": "130 mm"}
    recording = read_foreign(written(tmp_path, "0,10\n10,20\n"), mapped(channels={"torque": torque}))
    assert np.allclose(recording["torque"], [1.3, 2.6])
    assert recording.unit("torque") == "N m"


def test_gauge_pressure_counts_from_the_atmosphere_that_is_given(tmp_path: Path) -> None:
    channels = {"pressure_1": {"column": 2, "unit": "bar_g"}, "pressure_2": {"constant": "0 bar_g"}}
    recording = read_foreign(written(tmp_path, "0,1\n10,2\n"), mapped(channels=channels), atmosphere=9e4)
    assert np.allclose(recording["pressure_1"], [1.9e5, 2.9e5])
    assert np.allclose(recording["pressure_2"], 9e4)


def test_decimal_commas_semicolons_and_names_are_read(tmp_path: Path) -> None:
    text = "exported by hand\nZeit;Kraft\n0,0;1,5\n1,0;-2,25\n"
    channels = {"time": {"column": "Zeit", "unit": "s"}, "torque": {"column": "Kraft", "unit": "N m"}}
    columns = record_from(
        ColumnMap, {"delimiter": "semicolon", "decimal": "comma", "skip_lines": 1, "channels": channels}
    )
    assert np.allclose(read_foreign(written(tmp_path, text), columns)["torque"], [1.5, -2.25])


@pytest.mark.parametrize(
    ("decimal", "thousands", "cell", "value"),
    [
        ("point", "comma", "-1,234,567.25", -1234567.25),
        ("comma", "point", "1.234,5", 1234.5),
        ("point", "blank", "12 345", 12345.0),
        ("comma", "apostrophe", "1'000,5e1", 10005.0),
        ("comma", "comma", "12,345", 12345.0),
        ("point", "comma", "1234.5", 1234.5),
    ],
)
def test_groups_of_three_digits_are_read(tmp_path: Path, decimal: str, thousands: str, cell: str, value: float) -> None:
    torque = {"column": 2, "unit": "N m", "thousands": thousands}
    columns = mapped(delimiter="semicolon", decimal=decimal, channels={"torque": torque})
    assert read_foreign(written(tmp_path, f"0;{cell}\n10;1\n"), columns)["torque"][0] == value


@pytest.mark.parametrize(
    ("decimal", "thousands", "cell"),
    [
        ("point", "point", "1.5"),
        ("comma", "comma", "1,5"),
        ("point", "comma", "1,5"),
        ("comma", "point", "1.5"),
        ("point", "point", "1.234.5"),
        ("point", "comma", "1234,567"),
        ("point", "blank", "1 2"),
        ("point", "comma", "1.234,567"),
        ("point", "comma", ",123"),
    ],
)
def test_a_mark_that_stands_between_no_groups_is_refused(
    tmp_path: Path, decimal: str, thousands: str, cell: str
) -> None:
    torque = {"column": 2, "unit": "N m", "thousands": thousands}
    columns = mapped(delimiter="semicolon", decimal=decimal, channels={"torque": torque})
    with pytest.raises(DataError, match=f"line 2, column '2': '{cell}' must have groups of three digits"):
        read_foreign(written(tmp_path, f"0;1\n10;{cell}\n"), columns)


def test_direction_and_sweeps_follow_from_the_rate_of_a_channel(tmp_path: Path) -> None:
    time = np.arange(0.0, 4000.0, 10.0)
    position = 40.0 * np.abs(1.0 - (time / 1000.0) % 2.0)
    text = "".join(f"{moment:g},{place:g}\n" for moment, place in zip(time, position, strict=True))
    direction = {"of": "position", "threshold": "20 mm/s", "window": "0.1 s"}
    columns = mapped(channels={"position": {"column": 2, "unit": "mm"}}, direction=direction)
    recording = read_foreign(written(tmp_path, text), columns)
    assert [recording["direction"][index] for index in (50, 150, 250, 350)] == [-1.0, 1.0, -1.0, 1.0]
    assert [recording["repetition"][index] for index in (50, 150, 250, 350)] == [1.0, 2.0, 3.0, 4.0]


def test_a_large_table_is_read_row_by_row(tmp_path: Path) -> None:
    path = written(tmp_path, "".join(f"{row},{',1.25' * 20}\n".replace(",,", ",") for row in range(5000)))
    columns = mapped(channels={"torque": {"column": 21, "unit": "N m"}})
    read_foreign(path, columns)
    tracemalloc.start()
    recording = read_foreign(path, columns)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert recording["torque"].tolist() == [1.25] * 5000
    # Twice the text, as bytes and as characters, and its lines; each cell as a text was another twelve times as much.
    assert peak < 6 * path.stat().st_size


def test_a_synthetic_recording_stays_one_through_a_column_map(tmp_path: Path) -> None:
    text = "# synthetic: made by a model to stand for a measurement\n0,1\n10,2\n"
    columns = mapped(channels={"torque": {"column": 2, "unit": "N m"}})
    assert read_foreign(written(tmp_path, text), columns).kind == "synthetic"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0,1\n10,x\n", "line 2, column '2': 'x' is not a finite number"),
        ("0,1\n10,2\n5,3\n", "line 3, column 'time': the clock goes backwards"),
        ("0,1\n10\n", "line 2 has 1 values for 2 columns"),
        ("\n\n", "has no rows"),
        ("0\n1\n", "channels.torque.column = 2: must be the number of a column"),
        (b"0,1\n\xff,2\n", "latin-1"),
        (b"0,1\n\x00,2\n", "is not a text file"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path: Path, text: str | bytes, message: str) -> None:
    columns = mapped(channels={"torque": {"column": 2, "unit": "N m"}})
    with pytest.raises(DataError) as caught:
        read_foreign(written(tmp_path, text), columns)
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "raw.csv"))


@pytest.mark.parametrize(
    ("channel", "message"),
    [
        ({"column": 2, "unit": "N"}, "a unit like 'N m' is needed"),
        ({"column": "torque", "unit": "N m"}, "must be the number of a column"),
        ({"column": 2, "constant": "1 N m"}, "both a column and a constant"),
        ({}, "channels.torque needs a column or constant"),
        ({"column": 2, "unit": "N", "times": "arm"}, "does not start with a number"),
        ({"constant": "3 bananas"}, "not a known unit"),
    ],
)
def test_a_map_that_does_not_fit_is_explained(tmp_path: Path, channel: dict[str, Any], message: str) -> None:
    with pytest.raises(DataError) as caught:
        read_foreign(written(tmp_path, "0,1\n10,2\n"), mapped(channels={"torque": channel}))
    assert message in str(caught.value)


@given(
    content=st.binary(max_size=200),
    delimiter=st.sampled_from(["comma", "semicolon", "tab", "whitespace"]),
    header=st.booleans(),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture, TOO_SLOW], max_examples=150)
def test_any_bytes_are_read_or_refused_in_one_line(
    tmp_path: Path, content: bytes, delimiter: str, header: bool
) -> None:
    columns = mapped(delimiter=delimiter, header=header, channels={"torque": {"column": 2, "unit": "N m"}})
    try:
        recording = read_foreign(written(tmp_path, content), columns)
    except DataError as error:
        assert str(error).startswith(str(tmp_path / "raw.csv"))
    else:
        assert np.isfinite(recording["torque"]).all()


MAPS = """
[columns.logger.channels]
time = { column = 1, unit = "s" }
angle = { column = 2, unit = "deg" }
"""


@pytest.mark.parametrize(
    ("text", "name", "message"),
    [
        (MAPS + MAPS.replace("logger", "scope"), None, "has several column maps; name one as"),
        (MAPS, "loger", "no column map 'loger', did you mean 'logger'"),
        (MAPS.replace("column = 2", "colum = 2"), None, "did you mean 'column'"),
    ],
)
def test_a_file_of_maps_that_cannot_be_used_is_one_line(
    tmp_path: Path, text: str, name: str | None, message: str
) -> None:
    (tmp_path / "maps.toml").write_text(text)
    with pytest.raises(DataError) as caught:
        load_column_map(tmp_path / "maps.toml", name)
    assert str(caught.value).startswith(str(tmp_path / "maps.toml"))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_column_map_says_what_a_channel_does_between_its_samples(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("t,u,p\n0,0,4\n1,1,5\n2,0,6\n")
    found = read_foreign(
        tmp_path / "log.csv",
        record_from(
            ColumnMap,
            {
                "channels": {
                    "time": {"column": "t", "unit": "s"},
                    "command": {"column": "u", "between": "linear"},
                    "supply_pressure": {"column": "p", "unit": "bar_a", "between": "hold"},
                }
            },
        ),
    ).resample([0.5])
    assert found["command"].tolist() == [0.5]
    assert found["supply_pressure"].tolist() == [4.0e5]


def test_a_file_in_utf_16_is_read(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("t,Öffnung\n0,1\n1,0\n", encoding="utf-16")
    channels = {"time": {"column": "t", "unit": "s"}, "command": {"column": "Öffnung"}}
    assert read_foreign(tmp_path / "log.csv", record_from(ColumnMap, {"channels": channels}))["command"][0] == 1.0


def test_a_foreign_log_is_measured_and_read_through_a_map_by_name(tmp_path: Path) -> None:
    log, maps = tmp_path / "log.csv", tmp_path / "logger.toml"
    log.write_text("t_ms;M_Ncm\n0;0,0\n500;120,5\n1000;250,0\n", encoding="utf-8")
    maps.write_text(
        '[columns.bench]\ndelimiter = "semicolon"\ndecimal = "comma"\n[columns.bench.channels]\n'
        'time = { column = "t_ms", unit = "ms" }\ntorque = { column = "M_Ncm", unit = "N cm" }\n',
        encoding="utf-8",
    )
    assert ppafo.evaluate(log, columns=f"{maps}:bench")["peak_torque"].value == pytest.approx(2.5)
    assert ppafo.read_recording(log, columns=load_column_map(maps))["torque"].tolist() == pytest.approx([0, 1.205, 2.5])


def test_each_of_many_trials_with_a_clock_from_0_is_a_recording(tmp_path: Path) -> None:
    rows = [f"{10 * n},{100 * trial + n}\n" for trial in (1, 2, 3) for n in range(5 - trial)]
    path, channels = written(tmp_path, "".join(rows)), {"torque": {"column": 2, "unit": "N m"}}

    def torques(trial: Any) -> list[list[float]]:
        return [recording["torque"].tolist() for recording in read_trials(path, mapped(channels=channels, trial=trial))]

    first, second, third = torques("all")
    assert (first, second, third) == ([100.0, 101.0, 102.0, 103.0], [200.0, 201.0, 202.0], [300.0, 301.0])
    assert torques([3, 1]) == [third, first]
    recording = read_foreign(path, mapped(channels=channels, trial=2))
    assert recording["torque"].tolist() == second
    assert recording.time[0] == 0.0
    for read, wrong in (
        (read_foreign, {}),
        (read_foreign, {"trial": 4}),
        (read_foreign, {"trial": "all"}),
        (read_trials, {"trial": [1, 7]}),
    ):
        with pytest.raises(DataError, match="trial"):
            read(path, mapped(channels=channels, **wrong))
