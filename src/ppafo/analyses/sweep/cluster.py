"""The chunks of a study computed on a cluster."""

import asyncio
from collections.abc import Callable, Iterable
from importlib import import_module
from typing import Any
from uuid import uuid4

from ppafo.errors import PpafoError, StudyError, one_line
from ppafo.study.store import Finished, Task, work_on_chunk

_TASKS_PER_THREAD = 3
"""Tasks that wait at the scheduler for every thread of the workers: enough to keep them busy, few for 10^9 runs."""
_SECONDS_TO_CONNECT = 30


def compute_on_cluster(address: str, task: Task, numbers: Iterable[int], finish: Callable[[Finished], None]) -> None:
    """Compute chunks on the workers of the scheduler at an address; ``finish`` hears of each one.

    A chunk whose worker dies is given to another one by the scheduler.
    """
    try:
        distributed: Any = import_module("distributed")
    except ModuleNotFoundError as error:
        raise StudyError("--scheduler needs the extra 'cluster': pip install 'ppafo[cluster]'") from error
    try:
        # A client that did not connect complains once more when it is collected: whether one can is tried before.
        asyncio.run(_reach(address, distributed))
        client = distributed.Client(address, timeout=_SECONDS_TO_CONNECT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise StudyError(f"--scheduler {address}: cannot be reached: {one_line(error)}") from error
    with client:
        queue, left = distributed.as_completed(loop=client.loop), iter(numbers)
        # Keys of this session alone: a scheduler answers an equal key with what an earlier task returned.
        sweep = f"{task.study.name}-{uuid4().hex[:8]}"

        def submit(count: int) -> None:
            for _, number in zip(range(count), left, strict=False):
                queue.add(client.submit(work_on_chunk, task, number, key=f"{sweep}-{number}", pure=False))

        submit(max(4, _TASKS_PER_THREAD * sum(client.nthreads().values())))
        for future in queue:
            try:
                finished: Finished = future.result()
            except PpafoError:
                raise
            except distributed.scheduler.KilledWorker as error:
                raise StudyError(f"chunk {future.key}: its workers died repeatedly: {one_line(error)}") from error
            future.release()
            finish(finished)
            submit(1)


async def _reach(address: str, distributed: Any) -> None:
    """Connect to a scheduler once; OSError or ValueError where that fails."""
    secured = distributed.Security().get_connection_args("client")
    (await distributed.comm.connect(address, timeout=_SECONDS_TO_CONNECT, **secured)).abort()
