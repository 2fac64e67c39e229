"""Gas here and skeleton there: a foot in OpenSim, pushed by the device; and a whole model that follows a motion.

python co_simulation.py                        a foot on a hinge, which this script makes
python co_simulation.py MODEL.osim MOTION.mot  the right ankle of a model
"""

import sys
import time

import opensim

from ppafo.simulation.loading import load_scenario
from ppafo.worlds.opensim import CoSimulation, DeviceAtAnkle, follow_motion, load_model

STEP, SECONDS = 1.0e-3, 1.0
COORDINATE = "ankle_angle_r"


def hinged_foot() -> opensim.Model:
    """A foot of 1 kg that hangs on an upright shank, held by a soft spring."""
    model = opensim.Model()
    model.setName("hinged-foot")
    foot = opensim.Body("foot_r", 1.0, opensim.Vec3(0.09, 0, 0), opensim.Inertia(1.0e-3))
    model.addBody(foot)
    ankle = opensim.PinJoint("ankle_r", model.getGround(), foot)
    ankle.updCoordinate().setName(COORDINATE)
    model.addJoint(ankle)
    model.addForce(opensim.SpringGeneralizedForce(COORDINATE))
    spring = opensim.SpringGeneralizedForce.safeDownCast(model.updForceSet().get(0))
    spring.setStiffness(20.0)
    spring.setViscosity(0.2)
    model.finalizeConnections()
    return model


device = DeviceAtAnkle(load_scenario("torque-task-proportional"), STEP, SECONDS)
if len(sys.argv) > 2:
    model = load_model(sys.argv[1])
    model.updForceSet().clearAndDestroy()  # all joints follow the motion: muscles and contact would only cost time
    follow_motion(model, sys.argv[2], COORDINATE)
else:
    model = hinged_foot()

together = CoSimulation(model, COORDINATE, device)
sample = together.begin()
spent = -time.process_time()
for step in range(device.steps):
    command = 0.3 if step % 500 < 250 else -0.3
    sample = together.go_on(command)
    if step % 125 == 124:
        pressures = " ".join(f"{pressure / 1.0e5:5.2f}" for pressure in device.pressures())
        print(
            f"{sample.time:6.3f} s  ankle {sample.angle:+7.4f} rad  device {sample.torque:+6.2f} N m  {pressures} bar"
        )
spent += time.process_time()
print(f"{1.0e6 * spent / device.steps:.0f} us of the processor for a step of {1.0e3 * STEP:g} ms")
