"""QEMU with a Cortex-M in it, driven by the remote protocol of gdb over its standard input and output."""

import struct
from collections.abc import Iterable, Sequence
from typing import NamedTuple, final

from ppafo.control.fixed.whole_numbers import Readings
from ppafo.errors import SimulationError
from ppafo.exports.firmware.simulator import UNTOUCHED, Console, depth_of_stack
from ppafo.exports.firmware.target import Decision, Image, Target

DEEPEST = 1024
"""How far below the end of RAM the stack is looked for [bytes]."""
DEEPEST_OF_PLANT = 16384
_SHIFT = 7
_NANOSECONDS = 2**_SHIFT
"""What an instruction takes of the machine's time [ns]: more than two ticks of the counter, so that none is missed."""
_COUNTER_BITS = 24
"""Those of SysTick, which counts the ticks of the processor's clock down."""
_PIECE = 1024
"""Bytes that are read or written at once; a packet has no room for many more."""
_OUTPUTS = struct.Struct("<hhII")
_THUMB, _LENGTH_OF_NOP = 1, 2


@final
class Debugger:
    """A machine of QEMU that stands still but when it is told to go on; addresses are those of its processor."""

    def __init__(self, machine: str, image: Image) -> None:
        time = f"shift={_SHIFT},sleep=off"
        command = ["qemu-system-arm", "-M", machine, "-kernel", image.file.name, "-icount", time, "-S"]
        quiet = ["-display", "none", "-monitor", "none", "-serial", "none", "-gdb", "stdio"]
        self._console = Console([*command, *quiet], image.file.parent)
        self.packet("QStartNoAckMode")
        self._console.say(b"+")

    def close(self) -> None:
        """End QEMU."""
        self._console.close()

    def reset(self) -> None:
        """Reset the machine; it stands still at its beginning."""
        answer = self.packet(f"qRcmd,{b'system_reset'.hex()}")
        while answer != "OK":
            answer = self._answer()

    def stop_at(self, address: int) -> None:
        """Let the machine stop before an instruction, whenever it comes there."""
        self._expect(self.packet(f"Z0,{address:x},2"), "OK")

    def go_on(self, address: int | None = None) -> None:
        """Let the machine run, from an address where one is given, until it stops."""
        self._expect(self.packet("c" if address is None else f"c{address | _THUMB:x}")[:3], "T05")

    def read(self, address: int, size: int) -> bytes:
        """What is in memory."""
        return b"".join(
            self._read(at, min(_PIECE, address + size - at)) for at in range(address, address + size, _PIECE)
        )

    def _read(self, address: int, size: int) -> bytes:
        answer = self.packet(f"m{address:x},{size:x}")
        if len(answer) != 2 * size:
            raise SimulationError(f"QEMU cannot read {size} bytes at 0x{address:x}: {answer}")
        return bytes.fromhex(answer)

    def write(self, address: int, content: bytes) -> None:
        """Put something into memory."""
        for at in range(0, len(content), _PIECE):
            piece = content[at : at + _PIECE]
            self._expect(self.packet(f"M{address + at:x},{len(piece):x}:{piece.hex()}"), "OK")

    def packet(self, text: str) -> str:
        """The answer to a packet of the protocol."""
        self._console.say(b"$%b#%02x" % (text.encode(), sum(text.encode()) % 256))
        return self._answer()

    def _answer(self) -> str:
        self._console.until(b"$")
        return self._console.until(b"#").decode()

    def _expect(self, answer: str, wanted: str) -> None:
        if answer != wanted:
            raise SimulationError(f"QEMU answers '{answer}' where '{wanted}' was expected")


@final
class QemuSimulator:
    """QEMU with the image of a controller in it.

    It has no model of cycles: what is counted are instructions, by a clock that goes on by the same time with each.
    """

    def __init__(self, target: Target, image: Image) -> None:
        self._stop = image.symbols["simulated_stop"] & ~_THUMB
        self._readings, self._outputs = (image.symbols[f"simulated_{name}"] for name in ("readings", "outputs"))
        self._ticks = target.machine.clock * _NANOSECONDS * 1.0e-9
        self._bottom = target.ram.start + target.ram.size - DEEPEST
        self.debugger = Debugger(target.machine.name, image)
        self.debugger.write(self._bottom, bytes([UNTOUCHED]) * DEEPEST)
        self.debugger.stop_at(self._stop)
        self.debugger.go_on()

    def close(self) -> None:
        """End the simulator."""
        self.debugger.close()

    def begin(self) -> None:
        """Reset the processor, and let it come to where it waits for a sample."""
        self.debugger.reset()
        self.debugger.go_on()

    def samples(self, every: Sequence[Iterable[int]]) -> list[Decision]:
        """What it decides for some samples, one after the other."""
        return [self.sample(readings) for readings in every]

    def sample(self, readings: Iterable[int]) -> Decision:
        """What the chip decides for the readings of one sample."""
        self.debugger.write(self._readings, b"".join(number.to_bytes(2, "little") for number in readings))
        self.debugger.go_on(self._stop + _LENGTH_OF_NOP)
        command, is_sound, begun, ended = _OUTPUTS.unpack(self.debugger.read(self._outputs, _OUTPUTS.size))
        ticks = (begun - ended) % 2**_COUNTER_BITS
        return Decision(command, is_sound, round(ticks / self._ticks))

    def stack(self) -> int:
        """How deep the stack has been [bytes]: what it has written of the RAM that was filled before."""
        return depth_of_stack(self.debugger.read(self._bottom, DEEPEST))


class PlantSample(NamedTuple):
    """What the plant shows at a sample: readings, 1 while it is well, values; instructions since the last sample."""

    readings: Readings
    is_well: int
    values: tuple[float, ...]
    work: int


@final
class QemuPlant:
    """QEMU with the image of a plant in it, which waits for a command."""

    def __init__(self, target: Target, image: Image, value_count: int) -> None:
        self._stop = image.symbols["simulated_stop"] & ~_THUMB
        self._command, self._plant = image.symbols["simulated_command"], image.symbols["simulated_plant"]
        self._form = struct.Struct(f"<4h{value_count}dII")
        self._ticks = target.machine.clock * _NANOSECONDS * 1.0e-9
        self._bottom = target.ram.start + target.ram.size - DEEPEST_OF_PLANT
        self._debugger = Debugger(target.machine.name, image)
        self._debugger.write(self._bottom, bytes([UNTOUCHED]) * DEEPEST_OF_PLANT)
        self._debugger.stop_at(self._stop)
        self._debugger.go_on()

    def close(self) -> None:
        """End the simulator."""
        self._debugger.close()

    def shown(self) -> PlantSample:
        """The sample that it shows."""
        reference, first, second, is_well, *values, begun, ended = self._form.unpack(
            self._debugger.read(self._plant, self._form.size)
        )
        work = round((begun - ended) % 2**32 / self._ticks)
        seen = Readings(reference, first, second)
        return PlantSample(readings=seen, is_well=is_well, values=tuple(values), work=work)

    def go_on(self, command: int) -> None:
        """Hand it the command for the sample that it shows; it then shows the next one."""
        self._debugger.write(self._command, command.to_bytes(2, "little", signed=True))
        self._debugger.go_on(self._stop + _LENGTH_OF_NOP)

    def stack(self) -> int:
        """How deep the stack has been [bytes]."""
        return depth_of_stack(self._debugger.read(self._bottom, DEEPEST_OF_PLANT))
