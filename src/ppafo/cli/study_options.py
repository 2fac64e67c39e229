"""Options that the analyses of studies share, and their progress on the side."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ppafo.cli.arguments import UsageError
from ppafo.cli.output import add_output_arguments, add_override_argument
from ppafo.cli.whole_numbers import share, whole_number

if TYPE_CHECKING:
    from ppafo.studies.sweep.progress import ProgressLine


def add_study_options(parser: argparse.ArgumentParser) -> None:
    """Add what every analysis takes: overrides, seed, threads, confidence, allowed failures, output."""
    add_override_argument(parser)
    parser.add_argument("--seed", metavar="N", help="of the draws; that of the study unless given")
    parser.add_argument("--threads", metavar="N", help="threads; all cores unless given")
    parser.add_argument("--confidence", metavar="SHARE", help="of all intervals; 95%% unless given")
    parser.add_argument("--most-failed", metavar="SHARE", help="of the runs that may fail before it is refused")
    add_output_arguments(parser)


def seed(parsed: argparse.Namespace) -> int | None:
    """Return the seed, None where none was given."""
    return whole_number(parsed.seed, "--seed")


def threads(parsed: argparse.Namespace) -> int | None:
    """Return the number of threads, None for all cores."""
    number = whole_number(parsed.threads, "--threads")
    if number == 0:
        raise UsageError("--threads 0: must be 1 or more")
    return number


def confidence(parsed: argparse.Namespace, usual: float = 0.95) -> float:
    """Return the confidence of intervals."""
    found = share(parsed.confidence, "--confidence")
    return usual if found is None else found


def most_failed(parsed: argparse.Namespace, usual: float) -> float:
    """Return the share of runs that may fail."""
    found = share(parsed.most_failed, "--most-failed")
    return usual if found is None else found


@contextmanager
def progress() -> "Iterator[ProgressLine]":
    """Show progress on the side for the length of a ``with`` block."""
    from ppafo.studies.sweep.progress import ProgressLine

    line = ProgressLine(sys.stderr)
    try:
        yield line
    finally:
        line.close()
