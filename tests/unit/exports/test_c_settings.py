"""From settings in SI units to the numbers of a run: the C of a library gives the bits of Python's plan."""

import ctypes
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.engine.run import batches_of
from ppafo.exports.c_library import c_library, scenario_library
from ppafo.exports.c_library.files import c_identifier
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.numbers import TIMES, with_numbers
from ppafo.simulation.plan import plan_runs
from ppafo.simulation.scenario import Scenario
from tests.built_once import shared_library

RUNS = 1000
SPREAD = (0.7, 1.4)
"""Smallest and largest factor on a setting of a draw; one that is 0 stays 0, as another program would be needed."""
VARIED: dict[str, tuple[str, ...]] = {
    "step-response": (),
    "torque-task-anti-windup": (),
    "torque-task-moving-ankle": ("valve.sonic_conductance=9e-10 m^3/(s Pa)", "valve.critical_ratio=0.3"),
    "torque-task-proportional": (),
    "torque-task-slow-valve": ("controller.kind=feedback_linearisation",),
    "torque-task-solenoid": (
        "sensors.delay=2.3 ms",
        "sensors.pressure_noise=0.1 psi_d",
        "sensors.pressure_bandwidth=80 Hz",
        "reference.kind=sine",
        "reference.amplitude=2 N m",
    ),
}
"""Every shipped scenario, some with more settings."""
THERMAL = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
    "gas_model.wall_area_per_volume=100 1/m",
    "supply_line.plantarflexion.droop=3e6 Pa s/kg",
)
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")


def built(scenario: Scenario, folder: Path) -> ctypes.CDLL:
    """The library of a scenario, with the function from settings to numbers to be called from outside."""
    for name, content in c_library(scenario).items():
        (folder / name).write_bytes(content)
    source = folder / f"{c_identifier(scenario.name)}.c"
    return ctypes.CDLL(str(shared_library(source, "-O0", "-ffp-contract=off", "-DPPAFO_ENTRY=extern", "-w")))


class Handed(ctypes.Structure):
    _fields_ = (("values", ctypes.POINTER(ctypes.c_double)), ("extent", ctypes.c_int64 * 3))


def handed(values: Any) -> Handed:
    return Handed(values.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), (ctypes.c_int64 * 3)(values.size, 0, 0))


def drawn(scenario: Scenario) -> tuple[dict[str, Any], Scenario]:
    """Settings of many runs by path, and the scenario that stands for all of them."""
    draw = np.random.default_rng(15)
    settings = scenario_library(scenario).settings
    columns = {
        item.path: np.clip(item.value * draw.uniform(*SPREAD, RUNS), item.quantity.minimum, item.quantity.maximum)
        for item in settings
    }
    # Many steps to a sample, and whole numbers of them that are whole by rounding only.
    columns["run.step"][::2] *= draw.uniform(0.005, 0.1, RUNS // 2)
    columns["run.output_interval"][: RUNS // 2] = 3.0 * columns["run.step"][: RUNS // 2]
    columns["controller.period"][: RUNS // 2] = 2.0 * columns["run.step"][: RUNS // 2]
    varied = with_numbers(scenario, {path: column for path, column in columns.items() if path not in TIMES})
    return columns, replace(
        varied,
        duration=columns["run.duration"],
        time_step=columns["run.step"],
        output_interval=columns["run.output_interval"],
        control=replace(varied.control, period=columns["controller.period"]),
    )


@needs_gcc
@pytest.mark.parametrize(("name", "overrides"), [*VARIED.items(), ("step-response", THERMAL)])
def test_c_makes_the_numbers_of_a_run_that_python_makes(name: str, overrides: tuple[str, ...], tmp_path: Path) -> None:
    scenario = load_scenario(name, overrides)
    library = built(scenario, tmp_path)
    columns, varied = drawn(scenario)
    run, _ = plan_runs(varied)
    compared = 0
    for members, batch in batches_of(run, RUNS):
        clock = batch.clock
        delays = clock.signal_delay, clock.command_delay
        expected = clock.record_every, clock.step_count, clock.steps_per_sample, *delays, batch.program.is_adaptive
        for place, member in enumerate(members):
            settings = np.array([column[member] for column in columns.values()])
            parameters, counts = np.zeros(len(batch.parameters)), np.zeros(len(expected))
            states = np.zeros(len(batch.states))
            library.prepare(*map(handed, (settings, parameters, states, counts)))
            assert parameters.tobytes() == batch.parameters[:, place].tobytes()
            assert states.tobytes() == batch.states[:, place].tobytes()
            assert counts.tolist() == list(map(float, expected))
            compared += 1
    assert compared == RUNS
