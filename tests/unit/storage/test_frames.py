"""Recordings in tables of other libraries: DataFrame, Dataset, Parquet, and how other formats are answered."""

from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.errors import DataError
from ppafo.signals import Channel, Recording
from ppafo.storage import dataset_of
from ppafo.storage.reading import read_recording

pandas = pytest.importorskip("pandas", reason="pandas is not installed")
TIME = np.arange(30.0)
FALL = 5.0 * np.exp(-0.02 * TIME)


def frame(**more: object) -> "pandas.DataFrame":
    return pandas.DataFrame({"time [s]": TIME, "pressure_1 [bar_g]": FALL} | more)


@pytest.mark.parametrize("form", ["frame", "indexed", "parquet", "csv", "csv with the index"])
def test_a_table_of_pandas_is_a_recording_however_it_is_given(form: str, tmp_path: Path) -> None:
    table, path = frame(), tmp_path / f"decay{'.parquet' if form == 'parquet' else '.csv'}"
    if form == "parquet":
        table.to_parquet(path)
    elif form.startswith("csv"):
        table.to_csv(path, index="index" in form)
    given = {"frame": table, "indexed": table.set_index("time [s]")}.get(form, path)
    found = read_recording(given)
    assert found["pressure_1"] == pytest.approx(101_325.0 + 1.0e5 * FALL)
    assert found.time.tolist() == TIME.tolist()
    assert found.kind == "measured"


def test_what_a_result_gives_pandas_and_xarray_comes_back_to_the_bit(tmp_path: Path) -> None:
    result = ppafo.simulate("torque-task-proportional", {"run.duration": "0.05 s"})
    own, table = result.recording, result.to_dataframe()
    assert table.attrs["units"]["pressure_1"] == "Pa"
    table.to_csv(tmp_path / "back.csv")
    table.to_parquet(tmp_path / "back.parquet")
    for given in (table, dataset_of(own), tmp_path / "back.csv", tmp_path / "back.parquet"):
        found = read_recording(given)
        assert (found.names, found.kind) == (own.names, "simulated")
        assert all(np.array_equal(found[name], own[name]) for name in own.names)
    assert ppafo.evaluate(table) == ppafo.evaluate(read_recording(table))


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (
            lambda: pandas.DataFrame({"pressure_1 [Pa]": TIME}),
            r"no column and no index 'time \[s\]'; available: pressure_1",
        ),
        (
            lambda: frame(**{"pressure_1 [bar_g]": np.where(TIME == 0.0, np.nan, FALL)}),
            r"column 'pressure_1 \[bar_g\]': row 0 is nan, not a finite number",
        ),
        (lambda: frame(word="a"), "the header must name columns as 'name .unit.'.* not as 'word'"),
        (lambda: frame(**{"word [s]": "a"}), r"column 'word \[s\]' is not numeric"),
        (lambda: frame().iloc[::-1], "the clock goes backwards"),
        (lambda: dataset_of(a_recording()).rename(time="t"), "the Dataset has no coordinate 'time'"),
    ],
)
def test_a_table_that_is_no_recording_is_refused_in_one_line(table: object, message: str) -> None:
    with pytest.raises(DataError, match=message):
        read_recording(table())  # type: ignore[operator]


def a_recording() -> Recording:
    return Recording("decay", TIME, {"pressure_1": Channel(FALL, "Pa")})
