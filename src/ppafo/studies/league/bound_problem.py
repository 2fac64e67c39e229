"""The optimal control problem of the lower bound: Radau collocation on a regular grid, as one nonlinear programme."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.model.plant import PlantParameters, chamber_volumes
from ppafo.simulation.plan import plan_run, profile_values
from ppafo.simulation.scenario import LedMotion, Scenario
from ppafo.studies.league.bound_model import VALVE_OPENINGS, Volumes, chamber_rates

DEGREE = 2
"""Collocation points in an interval; Radau's, of third order, so that the steep flow near equal pressures is damped."""
MARGIN = 0.02
"""Share of the atmosphere by which the optimiser may step below it, so that nothing lies on a limit."""


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
    """The programme of a held or led scenario."""
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
    """What the chambers' equations leave over at every collocation point, in shares of an interval."""
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
    """Volumes at every point of a held or led ankle, each as a row."""
    import casadi

    if not isinstance(scenario.motion, LedMotion):
        raise TypeError("the bound is for a held or led ankle")
    angle, velocity = profile_values(scenario.motion.profile, grid.times)[:2]
    rows = [casadi.DM(np.asarray(item)).T for item in chamber_volumes(plant, angle)]
    return Volumes(rows[0], rows[1], casadi.DM(plant.volume_per_angle * velocity).T)
