"""``ppafo bench``: speed as ratios to other solvers, measured here and now."""

import argparse
import sys
from pathlib import Path

from ppafo.cli.output import print_result, write_files

EXIT_GOOD = 0
EXIT_CHECK_FAILED = 1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("--quick", action="store_true", help="a small version, about a minute")
    parser.add_argument("--check", action="store_true", help="exit 1 where a target is not met")
    parser.add_argument("--json", action="store_true", help="print one JSON document instead of text")
    parser.add_argument("--out", metavar="DIR", type=Path, help="also write bench.txt, bench.md and bench.json here")


def run(parsed: argparse.Namespace) -> int:
    """Measure, print and write; 1 where a target is not met and ``--check`` asks."""
    import json

    from ppafo.studies.bench import FULL, QUICK, measure_speed

    if parsed.out is not None:
        write_files(parsed.out, {})
    report = measure_speed(QUICK if parsed.quick else FULL, _say)
    document = report.document()
    if parsed.out is not None:
        encoded = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
        files = {"bench.txt": report.text() + "\n", "bench.md": report.markdown(), "bench.json": encoded}
        write_files(parsed.out, files)
    print_result(report.text(), document, parsed.json)
    return EXIT_CHECK_FAILED if parsed.check and report.missed else EXIT_GOOD


def _say(message: str) -> None:
    print(f"ppafo bench: {message} ...", file=sys.stderr, flush=True)
