"""mspdebug's simulator of an MSP430, driven by its console."""

import re
from collections.abc import Callable, Iterable, Sequence
from typing import final

from ppafo.processor.console import UNTOUCHED, Console, depth_of_stack
from ppafo.processor.images import Decision, Image, Target

_CYCLES = re.compile(rb"MCLK:\s+(\d+)")
"""Where mspdebug says how many cycles have passed."""
_ASKED = "asked.txt"
"""File of the questions for some samples."""
_SAID_OUTPUTS = "simio info counter\nmd simulated_outputs 4"
"""What mspdebug is asked behind each question: the cycles, and the four bytes of the outputs."""


@final
class MspdebugSimulator:
    """mspdebug's simulator of an MSP430 with an image in it."""

    def __init__(self, target: Target, image: Image) -> None:
        self._cycles = 0
        self._folder = image.file.parent
        self._console = Console(["mspdebug", "-n", "-q", "sim"], self._folder)
        self.close: Callable[[], object] = self._console.close
        self._start = target.ram.start + image.sizes.data
        self._free = target.ram.size - image.sizes.data
        self._say(f"prog {image.file.name}\nfill {self._start} {self._free} {UNTOUCHED:x}")
        self._say(f"simio add tracer counter\nsetbreak board_wait\nrun\n{_SAID_OUTPUTS}")
        self._answer()

    def begin(self) -> None:
        """Reset the processor, and let it come to where it waits for a sample."""
        self._say(f"reset\nrun\n{_SAID_OUTPUTS}")
        self._answer()

    def samples(self, every: Sequence[Iterable[int]]) -> list[Decision]:
        """What it decides for some samples in turn, at most 50: asked at once, so that neither waits for the other."""
        asked = []
        for readings in every:
            sent = " ".join(f"0x{byte:02x}" for number in readings for byte in number.to_bytes(2, "little"))
            asked.append(f"mw simulated_readings {sent}\nrun\n{_SAID_OUTPUTS}\n")
        # mspdebug asks the system for every byte of its console, and for a file at once.
        (self._folder / _ASKED).write_text("".join(asked), encoding="ascii")
        self._say(f"read {_ASKED}")
        decisions = []
        for _ in every:
            before = self._cycles
            words = self._answer()
            command = int.from_bytes(words[:2], "little", signed=True)
            decisions.append(Decision(command, int.from_bytes(words[2:], "little"), self._cycles - before))
        return decisions

    def stack(self) -> int:
        """How deep the stack has been [bytes]: what it has written of the RAM that was filled before."""
        self._say(f"md {self._start} {self._free}\n{_SAID_OUTPUTS}")
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
