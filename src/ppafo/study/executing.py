"""Blocks of runs on the workers of an executor of ``concurrent.futures``: processes, a cluster of Dask, MPI, Parsl.

The caller alone writes what workers compute, so that a study resumes and reports as on one computer. A worker loads the
program that a process of its computer compiled.
"""

import multiprocessing
import os
import pickle
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, Future
from functools import cache
from itertools import islice
from queue import SimpleQueue
from secrets import token_hex
from typing import Any, TypeVar

from ppafo.errors import PpafoError, StudyError, refused_as
from ppafo.plugins import name_modules_in, object_of
from ppafo.version import __version__

_TRIALS = 3
"""Number of workers that may be lost with a block before it is given up."""
_IN_FLIGHT = 4096
"""Largest number of blocks that are submitted and not yet written: four for each of a thousand workers."""
Block = TypeVar("Block")
Answer = TypeVar("Answer")


def executor_of(given: Executor | str | None) -> Executor | None:
    """Return an executor, the one that a word ``MODULE:OBJECT`` names, or the one that a named function makes."""
    found: Any = given
    if isinstance(given, str) and ":" in given:
        name_modules_in(given)
        # A function of the user may raise anything.
        with refused_as(StudyError, f"executor = '{given}'", Exception):
            found = object_of(given)
            found = found() if callable(found) and not isinstance(found, Executor) else found
    executor: Executor | None = found
    if given is None or isinstance(found, Executor):
        return executor
    raise StudyError(
        f"executor = {given!r}: must be an Executor of concurrent.futures such as Client(...).get_executor() of Dask, "
        "or the MODULE:OBJECT of one, or of a function that returns one"
    )


def computed_by(
    executor: Executor, work: Callable[[Block], Answer], blocks: Sequence[Block]
) -> Iterator[tuple[int, Answer]]:
    """Yield number and answer of each block, in the order in which workers end; a lost block is submitted again.

    Raises StudyError for a module that a worker lacks, for an executor without workers, and for a block lost again and
    again.
    """
    ended, lost = SimpleQueue[Future[Answer]](), Counter[int]()
    said = "executor: a class or function of the study cannot be sent to workers"
    with refused_as(StudyError, said, pickle.PicklingError, AttributeError, TypeError):
        sent = pickle.dumps(work)
    waiting: dict[Future[Answer], int] = {}
    numbers = iter(range(len(blocks)))

    def submit(number: int) -> None:
        try:
            # With a mark of its own, as Dask takes equal calls for one, which may be the one that failed.
            future = executor.submit(_computed, sent, blocks[number], __version__, token_hex())
        except RuntimeError as error:  # it was shut down, or a process of it was killed
            raise StudyError(f"executor: takes no more work ({error}); give a new one") from error
        waiting[future] = number
        future.add_done_callback(ended.put)

    try:
        for number in islice(numbers, _IN_FLIGHT):
            submit(number)
        while waiting:
            future = ended.get()
            number = waiting.pop(future)
            error = CancelledError("cancelled") if future.cancelled() else future.exception()
            if error is None:
                yield number, future.result()
                for following in islice(numbers, 1):
                    submit(following)
            elif isinstance(error, PpafoError):
                raise error
            else:
                lost[number] += 1
                if lost[number] == _TRIALS:
                    said = f"executor: block {number} was lost {_TRIALS} times: {type(error).__name__}: {error}"
                    raise StudyError(said) from error
                submit(number)
    finally:
        for future in waiting:
            future.cancel()


def _computed(sent: bytes, block: Any, version: str, _mark: str) -> Any:
    """Return the answer to a block, on a worker."""
    _end_with_caller()
    if version != __version__:
        raise StudyError(f"executor: a worker has ppafo {__version__}, not {version}; install the same version there")
    try:
        # Anew for each block: a worker may have several threads, and a Python controller one state.
        work = pickle.loads(sent)
    except (ImportError, AttributeError) as error:
        raise StudyError(
            f"executor: a worker cannot load the study: {error}; install this module there, or send it by means of the "
            "executor, such as upload_file of Dask's Client"
        ) from error
    return work(block)


@cache
def _end_with_caller() -> None:
    """Make the process of a worker that computes end with the one that started it: a pool's outlive a killed caller."""
    if (parent := multiprocessing.parent_process()) is not None:

        def end() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=end, daemon=True).start()
