"""Fit of a flow curve to the exact flow function of an orifice, for a gas or for a critical ratio of ISO 6358.

Curves are fitted by plain arithmetic and square roots alone, so that a run starts with the same bits on every machine.
"""

import math
from functools import lru_cache

from ppafo.model.columns import over_runs, root
from ppafo.model.gas import critical_pressure_ratio
from ppafo.model.orifice import TERMS, FlowCurve, isentropic_flow_function, iso6358_flow_function

Terms = tuple[float, float, float, float, float, float, float]
"""Coefficients of a series, ``TERMS`` of them."""

NODES: Terms = (0.01371, 0.117149, 0.300253, 0.522087, 0.735768, 0.900391, 0.988845)
"""Nodes at which a curve equals the exact function: 1 - r divided by its value at the critical ratio.

The best fit by relative least squares crosses the exact function of helium at these nodes, and of other gases nearby.
"""


def isentropic_curve(heat_capacity_ratio: float, linear_ratio: float) -> FlowCurve:
    """Fitted curve [-] of equations (6), (7) for a gas, within 3e-7 of the exact function below ``linear_ratio``."""
    return FlowCurve(
        critical_ratio=critical_pressure_ratio(heat_capacity_ratio),
        linear_ratio=linear_ratio,
        linear_slope=1.0 / (1.0 - linear_ratio),
        coefficients=over_runs(_cached_isentropic_coefficients, heat_capacity_ratio),
    )


def iso6358_curve(critical_ratio: float, linear_ratio: float) -> FlowCurve:
    """Fitted curve [-] of ISO 6358 for a critical ratio b; within 1e-5 of the exact function below ``linear_ratio``.

    The exact function depends on (1 - r) / (1 - b) alone, so one scaled fit is valid for every b.
    """
    # A factor on 1 - r scales the n-th coefficient by its n-th power, and the root in front by its own root.
    scale = 1.0 / (1.0 - critical_ratio)
    factor = root(scale)
    unscaled = _cached_iso6358_coefficients()
    coefficients = unscaled
    for index in range(TERMS):
        coefficients = _with_item(coefficients, index, unscaled[index] * factor)
        factor = factor * scale
    return FlowCurve(
        critical_ratio=critical_ratio,
        linear_ratio=linear_ratio,
        linear_slope=1.0 / (1.0 - linear_ratio),
        coefficients=coefficients,
    )


def _isentropic_coefficients(heat_capacity_ratio: float) -> Terms:
    """Coefficients for a gas that interpolate the exact function of equation (7) at nodes in the subsonic region."""
    critical_gap = 1.0 - critical_pressure_ratio(heat_capacity_ratio)
    gaps = NODES
    values = NODES
    for index in range(TERMS):
        gap = critical_gap * NODES[index]
        value = isentropic_flow_function(1.0 - gap, heat_capacity_ratio)
        # Divided by the root of the gap, which the curve has as a factor: what is left to fit is smooth at equal
        # pressures.
        gaps = _with_item(gaps, index, gap)
        values = _with_item(values, index, value / math.sqrt(gap))
    return _polynomial_through(gaps, values)


def _iso6358_coefficients() -> Terms:
    """Coefficients for a critical ratio of 0, where the exact function is the square root of (1 - r)(1 + r)."""
    values = NODES
    for index in range(TERMS):
        gap = NODES[index]
        values = _with_item(values, index, iso6358_flow_function(1.0 - gap, 0.0) / math.sqrt(gap))
    return _polynomial_through(NODES, values)


# A study asks for the few gases of its runs again and again. No decorators: an exported library is made of plain
# definitions alone.
_cached_isentropic_coefficients = lru_cache(maxsize=4096)(_isentropic_coefficients)
_cached_iso6358_coefficients = lru_cache(maxsize=1)(_iso6358_coefficients)


def _polynomial_through(nodes: Terms, values: Terms) -> Terms:
    """Coefficients, constant term first, of the polynomial through values at some points (Newton interpolation)."""
    differences = values
    for order in range(1, TERMS):
        for number in range(order, TERMS):
            index = TERMS - 1 + order - number
            # Divided differences in place, from the end, so that each still finds its neighbour of the order before.
            rise = differences[index] - differences[index - 1]
            differences = _with_item(differences, index, rise / (nodes[index] - nodes[index - order]))
    # Tuples of fixed length, no lists: an exported library fits its curves itself, from this text in C.
    coefficients = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for number in range(TERMS):
        node = nodes[TERMS - 1 - number]
        # The polynomial so far times (x - node), and the next difference.
        lower = coefficients
        for index in range(TERMS):
            raised = lower[index - 1] if index > 0 else 0.0
            coefficients = _with_item(coefficients, index, raised - node * lower[index])
        coefficients = _with_item(coefficients, 0, coefficients[0] + differences[TERMS - 1 - number])
    return coefficients


def _with_item(items: Terms, index: int, value: float) -> Terms:
    """Return a copy of a sequence with the item at an index replaced."""
    return (
        value if index == 0 else items[0],
        value if index == 1 else items[1],
        value if index == 2 else items[2],
        value if index == 3 else items[3],
        value if index == 4 else items[4],
        value if index == 5 else items[5],
        value if index == 6 else items[6],
    )
