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
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, rebuilt
from ppafo.engine.run import batch_of
from ppafo.engine.step import (
    energy_balance,
    foot,
    isothermal,
    lines,
    meters,
    not_ideal,
    phases,
    sample,
    stated,
    walk,
)
from ppafo.engine.step.lane import Lane, Now
from ppafo.model.plant import chamber_pressures
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.translation.c99 import program_source

MODULES: list[ModuleType] = [
    *(energy_balance, foot, isothermal, lines, meters, not_ideal, phases, sample, stated, walk)
]
FIRST = Now(
    step=0,
    sample=0,
    goal=1.0,
    early_command=0,
    late_command=0,
    late_signal=0,
    next_signal=0,
)


def lane_of(name: str, *overrides: str) -> tuple[Program, Lane]:
    """The parts of a scenario, and its numbers at the start."""
    batch = batch_of(plan_run(load_scenario(name, list(overrides))))
    lane, program = Lane(), batch.program
    for groups, table in ((program.state_rows(), batch.states), (program.parameter_rows(), batch.parameters)):
        begin = 0
        for group, row in groups.items():
            count = len(leaf_paths(row, group))
            lane[group] = rebuilt(row, table[begin : begin + count, 0].tolist()) if count else ()
            begin += count
    return program, lane


def do_step(parts: Program, lane: Lane) -> None:
    """The phases of a whole step of a locked vane."""
    phases.hold_chambers(parts, lane)
    phases.open_valve(parts, lane, FIRST)
    phases.begin_gas(parts, lane, FIRST)
    phases.pass_gas(parts, lane, FIRST)
    phases.finish(parts, lane, FIRST)


def test_a_step_with_a_closed_valve_changes_nothing() -> None:
    parts, lane = lane_of("torque-task-proportional", "initial.pressure_1=20 psi_g", "initial.pressure_2=20 psi_g")
    before = lane.state
    do_step(parts, lane)
    assert lane.state.supplied_mass == 0.0
    assert lane.state.angle == before.angle
    assert lane.result.failure_time == 1.0e300


def test_gas_of_a_step_that_opens_the_valve_is_what_the_supplies_gave() -> None:
    parts, lane = lane_of("torque-task-proportional")
    before = lane.state
    lane.result = lane.result._replace(command=1.0)
    do_step(parts, lane)
    gained = lane.state.mass_1 + lane.state.mass_2 - before.mass_1 - before.mass_2
    assert lane.state.supplied_mass > 0.0
    assert gained == pytest.approx(lane.state.supplied_mass - lane.state.vented_mass, rel=1e-9)
    first, _ = chamber_pressures(lane.plant, lane.state.angle, lane.state.mass_1, lane.state.mass_2)
    assert first > chamber_pressures(lane.plant, before.angle, before.mass_1, before.mass_2)[0]


def test_a_state_that_no_device_can_have_is_the_end_of_a_run() -> None:
    parts, lane = lane_of("torque-task-proportional")
    lane.state = lane.state._replace(mass_1=-1.0)
    do_step(parts, lane)
    assert lane.result.failure_time == pytest.approx(lane.timing.step)


def test_an_ensemble_with_samples_inside_steps_and_no_meters_ends() -> None:
    scenario = load_scenario("torque-task-proportional", ["run.output_interval=1.5 ms", "run.duration=0.3 s"])
    found = run_ensemble(scenario, {"supply.pressure": [4.0e5, 5.0e5]}, ["gas_supplied"])
    values = found.metrics["gas_supplied"]
    assert values[1] > values[0] > 0.0


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
