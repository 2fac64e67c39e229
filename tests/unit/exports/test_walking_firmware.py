"""The walking controller as firmware: proved, built without a warning, as in Python on a simulated chip."""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from ppafo.control.fixed.walking_numbers import EVENT_ON_OFF, SIGN_BITS
from ppafo.control.walking.signs import SIGNS
from ppafo.errors import ProgramError, ScenarioError
from ppafo.exports.firmware import proof
from ppafo.exports.firmware.catalog import MSP430G2553
from ppafo.exports.firmware.lock_step import PythonChip
from ppafo.exports.firmware.simulators import built, missing_tools, sizes
from ppafo.exports.firmware.walking import (
    DrawnGait,
    Gas,
    compare_drawn_walk,
    nominal_device,
    walk_chip,
    walk_firmware,
    walk_on_chip,
)
from ppafo.simulation.scenario import Scenario
from ppafo.translation.widths import Interval
from ppafo.walking.loading import load_walk

MISSING = missing_tools(MSP430G2553)
FIXED = "controller.arithmetic=fixed"
on_chip = pytest.mark.skipif(bool(MISSING), reason=f"not on this machine: {', '.join(MISSING)}")
with_compiler = pytest.mark.skipif(
    shutil.which("make") is None or shutil.which("cc") is None, reason="no make or no cc on this machine"
)


def fixed_walk(*overrides: str) -> Scenario:
    return load_walk("solenoid", (FIXED, *overrides))


def drawn_of(configuration: Scenario, seed: int) -> DrawnGait:
    gas = Gas(nominal_device(configuration), configuration.control.period)
    return DrawnGait(walk_chip(configuration).converter, gas, seed)


def test_no_number_of_the_law_can_overflow_and_no_state_leaves_its_range() -> None:
    found = proof(EVENT_ON_OFF)
    assert found.returned[0] == Interval(-1000, 1000)
    # It takes sixteen bits everywhere, so that no product or shift needs a library.
    assert "int32" not in repr(found.module)


@pytest.mark.parametrize(
    ("name", "high"), [("since_strike", 16000), ("stride", 16000), ("toe_strides", 999), ("sign", 20), ("mark", 16000)]
)
def test_a_state_that_may_leave_a_narrower_range_is_not_proved(name: str, high: int) -> None:
    with pytest.raises(ProgramError, match="may leave their ranges"):
        proof(replace(EVENT_ON_OFF, state_ranges={**EVENT_ON_OFF.state_ranges, name: (0, high)}))


def test_drawn_gaits_reach_every_phase_level_and_command_and_most_signs() -> None:
    chip = walk_chip(fixed_walk())
    seen: dict[str, set[int]] = {"phase": set(), "level": set(), "command": set(), "sign": set()}
    for seed in (3, 4, 5, 6):
        drawn, python, command = drawn_of(fixed_walk(), seed), PythonChip(chip), 0
        for _ in range(30_000):
            readings, begins = drawn.next(command)
            if begins:
                python.begin()
            command, told = python.sample(readings)
            seen["command"].add(command)
            seen["phase"].add(python.state.phase.phase)
            seen["level"].add(told >> SIGN_BITS)
            seen["sign"].add(told & 2**SIGN_BITS - 1)
    assert seen["phase"] == seen["level"] == {0, 1, 2, 3}
    assert seen["command"] == {-1000, 0, 1000}
    assert len(seen["sign"] & {int(sign) for sign in SIGNS}) >= 15


@with_compiler
def test_the_c_of_the_law_decides_as_python_does_under_the_sanitizer(tmp_path: Path) -> None:
    configuration = fixed_walk()
    built(walk_firmware(configuration), tmp_path, ("host", "checked"))
    chip = walk_chip(configuration)
    drawn, python, command, lines, wanted = drawn_of(configuration, 5), PythonChip(chip), 0, [], []
    for _ in range(15_000):
        readings, begins = drawn.next(command)
        if begins:
            python.begin()
            lines.append("begin")
        command, told = python.sample(readings)
        lines.append(" ".join(map(str, readings)))
        wanted.append(f"{command} {told >> SIGN_BITS} {told & 2**SIGN_BITS - 1}")
    for program in ("host", "checked"):
        done = subprocess.run(
            [tmp_path / program], input="\n".join(lines), capture_output=True, text=True, check=True, timeout=120
        )
        assert done.stdout.splitlines() == wanted
        assert done.stderr == ""


@on_chip
def test_the_chip_decides_as_python_does_within_its_memory_and_time() -> None:
    configuration = fixed_walk()
    found = compare_drawn_walk(configuration, 2500, seed=2)
    assert found.first_difference == ""
    assert found.differences == 0
    assert found.cost.sizes.flash <= MSP430G2553.flash.size
    assert found.cost.stack > 0
    assert found.cost.sizes.data + found.cost.stack + MSP430G2553.interrupt_stack <= MSP430G2553.ram.size
    assert 0 < found.cost.mean <= found.cost.worst <= 0.5 * MSP430G2553.clock * configuration.control.period


@on_chip
def test_a_walk_with_a_failing_heel_sensor_and_the_chip_in_charge_has_the_bits_of_the_lanes() -> None:
    configuration = fixed_walk("faults.heel.kind=stuck", "faults.heel.time=2 s")
    found = walk_on_chip(configuration, 0.09)
    assert found.samples == 5400
    assert found.differences == 0
    assert found.same_bits
    assert found.level > 0
    assert found.gas > 0.0


@on_chip
@pytest.mark.long
@pytest.mark.thorough
def test_a_chip_in_charge_of_a_wearer_who_reacts_has_the_bits_of_the_lanes() -> None:
    found = walk_on_chip(load_walk("reacting", (FIXED,)), 0.09)
    assert (found.samples, found.differences, found.same_bits, found.level) == (5400, 0, True, 0)


@on_chip
def test_a_chip_with_other_numbers_is_found_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = walk_firmware(fixed_walk("controller.push_off_end=0.5"))
    monkeypatch.setattr("ppafo.exports.firmware.walking.walk_firmware", lambda _: wrong)
    found = compare_drawn_walk(fixed_walk(), 3000)
    assert found.differences > 0
    assert "on the chip" in found.first_difference
    built(wrong, tmp_path)
    assert sizes(tmp_path / "firmware.elf", MSP430G2553).flash > sizes(tmp_path / "simulated.elf", MSP430G2553).flash


def test_numbers_stand_in_a_header_with_range_and_origin_and_signs_in_the_page() -> None:
    files = walk_firmware(fixed_walk())
    header = files["parameters.h"].decode()
    assert "load_threshold 60 N (controller.load_threshold)" in header
    assert "#define CONTROLLER_TICKS 8u" in header
    assert '#error "CONTROLLER_LOAD is beyond its range"' in header
    assert all(sign.summary in files["README.md"].decode() for sign in SIGNS.values())


@pytest.mark.parametrize(
    ("name", "overrides", "said"),
    [
        ("solenoid", (), "the controller computes with floats; set controller.arithmetic=fixed"),
        ("proportional", (), "'event_proportional' has no form on whole numbers; those that have one: event_on_off"),
        ("solenoid", (FIXED, "controller.converter_bits=12"), "the converter of the chip has 10"),
        ("solenoid", (FIXED, "controller.rate=900 Hz"), r"a multiple of 0.125 ms, up to 2.05 s"),
    ],
)
def test_what_has_no_firmware_is_refused(name: str, overrides: tuple[str, ...], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        walk_firmware(load_walk(name, overrides))


def test_another_chip_is_refused() -> None:
    with pytest.raises(ScenarioError, match="a walk's firmware is for msp430g2553, not 'msp430f2013'"):
        walk_firmware(fixed_walk(), "msp430f2013")
