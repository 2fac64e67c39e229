"""Every example runs from beginning to end and writes what it says."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / "src" / "ppafo" / "examples").glob("*/*.py"))
EXAMPLES = [example for example in EXAMPLES if example.parent.name == "first-steps"]
WRITTEN = {
    "first_steps": {
        "first-steps/torque-task.png",
        "first-steps/own-controller.png",
        "first-steps/own-controller/recording.nc",
        "first-steps/own-controller/recording.csv",
        "first-steps/own-controller/run.json",
    },
}


def run(example: Path, folder: Path) -> str:
    """What an example prints when it is run in a folder, where there is no screen."""
    environment = {**os.environ, "MPLBACKEND": "agg"}
    done = subprocess.run(
        [sys.executable, str(example)], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_example_is_tested() -> None:
    assert {example.stem for example in EXAMPLES} == set(WRITTEN)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.stem)
def test_an_example_runs_and_writes_its_files_under_out_and_nowhere_else(example: Path, tmp_path: Path) -> None:
    run(example, tmp_path)
    written = {str(path.relative_to(tmp_path / "out")) for path in tmp_path.rglob("*") if path.is_file()}
    assert written == WRITTEN[example.stem]
