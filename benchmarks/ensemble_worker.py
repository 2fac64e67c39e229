"""Child process that times lanes and JAX on the cores it is given: ``python -m benchmarks.ensemble_worker``.

The one argument is a JSON order, the answer is JSON on standard output. JAX reads its flags when it is imported and
starts its threads then, so each choice of flags and cores needs a process of its own.
"""

import json
import os
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from benchmarks.jax_model import State, state_of, task_of
from benchmarks.jax_program import Variant, compile_model, differing_parameters
from benchmarks.task import ensemble
from benchmarks.timing import Contender, time_in_turn, time_once
from ppafo.engine.lanes import Batch, Floats, run_batch
from ppafo.metrics import gas, switching, tracking
from ppafo.simulation.ensemble.running import Outcome, Request

FINALISTS = 2
COMPARED = ("mass_1", "mass_2", "supplied_mass", "vented_mass", "leaked_mass", "integral", "error", "command")


@dataclass(frozen=True, slots=True)
class Order:
    """What a worker is to do: runs, duration [s], cores to stay on, threads of the lanes to try, variants of JAX."""

    runs: int
    duration: float
    repetitions: int
    cores: tuple[int, ...]
    threads: tuple[int, ...]
    variants: tuple[Variant, ...]

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
            variants=tuple(Variant(**variant) for variant in plain["variants"]),
        )


class JaxEnsemble:
    """One compiled variant with its inputs on the device."""

    def __init__(self, batch: Batch, variant: Variant) -> None:
        import jax

        jax.config.update("jax_enable_x64", True)
        task = task_of(batch)
        self._initial = state_of(batch, batch.states)
        self._differing = differing_parameters(task)
        self._compiled = compile_model(task, batch.clock.step_count, variant)
        self._next = self._fresh()

    def run(self) -> State:
        """Final states; the initial ones, which are used up, were put on the device before."""
        import jax

        final: State = jax.block_until_ready(self._compiled(self._differing, self._next))
        return final

    def prepare(self) -> None:
        """Put new initial states on the device."""
        self._next = self._fresh()

    def _fresh(self) -> State:
        import jax
        import jax.numpy as jnp

        ready: State = jax.block_until_ready(jax.tree.map(jnp.array, self._initial))
        return ready


def largest_difference(batch: Batch, lanes: Floats, final: State) -> float:
    """Largest difference between lanes and JAX over the size of the same number in the ensemble [-]."""
    ours = state_of(batch, lanes)
    pairs = [(getattr(ours, name), np.asarray(getattr(final, name))) for name in COMPARED]
    return max(float(np.abs(one - other).max() / np.abs(one).max()) for one, other in pairs)


def work(order: Order) -> dict[str, Any]:
    """Durations [s] of lanes and JAX, and how far their numbers are apart."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, order.cores)
    batch = ensemble(order.runs, order.duration)
    lanes = run_batch(batch).states
    contenders = {f"lanes {threads}": Contender(partial(run_batch, batch, threads)) for threads in order.threads}
    contenders |= {f"lanes with metrics {threads}": Contender(metrics_of(batch, threads)) for threads in order.threads}
    difference = None
    if order.variants and find_spec("jax") is not None:
        models = {variant.name: JaxEnsemble(batch, variant) for variant in order.variants}
        difference = max(largest_difference(batch, lanes, model.run()) for model in models.values())
        contenders |= _finalists(models)
    timings = time_in_turn(contenders, order.repetitions)
    return {"seconds": {name: timing.seconds for name, timing in timings.items()}, "difference": difference}


def metrics_of(batch: Batch, threads: int) -> Callable[[], dict[str, Floats]]:
    """A function that runs the batch with every metric of tracking, gas and switching, sampled at every step."""
    kinds = {kind.name: kind for kind in (*tracking.METRICS, *gas.METRICS, *switching.METRICS)}
    request = Request(kinds, (), 0.0, np.empty(0))
    sampled = replace(batch, clock=replace(batch.clock, record_every=1))
    runs = batch.states.shape[1]

    def run() -> dict[str, Floats]:
        outcome = Outcome(runs, request)
        outcome.run(sampled, np.arange(runs), threads)
        return outcome.metrics

    run()
    return run


def _finalists(models: dict[str, JaxEnsemble]) -> dict[str, Contender]:
    """The variants that are quickest in one heat."""
    contenders = {name: Contender(model.run, model.prepare) for name, model in models.items()}
    heat = {name: time_once(contender) for name, contender in contenders.items()}
    chosen = sorted(heat, key=lambda name: heat[name])[:FINALISTS]
    return {name: contenders[name] for name in chosen}


def main() -> int:
    """Read the order, write the answer."""
    sys.stdout.write(json.dumps(work(Order.read(sys.argv[1]))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
