"""How the loop over the steps is given to XLA: all runs at once or in blocks, on one device or on several."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.jax_model import Array, State, Task, advance_gas, control


@dataclass(frozen=True, slots=True)
class Variant:
    """How the loop is given to XLA: runs in a block (0: all at once), steps unrolled, devices to spread over."""

    block: int
    unroll: int
    devices: int

    @property
    def name(self) -> str:
        """A few words for the table."""
        blocks = f"blocks of {self.block}" if self.block else "one block"
        return f"{blocks}, unroll {self.unroll}, {self.devices} XLA device{'s' if self.devices > 1 else ''}"


def compile_model(task: Task, step_count: int, variant: Variant) -> Callable[[dict[str, Array], State], State]:
    """A compiled function from the differing parameters and the initial states to the final states."""
    import jax
    import jax.numpy as jnp

    constants = {name: value for name, value in task._asdict().items() if not isinstance(value, np.ndarray)}

    def one_run(differing: dict[str, Array], state: State) -> State:
        own = Task(**constants, **differing)

        def one_step(carried: State, index: Array) -> tuple[State, None]:
            return advance_gas(own, control(own, carried, index * own.step)), None

        steps = jnp.arange(step_count, dtype=jnp.float64)
        final: State = jax.lax.scan(one_step, state, steps, unroll=variant.unroll)[0]
        return final

    blocks = _in_blocks(jax.vmap(one_run), variant.block)
    return _on_devices(blocks, variant.devices)


def _in_blocks(run_all: Callable[..., State], block: int) -> Callable[..., State]:
    """``run_all``, called for ``block`` runs after the other; for all at once where that is 0."""
    import jax

    if block == 0:
        return run_all

    def run(differing: dict[str, Array], state: State) -> State:
        cut = jax.tree.map(lambda values: values.reshape(-1, block), (differing, state))
        done = jax.lax.map(lambda part: run_all(*part), cut)
        joined: State = jax.tree.map(lambda values: values.reshape(-1), done)
        return joined

    return run


def _on_devices(run_all: Callable[..., State], devices: int) -> Callable[..., State]:
    """``run_all`` compiled, with the runs spread over XLA devices."""
    import jax
    from jax.sharding import Mesh, PartitionSpec

    if devices > 1:
        mesh = Mesh(np.array(jax.devices()[:devices]), ("runs",))
        spec = PartitionSpec("runs")
        run_all = _shard_map()(run_all, mesh=mesh, in_specs=(spec, spec), out_specs=spec)
    compiled: Callable[..., State] = jax.jit(run_all, donate_argnums=1)
    return compiled


def _shard_map() -> Callable[..., Any]:
    import jax

    if hasattr(jax, "shard_map"):
        mapper: Callable[..., Any] = jax.shard_map
        return mapper
    from jax.experimental.shard_map import shard_map

    older: Callable[..., Any] = shard_map
    return older


def differing_parameters(task: Task) -> dict[str, Array]:
    """The parameters that differ between the runs, as arrays on the device."""
    import jax.numpy as jnp

    return {name: jnp.asarray(value) for name, value in task._asdict().items() if isinstance(value, np.ndarray)}
