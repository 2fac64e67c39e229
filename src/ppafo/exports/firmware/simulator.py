"""Images of a firmware: built, measured, and put into the simulator of their processor."""

import os
import select
import struct
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from shutil import which
from typing import NamedTuple, final
from weakref import finalize

from ppafo.errors import SimulationError, one_line, reason
from ppafo.exports.firmware.target import ChipSimulator, Image, Sizes, Target

UNTOUCHED = 0xA5
"""What the RAM for the stack is filled with, so that what the stack has overwritten can be seen."""
_PATIENCE = 60.0
_LOADED = 2
_WITH_VALUES, _SYMBOLS = 1, 2
_SECTION = struct.Struct("<IIIIIIIIII")
_SYMBOL = struct.Struct("<IIIBBH")


def missing_tools(target: Target) -> tuple[str, ...]:
    """The tools of a target that this computer lacks."""
    return tuple(tool for tool in target.tools if which(tool) is None)


def check_tools(target: Target) -> None:
    """SimulationError where this computer lacks a tool of a target."""
    absent = missing_tools(target)
    if absent:
        raise SimulationError(
            f"the simulator of {target.name} needs {', '.join(absent)}; {target.packages} are packages of Debian"
        )


def built(contents: Mapping[str, bytes], folder: Path, goals: Sequence[str] = ("all",)) -> None:
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


@contextmanager
def chip_simulator(contents: Mapping[str, bytes], target: Target) -> Iterator[tuple[ChipSimulator, Image]]:
    """The simulator of a target with the firmware of these files in it, and the image; both end with the ``with``.

    SimulationError where a tool is missing, the files cannot be built, or the simulator does not answer.
    """
    with built_image(contents, target) as image:
        simulator = target.simulator(target, image)
        try:
            yield simulator, image
        finally:
            simulator.close()


@contextmanager
def built_image(contents: Mapping[str, bytes], target: Target) -> Iterator[Image]:
    """The image for the simulator that is built of these files, in a folder that goes with the ``with``."""
    check_tools(target)
    with tempfile.TemporaryDirectory(prefix="ppafo-chip-", ignore_cleanup_errors=True) as folder:
        built(contents, Path(folder))
        yield read_image(Path(folder), target)


def read_image(folder: Path, target: Target) -> Image:
    """The image for the simulator in a folder where a firmware was built; a plant has no other one."""
    file, shipped = folder / "simulated.elf", folder / "firmware.elf"
    content = file.read_bytes()
    own = _sizes(content, target)
    return Image(file, own, sizes(shipped, target) if shipped.is_file() else own, _symbols(content))


def sizes(image: Path, target: Target) -> Sizes:
    """Flash and RAM that a program takes of a target."""
    return _sizes(image.read_bytes(), target)


class _Section(NamedTuple):
    """A section of an ELF file."""

    name: int
    kind: int
    flags: int
    address: int
    offset: int
    size: int
    link: int
    info: int
    alignment: int
    entry_size: int


def _sections(content: bytes) -> list[_Section]:
    """The sections of a 32-bit ELF file, lowest byte first."""
    (start,) = struct.unpack_from("<I", content, 0x20)
    length, count = struct.unpack_from("<HH", content, 0x2E)
    return [_Section._make(_SECTION.unpack_from(content, start + length * place)) for place in range(count)]


def _sizes(content: bytes, target: Target) -> Sizes:
    loaded = [item for item in _sections(content) if item.flags & _LOADED]
    in_ram = [item for item in loaded if target.ram.holds(item.address)]
    values = sum(item.size for item in in_ram if item.kind == _WITH_VALUES)
    flash = sum(item.size for item in loaded if target.flash.holds(item.address))
    return Sizes(flash + values, sum(item.size for item in in_ram))


def _symbols(content: bytes) -> dict[str, int]:
    """Addresses of the symbols of an ELF file, by name."""
    sections = _sections(content)
    found = {}
    for item in sections:
        if item.kind == _SYMBOLS:
            names = sections[item.link].offset
            for at in range(item.offset, item.offset + item.size, _SYMBOL.size):
                name, address, *_ = _SYMBOL.unpack_from(content, at)
                begin = names + name
                found[content[begin : content.index(b"\0", begin)].decode()] = address
    return found


@final
class Console:
    """A program of this machine that is spoken to by its standard input and output; ``close`` ends it."""

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        self._name = command[0]
        self._seen = b""
        try:
            self._process = subprocess.Popen(
                command,
                cwd=folder,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                bufsize=0,
            )
        except OSError as error:
            raise SimulationError(f"{self._name} cannot be run: {reason(error)}") from error
        # Nothing else ends it where what holds this object fails before it can close it.
        self.close = finalize(self, _end, self._process)

    def say(self, text: bytes) -> None:
        """Write to the program. SimulationError where it has ended."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(text)
        except OSError as error:
            raise SimulationError(f"{self._name} has ended: {reason(error)}; {self._last()}") from error

    def until(self, mark: bytes) -> bytes:
        """What the program says up to a mark. SimulationError where it falls silent."""
        assert self._process.stdout is not None
        while mark not in self._seen:
            ready, _, _ = select.select([self._process.stdout], [], [], _PATIENCE)
            said = os.read(self._process.stdout.fileno(), 65536) if ready else b""
            if not said:
                raise SimulationError(f"{self._name} does not answer; {self._last()}")
            self._seen += said
        found, _, self._seen = self._seen.partition(mark)
        return found

    def _last(self) -> str:
        last = self._seen.decode(errors="replace").strip().splitlines()[-1:]
        return f"the last it said: {one_line(' '.join(last))}"


def _end(process: "subprocess.Popen[bytes]") -> None:
    process.kill()
    process.communicate()


def depth_of_stack(memory: bytes) -> int:
    """How deep a stack has been [bytes] that grows down from the end of memory filled with ``UNTOUCHED``."""
    return len(memory) - next((place for place, byte in enumerate(memory) if byte != UNTOUCHED), len(memory))
