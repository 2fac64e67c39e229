"""Files in the form in which real instruments and programs write them: LabVIEW, Arduino, Excel, MATLAB and Simulink."""

import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io

from ppafo.errors import DataError
from ppafo.parameters.records import record_from
from ppafo.storage.column_map import ColumnMap
from ppafo.storage.foreign import read_foreign
from ppafo.storage.matlab import open_matlab, read_matlab
from ppafo.storage.reading import read_recording

LVM = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t,
X_Columns\tOne
Date\t2026/03/21
Time\t08:00:00,123
***End_of_Header***\t
\t
Channels\t2\t\t\t
Samples\t3\t3\t\t
Y_Unit_Label\tVolts\tVolts\t\t
X0\t0,0000000000000000E+0\t0,0000000000000000E+0\t\t
Delta_X\t0,001000\t0,001000\t\t
***End_of_Header***\t\t\t\t
X_Value\tDruck\tDruck_0\tComment
0,000000\t1,500000\t0,100000
0,001000\t1,600000E+0\t0,200000
0,002000\t1,700000\t0,300000
"""


def columns(channels: dict[str, Any], **keys: Any) -> ColumnMap:
    return record_from(ColumnMap, {"channels": channels, **keys})


def written(folder: Path, name: str, content: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


TIME = {"column": "X_Value", "unit": "s"}
DRUCK = {"column": "Druck", "unit": "bar_g", "factor": 2.0}


@pytest.mark.parametrize("name", ["test.txt", "test.lvm", "test.dat"])
def test_labview_with_a_header_and_decimal_commas(tmp_path: Path, name: str) -> None:
    path = written(tmp_path, name, LVM)
    chosen = columns({"time": TIME, "pressure_1": DRUCK}, delimiter="tab", decimal="comma", skip_lines=15)
    found = read_foreign(path, chosen)
    assert found.time.tolist() == [0.0, 0.001, 0.002]
    assert np.allclose(found["pressure_1"], 101325.0 + 2e5 * np.array([1.5, 1.6, 1.7]))


def test_words_of_ones_own_and_words_that_nobody_knows(tmp_path: Path) -> None:
    path = written(tmp_path, "a.csv", "t,way\n0,heave\n1,lower\n")
    direction: dict[str, Any] = {"column": "way"}
    with pytest.raises(DataError, match=r"line 2, column 'way': 'heave' is not .*channels\.direction\.words"):
        read_foreign(path, columns({"time": {"column": "t", "unit": "s"}, "direction": direction}))
    direction["words"] = {"heave": 1.0, "lower": -1.0}
    found = read_foreign(path, columns({"time": {"column": "t", "unit": "s"}, "direction": direction}))
    assert found["direction"].tolist() == [1.0, -1.0]


LITRES = {"column": "Q", "unit": "L/min"}


@pytest.mark.parametrize(
    ("flow", "density"),
    [
        ({**LITRES, "at": "ANR", "gas": "air"}, 1.185),
        ({**LITRES, "unit": "Nl/min", "at": "DIN 1343", "gas": "air"}, 1.2923),
        ({**LITRES, "unit": "slm", "at": "0 degC, 1.01325 bar_a", "gas": "CO2"}, 1.9631),
        ({**LITRES, "unit": "L/min (DIN 1343, CO2)"}, 1.9631),
        ({**LITRES, "unit": "L/min (DIN 1343)"}, 1.9631),
        ({**LITRES, "at": "ANR"}, 1.8052),
        # Condition and gas in two places, or twice.
        ({**LITRES, "unit": "L/min (ANR)", "gas": "air"}, 1.185),
        ({**LITRES, "unit": "L/min (air)", "at": "ANR"}, 1.185),
        ({**LITRES, "unit": "L/min (ANR, air)", "at": "ISO 8778", "gas": "0.02897 kg/mol"}, 1.185),
        ({**LITRES, "unit": "Nl/min (DIN 1343, CO2)", "at": "0 degC, 1.01325 bar_a", "gas": "CO2"}, 1.9631),
    ],
)
def test_a_flow_meter_shows_volume_at_a_condition(tmp_path: Path, flow: dict[str, Any], density: float) -> None:
    path = written(tmp_path, "flow.csv", "t,Q\n0,60\n1,120\n")
    chosen = columns({"time": {"column": "t", "unit": "s"}, "mass_flow": flow})
    found = read_foreign(path, chosen, gas="0.044 kg/mol")
    assert np.allclose(found["mass_flow"], density * 1e-3 * np.array([1.0, 2.0]), rtol=2e-4)


@pytest.mark.parametrize(
    ("flow", "by_map"),
    [
        ({"unit": "L/min (ANR)", "at": "DIN 1343"}, "L/min (DIN 1343, air)"),
        ({"unit": "L/min (ANR, air)", "gas": "CO2"}, "L/min (ANR, CO2)"),
    ],
)
def test_a_condition_or_gas_that_contradicts_the_unit_is_refused(
    tmp_path: Path, flow: dict[str, Any], by_map: str
) -> None:
    path = written(tmp_path, "flow.csv", "t,Q\n0,60\n1,120\n")
    chosen = columns({"time": {"column": "t", "unit": "s"}, "mass_flow": {"column": "Q", **flow}})
    expected = f"means '{by_map}' by 'at' and 'gas', but 'L/min (ANR, air)' by 'unit'; give each only once"
    with pytest.raises(DataError, match=re.escape(expected)):
        read_foreign(path, chosen, gas="air")


def test_a_header_may_state_condition_and_gas(tmp_path: Path) -> None:
    path = written(tmp_path, "flow.csv", "time [s],mass_flow [L/min (ANR, air)],angle [deg]\n0,60,1\n1,60,2\n")
    assert np.allclose(read_recording(path)["mass_flow"], 1.185e-3)


METERED = "mass_flow [L/min (ANR, air)]"


@pytest.mark.parametrize("name", [METERED, f'"{METERED}"'])
@pytest.mark.parametrize("lines", [0, 2])
def test_a_unit_with_the_delimiter_is_one_cell_through_a_map_too(tmp_path: Path, name: str, lines: int) -> None:
    path = written(tmp_path, "flow.csv", "made by,a meter\n" * lines + f"time [s],{name},angle [deg]\n0,60,1\n1,60,2\n")
    flow = {"column": METERED, "unit": "L/min (ANR, air)"}
    angle = {"column": "angle [deg]", "unit": "deg"}
    channels = {"time": {"column": "time [s]", "unit": "s"}, "mass_flow": flow, "angle": angle}
    found = read_foreign(path, columns(channels, skip_lines=lines))
    assert np.allclose(found["mass_flow"], 1.185e-3)
    assert np.allclose(np.degrees(found["angle"]), [1.0, 2.0])
    if lines:
        with pytest.raises(DataError, match=r"give delimiter, skip_lines or header"):
            read_foreign(path, columns(channels))


@pytest.mark.parametrize("mark", ["\t", ";", ","])
def test_a_txt_file_is_a_table_of_what_separates_its_columns(tmp_path: Path, mark: str) -> None:
    text = "time [ms],pressure_1 [barg]\n0,1.5\n10,1.6\n".replace(",", mark)
    path = written(tmp_path, "a.txt", text if mark == "," else text.replace(".", ","))
    found = read_recording(path)
    assert found.time.tolist() == [0.0, 0.01]
    assert np.allclose(found["pressure_1"], [251325.0, 261325.0])


SECONDS, PRESSURE = np.arange(5) * 0.01, np.array([1.0, 1.1, 1.2, 1.3, 1.4])


def saved_v5(path: Path) -> None:
    """A To Workspace block in all three formats that are no objects, a matrix, and what importdata makes."""
    signals = np.zeros(2, dtype=[("values", object), ("label", object)])
    signals["values"][0], signals["values"][1] = PRESSURE[:, None], 2 * PRESSURE[:, None]
    signals["label"][:] = ["p1", "p2"]
    scipy.io.savemat(
        path,
        {
            "t": SECONDS[:, None],
            "p1": PRESSURE[None, :],
            "M": np.column_stack([SECONDS, PRESSURE, 2 * PRESSURE]),
            "log": {"time": SECONDS[:, None], "signals": signals, "blockName": "model/p"},
            "ts": {"Time": SECONDS[:, None], "Data": PRESSURE.reshape(1, 1, -1), "Name": "p"},
            "opts": {"data": np.column_stack([SECONDS, PRESSURE]), "colheaders": np.array(["time", "p"], dtype=object)},
            "cells": np.array([f"08:00:0{second}" for second in range(5)], dtype=object),
            "scalar": 3.0,
        },
    )


def saved_v73(path: Path) -> None:
    """The same as MATLAB lays it out in HDF5: transposed, texts as codes, references for arrays of structures."""
    with h5py.File(path, "w", userblock_size=512) as file:

        def numbers(group: h5py.Group, name: str, values: Any) -> h5py.Dataset:
            made = group.create_dataset(name, data=np.atleast_2d(np.asarray(values, dtype=float)).T)
            made.attrs["MATLAB_class"] = np.bytes_("double")
            return made

        def text(group: h5py.Group, name: str, value: str) -> h5py.Dataset:
            made = group.create_dataset(name, data=np.array([[ord(letter)] for letter in value], dtype=np.uint16))
            made.attrs["MATLAB_class"] = np.bytes_("char")
            return made

        def cells(group: h5py.Group, name: str, values: list[str]) -> None:
            hidden = [text(file["#refs#"], f"{name}{place}", value).ref for place, value in enumerate(values)]
            made = group.create_dataset(name, data=np.array(hidden, dtype=h5py.ref_dtype)[:, None])
            made.attrs["MATLAB_class"] = np.bytes_("cell")

        def structure(group: h5py.Group, name: str) -> h5py.Group:
            made = group.create_group(name)
            made.attrs["MATLAB_class"] = np.bytes_("struct")
            return made

        file.create_group("#refs#")
        numbers(file, "t", SECONDS[:, None])
        numbers(file, "p1", PRESSURE)
        numbers(file, "M", np.column_stack([SECONDS, PRESSURE, 2 * PRESSURE]))
        log = structure(file, "log")
        numbers(log, "time", SECONDS[:, None])
        signals = structure(log, "signals")
        values = [numbers(file["#refs#"], f"v{one}", one * PRESSURE[:, None]).ref for one in (1, 2)]
        signals.create_dataset("values", data=np.array(values, dtype=h5py.ref_dtype)[:, None])
        labels = [text(file["#refs#"], f"l{one}", f"p{one}").ref for one in (1, 2)]
        signals.create_dataset("label", data=np.array(labels, dtype=h5py.ref_dtype)[:, None])
        stamped = structure(file, "ts")
        numbers(stamped, "Time", SECONDS[:, None])
        numbers(stamped, "Data", PRESSURE[:, None])
        opts = structure(file, "opts")
        numbers(opts, "data", np.column_stack([SECONDS, PRESSURE]))
        cells(opts, "colheaders", ["time", "p"])
        cells(file, "cells", [f"08:00:0{second}" for second in range(5)])
        thing = file.create_dataset("thing", data=np.zeros((1, 6), dtype=np.uint32))
        thing.attrs["MATLAB_class"], thing.attrs["MATLAB_object_decode"] = np.bytes_("timeseries"), 3
    content = bytearray(path.read_bytes())
    content[:116] = b"MATLAB 7.3 MAT-file".ljust(116)
    content[124:128] = b"\x00\x02IM"
    path.write_bytes(bytes(content))


@pytest.fixture(params=[saved_v5, saved_v73], ids=["v5", "v7.3"])
def matlab(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / "run.mat"
    request.param(path)
    return path


@pytest.mark.parametrize(
    ("time", "pressure", "factor"),
    [
        ("t", "p1", 1.0),
        ("M(:,1)", "M(:, 3)", 2.0),
        ("log.time", "log.signals(2).values", 2.0),
        ("ts.Time", "ts.Data", 1.0),
        ("opts.data(:,1)", "opts.data(:,2)", 1.0),
    ],
)
def test_variables_of_matlab(matlab: Path, time: str | int, pressure: str | int, factor: float) -> None:
    channels = {"time": {"column": time, "unit": "s"}, "pressure_1": {"column": pressure, "unit": "bar_a"}}
    found = read_foreign(matlab, columns(channels))
    assert np.allclose(found.time, SECONDS)
    assert np.allclose(found["pressure_1"], 1e5 * factor * PRESSURE)


def test_times_of_day_and_rates_with_variables_of_matlab(matlab: Path) -> None:
    pressure = {"column": "p1", "unit": "bar_a"}
    stamped = read_foreign(matlab, columns({"time": {"column": "cells"}, "pressure_1": pressure}))
    assert stamped.time.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert np.allclose(
        read_foreign(matlab, columns({"time": {"rate": "100 Hz"}, "pressure_1": pressure})).time, SECONDS
    )


@pytest.mark.parametrize(
    ("column", "message"),
    [
        ("p11", "channels.pressure_1.column = 'p11': the file has no such variable, did you mean 'p1'"),
        ("cells", "; available: "),
    ],
)
def test_a_variable_that_is_not_there_is_named_with_its_key(matlab: Path, column: str, message: str) -> None:
    channels = {"time": {"column": "t", "unit": "s"}, "pressure_1": {"column": column, "unit": "bar_a"}}
    with pytest.raises(DataError) as caught:
        read_foreign(matlab, columns(channels))
    assert message in str(caught.value)
    with pytest.raises(
        DataError, match=r"\(1\) channels\.pressure_1\.column.*\(2\) channels\.torque\.column = 'T': the"
    ):
        read_foreign(matlab, columns({**channels, "torque": {"column": "T", "unit": "N m"}}))


@pytest.mark.parametrize(
    "content", [b"no matlab at all" * 50, b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"\xff" * 99]
)
def test_what_is_no_matlab_file_is_one_line(tmp_path: Path, content: bytes) -> None:
    with pytest.raises(DataError, match=r"a\.mat: ") as caught:
        read_matlab(written(tmp_path, "a.mat", content))
    assert "\n" not in str(caught.value)


def test_an_older_file_has_its_variables_and_names_objects_that_only_matlab_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scipy.io.savemat(tmp_path / "plain.mat", {"t": SECONDS[:, None], "p1": PRESSURE[:, None]})
    variables = read_matlab(tmp_path / "plain.mat").columns
    np.testing.assert_array_equal([variables["t"], variables["p1"]], [SECONDS, PRESSURE])
    # As SciPy gives what MATLAB wrote: without a name of its own, and with what it is in its fields.
    fields = [(name, object) for name in ("s0", "s1", "s2", "arr")]
    thing = np.array([(b"log", b"MCOS", b"timeseries", np.zeros(6))], dtype=fields)
    monkeypatch.setattr(scipy.io, "loadmat", lambda *_, **__: {"y": PRESSURE, "None": thing})
    assert open_matlab(tmp_path / "plain.mat").objects == [("log", "timeseries")]
