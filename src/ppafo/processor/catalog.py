"""Catalogue of processors with firmware support, each with its board files and simulator."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, final

from ppafo.errors import ScenarioError
from ppafo.processor.console import UNTOUCHED, Console, depth_of_stack
from ppafo.processor.images import Decision, Image, Target
from ppafo.processor.qemu import QemuSimulator
from ppafo.storage.files import write_file
from ppafo.wording import known_names

# mspdebug's simulator of an MSP430, driven by its console.

_CYCLES = re.compile(rb"MCLK:\s+(\d+)")
"""Pattern of the cycle count in mspdebug's output."""
_QUERIES = "asked.txt"
"""File with the mspdebug commands for a batch of samples."""
_SHOW_OUTPUTS = "simio info counter\nmd simulated_outputs 4"
"""mspdebug command after each sample: cycle count, and the four output bytes."""


@final
class _MspdebugSimulator:
    """MSP430 simulator mspdebug with a loaded image."""

    def __init__(self, target: Target, image: Image) -> None:
        self._cycles = 0
        self._folder = image.file.parent
        self._console = Console(["mspdebug", "-n", "-q", "sim"], self._folder)
        self.close: Callable[[], object] = self._console.close
        self._start = target.ram.start + image.sizes.data
        self._free = len(target.ram) - image.sizes.data
        self._say(f"prog {image.file.name}\nfill {self._start} {self._free} {UNTOUCHED:x}")
        self._say(f"simio add tracer counter\nsetbreak board_wait\nrun\n{_SHOW_OUTPUTS}")
        self._answer()

    def begin(self) -> None:
        """Reset the processor and run it until it waits for a sample."""
        self._say(f"reset\nrun\n{_SHOW_OUTPUTS}")
        self._answer()

    def samples(self, every: Sequence[Iterable[int]]) -> list[Decision]:
        """Return the decisions for consecutive samples, requested in one batch."""
        queries = []
        for readings in every:
            content = " ".join(f"0x{byte:02x}" for number in readings for byte in number.to_bytes(2, "little"))
            queries.append(f"mw simulated_readings {content}\nrun\n{_SHOW_OUTPUTS}\n")
        # mspdebug asks the system for every byte of its console, and for a file at once.
        write_file(self._folder / _QUERIES, "".join(queries).encode("ascii"))
        self._say(f"read {_QUERIES}")
        decisions = []
        for _ in every:
            before = self._cycles
            words = self._answer()
            command = int.from_bytes(words[:2], "little", signed=True)
            decisions.append(Decision(command, int.from_bytes(words[2:], "little"), self._cycles - before))
        return decisions

    def stack(self) -> int:
        """Return the deepest use of the stack [bytes], from overwritten fill bytes in RAM."""
        self._say(f"md {self._start} {self._free}\n{_SHOW_OUTPUTS}")
        response = self._console.until(b"simulated_outputs 4\n")
        self._console.until(b"\n")
        lines = re.findall(rb"^    [0-9a-f]{5}: ((?:[0-9a-f]{2} )+)", response, re.MULTILINE)
        return depth_of_stack(bytes.fromhex(b"".join(lines).decode()))

    def _say(self, text: str) -> None:
        self._console.say(f"{text}\n".encode())

    def _answer(self) -> bytes:
        """Return the four output bytes of a response, and store the cycle count."""
        response = self._console.until(b"simulated_outputs 4\n")
        self._cycles = int(_CYCLES.findall(response)[-1])
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
"""Make file rule that writes the program to the processor."""


MSP430F2013 = Target(
    name="msp430f2013",
    processor="MSP430F2013",
    board="an eZ430-F2013",
    clock=16.0e6,
    flash=range(0xF800, 0x10000),
    ram=range(0x200, 0x280),
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


def _cortex(name: str, part: str, pins: Mapping[str, str], flash: int, ram: int, **more: Any) -> Target:
    """Declare a Cortex-M on a micro:bit with flash and RAM [bytes]; compilers are gcc, clang or zig."""
    for_zig = f"zig cc -target thumb-freestanding-eabi -mcpu={name.replace('-', '_')}"
    copy_rule = _FLASH.format(
        said="Copy to the USB drive of the board", needs="firmware.hex", command='cp firmware.hex "$(MICROBIT)"'
    )
    words = {
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
        "flash": copy_rule + _HEX,
        "flash_said": "to the USB drive of the board, for example make flash MICROBIT=/media/MICROBIT",
        **{f"pin_{pin}": place for pin, place in pins.items()},
    }
    return Target(
        name=name,
        flash=range(flash),
        ram=range(0x20000000, 0x20000000 + ram),
        interrupt_stack=40,
        words=words,
        templates=("board_microbit.c", "start_cortex.c", f"converter_{part}.c", f"{part}.ld"),
        wiring="wiring_microbit.md",
        tools=("make", "arm-none-eabi-gcc", "qemu-system-arm"),
        packages="make, gcc-arm-none-eabi and qemu-system-arm",
        counted="instructions",
        simulator=QemuSimulator,
        **more,
    )


CORTEX_M0 = _cortex(
    "cortex-m0",
    "nrf51822",
    {
        "pressure_1": "P0.03, AIN4",
        "pressure_2": "P0.02, AIN3",
        "reference": "P0.01, AIN2",
        "a": "23",
        "b": "22",
        "pulse": "21",
        "enable": "20",
    },
    flash=256 * 1024,
    ram=16 * 1024,
    processor="nRF51822, a Cortex-M0",
    board="a BBC micro:bit V1",
    clock=16.0e6,
    converter_bits=10,
    machine="microbit",
    machine_clock=16.0e6,
)
CORTEX_M4 = _cortex(
    "cortex-m4",
    "nrf52833",
    {
        "pressure_1": "P0.02, AIN0",
        "pressure_2": "P0.03, AIN1",
        "reference": "P0.04, AIN2",
        "a": "17",
        "b": "01",
        "pulse": "13",
        "enable": "12",
    },
    flash=512 * 1024,
    ram=128 * 1024,
    processor="nRF52833, a Cortex-M4",
    board="a BBC micro:bit V2",
    clock=64.0e6,
    converter_bits=14,
    machine="mps2-an386",
    machine_clock=25.0e6,
)
CATALOG: dict[str, Target] = {target.name: target for target in (MSP430F2013, CORTEX_M0, CORTEX_M4)}
TARGETS = tuple(CATALOG)
"""Names of the processors with firmware support, default first."""


def target_of(name: str) -> Target:
    """Return a target by name. Raises ScenarioError for an unknown name."""
    if name not in CATALOG:
        raise ScenarioError(f"there is no target '{name}'{known_names(name, CATALOG)}")
    return CATALOG[name]
