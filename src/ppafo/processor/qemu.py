"""QEMU machine with a Cortex-M, controlled by the gdb remote protocol over standard input and output."""

import struct
from collections.abc import Callable, Iterable, Sequence
from typing import final

from ppafo.errors import SimulationError
from ppafo.processor.console import UNTOUCHED, Console, depth_of_stack
from ppafo.processor.images import Decision, Image, Target

DEEPEST = 1024
"""Size of the memory at the end of RAM that is searched for used stack [bytes]."""
_SHIFT = 7
"""Binary logarithm of the instruction time in QEMU [ns]."""
_NANOSECONDS = 2**_SHIFT
"""Instruction time of the machine [ns], more than two counter ticks, so that every instruction counts."""
_COUNTER_BITS = 24
"""Number of bits of SysTick, which counts processor clock ticks down."""
_PIECE = 1024
"""Bytes per packet of the protocol, close to its limit."""
_FORM_OF_OUTPUTS = struct.Struct("<hhII")
"""Memory layout of the outputs: command, validity of readings, counter before and after the sample."""
_THUMB, _LENGTH_OF_NOP = 1, 2
"""Address bit of a Thumb instruction, and length of a nop instruction [bytes]."""


@final
class Debugger:
    """Debugger connection to a QEMU machine, which runs only from ``go_on`` to the next breakpoint."""

    def __init__(self, machine: str, image: Image) -> None:
        time = f"shift={_SHIFT},sleep=off"
        command = ["qemu-system-arm", "-M", machine, "-kernel", image.file.name, "-icount", time, "-S"]
        quiet = ["-display", "none", "-monitor", "none", "-serial", "none", "-gdb", "stdio"]
        self._console = Console([*command, *quiet], image.file.parent)
        self.close: Callable[[], object] = self._console.close
        self.packet("QStartNoAckMode")
        # The answer to this packet is the last that is acknowledged.
        self._console.say(b"+")

    def reset(self) -> None:
        """Reset the machine; it remains stopped at its entry."""
        answer = self.packet(f"qRcmd,{b'system_reset'.hex()}")
        # Before its OK, QEMU may send what the command has to say.
        while answer != "OK":
            answer = self._answer()

    def stop_at(self, address: int) -> None:
        """Set a breakpoint at an address."""
        self._expect(self.packet(f"Z0,{address:x},2"), "OK")

    def go_on(self, address: int | None = None) -> None:
        """Run the machine, from ``address`` if given, to the next breakpoint."""
        # Bit 0 of an address says that the instruction is Thumb; a Cortex-M has no other.
        self._expect(self.packet("c" if address is None else f"c{address | _THUMB:x}")[:3], "T05")

    def read(self, address: int, size: int) -> bytes:
        """Read bytes from memory."""
        content = b""
        for start in range(address, address + size, _PIECE):
            count = min(_PIECE, address + size - start)
            answer = self.packet(f"m{start:x},{count:x}")
            if len(answer) != 2 * count:
                raise SimulationError(f"QEMU cannot read {count} bytes at 0x{start:x}: {answer}")
            content += bytes.fromhex(answer)
        return content

    def write(self, address: int, content: bytes) -> None:
        """Write bytes to memory."""
        for start in range(0, len(content), _PIECE):
            piece = content[start : start + _PIECE]
            self._expect(self.packet(f"M{address + start:x},{len(piece):x}:{piece.hex()}"), "OK")

    def packet(self, text: str) -> str:
        """Send a protocol packet and return the reply."""
        self._console.say(b"$%b#%02x" % (text.encode(), sum(text.encode()) % 256))
        return self._answer()

    def _answer(self) -> str:
        self._console.until(b"$")
        return self._console.until(b"#").decode()

    def _expect(self, answer: str, expected: str) -> None:
        if answer != expected:
            raise SimulationError(f"QEMU answers '{answer}' where '{expected}' was expected")


@final
class QemuSimulator:
    """QEMU simulator of a Cortex-M with the image of a controller.

    QEMU does not model cycles: instructions are counted, by a clock that advances by the same time for each.
    """

    def __init__(self, target: Target, image: Image) -> None:
        self._stop = image.symbols["simulated_stop"] & ~_THUMB
        self._readings, self._outputs = (image.symbols[f"simulated_{name}"] for name in ("readings", "outputs"))
        self._ticks = target.machine_clock * _NANOSECONDS * 1.0e-9
        self._bottom = target.ram.stop - DEEPEST
        self.debugger = Debugger(target.machine, image)
        self.close: Callable[[], object] = self.debugger.close
        self.debugger.write(self._bottom, bytes([UNTOUCHED]) * DEEPEST)
        self.debugger.stop_at(self._stop)
        self.debugger.go_on()

    def begin(self) -> None:
        """Reset the processor and run it until it waits for a sample."""
        self.debugger.reset()
        self.debugger.go_on()

    def samples(self, every: Sequence[Iterable[int]]) -> list[Decision]:
        """Return the decisions for consecutive samples."""
        decisions = []
        for readings in every:
            self.debugger.write(self._readings, b"".join(number.to_bytes(2, "little") for number in readings))
            # Behind the breakpoint, or the machine would stop at once.
            self.debugger.go_on(self._stop + _LENGTH_OF_NOP)
            outputs = self.debugger.read(self._outputs, _FORM_OF_OUTPUTS.size)
            command, is_sound, before, after = _FORM_OF_OUTPUTS.unpack(outputs)
            # The counter counts down, and begins anew at 2^24.
            ticks = (before - after) % 2**_COUNTER_BITS
            decisions.append(Decision(command, is_sound, round(ticks / self._ticks)))
        return decisions

    def stack(self) -> int:
        """Return the deepest use of the stack [bytes], from overwritten fill bytes in RAM."""
        return depth_of_stack(self.debugger.read(self._bottom, DEEPEST))
