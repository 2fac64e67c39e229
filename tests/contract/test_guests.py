"""A guest is a room that no other imports: without its folder everything else works, and says what is missing."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import ppafo

GUESTS = ("page", "processor")

PROFILE = """
schema_version = 1
name = "tiny"
scenario = "torque-task-proportional"
simulated = 1
gain_factors = [1.0]
profile = { time = ["0 s", "0.3 s", "0.6 s", "1 s"], torque = ["0 N m", "3 N m", "3 N m", "0 N m"] }
use.repetitions = 50
limits.rms_error = "0.7 N m"
bottles = ["paper-co2-9oz"]
valves.own = {}
"""
DECAY = """
schema_version = 1
name = "decay"
device.set = "ppafo2011"
[[procedure]]
kind = "free-decay"
recordings = ["free-decay.csv"]
"""


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package without its guests, beside a design, a problem and its recording."""
    folder = tmp_path_factory.mktemp("bare")
    package = Path(ppafo.__file__).parent
    absent = {str(package / name) for name in GUESTS}

    def left_out(parent: str, names: list[str]) -> set[str]:
        return {name for name in names if name == "__pycache__" or str(Path(parent) / name) in absent}

    shutil.copytree(package, folder / "ppafo", ignore=left_out)
    assert not any((folder / "ppafo" / name).exists() for name in GUESTS)
    (folder / "profile.toml").write_text(PROFILE)
    (folder / "decay.toml").write_text(DECAY)
    return folder


def called(bare: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Return what ``ppafo`` of the copy did in a folder."""
    return subprocess.run(
        [sys.executable, "-m", "ppafo", *arguments],
        cwd=folder,
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
        ["design", "BARE/profile.toml"],
        ["export", "c", "torque-task-proportional", "--out", "c"],
    ],
    ids=lambda arguments: " ".join(arguments[:2]),
)
def test_without_its_guests_the_package_works(bare: Path, tmp_path: Path, arguments: list[str]) -> None:
    done = called(bare, tmp_path, *(word.replace("BARE", str(bare)) for word in arguments))
    assert (done.returncode, done.stderr.count("Traceback")) == (0, 0), done.stderr


@pytest.mark.parametrize(
    ("arguments", "room"),
    [
        (["workbench"], "ppafo.page"),
        (["export", "firmware", "torque-task-proportional", "--out", "firmware"], "ppafo.processor"),
        (["simulate", "torque-task-proportional", "--set", "controller.kind=pid_fixed_point"], "ppafo.processor"),
    ],
    ids=lambda given: " ".join(given[:2]) if isinstance(given, list) else given,
)
def test_a_command_of_a_guest_says_that_it_is_not_installed(
    bare: Path, tmp_path: Path, arguments: list[str], room: str
) -> None:
    done = called(bare, tmp_path, *arguments)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert f"is part of {room}, which is not installed" in done.stderr
