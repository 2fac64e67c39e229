"""The optimal control problem of the lower bound: the flow laws of the engine for an optimiser, and Radau collocation.

Three differences to the engine: near equal pressures the straight line and the root meet in one smooth curve, a
supply that takes no gas back closes smoothly too, and the two ways of the valve have an opening each, of which the sum
is at most 1. Both open at once stands for a valve that switches between them infinitely fast, so that no control of
the valve can do better.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.model.orifice import FlowCurve
from ppafo.model.plant import PlantParameters, chamber_volumes
from ppafo.simulation.plan import plan_run, profile_values
from ppafo.simulation.scenario import PrescribedMotion, Scenario

Openings = Callable[..., tuple[Any, Any, Any, Any]]
"""From the fractions of time of a valve's ways, towards chamber 1 first, to source 1, vent 1, source 2 and vent 2."""

CLOSING = 1.0e-3
"""Fraction of the choked flow about which the flow from a supply that takes no gas back rounds off to nothing."""
DEGREE = 2
"""Collocation points in an interval; Radau's, of third order, so that the steep flow near equal pressures is damped."""
MARGIN = 0.02
"""Fraction of the atmosphere by which the optimiser may step below it, so that nothing lies on a limit."""


@dataclass(frozen=True, slots=True)
class ChamberRates:
    """Rates of both pressures [Pa/s] and gas taken from the source [kg/s], as expressions."""

    pressure_1: Any
    pressure_2: Any
    supplied: Any


@dataclass(frozen=True, slots=True)
class Volumes:
    """Volumes of both chambers [m^3] and the rate of the first [m^3/s], rows of all points; the second shrinks."""

    first: Any
    second: Any
    rate: Any


def proportional_openings(towards_1: Any, towards_2: Any) -> tuple[Any, Any, Any, Any]:
    """Openings of the spool valve: what feeds one chamber vents the other."""
    return towards_1, towards_2, towards_2, towards_1


def solenoid_openings(towards_1: Any, towards_2: Any) -> tuple[Any, Any, Any, Any]:
    """Openings of the solenoid pair: a chamber that is not fed is vented."""
    return towards_1, 1.0 - towards_1, towards_2, 1.0 - towards_2


VALVE_OPENINGS: dict[str, Openings] = {"proportional": proportional_openings, "solenoid": solenoid_openings}
"""By the kind of the valve."""


def smooth_flow(pressure_a: Any, pressure_b: Any, conductance: float, curve: FlowCurve) -> Any:
    """Mass flow from a to b [kg/s] as an expression: that of ``orifice_flow``, smooth at equal pressures."""
    import casadi

    upstream = casadi.fmax(pressure_a, pressure_b)
    gap = (pressure_a - pressure_b) / upstream
    size = casadi.fabs(gap)
    polynomial: Any = 0.0
    for coefficient in reversed(curve.coefficients):
        polynomial = polynomial * size + coefficient
    # Half the gap of the straight line: the flow near equal pressures is then hardly ever below the engine's, and a
    # bound may have too much flow but not too little.
    meeting = 0.5 * (1.0 - curve.linear_ratio)
    subsonic = polynomial * gap * (gap**4 + meeting**4) ** -0.125
    is_subsonic = size < 1.0 - curve.critical_ratio
    return conductance * upstream * casadi.if_else(is_subsonic, subsonic, casadi.sign(gap))


def supply_flow(source: float, pressure: Any, plant: PlantParameters) -> Any:
    """Mass flow from a supply at ``source`` [Pa] through the whole valve [kg/s], none back unless it is relieving."""
    import casadi

    flow = smooth_flow(source, pressure, plant.valve_conductance, plant.valve_curve)
    rounding = CLOSING * plant.valve_conductance * source
    return flow if plant.relieving else 0.5 * (flow + casadi.sqrt(flow * flow + rounding * rounding))


def chamber_rates(
    plant: PlantParameters,
    openings: Openings,
    volumes: Volumes,
    pressures: tuple[Any, Any],
    ways: tuple[Any, ...],
) -> ChamberRates:
    """Rates of isothermal chambers at absolute pressures [Pa], for fractions of time of each way. Eqs (3) to (9)."""
    pressure_1, pressure_2 = pressures
    source_1, vent_1, source_2, vent_2 = openings(*ways)
    full, curve, ambient = plant.valve_conductance, plant.valve_curve, plant.atmospheric_pressure
    leak = smooth_flow(pressure_1, pressure_2, plant.leak_conductance, plant.leak_curve)
    fed_1 = source_1 * supply_flow(plant.supply_pressure, pressure_1, plant)
    fed_2 = source_2 * supply_flow(plant.dorsiflexion_pressure, pressure_2, plant)
    gain_1 = fed_1 - vent_1 * smooth_flow(pressure_1, ambient, full, curve) - leak
    gain_2 = fed_2 - vent_2 * smooth_flow(pressure_2, ambient, full, curve) + leak
    return ChamberRates(
        (plant.gas_product * gain_1 - pressure_1 * volumes.rate) / volumes.first,
        (plant.gas_product * gain_2 + pressure_2 * volumes.rate) / volumes.second,
        fed_1 + fed_2,
    )


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

    plant = plan_run(scenario).plant
    grid = regular_grid(scenario.duration, intervals)
    scale = max(plant.supply_pressure, plant.dorsiflexion_pressure)
    pressures = casadi.SX.sym("pressures", 2, grid.times.size)
    openings = casadi.SX.sym("openings", 2, intervals)
    here = casadi.reshape(casadi.repmat(openings, DEGREE, 1), 2, grid.times.size)
    rates = chamber_rates(
        plant,
        VALVE_OPENINGS[scenario.device.valve.kind],
        _volumes(scenario, plant, grid),
        (scale * pressures[0, :], scale * pressures[1, :]),
        (here[0, :], here[1, :]),
    )
    start = np.array([scenario.initial_pressure_1, scenario.initial_pressure_2]) / scale
    slopes = casadi.vertcat(rates.pressure_1, rates.pressure_2) / scale
    reference = profile_values(scenario.reference, grid.times)[0]
    error = casadi.DM(reference).T - plant.torque_constant * scale * (pressures[0, :] - pressures[1, :])
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


def _volumes(scenario: Scenario, plant: PlantParameters, grid: Grid) -> Volumes:
    """Volumes at every point of a fixed or prescribed ankle, each as a row."""
    import casadi

    if not isinstance(scenario.motion, PrescribedMotion):
        raise TypeError("the bound is for a fixed or prescribed ankle")
    angle, velocity = profile_values(scenario.motion.profile, grid.times)[:2]
    rows = [casadi.DM(np.asarray(item)).T for item in chamber_volumes(plant, angle)]
    return Volumes(rows[0], rows[1], casadi.DM(plant.volume_per_angle * velocity).T)
