"""A NetCDF file can point at other files and promise more numbers than it has; both are refused, unread."""

import resource
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.storage import trial_reading
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


def promised(file: h5py.File) -> None:
    file.create_dataset("time", (100_000_000,), "f8", chunks=(1_000_000,), compression="gzip")


def fill_value(file: h5py.File) -> None:
    file.create_dataset("time", (1_000_000,), "f8", fillvalue=1.0)


def some_chunks_missing(file: h5py.File) -> None:
    time = file.create_dataset("time", (100_000,), "f8", chunks=(1_000,))
    time[:1_000] = np.arange(1_000.0)


def huge_chunk(file: h5py.File) -> None:
    time = file.create_dataset("time", (2,), "f8", chunks=(50_000_000,), maxshape=(None,), compression="gzip")
    assert time.size == 2


def many_names(file: h5py.File) -> None:
    file["time"] = np.arange(20_000.0)
    for number in range(500):
        file[f"angle_{number}"] = file["time"]


def gzip_within_gzip(file: h5py.File) -> None:
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_chunk((1_000,))
    properties.set_deflate(9)
    properties.set_deflate(9)
    space = h5py.h5s.create_simple((1_000,))
    h5py.h5d.create(file.id, b"time", h5py.h5t.IEEE_F64LE, space, properties)


def chunk_that_grows(file: h5py.File) -> None:
    time = file.create_dataset("time", (1_000,), "f8", chunks=(1_000,), compression="gzip")
    packer = zlib.compressobj()
    packed = [packer.compress(bytes(1_000_000)) for _ in range(300)]
    time.id.write_direct_chunk((0,), b"".join([*packed, packer.flush()]))


def shuffled_after_gzip(file: h5py.File) -> None:
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_chunk((1_000,))
    properties.set_deflate(9)
    properties.set_shuffle()
    space = h5py.h5s.create_simple((1_000,))
    h5py.h5d.create(file.id, b"time", h5py.h5t.IEEE_F64LE, space, properties)


HOSTILE = {
    promised: "requires 808 MB of memory",
    fill_value: "the file contains none of them",
    some_chunks_missing: "the file contains only some of them",
    huge_chunk: "requires 400 MB of memory",
    many_names: "requires 80 MB of memory",
    gzip_within_gzip: "has an unsupported compression",
    shuffled_after_gzip: "has an unsupported compression",
    chunk_that_grows: "'time' decompresses to more than its stated size",
}


@pytest.mark.parametrize("make", HOSTILE, ids=lambda make: make.__name__)
def test_more_than_the_file_holds_is_refused_before_memory_is_taken(
    tmp_path: Path, make: Callable[[h5py.File], None]
) -> None:
    with h5py.File(tmp_path / "bench.nc", "w") as file:
        make(file)
        file["time"].attrs["units"] = "s"
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(DataError, match=rf"bench\.nc: .*{HOSTILE[make]}"):
        read_netcdf(tmp_path / "bench.nc")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # KiB


def test_recording_that_another_program_packed_with_gzip_is_read(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "bench.nc", "w") as file:
        for name, unit in (("time", "s"), ("angle", "rad")):
            file.create_dataset(
                name, data=np.arange(10_000.0), chunks=(3_000,), compression="gzip", shuffle=True, fletcher32=True
            )
            file[name].attrs["units"] = unit
    assert read_netcdf(tmp_path / "bench.nc")["angle"][-1] == 9_999.0


@pytest.mark.parametrize("key", ["scale_factor", "add_offset", "_FillValue", "missing_value"])
def test_packed_numbers_and_gaps_are_not_misread(tmp_path: Path, key: str) -> None:
    with h5py.File(tmp_path / "bench.nc", "w") as file:
        file["time"], file["angle"] = np.arange(3.0), np.array([0, 1, 2], dtype="i2")
        file["time"].attrs["units"], file["angle"].attrs["units"] = "s", "rad"
        file["angle"].attrs[key] = 1
    with pytest.raises(DataError, match=rf"bench\.nc: 'angle' .*'{key}'"):
        read_netcdf(tmp_path / "bench.nc")


def test_file_larger_than_any_recording_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "bench.nc"
    with path.open("wb") as file:
        file.truncate(10**12)
    with pytest.raises(DataError, match=r"bench\.nc: cannot be read: it is larger than 2000 MB"):
        read_netcdf(path)


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "is damaged: the library h5py crashes"),
        ("import time; time.sleep(60)", "is damaged: the library h5py does not finish reading it"),
    ],
)
def test_library_that_crashes_or_hangs_on_a_file_takes_nobody_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str, message: str
) -> None:
    with h5py.File(tmp_path / "bench.nc", "w") as file:
        file["time"] = np.arange(3.0)
        file["time"].attrs["units"] = "s"
    assert len(read_recording(tmp_path / "bench.nc")) == 3
    monkeypatch.setattr(trial_reading, "TRIAL", ("-c", code))
    monkeypatch.setattr(trial_reading, "_MAXIMUM_SECONDS", 1.5)
    with pytest.raises(DataError, match=rf"bench\.nc: {message}"):
        read_recording(tmp_path / "bench.nc")


def test_module_in_the_working_folder_is_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "h5py.py").write_text(f"open({str(tmp_path / 'sprung')!r}, 'w')\n")
    with h5py.File(tmp_path / "bench.nc", "w") as file:
        file["time"] = np.arange(3.0)
        file["time"].attrs["units"] = "s"
    monkeypatch.chdir(tmp_path)
    assert len(read_recording("bench.nc")) == 3
    assert not (tmp_path / "sprung").exists()


@pytest.mark.parametrize(
    ("key", "limits"),
    [
        ("valid_min", 0.5),
        ("valid_max", 1.5),
        ("valid_range", [0.5, 3.0]),
        ("valid_range", [0, 1]),
        ("valid_range", [0.0, 2.0, 3.0]),
        ("valid_range", [0.0, 2.0]),
    ],
)
def test_values_outside_the_valid_ones_of_the_file_are_refused(key: str, limits: object, tmp_path: Path) -> None:
    with h5py.File(tmp_path / "bench.nc", "w") as file:
        for name, unit in (("time", "s"), ("angle", "rad")):
            file[name] = np.arange(3.0)
            file[name].attrs["units"] = unit
        file["angle"].attrs[key] = limits
    if limits == [0.0, 2.0]:
        assert read_netcdf(tmp_path / "bench.nc")["angle"].tolist() == [0.0, 1.0, 2.0]
        return
    with pytest.raises(DataError, match=f"'angle'.*'{key}'"):
        read_netcdf(tmp_path / "bench.nc")
