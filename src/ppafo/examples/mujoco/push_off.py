"""One push-off a second at an ankle in MuJoCo, by an ideal motor and by gas: what the ideal actuator hides.

    pip install "ppafo[mujoco]"
    ppafo export mujoco torque-task-proportional --out out/plugin
    python push_off.py out/plugin

The foot hangs on a stiff ankle. The law in Python sees the torque of the device and sets the opening of its valve.
"""

# %% The model: a foot on a hinge, positive as the toes go down
import math
import sys

import mujoco
import numpy as np

from ppafo.worlds.mujoco import add_device, add_friction, load_plugin, outputs_of

FOOT = """<mujoco><compiler angle="radian"/><option timestep="0.001"/><worldbody><body name="foot">
<joint name="ankle" type="hinge" axis="0 1 0" range="-1.2 0.69" limited="true" stiffness="20" damping="0.5"/>
<geom type="box" pos="0.06 0 -0.06" size="0.12 0.04 0.02" mass="1"/></body></worldbody></mujoco>"""
PUSHES, HIGHEST = 10, 4.0


def wanted(time: float) -> float:
    """Torque that is wanted [N m]: half a sine of 0.3 s, once a second."""
    inside = time % 1.0
    return HIGHEST * math.sin(math.pi * inside / 0.3) if inside < 0.3 else 0.0


# %% Ten pushes, by a motor that gives what it is told, or by the device under a proportional law
plugin = load_plugin(sys.argv[1] if len(sys.argv) > 1 else "out/plugin")


def push(with_gas: bool) -> tuple[np.ndarray, np.ndarray, float]:
    """Torques wanted and given [N m], and gas from the supply [kg]."""
    spec = mujoco.MjSpec.from_string(FOOT)
    if with_gas:
        add_device(spec, plugin, "device", joint="ankle")
    else:
        add_friction(spec, plugin, "ankle")
        spec.add_actuator(name="device", trntype=mujoco.mjtTrn.mjTRN_JOINT, target="ankle")
    model = spec.compile()
    data = mujoco.MjData(model)
    asked, given, gas = [], [], 0.0
    for _ in range(1000 * PUSHES):
        asked.append(wanted(data.time))
        if with_gas:
            found = outputs_of(model, data, plugin, "device")
            data.ctrl[0] = 0.5 * (asked[-1] - found["torque"])
            gas = found["supplied_mass"]
        else:
            data.ctrl[0] = asked[-1]
        mujoco.mj_step(model, data)
        given.append(data.qfrc_actuator[0])
    return np.array(asked), np.array(given), gas


# %% What was hidden
for name, with_gas in (("ideal motor", False), ("gas", True)):
    asked, given, gas = push(with_gas)
    error = math.sqrt(np.mean((given - asked) ** 2))
    shifts = [np.mean((np.roll(asked, lag) - given) ** 2) for lag in range(200)]
    print(
        f"{name}: highest torque {given.max():.2f} of {HIGHEST:g} N m, error {error:.2f} N m (root mean square), "
        f"{int(np.argmin(shifts))} ms late, gas {gas * 1.0e3 / PUSHES:.3f} g a push"
    )
