"""``python -m benchmarks``: speed as ratios to other solvers, measured here and now."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.command import run_command
from benchmarks.telling import tell
from ppafo.cli.output import (
    EXIT_CHECK_FAILED,
    EXIT_GOOD,
    check_output,
    print_result,
    write_files,
)
from ppafo.documents.json_text import json_text

FILES = ("bench.txt", "bench.md", "bench.json")
COMMAND = "bench"
"""What the mark of a result folder calls it, also in folders that ``ppafo bench`` wrote."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("--quick", action="store_true", help="a small version, about a minute")
    parser.add_argument("--check", action="store_true", help="exit 1 where a target is not met")
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    parser.add_argument("--out", metavar="DIR", type=Path, help=f"also write {', '.join(FILES)} here")
    parser.set_defaults(command=COMMAND)


def main(words: Sequence[str] | None = None) -> int:
    """Return the exit code of the command with these words."""
    return run_command("benchmarks", "Measure speed against other solvers in the same run.", add_arguments, run, words)


def run(parsed: argparse.Namespace) -> int:
    """Measure, print and write; 1 where a target is not met and ``--check`` asks."""
    from benchmarks.study import FULL, QUICK, measure_speed

    check_output(parsed.out, COMMAND)
    report = measure_speed(QUICK if parsed.quick else FULL, tell)
    document = report.document()
    if parsed.out is not None:
        texts = (f"{report.text()}\n", report.markdown(), f"{json_text(document)}\n")
        write_files(parsed.out, {name: text.encode() for name, text in zip(FILES, texts, strict=True)}, COMMAND)
    print_result(report.text(), document, parsed.json)
    return EXIT_CHECK_FAILED if parsed.check and report.missed else EXIT_GOOD


if __name__ == "__main__":
    sys.exit(main())
