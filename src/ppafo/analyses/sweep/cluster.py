"""The chunks of a study computed by the workers of a Dask scheduler, which may be anywhere on a network."""

import asyncio
import socket
from collections.abc import Callable, Iterable
from concurrent.futures import CancelledError
from importlib import import_module
from itertools import islice
from typing import Any
from uuid import uuid4

from ppafo.errors import StudyError
from ppafo.storage.places import place_at
from ppafo.study.blocks import chunk_count
from ppafo.study.store import ChunkTask, FinishedChunk, note_file, work_on_chunk
from ppafo.wording import one_line, reason

_TASKS_PER_THREAD = 3
"""Tasks that wait at the scheduler for every thread of the workers: enough to keep them busy, few for 10^9 runs."""
_FEWEST_TASKS = 4
"""Tasks that wait there before the first worker has come."""
_SECONDS_TO_ANSWER = 5
"""Time limit for a computer to accept a connection [s]."""
_SECONDS_TO_CONNECT = 30
"""Time limit for a scheduler to greet a client [s]."""
_OVER_SOCKETS = ("tcp://", "tls://", "ws://", "wss://")
"""Beginnings of addresses behind which something must listen; an address without any is one of TCP."""


def check_scheduler(address: str) -> None:
    """Connect to the scheduler at an address once; StudyError where there is none, or no library for it."""
    distributed = _library()
    try:
        # The library tries for half a minute, also where the other computer says at once that nothing listens.
        if "://" not in address or address.startswith(_OVER_SOCKETS):
            host_and_port = distributed.comm.get_address_host_port(address)
            socket.create_connection(host_and_port, timeout=_SECONDS_TO_ANSWER).close()
        asyncio.run(_reach(address, distributed))
    except (OSError, ValueError, TimeoutError) as error:
        raise _unreachable(address, error) from error


def compute_on_cluster(
    address: str, task: ChunkTask, numbers: Iterable[int], finish: Callable[[FinishedChunk], None]
) -> None:
    """Compute the chunks of these numbers on the workers of the scheduler at an address; ``finish`` hears of each one.

    They finish in any order. A chunk whose worker dies is given to another one by the scheduler. StudyError where the
    scheduler itself is lost.
    """
    # A client that did not connect complains once more when it is collected: whether it can connect is tried before.
    check_scheduler(address)
    distributed = _library()
    try:
        client = distributed.Client(address, timeout=_SECONDS_TO_CONNECT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise _unreachable(address, error) from error
    try:
        with client:
            _compute(client, distributed, task, numbers, finish)
    except (CancelledError, OSError) as error:
        names, count = place_at(task.address).names(), chunk_count(task.study)
        kept = sum(note_file(number) in names for number in range(count))
        raise StudyError(
            f"--scheduler {address}: the connection was lost; {kept} of {count} chunks are finished and kept in "
            f"{task.address}: start a scheduler and run the same command again, which resumes the study"
        ) from error


def _compute(
    client: Any, distributed: Any, task: ChunkTask, numbers: Iterable[int], finish: Callable[[FinishedChunk], None]
) -> None:
    """Keep some chunks waiting at the scheduler, one more for each that is finished, until all are.

    StudyError for a chunk on which workers die; what is wrong with the study itself is raised as it was there.
    """
    futures, remaining = distributed.as_completed(loop=client.loop), iter(numbers)
    # Keys of this session alone: a scheduler answers an equal key with what an earlier task returned.
    session = f"{task.study.name}-{uuid4().hex[:8]}"

    def submit(count: int) -> None:
        for number in islice(remaining, count):
            futures.add(client.submit(work_on_chunk, task, number, key=f"{session}-{number}", pure=False))

    submit(max(_FEWEST_TASKS, _TASKS_PER_THREAD * sum(client.nthreads().values())))
    for future in futures:
        try:
            finished: FinishedChunk = future.result()
        except distributed.scheduler.KilledWorker as error:
            raise StudyError(
                f"chunk {future.key}: its workers died repeatedly: {one_line(error)}; give workers "
                f"more memory and run the same command again, which resumes the study"
            ) from error
        future.release()
        finish(finished)
        submit(1)


def _library() -> Any:
    """Return the module ``distributed``; StudyError, with the line that installs it, where it is not installed."""
    try:
        return import_module("distributed")
    except ModuleNotFoundError as error:
        raise StudyError("--scheduler needs the extra 'cluster': pip install 'ppafo[cluster]'") from error


def _unreachable(address: str, error: Exception) -> StudyError:
    said = reason(error) if isinstance(error, OSError) else error
    return StudyError(f"--scheduler {address}: cannot be reached: {one_line(said)}")


async def _reach(address: str, distributed: Any) -> None:
    """Connect to a scheduler once; OSError or ValueError where that fails."""
    secured = distributed.Security().get_connection_args("client")
    (await distributed.comm.connect(address, timeout=_SECONDS_TO_CONNECT, **secured)).abort()
