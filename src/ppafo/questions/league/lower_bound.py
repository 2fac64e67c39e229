"""The minimum error and the minimum gas that any control of a valve could reach on a task, by optimal control.

Held or prescribed motion, isothermal gas. Sampling, sensors, dead band, delays and spool are left out: each of them can
only make a task harder, so what is found without them bounds what is possible with them. The optimiser finds a local
optimum; that it is the best there is, is checked only by every controller staying above it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.replay import StepInputs, replay
from ppafo.engine.run import batch_of
from ppafo.errors import SimulationError
from ppafo.metrics.gas import gas_supplied
from ppafo.metrics.tracking import rms_error
from ppafo.model.plant import chamber_pressures
from ppafo.parameters.device import VANE
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.league.bound_problem import BOUNDED_VALVES, at_once
from ppafo.questions.league.bound_solver import BoundSolver, Optimum
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.plan import plan_run, profile_values
from ppafo.simulation.sampled import state_row_numbers
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, PrescribedMotion, Scenario
from ppafo.translation.plant_rates import check_without_opensim

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
    check_without_opensim()
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
