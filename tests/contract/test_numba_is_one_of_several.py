"""Numba is one of several compilers: whatever is compiled runs without it."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.compilers_here import compilers_here

ROOT = Path(__file__).parents[2]
MAY_IMPORT = {"engine/numba_compiler.py"}

USES = """
import sys

import gymnasium, ppafo.gym
env = gymnasium.make_vec("ppafo/TorqueTask-v0", num_envs=3)
env.reset(seed=1)
for _ in range(5):
    env.step(env.action_space.sample())
print("environments", "numba" in sys.modules)

from tests.reference.reference_solver import solve_reference
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
solve_reference(plan_run(load_scenario("torque-task-proportional", ["run.duration=20 ms"])))
print("reference solution", "numba" in sys.modules)

from scripts.interval_coverage import one_of
one_of("white", 5, 0)
print("fit", "numba" in sys.modules)
"""


def test_no_other_module_imports_numba() -> None:
    """What a generated text begins with is Numba's alone: no other compiler runs it."""
    folder = ROOT / "src/ppafo"
    statement = re.compile(r"^\s*(from|import) (numba|llvmlite)\b", re.MULTILINE)
    texts = {
        path: re.sub(r"'''.*?'''", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        for path in folder.rglob("*.py")
    }
    found = {path.relative_to(folder).as_posix() for path, text in texts.items() if statement.search(text)}
    assert found == MAY_IMPORT


@pytest.mark.skipif(compilers_here().keys() == {"numba"}, reason="no compiler of C on this machine")
def test_by_a_compiler_of_c_nothing_loads_numba(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("gymnasium")
    pytest.importorskip("sksundae")
    monkeypatch.setenv("PPAFO_BACKEND", "c")
    done = subprocess.run([sys.executable, "-c", USES], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.stdout.splitlines() == ["environments False", "reference solution False", "fit False"], done.stderr
