"""Firmware on mspdebug, a simulator of the MSP430: its decisions for drawn samples beside those in Python, its cost."""

import random
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from shutil import which
from typing import NamedTuple

from ppafo.errors import SimulationError
from ppafo.processor.controller import PythonProcessor, fixed_point_controller
from ppafo.processor.firmware import firmware
from ppafo.processor.fixed_point import ConverterCounts
from ppafo.simulation.scenario import Scenario
from ppafo.storage.files import temporary_folder, write_file
from ppafo.translation.compiling import asked
from ppafo.wording import one_line

# Memory of the MSP430F2013 [bytes].
FLASH = 2048
RAM = 128
CLOCK = 16.0e6
"""Clock frequency of the board [Hz]."""
INTERRUPT_STACK = 4
"""Stack use of the timer's interrupt, which the simulator does not run [bytes]."""
EPISODE = 200
"""Number of drawn samples between resets of the controller."""
_TOOLS = ("make", "clang", "ld.lld", "mspdebug")
_RAM_START = 0x200
_UNTOUCHED = 0xA5
"""Fill byte of RAM, which shows what data and stack have not overwritten."""
_COMMANDS = "commands.txt"
_ANSWER = re.compile(r"MCLK: +(\d+)\n(?:.*\n)*?=> md simulated_outputs 4\n +[0-9a-f]+: ((?:[0-9a-f]{2} ){4})")
"""Pattern of cycles since the start, and of the four output bytes, whenever the processor waits for a sample."""


class FirmwareTrial(NamedTuple):
    """Comparison of a firmware with the integer controller in Python, and what it needs of the processor.

    Flash of the program for the board, and RAM for data and stack in the simulator [bytes]; largest and mean number of
    clock cycles of a sample.
    """

    samples: int
    differences: int
    first_difference: str
    flash: int
    ram: int
    worst_cycles: int
    mean_cycles: float


def try_firmware(scenario: Scenario, samples: int, seed: int = 1) -> FirmwareTrial:
    """Run the firmware of a scenario's controller on drawn samples in mspdebug, and compare its decisions.

    Raises ScenarioError if the controller has no integer form, SimulationError if a tool is missing or fails.
    """
    fixed = fixed_point_controller(scenario)
    drawn = list(drawn_readings(fixed.numbers.limits.top, samples, seed))
    printed = _printed_by_mspdebug(firmware(scenario), drawn)
    found, cycles = _decisions(printed)
    processor = PythonProcessor(fixed)
    expected = []
    for number, readings in enumerate(drawn):
        if number % EPISODE == 0:
            processor.begin()
        expected.append(processor.sample(readings))
    if len(found) != samples:
        raise SimulationError(
            f"mspdebug answered {len(found)} of {samples} samples; it printed {one_line(printed[-80:])}"
        )
    differing = [number for number, decision in enumerate(found) if decision != expected[number]]
    first = (
        f"sample {differing[0]}: {found[differing[0]]} on the processor, {expected[differing[0]]} in Python"
        if differing
        else ""
    )
    _, flash = re.findall(r"Done, (\d+) bytes total", printed)
    # What data below and stack above have overwritten, from mspdebug's dump.
    dump = printed.rpartition(f"=> md {_RAM_START} {RAM}")[2]
    memory = bytes.fromhex("".join(re.findall(r"^ +[0-9a-f]{5}: ((?:[0-9a-f]{2} )+)", dump, re.MULTILINE)))
    ram = RAM - max(map(len, re.findall(rb"%c+" % _UNTOUCHED, memory)), default=0)
    return FirmwareTrial(samples, len(differing), first, int(flash), ram, max(cycles), sum(cycles) / samples)


def drawn_readings(top: int, samples: int, seed: int) -> Iterator[ConverterCounts]:
    """Yield random converter readings: wandering, jumping, resting at a limit, or broken signals.

    Each episode has one kind of signal; in two of five a reading reaches an end of its range at some time.
    """
    draw = random.Random(seed)
    edges = (1, 2, top // 2, top // 2 + 1, top - 2, top - 1)
    for start in range(0, samples, EPISODE):
        step = draw.choice((1, 3, 30, 300, top))
        readings = [draw.choice((*edges, draw.randint(1, top - 1))) for _ in ConverterCounts._fields]
        breaks = draw.randrange(EPISODE) if draw.random() < 0.4 else EPISODE
        for sample in range(min(EPISODE, samples - start)):
            if draw.random() < 0.02:
                readings[draw.randrange(3)] = draw.choice(edges)
            if draw.random() < 0.7:
                readings = [min(top - 1, max(1, value + draw.randint(-step, step))) for value in readings]
            sensed = list(readings)
            if sample == breaks:
                sensed[draw.randrange(3)] = draw.choice((0, top))
            yield ConverterCounts(*sensed)


def _printed_by_mspdebug(files: Mapping[str, bytes], drawn: list[ConverterCounts]) -> str:
    """Build a firmware, hand the samples to mspdebug in one batch, and return what it printed."""
    missing = missing_tools()
    if missing:
        raise SimulationError(
            f"the simulator of the processor needs {', '.join(missing)}; install the Debian packages make, clang, lld "
            "and mspdebug"
        )
    answer = "simio info counter\nmd simulated_outputs 4"
    lines = ["prog simulated.elf", f"fill {_RAM_START} {RAM} {_UNTOUCHED:x}", "simio add tracer counter"]
    lines.append("setbreak board_wait")
    for number, readings in enumerate(drawn):
        if number % EPISODE == 0:
            lines.append(f"reset\nrun\n{answer}")
        content = " ".join(f"0x{byte:02x}" for count in readings for byte in count.to_bytes(2, "little"))
        lines.append(f"mw simulated_readings {content}\nrun\n{answer}")
    lines += [f"md {_RAM_START} {RAM}", "prog firmware.elf", ""]
    with temporary_folder("ppafo-processor", files) as folder:
        build_firmware(Path(folder))
        write_file(Path(folder) / _COMMANDS, "\n".join(lines).encode("ascii"))
        return asked(["mspdebug", "-n", "-q", "sim", f"read {_COMMANDS}"], folder=folder).stdout


def missing_tools() -> tuple[str, ...]:
    """Return the tools for building and simulating that are not installed on this computer."""
    return tuple(tool for tool in _TOOLS if which(tool) is None)


def build_firmware(folder: Path, goal: str = "all") -> None:
    """Run make for a goal in a firmware folder. Raises SimulationError if it fails."""
    done = asked(["make", "-C", str(folder), goal], scratch=folder.absolute())
    if done.returncode != 0:
        # Make says which goal failed; the line of the compiler says why.
        cause = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr)
        raise SimulationError(f"the firmware cannot be built: {one_line(cause)}")


def _decisions(printed: str) -> tuple[list[tuple[int, int]], list[int]]:
    """Return command [steps] and validity flag of each sample in mspdebug's output, and the clock cycles it took."""
    found = []
    cycles = []
    before = 0
    for number, (total, outputs) in enumerate(_ANSWER.findall(printed)):
        # Each episode begins with the wait for its first sample.
        if number % (EPISODE + 1):
            content = bytes.fromhex(outputs)
            found.append((int.from_bytes(content[:2], "little", signed=True), int.from_bytes(content[2:], "little")))
            cycles.append(int(total) - before)
        before = int(total)
    return found, cycles
