"""The layer of the micro:bit in QEMU, which has its timer and its pins: samples come on time, pins follow the command.

The converter is a stand-in, as QEMU has none; it has no watchdog either.
"""

from collections.abc import Iterator
from pathlib import Path

import pytest

from ppafo.processor.catalog import CORTEX_M0
from ppafo.processor.firmware import firmware, fixed_point_controller
from ppafo.processor.fixed_point import ConverterCounts
from ppafo.processor.images import make_firmware, missing_tools, read_image
from ppafo.processor.lock_step import PythonProcessor
from ppafo.processor.qemu import Debugger
from ppafo.storage.files import add_files
from tests.unit.exports.test_firmware import scenario_of

MISSING = missing_tools(CORTEX_M0)
pytestmark = pytest.mark.skipif(bool(MISSING), reason=f"not on this machine: {', '.join(MISSING)}")
STAND_IN = """\
#include "board.h"
void converter_begin(void);
volatile board_readings simulated_readings;
void converter_begin(void)
{
}
board_readings board_read(void)
{
    const board_readings seen = {
        simulated_readings.reference, simulated_readings.pressure_1, simulated_readings.pressure_2};
    return seen;
}
"""
OUT, TIMER_AT_1 = 0x50000504, 0x40008544
VALVE_A, VALVE_B, ENABLE = 1 << 23, 1 << 22, 1 << 20


class Board:
    """The program for the board in QEMU, from one look at the converter to the next."""

    def __init__(self, folder: Path, *overrides: str) -> None:
        files = firmware(scenario_of("pid", *overrides), CORTEX_M0.name)
        add_files(folder, {**files, "converter_nrf51822.c": STAND_IN.encode()})
        make_firmware(folder)
        (folder / "firmware.elf").replace(folder / "simulated.elf")
        image = read_image(folder, CORTEX_M0)
        self.symbols = {name: address & ~1 for name, address in image.symbols.items()}
        self.debugger = Debugger(CORTEX_M0.machine, image)
        for name in ("board_read", "board_tick"):
            self.debugger.stop_at(self.symbols[name])
        self.ticks_to_sample()

    def ticks_to_sample(self) -> int:
        """Go on to the next look at the converter: how often the interrupt came meanwhile."""
        for count in range(100):
            self.debugger.packet("s")
            if self.place() not in (self.symbols["board_read"], self.symbols["board_tick"]):
                self.debugger.go_on()
            if self.place() == self.symbols["board_read"]:
                return count
        raise AssertionError("no sample came")

    def place(self) -> int:
        return int.from_bytes(bytes.fromhex(self.debugger.packet("g")[120:128]), "little")

    def sample(self, readings: ConverterCounts) -> int:
        """The pins that are high once the readings of a sample have led to a command."""
        self.debugger.write(
            self.symbols["simulated_readings"], b"".join(number.to_bytes(2, "little") for number in readings)
        )
        self.ticks_to_sample()
        return int.from_bytes(self.debugger.read(OUT, 4), "little")

    def pulse(self) -> int:
        """Length of the pulse in ticks of the timer, 2,000 of which are one of 125 us."""
        return int.from_bytes(self.debugger.read(TIMER_AT_1, 4), "little")


@pytest.fixture
def board(tmp_path: Path) -> Iterator[Board]:
    made = Board(tmp_path)
    yield made
    made.debugger.close()


def test_pins_and_pulse_follow_the_command_until_a_reading_cannot_be_true(board: Board) -> None:
    fixed = PythonProcessor(fixed_point_controller(scenario_of("pid")))
    seen = set()
    for readings in (
        ConverterCounts(2060, 1500, 1500),
        ConverterCounts(3000, 1500, 1500),
        ConverterCounts(1000, 1500, 1500),
    ):
        command, is_sound = fixed.sample(readings)
        pins = board.sample(readings)
        assert is_sound == 1
        assert pins & (VALVE_A | VALVE_B | ENABLE) == ENABLE | (VALVE_A if command > 0 else VALVE_B)
        assert board.pulse() == 1000 + command
        seen.add(command > 0)
    assert seen == {True, False}
    assert board.sample(ConverterCounts(1000, 4095, 1500)) & (VALVE_A | VALVE_B | ENABLE) == 0
    assert board.sample(ConverterCounts(1000, 1500, 1500)) & (VALVE_A | VALVE_B | ENABLE) == 0
    assert board.pulse() == 1000


@pytest.mark.parametrize(("rate", "ticks"), [("1 kHz", 8), ("500 Hz", 16)])
def test_a_sample_comes_after_its_periods_of_the_timer(rate: str, ticks: int, tmp_path: Path) -> None:
    board = Board(tmp_path, f"controller.rate={rate}")
    # Time jumps to the next event wherever QEMU is stopped: the end of a pulse is served with the period after it.
    assert [board.ticks_to_sample() for _ in range(4)] == [ticks] * 4
    board.debugger.close()
