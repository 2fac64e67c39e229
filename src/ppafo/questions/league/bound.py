"""The optimal control problem of the lower bound: the plant of the engine for an optimiser, and Radau collocation.

The rates of the chambers are the text of the engine as expressions (``translation.plant_rates``), with three
differences: near equal pressures the straight line and the root of the flow curve meet in one smooth curve, a
supply that takes no gas back closes smoothly too, and a valve may spend a share of the time at each of its ways. Both
ways at once stands for a valve that switches between them infinitely fast, so that no control of the valve can do
better.

Held or prescribed motion, isothermal gas. Sampling, sensors, dead band, delays and spool are left out: each of them can
only make a task harder, so what is found without them bounds what is possible with them. The optimiser finds a local
optimum; that it is the best there is, is checked only by every controller staying above it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any, final

import numpy as np

from ppafo.engine.lanes import Floats, StepInputs, replay
from ppafo.engine.run import Run, batch_of
from ppafo.errors import SimulationError
from ppafo.metrics.gas import gas_supplied
from ppafo.metrics.tracking import rms_error
from ppafo.model.orifice import FlowCurve, check_valve_flow, fitted_flow_function
from ppafo.model.plant import Openings, actuator_torque, chamber_pressures
from ppafo.parameters.device import VANE, Valve
from ppafo.progress import Progress, Report, report_nothing
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.plan import plan_run, profile_values
from ppafo.simulation.sampled import state_row_numbers
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, PrescribedMotion, Scenario
from ppafo.simulation.simulate import simulate
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


GUESSED_BY = "feedback_linearisation"
"""The controller whose run the optimiser starts from; any start will do that is near the task."""
GUESS_PERIOD = 1.0e-3
NEARLY_CONVEX = 2.0e-3
"""Fraction by which a point may lie above the line between its neighbours."""
AS_GOOD = 1.0001
"""Errors that differ by this factor count as equal."""
MEASURABLE = 1.0e-3
"""An error below this fraction of the largest reference counts as none: nobody could measure the difference."""
TIE_BREAK = 1.0e-6
"""Weight of the gas [1/g] beside the mean square error [N^2 m^2]: of equal errors the thrifty one is taken."""
OPTIONS: dict[str, Any] = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 300,
    "ipopt.tol": 1.0e-7,
    "ipopt.acceptable_tol": 1.0e-6,
}
STRATEGIES = ({"ipopt.mu_strategy": "adaptive"}, {"ipopt.mu_strategy": "monotone"})
"""The first is mostly quicker; where it fails, the second is tried."""


@dataclass(frozen=True, slots=True)
class Optimum:
    """One optimal control: RMS error [N m], gas [kg], and the openings both ways, held from each of the times [s] on.

    Where both openings ``towards_1`` and ``towards_2`` [-] are above 0, the valve switches between the two.
    """

    rms_error: float
    gas: float
    times: Floats
    towards_1: Floats
    towards_2: Floats

    @property
    def overlap(self) -> float:
        """Largest opening of the lesser way [-]: 0 where a valve can do just this."""
        return float(np.max(np.minimum(self.towards_1, self.towards_2)))


@final
class BoundSolver:
    """Optimal controls of one scenario on one grid; an error below ``unmeasurable`` [N m] counts as none.

    ``idle_error`` [N m] is the RMS error of no torque at all.
    """

    def __init__(self, scenario: Scenario, intervals: int) -> None:
        import casadi

        self._programme = programme(scenario, intervals)
        built = self._programme
        weights = casadi.SX.sym("weights", 2)
        problem = {
            "x": built.unknowns,
            "p": weights,
            "f": weights[0] * built.mean_square + weights[1] * built.gas,
            "g": casadi.vertcat(built.equal_to_zero, built.openings_sum, built.mean_square),
        }
        self._solvers = [casadi.nlpsol("bound", "ipopt", problem, OPTIONS | strategy) for strategy in STRATEGIES]
        self._measures = casadi.Function("measures", [built.unknowns], [built.mean_square, built.gas])
        self._name = scenario.name
        self._first: Any = _guess(scenario, built)
        self._near = self._first
        reference = profile_values(scenario.reference, built.grid.times)[0]
        self.unmeasurable = MEASURABLE * float(np.max(np.abs(reference)))
        self.idle_error = float(np.sqrt(np.mean(reference**2)))

    def least_error(self) -> Optimum:
        """The control with the minimum RMS error, and of all with that error the thriftiest."""
        least = self._solve((1.0, TIE_BREAK), np.inf)
        return self.least_gas(max(AS_GOOD * least.rms_error, self.unmeasurable))

    def least_gas(self, rms_error: float) -> Optimum:
        """The control with the minimum gas of all whose RMS error [N m] is at most this."""
        return self._solve((TIE_BREAK, 1.0), rms_error * rms_error)

    def trade_off(self, errors: Sequence[float]) -> list[Optimum]:
        """The minimum gas at growing errors [N m], each from the one before.

        A point that lies above the line between its neighbours is a local optimum only; it is tried again from the
        next one, and the better of both is kept.
        """
        found, states = [], []
        for error in errors:
            found.append(self.least_gas(error))
            states.append(self._near)
        for place in range(len(found) - 2, 0, -1):
            before, here, after = found[place - 1 : place + 2]
            span = (here.rms_error - before.rms_error) / (after.rms_error - before.rms_error)
            if here.gas > (1.0 + NEARLY_CONVEX) * (before.gas + span * (after.gas - before.gas)):
                self._near = states[place + 1]
                again = self.least_gas(errors[place])
                found[place] = min(here, again, key=lambda optimum: optimum.gas)
        return found

    def _solve(self, weights: tuple[float, float], maximum_square: float) -> Optimum:
        built = self._programme
        zeros, sums = built.equal_to_zero.numel(), built.openings_sum.numel()
        limits: dict[str, Any] = {
            "lbx": built.lowest,
            "ubx": built.highest,
            "lbg": [0.0] * zeros + [-np.inf] * (sums + 1),
            "ubg": [0.0] * zeros + [1.0] * sums + [maximum_square],
        }
        ended = ""
        for start in (self._near, self._first):
            for solver in self._solvers:
                found = solver(x0=start, p=weights, **limits)
                if solver.stats()["success"]:
                    self._near = found["x"]
                    return self._optimum(found["x"])
                ended = solver.stats()["return_status"]
        raise SimulationError(
            f"{self._name}: the optimiser of the lower bound ended with '{ended}' from every starting point; try a "
            "shorter task, or another initial pressure"
        )

    def _optimum(self, solution: Any) -> Optimum:
        grid = self._programme.grid
        square, gas = (float(item) for item in self._measures(solution))
        towards = np.array(solution)[2 * grid.times.size :].reshape(-1, 2)
        return Optimum(
            rms_error=float(np.sqrt(max(square, 0.0))),
            gas=1.0e-3 * gas,
            times=grid.starts,
            towards_1=towards[:, 0],
            towards_2=towards[:, 1],
        )


def _guess(scenario: Scenario, built: Programme) -> Floats:
    """Pressures and openings of a controlled run at the points, as the unknowns have them."""
    from ppafo.control.catalog import CONTROLLERS

    settings = {item.name: float(item.default or 0.0) for item in CONTROLLERS[GUESSED_BY].quantities}
    run = simulate(replace(scenario, control=Control(GUESSED_BY, settings, GUESS_PERIOD))).recording
    grid = built.grid
    first, second = (np.interp(grid.times, run.time, run[name]) for name in ("pressure_1", "pressure_2"))
    command = np.interp(grid.starts + 0.5 * grid.starts[1], run.time, run["command"])
    pressures = np.array([first, second]).T.ravel() / built.scale
    openings = np.array([np.maximum(command, 0.0), np.maximum(-command, 0.0)]).T.ravel()
    guess: Floats = np.clip(np.concatenate([pressures, openings]), built.lowest, built.highest)
    return guess


MISSING_EXTRA = "the lower bound needs CasADi: pip install ppafo[optimal]"
FIRST_INTERVALS = 75
MAXIMUM_INTERVALS = 1200
NEARLY = 1.01
"""Factor within which the minimum error is the one that counts as none."""
CLOSED = 1.0e-6
"""An opening below this is none."""
REFERENCE_POINTS = 1001
CURVE_POINTS = 12
CURVE_FRACTIONS = (0.003, 0.4)
"""First and last point of the curve: error above the minimum, over the error of doing nothing."""
FINE_ENOUGH = 0.01
"""Fraction by which minimum error and minimum gas may move when the grid is made twice as fine."""


@dataclass(frozen=True, slots=True)
class LowerBound:
    """The trade-off of error and gas of one task: the minimum error, and the minimum gas at growing errors.

    ``intervals`` is the grid that was fine enough and ``moved`` the fraction by which the last refinement moved it. An
    error below ``unmeasurable`` [N m] counts as none, and the minimum error is not looked for below it.
    """

    least_error: Optimum
    curve: tuple[Optimum, ...]
    intervals: int
    moved: float
    unmeasurable: float

    @property
    def is_attainable(self) -> bool:
        """True where some control follows the reference so well that the error counts as none."""
        return self.least_error.rms_error <= NEARLY * self.unmeasurable

    def gas_at(self, rms_error: float) -> float:
        """Least gas [kg] at an RMS error [N m]: exact at the points of the curve, straight lines between them.

        Below the minimum error, which rounding or an unmeasurable error may bring about, it is that of the minimum
        error.
        """
        errors = [self.least_error.rms_error, *(point.rms_error for point in self.curve)]
        gas = [self.least_error.gas, *(point.gas for point in self.curve)]
        return float(np.interp(rms_error, errors, gas))


@dataclass(frozen=True, slots=True)
class Played:
    """What the engine makes of an optimal command: RMS error [N m] and gas [kg] of the run."""

    rms_error: float
    gas: float


def check_bounded(scenario: Scenario) -> None:
    """Refuse a scenario that the bound cannot be computed for, with the reason; SimulationError."""
    if find_spec("casadi") is None:
        raise SimulationError(MISSING_EXTRA)
    if scenario.device.actuator.kind != VANE:
        raise SimulationError(f"{scenario.name}: the lower bound is for a vane, not '{scenario.device.actuator.kind}'")
    if not isinstance(scenario.motion, PrescribedMotion):
        raise SimulationError(f"{scenario.name}: the lower bound needs a fixed or prescribed ankle, not a free one")
    if scenario.thermal is not None:
        raise SimulationError(f"{scenario.name}: the lower bound is for isothermal gas; omit [gas_model]")
    if scenario.supply_lines is not None:
        raise SimulationError(f"{scenario.name}: the lower bound is for constant supplies; omit [supply_line]")
    if scenario.device.valve.kind not in BOUNDED_VALVES:
        known = ", ".join(BOUNDED_VALVES)
        raise SimulationError(f"{scenario.name}: no lower bound for valve '{scenario.device.valve.kind}', only {known}")
    times = np.linspace(0.0, scenario.duration, REFERENCE_POINTS)
    if not np.any(profile_values(scenario.reference, times)[0]):
        raise SimulationError(f"{scenario.name}: the reference is 0 N m throughout, which is reached without any gas")


def lower_bound(scenario: Scenario, errors: Sequence[float] = (), progress: Report = report_nothing) -> LowerBound:
    """The bound, as a curve that begins at the minimum error and goes on for 0.4 of the error of doing nothing.

    The curve has a point at each of ``errors`` [N m] that can be reached at all, beside its own. The grid is made finer
    until the minimum error, and the minimum gas at the curve's first and middle error, move by less than 1 %.
    SimulationError for a scenario that it cannot do, or where the optimiser does not converge.
    """
    check_bounded(scenario)
    intervals, moved = FIRST_INTERVALS, np.inf
    solver = BoundSolver(scenario, intervals)
    before = _probe(solver)
    while moved > FINE_ENOUGH and 2 * intervals <= MAXIMUM_INTERVALS:
        intervals *= 2
        progress(Progress(f"lower bound with {intervals} intervals"))
        solver = BoundSolver(scenario, intervals)
        after = _probe(solver)
        moved = max(abs(new / old - 1.0) for old, new in zip(before, after, strict=True))
        before = after
    least = solver.least_error()
    reachable = sorted({*_curve_errors(solver, least), *(error for error in errors if error > least.rms_error)})
    progress(Progress(f"lower bound: minimum gas at {len(reachable)} errors"))
    curve = tuple(solver.trade_off(reachable))
    return LowerBound(least, curve, intervals, float(moved), solver.unmeasurable)


def play_optimum(scenario: Scenario, optimum: Optimum) -> Played:
    """What the engine makes of an optimal command, given to it as a recorded one; the valve follows at once."""
    bare = replace(at_once(scenario), control=Control(PYTHON_CONTROLLER, {}, scenario.control.period))
    run = plan_run(bare)
    command = valve_command(optimum, run.step, run.step_count)
    record = replay(batch_of(run), StepInputs(command, {})).record[:, :, 0]
    rows = state_row_numbers(run)
    angle, *masses = (record[:, rows[f"state.{name}"]] for name in ("angle", "mass_1", "mass_2"))
    pressure_1, pressure_2 = chamber_pressures(run.plant, angle, *masses)
    times = run.step * run.record_every * np.arange(record.shape[0], dtype=np.float64)
    channels = {
        "torque": Channel(run.plant.torque_constant * np.subtract(pressure_1, pressure_2), "N m"),
        "reference": Channel(np.asarray(profile_values(bare.reference, times)[0]), "N m"),
        "supplied_mass": Channel(record[:, rows["state.supplied_mass"]], "kg"),
    }
    recording = Recording(scenario.name, times, channels, kind="simulated")
    return Played(rms_error(recording), gas_supplied(recording))


def valve_command(optimum: Optimum, step: float, step_count: int) -> Floats:
    """Mean command [-] of every step [s]: the opening, or one way and then the other where both are open.

    The steps of an interval are then shared out between the two ways, each opened as far as gives its mean.
    """
    edges = step * np.arange(step_count + 1)
    up, down = np.maximum(optimum.towards_1, 0.0), np.maximum(optimum.towards_2, 0.0)
    ends = np.append(optimum.times, edges[-1])
    travelled = np.concatenate([[0.0], np.cumsum((up - down) * np.diff(ends))])
    mean = np.diff(np.interp(edges, ends, travelled)) / step
    held = np.searchsorted(optimum.times, edges[:-1] + 0.5 * step, side="right") - 1
    first = np.searchsorted(held, np.arange(optimum.times.size))
    steps = np.diff(np.append(first, step_count))
    is_shared = (np.minimum(up, down) > CLOSED) & (steps > 1)
    upward = np.clip(np.round(steps * up / np.maximum(up + down, CLOSED)), 1, np.maximum(steps - 1, 1))
    high = np.minimum(1.0, up * steps / upward)[held]
    low = np.minimum(1.0, down * steps / np.maximum(steps - upward, 1))[held]
    goes_up = np.arange(step_count) - first[held] < upward[held]
    command: Floats = np.where(is_shared[held], np.where(goes_up, high, -low), mean)
    return command


def _probe(solver: BoundSolver) -> tuple[float, ...]:
    """The minimum error [N m], the gas [kg] it takes, and the minimum gas [kg] at two more errors of the curve."""
    least = solver.least_error()
    errors = _curve_errors(solver, least)
    further = solver.trade_off([errors[0], errors[len(errors) // 2]])
    return least.rms_error, least.gas, *(optimum.gas for optimum in further)


def _curve_errors(solver: BoundSolver, least: Optimum) -> list[float]:
    """Errors [N m] above the minimum, near it close together, up to a fraction of the error of doing nothing."""
    excess = solver.idle_error * np.geomspace(*CURVE_FRACTIONS, CURVE_POINTS)
    return [least.rms_error + float(value) for value in excess]
