"""Small processors and their simulators: memory and tools of a target, images built and measured, mspdebug and QEMU.

mspdebug is driven by its console, QEMU with a Cortex-M in it by the remote protocol of gdb over its standard input and
output.
"""

import os
import re
import select
import struct
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shutil import which
from typing import NamedTuple, Protocol, final
from weakref import finalize

from ppafo.errors import SimulationError, one_line, reason
from ppafo.translation.compiling import asked


class Memory(NamedTuple):
    """A range of addresses: its first one, and its size [bytes]."""

    start: int
    size: int

    def holds(self, address: int) -> bool:
        """True for an address within it."""
        return self.start <= address < self.start + self.size


class Machine(NamedTuple):
    """What QEMU calls a machine: its name, and the clock of its processor [Hz]."""

    name: str
    clock: float


NO_MACHINE = Machine("", 0.0)
"""Simulator of a target which QEMU does not simulate."""


class Decision(NamedTuple):
    """Command in steps, 1 while all readings have been sound, and the cycles or instructions of the sample."""

    command: int
    is_sound: int
    work: int


class Sizes(NamedTuple):
    """Flash of an image and RAM of its data [bytes]."""

    flash: int
    data: int


@dataclass(frozen=True, slots=True)
class Image:
    """A program for the simulator that was built: its file, what it takes, the addresses of its symbols.

    ``shipped`` is what the program for the board takes, which has the real layer around the controller.
    """

    file: Path
    sizes: Sizes
    shipped: Sizes
    symbols: Mapping[str, int]


class ProcessorSimulator(Protocol):
    """A simulator with an image in it, which waits for a sample. SimulationError where it does not answer."""

    def begin(self) -> None:
        """Reset the processor, and let it come to where it waits for a sample."""

    def samples(self, every: Sequence[Iterable[int]]) -> list[Decision]:
        """What the processor decides for some samples in turn, at most 50, asked at once where the simulator can."""

    def stack(self) -> int:
        """How deep the stack has been [bytes]."""

    close: Callable[[], object]
    """Ends the simulator."""


@dataclass(frozen=True, slots=True)
class Target:
    """A processor that firmware is written for.

    ``processor`` and ``board`` say what it is, ``clock`` is the processor's [Hz], ``interrupt_stack`` what an
    interrupt of the board puts on the stack [bytes], ``converter_bits`` the bits of its converter. ``words`` fill the
    templates: how it is compiled, linked and written, which pins it has. ``templates`` are the files that belong to
    this target alone, ``wiring`` is the one with the part of README.md that says what is wired to it.

    ``tools`` are the programs that building and simulating need, ``packages`` Debian's packages that have them.
    ``simulator`` starts one with an image, ``machine`` is what QEMU has to know, ``counted`` what is counted of a
    sample: cycles or instructions.
    """

    name: str
    processor: str
    board: str
    clock: float
    flash: Memory
    ram: Memory
    interrupt_stack: int
    converter_bits: int
    words: Mapping[str, str]
    templates: tuple[str, ...]
    wiring: str
    tools: tuple[str, ...]
    packages: str
    counted: str
    simulator: Callable[["Target", Image], ProcessorSimulator]
    machine: Machine = NO_MACHINE


UNTOUCHED = 0xA5
"""What the RAM for the stack is filled with, so that what the stack has overwritten can be seen."""
# Seconds without a byte before a simulator is given up; a busy machine starts QEMU in some ten.
_PATIENCE = 60.0
# Of the ELF format: SHF_ALLOC; SHT_PROGBITS, SHT_SYMTAB; a section header and a symbol of 32 bits.
_LOADED = 2
_WITH_VALUES, _SYMBOL_TABLE = 1, 2
_SECTION = struct.Struct("<IIIIIIIIII")
_SYMBOL = struct.Struct("<IIIBBH")


def missing_tools(target: Target) -> tuple[str, ...]:
    """The tools of a target that this computer lacks."""
    return tuple(tool for tool in target.tools if which(tool) is None)


def built(contents: Mapping[str, bytes], folder: Path, goals: Sequence[str] = ("all",)) -> None:
    """Write the files of a firmware into a folder and make what is asked for; SimulationError where that fails."""
    for name, content in contents.items():
        (folder / name).write_bytes(content)
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
    with tempfile.TemporaryDirectory(prefix="ppafo-processor-", ignore_cleanup_errors=True) as folder:
        built(contents, Path(folder))
        image = read_image(Path(folder), target)
        simulator = target.simulator(target, image)
        try:
            yield simulator, image
        finally:
            simulator.close()


def read_image(folder: Path, target: Target) -> Image:
    """The image for the simulator in a folder where a firmware was built."""
    file, shipped = folder / "simulated.elf", folder / "firmware.elf"
    own = sizes(file, target)
    return Image(file, own, sizes(shipped, target) if shipped.is_file() else own, _symbols(file.read_bytes()))


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


def sizes(image: Path, target: Target) -> Sizes:
    """Flash and RAM that a program takes of a target."""
    loaded = [section for section in _sections(image.read_bytes()) if section.flags & _LOADED]
    in_ram = [section for section in loaded if target.ram.holds(section.address)]
    values = sum(section.size for section in in_ram if section.kind == _WITH_VALUES)
    flash = sum(section.size for section in loaded if target.flash.holds(section.address))
    # Initial values of RAM lie in flash too, from where the start-up code copies them.
    return Sizes(flash + values, sum(section.size for section in in_ram))


def _symbols(content: bytes) -> dict[str, int]:
    """Addresses of the symbols of an ELF file, by name."""
    sections = _sections(content)
    symbols = {}
    for section in sections:
        if section.kind == _SYMBOL_TABLE:
            names = sections[section.link].offset
            for at in range(section.offset, section.offset + section.size, _SYMBOL.size):
                name, address, *_ = _SYMBOL.unpack_from(content, at)
                begin = names + name
                symbols[content[begin : content.index(b"\0", begin)].decode()] = address
    return symbols


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
            # What comes behind the mark is kept for the next question.
            self._seen += said
        output, _, self._seen = self._seen.partition(mark)
        return output

    def _last(self) -> str:
        last = self._seen.decode(errors="replace").strip().splitlines()[-1:]
        return f"the last it said: {one_line(' '.join(last))}"


def _end(process: "subprocess.Popen[bytes]") -> None:
    process.kill()
    process.communicate()


def depth_of_stack(memory: bytes) -> int:
    """How deep a stack has been [bytes] that grows down from the end of memory filled with ``UNTOUCHED``."""
    return len(memory) - next((depth for depth, byte in enumerate(memory) if byte != UNTOUCHED), len(memory))


_CYCLES = re.compile(rb"MCLK:\s+(\d+)")
_ASKED = "asked.txt"
_SAID_OUTPUTS = "simio info counter\nmd simulated_outputs 4"


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


DEEPEST = 1024
"""How far below the end of RAM the stack is looked for [bytes]."""
_SHIFT = 7
_NANOSECONDS = 2**_SHIFT
"""What an instruction takes of the machine's time [ns]: more than two ticks of the counter, so that none is missed."""
_COUNTER_BITS = 24
"""Bits of SysTick, the counter that counts the ticks of the processor's clock down."""
_PIECE = 1024
"""Bytes that are read or written at once; a packet has no room for many more."""
_FORM_OF_OUTPUTS = struct.Struct("<hhII")
_THUMB, _LENGTH_OF_NOP = 1, 2


@final
class Debugger:
    """A machine of QEMU that stands still but when it is told to go on; addresses are its processor's."""

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
        """Reset the machine; it stands still at its beginning."""
        answer = self.packet(f"qRcmd,{b'system_reset'.hex()}")
        # Before its OK, QEMU may send what the command has to say.
        while answer != "OK":
            answer = self._answer()

    def stop_at(self, address: int) -> None:
        """Let the machine stop before an instruction, whenever it comes there."""
        self._expect(self.packet(f"Z0,{address:x},2"), "OK")

    def go_on(self, address: int | None = None) -> None:
        """Let the machine run, from an address where one is given, until it stops."""
        # Bit 0 of an address says that the instruction is Thumb; a Cortex-M has no other.
        self._expect(self.packet("c" if address is None else f"c{address | _THUMB:x}")[:3], "T05")

    def read(self, address: int, size: int) -> bytes:
        """What is in memory."""
        content = b""
        for at in range(address, address + size, _PIECE):
            count = min(_PIECE, address + size - at)
            answer = self.packet(f"m{at:x},{count:x}")
            if len(answer) != 2 * count:
                raise SimulationError(f"QEMU cannot read {count} bytes at 0x{at:x}: {answer}")
            content += bytes.fromhex(answer)
        return content

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
        self.close: Callable[[], object] = self.debugger.close
        self.debugger.write(self._bottom, bytes([UNTOUCHED]) * DEEPEST)
        self.debugger.stop_at(self._stop)
        self.debugger.go_on()

    def begin(self) -> None:
        """Reset the processor, and let it come to where it waits for a sample."""
        self.debugger.reset()
        self.debugger.go_on()

    def samples(self, every: Sequence[Iterable[int]]) -> list[Decision]:
        """What it decides for some samples, one after the other."""
        decisions = []
        for readings in every:
            self.debugger.write(self._readings, b"".join(number.to_bytes(2, "little") for number in readings))
            # Behind the breakpoint, or the machine would stop at once.
            self.debugger.go_on(self._stop + _LENGTH_OF_NOP)
            outputs = self.debugger.read(self._outputs, _FORM_OF_OUTPUTS.size)
            command, is_sound, begun, ended = _FORM_OF_OUTPUTS.unpack(outputs)
            # The counter counts down, and begins anew at 2^24.
            ticks = (begun - ended) % 2**_COUNTER_BITS
            decisions.append(Decision(command, is_sound, round(ticks / self._ticks)))
        return decisions

    def stack(self) -> int:
        """How deep the stack has been [bytes]: what it has written of the RAM that was filled before."""
        return depth_of_stack(self.debugger.read(self._bottom, DEEPEST))
