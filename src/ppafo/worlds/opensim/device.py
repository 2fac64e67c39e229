"""Valve and gas of a walk or a scenario on the ankle of an OpenSim model: read, coupled, and exchanged step by step.

Gas here and skeleton there: a device's torque and OpenSim's ankle are exchanged in every step.
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, final

import numpy as np
import opensim

from ppafo.constants import STANDARD_GRAVITY
from ppafo.engine.lanes import begin_block
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, Run, batch_of, gas_by_path
from ppafo.errors import DataError, ScenarioError, SimulationError, nearest_name, one_line
from ppafo.exports.opensim.add_device import add_actuator, check_coordinate, line, read_model
from ppafo.model.plant import actuator_torque, chamber_pressures
from ppafo.model.sensors import SensorParameters
from ppafo.model.valves.kind import VENT
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.plan import Pieces, Steps, compose_run
from ppafo.simulation.scenario import ProfileChoice, Scenario
from ppafo.storage.opensim import OpenSimTable, read_opensim
from ppafo.walking.planning import NO_REFERENCE, walking_valve
from ppafo.walking.preparation import vented_state

_STATE = "/value"
CONTACT = ("HuntCrossleyForce", "ElasticFoundationForce", "SmoothSphereHalfSpaceForce")
"""Forces of a model that press the feet on the ground: measured ones stand in their place."""


def load_model(path: str | Path) -> Any:
    """Return a model of OpenSim; DataError for a file that is none."""
    try:
        return read_model(Path(path))
    except ValueError as error:
        raise DataError(one_line(error)) from error


def coordinate_of_model(model: Any, name: str) -> Any:
    """Return a coordinate of a model; DataError where it has none of that name."""
    names = coordinate_names(model)
    if name not in names:
        raise DataError(
            f"model {model.getName()}: has no coordinate '{name}'{nearest_name(name, names)}; "
            f"there are: {', '.join(names)}"
        )
    return model.getCoordinateSet().get(name)


def check_place(model: Any, name: str) -> None:
    """Refuse a coordinate that cannot take a device: one that is not there, is no angle, or has one; DataError."""
    coordinate_of_model(model, name)
    try:
        check_coordinate(model, name)
    except ValueError as error:
        raise DataError(f"model {error}") from error


def coordinate_names(model: Any) -> list[str]:
    """Return the names of all coordinates, in the order of the model."""
    coordinates = model.getCoordinateSet()
    return [coordinates.get(index).getName() for index in range(coordinates.getSize())]


def muscles_across(model: Any, coordinate: str) -> tuple[str, ...]:
    """Return the names of the muscles that turn a coordinate; DataError where none does."""
    state = model.initSystem()
    turned = coordinate_of_model(model, coordinate)
    muscles = [model.getMuscles().get(index) for index in range(model.getMuscles().getSize())]
    arms = {muscle.getName(): muscle.getGeometryPath().computeMomentArm(state, turned) for muscle in muscles}
    found = tuple(name for name, arm in arms.items() if abs(arm) > 1.0e-5)
    if not found:
        raise DataError(f"model {model.getName()}: no muscle crosses '{coordinate}'")
    return found


def read_motion(path: str | Path, model: Any, coordinate: str) -> OpenSimTable:
    """Return a motion by the names of the model's coordinates, in the file's units.

    DataError where the file has no column for a coordinate that the model leaves free.
    """
    table = read_opensim(path)
    named = {name.removesuffix(_STATE).rpartition("/")[2]: name for name in table.columns}
    if coordinate not in named:
        raise DataError(f"{path}: has no column '{coordinate}'{nearest_name(coordinate, named)}")
    state = model.initSystem()
    free = [name for name in coordinate_names(model) if not model.getCoordinateSet().get(name).isConstrained(state)]
    missing = [name for name in free if name not in named]
    if missing:
        raise DataError(f"{path}: has no column for {', '.join(missing)} of model {model.getName()}")
    return table


def follow_motion(
    model: Any, path: str | Path, coordinate: str, start: float | None = None, free: tuple[str, ...] = ()
) -> float:
    """Let a model follow a motion, but for locked coordinates and those in ``free``; returns how long there is one [s].

    Time 0 of the model is ``start`` [s] of the file, its first row unless given. Curves between rows are cubic splines.
    DataError for a motion that does not fit the model, and for a start that is not inside.
    """
    table = read_motion(path, model, coordinate)
    first, last = float(table.time[0]), float(table.time[-1])
    start = first if start is None else start
    if not first <= start < last:
        raise DataError(f"{path}: goes from {first:g} to {last:g} s, it cannot be followed from {start:g} s on")
    for name in free:
        coordinate_of_model(model, name)
    degrees = table.in_degrees if table.in_degrees is not None else table.is_old
    for label, values in table.columns.items():
        name = label.removesuffix(_STATE).rpartition("/")[2]
        if name in free or name not in coordinate_names(model):
            continue
        led = model.updCoordinateSet().get(name)
        if led.getDefaultLocked():
            continue
        scale = math.radians(1.0) if degrees and led.getMotionType() == opensim.Coordinate.Rotational else 1.0
        led.setPrescribedFunction(spline((table.time - start).tolist(), (scale * values).tolist()))
        led.setDefaultIsPrescribed(True)
    return last - start


def spline(times: list[float], values: list[float]) -> Any:
    """Return a function of OpenSim: a cubic spline through values at times [s], or a line through two."""
    if len(times) < 4:
        return line(times, values)
    function = opensim.SimmSpline()
    for time, value in zip(times, values, strict=True):
        function.addPoint(time, value)
    return function


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

    def __init__(self, item: Scenario, period: float = 1.0e-3, duration: float = 60.0) -> None:
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
        self._run, self._rows = run, rows
        self._state = [rows[f"state.{name}"] for name in ("angle", "mass_1", "mass_2")]
        self._supplied = rows["state.supplied_mass"]

    def begin(self, angle: float) -> None:
        """Put the vented device at an angle [rad], with all of its time ahead; SimulationError beyond its stops."""
        self._check_angle(angle, 0.0)
        self.taken = 0
        self._block = begin_block(self._batch)
        state = vented_state(self._fed, angle, 0.0)
        self._block.states[self._rows["state.angle"], 0] = state.angle
        for path, number in gas_by_path(replace(self._run, initial=state)).items():
            self._block.states[self._rows[path], 0] = number

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


def _run_of(item: Scenario, period: float, steps: int) -> Run:
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


PLATE_MASS = 0.5
"""Mass of a foot plate [kg] whose set says nothing but its inertia and its weight's torque about the ankle."""


class Sample(NamedTuple):
    """Time [s]; angle [rad] and rate [rad/s] in OpenSim's sign; torque that acts from here on [N m], in that sign."""

    time: float
    angle: float
    rate: float
    torque: float


@final
class CoSimulation:
    """A device on a coordinate of a model: OpenSim's integrator goes on step by step under the torque of the gas.

    The model gets an actuator, whose control is set between two steps, and a foot plate. In a step the torque is that
    of its middle, extrapolated from the last two samples, and the gas follows the angle that came of it. ``state`` may
    be changed until ``begin``, which the first step calls where nobody has. DataError for a coordinate that the model
    lacks, that is no angle, or has a device.
    """

    def __init__(self, model: Any, coordinate: str, device: DeviceAtAnkle) -> None:
        self.model = load_model(model) if isinstance(model, str | Path) else model
        self.device = device
        check_place(self.model, coordinate)
        add_foot_plate(self.model, coordinate, device)
        name = add_actuator(self.model, coordinate, opensim.Constant(0.0))
        self.state = self.model.initSystem()
        controller = opensim.PrescribedController.safeDownCast(self.model.updControllerSet().get(f"{name}_controller"))
        self._torque = opensim.Constant.safeDownCast(controller.upd_ControlFunctions().get(0))
        self._ankle = self.model.getCoordinateSet().get(coordinate)
        self._actuator = opensim.CoordinateActuator.safeDownCast(self.model.getForceSet().get(name))
        self._manager: Any = None
        self._start, self._last = 0.0, 0.0

    def begin(self) -> Sample:
        """Take ``state`` for the beginning, with the device vented; returns the first sample.

        SimulationError for an ankle beyond the stops of the device.
        """
        # The state after a step is the manager's, and would go with it.
        self.state = opensim.State(self.state)
        self._torque.setValue(0.0)
        self._start = self.state.getTime()
        manager = opensim.Manager(self.model)
        manager.setWriteToStorage(False)
        manager.setPerformAnalyses(False)
        manager.initialize(self.state)
        self.model.realizeVelocity(self.state)
        self.device.begin(to_model(self._ankle.getValue(self.state)))
        self._manager = manager
        first = self._sample()
        self._last = first.torque
        return first

    def go_on(self, command: float) -> Sample:
        """Go one step on under a command to the valve [-]; returns the sample that it leads to.

        SimulationError where OpenSim's integrator gives up, and errors of ``DeviceAtAnkle.go_on``.
        """
        check_command(command)
        before = self.begin() if self._manager is None else self._sample()
        self._torque.setValue(1.5 * before.torque - 0.5 * self._last)
        self._last = before.torque
        try:
            self.state = self._manager.integrate(self._start + (self.device.taken + 1) * self.device.period)
            self.model.realizeVelocity(self.state)
        except RuntimeError as error:
            raise SimulationError(f"OpenSim stopped at {before.time:g} s: {one_line(error)}") from error
        self.device.go_on(command, to_model(before.angle), to_model(self._ankle.getValue(self.state)))
        return self._sample()

    def actuation(self) -> float:
        """Torque [N m] of the actuator as OpenSim has it now, which is that of the last step."""
        self.model.realizeDynamics(self.state)
        return float(self._actuator.getActuation(self.state))

    def _sample(self) -> Sample:
        angle, rate = self._ankle.getValue(self.state), self._ankle.getSpeedValue(self.state)
        torque = -self.device.joint_torque(-rate)
        return Sample(time=self.state.getTime(), angle=angle, rate=rate, torque=torque)


def add_foot_plate(model: Any, coordinate: str, device: DeviceAtAnkle) -> None:
    """Put the plate's inertia and weight on the foot: a body whose axes are those of the foot, X forward."""
    inertia, moment = device.plant.inertia, device.plant.gravity_torque / STANDARD_GRAVITY
    # Heavy enough for its inertia about its own centre to be above 0.
    mass = max(PLATE_MASS, 1.01 * moment * moment / inertia)
    lever = moment / mass
    about_centre = inertia - mass * lever * lever
    name = f"{coordinate}_foot_plate"
    plate = opensim.Body(name, mass, opensim.Vec3(lever, 0.0, 0.0), opensim.Inertia(*(3 * [about_centre])))
    model.addBody(plate)
    ankle = model.getCoordinateSet().get(coordinate).getJoint().getChildFrame()
    foot, centre = model.getBodySet().get(ankle.findBaseFrame().getName()), ankle.findTransformInBaseFrame().p()
    level, origin = opensim.Vec3(0.0), opensim.Vec3(0.0)
    weld = opensim.WeldJoint(f"{name}_weld", foot, centre, level, plate, origin, level)
    model.addJoint(weld)
    model.finalizeConnections()
