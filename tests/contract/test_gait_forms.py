"""A form of gait recording of another package is one file and one entry point: its files are imported by that."""

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.gait import load_gait, walk_recording
from ppafo.gait.recorded import ImportSettings, import_gait
from ppafo.gait.recorded.form import GaitForm
from ppafo.gait.recorded.source import FORMS, read_table
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


def test_it_can_be_named_by_its_module_without_an_entry_point(site: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.rmtree(site / "my_forms-0.1.0.dist-info")
    path = write_walk(site.parent / "walk.txt")
    words = ["gait", "import", str(path), "--body-mass", "62 kg"]
    assert main(words) == 2
    assert "walk.txt: the first column must be 'time'" in capsys.readouterr().err
    assert main([*words, "--form", "my_forms.goniometer:FORM"]) == 0


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


@pytest.mark.parametrize("name", OWN)
def test_a_form_of_the_package_is_a_value_whose_suffixes_the_help_names(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    form = FORMS[name]
    assert isinstance(form, GaitForm)
    assert form.name == name
    assert all(suffix == suffix.lower() and suffix.startswith(".") for suffix in form.suffixes)
    with pytest.raises(SystemExit):
        main(["gait", "--help"])
    printed = capsys.readouterr().out
    missing = [suffix for suffix in form.suffixes if suffix not in printed]
    assert missing == [], "name them in the help of 'import' in src/ppafo/cli/gait.py"


def test_whoever_reads_a_table_learns_its_form(tmp_path: Path) -> None:
    path = tmp_path / "walk.csv"
    rows = "".join(f"{0.01 * row},{row},{row}\n" for row in range(9))
    path.write_text("time [s],shank_angle [deg],ankle_angle [deg]\n" + rows)
    assert read_table(path).form == "csv"
    path.write_text("time,ankle_angle_r,knee_angle_r\n" + rows)
    assert read_table(path).form == "opensim"
