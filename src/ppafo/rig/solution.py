"""Integrates one run on the rig from event to event, by LSODA: samples, arriving commands, valve, stick-slip, stops.

Friction is Coulomb's with a static limit and Stribeck's curve, both growing with pressure, and sticking is a mode that
root functions begin and end, as in the reference solver. A bristle model would need no modes, but to agree with
equation (10) to 1e-3 of the angle range its stiffness must be some 1e7 N m/rad, and a solver would crawl through every
reversal; with modes no kink lies inside a step, and without the extra terms the rig is equation (10) exactly.

The right-hand side is compiled from the same source text as all compiled physics. The valve and a path of the vane stay
outside, in Python: what they ask for comes in as numbers. So there is one program for all devices and experiments, and
a new computer compiles once.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.engine.continuous_time import SAME_TIME, Roots, after_stop, roots_at_rest, roots_sliding
from ppafo.engine.entries import ARRAY, FLOAT, HEADER, INLINE, entry_text, with_arrays
from ppafo.engine.led_leg import torque_of_leg
from ppafo.engine.loading import load_source
from ppafo.engine.rows import leaf_paths, numbers, rebuild, row_expression
from ppafo.engine.run import Run
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import SimulationError
from ppafo.model.effects.spool_play import spool_position
from ppafo.model.orifice import ExactOrifice
from ppafo.model.plant import Openings, actuator_torque, holds_still
from ppafo.model.sensors import Measurement
from ppafo.parameters.device import Device
from ppafo.rig.dynamics import RigNumbers, RigPhysics, RigState, observables, rig_rates
from ppafo.rig.preset import Sensor

Floats = NDArray[np.float64]
Slopes = Callable[[float, Floats], Floats]
Distances = Callable[[float, Floats], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class RigRun:
    """A run on the rig.

    The device as it truly is, its plain run, the richer physics, sensors and when they are read, play of the valve [-].
    """

    device: Device
    run: Run
    physics: RigPhysics
    line_orifice: ExactOrifice
    initial: RigState
    sensors: dict[str, Sensor]
    sample_times: Floats
    control_period: float
    command_delay: float
    hysteresis: float


@dataclass(slots=True)
class RigSolution:
    """True state (samples, unknowns of ``RigState``), pressures [Pa] and command at each sample; impacts [s]."""

    states: Floats
    pressures: Floats
    commands: Floats
    impacts: list[float] = field(default_factory=list)
    breakaways: list[float] = field(default_factory=list)


def sensor_signals(physics: RigPhysics, state: Floats, pressures: Floats) -> tuple[float, float, float]:
    """Return angle [rad] and both pressures [Pa] behind the bandwidth of the sensors, before noise."""
    now, is_slow = RigState._make(state.tolist()), physics.pressure_follow_rate > 0.0
    first, second = (now.sensor_pressure_1, now.sensor_pressure_2) if is_slow else pressures.tolist()
    return now.sensor_angle if physics.angle_follow_rate > 0.0 else now.angle, first, second


UNKNOWNS = len(RigState._fields)
OUTPUTS = 4
"""Numbers that ``show`` writes: both pressures [Pa], driving torque and static limit of friction [N m]."""

# The valve has the first four.
ANGLE, RATE, ADDED = 4, 5, 6
INPUTS = 7
"""Numbers that come from outside: four openings, angle [rad] and prescribed rate [rad/s] of the vane, and the torque
of a leg on it [N m]."""


@functools.cache
def rig_source() -> str:
    """Return the module of ``fill(y, slopes, parameters, inputs, direction)`` and of ``show`` with ``outputs``.

    ``y`` and ``slopes`` belong to the unknowns of ``RigState``.
    """
    collector = SourceCollector(INLINE)
    add = collector.add
    cells = {path: f"parameters[{number}]" for number, path in enumerate(leaf_paths(RigNumbers, "given"))}
    cells |= {f"state.{field}": f"y[{number}]" for number, field in enumerate(RigState._fields)}
    cells |= {f"openings.{field}": f"inputs[{number}]" for number, field in enumerate(Openings._fields)}
    rows = {"given": RigNumbers, "state": RigState, "openings": Openings}
    rebuilt = [f"{name} = {row_expression(row, name, cells, add)}" for name, row in rows.items()]
    motion = f"inputs[{ANGLE}], inputs[{RATE}], inputs[{ADDED}], direction"
    fill = [f"rates = {add(rig_rates)}(given, openings, state, {motion})"]
    fill += [f"slopes[{number}] = rates.{field}" for number, field in enumerate(RigState._fields)]
    show = [f"now = {add(observables)}(given, state, inputs[{ANGLE}], inputs[{ADDED}])"]
    outputs = ("node_1.pressure", "node_2.pressure", "torque", "static_limit")
    show += [f"outputs[{number}] = now.{path}" for number, path in enumerate(outputs)]
    functions = []
    for name, output, lines in (("fill", "slopes", fill), ("show", "outputs", show)):
        arrays = dict.fromkeys(("y", output, "parameters", "inputs"), ARRAY)
        functions.append(entry_text(name, arrays | {"direction": FLOAT}, rebuilt + lines))
    return "\n\n\n".join([HEADER, collector.text(), *functions])


_TOLERANCES = {"angle": 1e-10, "angular_velocity": 1e-9, "sensor_angle": 1e-9}
_BY_KIND = {"mass": 1e-13, "drop": 1e-2, "pressure": 1e-2}
_ENERGY_TOLERANCE, _VALVE_TOLERANCE = 1e-8, 1e-10


def absolute_tolerances(valve_unknowns: int) -> Floats:
    """Return the absolute tolerances of all unknowns [SI], the valve's last."""
    tolerances = []
    # Below a millionth of usual values: of a chamber 1e-4 kg and 10 J, of a supply 1e5 Pa.
    for name in RigState._fields:
        by_kind = next((size for kind, size in _BY_KIND.items() if kind in name), _ENERGY_TOLERANCE)
        tolerances.append(_TOLERANCES.get(name, by_kind))
    return np.array(tolerances + [_VALVE_TOLERANCE] * valve_unknowns)


TOLERANCE = 1.0e-8
MAXIMUM_STEPS = 100_000
_WITHIN = 4.0 * float(np.finfo(np.float64).eps)


class Stretch(NamedTuple):
    """Unknowns (times, unknowns) at the times [s] that were wanted and at the last one, where it ended."""

    t: Floats
    y: Floats


def solve_stretch(
    slopes: Slopes, tolerances: Floats, roots: Distances | None, y: Floats, time: float, end: float, wanted: Floats
) -> Stretch:
    """Unknowns from ``time`` to ``end`` [s], or to where one of two roots falls to 0, also at the ``wanted`` times.

    A root that is 0 at the start ends nothing. SimulationError where the solver gives up.
    """
    from scipy.integrate import LSODA

    solver = LSODA(slopes, time, y, end, rtol=TOLERANCE, atol=tolerances)
    times, states = [time], [np.array(y)]
    before = None if roots is None else roots(time, y)
    # The ends are states of the solver itself, not of its interpolant.
    waiting = list(wanted[(wanted > time) & (wanted < end)])
    for _ in range(MAXIMUM_STEPS):
        said = solver.step()
        if solver.status == "failed":
            raise SimulationError(f"the rig's solver stopped at t = {solver.t:.6g} s: {said}")
        after, event = float(solver.t), None
        # The interpolant is valid in the last step only, so it is asked for in each.
        inside = solver.dense_output()
        if roots is not None and before is not None:
            now = roots(after, solver.y)
            # Strictly above 0 before: a vane that just came to rest has not done so again.
            crossed = [number for number in (0, 1) if before[number] > 0.0 >= now[number]]
            event = min((_root(roots, number, inside, float(solver.t_old), after) for number in crossed), default=None)
            before = now
        last = after if event is None else event
        while waiting and waiting[0] < last:
            moment = waiting.pop(0)
            times.append(moment)
            states.append(inside(moment))
        if event is not None or solver.status == "finished":
            times.append(last)
            states.append(inside(last) if event is not None else np.array(solver.y))
            return Stretch(np.array(times), np.array(states))
    raise SimulationError(f"the rig's solver took {MAXIMUM_STEPS} steps up to t = {solver.t:.6g} s")


def _root(roots: Distances, number: int, inside: Callable[[float], Floats], start: float, end: float) -> float:
    """Where a root falls to 0 within a step [s]."""
    from scipy.optimize import brentq

    found: float = brentq(lambda t: roots(t, inside(t))[number], start, end, xtol=1.0e-15, rtol=_WITHIN)
    return found


def solve_rig(rig_run: RigRun) -> RigSolution:
    """Return the solution of a run; SimulationError where the solver gives up."""
    return _Rig(rig_run).solve()


class _Rig:
    """State of one solution while it is being made."""

    def __init__(self, rig_run: RigRun) -> None:
        self.rig_run, self.run, self.plant = rig_run, rig_run.run, rig_run.run.plant
        run, state = rig_run.run, rig_run.run.program.valve.initial()
        self.is_free = run.program.angle is None
        given = RigNumbers(
            plant=run.plant,
            rig=rig_run.physics,
            valve_orifice=run.valve_orifice,
            leak_orifice=run.leak_orifice,
            line_orifice=rig_run.line_orifice,
        )
        parameters = np.array(numbers(given))
        self.y = np.array([*rig_run.initial, *numbers(state)], dtype=np.float64)
        self.tolerances = absolute_tolerances(self.y.size - UNKNOWNS)
        self.outputs, self.inputs = np.empty(OUTPUTS), np.zeros(INPUTS)
        self.present, self.rates = np.empty(UNKNOWNS), np.empty(UNKNOWNS)
        module = load_source(rig_source())
        self.fill = with_arrays(module.fill, self.present, self.rates, parameters, self.inputs)
        self.show = with_arrays(module.show, self.present, self.outputs, parameters, self.inputs)
        self.valve_moves = True
        # Each evaluation makes a state of numbers, for which a flat one needs no search for what it nests.
        self.has_flat_valve = not any(isinstance(value, tuple) for value in state)
        self.time, self.command, self.direction = 0.0, 0.0, 0.0
        self.decided, self.spool = 0.0, 0.0
        self.pending_commands: list[tuple[float, float]] = []
        self.controller_state = None if run.program.controller is None else run.program.controller.initial
        self.recorded = 0
        count = rig_run.sample_times.size
        self.result = RigSolution(np.empty((count, UNKNOWNS)), np.empty((count, 2)), np.zeros(count))
        if self.is_free:
            self.direction = float(np.sign(self.y[1])) if self.y[1] != 0.0 else self.rest_mode()

    def slopes(self, t: float, y: Floats) -> Floats:
        """Return the right-hand side; the valve is asked anew only while it moves."""
        slopes = np.empty_like(y)
        slopes[UNKNOWNS:] = self.ask_valve(y) if self.valve_moves else 0.0
        self.place_vane(t, y)
        self.fill(self.direction)
        slopes[:UNKNOWNS] = self.rates
        return slopes

    def ask_valve(self, y: Floats) -> list[float]:
        """Put the valve's openings into the inputs and return the slopes of its state."""
        valve, state = self.run.program.valve, self.valve_state(y)
        self.inputs[:ANGLE] = valve.instant(self.run.valve, state, self.command)
        return numbers(valve.rates(self.run.valve, state, self.command))

    def valve_state(self, y: Floats) -> Any:
        """Return the valve's part of the unknowns."""
        state, values = self.run.program.valve.state, y[UNKNOWNS:].tolist()
        return state(*values) if self.has_flat_valve else rebuild(state, values)

    def place_vane(self, t: float, y: Floats) -> None:
        """Put a state into the arrays of the compiled functions, with a prescribed angle and the torque of a leg."""
        path, leg = self.run.program.angle, self.run.leg
        if leg is not None:
            self.inputs[ADDED] = torque_of_leg(self.run.program, leg, t, float(y[0]))
        # The rate of a free vane is one of the unknowns.
        self.inputs[ANGLE], self.inputs[RATE] = (y[0], 0.0) if path is None else path.value(self.run.path, t)[:2]
        self.present[:] = y[:UNKNOWNS]

    def observe(self, t: float, y: Floats) -> Floats:
        """Return both pressures [Pa], driving torque and static limit of friction [N m] of a state."""
        self.place_vane(t, y)
        self.show(self.direction)
        return self.outputs

    def roots(self, t: float, y: Floats) -> Roots:
        """Return the distance from breakaway, or from standstill and the stop ahead."""
        if self.direction != 0.0:
            return roots_sliding(self.plant, float(y[0]), float(y[1]), self.direction)
        _, _, torque, limit = self.observe(t, y).tolist()
        return roots_at_rest(self.plant._replace(static_torque=limit), float(y[0]), torque)

    def rest_mode(self) -> float:
        """Return the way in which a vane at rest sets off, 0 where it is held."""
        _, _, torque, limit = self.observe(self.time, self.y).tolist()
        angle, plant = float(self.y[0]), self.plant
        if holds_still(torque, limit, angle <= plant.angle_min, angle >= plant.angle_max):
            return 0.0
        return 1.0 if torque > 0.0 else -1.0

    def solve(self) -> RigSolution:
        """Return the solution, from sample to sample of the controller."""
        end = float(self.rig_run.sample_times[-1])
        sample = 0
        while self.time < end - SAME_TIME:
            self.decide(sample)
            sample += 1
            self.advance_to(min(sample * self.rig_run.control_period, end))
        self.record_until(end + 1.0, None)
        return self.result

    def decide(self, sample: int) -> None:
        """Let the controller see the sensors and send its command on its way."""
        rig, run, controller = self.rig_run, self.run, self.run.program.controller
        if controller is None:
            raise SimulationError("the simulated test bench runs controllers of the catalogue only")
        # The noise is the last recorded sample's.
        index = max(0, int(np.searchsorted(rig.sample_times, self.time + SAME_TIME, side="right")) - 1)
        pressures = self.observe(self.time, self.y)[:2]
        signals = sensor_signals(rig.physics, self.prescribe_angle(self.y, self.time), pressures)
        angle, first, second = (
            rig.sensors[name].reads(value, index)
            for name, value in zip(("angle", "pressure_1", "pressure_2"), signals, strict=True)
        )
        measured = Measurement(
            angle=angle,
            pressure_1=first,
            pressure_2=second,
            torque=actuator_torque(first, second, self.plant.torque_constant),
        )
        requested = run.program.reference.value(run.reference, sample * rig.control_period)[0]
        self.decided, self.controller_state = controller.update(
            run.controller, self.controller_state, requested, measured, run.period
        )
        self.spool = spool_position(self.spool, self.decided, rig.hysteresis)
        self.pending_commands.append((self.time + rig.command_delay, self.spool))

    def advance_to(self, end: float) -> None:
        """Integrate over all that happens on the way."""
        valve = self.run.program.valve
        while self.time < end - SAME_TIME:
            while self.pending_commands and self.pending_commands[0][0] <= self.time + SAME_TIME:
                self.command = self.pending_commands.pop(0)[1]
            state = valve.settle(self.run.valve, self.valve_state(self.y), self.command, self.time)
            self.y[UNKNOWNS:] = numbers(state)
            # An event that is now would not let time go on.
            event = max(valve.next_event(self.run.valve, state, self.command, self.time), self.time + 2 * SAME_TIME)
            later = [moment for moment, _ in self.pending_commands if moment > self.time + SAME_TIME]
            self.integrate(min([end, event, *later]))

    def integrate(self, end: float) -> None:
        """Integrate to ``end`` or to the next event of the vane, and change the mode there."""
        if self.is_free and self.direction == 0.0:
            self.direction = self.rest_mode()
            if self.direction != 0.0:
                self.result.breakaways.append(self.time)
        # A valve whose slopes are 0 stays where it is, because they depend on nothing but its state and the command.
        self.valve_moves = any(self.ask_valve(self.y))
        times = self.rig_run.sample_times[self.recorded :]
        roots = self.roots if self.is_free else None
        solution = solve_stretch(self.slopes, self.tolerances, roots, self.y, self.time, end, times)
        self.record_until(float(solution.t[-1]) + SAME_TIME, solution)
        self.time = float(solution.t[-1])
        self.y = np.array(solution.y[-1])
        if self.time < end - SAME_TIME:
            self.change_mode()
        else:
            self.time = end

    def record_until(self, end: float, solution: Stretch | None) -> None:
        """Keep the states at the samples before ``end``."""
        times = self.rig_run.sample_times
        while self.recorded < times.size and times[self.recorded] < end - 2 * SAME_TIME:
            moment, index = float(times[self.recorded]), self.recorded
            state = self.y if solution is None else solution.y[np.argmin(np.abs(solution.t - moment))]
            self.result.states[index] = self.prescribe_angle(state, moment)
            self.result.pressures[index] = self.observe(moment, state)[:2]
            self.result.commands[index] = self.decided
            self.recorded += 1

    def prescribe_angle(self, state: Floats, time: float) -> Floats:
        """Return the unknowns of ``RigState`` with the prescribed angle put in, where there is one."""
        unknowns = np.array(state[:UNKNOWNS])
        if self.run.program.angle is not None:
            unknowns[0], unknowns[1], _ = self.run.program.angle.value(self.run.path, time)
        return unknowns

    def change_mode(self) -> None:
        """Let the vane break away, come to rest, or meet a stop."""
        if self.direction == 0.0:
            self.direction = 1.0 if self.observe(self.time, self.y)[2] > 0.0 else -1.0
            self.result.breakaways.append(self.time)
            return
        # Of the two distances the one that ended the stretch is 0 but for rounding.
        roots = self.roots(self.time, self.y)
        if abs(roots.second) < abs(roots.first):
            self.result.impacts.append(self.time)
            # Onto the stop itself: a rounding beyond it would be another impact at once.
            self.y[0] = self.plant.angle_max if self.direction > 0.0 else self.plant.angle_min
            self.y[1] = after_stop(self.run, {}, float(self.y[1]))
        else:
            self.y[1] = 0.0
        self.direction = float(np.sign(self.y[1])) if self.y[1] != 0.0 else self.rest_mode()
