"""The same fixed-step model in JAX: the closed torque task of a held vane, for thousands of runs at once.

Scheme, flow polynomial, controller and float64 are those of the lanes. JAX gets what its users would give it: numbers
that all runs share are constants of the compiled program, the volumes of a held vane are worked out once, the state
is donated, runs can be taken in blocks that stay in the cache, and blocks are spread over the cores.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ppafo.engine.lanes import Batch, Floats
from ppafo.engine.scheme.pneumatics import GAMMA
from ppafo.studies.bench.task import named_rows, volumes_of

Array = Any
FLOW_TERMS = ("c0", "c1", "c2", "c3", "c4", "c5", "c6")


class Task(NamedTuple):
    """Parameters of the task: a number where all runs share it, an array over the runs where they differ."""

    per_mass_1: Array
    per_mass_2: Array
    torque_constant: Array
    supply_pressure: Array
    dorsiflexion_pressure: Array
    atmospheric_pressure: Array
    valve_conductance: Array
    leak_conductance: Array
    dead_band: Array
    proportional_gain: Array
    integral_gain: Array
    derivative_gain: Array
    derivative_filter: Array
    anti_windup: Array
    start_level: Array
    level: Array
    ramp_start: Array
    ramp_time: Array
    step: Array
    valve_curve: Array
    leak_curve: Array


class State(NamedTuple):
    """Gas [kg], memory of the controller and the command in force."""

    mass_1: Array
    mass_2: Array
    supplied_mass: Array
    vented_mass: Array
    leaked_mass: Array
    integral: Array
    error: Array
    slope: Array
    started: Array
    command: Array


class Curve(NamedTuple):
    """A fitted flow function: gaps 1 - r [-] at the critical and the linear ratio, and the polynomial's terms."""

    critical_gap: float
    linear_gap: float
    terms: tuple[float, ...]


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


def task_of(batch: Batch) -> Task:
    """The parameters of a batch; rows that are the same in all runs become numbers."""
    rows = named_rows(batch.program.parameter_rows(), batch.parameters)
    by_name = {path.rpartition(".")[2]: row for path, row in rows.items() if path.count(".") == 1}
    first, second = volumes_of(batch)
    by_name |= {
        "per_mass_1": by_name["gas_product"] / first,
        "per_mass_2": by_name["gas_product"] / second,
        "step": rows["timing.step"],
        "level": rows["reference.level"],
    }
    curves = {name: _curve(rows, f"plant.{name}") for name in ("valve_curve", "leak_curve")}
    shared = {name: _shared(by_name[name]) for name in Task._fields if name not in curves}
    return Task(**shared, **curves)


def state_of(batch: Batch, states: Floats) -> State:
    """States of a batch, copied."""
    rows = named_rows(batch.program.state_rows(), states)
    by_name = {path.rpartition(".")[2]: row for path, row in rows.items()}
    return State(*[np.array(by_name[name]) for name in State._fields])


def _shared(row: Floats) -> Floats | float:
    return float(row[0]) if np.all(row == row[0]) else np.array(row)


def _curve(rows: dict[str, Floats], path: str) -> Curve:
    ratios = [1.0 - float(rows[f"{path}.{name}"][0]) for name in ("critical_ratio", "linear_ratio")]
    return Curve(ratios[0], ratios[1], tuple(float(rows[f"{path}.{term}"][0]) for term in FLOW_TERMS))


def flow_function(ratio: Array, curve: Curve) -> Array:
    """Flow over choked flow [-]. Equations (6), (7)."""
    import jax.numpy as jnp

    gap = 1.0 - ratio
    inside = jnp.maximum(jnp.minimum(gap, curve.critical_gap), curve.linear_gap)
    polynomial = curve.terms[-1]
    for term in curve.terms[-2::-1]:
        polynomial = polynomial * inside + term
    return jnp.sqrt(inside) * polynomial * jnp.minimum(gap / curve.linear_gap, 1.0)


def flow_function_slope(ratio: Array, curve: Curve) -> tuple[Array, Array]:
    """As ``flow_function``, with its derivative [-]."""
    import jax.numpy as jnp

    gap = 1.0 - ratio
    inside = jnp.maximum(jnp.minimum(gap, curve.critical_gap), curve.linear_gap)
    polynomial = derivative = curve.terms[-1]
    for term in curve.terms[-2:0:-1]:
        polynomial = polynomial * inside + term
        derivative = derivative * inside + polynomial
    polynomial = polynomial * inside + curve.terms[0]
    root = jnp.sqrt(inside)
    value = root * polynomial
    curved = (0.5 * polynomial + inside * derivative) / root
    slope = jnp.where(gap < curve.linear_gap, value / curve.linear_gap, curved)
    slope = jnp.where(gap > curve.critical_gap, 0.0, slope)
    return value * jnp.minimum(gap / curve.linear_gap, 1.0), -slope


def flow(pressure_a: Array, pressure_b: Array, conductance: Array, curve: Curve) -> Array:
    """Mass flow from a to b [kg/s]."""
    import jax.numpy as jnp

    upstream = jnp.maximum(pressure_a, pressure_b)
    size = conductance * upstream * flow_function(jnp.minimum(pressure_a, pressure_b) / upstream, curve)
    return jnp.where(pressure_a >= pressure_b, size, -size)


def flow_slopes(pressure_a: Array, pressure_b: Array, conductance: Array, curve: Curve) -> tuple[Array, Array, Array]:
    """As ``flow``, with the derivatives with respect to both pressures [kg/(s Pa)]."""
    import jax.numpy as jnp

    forward = pressure_a >= pressure_b
    upstream = jnp.maximum(pressure_a, pressure_b)
    ratio = jnp.minimum(pressure_a, pressure_b) / upstream
    value, slope = flow_function_slope(ratio, curve)
    size = conductance * upstream * value
    by_upstream = conductance * (value - ratio * slope)
    by_downstream = conductance * slope
    return (
        jnp.where(forward, size, -size),
        jnp.where(forward, by_upstream, -by_downstream),
        jnp.where(forward, by_downstream, -by_upstream),
    )


def control(task: Task, state: State, time: Array) -> State:
    """The state with the controller's decision at ``time`` [s]. Equation (13)."""
    import jax.numpy as jnp

    torque = task.torque_constant * (state.mass_1 * task.per_mass_1 - state.mass_2 * task.per_mass_2)
    progress = jnp.clip((time - task.ramp_start) / task.ramp_time, 0.0, 1.0)
    error = task.start_level + (task.level - task.start_level) * progress - torque
    raw_slope = (error - state.error) / task.step * state.started
    slope = state.slope + task.step / (task.step + task.derivative_filter) * (raw_slope - state.slope)
    integral = state.integral + task.integral_gain * error * task.step
    wanted = task.proportional_gain * error + integral + task.derivative_gain * slope
    command = jnp.clip(wanted, -1.0, 1.0)
    integral = integral + task.anti_windup * task.step * (command - wanted)
    return state._replace(integral=integral, error=error, slope=slope, started=jnp.ones_like(error), command=command)


class Connection(NamedTuple):
    """Open area and the two nodes that a command joins to the chambers; the shares are 1 where that is the source."""

    conductance: Array
    node_1: Array
    node_2: Array
    share_1: Array
    share_2: Array


def connect(task: Task, command: Array) -> Connection:
    """Ports of a proportional valve. Equation (8)."""
    import jax.numpy as jnp

    size = jnp.maximum(jnp.minimum(jnp.abs(command), 1.0) - task.dead_band, 0.0) / (1.0 - task.dead_band)
    feeds_1 = command >= 0.0
    return Connection(
        size * task.valve_conductance,
        jnp.where(feeds_1, task.supply_pressure, task.atmospheric_pressure),
        jnp.where(feeds_1, task.atmospheric_pressure, task.dorsiflexion_pressure),
        jnp.where(feeds_1, 1.0, 0.0),
        jnp.where(feeds_1, 0.0, 1.0),
    )


def advance_gas(task: Task, state: State) -> State:
    """One step of the two-stage Rosenbrock method on both chambers and the totals. Equations (3), (6) to (9)."""
    import jax.numpy as jnp

    port = connect(task, state.command)
    step, weight = task.step, GAMMA * task.step
    pressure_1, pressure_2 = state.mass_1 * task.per_mass_1, state.mass_2 * task.per_mass_2
    in_1, _, slope_1 = flow_slopes(port.node_1, pressure_1, port.conductance, task.valve_curve)
    in_2, _, slope_2 = flow_slopes(port.node_2, pressure_2, port.conductance, task.valve_curve)
    leak, leak_by_1, leak_by_2 = flow_slopes(pressure_1, pressure_2, task.leak_conductance, task.leak_curve)
    a = 1.0 - weight * (slope_1 - leak_by_1) * task.per_mass_1
    b = weight * leak_by_2 * task.per_mass_2
    c = -weight * leak_by_1 * task.per_mass_1
    d = 1.0 - weight * (slope_2 + leak_by_2) * task.per_mass_2
    scale = 1.0 / (a * d - b * c)
    source_1, source_2 = slope_1 * port.share_1 * task.per_mass_1, slope_2 * port.share_2 * task.per_mass_2
    across_1, across_2 = leak_by_1 * task.per_mass_1, leak_by_2 * task.per_mass_2

    def stage(right_1: Array, right_2: Array, supplied: Array, leaked: Array) -> tuple[Array, Array, Array, Array]:
        rate_1 = (d * right_1 - b * right_2) * scale
        rate_2 = (a * right_2 - c * right_1) * scale
        supplied = supplied + weight * (source_1 * rate_1 + source_2 * rate_2)
        return rate_1, rate_2, supplied, leaked + weight * (across_1 * rate_1 + across_2 * rate_2)

    first = stage(in_1 - leak, in_2 + leak, in_1 * port.share_1 + in_2 * port.share_2, leak)
    end_1 = (state.mass_1 + step * first[0]) * task.per_mass_1
    end_2 = (state.mass_2 + step * first[1]) * task.per_mass_2
    in_1 = flow(port.node_1, end_1, port.conductance, task.valve_curve)
    in_2 = flow(port.node_2, end_2, port.conductance, task.valve_curve)
    leak = flow(end_1, end_2, task.leak_conductance, task.leak_curve)
    second = stage(
        in_1 - leak - 2.0 * first[0],
        in_2 + leak - 2.0 * first[1],
        in_1 * port.share_1 + in_2 * port.share_2 - 2.0 * first[2],
        leak - 2.0 * first[3],
    )
    change_1, change_2, supplied, leaked = (
        step * (1.5 * one + 0.5 * two) for one, two in zip(first, second, strict=True)
    )
    return state._replace(
        mass_1=state.mass_1 + change_1,
        mass_2=state.mass_2 + change_2,
        supplied_mass=state.supplied_mass + supplied,
        vented_mass=state.vented_mass + supplied - change_1 - change_2,
        leaked_mass=state.leaked_mass + jnp.abs(leaked),
    )


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
