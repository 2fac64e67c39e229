"""A file of MATLAB 7.3 is HDF5, which can point at other files: that one is refused, as recordings in NetCDF are."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.storage.matlab import open_matlab, read_matlab

HEAD = b"MATLAB 7.3 MAT-file".ljust(512, b" ")


def written(path: Path, fill: Any) -> Path:
    with h5py.File(path, "w", userblock_size=512) as file:
        file["angle"] = np.arange(3.0)
        fill(file)
    with path.open("r+b") as begun:
        begun.write(HEAD)
    return path


def link(file: Any) -> None:
    file["other"] = h5py.ExternalLink("secret.h5", "/angle")


def inner_link(file: Any) -> None:
    file.create_group("leg")["other"] = h5py.ExternalLink("secret.h5", "/angle")


def raw_bytes(file: Any) -> None:
    file.create_dataset("other", (4,), "u1", external=[("secret.txt", 0, 4)])


def virtual(file: Any) -> None:
    layout = h5py.VirtualLayout((3,), "f8")
    layout[:] = h5py.VirtualSource("secret.h5", "angle", (3,))
    file.create_virtual_dataset("other", layout)


@pytest.mark.parametrize("fill", [link, inner_link, raw_bytes, virtual])
def test_numbers_of_another_file_are_refused(fill: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    written(tmp_path / "secret.h5", lambda _file: None)
    Path("secret.txt").write_text("root", encoding="utf-8")
    with pytest.raises(DataError, match=r"'other' is an HDF5 link|numbers of 'other' are stored in another file"):
        read_matlab(written(tmp_path / "given.mat", fill))


def odd_text(file: Any) -> None:
    file["word"] = np.array([2**40, -1])
    file["word"].attrs["MATLAB_class"] = np.bytes_("char")


def test_a_text_of_no_characters_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"given\.mat: cannot be read as a \.mat file"):
        open_matlab(written(tmp_path / "given.mat", odd_text))
