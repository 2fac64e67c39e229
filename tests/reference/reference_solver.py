"""Integrates one run with CVODE from event to event: samples, valve switchings, breakaway, reversal, stops.

First the sampled controller beside a solution in continuous time, with what it sees and commands late; then stick, slip
and stops as the modes between which the solver switches; then the solution; last how far the lanes are from it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.continuous_time import mode_at_rest, torque_at_rest
from ppafo.engine.in_python import in_program
from ppafo.engine.lanes import BatchResult, run_batch, samples_in
from ppafo.engine.rows import leaf_paths, numbers, rebuilt
from ppafo.engine.run import Run, batch_of, states_at_start
from ppafo.errors import SimulationError
from ppafo.model.plant import PlantParameters
from ppafo.model.ports import at_valve, friction_at_rest, rebound, sent_command, shown_signals
from ppafo.model.sensors import Measurement, measure
from tests.interpreted import load_source
from tests.reference.reference_slopes import (
    PLANT_UNKNOWNS,
    gas_unknowns,
    right_hand_side_source,
    unknowns_before_valve,
)

SAME_TIME = 1.0e-12
"""Difference [s] below which two instants count as equal."""
SLOWEST_REBOUND = 1.0e-7
"""Angular velocity [rad/s] below which a rebound is neglected."""
Signals = tuple[float, float, float]
"""Angle [rad] and both absolute pressures [Pa]."""


class Roots(NamedTuple):
    """Two root functions, positive during a mode; the mode ends when one becomes zero."""

    first: float
    second: float


def roots_at_rest(plant: PlantParameters, angle: float, torque: float) -> Roots:
    """Margins of the torque to breakaway in both directions [N m]; a stop withstands any torque."""
    # A constant has no zero: the solver never leaves the mode through a stop that holds.
    towards_upper = 1.0 if angle >= plant.angle_max else plant.static_torque - torque
    towards_lower = 1.0 if angle <= plant.angle_min else plant.static_torque + torque
    return Roots(towards_upper, towards_lower)


def roots_sliding(plant: PlantParameters, angle: float, angular_velocity: float, way: float) -> Roots:
    """Speed in the direction of motion [rad/s], and distance to the next stop [rad]."""
    ahead = plant.angle_max - angle if way > 0.0 else angle - plant.angle_min
    return Roots(way * angular_velocity, ahead)


def after_stop(run: Run, states: Mapping[str, Any], angular_velocity: float) -> float:
    """Angular velocity [rad/s] after an impact on a stop; 0 for a negligible rebound."""
    thrown_back = float(in_program(rebound, run.program, run.effects)(states, angular_velocity))
    # Rebounds follow in ever shorter times: without a lowest speed the solver would restart without end.
    return thrown_back if abs(thrown_back) > SLOWEST_REBOUND else 0.0


class SampledControl:
    """Keeps what the sensors have seen, the controller's state, and the commands that are on their way to the valve."""

    def __init__(self, run: Run, first_signals: Signals) -> None:
        if run.program.controller is None:
            raise SimulationError("the reference solver runs controllers of the catalogue only")
        self._run = run
        self._controller = run.program.controller
        self._inverts = run.program.inverts_valve
        self._state = run.program.controller.initial
        self._first_signals = first_signals
        self._seen: dict[int, Signals] = {}
        self._on_the_way: list[tuple[float, float]] = []
        self.decided = 0.0

    def decide(self, sample: int, time: float, present: Signals) -> None:
        """Take a sample at ``time`` [s] and send the new command on its way."""
        run = self._run
        wanted = run.program.reference.value(run.reference, time)[0]
        seen = self._measurement(sample, present)
        asked, self._state = self._controller.update(run.controller, self._state, wanted, seen, run.period)
        self.decided = in_program(sent_command, run.program, run.effects)({}, asked) if self._inverts else asked
        self._on_the_way.append((time + run.command_delay, self.decided))

    def looks(self, next_sample: int) -> dict[float, int]:
        """Times [s] before the next sample at which a late sensor looks, each with the sample that will use it."""
        run = self._run
        if run.signal_delay <= 0.0:
            return {}
        ahead = range(next_sample, next_sample + int(run.signal_delay / run.period) + 2)
        return {index * run.period - run.signal_delay: index for index in ahead}

    def keep(self, sample: int, signals: Signals) -> None:
        """Keep what a late sensor sees now for a sample to come."""
        self._seen[sample] = signals

    def arriving(self, time: float, command: float) -> float:
        """Command at the valve at ``time`` [s]: the last that has arrived, else the one in force."""
        while self._on_the_way and self._on_the_way[0][0] <= time + SAME_TIME:
            command = self._on_the_way.pop(0)[1]
        return command

    def arrivals(self) -> list[float]:
        """Times [s] at which commands will arrive."""
        return [moment for moment, _ in self._on_the_way]

    def _measurement(self, sample: int, present: Signals) -> Measurement:
        run = self._run
        before_start = sample * run.period < run.signal_delay - SAME_TIME
        signals = self._seen.pop(sample, None) or (self._first_signals if before_start else present)
        if run.program.ideal_sensors:
            angle, pressure_1, pressure_2 = signals
            return Measurement(
                angle=angle,
                pressure_1=pressure_1,
                pressure_2=pressure_2,
                torque=run.program.actuator.torque(run.plant, angle, pressure_1, pressure_2),
            )
        return measure(run.sensors, *signals, run.plant, sample, parts=run.program.functions)


Floats = NDArray[np.float64]


def solve_segment(solver: Any, y: Floats, time: float, end: float, wanted: Floats, name: str) -> Any:
    """Solution from ``time`` to ``end`` [s], or to an event before, also at the ``wanted`` times that lie ahead.

    ``wanted`` may hold times before ``time`` and after ``end``. SimulationError, which calls the solver ``name``, where
    the solver gives up.
    """
    inside = wanted[(wanted > time + SAME_TIME) & (wanted < end - SAME_TIME)]
    grid = np.unique(np.concatenate([[time], inside, [end]]))
    # With only two times the solver would return its own steps instead of the end.
    times = grid if grid.size > 2 else np.array([grid[0], 0.5 * (grid[0] + grid[1]), grid[1]])
    solution = solver.solve(times, y)
    if not solution.success:
        raise SimulationError(f"{name} stopped at t = {solution.t[-1]:.6g} s: {solution.message}")
    return solution


MASS_TOLERANCE = 1e-15
TOLERANCES = (1e-11, 1e-10, *(MASS_TOLERANCE,) * 5)
VALVE_TOLERANCE = 1e-11
STATE_TOLERANCE = 1e-10
MAXIMUM_STEPS = 200_000


@dataclass(slots=True)
class ReferenceResult:
    """Record of one run: times [s], the seven numbers of ``PlantState`` and the command at each; event times [s]."""

    times: Floats
    states: Floats
    commands: Floats
    impacts: list[float] = field(default_factory=list)
    breakaways: list[float] = field(default_factory=list)
    evaluations: int = 0


class RightHandSide(NamedTuple):
    """The compiled right-hand side of a run: ``fill(time, command, way)`` writes the ``slopes`` of the unknowns ``y``.

    Both stay where they are: to copy some numbers there is quicker than to hand over new arrays. ``way`` is that of the
    vane, 0 where it is held.
    """

    y: Floats
    slopes: Floats
    fill: Callable[[float, float, float], None]


def load_right_hand_side(run: Run) -> RightHandSide:
    """Return the right-hand side of a run, whose unknowns are those of ``right_hand_side_source``."""
    program = run.program
    groups = (
        run.plant,
        run.thermal,
        run.valve,
        run.path,
        *(() if run.leg is None else (run.leg.load, run.leg.shank)),
        *run.effects,
    )
    parameters = np.array([number for group in groups for number in numbers(group)])
    y = np.empty(unknowns_before_valve(program) + len(numbers(program.valve.state())))
    slopes = np.empty_like(y)
    compiled = load_source(right_hand_side_source(program)).fill
    return RightHandSide(y, slopes, partial(compiled, y, slopes, parameters))


def solve_reference(run: Run, tolerance: float = 1e-10) -> ReferenceResult:
    """Solve a run to a relative tolerance [-]; the result [SI] is recorded at the run's record times.

    SimulationError where scikit-sundae is not installed or the solver gives up.
    """
    if run.lines is not None:
        raise SimulationError(
            "the reference solver does not support [supply_line]; omit the section to compare with it"
        )
    return _Solution(run, tolerance).solve()


class _Solution:
    """State of one reference solution while it is being made."""

    def __init__(self, run: Run, tolerance: float) -> None:
        self.run = run
        masses = [run.initial.mass_1, run.initial.mass_2] if run.program.is_thermal else []
        stated = [number for state in states_at_start(run) for number in numbers(state)]
        self.y = np.array([*numbers(run.initial), *masses, *stated, *numbers(run.program.valve.state())])
        self.valve_from = unknowns_before_valve(run.program)
        self.show = in_program(shown_signals, run.program, run.effects)
        self.limit = in_program(friction_at_rest, run.program, run.effects)
        self.follows = in_program(at_valve, run.program, run.effects)
        self.settle = in_program(run.program.valve.settle, run.program, run.effects)
        self.driven = torque_at_rest(run)
        self.arrived = 0.0
        self.command = 0.0
        self.time = 0.0
        self.way = self.rest_mode() if run.program.angle is None else 0.0
        if self.y[1] != 0.0 and run.program.angle is None:
            self.way = float(np.sign(self.y[1]))
        self.controller = SampledControl(run, self.present_signals())
        count = samples_in(run.step_count, run.record_every)
        times = np.arange(count, dtype=np.float64) * (run.step * run.record_every)
        self.result = ReferenceResult(times, np.empty((count, PLANT_UNKNOWNS)), np.zeros(count))
        self.records = 0
        self.solver = self.make_solver(tolerance)

    def make_solver(self, tolerance: float) -> Any:
        """CVODE with two root functions that belong to the present mode."""
        try:
            from sksundae.cvode import CVODE
        except ImportError as error:
            raise SimulationError("the reference solver needs scikit-sundae, which a checkout has") from error

        given, found, fill = load_right_hand_side(self.run)

        def slopes(t: float, y: Floats, yp: Floats) -> None:
            self.result.evaluations += 1
            given[:] = y
            fill(t, self.command, self.way)
            yp[:] = found

        def write_roots(t: float, y: Floats, events: Floats) -> None:
            events[:] = self.roots(t, y.tolist())

        roots: Any = write_roots
        roots.terminal = [True, True]
        roots.direction = [-1, -1]
        gas_count = gas_unknowns(self.run.program) - PLANT_UNKNOWNS
        stated = (STATE_TOLERANCE,) * (self.valve_from - gas_unknowns(self.run.program))
        valve_count = self.y.size - self.valve_from
        free = self.run.program.angle is None
        return CVODE(
            slopes,
            rtol=tolerance,
            atol=np.array(TOLERANCES + (MASS_TOLERANCE,) * gas_count + stated + (VALVE_TOLERANCE,) * valve_count),
            eventsfn=roots if free else None,
            num_events=2 if free else 0,
            max_num_steps=MAXIMUM_STEPS,
        )

    def roots(self, time: float, y: Sequence[float]) -> Roots:
        """Root functions of the present mode; Python's floats are several times quicker here than NumPy's."""
        plant = self.run.plant
        if self.way == 0.0:
            return roots_at_rest(self.plant_at(y), y[0], self.torque(time, y))
        return roots_sliding(plant, y[0], y[1], self.way)

    def rest_mode(self) -> float:
        """Mode of the vane at rest with the present gas."""
        y = self.y.tolist()
        return mode_at_rest(self.plant_at(y), y[0], self.torque(self.time, y))

    def torque(self, time: float, y: Sequence[float]) -> float:
        """Torque before friction and damping [N m] with unknowns at a time [s]. Equation (1)."""
        pressures = self.run.program.actuator.pressures(self.run.plant, y[0], y[2], y[3])
        return self.driven(self.states_in(y), time, y[0], *pressures)

    def is_thrown_at_its_stop(self) -> bool:
        """True for a vane on a stop with an angular velocity into it; a root that is 0 at the start is no event."""
        roots = self.roots(self.time, self.y.tolist())
        return self.way != 0.0 and roots.second <= 0.0 < roots.first

    def solve(self) -> ReferenceResult:
        """Sample by sample from beginning to end."""
        run = self.run
        end = float(self.result.times[-1])
        sample = 0
        if run.program.angle is None and self.is_thrown_at_its_stop():
            self.change_mode()
        while self.time < end - SAME_TIME:
            self.controller.decide(sample, self.time, self.present_signals())
            sample += 1
            self.advance_to(min(sample * run.period, end), sample)
        self.record_until(end + 1.0, None)
        return self.result

    def present_signals(self) -> Signals:
        """Angle and pressures now, as the sensors show them."""
        run = self.run
        angle = self.y[0] if run.program.angle is None else run.program.angle.value(run.path, self.time)[0]
        pressure_1, pressure_2 = run.program.actuator.pressures(run.plant, angle, self.y[2], self.y[3])
        signals = float(angle), float(pressure_1), float(pressure_2)
        shown: Signals = self.show(self.states_in(self.y), *signals)
        return shown

    def states_in(self, y: Any) -> dict[str, Any]:
        """States of effects among unknowns, by name."""
        states = {}
        first = gas_unknowns(self.run.program)
        for name, row in self.run.program.effect_states.items():
            count = len(leaf_paths(row, name))
            states[name] = rebuilt(row, map(float, y[first : first + count]))
            first += count
        return states

    def plant_at(self, y: Sequence[float]) -> Any:
        """The plant with the friction that holds the vane at rest with unknowns."""
        plant = self.run.plant
        pressures = self.run.program.actuator.pressures(plant, y[0], y[2], y[3])
        return plant._replace(static_torque=self.limit(self.states_in(y), plant.static_torque, *pressures))

    def advance_to(self, end: float, next_sample: int) -> None:
        """Integrate to the next sample over all that happens on the way."""
        looks = self.controller.looks(next_sample)
        while self.time < end - SAME_TIME:
            for moment, sample in looks.items():
                if abs(moment - self.time) <= SAME_TIME:
                    self.controller.keep(sample, self.present_signals())
            self.take_command()
            self.settle_valve()
            events = [*looks, *self.controller.arrivals(), self.next_valve_event()]
            self.integrate(min([end, *(moment for moment in events if moment > self.time + SAME_TIME)]))

    def take_command(self) -> None:
        """Let the valve have the command that has arrived, and effects between them change with it."""
        self.arrived = self.controller.arriving(self.time, self.arrived)
        self.command = self.arrived
        self.command = self.follows(self.states_in(self.y), self.arrived)
        first = gas_unknowns(self.run.program)
        states = self.states_in(self.y)
        for effect, row in zip(self.run.program.effects, self.run.effects, strict=True):
            if effect.state is None:
                continue
            state = states[effect.state_name]
            settled = state if effect.state.settle is None else effect.state.settle(row, state, self.command)
            self.y[first : first + len(numbers(state))] = numbers(settled)
            first += len(numbers(state))

    def settle_valve(self) -> None:
        """Let the valve make the abrupt changes that are due."""
        given = self.run.valve, self.valve_state(), self.command, self.time
        state = self.settle(self.states_in(self.y), *given)
        self.y[self.valve_from :] = numbers(state)

    def valve_state(self) -> Any:
        """The valve's part of the unknowns."""
        return rebuilt(self.run.program.valve.state, map(float, self.y[self.valve_from :]))

    def next_valve_event(self) -> float:
        """When the valve next changes by itself."""
        valve = self.run.program.valve
        event = valve.next_event(self.run.valve, self.valve_state(), self.command, self.time)
        return float(max(event, self.time + 2 * SAME_TIME))

    def integrate(self, end: float) -> None:
        """Integrate to ``end`` or to the next event of the vane, and change the mode there."""
        if self.run.program.angle is None and self.way == 0.0:
            self.way = self.rest_mode()
            if self.way != 0.0:
                self.result.breakaways.append(self.time)
        wanted = self.result.times[self.records :]
        solution = solve_segment(self.solver, self.y, self.time, end, wanted, "the reference solver")
        self.record_until(solution.t[-1] + SAME_TIME, solution)
        self.time = float(solution.t[-1])
        self.y = np.array(solution.y[-1])
        if self.time < end - SAME_TIME:
            self.change_mode()
        else:
            self.time = end

    def record_until(self, end: float, solution: Any) -> None:
        """Keep the states at the record times before ``end``."""
        times = self.result.times
        while self.records < times.size and times[self.records] < end - 2 * SAME_TIME:
            moment = times[self.records]
            state = self.y if solution is None else solution.y[np.argmin(np.abs(solution.t - moment))]
            self.result.states[self.records] = self.with_prescribed_angle(state[:PLANT_UNKNOWNS], moment)
            self.result.commands[self.records] = self.controller.decided
            self.records += 1

    def with_prescribed_angle(self, state: Floats, time: float) -> Floats:
        """The state with the prescribed angle put in, where there is one."""
        if self.run.program.angle is None:
            return state
        angle, rate, _ = self.run.program.angle.value(self.run.path, time)
        return np.array([angle, rate, *state[2:]])

    def change_mode(self) -> None:
        """The vane breaks away, comes to rest, or meets a stop."""
        plant = self.run.plant
        if self.way == 0.0:
            # The torque equals the static limit to rounding here, so its sign alone says which way the vane goes.
            self.way = 1.0 if self.torque(self.time, self.y.tolist()) > 0.0 else -1.0
            self.result.breakaways.append(self.time)
            return
        roots = self.roots(self.time, self.y.tolist())
        if abs(roots.second) < abs(roots.first):
            self.result.impacts.append(self.time)
            self.y[0] = plant.angle_max if self.way > 0.0 else plant.angle_min
            self.y[1] = after_stop(self.run, self.states_in(self.y), self.y[1])
        else:
            self.y[1] = 0.0
        self.way = float(np.sign(self.y[1])) if self.y[1] != 0.0 else self.rest_mode()


IMPACT_WINDOW = 5.0e-3


@dataclass(frozen=True, slots=True)
class Agreement:
    """Largest and root-mean-square differences as fractions of the angle range and of the supply's gauge pressure [-].

    Where the supply is at the pressure of the atmosphere, that pressure stands for the gauge pressure. Instants within
    5 ms of an impact on a stop are left out. ``supplied`` is relative, ``impacts`` in seconds.
    """

    angle: float
    pressure_1: float
    pressure_2: float
    angle_rms: float
    pressure_1_rms: float
    pressure_2_rms: float
    supplied: float
    impacts: tuple[float, ...]

    @property
    def worst_pressure(self) -> float:
        """The larger of the two largest pressure differences [-]."""
        return max(self.pressure_1, self.pressure_2)

    @property
    def worst_rms(self) -> float:
        """The largest of the root-mean-square differences [-]."""
        return max(self.angle_rms, self.pressure_1_rms, self.pressure_2_rms)


def compare_with_reference(run: Run, reference: ReferenceResult | None = None) -> Agreement:
    """Run the lanes and, unless it is given, the reference solver, and compare them at the record times."""
    reference = reference or solve_reference(run)
    return measure_agreement(run, run_batch(batch_of(run)), reference)


def measure_agreement(run: Run, outcome: BatchResult, reference: ReferenceResult) -> Agreement:
    """Differences between a recorded run of the lanes and the reference."""
    plant = run.plant
    states = plant_states(run, outcome)
    away = np.ones(reference.times.size, dtype=bool)
    for impact in reference.impacts:
        away &= np.abs(reference.times - impact) > IMPACT_WINDOW
    gauge = max(plant.supply_pressure, plant.dorsiflexion_pressure) - plant.atmospheric_pressure
    pressure_range = gauge if gauge > 0.0 else plant.atmospheric_pressure
    ours = chamber_pressures_of(run, states)
    theirs = chamber_pressures_of(run, reference.states)
    differences = [
        (states[:, 0] - reference.states[:, 0]) / (plant.angle_max - plant.angle_min),
        (ours[0] - theirs[0]) / pressure_range,
        (ours[1] - theirs[1]) / pressure_range,
    ]
    largest = [float(np.abs(difference[away]).max()) for difference in differences]
    rms = [float(np.sqrt(np.mean(difference[away] ** 2))) for difference in differences]
    supplied = float(abs(states[-1, 4] - reference.states[-1, 4]) / max(abs(reference.states[-1, 4]), 1e-12))
    return Agreement(
        angle=largest[0],
        pressure_1=largest[1],
        pressure_2=largest[2],
        angle_rms=rms[0],
        pressure_1_rms=rms[1],
        pressure_2_rms=rms[2],
        supplied=supplied,
        impacts=tuple(reference.impacts),
    )


def plant_states(run: Run, outcome: BatchResult) -> Floats:
    """The seven numbers [SI] of ``PlantState`` at each record (records, 7) of the first run in a result."""
    paths = [path for name, row in run.program.state_rows().items() for path in leaf_paths(row, name)]
    first = paths.index("state.angle")
    return outcome.record[:, first : first + 7, 0]


def chamber_pressures_of(run: Run, states: Floats) -> tuple[Floats, Floats]:
    """Both pressures [Pa absolute] of states (records, 7)."""
    pressures = run.program.actuator.pressures
    pairs = [pressures(run.plant, float(row[0]), float(row[2]), float(row[3])) for row in states]
    return np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs])
