"""What a run loads: each library where it is needed, and no part of the package that the run has nothing to do with."""

import json
import os
import subprocess
import sys
from pathlib import Path
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


def own(modules: list[str]) -> set[str]:
    return {name for name in modules if name.partition(".")[0] == "ppafo"}


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


def said_by(*words: str) -> tuple[int, str]:
    """Exit code and all words of a command in a process of its own, which has loaded no kinds before."""
    done = subprocess.run([sys.executable, "-m", "ppafo", *words], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.parametrize(
    "content",
    [
        'schema_version = 1\nname = "x"\n',
        'schema_version = 1\nname = "x"\n[controler]\nkind = "pid"\n',
        'schema_version = 1\nname = "x"\n[controller]\nproportional_gain = "1 1/(N m)"\n',
        'schema_version = 2\nname = "x"\n',
    ],
)
def test_a_file_that_names_no_kind_is_refused_in_one_line_by_a_process_that_has_loaded_none(
    content: str, tmp_path: Path
) -> None:
    (tmp_path / "x.toml").write_text(content)
    code, said = said_by("simulate", str(tmp_path / "x.toml"))
    assert code == 2
    assert said.count("\n") == 1
    assert "x.toml: " in said


@pytest.mark.long
def test_an_effect_that_nothing_has_named_before_can_be_varied() -> None:
    condition = ("--such-that", "rms_error <= 0.9 N m")
    code, said = said_by(
        "find", "torque-task-proportional", "--vary", "effects.ice.blockage_per_gas=1..2000 1/kg", *condition
    )
    assert code == 0, said
