"""Small processors and the images of their firmware: memory and tools of a target, images built and measured."""

import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shutil import which
from typing import NamedTuple, Protocol

from ppafo.errors import SimulationError
from ppafo.storage.files import temporary_folder
from ppafo.translation.compiling import asked
from ppafo.wording import one_line


class Decision(NamedTuple):
    """Command in steps, 1 while all readings have been sound, and the cycles or instructions of the sample."""

    command: int
    is_sound: int
    work: int


class ImageSizes(NamedTuple):
    """Flash of an image and RAM of its data [bytes]."""

    flash: int
    data: int


@dataclass(frozen=True, slots=True)
class Image:
    """A program for the simulator that was built: its file, what it takes, the addresses of its symbols.

    ``shipped`` is what the program for the board takes, which has the real layer around the controller.
    """

    file: Path
    sizes: ImageSizes
    shipped: ImageSizes
    symbols: Mapping[str, int]


class ProcessorSimulator(Protocol):
    """A simulator with an image in it, which waits for a sample. SimulationError where it does not answer."""

    def begin(self) -> None:
        """Reset the processor, and let it come to where it waits for a sample."""

    def samples(self, every: Sequence[Iterable[int]]) -> list[Decision]:
        """Controller decisions for up to 50 consecutive samples, in one batch where the simulator can."""

    def stack(self) -> int:
        """Deepest use of the stack [bytes]."""

    close: Callable[[], object]
    """Ends the simulator."""


@dataclass(frozen=True, slots=True)
class Target:
    """A processor that firmware is written for.

    ``processor`` and ``board`` say what it is, ``clock`` is the processor's [Hz], ``flash`` and ``ram`` are ranges of
    addresses, ``interrupt_stack`` is what an interrupt of the board puts on the stack [bytes], ``converter_bits`` the
    bits of its converter. ``words`` fill the templates: how it is compiled, linked and written, which pins it has.
    ``templates`` are the files that belong to this target alone, ``wiring`` is the one with the part of README.md that
    says what is wired to it.

    ``tools`` are the programs that building and simulating need, ``packages`` Debian's packages that have them.
    ``simulator`` starts one with an image; ``machine`` is QEMU's name of a machine with the processor, which has the
    clock ``machine_clock`` [Hz]. ``counted`` is what is counted of a sample: cycles or instructions.
    """

    name: str
    processor: str
    board: str
    clock: float
    flash: range
    ram: range
    interrupt_stack: int
    converter_bits: int
    words: Mapping[str, str]
    templates: tuple[str, ...]
    wiring: str
    tools: tuple[str, ...]
    packages: str
    counted: str
    simulator: Callable[["Target", Image], ProcessorSimulator]
    machine: str = ""
    machine_clock: float = 0.0


_LOADED = 2
"""SHF_ALLOC of the ELF format: the flag of a section that is in memory while the program runs."""
_WITH_VALUES, _SYMBOL_TABLE = 1, 2
"""SHT_PROGBITS and SHT_SYMTAB of the ELF format: kinds of sections."""
_SECTION = struct.Struct("<IIIIIIIIII")
_SYMBOL = struct.Struct("<IIIBBH")
"""A section header and a symbol of a 32-bit ELF file."""


def missing_tools(target: Target) -> tuple[str, ...]:
    """The tools of a target that this computer lacks."""
    return tuple(tool for tool in target.tools if which(tool) is None)


def make_firmware(folder: Path, goals: Sequence[str] = ("all",)) -> None:
    """Make what is asked for of the files of a firmware in a folder; SimulationError where that fails."""
    done = asked(["make", "-C", str(folder), *goals], scratch=folder.absolute())
    if done.returncode != 0:
        # Make says which goal failed; the line of the compiler says why.
        said = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr)
        raise SimulationError(f"the firmware cannot be built: {one_line(said)}")


@contextmanager
def processor_simulator(contents: Mapping[str, bytes], target: Target) -> Iterator[tuple[ProcessorSimulator, Image]]:
    """The simulator of a target with the firmware of these files in it, and the image; both end with the ``with``.

    SimulationError where a tool is missing, the files cannot be built, or the simulator does not answer.
    """
    absent = missing_tools(target)
    if absent:
        raise SimulationError(
            f"the simulator of {target.name} needs {', '.join(absent)}; {target.packages} are packages of Debian"
        )
    with temporary_folder("ppafo-processor", contents) as folder:
        make_firmware(Path(folder))
        image = read_image(Path(folder), target)
        simulator = target.simulator(target, image)
        try:
            yield simulator, image
        finally:
            simulator.close()


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
    # Where the section headers begin, how long each is, and how many there are (e_shoff, e_shentsize, e_shnum).
    (start,) = struct.unpack_from("<I", content, 0x20)
    length, count = struct.unpack_from("<HH", content, 0x2E)
    return [_Section._make(_SECTION.unpack_from(content, start + length * number)) for number in range(count)]


def sizes(image: Path, target: Target) -> ImageSizes:
    """Flash and RAM that a program takes of a target."""
    loaded = [section for section in _sections(image.read_bytes()) if section.flags & _LOADED]
    in_ram = [section for section in loaded if section.address in target.ram]
    values = sum(section.size for section in in_ram if section.kind == _WITH_VALUES)
    flash = sum(section.size for section in loaded if section.address in target.flash)
    # Initial values of RAM lie in flash too, from where the start-up code copies them.
    return ImageSizes(flash + values, sum(section.size for section in in_ram))


def read_image(folder: Path, target: Target) -> Image:
    """The image for the simulator in a folder where a firmware was built."""
    file, shipped = folder / "simulated.elf", folder / "firmware.elf"
    content = file.read_bytes()
    sections, symbols = _sections(content), {}
    for section in sections:
        if section.kind == _SYMBOL_TABLE:
            names = sections[section.link].offset
            for at in range(section.offset, section.offset + section.size, _SYMBOL.size):
                name, address, *_ = _SYMBOL.unpack_from(content, at)
                begin = names + name
                symbols[content[begin : content.index(b"\0", begin)].decode()] = address
    own = sizes(file, target)
    return Image(file, own, sizes(shipped, target) if shipped.is_file() else own, symbols)
