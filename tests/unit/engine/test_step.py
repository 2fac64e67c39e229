"""Phases of a step, called by hand; and what compiled loops over lanes ask of them."""

import ast
import inspect
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from shutil import which
from types import ModuleType
from typing import Any

import pytest

from ppafo.engine.compilers import FLAGS, Effort
from ppafo.engine.run import batch_of
from ppafo.engine.scheme.actuators import filled_state
from ppafo.engine.step import foot, gas, lines, meters, phases, sample, stated, walk
from ppafo.model.actuators.vane import MODEL as VANE
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from scripts.built_programs import program_source

MODULES: list[ModuleType] = [*(foot, gas, lines, meters, phases, sample, stated, walk)]


def functions() -> list[tuple[str, Callable[..., Any]]]:
    """Functions of the step."""
    return [
        (f"{module.__name__.rpartition('.')[2]}.{name}", item)
        for module in MODULES
        for name, item in vars(module).items()
        if inspect.isfunction(item) and item.__module__ == module.__name__
    ]


@pytest.mark.parametrize(("name", "function"), functions())
def test_no_phase_divides_whole_numbers(name: str, function: Callable[..., Any]) -> None:
    """Compilers leave a loop over lanes as it is where they meet one: five times slower."""
    tree = ast.parse(inspect.getsource(function))
    divisions = [node for node in ast.walk(tree) if isinstance(node, ast.FloorDiv | ast.Mod)]
    assert divisions == [], f"{name}: the loop over steps works it out, once for all lanes"


VECTORISED = re.compile(r"^program\.c:(\d+):\d+: optimized: loop vectorized", re.MULTILINE)


@pytest.mark.skipif(which("gcc") is None, reason="gcc says which loops it takes several lanes of at once")
@pytest.mark.parametrize(
    ("name", "overrides", "least"),
    [
        ("torque-task-proportional", (), 6),
        ("torque-task-slow-valve", ("sensors.delay=2.3 ms",), 9),
    ],
)
def test_loops_over_lanes_are_vectorised(name: str, overrides: tuple[str, ...], least: int, tmp_path: Path) -> None:
    text = program_source(batch_of(plan_run(load_scenario(name, list(overrides)))).program)
    (tmp_path / "program.c").write_text(text, encoding="utf-8")
    command = [
        "gcc",
        Effort.FULL,
        *FLAGS,
        "-march=x86-64-v3",
        "-fopenmp-simd",
        "-fopt-info-vec-optimized",
        "-c",
        "program.c",
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert len(set(VECTORISED.findall(done.stderr))) >= least


def test_an_evacuated_chamber_begins_without_gas() -> None:
    plant = plant_parameters(load_scenario("step-response").device)
    filled = filled_state(VANE, plant, 1.0, 0.0, 0.0, 2.0e5)
    assert filled.mass_1 == 0.0
    assert filled.mass_2 > 0.0
