"""The optimal control problem of a stride: chambers all the way, the foot where it is free, as one programme."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run, Walk
from ppafo.engine.scheme.ankle_torque import Direction, leg_torque
from ppafo.model.command import VENT
from ppafo.model.contact import FLAT, foot_angle, prescribed_ankle
from ppafo.model.gait import GaitNow
from ppafo.model.plant import PlantParameters
from ppafo.model.vane import actuator_torque, vane_acceleration
from ppafo.questions.league.bound import MARGIN, ChamberRates, chamber_rates
from ppafo.questions.league.walking.stride import DEGREE, Grid, Stride
from ppafo.walking.posture import AnklePath

STICKING_SPEED = 0.05
"""Angular velocity [rad/s] about which the largest friction falls from the breakaway torque to that of motion. Within
the largest the programme chooses the friction, which is more than a vane can have."""
FASTEST = 40.0
"""Angular velocity [rad/s] that no foot has."""
TINY = 1.0e-9
"""Time [s] that a window without any point counts as."""
HIGHEST = 3.0
"""Largest pressure over the highest of the source: a vane that is pushed may compress its gas."""
WAYS = (1.0, -1.0, VENT)
"""Commands [-] of what a valve can do, each for a share of the time: feed chamber 1, feed chamber 2, vent both."""
MODES = len(WAYS)


@dataclass(frozen=True, slots=True)
class Programme:
    """The nonlinear programme of a stride.

    Unknowns, in this order: two pressures over ``scale`` [Pa] at every point; angle [rad], angular velocity [rad/s] and
    friction over the largest at that speed at every free point; three openings on every interval. ``equal_to_zero`` are
    the equations, ``openings_sum`` is at most 1, ``heights`` [m] are those of the toes over the ground where that is
    requested, ``landed`` [rad] is at most 0 before the foot is flat. ``mean_square`` error of the torque and
    ``free_square`` the torque's own in mid-stance [N^2 m^2], ``gas`` [g]. ``sticking`` is a parameter: the fraction
    of the breakaway torque that counts, 0 or 1.
    """

    unknowns: Any
    sticking: Any
    equal_to_zero: Any
    openings_sum: Any
    heights: Any
    landed: Any
    mean_square: Any
    free_square: Any
    gas: Any
    lowest: Floats
    highest: Floats
    scale: float


@dataclass(frozen=True, slots=True)
class _Unknowns:
    """Symbols: pressures (2, points), angle, rate and friction (1, free points) each, openings (3, intervals)."""

    pressures: Any
    angle: Any
    rate: Any
    friction: Any
    openings: Any


def programme(run: Run, stride: Stride, path: AnklePath) -> Programme:
    """The programme of a stride for the plant and the leg of a run, equations (1) and (11).

    ``path`` places the toes over the ground.
    """
    import casadi

    assert run.walk is not None, "a stride is walked"
    plant, grid = run.plant, stride.grid
    scale = max(plant.supply_pressure, plant.dorsiflexion_pressure)
    unknowns, sticking = _unknowns(grid), casadi.SX.sym("sticking")
    rates = _chamber_rates(run, stride, unknowns, scale)
    pressures = unknowns.pressures
    slopes = casadi.vertcat(rates.pressure_1, rates.pressure_2) / scale
    torque = actuator_torque(scale * pressures[0, :], scale * pressures[1, :], plant.torque_constant)
    motion = casadi.vertcat(unknowns.angle, unknowns.rate)
    turning = casadi.vertcat(unknowns.rate, _accelerations(run.walk, plant, stride, unknowns, torque, sticking))
    flat = [_flat_angle(run.walk, now) for now in stride.now[: grid.free_points]]
    left = [
        casadi.vec(_residuals(grid, pressures, pressures[:, -1], slopes)),
        casadi.vec(_residuals(grid, motion, casadi.DM(stride.begin[:2]), turning)),
        unknowns.angle[-1] - flat[-1],
    ]
    places = np.flatnonzero(stride.asks_height).tolist()
    error = casadi.DM(stride.wanted).T - torque
    weights, free_weights = grid.weights * stride.asks_torque, grid.weights * stride.asks_freedom
    lowest, highest = _limits(plant, grid, scale)
    return Programme(
        unknowns=casadi.vertcat(
            casadi.vec(pressures), unknowns.angle.T, unknowns.rate.T, unknowns.friction.T, casadi.vec(unknowns.openings)
        ),
        sticking=sticking,
        equal_to_zero=casadi.vertcat(*left),
        openings_sum=casadi.vec(casadi.sum1(unknowns.openings)),
        heights=casadi.vertcat(*[_toe_height(path, stride, place, unknowns.angle[place]) for place in places]),
        landed=casadi.vertcat(*[unknowns.angle[place] - flat[place] for place in stride.before_landing]),
        mean_square=casadi.mtimes(error * error, casadi.DM(weights)) / float(np.sum(weights)),
        free_square=casadi.mtimes(torque * torque, casadi.DM(free_weights)) / max(float(np.sum(free_weights)), TINY),
        gas=1.0e3 * casadi.mtimes(rates.supplied, casadi.DM(grid.weights)),
        lowest=lowest,
        highest=highest,
        scale=scale,
    )


def _unknowns(grid: Grid) -> _Unknowns:
    import casadi

    angle, rate, friction = (casadi.SX.sym(name, 1, grid.free_points) for name in ("angle", "rate", "friction"))
    return _Unknowns(
        casadi.SX.sym("pressures", 2, grid.times.size),
        angle,
        rate,
        friction,
        casadi.SX.sym("openings", MODES, grid.starts.size),
    )


def _limits(plant: PlantParameters, grid: Grid, scale: float) -> tuple[Floats, Floats]:
    """Lowest and highest value of every unknown."""
    free = grid.free_points
    counts = (2 * grid.times.size, free, free, free, MODES * grid.starts.size)
    lowest = ((1.0 - MARGIN) * plant.atmospheric_pressure / scale, plant.angle_min, -FASTEST, -1.0, 0.0)
    highest = (HIGHEST, plant.angle_max, FASTEST, 1.0, 1.0)
    return np.repeat(lowest, counts), np.repeat(highest, counts)


def _chamber_rates(run: Run, stride: Stride, unknowns: _Unknowns, scale: float) -> ChamberRates:
    """Rates of both chambers at every point, as rows; their volumes run with the free foot or with the ground."""
    import casadi

    angle = casadi.horzcat(unknowns.angle, casadi.DM([item.angle for item in stride.prescribed]).T)
    rate = casadi.horzcat(unknowns.rate, casadi.DM([item.rate for item in stride.prescribed]).T)
    here = casadi.reshape(casadi.repmat(unknowns.openings, DEGREE, 1), MODES, stride.grid.times.size)
    return chamber_rates(run, WAYS, (angle, rate), scale * unknowns.pressures, here)


def _accelerations(
    walk: Walk, plant: PlantParameters, stride: Stride, unknowns: _Unknowns, torque: Any, sticking: Any
) -> Any:
    """Angular accelerations [rad/s^2] of the free foot at every free point, by the engine's own torque of the leg."""
    import casadi

    found, breakaway = [], sticking * (plant.static_torque - plant.dynamic_torque)
    for place in range(stride.grid.free_points):
        angle, rate, now = unknowns.angle[place], unknowns.rate[place], stride.now[place]
        standing = foot_angle(now.shank, angle)
        foot = Direction(casadi.sin(standing), casadi.cos(standing))
        level = walk.timing.ground_angle
        added = leg_torque(walk.leg, walk.share, stride.contacts[place], now, level, angle, foot)
        largest = plant.dynamic_torque + breakaway * casadi.exp(-((rate / STICKING_SPEED) ** 2))
        friction = unknowns.friction[place] * largest
        found.append(vane_acceleration(torque[place] + added, rate, friction, plant.viscous_damping, plant.inertia))
    return casadi.horzcat(*found)


def _flat_angle(walk: Walk, now: GaitNow) -> float:
    """Ankle angle [rad] with which the foot is flat."""
    return prescribed_ankle(FLAT, now, walk.timing.ground_angle, keeps_gait=0.0).angle


def _toe_height(path: AnklePath, stride: Stride, place: int, angle: Any) -> Any:
    """Toes over the ground [m] at a free point, as ``AnklePath.toe_height`` has them."""
    import casadi

    now = stride.now[place]
    tilt = foot_angle(now.shank, angle) - path.ground_angle
    return path.ankle_height(now.phase) + path.toes_at(casadi.sin(tilt), casadi.cos(tilt))


def _residuals(grid: Grid, states: Any, begin: Any, slopes: Any) -> Any:
    """What equations leave over at every collocation point of the first intervals; states (rows, points)."""
    import casadi

    left = []
    for interval in range(states.shape[1] // DEGREE):
        place = DEGREE * interval
        before = begin if interval == 0 else states[:, place - 1]
        nodes = [before, *(states[:, place + point] for point in range(DEGREE))]
        for point in range(DEGREE):
            slope = sum(float(grid.slopes[index, point]) * node for index, node in enumerate(nodes))
            left.append(slope - float(grid.lengths[interval]) * slopes[:, place + point])
    return casadi.horzcat(*left)
