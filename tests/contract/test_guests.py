"""A guest is a room that no other imports: without its folder everything else works."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import ppafo

GUESTS = ("gym", "wearer")


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package without its guests."""
    folder = tmp_path_factory.mktemp("bare")
    package = Path(ppafo.__file__).parent
    shutil.copytree(package, folder / "ppafo", ignore=shutil.ignore_patterns("__pycache__"))
    for name in GUESTS:
        shutil.rmtree(folder / "ppafo" / name)
    return folder


def run_in(bare: Path, home: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A command of that copy, run in a folder."""
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=home,
        env={**os.environ, "PYTHONPATH": str(bare)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["simulate", "torque-task-proportional", "--set", "run.duration=0.2s"],
        ["walk", "off", "--set", "run.duration=6s"],
        ["walk", "--list"],
        ["doctor", "--schema", "scenario"],
        ["export", "c", "torque-task-proportional", "--out", "c"],
    ],
    ids=" ".join,
)
def test_without_its_guests_the_package_works(bare: Path, tmp_path: Path, arguments: list[str]) -> None:
    done = run_in(bare, tmp_path, "-m", "ppafo", *arguments)
    assert (done.returncode, done.stderr.count("Traceback")) == (0, 0), done.stderr


def test_a_motion_whose_folder_is_not_there_is_not_known(bare: Path, tmp_path: Path) -> None:
    done = run_in(bare, tmp_path, "-m", "ppafo", "walk", "reacting")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "motion.kind = 'react' is not known; allowed: free, held, prescribed, leg, walk" in done.stderr


WALKED = """
import sys
import ppafo
print(ppafo.compare_walks(ppafo.load_walk("proportional"), minutes=0.1).is_completed)
print(*(name for name in sys.modules if name.startswith("ppafo.wearer")))
"""


def test_a_walk_along_a_gait_loads_nothing_of_the_wearer_who_reacts(tmp_path: Path) -> None:
    done = run_in(Path(ppafo.__file__).parents[1], tmp_path, "-c", WALKED)
    assert done.stdout.split() == ["True"], done.stderr
