"""A guest is a room that no other imports: without its folder everything else works."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import ppafo

GUESTS = ("gym",)


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package without its guests."""
    folder = tmp_path_factory.mktemp("bare")
    package = Path(ppafo.__file__).parent
    shutil.copytree(package, folder / "ppafo", ignore=shutil.ignore_patterns("__pycache__", *GUESTS))
    assert not any((folder / "ppafo" / name).exists() for name in GUESTS)
    return folder


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["simulate", "torque-task-proportional", "--set", "run.duration=0.2s"],
        ["walk", "off", "--set", "run.duration=6s"],
        ["export", "c", "torque-task-proportional", "--out", "c"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_without_its_guests_the_package_works(bare: Path, tmp_path: Path, arguments: list[str]) -> None:
    environment = {**os.environ, "PYTHONPATH": str(bare)}
    done = subprocess.run(
        [sys.executable, "-m", "ppafo", *arguments],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr.count("Traceback")) == (0, 0), done.stderr
