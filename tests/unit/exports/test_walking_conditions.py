"""The samples of a long comparison reach every condition of the walking law in C, but for three that cannot be.

Those limit the moving average of the stride time to its range, for the proof of the widths, which knows no relation
between two numbers: the average lies between both strides, so that neither limit is ever met.
"""

from pathlib import Path

import numpy as np
import pytest

from ppafo.control.fixed.arithmetic import fraction_of
from ppafo.control.fixed.walking.phases import HALVES, LONGEST_STRIDE
from ppafo.exports.firmware.walking import walk_chip, walk_firmware
from ppafo.exports.firmware.walking.drawn import gait_readings
from ppafo.exports.firmware.walking.lock_step import PythonWalkChip
from ppafo.exports.firmware.walking.made import SAMPLES
from ppafo.walking.loading import load_walk
from tests.unit.exports.test_firmware_conditions import TOOLS, reached

WALK = ("solenoid", ("controller.arithmetic=fixed",))


@pytest.mark.skipif(TOOLS is None, reason="no clang with MC/DC on this machine: Debian has clang-19, llvm-19")
def test_samples_reach_every_condition_that_can_be_both_ways_and_each_decides_alone(tmp_path: Path) -> None:
    configuration = load_walk(*WALK)
    for name, content in walk_firmware(configuration).items():
        (tmp_path / name).write_bytes(content)
    chip = walk_chip(configuration)
    given, python, lines = gait_readings(chip.converter, SAMPLES, 1), PythonWalkChip(chip), []
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
    assert sorted(shown(code, line) for line in found.missing) == sorted(never)


def shown(code: list[str], missing: str) -> str:
    """The function of a condition that is missing, how it begins, and what is missing of it."""
    function, place, what = missing.split(" ", 2)
    line, column = map(int, place.split(":"))
    begins = code[line - 1][column - 1 :].partition(" (")[0]
    return f"{function.rpartition('phases_')[2]}: {begins}: {what}"


def test_a_part_of_a_number_lies_between_zero_and_the_number_whatever_the_fraction() -> None:
    # Each of its fifteen turns makes (t + v) >> 1 or t >> 1 of t: both grow with t, so that the ends of the range tell.
    values = np.arange(-HALVES, HALVES + 2)
    lowest, highest = np.minimum(values, 0), np.maximum(values - 1, 0)
    for ends in (lowest, highest):
        for after in (ends + values >> 1, ends >> 1):
            assert np.all((lowest <= after) & (after <= highest))
    drawn = np.random.default_rng(1).integers(0, 2**15, values.size)
    parts = [fraction_of(int(value), int(share)) for value, share in zip(values[::16], drawn[::16], strict=True)]
    assert np.all((lowest[::16] <= parts) & (parts <= highest[::16]))


def test_the_average_of_two_strides_is_never_beyond_its_range() -> None:
    known = np.append(np.arange(0, HALVES, 13), HALVES)[:, None]
    halves = 2 * np.append(np.arange(0, LONGEST_STRIDE, 13), LONGEST_STRIDE)[None, :]
    ahead = halves - known + 1
    assert ahead.min() >= -HALVES
    assert ahead.max() <= HALVES + 1
    assert (known + np.minimum(ahead, 0)).min() >= 0
    assert (known + np.maximum(ahead - 1, 0)).max() <= HALVES
