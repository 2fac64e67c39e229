"""A NetCDF file can point at other files and promise more numbers than it has; both are refused, unread."""

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.storage.netcdf import read_netcdf
from ppafo.storage.reading import read_recording

SECRET = np.arange(3.0)


def secret(folder: Path) -> Path:
    """Another user's file, as raw numbers and as an HDF5 file."""
    (folder / "raw.bin").write_bytes(SECRET.tobytes())
    with h5py.File(folder / "other.h5", "w") as file:
        file["time"] = SECRET
        file["time"].attrs["units"] = "s"
    return folder


def external_storage(file: h5py.File, folder: Path) -> None:
    file.create_dataset("angle", (3,), "f8", external=[(str(folder / "raw.bin"), 0, h5py.h5f.UNLIMITED)])


def external_link(file: h5py.File, folder: Path) -> None:
    file["angle"] = h5py.ExternalLink(str(folder / "other.h5"), "time")


def soft_link(file: h5py.File, folder: Path) -> None:
    file["there"] = h5py.ExternalLink(str(folder / "other.h5"), "/")
    file["angle"] = h5py.SoftLink("/there/time")


def virtual_data_set(file: h5py.File, folder: Path) -> None:
    layout = h5py.VirtualLayout((3,), "f8")
    layout[:] = h5py.VirtualSource(str(folder / "other.h5"), "time", (3,))
    file.create_virtual_dataset("angle", layout)


def time_by_link(file: h5py.File, folder: Path) -> None:
    del file["time"]
    file["time"] = h5py.ExternalLink(str(folder / "other.h5"), "time")


@pytest.mark.parametrize("make", [external_storage, external_link, soft_link, virtual_data_set, time_by_link])
def test_numbers_of_another_file_are_refused(tmp_path: Path, make: Callable[[h5py.File, Path], None]) -> None:
    with h5py.File(tmp_path / "bench.nc", "w") as file:
        file["time"] = SECRET
        file["time"].attrs["units"] = "s"
        make(file, secret(tmp_path))
        if make in (external_storage, virtual_data_set):
            file["angle"].attrs["units"] = "rad"
    with pytest.raises(DataError, match=r"bench\.nc: .*in the file itself"):
        read_netcdf(tmp_path / "bench.nc")


def test_recording_that_another_program_packed_with_gzip_is_read(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "bench.nc", "w") as file:
        for name, unit in (("time", "s"), ("angle", "rad")):
            file.create_dataset(
                name, data=np.arange(10_000.0), chunks=(3_000,), compression="gzip", shuffle=True, fletcher32=True
            )
            file[name].attrs["units"] = unit
    assert read_netcdf(tmp_path / "bench.nc")["angle"][-1] == 9_999.0


def test_module_in_the_working_folder_is_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "h5py.py").write_text(f"open({str(tmp_path / 'sprung')!r}, 'w')\n")
    with h5py.File(tmp_path / "bench.nc", "w") as file:
        file["time"] = np.arange(3.0)
        file["time"].attrs["units"] = "s"
    monkeypatch.chdir(tmp_path)
    assert len(read_recording("bench.nc")) == 3
    assert not (tmp_path / "sprung").exists()
