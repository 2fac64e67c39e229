"""Event-by-event solution of a run on the simulated bench: samples, commands, valve, stick-slip, stops.

Friction is Coulomb friction with a static limit and a Stribeck curve, both increasing with pressure. Sticking is a
separate mode, entered and left at zeros of root functions as in the reference solver. A bristle model would need no
modes, but agreement with equation (10) to 1e-3 of the angle range requires a stiffness of about 1e7 N m/rad, at which a
solver takes very small steps through every reversal. With modes no kink lies inside a step, and without the additional
physics the rig is equation (10) exactly.
"""

import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ppafo.control.kind import ControllerKind
from ppafo.engine.continuous_time import SAME_TIME, Roots, after_stop, mode_at_rest, roots_at_rest, roots_sliding
from ppafo.engine.entries import with_arrays
from ppafo.engine.led_leg import torque_of_leg
from ppafo.engine.row_functions import row_functions
from ppafo.engine.rows import leaf_paths, numbers, rebuilt
from ppafo.engine.run import Run
from ppafo.errors import SimulationError
from ppafo.model.effects.spool_play import spool_position
from ppafo.model.orifice import ExactOrifice
from ppafo.model.plant import Openings, PlantParameters, actuator_torque
from ppafo.model.sensors import Measurement
from ppafo.parameters.device import Device
from ppafo.progress import Progress, Report, report_nothing
from ppafo.rig.dynamics import Inputs, Observables, RigNumbers, RigPhysics, RigState, VaneInputs, observables, rig_rates
from ppafo.rig.sensors import SimulatedSensor
from ppafo.rig.stretches import Distances, Slopes, solve_stretch

Floats = NDArray[np.float64]

UNKNOWNS = len(RigState._fields)
"""Number of unknowns of ``RigState``; in arrays of unknowns, the unknowns of the valve follow."""
ANGLE = RigState._fields.index("angle")
VELOCITY = RigState._fields.index("angular_velocity")
_BETWEEN_REPORTS = 1.0
"""Time [s] between two progress reports."""


@dataclass(frozen=True, slots=True)
class RigRun:
    """Run on the simulated bench, in SI units."""

    device: Device
    """True device, which the sensors and the controller do not know."""
    run: Run
    """Planned run of the identified model, without the additional physics of the bench."""
    physics: RigPhysics
    line_orifice: ExactOrifice
    initial: RigState
    sensors: dict[str, SimulatedSensor]
    """Sensors by channel, at least angle, pressure_1 and pressure_2."""
    sample_times: Floats
    """Sample times of the sensors [s], the first at 0 and the last at the end."""
    control_period: float
    """Sample period of the controller [s]."""
    command_delay: float
    """Dead time between controller and valve [s]."""
    hysteresis: float
    """Backlash of the valve spool, as a width in command [-]."""
    report: Report = report_nothing
    """Called every second with the number of samples recorded."""


@dataclass(slots=True)
class RigSolution:
    """True solution of a run on the simulated bench, at each sample time."""

    states: Floats
    """Unknowns (samples, unknowns of ``RigState``) [SI]."""
    pressures: Floats
    """Pressures of both chambers (samples, 2) [Pa, absolute]."""
    commands: Floats
    """Commands of the controller (samples,) [-]."""
    impacts: list[float] = field(default_factory=list)
    """Times [s] at which the vane hit a stop."""
    breakaways: list[float] = field(default_factory=list)
    """Times [s] at which the vane broke away from friction."""


def sensor_signals(physics: RigPhysics, state: Floats, pressures: Floats) -> tuple[float, float, float]:
    """Return angle [rad] and both pressures [Pa] filtered by the sensor bandwidth, without noise."""
    now, is_slow = RigState._make(state.tolist()), physics.pressure_follow_rate > 0.0
    first, second = (now.sensor_pressure_1, now.sensor_pressure_2) if is_slow else pressures.tolist()
    return now.sensor_angle if physics.angle_follow_rate > 0.0 else now.angle, first, second


def solve_rig(rig_run: RigRun) -> RigSolution:
    """Solve a run on the simulated bench.

    Raises SimulationError if the solver fails, and for a controller written in Python, which the rig cannot run.
    """
    return _Solver(rig_run).solve()


class _Equations:
    """Equations of a run as functions of time [s], unknowns (unknowns,) and mode, without internal state.

    The mode is the sliding ``direction`` of the vane: 1, -1, or 0 if the vane is stuck or its angle is prescribed.
    Valve and prescribed vane angle are computed in Python and passed to the compiled equations as numbers. So one
    compiled program serves all devices and experiments, and a new computer compiles only once.
    """

    def __init__(self, rig_run: RigRun) -> None:
        self.rig_run, self.run = rig_run, rig_run.run
        self.plant: PlantParameters = rig_run.run.plant
        self.is_free = self.run.program.angle is None
        given = RigNumbers(
            plant=self.plant,
            rig=rig_run.physics,
            valve_orifice=self.run.valve_orifice,
            leak_orifice=self.run.leak_orifice,
            line_orifice=rig_run.line_orifice,
        )
        parameters = np.array(numbers(given))
        self._state, self._rates = np.empty(UNKNOWNS), np.empty(UNKNOWNS)
        self._observed, self._inputs = np.empty(len(Observables._fields)), np.zeros(len(leaf_paths(Inputs, "inputs")))
        slopes, observed = row_functions(rig_rates, observables)
        self._fill = with_arrays(slopes, parameters, self._state, self._inputs, self._rates)
        self._show = with_arrays(observed, parameters, self._state, self._inputs, self._observed)
        valve_state = self.run.program.valve.initial()
        # Each evaluation makes a state of numbers, for which a flat one needs no search for what it nests.
        self._has_flat_valve = not any(isinstance(value, tuple) for value in valve_state)
        self.initial = np.array([*rig_run.initial, *numbers(valve_state)], dtype=np.float64)

    def valve_state(self, unknowns: Floats) -> Any:
        """Valve state as NamedTuple, from the last entries of the unknowns."""
        state, values = self.run.program.valve.state, unknowns[UNKNOWNS:].tolist()
        return state(*values) if self._has_flat_valve else rebuilt(state, values)

    def openings(self, unknowns: Floats, command: float) -> Openings:
        """Openings of the valve [-] at a command [-]."""
        return self.run.program.valve.instant(self.run.valve, self.valve_state(unknowns), command)

    def valve_slopes(self, unknowns: Floats, command: float) -> list[float]:
        """Time derivatives of the valve unknowns at a command [-]."""
        return numbers(self.run.program.valve.rates(self.run.valve, self.valve_state(unknowns), command))

    def vane(self, time: float, unknowns: Floats) -> VaneInputs:
        """Return angle [rad], prescribed angular velocity [rad/s] and leg torque [N m] at a time [s]."""
        path, leg, angle = self.run.program.angle, self.run.leg, float(unknowns[ANGLE])
        added_torque = 0.0 if leg is None else torque_of_leg(self.run.program, leg, time, angle)
        if path is None:
            return VaneInputs(angle, 0.0, added_torque)
        angle, rate, _ = path.value(self.run.path, time)
        return VaneInputs(angle, rate, added_torque)

    def slopes(self, direction: float, command: float, unknowns: Floats) -> Slopes:
        """Return the right-hand side of the equations for an interval that starts with these unknowns."""
        # A valve whose slopes are 0 stays where it is, because they depend on nothing but its state and the command.
        valve_moves = any(self.valve_slopes(unknowns, command))
        resting = self.openings(unknowns, command)

        def slopes(time: float, unknowns: Floats) -> Floats:
            slopes = np.empty_like(unknowns)
            slopes[UNKNOWNS:] = self.valve_slopes(unknowns, command) if valve_moves else 0.0
            openings = self.openings(unknowns, command) if valve_moves else resting
            self._state[:] = unknowns[:UNKNOWNS]
            self._inputs[:] = (*openings, *self.vane(time, unknowns))
            self._fill(direction)
            slopes[:UNKNOWNS] = self._rates
            return slopes

        return slopes

    def observe(self, time: float, unknowns: Floats) -> Observables:
        """Pressures [Pa], driving torque [N m] and static friction limit [N m] at a time [s]."""
        self._state[:] = unknowns[:UNKNOWNS]
        self._inputs[len(Openings._fields) :] = self.vane(time, unknowns)
        self._show()
        return Observables._make(self._observed.tolist())

    def distances(self, direction: float) -> Distances:
        """Root functions of a mode: distance to breakaway at rest; to standstill and to the next stop in motion."""

        def sliding(_time: float, unknowns: Floats) -> Roots:
            return roots_sliding(self.plant, float(unknowns[ANGLE]), float(unknowns[VELOCITY]), direction)

        def resting(time: float, unknowns: Floats) -> Roots:
            observed = self.observe(time, unknowns)
            return roots_at_rest(self._gripping(observed), float(unknowns[ANGLE]), observed.torque)

        return resting if direction == 0.0 else sliding

    def rest_direction(self, time: float, unknowns: Floats) -> float:
        """Return the direction in which a resting vane breaks away, 0 if it sticks."""
        observed = self.observe(time, unknowns)
        return mode_at_rest(self._gripping(observed), float(unknowns[ANGLE]), observed.torque)

    def _gripping(self, observed: Observables) -> PlantParameters:
        """Return the plant with the static friction at the observed pressures."""
        return self.plant._replace(static_torque=observed.static_limit)

    def with_prescribed_angle(self, time: float, unknowns: Floats) -> Floats:
        """Return the unknowns of ``RigState`` (unknowns,), with the prescribed angle inserted if there is one."""
        state = np.array(unknowns[:UNKNOWNS])
        if (path := self.run.program.angle) is not None:
            state[ANGLE], state[VELOCITY], _ = path.value(self.run.path, time)
        return state


class _Solver:
    """Event-driven solver of a run, with its current time [s], unknowns and mode.

    ``decided`` is the last command of the controller [-], ``at_valve`` the command after backlash and dead time [-].
    Raises SimulationError for a controller written in Python, which the rig cannot run.
    """

    def __init__(self, rig_run: RigRun) -> None:
        if rig_run.run.program.controller is None:
            raise SimulationError("the simulated test bench supports only controllers given by controller.kind")
        self.rig_run, self.equations = rig_run, _Equations(rig_run)
        self.controller: ControllerKind = rig_run.run.program.controller
        self.decided = self.at_valve = 0.0
        self.commands_under_way: list[tuple[float, float]] = []
        """Arrival times at the valve [s] and commands [-]."""
        self.time, self.unknowns, self.direction = 0.0, self.equations.initial, 0.0
        samples = rig_run.sample_times.size
        self.solution = RigSolution(
            states=np.empty((samples, UNKNOWNS)), pressures=np.empty((samples, 2)), commands=np.zeros(samples)
        )
        self.recorded = 0
        if self.equations.is_free:
            self.direction = self.direction_now()

    def direction_now(self) -> float:
        """Return the direction in which a free vane slides or breaks away, 0 if it sticks."""
        velocity = float(self.unknowns[VELOCITY])
        return float(np.sign(velocity)) if velocity != 0.0 else self.equations.rest_direction(self.time, self.unknowns)

    def solve(self) -> RigSolution:
        """Integrate to the end of the run, controller period by controller period."""
        rig_run, run = self.rig_run, self.rig_run.run
        end, sample = float(rig_run.sample_times[-1]), 0
        spool, state = 0.0, self.controller.initial
        started = reported = time.monotonic()
        while self.time < end - SAME_TIME:
            if (now := time.monotonic()) - reported >= _BETWEEN_REPORTS:
                counts = (self.recorded, rig_run.sample_times.size, 0, 0, now - started)
                rig_run.report(Progress("recording on the simulated test bench", *counts, noun="samples"))
                reported = now
            measurement = self.measure()
            reference = run.program.reference.value(run.reference, sample * rig_run.control_period)[0]
            # A constant command is decided once for the whole run; the law still has the period of its file.
            self.decided, state = self.controller.update(run.controller, state, reference, measurement, run.period)
            spool = spool_position(spool, self.decided, rig_run.hysteresis)
            self.commands_under_way.append((self.time + rig_run.command_delay, spool))
            sample += 1
            self.advance_to(min(sample * rig_run.control_period, end))
        # The stretches leave out the sample at the very end, where the unknowns are.
        while self.recorded < self.rig_run.sample_times.size:
            self.record(self.unknowns)
        return self.solution

    def measure(self) -> Measurement:
        """Return the current measurement for the controller."""
        rig_run, observed = self.rig_run, self.equations.observe(self.time, self.unknowns)
        state = self.equations.with_prescribed_angle(self.time, self.unknowns)
        pressures = np.array([observed.pressure_1, observed.pressure_2])
        signals = sensor_signals(rig_run.physics, state, pressures)
        # The noise is that of the last recorded sample.
        latest = np.searchsorted(rig_run.sample_times, self.time + SAME_TIME, side="right")
        sample = max(0, int(latest) - 1)
        angle, pressure_1, pressure_2 = (
            rig_run.sensors[channel].reads(value, sample)
            for channel, value in zip(("angle", "pressure_1", "pressure_2"), signals, strict=True)
        )
        torque = actuator_torque(pressure_1, pressure_2, self.equations.plant.torque_constant)
        return Measurement(angle=angle, pressure_1=pressure_1, pressure_2=pressure_2, torque=torque)

    def advance_to(self, end: float) -> None:
        """Integrate to a time [s], stopping at arrivals of commands and events of the valve."""
        run, valve = self.rig_run.run, self.rig_run.run.program.valve
        while self.time < end - SAME_TIME:
            while self.commands_under_way and self.commands_under_way[0][0] <= self.time + SAME_TIME:
                _, self.at_valve = self.commands_under_way.pop(0)
            command = self.at_valve
            valve_state = valve.settle(run.valve, self.equations.valve_state(self.unknowns), command, self.time)
            self.unknowns[UNKNOWNS:] = numbers(valve_state)
            # An event that is now would not let time go on.
            switches = max(valve.next_event(run.valve, valve_state, command, self.time), self.time + 2 * SAME_TIME)
            arrivals = [arrival for arrival, _ in self.commands_under_way[:1]]
            self.integrate(min(end, switches, *arrivals))

    def integrate(self, end: float) -> None:
        """Integrate to a time [s] or the next vane event, and change the mode at the event."""
        if self.equations.is_free and self.direction == 0.0:
            self.direction = self.equations.rest_direction(self.time, self.unknowns)
            if self.direction != 0.0:
                self.solution.breakaways.append(self.time)
        samples = self.rig_run.sample_times
        times, unknowns = solve_stretch(
            self.equations.slopes(self.direction, self.at_valve, self.unknowns),
            self.equations.distances(self.direction) if self.equations.is_free else None,
            self.unknowns,
            self.time,
            end,
            samples[self.recorded :],
        )
        # A sample at the end of a stretch belongs to the next.
        while self.recorded < samples.size and samples[self.recorded] < float(times[-1]) - SAME_TIME:
            self.record(unknowns[np.argmin(np.abs(times - samples[self.recorded]))])
        self.time, self.unknowns = float(times[-1]), np.array(unknowns[-1])
        if self.time < end - SAME_TIME:
            self.change_mode()
        else:
            self.time = end

    def record(self, unknowns: Floats) -> None:
        """Store the unknowns at the next sample."""
        sample = self.recorded
        time = float(self.rig_run.sample_times[sample])
        observed = self.equations.observe(time, unknowns)
        self.solution.states[sample] = self.equations.with_prescribed_angle(time, unknowns)
        self.solution.pressures[sample] = observed.pressure_1, observed.pressure_2
        self.solution.commands[sample] = self.decided
        self.recorded += 1

    def change_mode(self) -> None:
        """Change the mode when the vane breaks away, stops, or hits an end stop."""
        if self.direction == 0.0:
            torque = self.equations.observe(self.time, self.unknowns).torque
            self.direction = 1.0 if torque > 0.0 else -1.0
            self.solution.breakaways.append(self.time)
            return
        # Of the two distances the one that ended the stretch is 0 but for rounding.
        distances = self.equations.distances(self.direction)(self.time, self.unknowns)
        if abs(distances.second) < abs(distances.first):
            self.solution.impacts.append(self.time)
            # Onto the stop itself: a rounding beyond it would be another impact at once.
            plant = self.equations.plant
            self.unknowns[ANGLE] = plant.angle_max if self.direction > 0.0 else plant.angle_min
            self.unknowns[VELOCITY] = after_stop(self.rig_run.run, {}, float(self.unknowns[VELOCITY]))
        else:
            self.unknowns[VELOCITY] = 0.0
        self.direction = self.direction_now()
