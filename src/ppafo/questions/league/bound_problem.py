"""The optimal control problem of the lower bound: the plant of the engine for an optimiser, and Radau collocation.

The rates of the chambers are the text of the engine as expressions (``translation.plant_rates``), with three
differences: near equal pressures the straight line and the root of the flow curve meet in one smooth curve, a
supply that takes no gas back closes smoothly too, and a valve may spend a share of the time at each of its ways. Both
ways at once stands for a valve that switches between them infinitely fast, so that no control of the valve can do
better.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run
from ppafo.model.orifice import FlowCurve, check_valve_flow, fitted_flow_function
from ppafo.model.plant import Openings
from ppafo.model.vane import actuator_torque
from ppafo.parameters.device import Valve
from ppafo.simulation.plan import plan_run, profile_values
from ppafo.simulation.scenario import PrescribedMotion, Scenario
from ppafo.translation.plant_rates import gas_rates

BOUNDED_VALVES = ("proportional", "solenoid")
"""Kinds of valves whose ways are known: full command one way, and the other."""
WAYS = (1.0, -1.0)
"""Commands [-] of the ways of a valve; the rest of the time the command is 0."""
CLOSING = 1.0e-3
"""Fraction of the choked flow about which the flow from a supply that takes no gas back rounds off to nothing."""
DEGREE = 2
"""Collocation points in an interval; Radau's, of third order, so that the steep flow near equal pressures is damped."""
MARGIN = 0.02
"""Fraction of the atmosphere by which the optimiser may step below it, so that nothing lies on a limit."""


def at_once(scenario: Scenario) -> Scenario:
    """The scenario with a valve that follows its command at once."""
    valve = scenario.device.valve
    ideal = Valve(valve.kind, valve.orifice, dict.fromkeys(valve.settings, 0.0))
    return replace(scenario, device=replace(scenario.device, valve=ideal))


def mean_openings(run: Run, ways: Sequence[float], shares: Sequence[Any]) -> Openings:
    """Mean openings [-] of a valve that follows at once, with a share of the time at each command of ``ways``.

    The rest of the time its command is 0. Flows are proportional to openings, so their mean has the mean flow.
    """
    valve = run.program.valve
    at_rest, *found = (valve.instant(run.valve, valve.initial(), command) for command in (0.0, *ways))
    means = []
    for place, rest in enumerate(at_rest):
        changes = [opening[place] - rest for opening in found]
        moved = [share * change for share, change in zip(shares, changes, strict=True) if change != 0.0]
        means.append(sum(moved[1:], rest + moved[0]) if moved else rest)
    source_1, vent_1, source_2, vent_2 = means
    return Openings(source_1=source_1, vent_1=vent_1, source_2=source_2, vent_2=vent_2)


def smooth_flow_function(flow_function: Callable[..., Any], ratio: Any, curve: FlowCurve) -> Any:
    """The ``flow_function`` of the engine [-] with one smooth curve in the place of the straight line and the corner.

    The gap to equal pressures is kept from falling below that of the line by a mean of fourth powers. Of the line
    itself half is left: the flow near equal pressures is then hardly ever below the engine's, and a bound may have
    too much flow but not too little.
    """
    gap = 1.0 - ratio
    meeting = 0.5 * (1.0 - curve.linear_ratio)
    kept = (gap**4 + meeting**4) ** 0.25
    half = curve._replace(linear_ratio=1.0 - meeting, linear_slope=1.0 / meeting)
    return flow_function(1.0 - kept, half) * gap / kept


def closing_flow(
    flow: Callable[..., Any], pressure_a: Any, pressure_b: Any, conductance: Any, takes_back: float, curve: FlowCurve
) -> Any:
    """The ``flow`` of the engine [kg/s] through an orifice, which closes smoothly where nothing flows back."""
    import casadi

    both_ways = flow(pressure_a, pressure_b, 1.0, 1.0, curve)
    if takes_back > 0.0:
        return conductance * both_ways
    rounding = CLOSING * pressure_a
    return conductance * 0.5 * (both_ways + casadi.sqrt(both_ways * both_ways + rounding * rounding))


SMOOTH: dict[Any, Callable[..., Any]] = {
    fitted_flow_function: smooth_flow_function,
    check_valve_flow: closing_flow,
}
"""What stands before functions of the engine, so that an optimiser can follow them."""


@dataclass(frozen=True, slots=True)
class ChamberRates:
    """Rates of both pressures [Pa/s] and gas taken from the source [kg/s], as expressions, rows of all points."""

    pressure_1: Any
    pressure_2: Any
    supplied: Any


def chamber_rates(
    run: Run, ways: Sequence[float], motion: tuple[Any, Any], pressures: Any, shares: Any
) -> ChamberRates:
    """Rates of isothermal chambers at every point, by the engine's own text. Equations (3) to (9).

    ``motion`` has angles [rad] and rates [rad/s] (1, points), ``pressures`` [Pa absolute] are (2, points), ``shares``
    (ways, points) of the time at each of the ``ways`` of the valve.
    """
    import casadi

    angle, rate, pressure, share = map(casadi.SX.sym, ("angle", "rate", "pressures", "shares"), (1, 1, 2, len(ways)))
    openings = mean_openings(run, ways, casadi.vertsplit(share))
    acting = dict(zip(run.program.effects, run.effects, strict=True))
    found = gas_rates(run.plant, openings, angle, rate, (pressure[0], pressure[1]), SMOOTH, acting=acting)
    at_a_point = casadi.Function(
        "rates", [angle, rate, pressure, share], [found.pressure_1, found.pressure_2, found.supplied]
    )
    return ChamberRates(*at_a_point(*motion, pressures, shares))


@dataclass(frozen=True, slots=True)
class Grid:
    """A regular grid: ``times`` [s] and integration ``weights`` [s] of all collocation points, in order of time.

    ``starts`` [s] are those of the intervals; ``slopes`` [1/s] (degree + 1, degree) differentiate within one.
    """

    times: Floats
    weights: Floats
    starts: Floats
    slopes: Floats


@dataclass(frozen=True, slots=True)
class Programme:
    """The nonlinear programme: two pressures, over ``scale`` [Pa], at every point, two openings on every interval.

    ``equal_to_zero`` are the chambers' equations, ``openings_sum`` is at most 1, ``mean_square`` the error [N^2 m^2],
    ``gas`` what is taken from the source [g]; ``lowest`` and ``highest`` limit the unknowns.
    """

    unknowns: Any
    equal_to_zero: Any
    openings_sum: Any
    mean_square: Any
    gas: Any
    lowest: Floats
    highest: Floats
    grid: Grid
    scale: float


def regular_grid(duration: float, intervals: int) -> Grid:
    """The collocation points of a task of some duration [s]."""
    import casadi

    roots = np.array(casadi.collocation_points(DEGREE, "radau"))
    slopes, _, weights = (np.array(item) for item in casadi.collocation_coeff(list(roots)))
    length = duration / intervals
    starts: Floats = length * np.arange(intervals, dtype=np.float64)
    times: Floats = np.asarray(starts[:, None] + length * roots[None, :], dtype=np.float64).ravel()
    return Grid(times, np.tile(length * weights.ravel(), intervals), starts, slopes / length)


def programme(scenario: Scenario, intervals: int) -> Programme:
    """The programme of a fixed or prescribed scenario."""
    import casadi

    run = plan_run(at_once(scenario))
    plant = run.plant
    grid = regular_grid(scenario.duration, intervals)
    scale = max(plant.supply_pressure, plant.dorsiflexion_pressure)
    pressures: Any = casadi.SX.sym("pressures", 2, grid.times.size)
    openings = casadi.SX.sym("openings", 2, intervals)
    here = casadi.reshape(casadi.repmat(openings, DEGREE, 1), 2, grid.times.size)
    rates = chamber_rates(run, WAYS, _motion(scenario, grid), scale * pressures, here)
    start = np.array([scenario.initial_pressure_1, scenario.initial_pressure_2]) / scale
    slopes = casadi.vertcat(rates.pressure_1, rates.pressure_2) / scale
    reference = profile_values(scenario.reference, grid.times)[0]
    torque = actuator_torque(scale * pressures[0, :], scale * pressures[1, :], plant.torque_constant)
    error = casadi.DM(reference).T - torque
    weights = casadi.DM(grid.weights)
    lowest = (1.0 - MARGIN) * plant.atmospheric_pressure / scale
    highest = max(1.0, *start)
    limits = (2 * grid.times.size, 2 * intervals)
    return Programme(
        unknowns=casadi.vertcat(casadi.vec(pressures), casadi.vec(openings)),
        equal_to_zero=casadi.vec(_residuals(pressures, slopes, start, grid)),
        openings_sum=casadi.vec(openings[0, :] + openings[1, :]),
        mean_square=casadi.mtimes(error * error, weights) / scenario.duration,
        gas=1.0e3 * casadi.mtimes(rates.supplied, weights),
        lowest=np.repeat([lowest, 0.0], limits),
        highest=np.repeat([highest, 1.0], limits),
        grid=grid,
        scale=scale,
    )


def _residuals(pressures: Any, slopes: Any, start: Floats, grid: Grid) -> Any:
    """What the chambers' equations leave over at every collocation point, in fractions of an interval."""
    import casadi

    length = grid.starts[1]
    points = [pressures[:, place::DEGREE] for place in range(DEGREE)]
    before = casadi.horzcat(casadi.DM(start), points[-1][:, :-1])
    nodes = [before, *points]
    left = []
    for place in range(DEGREE):
        slope = sum(grid.slopes[index, place] * node for index, node in enumerate(nodes))
        left.append(length * (slope - slopes[:, place::DEGREE]))
    return casadi.vertcat(*left)


def _motion(scenario: Scenario, grid: Grid) -> tuple[Any, Any]:
    """Angle [rad] and rate [rad/s] of a fixed or prescribed ankle at every point, each as a row."""
    import casadi

    if not isinstance(scenario.motion, PrescribedMotion):
        raise TypeError("the bound is for a fixed or prescribed ankle")
    angle, rate = profile_values(scenario.motion.profile, grid.times)[:2]
    return casadi.DM(angle).T, casadi.DM(rate).T
