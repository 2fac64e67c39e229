"""What a run loads: each library where it is needed, and no part of the package that the run has nothing to do with."""

import json
import os
import subprocess
import sys
from typing import Any

import pytest

HEAVY = frozenset(
    {
        *("dask", "h5netcdf", "h5py", "jax", "jinja2", "matplotlib", "numpy", "pandas"),
        *("PIL", "pint", "pyarrow", "pydantic", "scipy", "sksundae", "xarray"),
    }
)
READING, DRAWING = {"numpy", "pydantic"}, {"matplotlib", "PIL"}
WRITING = {"h5netcdf", "h5py", "jinja2"}
MOST_BEFORE_THE_RUN, MOST = 175, 223
"""Modules of the package that a run of a scenario may load; what has no part in it stays out.

The five phases of a step are among them, though a stored program needs none: their numbers are in its key."""
MOST_FROM_PYTHON, MOST_LINES_FROM_PYTHON = 140, 23_000
"""Modules and their lines that a run from Python may load: the verdict on what does not follow is among them."""

CODE = """
import json, sys
from ppafo.engine.lanes import LaneBlock

advance, seen = LaneBlock.advance, []

def watched(self, steps):
    seen or seen.append(list(sys.modules))
    advance(self, steps)

LaneBlock.advance = watched
{command}
print(json.dumps([seen[0], list(sys.modules)]))
"""
COMMAND = "from ppafo.cli.main import main\nassert main({words!r}) == 0"


def loaded_by(command: str) -> tuple[list[str], list[str]]:
    """Modules that a command had loaded as the run began, and in the end."""
    done = subprocess.run(
        [sys.executable, "-c", CODE.format(command=command)], env=os.environ, capture_output=True, text=True, check=True
    )
    found: Any = json.loads(done.stdout.splitlines()[-1])
    return found[0], found[1]


def heavy(modules: list[str]) -> set[str]:
    return {name.partition(".")[0] for name in modules} & HEAVY


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[str], list[str]]:
    """What ``ppafo simulate`` loads, with everything made that is kept."""
    words = ["simulate", "torque-task-proportional", "--out", str(tmp_path_factory.mktemp("run") / "result")]
    command = COMMAND.format(words=words)
    # Keys have the numbers of all modules that are loaded: a run that composes its step keeps its page under another.
    loaded_by(command)
    loaded_by(command)
    return loaded_by(command)


def test_a_run_loads_no_library_that_it_does_not_use(simulated: tuple[list[str], list[str]]) -> None:
    before, after = simulated
    assert heavy(before) == READING
    assert heavy(after) == READING | DRAWING | WRITING


@pytest.fixture(scope="module")
def run_from_python() -> list[str]:
    """What ``ppafo.simulate`` loads, with everything made that is kept."""
    command = "import ppafo\nppafo.simulate('torque-task-proportional')"
    loaded_by(command)
    return loaded_by(command)[1]


def test_a_run_from_python_draws_and_writes_nothing(run_from_python: list[str]) -> None:
    assert heavy(run_from_python) == READING
