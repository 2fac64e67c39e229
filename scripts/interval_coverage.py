"""Counts how often intervals of a trajectory fit hold under ten kinds of noise; resumes after a stop.

    python scripts/interval_coverage.py --draws 44 --seed 2026 --out out/coverage

Finished fits are kept line by line in the folder, so that the same command resumes, also in a folder that
``ppafo coverage`` began when it was a command of the package. One that other code began is not continued. Exit code 1
where a cell of the table is outside of what it should be.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

if not __package__:
    # The first place is this folder, in which this file would pass for the package of the same name.
    sys.path[0] = str(Path(__file__).parents[1])

from benchmarks.command import run_command
from ppafo.cli.arguments import counting_number, whole_number
from ppafo.cli.output import (
    EXIT_CHECK_FAILED,
    EXIT_GOOD,
    EXIT_INTERRUPTED,
    add_output_arguments,
    check_output,
    print_result,
    tell,
    write_files,
)

COMMAND = "coverage"
"""What the mark of a result folder calls it."""
FITS, FIGURE = "fits-{truths}-{seed}.jsonl", "ranks"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("--noise", metavar="KIND", action="append", help="kind of noise; default: all ten")
    parser.add_argument(
        "--draws", type=whole_number, default=200, metavar="N", help="fits for each kind of noise; default 200"
    )
    parser.add_argument(
        "--from-prior",
        action="store_true",
        help="draw the truth of each fit from the prior that it is given (simulation-based calibration)",
    )
    parser.add_argument(
        "--seed", type=whole_number, default=2026, metavar="N", help="random seed of truths and noise; default 2026"
    )
    parser.add_argument("--threads", type=counting_number, metavar="N", help="number of processes; default: all cores")
    add_output_arguments(parser)
    parser.set_defaults(command=COMMAND)


def main(words: Sequence[str] | None = None) -> int:
    """Return the exit code of the command with these words."""
    summary = "How often the intervals of a trajectory fit hold, under ten kinds of noise."
    return run_command("coverage", summary, add_arguments, run, words)


def run(parsed: argparse.Namespace) -> int:
    """Fit, count and print; 1 where a cell of the table is outside of what it should be."""
    from benchmarks.intervals.calibration import run_tasks, tasks_of
    from benchmarks.intervals.noise_kinds import NOISE_KINDS
    from benchmarks.intervals.report import coverage_document, coverage_text, is_good, ranks_figure
    from ppafo.documents.json_text import json_text

    draws, seed, processes = parsed.draws, parsed.seed, parsed.threads
    fits = FITS.format(truths="drawn" if parsed.from_prior else "fixed", seed=seed)
    tasks = tasks_of(parsed.noise or tuple(NOISE_KINDS), draws, seed, parsed.from_prior)
    check_output(parsed.out, COMMAND, _files_to_keep(parsed.out) if parsed.out is not None else None)
    if parsed.out is not None:
        # The folder is marked as ours before the first fit is kept in it.
        write_files(parsed.out, {fits: b""} | _files_to_keep(parsed.out), COMMAND)
    file = None if parsed.out is None else parsed.out / fits
    try:
        lines = run_tasks(tasks, file, processes or os.cpu_count() or 1, tell, _warn)
    except KeyboardInterrupt:
        print("\ncoverage: interrupted; with --out finished fits are kept: run the same command again", file=sys.stderr)
        return EXIT_INTERRUPTED
    text, document = coverage_text(lines, parsed.from_prior), coverage_document(lines, parsed.from_prior)
    if parsed.out is not None:
        from ppafo.answers.drawing import load_drawing

        load_drawing()
        from ppafo.answers.style import render_figure

        figures = render_figure(ranks_figure(lines), ("png", "svg"))
        contents = {f"{FIGURE}.{ending}": content for ending, content in figures.items()}
        contents |= {"coverage.txt": f"{text}\n".encode(), "coverage.json": f"{json_text(document)}\n".encode()}
        write_files(parsed.out, contents | _files_to_keep(parsed.out), COMMAND)
    print_result(text, document, parsed.json)
    return EXIT_GOOD if is_good(lines, parsed.from_prior) else EXIT_CHECK_FAILED


def _warn(text: str) -> None:
    print(f"{COMMAND}: {text}", file=sys.stderr)


def _files_to_keep(folder: Path) -> dict[str, bytes]:
    """Return the finished fits in a folder by file, of this and of other seeds, which all resume from there."""
    return {path.name: path.read_bytes() for path in sorted(folder.glob(FITS.format(truths="*", seed="*")))}


if __name__ == "__main__":
    sys.exit(main())
