"""The same fixed-step model in JAX: the closed torque task of a held vane, for thousands of runs at once.

Scheme, flow polynomial, controller and float64 are those of the lanes. JAX gets what its users would give it: numbers
that all runs share are constants of the compiled program, the volumes of a held vane are worked out once, the state
is donated, runs can be taken in blocks that stay in the cache, and blocks are spread over the cores.
"""

from typing import Any, NamedTuple

import numpy as np

from benchmarks.task import named_rows, volumes_of
from ppafo.engine.lanes import Batch, Floats
from ppafo.engine.scheme.pneumatics import GAMMA
from ppafo.model.orifice import TERMS

Array = Any


class Curve(NamedTuple):
    """A fitted flow function: gaps 1 - r [-] at the critical and the linear ratio, and the polynomial's terms."""

    critical_gap: float
    linear_gap: float
    terms: tuple[float, ...]


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
    """As ``flow_function``, with the slope that the lanes take [-]."""
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
    # As in the lanes: near equal pressures the chord from there, in twice the linear region.
    slope = jnp.where(gap < 2.0 * curve.linear_gap, polynomial, 0.5 * polynomial + inside * derivative) / root
    slope = jnp.where(gap > curve.critical_gap, 0.0, slope)
    return value * jnp.minimum(gap / curve.linear_gap, 1.0), -slope


def flow(pressure_a: Array, pressure_b: Array, conductance: Array, takes_back: Array, curve: Curve) -> Array:
    """Mass flow from a to b [kg/s]; none flows back into a where ``takes_back`` is 0, not 1."""
    import jax.numpy as jnp

    upstream = jnp.maximum(pressure_a, pressure_b)
    size = conductance * upstream * flow_function(jnp.minimum(pressure_a, pressure_b) / upstream, curve)
    return jnp.where(pressure_a >= pressure_b, size, -takes_back * size)


def flow_slopes(
    pressure_a: Array, pressure_b: Array, conductance: Array, takes_back: Array, curve: Curve
) -> tuple[Array, Array, Array]:
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
        jnp.where(forward, size, -takes_back * size),
        jnp.where(forward, by_upstream, -takes_back * by_downstream),
        jnp.where(forward, by_downstream, -takes_back * by_upstream),
    )


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
    relieving: Array
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
    return Curve(
        critical_gap=1.0 - float(rows[f"{path}.critical_ratio"][0]),
        linear_gap=1.0 - float(rows[f"{path}.linear_ratio"][0]),
        terms=tuple(float(rows[f"{path}.coefficients[{term}]"][0]) for term in range(TERMS)),
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
    """Open area and the two nodes that a command joins to the chambers.

    The shares are 1 where that is the source; ``back_1`` and ``back_2`` are 1 where gas may flow back into the node.
    """

    conductance: Array
    node_1: Array
    node_2: Array
    share_1: Array
    share_2: Array
    back_1: Array
    back_2: Array


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
        jnp.where(feeds_1, task.relieving, 1.0),
        jnp.where(feeds_1, 1.0, task.relieving),
    )


class Linear(NamedTuple):
    """The matrix 1 - gamma h J by rows, one over its determinant, and gamma h times the slopes of both totals."""

    a: Array
    b: Array
    c: Array
    d: Array
    scale: Array
    source_1: Array
    source_2: Array
    leak_1: Array
    leak_2: Array


class Rates(NamedTuple):
    """Rates of both masses and both totals [kg/s]."""

    mass_1: Array
    mass_2: Array
    supplied: Array
    leaked: Array


def solve_stage(linear: Linear, right: Rates) -> Rates:
    """One stage of the Rosenbrock method."""
    rate_1 = (linear.d * right.mass_1 - linear.b * right.mass_2) * linear.scale
    rate_2 = (linear.a * right.mass_2 - linear.c * right.mass_1) * linear.scale
    supplied = right.supplied + linear.source_1 * rate_1 + linear.source_2 * rate_2
    return Rates(rate_1, rate_2, supplied, right.leaked + linear.leak_1 * rate_1 + linear.leak_2 * rate_2)


def first_stage(task: Task, state: State, port: Connection) -> tuple[Linear, Rates]:
    """Linearisation and first stage. Equations (3), (6) to (9)."""
    weight_1, weight_2 = GAMMA * task.step * task.per_mass_1, GAMMA * task.step * task.per_mass_2
    pressure_1, pressure_2 = state.mass_1 * task.per_mass_1, state.mass_2 * task.per_mass_2
    in_1, _, slope_1 = flow_slopes(port.node_1, pressure_1, port.conductance, port.back_1, task.valve_curve)
    in_2, _, slope_2 = flow_slopes(port.node_2, pressure_2, port.conductance, port.back_2, task.valve_curve)
    leak, leak_by_1, leak_by_2 = flow_slopes(pressure_1, pressure_2, task.leak_conductance, 1.0, task.leak_curve)
    a, b = 1.0 - weight_1 * (slope_1 - leak_by_1), weight_2 * leak_by_2
    c, d = -weight_1 * leak_by_1, 1.0 - weight_2 * (slope_2 + leak_by_2)
    source_1, source_2 = weight_1 * slope_1 * port.share_1, weight_2 * slope_2 * port.share_2
    linear = Linear(a, b, c, d, 1.0 / (a * d - b * c), source_1, source_2, -c, b)
    right = Rates(in_1 - leak, in_2 + leak, in_1 * port.share_1 + in_2 * port.share_2, leak)
    return linear, solve_stage(linear, right)


def advance_gas(task: Task, state: State) -> State:
    """One step of the two-stage Rosenbrock method on both chambers and the totals. Equations (3), (6) to (9)."""
    import jax.numpy as jnp

    step, port = task.step, connect(task, state.command)
    linear, first = first_stage(task, state, port)
    end_1 = (state.mass_1 + step * first.mass_1) * task.per_mass_1
    end_2 = (state.mass_2 + step * first.mass_2) * task.per_mass_2
    in_1 = flow(port.node_1, end_1, port.conductance, port.back_1, task.valve_curve)
    in_2 = flow(port.node_2, end_2, port.conductance, port.back_2, task.valve_curve)
    leak = flow(end_1, end_2, task.leak_conductance, 1.0, task.leak_curve)
    right = Rates(
        in_1 - leak - 2.0 * first.mass_1,
        in_2 + leak - 2.0 * first.mass_2,
        in_1 * port.share_1 + in_2 * port.share_2 - 2.0 * first.supplied,
        leak - 2.0 * first.leaked,
    )
    second = solve_stage(linear, right)
    change = Rates(*(step * (1.5 * one + 0.5 * two) for one, two in zip(first, second, strict=True)))
    change = change._replace(supplied=jnp.maximum(change.supplied, change.supplied * task.relieving))
    return state._replace(
        mass_1=state.mass_1 + change.mass_1,
        mass_2=state.mass_2 + change.mass_2,
        supplied_mass=state.supplied_mass + change.supplied,
        vented_mass=state.vented_mass + change.supplied - change.mass_1 - change.mass_2,
        leaked_mass=state.leaked_mass + jnp.abs(change.leaked),
    )
