"""Gas here and skeleton there: a device's torque and OpenSim's ankle are exchanged in every step."""

from pathlib import Path
from typing import Any, NamedTuple, final

import opensim

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import SimulationError, one_line
from ppafo.exports.opensim.add_device import add_actuator
from ppafo.worlds.opensim.device import DeviceAtAnkle, check_command, to_model
from ppafo.worlds.opensim.models import check_place, load_model

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
