"""The samples of a long comparison reach every condition of the walking law in C, but for three that cannot be.

The observer of the chambers is left out: it has conditions of valves, delays and lags that one walk does not have.
Those three limit the moving average of the stride time to its range, for the proof of the widths, which knows no
relation between two numbers: the average lies between both strides, so that neither limit is ever met.
"""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.control.fixed.walking_law import HALVES, LONGEST, LONGEST_STRIDE, TOP, next_stride
from ppafo.control.fixed.whole_numbers import FRACTION_BITS, HALF, LARGEST_FRACTION, nearest_fraction_of
from ppafo.exports.firmware.lock_step import PythonChip
from ppafo.exports.firmware.walking import SAMPLES, Gas, gait_readings, nominal_device, walk_chip, walk_firmware
from ppafo.walking.loading import load_walk
from tests.unit.control.test_fixed_walking import RULES
from tests.unit.exports.test_firmware_conditions import TOOLS, reached

OF_OBSERVER = ("chamber_observer", "valve_sign", "holds_pressure")
"""Functions whose conditions depend on the device that is believed in."""
WALK = ("solenoid", ("controller.arithmetic=fixed",))


@pytest.mark.skipif(TOOLS is None, reason="no clang with MC/DC on this machine: Debian has clang-19, llvm-19")
def test_samples_reach_every_condition_that_can_be_both_ways_and_each_decides_alone(tmp_path: Path) -> None:
    configuration = load_walk(*WALK)
    for name, content in walk_firmware(configuration).items():
        (tmp_path / name).write_bytes(content)
    chip = walk_chip(configuration)
    gas = Gas(nominal_device(configuration), configuration.control.period)
    given, python, lines = gait_readings(chip.converter, gas, SAMPLES, 1), PythonChip(chip), []
    readings, begins = next(given)
    for _ in range(SAMPLES):
        if begins:
            python.begin()
            lines.append("begin")
        lines.append(" ".join(map(str, readings)))
        readings, begins = given.send(python.sample(readings)[0])
    found = reached(("host.c", "controller.c"), "controller.c", tmp_path, "\n".join(lines))
    assert found.conditions > 230
    assert found.decisions > 50
    code = (tmp_path / "controller.c").read_text(encoding="utf-8").splitlines()
    never = ("next_stride: 0 >: never 1", *2 * (f"next_stride: {HALVES} <: never 1",))
    own = [line for line in found.missing if not any(name in line for name in OF_OBSERVER)]
    assert sorted(shown(code, line) for line in own) == sorted(never)


def shown(code: list[str], missing: str) -> str:
    """The function of a condition that is missing, how it begins, and what is missing of it."""
    function, place, what = missing.split(" ", 2)
    line, column = map(int, place.split(":"))
    begins = code[line - 1][column - 1 :].partition(" (")[0]
    return f"{function.rpartition('phases_')[2]}: {begins}: {what}"


@given(st.integers(-TOP, TOP), st.integers(0, LARGEST_FRACTION))
def test_the_nearest_fraction_is_that_of_exact_arithmetic(value: int, fraction: int) -> None:
    assert nearest_fraction_of(value, fraction) == value * fraction + HALF >> FRACTION_BITS


def test_the_nearest_fraction_of_a_number_lies_between_zero_and_the_number() -> None:
    # It grows or falls with the fraction, so that the smallest and the largest one tell of all.
    for value in range(-TOP, TOP + 1, 3):
        assert nearest_fraction_of(value, 0) == 0
        assert min(value, 0) <= nearest_fraction_of(value, LARGEST_FRACTION) <= max(value, 0)


def test_so_the_average_of_two_strides_is_never_beyond_its_range() -> None:
    # known + part of (halves - known): between both, whichever is the longer one.
    assert 2 * LONGEST_STRIDE == HALVES
    for known in range(0, HALVES + 1, 1489):
        for since in (0, 1, known // 4, known // 4 + 1, known - 1, known, LONGEST_STRIDE, LONGEST):
            halves = 2 * min(max(since, 0), LONGEST_STRIDE)
            for weight in (0, 9830, LARGEST_FRACTION):
                found = next_stride(RULES._replace(stride_weight=weight), known, max(since, 0))
                assert min(known, halves) <= found <= max(known, halves)
