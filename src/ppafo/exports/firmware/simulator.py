"""The image of a controller in the simulator of its processor, one sample after another, driven by its console."""

import os
import re
import select
import subprocess
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from shutil import which
from types import TracebackType
from typing import NamedTuple, final

from ppafo.errors import SimulationError, one_line, reason

TOOLS = ("make", "clang", "ld.lld", "mspdebug")
CLOCK = 16.0e6
"""Of the processor [Hz]."""
FLASH, RAM = 2048, 128
"""What an MSP430F2013 has [bytes]."""
_PATIENCE = 60.0
_RAM_START, _UNTOUCHED = 0x200, 0xA5
_CYCLES = re.compile(rb"MCLK:\s+(\d+)")


class Decision(NamedTuple):
    """Command in steps, 1 while all readings have been sound, and the cycles that the sample took."""

    command: int
    is_sound: int
    cycles: int


class Sizes(NamedTuple):
    """Flash of an image and RAM of its data [bytes]."""

    flash: int
    data: int


def missing_tools() -> tuple[str, ...]:
    """Those of ``TOOLS`` that this computer lacks."""
    return tuple(tool for tool in TOOLS if which(tool) is None)


def built(contents: Mapping[str, bytes], folder: Path, goals: tuple[str, ...] = ("all",)) -> None:
    """Write the files of a firmware into a folder and make what is asked for; SimulationError where that fails."""
    for name, content in contents.items():
        (folder / name).write_bytes(content)
    try:
        done = subprocess.run(["make", "-C", str(folder), *goals], capture_output=True, text=True, check=False)
    except OSError as error:
        raise SimulationError(f"make cannot be run: {reason(error)}") from error
    if done.returncode != 0:
        said = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr)
        raise SimulationError(f"the firmware cannot be built: {one_line(said)}")


def sizes(image: Path) -> Sizes:
    """Flash and RAM of an image, as the headers of its segments have them."""
    return _sizes_of(image.read_bytes())


def _sizes_of(image: bytes) -> Sizes:
    """The same of the bytes of a 32-bit ELF file: sections that are loaded, in flash or in RAM."""

    def number(at: int, length: int) -> int:
        return int.from_bytes(image[at : at + length], "little")

    start, length, count = number(0x20, 4), number(0x2E, 2), number(0x30, 2)
    flash = data = 0
    for at in range(start, start + length * count, length):
        is_loaded = number(at + 8, 4) & 2
        address, size = number(at + 12, 4), number(at + 20, 4)
        flash += size if is_loaded and address >= 2 * _RAM_START else 0
        data += size if is_loaded and address < 2 * _RAM_START else 0
    return Sizes(flash, data)


@final
class ChipSimulator:
    """mspdebug's simulator with the image of a folder in it; to be used in a ``with``.

    SimulationError where a tool is missing, or where the simulator does not answer.
    """

    def __init__(self, contents: Mapping[str, bytes], ram: int = RAM) -> None:
        absent = missing_tools()
        if absent:
            raise SimulationError(
                f"the chip's simulator needs {', '.join(absent)}; make, clang, lld and mspdebug are packages of Debian"
            )
        self._folder = tempfile.TemporaryDirectory(prefix="ppafo-chip-", ignore_cleanup_errors=True)
        folder = Path(self._folder.name)
        built(contents, folder)
        self.sizes = sizes(folder / "firmware.elf")
        self.simulated = sizes(folder / "simulated.elf")
        self._cycles = 0
        self._ram = ram
        self._seen = b""
        self._process = subprocess.Popen(
            ["mspdebug", "-n", "-q", "sim"],
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            bufsize=0,
        )
        free = ram - self.simulated.data
        self._say(f"prog simulated.elf\nfill {_RAM_START + self.simulated.data} {free} {_UNTOUCHED:x}")
        self._say("simio add tracer counter\nsetbreak board_wait\nrun\nsimio info counter\nmd simulated_outputs 4")
        self._answer()

    def __enter__(self) -> "ChipSimulator":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the simulator and remove its folder."""
        self._process.kill()
        self._process.communicate()
        self._folder.cleanup()

    def begin(self) -> None:
        """Reset the processor, and let it come to where it waits for a sample."""
        self._say("reset\nrun\nsimio info counter\nmd simulated_outputs 4")
        self._answer()

    def sample(self, readings: Iterable[int]) -> Decision:
        """What the chip decides for the readings of one sample."""
        return self.samples((readings,))[0]

    def samples(self, every: Sequence[Iterable[int]]) -> list[Decision]:
        """What it decides for some samples in turn, at most 50: asked at once, so that neither waits for the other."""
        for readings in every:
            given = " ".join(f"0x{byte:02x}" for number in readings for byte in number.to_bytes(2, "little"))
            self._say(f"mw simulated_readings {given}\nrun\nsimio info counter\nmd simulated_outputs 4")
        return [self._decision() for _ in every]

    def _decision(self) -> Decision:
        before = self._cycles
        words = self._answer()
        command = int.from_bytes(words[:2], "little", signed=True)
        return Decision(command, int.from_bytes(words[2:], "little"), self._cycles - before)

    def stack(self) -> int:
        """How deep the stack has been [bytes]: what it has written of the RAM that was filled before."""
        start = _RAM_START + self.simulated.data
        self._say(f"md {start} {self._ram - self.simulated.data}\nsimio info counter\nmd simulated_outputs 4")
        shown = self._until(b"simulated_outputs 4\n")
        self._line()
        lines = re.findall(rb"^    [0-9a-f]{5}: ((?:[0-9a-f]{2} )+)", shown, re.MULTILINE)
        memory = bytes.fromhex(b"".join(lines).decode())
        untouched = next(place for place, byte in enumerate(memory) if byte != _UNTOUCHED)
        return len(memory) - untouched

    def _say(self, text: str) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(f"{text}\n".encode())
        except OSError as error:
            raise SimulationError(f"mspdebug has ended: {reason(error)}") from error

    def _answer(self) -> bytes:
        """The four bytes of the outputs, at the end of what was asked; the cycles are noted."""
        said = self._until(b"simulated_outputs 4\n")
        self._cycles = int(_CYCLES.findall(said)[-1])
        return bytes.fromhex(self._line().split(b":")[1].split(b"|")[0].decode())

    def _line(self) -> bytes:
        return self._until(b"\n")

    def _until(self, mark: bytes) -> bytes:
        """What the simulator says up to a mark. SimulationError where it falls silent."""
        assert self._process.stdout is not None
        while mark not in self._seen:
            ready, _, _ = select.select([self._process.stdout], [], [], _PATIENCE)
            said = os.read(self._process.stdout.fileno(), 65536) if ready else b""
            if not said:
                last = self._seen.decode(errors="replace").strip().splitlines()[-1:]
                raise SimulationError(f"mspdebug does not answer; the last it said: {one_line(' '.join(last))}")
            self._seen += said
        found, _, self._seen = self._seen.partition(mark)
        return found
