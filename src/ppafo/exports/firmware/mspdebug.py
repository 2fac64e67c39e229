"""The simulator of mspdebug, driven by its console."""

import re
from collections.abc import Iterable, Sequence
from typing import final

from ppafo.exports.firmware.simulator import UNTOUCHED, Console, depth_of_stack
from ppafo.exports.firmware.target import Decision, Image, Target

_CYCLES = re.compile(rb"MCLK:\s+(\d+)")
_ASKED = "asked.txt"
_OUTPUTS = "simio info counter\nmd simulated_outputs 4"


@final
class MspdebugSimulator:
    """mspdebug's simulator of an MSP430 with an image in it."""

    def __init__(self, target: Target, image: Image) -> None:
        self._cycles = 0
        self._folder = image.file.parent
        self._console = Console(["mspdebug", "-n", "-q", "sim"], self._folder)
        self._start = target.ram.start + image.sizes.data
        self._free = target.ram.size - image.sizes.data
        self._say(f"prog {image.file.name}\nfill {self._start} {self._free} {UNTOUCHED:x}")
        self._say(f"simio add tracer counter\nsetbreak board_wait\nrun\n{_OUTPUTS}")
        self._answer()

    def close(self) -> None:
        """End the simulator."""
        self._console.close()

    def begin(self) -> None:
        """Reset the processor, and let it come to where it waits for a sample."""
        self._say(f"reset\nrun\n{_OUTPUTS}")
        self._answer()

    def sample(self, readings: Iterable[int]) -> Decision:
        """What the chip decides for the readings of one sample."""
        return self.samples((readings,))[0]

    def samples(self, every: Sequence[Iterable[int]]) -> list[Decision]:
        """What it decides for some samples in turn, at most 50: asked at once, so that neither waits for the other."""
        asked = []
        for readings in every:
            given = " ".join(f"0x{byte:02x}" for number in readings for byte in number.to_bytes(2, "little"))
            asked.append(f"mw simulated_readings {given}\nrun\n{_OUTPUTS}\n")
        # mspdebug asks the system for every byte of its console, and for a file at once.
        (self._folder / _ASKED).write_text("".join(asked), encoding="ascii")
        self._say(f"read {_ASKED}")
        return [self._decision() for _ in every]

    def _decision(self) -> Decision:
        before = self._cycles
        words = self._answer()
        command = int.from_bytes(words[:2], "little", signed=True)
        return Decision(command, int.from_bytes(words[2:], "little"), self._cycles - before)

    def stack(self) -> int:
        """How deep the stack has been [bytes]: what it has written of the RAM that was filled before."""
        self._say(f"md {self._start} {self._free}\n{_OUTPUTS}")
        shown = self._console.until(b"simulated_outputs 4\n")
        self._console.until(b"\n")
        lines = re.findall(rb"^    [0-9a-f]{5}: ((?:[0-9a-f]{2} )+)", shown, re.MULTILINE)
        return depth_of_stack(bytes.fromhex(b"".join(lines).decode()))

    def _say(self, text: str) -> None:
        self._console.say(f"{text}\n".encode())

    def _answer(self) -> bytes:
        """The four bytes of the outputs, at the end of what was asked; the cycles are noted."""
        said = self._console.until(b"simulated_outputs 4\n")
        self._cycles = int(_CYCLES.findall(said)[-1])
        return bytes.fromhex(self._console.until(b"\n").split(b":")[1].split(b"|")[0].decode())
