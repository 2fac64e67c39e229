"""One closed-loop run at 1 kHz: the lanes against general-purpose solvers, in time and in accuracy."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.report import MISSING_EXTRA, Line, Target
from benchmarks.sampled_solvers import (
    SolverFactory,
    cvode_interval,
    has_cvode,
    has_lsoda,
    lsoda_interval,
    solve_by_samples,
)
from benchmarks.task import torque_task, torque_task_scenario
from benchmarks.timing import Timing, time_in_turn
from ppafo.engine.lanes import Floats, run_batch
from ppafo.engine.run import Run, batch_of
from ppafo.simulation.simulate import simulate, simulate_many
from tests.reference.reference_solver import chamber_pressures_of, plant_states, solve_reference

GROUP = "One closed-loop run at 1 kHz"
CALLS_PER_REPETITION = 20
LSODA_TARGET = Target(100.0, at_least=True)


MANY = 100
_WHOLE = {
    "simulate": ("ppafo.simulate of it, recording and metrics read", CALLS_PER_REPETITION),
    "many": (f"a run of {MANY} by ppafo.simulate_many, nothing read, one thread", MANY),
    "many_read": ("... with recording and metrics read", MANY),
}


@dataclass(frozen=True, slots=True)
class Competitor:
    """A general-purpose solver at one tolerance."""

    id: str
    name: str
    make: SolverFactory
    is_installed: Callable[[], bool]
    tolerance: float
    target: Target | None = None


COMPETITORS = (
    Competitor("lsoda", "solve_ivp LSODA, rtol 1e-6", lsoda_interval, has_lsoda, 1e-6, LSODA_TARGET),
    Competitor("lsoda_loose", "solve_ivp LSODA, rtol 1e-3", lsoda_interval, has_lsoda, 1e-3),
    Competitor("lsoda_tight", "solve_ivp LSODA, rtol 1e-9", lsoda_interval, has_lsoda, 1e-9),
    Competitor("cvode", "SUNDIALS CVODE, rtol 1e-6", cvode_interval, has_cvode, 1e-6),
    Competitor("cvode_tight", "SUNDIALS CVODE, rtol 1e-9", cvode_interval, has_cvode, 1e-9),
)


def lane_states(run: Run) -> Floats:
    """The seven numbers of ``PlantState`` at every sample (samples + 1, 7), from the lanes."""
    return plant_states(run, run_batch(batch_of(run)))


def pressure_error(run: Run, states: Floats, reference: Floats) -> float:
    """Largest difference of both chamber pressures over the supply's gauge pressure [-]."""
    plant = run.plant
    span = max(plant.supply_pressure, plant.dorsiflexion_pressure) - plant.atmospheric_pressure
    pairs = zip(chamber_pressures_of(run, states), chamber_pressures_of(run, reference), strict=True)
    return max(float(np.abs(ours - theirs).max()) for ours, theirs in pairs) / span


def measure_single_run(duration: float, repetitions: int, say: Callable[[str], None]) -> list[Line]:
    """Lines about one run of ``duration`` [s]."""
    run = torque_task(duration)
    present = [competitor for competitor in COMPETITORS if competitor.is_installed()]
    contenders: dict[str, Callable[[], object]] = {
        "lanes": lambda: [lane_states(run) for _ in range(CALLS_PER_REPETITION)]
    }
    scenario = torque_task_scenario(duration)
    contenders |= {
        "simulate": lambda: [simulate(scenario).metrics for _ in range(CALLS_PER_REPETITION)],
        "many": lambda: simulate_many([scenario] * MANY, threads=1),
        "many_read": lambda: [result.metrics for result in simulate_many([scenario] * MANY, threads=1)],
    }
    for name in ("simulate", "many_read"):
        contenders[name]()
    contenders |= {competitor.id: _contender(run, competitor) for competitor in present}
    say("one run: warming up")
    states = {"lanes": lane_states(run)} | {
        competitor.id: solve_by_samples(run, competitor.make(run, competitor.tolerance)) for competitor in present
    }
    say(f"one run: {repetitions} repetitions of {', '.join(contenders)}")
    timings = time_in_turn(contenders, repetitions)
    lanes = Timing(tuple(seconds / CALLS_PER_REPETITION for seconds in timings["lanes"].seconds))
    lines = [_lane_line(duration, lanes)]
    for name, (what, calls) in _WHOLE.items():
        seconds = timings[name].best / calls
        lines.append(Line(f"single_run_{name}", GROUP, what, 1e3 * seconds, "ms"))
    lines += [_ratio_line(competitor, lanes, timings.get(competitor.id)) for competitor in COMPETITORS]
    return lines + _error_lines(run, states, say)


def _contender(run: Run, competitor: Competitor) -> Callable[[], object]:
    return lambda: solve_by_samples(run, competitor.make(run, competitor.tolerance))


def _lane_line(duration: float, lanes: Timing) -> Line:
    return Line(
        id="single_run_time",
        group=GROUP,
        what=f"ppafo, {duration:g} s recorded at 1 kHz",
        value=1e3 * lanes.best,
        unit="ms",
        spread=(1e3 * lanes.worst, 1e3 * lanes.best),
    )


def _ratio_line(competitor: Competitor, lanes: Timing, timing: Timing | None) -> Line:
    what = f"times faster than {competitor.name}"
    line_id = f"single_run_against_{competitor.id}"
    if timing is None:
        return Line(line_id, GROUP, what, None, "", competitor.target, note=MISSING_EXTRA)
    ratios = timing.best / lanes.best
    spread = (timing.best / lanes.worst, timing.worst / lanes.best)
    note = f"{timing.best:.3g} s, restarted at every sample"
    return Line(line_id, GROUP, what, ratios, "", competitor.target, spread, note)


def _error_lines(run: Run, states: dict[str, Floats], say: Callable[[str], None]) -> list[Line]:
    names = {"lanes": "ppafo"} | {competitor.id: competitor.name for competitor in COMPETITORS}
    what = {name: f"largest pressure error of {label}" for name, label in names.items()}
    if not has_cvode():
        return [Line(f"single_run_error_{name}", GROUP, what[name], None, "", note=MISSING_EXTRA) for name in names]
    say("one run: the reference solution, rtol 1e-10")
    reference = solve_reference(run).states
    errors = {name: pressure_error(run, values, reference) for name, values in states.items()}
    return [
        Line(
            f"single_run_error_{name}",
            GROUP,
            what[name],
            errors.get(name),
            "of the range",
            note="" if name in errors else MISSING_EXTRA,
        )
        for name in names
    ]
