"""Gas here and skeleton there: a foot in OpenSim, pushed by the device; and a whole model that follows a motion.

python co_simulation.py                        a foot on a hinge, which this script makes
python co_simulation.py MODEL.osim MOTION.mot  the right ankle of a model
"""

import argparse
import sys
import time

import opensim

from ppafo.errors import PpafoError
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


def main() -> None:
    """Push the ankle to and fro, and print where it goes."""
    parser = argparse.ArgumentParser(description="A device on the ankle of a model of OpenSim.")
    parser.add_argument("model", nargs="?", help="a model of OpenSim (.osim); default: a foot on a hinge")
    parser.add_argument("motion", nargs="?", help="a motion of the model (.mot or .sto), which goes with it")
    parsed = parser.parse_args()
    if parsed.model and not parsed.motion:
        parser.error("a model wants a motion: co_simulation.py MODEL.osim MOTION.mot")
    device = DeviceAtAnkle(load_scenario("torque-task-proportional"), STEP, SECONDS)
    if parsed.motion:
        model = load_model(parsed.model)
        model.updForceSet().clearAndDestroy()  # all joints follow the motion: muscles and contact would only cost time
        follow_motion(model, parsed.motion, COORDINATE)
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
            ankle, torque = f"{sample.angle:+7.4f} rad", f"{sample.torque:+6.2f} N m"
            print(f"{sample.time:6.3f} s  ankle {ankle}  device {torque}  {pressures} bar")
    spent += time.process_time()
    print(f"{1.0e6 * spent / device.steps:.0f} us of the processor for a step of {1.0e3 * STEP:g} ms")


if __name__ == "__main__":
    try:
        main()
    except PpafoError as error:
        print(f"co_simulation: {error}", file=sys.stderr)
        raise SystemExit(2) from None
