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
from hashlib import sha256
from itertools import islice
from queue import SimpleQueue
from secrets import token_hex
from typing import Any, TypeVar

from ppafo.errors import Faults, PpafoError, StudyError, refused_as
from ppafo.plugins import name_modules_in, object_of
from ppafo.version import __version__
from ppafo.wording import one_line

_TRIALS = 3
"""Number of workers that may be lost with a block before it is given up."""
_IN_FLIGHT = 4096
"""Largest number of blocks that are submitted and not yet written: four for each of a thousand workers."""
_BETWEEN_LOOKS = 1.0
"""Time between two looks of a worker for its caller [s]."""
Block = TypeVar("Block")
Answer = TypeVar("Answer")


def executor_of(given: Executor | str | None) -> Executor | None:
    """Return an executor, the one that a word ``MODULE:OBJECT`` names, or the one that a named function makes."""
    found: Any = given
    if isinstance(given, str) and ":" in given:
        name_modules_in(given)
        place = f"executor = '{given}'"
        # A function of the user may raise anything.
        with refused_as(StudyError, f"{place}: calls sys.exit", SystemExit), refused_as(StudyError, place, Exception):
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

    Raises StudyError for a module that a worker lacks, for an executor without workers, for a block lost again and
    again, and for an answer to another submission. Before an executor that takes no more work is refused, the blocks
    that it has finished are yielded.
    """
    ended = SimpleQueue[Future[Any]]()
    lost = Counter[int]()
    waiting = {}
    faults = Faults()
    said = "executor: a class or function of the study cannot be sent to workers"
    with refused_as(StudyError, said, pickle.PicklingError, AttributeError, TypeError):
        sent = pickle.dumps(work)
    numbers = iter(range(len(blocks)))

    def submit(number: int) -> None:
        if faults:
            return
        # A mark for each submission: Dask merges equal calls, and would return the one that failed.
        mark = token_hex()
        # An executor of the user may raise anything.
        with faults, refused_as(StudyError, "executor: takes no more work, give a new one", Exception):
            future = executor.submit(_computed, sent, blocks[number], __version__, mark)
            future.add_done_callback(ended.put)
            waiting[future] = number, mark

    try:
        for number in islice(numbers, _IN_FLIGHT):
            submit(number)
        while waiting and not (faults and ended.empty()):
            future = ended.get()
            number, mark = waiting.pop(future)
            error = CancelledError("cancelled") if future.cancelled() else future.exception()
            if error is None:
                match future.result():
                    case (str(seal), bytes(content)) if seal == sha256(mark.encode() + content).hexdigest():
                        yield number, pickle.loads(content)
                    case foreign:
                        raise StudyError(
                            f"executor: answers block {number} with a {type(foreign).__name__} that is not its result"
                        )
                for following in islice(numbers, 1):
                    submit(following)
            elif isinstance(error, PpafoError):
                raise error
            else:
                lost[number] += 1
                if lost[number] == _TRIALS:
                    said = f"executor: block {number} was lost {_TRIALS} times: {type(error).__name__}"
                    raise StudyError(f"{said}: {one_line(error)}") from error
                submit(number)
        Faults(faults[:1]).raise_all()
    finally:
        for future in waiting:
            future.cancel()


def _computed(sent: bytes, block: Any, version: str, mark: str) -> tuple[str, bytes]:
    """Return the answer to a block as bytes, on a worker, behind their hash with the mark of the submission."""
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
    content = pickle.dumps(work(block))
    return sha256(mark.encode() + content).hexdigest(), content


@cache
def _end_with_caller() -> None:
    """Make the process of a worker that computes end with the one that started it: a pool's outlive a killed caller."""
    if (parent := multiprocessing.parent_process()) is not None:
        caller = os.getppid()

        def end() -> None:
            # Forked workers keep each other's pipes to the caller open, so the number of the parent is compared too.
            while parent.is_alive() and os.getppid() == caller:
                parent.join(_BETWEEN_LOOKS)
            os._exit(1)

        threading.Thread(target=end, daemon=True).start()
