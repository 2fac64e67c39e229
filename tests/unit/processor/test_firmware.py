"""Integer controllers as firmware: proved, built without a warning, and the same as in Python on a simulated fixed."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from ppafo.errors import ProgramError, ScenarioError, SimulationError
from ppafo.processor.controller import FIXED_LAWS, PythonProcessor, fixed_point_controller
from ppafo.processor.firmware import declared, firmware, proof
from ppafo.processor.simulated import (
    CLOCK,
    FLASH,
    INTERRUPT_STACK,
    RAM,
    build_firmware,
    drawn_readings,
    missing_tools,
    try_firmware,
)
from ppafo.processor.torque_laws.law import FixedLaw
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario
from ppafo.storage.files import add_files
from ppafo.translation.compiling import asked
from ppafo.translation.widths import IntegerRange

SCENARIOS = {
    "pid": ("torque-task-proportional", "controller.kind=pid_fixed_point"),
    "pid with all": (
        "torque-task-anti-windup",
        "controller.kind=pid_fixed_point",
        "controller.converter_bits=14",
        "controller.converter_range=1.2 MPa_a",
    ),
    "pid beyond a dead band": (
        "torque-task-proportional",
        "controller.kind=pid_fixed_point",
        "valve.dead_band=0.3",
    ),
    "on_off": ("torque-task-solenoid", "controller.kind=on_off_fixed_point"),
    "on_off_dead_zone": ("torque-task-proportional", "controller.kind=on_off_dead_zone_fixed_point"),
}
if_simulated = pytest.mark.skipif(bool(missing_tools()), reason=f"not on this machine: {', '.join(missing_tools())}")
with_compiler = pytest.mark.skipif(
    shutil.which("make") is None or shutil.which("cc") is None, reason="no make or no cc on this machine"
)


def scenario_of(law: str, *overrides: str) -> Scenario:
    """A scenario with an integer controller."""
    name, *own = SCENARIOS[law]
    return load_scenario(name, (*own, *overrides))


@pytest.mark.parametrize("law", FIXED_LAWS.values(), ids=list(FIXED_LAWS))
def test_no_number_of_a_law_can_overflow_and_no_state_leaves_its_range(law: FixedLaw) -> None:
    command, after = proof(law).returned
    assert command == IntegerRange(-1000, 1000)
    assert after


@pytest.mark.parametrize(
    ("name", "low", "high", "said"),
    [
        ("integral", -(2**30), 2**30, "does not fit in 32 bits"),
        ("slope", -(2**31), 2**31 - 1, "does not fit in 32 bits"),
        ("error", -1000, 1000, "can leave its allowed range"),
    ],
)
def test_a_state_with_another_range_is_not_proved(
    name: str, low: int, high: int, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    law = FIXED_LAWS["pid_fixed_point"]
    state: Any = declared(type(law.begins))
    others = {law.numbers: declared(law.numbers), type(law.begins): state._replace(**{name: IntegerRange(low, high)})}
    monkeypatch.setattr("ppafo.processor.firmware.declared", others.__getitem__)
    with pytest.raises(ProgramError, match=said):
        proof(law)


def test_drawn_readings_reach_edges_saturation_and_faults() -> None:
    drawn = list(drawn_readings(4095, 20_000, 1))
    for place in range(3):
        seen = {readings[place] for readings in drawn}
        assert {0, 1, 4094, 4095} <= seen
    fixed = PythonProcessor(fixed_point_controller(scenario_of("pid with all")))
    found = [fixed.sample(readings)[0] for readings in drawn_readings(16383, 200, 3)]
    assert {-1000, 1000} <= set(found)


@with_compiler
@pytest.mark.parametrize("law", SCENARIOS)
def test_the_c_of_a_law_decides_as_python_does_under_the_sanitizer(tmp_path: Path, law: str) -> None:
    scenario = scenario_of(law)
    add_files(tmp_path, firmware(scenario))
    for goal in ("host", "checked"):
        build_firmware(tmp_path, goal)
    fixed = PythonProcessor(fixed_point_controller(scenario))
    lines, wanted = [], []
    for number, readings in enumerate(drawn_readings(fixed.numbers.limits.top, 20_000, 5)):
        if number % 200 == 0:
            fixed.begin()
            lines.append("begin")
        lines.append(" ".join(map(str, readings)))
        wanted.append("{} {}".format(*fixed.sample(readings)))
    for program in ("host", "checked"):
        done = subprocess.run(
            [tmp_path / program], input="\n".join(lines), capture_output=True, text=True, check=True, timeout=120
        )
        assert done.stdout.splitlines() == wanted
        assert done.stderr == ""


@if_simulated
@pytest.mark.parametrize("law", SCENARIOS)
def test_the_processor_decides_as_python_does_within_its_memory_and_time(law: str) -> None:
    scenario = scenario_of(law)
    found = try_firmware(scenario, 600, seed=2)
    assert (found.samples, found.differences, found.first_difference) == (600, 0, "")
    assert 0 < found.flash <= FLASH
    assert 10 < found.ram <= RAM - INTERRUPT_STACK
    assert 0 < found.mean_cycles <= found.worst_cycles <= 0.5 * CLOCK * scenario.controller.period


@if_simulated
def test_a_processor_with_other_numbers_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = firmware(scenario_of("pid", "controller.proportional_gain=0.0951 1/(N m)"))
    monkeypatch.setattr("ppafo.processor.simulated.firmware", lambda _: wrong)
    found = try_firmware(scenario_of("pid"), 400)
    assert found.differences > 0
    assert "on the processor" in found.first_difference


@if_simulated
def test_a_simulator_that_ends_early_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ppafo.processor.simulated.asked", lambda line, **given: asked([*line[:-1], "exit"], **given))
    monkeypatch.setattr("ppafo.processor.simulated.build_firmware", lambda _: None)
    with pytest.raises(SimulationError, match="answered 0 of 5 samples"):
        try_firmware(scenario_of("pid"), 5)


def test_numbers_stand_in_a_header_with_range_and_origin() -> None:
    header = firmware(scenario_of("pid"))["parameters.h"].decode()
    assert "proportional_gain 0.095 1/(N m) (controller.proportional_gain)" in header
    assert "#define CONTROLLER_TICKS 8u" in header
    assert '#error "CONTROLLER_PROPORTIONAL is beyond its range"' in header


@pytest.mark.parametrize(
    ("name", "overrides", "said"),
    [
        ("torque-task-proportional", ("effects.opening.command_01=0.1",), "inverts no table of openings"),
        ("step-response", (), "'constant' has no fixed-point form; available: pid, on_off"),
        (
            "torque-task-solenoid",
            ("controller.rate=900 Hz",),
            r"must be a multiple of 0.125 ms on the processor, at most 2.05 s",
        ),
    ],
)
def test_what_has_no_firmware_is_refused(name: str, overrides: tuple[str, ...], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        firmware(load_scenario(name, overrides))
