"""A form of gait recording of another package is one file and one entry point: its files are imported by that."""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.gait import load_gait, walk_recording
from ppafo.gait.recorded import ImportSettings, import_gait
from ppafo.gait.recorded.source import FORMS
from tests.page_code import block_with, write_package

PAGE = "how-to/extend.md"
OWN = list(FORMS)
GAIT = load_gait("falisse2019-subject1")
PERCENT = np.linspace(0.0, 1.0, 101)


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with the package of the page, as an installer leaves it; forgotten at the end of the test."""
    folder = tmp_path / "site"
    module, entry_points = block_with(PAGE, "FORM = GaitForm"), block_with(PAGE, "ppafo.gait_forms")
    write_package(folder, "my_forms.goniometer", module, entry_points)
    monkeypatch.syspath_prepend(folder)
    monkeypatch.chdir(tmp_path)
    yield folder
    for name in set(FORMS) - set(OWN):
        del FORMS[name]
    for name in [name for name in sys.modules if name.split(".")[0] == "my_forms"]:
        del sys.modules[name]


def write_walk(path: Path, names: str = "ms shank_r ankle_r") -> Path:
    """Five strides of the gait of the package, as a goniometer would have written them."""
    walk = walk_recording(GAIT, 5)
    shank, ankle = np.degrees(walk["shank_angle"]), 90.0 - np.degrees(walk["ankle_angle"])
    with path.open("w") as file:
        file.write(f"# goniometer 2, serial 417\n{names}\n")
        np.savetxt(file, np.column_stack([1e3 * walk.time, shank, ankle]), fmt="%.4f")
    return path


@pytest.mark.usefixtures("site")
def test_its_files_are_recognised_and_imported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_walk(tmp_path / "walk.txt")
    found = import_gait([path], ImportSettings(body_mass=62.0, name="mine")).gait
    walk = walk_recording(GAIT, 5)
    rows = np.column_stack([walk.time, walk["shank_angle"], walk["ankle_angle"]])
    header = "time [s],shank_angle [rad],ankle_angle [rad]"
    np.savetxt(tmp_path / "walk.csv", rows, delimiter=",", header=header, comments="")
    same = import_gait([tmp_path / "walk.csv"], ImportSettings(body_mass=62.0, name="mine")).gait
    for name in ("shank_angle", "ankle_angle"):
        away = found.curves[name].values_at(PERCENT) - same.curves[name].values_at(PERCENT)
        assert np.abs(away).max() < 1e-5
    assert main(["gait", "import", str(path), "--body-mass", "62 kg"]) == 0
    assert main(["gait", "import", str(path), "--body-mass", "62 kg", "--form", "goniometre"]) == 2
    assert "there is no gait format 'goniometre', did you mean 'goniometer'?" in capsys.readouterr().err


@pytest.mark.usefixtures("site")
def test_a_wrong_file_of_it_is_one_line_that_names_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for names, said in (
        ("s shank_r ankle_r", "of which the first must be 'ms'"),
        ("ms shank_l ankle_l", "shank_angle: there is no column 'shank_r', did you mean 'shank_l'?"),
    ):
        assert main(["gait", "import", str(write_walk(tmp_path / "x.txt", names)), "--body-mass", "62 kg"]) == 2
        printed = capsys.readouterr().err
        assert said in printed
        assert "x.txt" in printed
