"""Runs a function with many arguments in several processes, each with one thread for its linear algebra."""

import argparse
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any, TypeVar

Result = TypeVar("Result")


def add_processes(parser: argparse.ArgumentParser) -> None:
    """Add the option ``--processes``."""
    parser.add_argument("--processes", type=int, default=1, metavar="N", help="work in N processes; default 1")


def results_of(
    function: Callable[..., Result], arguments: Sequence[tuple[Any, ...]], processes: int
) -> Iterator[Result]:
    """Yield the results in the order of their arguments; what is done is counted on the standard error."""
    begun = time.monotonic()
    if processes == 1:
        pool, results = None, (function(*one) for one in arguments)
    else:
        # Read when the children load their linear algebra.
        for library in ("OMP", "OPENBLAS", "MKL"):
            os.environ[f"{library}_NUM_THREADS"] = "1"
        pool = ProcessPoolExecutor(processes, multiprocessing.get_context("spawn"))
        futures = [pool.submit(function, *one) for one in arguments]
        results = (one.result() for one in futures)
    try:
        for number, result in enumerate(results, start=1):
            print(f"{number} of {len(arguments)}, {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)
            yield result
    finally:
        if pool is not None:
            pool.shutdown(cancel_futures=True)
