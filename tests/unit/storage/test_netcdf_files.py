"""Recordings as NetCDF."""

from pathlib import Path

import h5netcdf
import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.signals import Channel, Recording
from ppafo.storage import dataset_of
from ppafo.storage.netcdf import netcdf_bytes, read_netcdf


def recording() -> Recording:
    channels = {"angle": Channel(np.array([1.0 / 3.0, 1e-17]), "rad"), "command": Channel(np.ones(2), "-")}
    return Recording("bench é", np.array([0.0, 0.1]), channels, "synthetic")


def written(folder: Path, recording: Recording) -> Path:
    path = folder / "bench.nc"
    path.write_bytes(netcdf_bytes(recording))
    return path


def test_a_file_is_read_back_exactly(tmp_path: Path) -> None:
    assert read_netcdf(written(tmp_path, recording())) == recording()


def test_the_same_recording_gives_the_same_bytes() -> None:
    assert netcdf_bytes(recording(), {"name": "task"}) == netcdf_bytes(recording(), {"name": "task"})


def test_xarray_opens_the_file_as_the_dataset_that_python_gets(tmp_path: Path) -> None:
    import xarray

    path = tmp_path / "bench.nc"
    path.write_bytes(netcdf_bytes(recording(), {"name": "task", "note": "x" * 200_000}))
    with xarray.open_dataset(path, engine="h5netcdf") as opened:
        xarray.testing.assert_identical(opened.load(), dataset_of(recording(), {"name": "task", "note": "x" * 200_000}))


def test_attributes_hold_units_long_names_and_the_scenario() -> None:
    dataset = dataset_of(recording(), {"name": "task"})
    assert dataset["angle"].attrs == {"units": "rad", "long_name": "ankle angle, growing in plantarflexion"}
    assert dataset["command"].attrs["units"] == "1"
    assert dataset["time"].attrs["units"] == "s"
    assert dataset.attrs == {"title": "bench é", "kind": "synthetic", "scenario": '{"name": "task"}'}


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
def test_a_file_cut_off_anywhere_is_refused_by_name(tmp_path: Path) -> None:
    whole = netcdf_bytes(recording())
    path = tmp_path / "cut.nc"
    for share in (0.001, 0.2, 0.5, 0.9, 0.999):
        path.write_bytes(whole[: int(len(whole) * share)])
        with pytest.raises(DataError, match="not a complete NetCDF recording"):
            read_netcdf(path)


def changed(folder: Path, variable: str, units: str) -> Path:
    path = written(folder, recording())
    with h5netcdf.File(path, "a") as file:
        file.variables[variable].attrs["units"] = units
    return path


def test_a_wrong_unit_is_refused_by_file_and_channel(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"bench\.nc: .*channel 'angle' must be in 'rad', not in 'deg'"):
        read_netcdf(changed(tmp_path, "angle", "deg"))
    with pytest.raises(DataError, match=r"'time' must be in 's', not in 'ms'"):
        read_netcdf(changed(tmp_path, "time", "ms"))


def test_what_a_channel_declares_between_its_samples_is_an_attribute(tmp_path: Path) -> None:
    supply = Channel(np.array([4.0e5, 5.0e5]), "Pa", "hold")
    declared = Recording("bench", np.array([0.0, 1.0]), {"supply_pressure": supply})
    assert read_netcdf(written(tmp_path, declared)) == declared


def test_a_channel_of_two_dimensions_is_refused(tmp_path: Path) -> None:
    import xarray

    path = tmp_path / "two.nc"
    made = xarray.Dataset({"angle": (("time", "y"), np.zeros((2, 3)))}, {"time": ("time", [0.0, 1.0], {"units": "s"})})
    made.to_netcdf(path, engine="h5netcdf")
    with pytest.raises(DataError, match="'angle' must be numeric and one-dimensional over 'time'"):
        read_netcdf(path)
