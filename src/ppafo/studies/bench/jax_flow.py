"""Flow through an orifice in JAX: the fitted flow function of the lanes, as array operations."""

from typing import Any, NamedTuple

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
