"""The table of the benchmark: on which machine, what was measured, against which target, met or not."""

import os
import platform
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from ppafo.translation.native import described_processor

PACKAGES = ("ppafo", "numpy", "scipy", "scikit-sundae")


@dataclass(frozen=True, slots=True)
class Machine:
    """Processor, cores that this process may use, width of its vectors, and versions (None: not installed)."""

    processor: str
    system: str
    cores: int
    has_avx512: bool
    python: str
    packages: dict[str, str | None]


def usable_cores() -> tuple[int, ...]:
    """Numbers of the cores that this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return tuple(sorted(os.sched_getaffinity(0)))
    return tuple(range(os.cpu_count() or 1))


def describe_machine() -> Machine:
    """Facts about this computer and the installed packages."""
    return Machine(
        processor=_processor(),
        system=f"{platform.system()} {platform.machine()}",
        cores=len(usable_cores()),
        has_avx512=has_avx512(),
        python=platform.python_version(),
        packages={name: _version(name) for name in PACKAGES},
    )


def has_avx512() -> bool:
    """True where the compiler may use vectors of eight doubles."""
    return "avx512f" in described_processor().split()


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


SCHEMA_VERSION = 1
HEADINGS = ("what", "value", "spread", "target", "met")
MISSING_EXTRA = "not measured: pip install scikit-sundae"


@dataclass(frozen=True, slots=True)
class Target:
    """A limit that a value is to reach from below, or to stay under."""

    limit: float
    at_least: bool

    def is_met(self, value: float) -> bool:
        """True where ``value`` is on the right side of the limit."""
        return value >= self.limit if self.at_least else value < self.limit


@dataclass(frozen=True, slots=True)
class Line:
    """One measured number; ``value`` None where it could not be measured, and then ``note`` says why.

    ``spread`` holds the same number from the worst and the best repetition.
    """

    id: str
    group: str
    what: str
    value: float | None
    unit: str
    target: Target | None = None
    spread: tuple[float, float] | None = None
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None without a target or without a value."""
        if self.target is None or self.value is None:
            return None
        return self.target.is_met(self.value)


@dataclass(frozen=True, slots=True)
class BenchReport:
    """All lines of one benchmark, with the machine and the size of what was run."""

    machine: Machine
    size: dict[str, Any]
    lines: tuple[Line, ...]

    @property
    def missed(self) -> tuple[Line, ...]:
        """Lines whose target was measured and not met."""
        return tuple(line for line in self.lines if line.met is False)

    def document(self) -> dict[str, Any]:
        """The report as plain values for JSON."""
        verdicts = [line.met for line in self.lines if line.target is not None]
        return {
            "schema_version": SCHEMA_VERSION,
            "machine": asdict(self.machine),
            "size": self.size,
            "targets": {
                "met": verdicts.count(True),
                "missed": verdicts.count(False),
                "not_measured": verdicts.count(None),
            },
            "lines": [asdict(line) | {"met": line.met} for line in self.lines],
        }

    def text(self) -> str:
        """The report for a terminal."""
        blocks = [machine_text(self.machine)]
        for group, rows in _groups(self.lines).items():
            blocks.append("\n".join([group, *_aligned([HEADINGS, *(_cells(line) for line in rows)]), *_notes(rows)]))
        return "\n\n".join([*blocks, self._summary()])

    def markdown(self) -> str:
        """The report as Markdown."""
        blocks = ["# Speed", machine_text(self.machine)]
        for group, rows in _groups(self.lines).items():
            table = [_row(HEADINGS), "|---|---:|---:|---:|---|", *(_row(_cells(line)) for line in rows)]
            blocks += [f"## {group}", "\n".join(table), "\n".join(f"-{note[1:]}" for note in _notes(rows))]
        return "\n\n".join(block for block in [*blocks, self._summary()] if block) + "\n"

    def _summary(self) -> str:
        counts = self.document()["targets"]
        return f"targets: {counts['met']} met, {counts['missed']} missed, {counts['not_measured']} not measured"


def machine_text(machine: Machine) -> str:
    """One paragraph about the machine."""
    versions = ", ".join(f"{name} {version or 'not installed'}" for name, version in machine.packages.items())
    vectors = "AVX-512" if machine.has_avx512 else "no AVX-512"
    return (
        f"{machine.processor}, {machine.cores} cores, {vectors}, {machine.system}; "
        f"Python {machine.python}, {versions}. Best of all repetitions; spread: worst to best."
    )


def number_text(value: float) -> str:
    """A number with three significant digits, thousands apart."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e3:
        return f"{value:.3g}"
    return f"{value:.1e}" if abs(value) < 1e-3 else f"{float(f'{value:.3g}'):,.0f}"


def _groups(lines: Sequence[Line]) -> dict[str, list[Line]]:
    groups: dict[str, list[Line]] = {}
    for line in lines:
        groups.setdefault(line.group, []).append(line)
    return groups


def _cells(line: Line) -> tuple[str, ...]:
    unit = f" {line.unit}" if line.unit else ""
    value = "-" if line.value is None else number_text(line.value) + unit
    spread = "" if line.spread is None else f"{number_text(line.spread[0])} to {number_text(line.spread[1])}"
    target = "" if line.target is None else f"{'>=' if line.target.at_least else '<'} {number_text(line.target.limit)}"
    verdict = {True: "yes", False: "NO", None: ""}[line.met]
    return line.what, value, spread, target, verdict if line.value is not None else line.note


def _notes(rows: Sequence[Line]) -> list[str]:
    return [f"  {line.what}: {line.note}" for line in rows if line.note and line.value is not None]


def _aligned(rows: Sequence[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]) - 1)]
    lines = []
    for row in rows:
        middle = [cell.rjust(width) for cell, width in zip(row[1:-1], widths[1:], strict=True)]
        lines.append("  ".join(["", row[0].ljust(widths[0]), *middle, row[-1]]).rstrip())
    return lines


def _row(cells: tuple[str, ...]) -> str:
    return f"| {' | '.join(cells)} |"
