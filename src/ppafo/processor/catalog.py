"""Processors that firmware is written for. To add one here: a description, and the files of its board."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import final

from ppafo.errors import ScenarioError
from ppafo.processor.console import UNTOUCHED, Console, depth_of_stack
from ppafo.processor.images import Decision, EmulatedMachine, Image, MemoryRegion, Target
from ppafo.processor.qemu import QemuSimulator
from ppafo.storage.files import write_file

# mspdebug's simulator of an MSP430, driven by its console.

_CYCLES = re.compile(rb"MCLK:\s+(\d+)")
"""Form of mspdebug's cycle counter."""
_ASKED = "asked.txt"
"""File of the questions for some samples."""
_SAID_OUTPUTS = "simio info counter\nmd simulated_outputs 4"
"""Query of mspdebug after each sample: cycle count, and the four bytes of the outputs."""


@final
class _MspdebugSimulator:
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
        """Controller decisions for up to 50 consecutive samples, requested in one batch to avoid a round trip each."""
        asked = []
        for readings in every:
            sent = " ".join(f"0x{byte:02x}" for number in readings for byte in number.to_bytes(2, "little"))
            asked.append(f"mw simulated_readings {sent}\nrun\n{_SAID_OUTPUTS}\n")
        # mspdebug asks the system for every byte of its console, and for a file at once.
        write_file(self._folder / _ASKED, "".join(asked).encode("ascii"))
        self._say(f"read {_ASKED}")
        decisions = []
        for _ in every:
            before = self._cycles
            words = self._answer()
            command = int.from_bytes(words[:2], "little", signed=True)
            decisions.append(Decision(command, int.from_bytes(words[2:], "little"), self._cycles - before))
        return decisions

    def stack(self) -> int:
        """Deepest use of the stack [bytes]: what it has overwritten of RAM that was filled before."""
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


_VARIABLES = """\
# Others do as well: make COMPILER="clang --target=arm-none-eabi" LINKER='$(COMPILER) -fuse-ld=lld',
# or make COMPILER="{zig}" PROCESSOR=
COMPILER ?= arm-none-eabi-gcc
LINKER ?= $(COMPILER)
PROCESSOR ?= -mcpu={name}
OBJCOPY ?= arm-none-eabi-objcopy"""
_HEX = """
firmware.hex: firmware.elf
\t$(OBJCOPY) -O ihex $< $@
"""

_FLASH = "\n# {said}. Read README.md first.\nflash: {needs}\n\t{command}\n"
"""The part of a make file that writes the processor."""


MSP430F2013 = Target(
    name="msp430f2013",
    processor="MSP430F2013",
    board="an eZ430-F2013",
    clock=16.0e6,
    flash=MemoryRegion(0xF800, 0x800),
    ram=MemoryRegion(0x200, 0x80),
    interrupt_stack=4,
    converter_bits=16,
    words={
        "needs": "clang and lld of LLVM",
        "variables": "CLANG ?= clang\nLINKER ?= ld.lld",
        "compiler": "$(CLANG)",
        "flags_of_target": "--target=msp430-none-elf -mmcu=msp430f2013",
        "link": "$(LINKER) --gc-sections",
        "start": "start_msp430.o",
        "board_objects": "board_msp430f2013.o",
        "board_files": "`board_msp430f2013.c`, `msp430.h`",
        "not_run": "no simulator here has them",
        "script": "msp430f2013.ld",
        "flash": _FLASH.format(
            said="Into the processor of an eZ430-F2013",
            needs="firmware.elf",
            command='mspdebug uif "prog firmware.elf"',
        ),
        "flash_said": "into the processor of an eZ430-F2013, by mspdebug",
    },
    templates=("board_msp430f2013.c", "msp430.h", "msp430f2013.ld", "start_msp430.c"),
    wiring="wiring_msp430f2013.md",
    tools=("make", "clang", "ld.lld", "mspdebug"),
    packages="make, clang, lld and mspdebug",
    counted="cycles",
    simulator=_MspdebugSimulator,
)


def _words_of_cortex(name: str, part: str, pins: Mapping[str, str]) -> dict[str, str]:
    """Template variables for a Cortex-M on a micro:bit, whose compiler may be gcc, clang or zig."""
    for_zig = f"zig cc -target thumb-freestanding-eabi -mcpu={name.replace('-', '_')}"
    return {
        "needs": "gcc for ARM without a system",
        "variables": _VARIABLES.format(name=name, zig=for_zig),
        "compiler": "$(COMPILER)",
        "flags_of_target": "$(PROCESSOR) -mthumb -fomit-frame-pointer",
        "link": "$(LINKER) $(PROCESSOR) -mthumb -nostdlib -Wl,--gc-sections",
        "start": "start_cortex.o",
        "board_objects": f"board_microbit.o converter_{part}.o",
        "board_files": f"`board_microbit.c` and `converter_{part}.c`",
        "not_run": "timer and outputs run in QEMU's micro:bit V1, converter and watchdog have no simulator",
        "script": f"{part}.ld",
        "flash": _FLASH.format(
            said="Onto the drive that the board is", needs="firmware.hex", command='cp firmware.hex "$(MICROBIT)"'
        )
        + _HEX,
        "flash_said": "onto the drive that the board is, as in make flash MICROBIT=/media/MICROBIT",
        **pins,
    }


_OF_CORTEX = ("board_microbit.c", "start_cortex.c")
_TOOLS = ("make", "arm-none-eabi-gcc", "qemu-system-arm")
_PACKAGES = "make, gcc-arm-none-eabi and qemu-system-arm"
CORTEX_M0 = Target(
    name="cortex-m0",
    processor="nRF51822, a Cortex-M0",
    board="a BBC micro:bit V1",
    clock=16.0e6,
    flash=MemoryRegion(0, 256 * 1024),
    ram=MemoryRegion(0x20000000, 16 * 1024),
    interrupt_stack=40,
    converter_bits=10,
    words=_words_of_cortex(
        "cortex-m0",
        "nrf51822",
        {
            "pin_pressure_1": "P0.03, AIN4",
            "pin_pressure_2": "P0.02, AIN3",
            "pin_reference": "P0.01, AIN2",
            "pin_a": "23",
            "pin_b": "22",
            "pin_pulse": "21",
            "pin_enable": "20",
        },
    ),
    templates=(*_OF_CORTEX, "converter_nrf51822.c", "nrf51822.ld"),
    wiring="wiring_microbit.md",
    tools=_TOOLS,
    packages=_PACKAGES,
    counted="instructions",
    simulator=QemuSimulator,
    machine=EmulatedMachine("microbit", 16.0e6),
)
CORTEX_M4 = Target(
    name="cortex-m4",
    processor="nRF52833, a Cortex-M4",
    board="a BBC micro:bit V2",
    clock=64.0e6,
    flash=MemoryRegion(0, 512 * 1024),
    ram=MemoryRegion(0x20000000, 128 * 1024),
    interrupt_stack=40,
    converter_bits=14,
    words=_words_of_cortex(
        "cortex-m4",
        "nrf52833",
        {
            "pin_pressure_1": "P0.02, AIN0",
            "pin_pressure_2": "P0.03, AIN1",
            "pin_reference": "P0.04, AIN2",
            "pin_a": "17",
            "pin_b": "01",
            "pin_pulse": "13",
            "pin_enable": "12",
        },
    ),
    templates=(*_OF_CORTEX, "converter_nrf52833.c", "nrf52833.ld"),
    wiring="wiring_microbit.md",
    tools=_TOOLS,
    packages=_PACKAGES,
    counted="instructions",
    simulator=QemuSimulator,
    machine=EmulatedMachine("mps2-an386", 25.0e6),
)
CATALOG: dict[str, Target] = {target.name: target for target in (MSP430F2013, CORTEX_M0, CORTEX_M4)}
TARGETS = tuple(CATALOG)
"""Names of the processors that an integer controller can be written for, the usual one first."""


def target_of(name: str) -> Target:
    """The target of a name; ScenarioError where there is none."""
    if name not in CATALOG:
        raise ScenarioError(f"no firmware for '{name}'; targets: {', '.join(CATALOG)}")
    return CATALOG[name]
