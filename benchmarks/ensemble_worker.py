"""Child process that times lanes on the cores it is given: ``python -m benchmarks.ensemble_worker``.

The one argument is a JSON order, the answer is JSON on standard output. A process that stays on some cores cannot time
all of them, so each choice of cores needs a process of its own.
"""

import json
import os
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

from benchmarks.task import ensemble
from benchmarks.timing import time_in_turn
from ppafo.engine.lanes import Batch, Floats, run_batch
from ppafo.metrics import gas, switching, tracking
from ppafo.simulation.ensemble import MeteredRuns, OutputRequest


@dataclass(frozen=True, slots=True)
class Order:
    """What a worker is to do: runs, duration [s], cores to stay on, threads of the lanes to try."""

    runs: int
    duration: float
    repetitions: int
    cores: tuple[int, ...]
    threads: tuple[int, ...]

    def text(self) -> str:
        """The order as JSON."""
        return json.dumps(asdict(self))

    @staticmethod
    def read(text: str) -> "Order":
        """The order that ``text`` wrote."""
        plain = json.loads(text)
        return Order(
            runs=plain["runs"],
            duration=plain["duration"],
            repetitions=plain["repetitions"],
            cores=tuple(plain["cores"]),
            threads=tuple(plain["threads"]),
        )


def work(order: Order) -> dict[str, tuple[float, ...]]:
    """Durations [s] of the lanes by name, the first of which compiles nothing."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, order.cores)
    batch = ensemble(order.runs, order.duration)
    run_batch(batch)
    contenders: dict[str, Callable[[], object]] = {
        f"lanes {threads}": partial(run_batch, batch, threads) for threads in order.threads
    }
    contenders |= {f"lanes with metrics {threads}": metrics_of(batch, threads) for threads in order.threads}
    return {name: timing.seconds for name, timing in time_in_turn(contenders, order.repetitions).items()}


def metrics_of(batch: Batch, threads: int) -> Callable[[], dict[str, Floats]]:
    """A function that runs the batch with every metric of tracking, gas and switching, sampled at every step."""
    kinds = {kind.name: kind for kind in (*tracking.METRICS, *gas.METRICS, *switching.METRICS)}
    request = OutputRequest(kinds, (), 0.0, np.empty(0))
    sampled = replace(batch, clock=replace(batch.clock, record_every=1))
    runs = batch.states.shape[1]

    def run() -> dict[str, Floats]:
        outcome = MeteredRuns(runs, request)
        outcome.run_all([(np.arange(runs), sampled)], threads)
        return outcome.metrics

    run()
    return run


def main() -> int:
    """Read the order, write the answer."""
    sys.stdout.write(json.dumps(work(Order.read(sys.argv[1]))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
