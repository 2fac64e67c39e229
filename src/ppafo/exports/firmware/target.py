"""What a small processor is for a firmware: its memory, how it is built for, and how its simulator is driven."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol


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
"""That of a target which QEMU does not simulate."""


class Doubles(NamedTuple):
    """How a target computes floats of 64 bits: flags of the compiler, and the same in words."""

    flags: str
    said: str


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


class ChipSimulator(Protocol):
    """A simulator with an image in it, which waits for a sample. SimulationError where it does not answer."""

    def begin(self) -> None:
        """Reset the processor, and let it come to where it waits for a sample."""

    def sample(self, readings: Iterable[int]) -> Decision:
        """What the chip decides for the readings of one sample."""

    def samples(self, every: Sequence[Iterable[int]]) -> list[Decision]:
        """What it decides for some samples in turn, at most 50: asked at once where the simulator takes that."""

    def stack(self) -> int:
        """How deep the stack has been [bytes]."""

    def close(self) -> None:
        """End the simulator."""


@dataclass(frozen=True, slots=True)
class Target:
    """A processor that firmware is written for.

    ``processor`` and ``board`` say what it is, ``clock`` is that of the processor [Hz], ``interrupt_stack`` what an
    interrupt of the board puts on the stack [bytes], ``converter_bits`` those of its converter. ``words`` fill the
    templates: how it is compiled, linked and written, which pins it has. ``templates`` are the files that belong to
    this target alone, ``wiring`` is the one with the part of README.md that says what is wired to it.

    ``tools`` are the programs that building and simulating need, ``packages`` those of Debian that have them.
    ``simulator`` starts one with an image, ``machine`` is what QEMU has to know, ``counted`` what is counted of a
    sample: cycles or instructions. The plant can be written for a target that has ``doubles``.
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
    simulator: Callable[["Target", Image], ChipSimulator]
    machine: Machine = NO_MACHINE
    doubles: Doubles | None = None
