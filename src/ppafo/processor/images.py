"""Firmware images and targets: memory and tools of a processor, build and size of an image."""

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
    """Controller decision for a sample: command [steps], 1 for valid readings, and cycles or instructions."""

    command: int
    is_sound: int
    work: int


class ImageSizes(NamedTuple):
    """Flash of an image, and RAM of its data [bytes]."""

    flash: int
    data: int


@dataclass(frozen=True, slots=True)
class Image:
    """Firmware image for the simulator: file, sizes, and symbol addresses.

    ``shipped`` are the sizes of the program for the board, which has the hardware layer around the controller.
    """

    file: Path
    sizes: ImageSizes
    shipped: ImageSizes
    symbols: Mapping[str, int]


class ProcessorSimulator(Protocol):
    """Processor simulator with a loaded image. Methods raise SimulationError if it does not respond."""

    def begin(self) -> None:
        """Reset the processor and run it until it waits for a sample."""

    def samples(self, every: Sequence[Iterable[int]]) -> list[Decision]:
        """Return the decisions for consecutive samples, in one batch if possible."""

    def stack(self) -> int:
        """Return the deepest use of the stack [bytes]."""

    close: Callable[[], object]
    """Function that ends the simulator process."""


@dataclass(frozen=True, slots=True)
class Target:
    """Processor with firmware support: memory, tools, templates and simulator.

    ``processor`` and ``board`` describe it, ``clock`` is the clock frequency [Hz], ``flash`` and ``ram`` are address
    ranges, ``interrupt_stack`` is the stack use of an interrupt on the board [bytes], ``converter_bits`` the resolution
    of its converter. ``words`` fill the templates: commands to compile, link and flash, and pins. ``templates`` are the
    files of this target alone, ``wiring`` is the file with the wiring section of README.md.

    ``tools`` are the programs for building and simulating, ``packages`` the Debian packages that contain them.
    ``simulator`` starts a simulator with an image; ``machine`` is the QEMU name of a machine with the processor, with
    the clock frequency ``machine_clock`` [Hz]. ``counted`` is the cost unit of a sample: cycles or instructions.
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
"""SHF_ALLOC of ELF, the flag of a section in memory at run time."""
_WITH_VALUES, _SYMBOL_TABLE = 1, 2
"""SHT_PROGBITS and SHT_SYMTAB of ELF, types of sections."""
_SECTION = struct.Struct("<IIIIIIIIII")
_SYMBOL = struct.Struct("<IIIBBH")
"""Layouts of a section header and a symbol in a 32-bit ELF file."""


def missing_tools(target: Target) -> tuple[str, ...]:
    """Return the tools of a target that are not installed on this computer."""
    return tuple(tool for tool in target.tools if which(tool) is None)


def make_firmware(folder: Path, goals: Sequence[str] = ("all",)) -> None:
    """Run make for goals in a firmware folder. Raises SimulationError if it fails."""
    done = asked(["make", "-C", str(folder), *goals], scratch=folder.absolute())
    if done.returncode != 0:
        # Make says which goal failed; the line of the compiler says why.
        cause = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr)
        raise SimulationError(f"the firmware cannot be built: {one_line(cause)}")


@contextmanager
def processor_simulator(contents: Mapping[str, bytes], target: Target) -> Iterator[tuple[ProcessorSimulator, Image]]:
    """Build firmware files and load them into the target's simulator; yields simulator and image.

    Raises SimulationError if a tool is missing, the files cannot be built, or the simulator does not respond.
    """
    missing = missing_tools(target)
    if missing:
        raise SimulationError(
            f"the simulator of {target.name} needs {', '.join(missing)}; install the Debian packages {target.packages}"
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
    """Section of an ELF file."""

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
    """Return the sections of a little-endian 32-bit ELF file."""
    # Where the section headers begin, how long each is, and how many there are (e_shoff, e_shentsize, e_shnum).
    (start,) = struct.unpack_from("<I", content, 0x20)
    length, count = struct.unpack_from("<HH", content, 0x2E)
    return [_Section._make(_SECTION.unpack_from(content, start + length * number)) for number in range(count)]


def sizes(image: Path, target: Target) -> ImageSizes:
    """Return flash and RAM of a program on a target [bytes]."""
    loaded = [section for section in _sections(image.read_bytes()) if section.flags & _LOADED]
    in_ram = [section for section in loaded if section.address in target.ram]
    values = sum(section.size for section in in_ram if section.kind == _WITH_VALUES)
    flash = sum(section.size for section in loaded if section.address in target.flash)
    # Initial values of RAM lie in flash too, from where the start-up code copies them.
    return ImageSizes(flash + values, sum(section.size for section in in_ram))


def read_image(folder: Path, target: Target) -> Image:
    """Return the simulator image of a folder with built firmware."""
    file, shipped = folder / "simulated.elf", folder / "firmware.elf"
    content = file.read_bytes()
    sections, symbols = _sections(content), {}
    for section in sections:
        if section.kind == _SYMBOL_TABLE:
            names = sections[section.link].offset
            for offset in range(section.offset, section.offset + section.size, _SYMBOL.size):
                name, address, *_ = _SYMBOL.unpack_from(content, offset)
                begin = names + name
                symbols[content[begin : content.index(b"\0", begin)].decode()] = address
    simulated_sizes = sizes(file, target)
    shipped_sizes = sizes(shipped, target) if shipped.is_file() else simulated_sizes
    return Image(file, simulated_sizes, shipped_sizes, symbols)
