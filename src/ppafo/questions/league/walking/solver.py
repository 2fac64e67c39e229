"""The programme of a stride for an optimiser, and its solution with IPOPT, for one landing of the foot."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.run import Run, Walk
from ppafo.engine.scheme.motion import friction_now
from ppafo.engine.scheme.walking import Direction, leg_torque
from ppafo.errors import SimulationError
from ppafo.model.contact import FLAT, foot_angle, prescribed_ankle
from ppafo.model.gait import GaitNow
from ppafo.model.plant import PlantParameters, actuator_torque, vane_acceleration
from ppafo.model.valves.kind import VENT, VENTS_ABOVE
from ppafo.questions.league.bound import (
    AS_GOOD,
    MARGIN,
    MEASURABLE,
    OPTIONS,
    STRATEGIES,
    TIE_BREAK,
    ChamberRates,
    chamber_rates,
)
from ppafo.questions.league.walking.measures import DEGREE, Grid, Stride
from ppafo.questions.league.walking.task import PROFILE_KIND, PROFILE_VALVE, WalkingTask
from ppafo.translation.symbolic import symbolic
from ppafo.walking.gait_series import AnklePath
from ppafo.walking.walk import walk

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
    largest = largest_friction(run, unknowns.rate, scale * pressures[:, : grid.free_points], sticking)
    turning = casadi.vertcat(unknowns.rate, _accelerations(run.walk, plant, stride, unknowns, torque, largest))
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


def largest_friction(run: Run, rates: Any, pressures: Any, sticking: Any) -> Any:
    """Largest friction torque [N m] at some points, by the laws of the engine with the effects of the run.

    ``rates`` [rad/s] (1, points) and absolute ``pressures`` [Pa] (2, points) are matrices of CasADi.
    """
    import casadi

    acting = dict(zip(run.program.effects, run.effects, strict=True))
    sizes = symbolic(friction_now, PlantParameters, float, float, float, acting=acting)
    found = []
    for place in range(rates.shape[1]):
        friction = sizes(run.plant, rates[place], pressures[0, place], pressures[1, place])
        breakaway = sticking * (friction.at_rest - friction.in_motion)
        found.append(friction.in_motion + breakaway * casadi.exp(-((rates[place] / STICKING_SPEED) ** 2)))
    return casadi.horzcat(*found)


def _accelerations(
    walk: Walk, plant: PlantParameters, stride: Stride, unknowns: _Unknowns, torque: Any, largest: Any
) -> Any:
    """Angular accelerations [rad/s^2] of the free foot at every free point, by the engine's own torque of the leg."""
    import casadi

    found = []
    for place in range(stride.grid.free_points):
        angle, rate, now = unknowns.angle[place], unknowns.rate[place], stride.now[place]
        standing = foot_angle(now.shank, angle)
        foot = Direction(casadi.sin(standing), casadi.cos(standing))
        level = walk.timing.ground_angle
        added = leg_torque(walk.leg, walk.share, stride.contacts[place], now, level, angle, foot)
        friction = unknowns.friction[place] * largest[place]
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


MAXIMUM_ITERATIONS = 600
FREE = 0.1
"""RMS torque [N m] in mid-stance that counts as free."""


@dataclass(frozen=True, slots=True, eq=False)
class Guess:
    """One stride, from which the optimiser starts: each (samples,) at ``phases`` from the heel strike.

    Pressures [Pa], angle [rad], angular velocity [rad/s]; ``openings`` (times, 3) at phases ``middles`` of their own.
    """

    phases: Floats
    pressure_1: Floats
    pressure_2: Floats
    angle: Floats
    angular_velocity: Floats
    middles: Floats
    openings: Floats

    def unknowns(self, built: Programme, stride: Stride) -> Floats:
        """The stride as the unknowns of a programme have it."""
        phases, free = stride.phases % 1.0, stride.grid.free_points
        pressures = np.array([self._at(phases, row) for row in (self.pressure_1, self.pressure_2)])
        angle, rate = (self._at(phases[:free], row) for row in (self.angle, self.angular_velocity))
        middles = stride.middle_phases % 1.0
        openings = [np.interp(middles, self.middles, row, period=1.0) for row in self.openings.T]
        parts = (pressures.T.ravel() / built.scale, angle, rate, np.sign(rate), np.array(openings).T.ravel())
        guess: Floats = np.clip(np.concatenate(parts), built.lowest, built.highest)
        return guess

    def _at(self, phases: Floats, row: Floats) -> Floats:
        return np.asarray(np.interp(phases, self.phases, row, period=1.0), dtype=np.float64)


def guess_from_walk(task: WalkingTask) -> Guess:
    """The last whole stride of a controlled walk; SimulationError where it has none."""
    result = walk(task.configuration(PROFILE_KIND, PROFILE_VALVE), task.seconds / 60.0)
    if not result.status.is_completed:
        raise SimulationError(f"the walk used as the optimiser's starting point ended early: {result.status.message}")
    stride = slice(int(result.starts[-2]), int(result.starts[-1]))
    recorded = result.recording
    phases = np.arange(stride.stop - stride.start) / (stride.stop - stride.start)
    return Guess(
        phases,
        np.array(recorded["pressure_1"][stride]),
        np.array(recorded["pressure_2"][stride]),
        np.array(recorded["angle"][stride]),
        np.array(recorded["angular_velocity"][stride]),
        phases,
        _openings(np.array(recorded["command"][stride])),
    )


def _openings(command: Floats) -> Floats:
    """Openings (samples, 3) of commands (samples,)."""
    vents = command > VENTS_ABOVE
    return np.array([np.where(vents, 0.0, np.maximum(command, 0.0)), np.maximum(-command, 0.0), 1.0 * vents]).T


@dataclass(frozen=True, slots=True)
class Strike:
    """The leg at heel strike: angle [rad], angular velocity [rad/s], pressures [Pa]."""

    angle: float
    angular_velocity: float
    pressure_1: float
    pressure_2: float


@dataclass(frozen=True, slots=True)
class StrideOptimum:
    """One optimal stride: RMS torque error [N m], gas [kg], and the phase at which the foot lands flat.

    ``height`` [m] is what was requested of the toes. ``openings`` (intervals, 3) towards chamber 1, towards chamber 2
    and to the atmosphere are held from each of ``times`` [s] after toe-off on, in a stride of ``period`` [s];
    ``strike`` is the state at heel strike, ``guess`` the stride as a start for another.
    """

    rms_error: float
    gas: float
    height: float
    landing: float
    period: float
    times: Floats
    openings: Floats
    strike: Strike
    guess: Guess


@final
class StrideSolver:
    """Optimal strides of one landing on one grid; ``guess`` are unknowns that are near a stride, see ``guessed``."""

    def __init__(self, run: Run, stride: Stride, path: AnklePath, guess: Guess) -> None:
        import casadi

        built = programme(run, stride, path)
        weights = casadi.SX.sym("weights", 2)
        limited = (
            built.equal_to_zero,
            built.openings_sum,
            built.landed,
            built.heights,
            built.mean_square,
            built.free_square,
        )
        problem = {
            "x": built.unknowns,
            "p": casadi.vertcat(weights, built.sticking),
            "f": weights[0] * built.mean_square + weights[1] * built.gas,
            "g": casadi.vertcat(*limited),
        }
        options = OPTIONS | {"ipopt.max_iter": MAXIMUM_ITERATIONS}
        self._solver = casadi.nlpsol("stride", "ipopt", problem, options | STRATEGIES[0])
        self._measures = casadi.Function("measures", [built.unknowns], [built.mean_square, built.gas])
        self._counts = tuple(item.numel() for item in limited)
        self._programme, self._stride = built, stride
        self._first = guess.unknowns(built, stride)
        self._near: Any = self._first
        self.unmeasurable = MEASURABLE * float(np.max(np.abs(stride.wanted * stride.asks_torque)))
        torque_weights = stride.grid.weights * stride.asks_torque
        self.idle_error = float(np.sqrt(np.sum(stride.wanted**2 * torque_weights) / np.sum(torque_weights)))

    def start_from(self, guess: Guess) -> None:
        """Start the next search near a stride."""
        self._near = guess.unknowns(self._programme, self._stride)

    def least_error(self, height: float) -> StrideOptimum | None:
        """The thriftiest stride of those with the minimum RMS error; None where the optimiser finds none."""
        least = self._solve((1.0, TIE_BREAK), np.inf, height, FREE)
        if least is None:
            return None
        return self.least_gas(max(AS_GOOD * least.rms_error, self.unmeasurable), height)

    def least_gas(self, rms_error: float, height: float, resistance: float = FREE) -> StrideOptimum | None:
        """The minimum gas at an RMS error [N m] of at most this and toes at least so high [m]; None if not found.

        ``resistance`` [N m] is the RMS torque that mid-stance may have.
        """
        return self._solve((TIE_BREAK, 1.0), rms_error * rms_error, height, resistance)

    def _solve(
        self, weights: tuple[float, float], maximum_square: float, height: float, resistance: float
    ) -> StrideOptimum | None:
        built = self._programme
        zeros, sums, landed, heights, _, _ = self._counts
        limits: dict[str, Any] = {
            "lbx": built.lowest,
            "ubx": built.highest,
            "lbg": [0.0] * zeros + [-np.inf] * (sums + landed) + [height] * heights + [-np.inf] * 2,
            "ubg": [0.0] * zeros
            + [1.0] * sums
            + [0.0] * landed
            + [np.inf] * heights
            + [maximum_square, resistance * resistance],
        }
        found = self._stepwise(weights, limits)
        optima = [self._optimum(solution, height) for solution in found]
        return min(optima, key=lambda item: weights[0] * item.rms_error**2 + weights[1] * item.gas, default=None)

    def _stepwise(self, weights: tuple[float, float], limits: Mapping[str, Any]) -> list[Any]:
        """Solutions without the breakaway torque and, from there, with it: sticking alone has many local optima."""
        for start in (self._near, self._first):
            sliding = self._solver(x0=start, p=[*weights, 0.0], **limits)
            if self._solver.stats()["success"]:
                self._near = sliding["x"]
                sticking = self._solver(x0=sliding["x"], p=[*weights, 1.0], **limits)
                return [sliding["x"], sticking["x"]] if self._solver.stats()["success"] else [sliding["x"]]
        return []

    def _optimum(self, solution: Any, height: float) -> StrideOptimum:
        grid, scale = self._stride.grid, self._programme.scale
        square, gas = (float(item) for item in self._measures(solution))
        values = np.array(solution).ravel()
        count, free = grid.times.size, grid.free_points
        pressures = scale * values[: 2 * count].reshape(-1, 2)
        motion = values[2 * count : 2 * (count + free)].reshape(2, -1)
        openings = values[2 * count + 3 * free :].reshape(-1, MODES)
        strike = self._stride.before_landing[0]
        return StrideOptimum(
            rms_error=float(np.sqrt(max(square, 0.0))),
            gas=1.0e-3 * gas,
            height=height,
            landing=self._stride.landing,
            period=float(np.sum(grid.lengths)),
            times=grid.starts,
            openings=openings,
            strike=Strike(*(float(value) for value in (*motion[:, strike], *pressures[strike]))),
            guess=self._guess(pressures, motion, openings),
        )

    def _guess(self, pressures: Floats, motion: Floats, openings: Floats) -> Guess:
        stride = self._stride
        prescribed = np.array([item[:2] for item in stride.prescribed]).T
        angle, rate = np.concatenate([motion, prescribed], axis=1)
        phases, middles = stride.phases % 1.0, stride.middle_phases % 1.0
        order, held = np.argsort(phases), np.argsort(middles)
        first, second = pressures[order].T
        return Guess(phases[order], first, second, angle[order], rate[order], middles[held], openings[held])
