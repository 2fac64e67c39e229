"""Integer controllers as firmware: proved, built without a warning, and the same as in Python on a simulated chip."""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from ppafo.control.fixed.catalog import FIXED_LAWS
from ppafo.control.fixed.kind import FixedLaw
from ppafo.errors import ProgramError, ScenarioError
from ppafo.exports.firmware import chip_controller, firmware
from ppafo.exports.firmware.controller import proof
from ppafo.exports.firmware.lock_step import PythonChip, compare_drawn, drawn_readings, run_on_chip
from ppafo.exports.firmware.simulator import FLASH, RAM, built, missing_tools, sizes
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario
from ppafo.translation.widths import Interval

FIXED = "controller.arithmetic=fixed"
SCENARIOS = {
    "pid": ("torque-task-proportional",),
    "pid with all": ("torque-task-anti-windup", "controller.converter_bits=14", "controller.converter_range=1.2 MPa_a"),
    "on_off": ("torque-task-solenoid",),
    "on_off_dead_zone": ("torque-task-proportional", "controller.kind=on_off_dead_zone"),
}
on_chip = pytest.mark.skipif(bool(missing_tools()), reason=f"not on this machine: {', '.join(missing_tools())}")
with_compiler = pytest.mark.skipif(
    shutil.which("make") is None or shutil.which("cc") is None, reason="no make or no cc on this machine"
)


def scenario_of(law: str, *overrides: str) -> Scenario:
    """A scenario with an integer controller."""
    name, *own = SCENARIOS[law]
    kinds = [item for item in own if "kind" in item]
    return load_scenario(name, (*kinds, FIXED, *(item for item in own if item not in kinds), *overrides))


@pytest.mark.parametrize("law", FIXED_LAWS.values(), ids=list(FIXED_LAWS))
def test_no_number_of_a_law_can_overflow_and_no_state_leaves_its_range(law: FixedLaw) -> None:
    command, after = proof(law).returned
    assert command == Interval(-1000, 1000)
    assert after


@pytest.mark.parametrize(("name", "low", "high"), [("integral", -(2**30), 2**30), ("slope", -(2**31), 2**31 - 1)])
def test_a_state_with_a_wider_range_is_not_proved(name: str, low: int, high: int) -> None:
    law = FIXED_LAWS["pid"]
    with pytest.raises(ProgramError, match="beyond 32 bits"):
        proof(replace(law, state_ranges={**law.state_ranges, name: (low, high)}))


def test_a_state_that_may_leave_a_narrower_range_is_not_proved() -> None:
    law = FIXED_LAWS["pid"]
    with pytest.raises(ProgramError, match="may leave their ranges"):
        proof(replace(law, state_ranges={**law.state_ranges, "error": (-1000, 1000)}))


def test_a_converter_of_sixteen_bits_is_not_proved() -> None:
    law = FIXED_LAWS["pid"]
    wider = [replace(item, maximum=item.maximum * 2.0 + 1.0) for item in law.number_quantities[:2]]
    with pytest.raises(ProgramError):
        proof(law, (*wider, *(replace(item, maximum=65535.0) for item in law.number_quantities[2:])))


def test_drawn_readings_reach_edges_saturation_and_faults() -> None:
    drawn = list(drawn_readings(4095, 20_000, 1))
    for place in range(3):
        seen = {readings[place] for readings in drawn}
        assert {0, 1, 4094, 4095} <= seen
    chip = PythonChip(chip_controller(scenario_of("pid with all")))
    found = [chip.sample(readings)[0] for readings in drawn_readings(16383, 200, 3)]
    assert {-1000, 1000} <= set(found)


@with_compiler
@pytest.mark.parametrize("law", SCENARIOS)
def test_the_c_of_a_law_decides_as_python_does_under_the_sanitizer(tmp_path: Path, law: str) -> None:
    scenario = scenario_of(law)
    built(firmware(scenario), tmp_path, ("host", "checked"))
    chip = PythonChip(chip_controller(scenario))
    lines, wanted = [], []
    for number, readings in enumerate(drawn_readings(int(chip_controller(scenario).converter.top), 20_000, 5)):
        if number % 200 == 0:
            chip.begin()
            lines.append("begin")
        lines.append(" ".join(map(str, readings)))
        wanted.append("{} {}".format(*chip.sample(readings)))
    for program in ("host", "checked"):
        done = subprocess.run(
            [tmp_path / program], input="\n".join(lines), capture_output=True, text=True, check=True, timeout=120
        )
        assert done.stdout.splitlines() == wanted
        assert done.stderr == ""


@on_chip
@pytest.mark.parametrize("law", SCENARIOS)
def test_the_chip_decides_as_python_does_within_its_memory_and_time(law: str) -> None:
    scenario = scenario_of(law)
    found = compare_drawn(scenario, 600, seed=2)
    assert found.first_difference == ""
    assert found.differences == 0
    assert found.cost.sizes.flash <= FLASH
    assert found.cost.stack > 0
    # The timer's interrupt takes two words more.
    assert found.cost.sizes.data + found.cost.stack + 4 <= RAM
    assert 0 < found.cost.mean_cycles <= found.cost.worst_cycles <= 0.5 * 16.0e6 * scenario.control.period


@on_chip
@pytest.mark.parametrize("law", ["pid", "on_off"])
def test_the_torque_task_with_the_chip_in_charge_has_the_bits_of_the_lanes(law: str) -> None:
    found = run_on_chip(scenario_of(law, "run.duration=0.3 s"))
    assert found.samples == (300 if law == "pid" else 6)
    assert found.differences == 0
    assert found.same_bits
    assert len(set(found.chip.recording["command"])) > 1 or law == "on_off"


@on_chip
def test_a_chip_with_other_numbers_is_found_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = scenario_of("pid")
    wrong = firmware(scenario_of("pid", "controller.proportional_gain=0.0951 1/(N m)"))
    monkeypatch.setattr("ppafo.exports.firmware.lock_step.firmware", lambda _: wrong)
    found = compare_drawn(scenario, 400)
    assert found.differences > 0
    assert "on the chip" in found.first_difference
    built(wrong, tmp_path)
    assert sizes(tmp_path / "firmware.elf").flash > sizes(tmp_path / "simulated.elf").flash


def test_numbers_stand_in_a_header_with_range_and_origin() -> None:
    header = firmware(scenario_of("pid"))["parameters.h"].decode()
    assert "proportional_gain 0.095 1/(N m) (controller.proportional_gain)" in header
    assert "#define CONTROLLER_TICKS 8u" in header
    assert '#error "CONTROLLER_PROPORTIONAL is beyond its range"' in header


@pytest.mark.parametrize(
    ("name", "overrides", "said"),
    [
        ("torque-task-proportional", (), "the controller computes with floats; set controller.arithmetic=fixed"),
        ("step-response", (), "'constant' has no form on whole numbers; those that have one: pid, on_off"),
        ("torque-task-solenoid", (FIXED, "controller.rate=900 Hz"), r"a multiple of 0.125 ms, up to 2.05 s"),
    ],
)
def test_what_has_no_firmware_is_refused(name: str, overrides: tuple[str, ...], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        firmware(load_scenario(name, overrides))


def test_an_unknown_target_is_refused() -> None:
    with pytest.raises(ScenarioError, match="no firmware for 'avr'; targets: msp430f2013"):
        firmware(scenario_of("pid"), "avr")
