"""Valve and gas of a walk or a scenario on an ankle that somebody else moves, step by step."""

import math
from typing import final

import numpy as np

from ppafo.engine.lanes import begin_block
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, Run, batch_of
from ppafo.errors import DataError, ScenarioError, SimulationError
from ppafo.model.command import VENT
from ppafo.model.plant import chamber_pressures
from ppafo.model.sensors import SensorParameters
from ppafo.model.vane import actuator_torque
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.plan import Pieces, Steps, compose_run
from ppafo.simulation.scenario import ProfileChoice, Scenario
from ppafo.walking.configuration import Configuration
from ppafo.walking.planning import NO_REFERENCE, walking_valve
from ppafo.walking.preparation import vented_state

SLOW = 0.05
"""Rate of the ankle [rad/s] below which sliding friction fades out, in proportion: nothing sticks between two steps."""
SHORTEST_PERIOD, LONGEST_PERIOD, LONGEST = 1.0e-5, 1.0e-2, 3600.0
_SILENT = SensorParameters(angle_noise=0.0, pressure_noise=0.0, angle_quantum=0.0, pressure_quantum=0.0, seed=1.0)
_PATH = ("path.start_level", "path.level", "path.ramp_start", "path.ramp_time")
_NEUTRAL = 0.5 * math.pi


@final
class DeviceAtAnkle:
    """The gas of a device, vented at first; ``period`` [s] is a step, and there is time for ``duration`` [s].

    Angles are those of the package: 90 deg neutral, growing in plantarflexion. A valve of either kind can be vented
    (``model.command.VENT``). The supply does not end, whatever a walk hangs on. ScenarioError for times that cannot be.
    """

    def __init__(self, item: Scenario | Configuration, period: float = 1.0e-3, duration: float = 60.0) -> None:
        if not SHORTEST_PERIOD <= period <= LONGEST_PERIOD:
            raise ScenarioError(f"a step of {period:g} s: must be {SHORTEST_PERIOD:g} to {LONGEST_PERIOD:g} s")
        if not period <= duration <= LONGEST:
            raise ScenarioError(f"a duration of {duration:g} s: must be a step of {period:g} s to {LONGEST:g} s")
        item.device.check_vane("co-simulation in OpenSim")
        self.name = item.name
        self.period = period
        self.steps = round(duration / period)
        self.taken = 0
        self.plant = plant_parameters(item.device)
        run = _run_of(item, period, self.steps)
        self._batch = batch_of(run)
        self._fed = run.plant
        self._block = begin_block(self._batch)
        self._path = [row_numbers(self._batch.program.parameter_rows())[name] for name in _PATH]
        rows = row_numbers(self._batch.program.state_rows())
        self._command, self._failure = rows["result.command"], rows["result.failure_time"]
        self._state = [rows[f"state.{name}"] for name in ("angle", "mass_1", "mass_2")]
        # True masses, which gas with an energy balance has beside those at the reference temperature.
        self._true = [rows[path] for path in ("masses.mass_1", "masses.mass_2") if path in rows]
        self._supplied = rows["state.supplied_mass"]

    def begin(self, angle: float) -> None:
        """Put the vented device at an angle [rad], with all of its time ahead; SimulationError beyond its stops."""
        self._check_angle(angle, 0.0)
        self.taken = 0
        self._block = begin_block(self._batch)
        state = vented_state(self._fed, angle, 0.0)
        self._block.states[self._state, 0] = state.angle, state.mass_1, state.mass_2
        if self._true:
            self._block.states[self._true, 0] = state.mass_1, state.mass_2

    def pressures(self) -> tuple[float, float]:
        """Absolute pressures [Pa] in both chambers."""
        angle, mass_1, mass_2 = self._block.states[self._state, 0].tolist()
        first, second = chamber_pressures(self._fed, angle, mass_1, mass_2)
        return first, second

    def supplied_mass(self) -> float:
        """Gas taken from the supply so far [kg]."""
        return float(self._block.states[self._supplied, 0])

    def actuator_torque(self) -> float:
        """Torque of the gas [N m], positive in plantarflexion; equation (2)."""
        return actuator_torque(*self.pressures(), self.plant.torque_constant)

    def joint_torque(self, rate: float) -> float:
        """Torque on the joint [N m] at its rate [rad/s]: of the gas, less friction and damping; equation (1)."""
        sliding = self.plant.dynamic_torque * max(-1.0, min(1.0, rate / SLOW))
        return self.actuator_torque() - sliding - self.plant.viscous_damping * rate

    def go_on(self, command: float, angle: float, next_angle: float) -> None:
        """Go one step on under a command [-], while the ankle turns from an angle to the next one [rad].

        DataError for what is no command. SimulationError after the last step, for an angle beyond the stops, and where
        the gas has left what is possible.
        """
        check_command(command)
        if self.taken >= self.steps:
            raise SimulationError(f"{self.name}: there was time for {self.steps * self.period:g} s; begin with more")
        begun = self.taken * self.period
        self._check_angle(angle, begun)
        self._check_angle(next_angle, begun)
        path = (angle, 2.0 * next_angle - angle, begun, 2.0 * self.period)
        self._block.set_parameters(self._path, np.array(path))
        self._block.states[self._command] = command
        self._block.advance(1)
        self.taken += 1
        states = self._block.states
        if states[self._failure, 0] < NEVER_FAILED or not bool(np.isfinite(states).all()):
            raise SimulationError(
                f"{self.name}: the simulation diverged at {begun:g} s; try a shorter step than {self.period:g} s"
            )

    def _check_angle(self, angle: float, time: float) -> None:
        if not self.plant.angle_min <= angle <= self.plant.angle_max:
            lowest, highest = (math.degrees(to_model(stop)) for stop in (self.plant.angle_max, self.plant.angle_min))
            raise SimulationError(
                f"{self.name}: at {time:g} s the ankle goes to {math.degrees(to_model(angle)):.4g} deg, beyond "
                f"the stops of the device at {lowest:g} and {highest:g} deg (dorsiflexion above 0)"
            )


def check_command(command: float) -> None:
    """Refuse what is no command [-]; DataError."""
    if not (-1.0 <= command <= 1.0 or command == VENT):
        raise DataError(f"a command of {command:g}: must be -1 to 1, or {VENT:g} to vent both chambers")


def to_model(angle: float) -> float:
    """OpenSim's ankle angle [rad], 0 neutral and above 0 in dorsiflexion, of one of the package; and back."""
    return _NEUTRAL - angle


def _run_of(item: Scenario | Configuration, period: float, steps: int) -> Run:
    """The run of valve and gas under a command from outside, on a straight path of the angle for each step."""
    path = {"start_level": _NEUTRAL, "level": _NEUTRAL, "ramp_start": 0.0, "ramp_time": 2.0 * period}
    pieces = Pieces(
        device=item.device,
        valve=walking_valve(item.device.valve),
        controller=None,
        settings={},
        reference=NO_REFERENCE,
        path=ProfileChoice("ramp_hold", path),
        sensors=_SILENT,
        has_ideal_sensors=True,
        thermal=item.thermal,
        supply_lines=item.supply_lines,
    )
    stepped = Steps(step=period, step_count=steps, steps_per_sample=1, record_every=0, needs_parts=True)
    return compose_run(
        pieces, plant_parameters(item.device), lambda _: stepped, lambda plant: vented_state(plant, _NEUTRAL, 0.0)
    )
