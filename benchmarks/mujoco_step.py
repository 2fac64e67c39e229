"""``python -m benchmarks.mujoco_step``: what two devices cost a step of MuJoCo, and how true their work is.

The model is two feet on hinges. Its steps are timed with the plugin of ``ppafo export mujoco`` and with a plain motor
in its place, in turns; the difference is what the gas costs. Then the work into both joints is compared with that of
the pressures (their difference times K and the motion), both summed over a run.
"""

import argparse
import math
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import mujoco

from benchmarks.command import run_command
from benchmarks.report import describe_machine
from ppafo.cli.output import EXIT_GOOD, add_json_argument, print_result
from ppafo.errors import SimulationError
from ppafo.exports.fmu import host_platform
from ppafo.exports.mujoco import installed_headers, plugin_files
from ppafo.simulation.loading import load_scenario
from ppafo.worlds.mujoco import Plugin, add_device, add_friction, load_plugin, outputs_of

SIDES = {"left": 1.0, "right": 1.3}
"""The feet, and how often a second the command of each goes up and down."""
STEP = 1.0e-3
TIMED = 1000
HELD = 25
"""Steps in all, and steps for which a command holds."""
_FOOT = """<body name="{side}" pos="0 {place} 0"><joint name="{side}" type="hinge" axis="0 1 0" range="-1.2 0.69"
limited="true"/>
<geom type="box" pos="0.06 0 -0.06" size="0.12 0.04 0.02" mass="1" contype="0" conaffinity="0"/></body>"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("--scenario", metavar="NAME", default="torque-task-proportional", help="whose device it is")
    parser.add_argument("--repetitions", metavar="N", type=int, default=40, help="the best counts (default: 40)")
    add_json_argument(parser)


def main(words: Sequence[str] | None = None) -> int:
    """Return the exit code of the command with these words."""
    return run_command("mujoco_step", "Time two devices in MuJoCo, and sum their work.", add_arguments, run, words)


def run(parsed: argparse.Namespace) -> int:
    """Time, sum, print."""
    platform = host_platform()
    if parsed.repetitions < 1 or platform is None:
        raise SimulationError("--repetitions is to be 1 or more, on a computer that plugins are built for")
    scenario = load_scenario(parsed.scenario)
    with tempfile.TemporaryDirectory() as folder:
        for name, content in plugin_files(scenario, [platform], installed_headers()).items():
            (Path(folder) / name).parent.mkdir(exist_ok=True)
            (Path(folder) / name).write_bytes(content)
        plugin = load_plugin(folder)
    times = {"gas": math.inf, "motors": math.inf}
    models = {"gas": _model(plugin, add_device), "motors": _model(plugin, _add_motor)}
    for _ in range(parsed.repetitions):
        times = {name: min(best, _seconds_of_a_step(models[name])) for name, best in times.items()}
    into_joints, of_gas = _work(models["gas"], plugin, scenario.device.actuator.torque_constant)
    micro = {name: seconds * 1.0e6 for name, seconds in times.items()}
    lines = [
        f"MuJoCo {mujoco.__version__}, one core of {describe_machine().processor}, best of {parsed.repetitions}",
        f"a step of 1 ms with two motors {micro['motors']:.2f} us, with two devices {micro['gas']:.2f} us: "
        f"the gas costs {micro['gas'] - micro['motors']:.2f} us",
        f"work into the joints {into_joints:.3f} J, of the gas {of_gas:.3f} J: {into_joints / of_gas - 1.0:+.3%}",
    ]
    document = {"microseconds": micro, "work_into_joints": into_joints, "work_of_gas": of_gas}
    print_result("\n".join(lines), document, parsed.json)
    return EXIT_GOOD


def _add_motor(spec: Any, plugin: Plugin, name: str, joint: str) -> None:
    """A motor in the device's place, on a joint with the same inertia and friction."""
    add_friction(spec, plugin, joint)
    spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint)


def _model(plugin: Plugin, add: Callable[[Any, Plugin, str, str], None]) -> Any:
    """Two feet with something at each."""
    feet = "".join(_FOOT.format(side=side, place=0.2 * place) for place, side in enumerate(SIDES))
    spec = mujoco.MjSpec.from_string(
        f'<mujoco><compiler angle="radian"/><option timestep="{STEP}"/><worldbody>{feet}</worldbody></mujoco>'
    )
    for side in SIDES:
        add(spec, plugin, side, side)
    return spec.compile()


def _command(data: Any) -> None:
    data.ctrl[:] = [math.sin(2.0 * math.pi * rate * data.time) for rate in SIDES.values()]


def _seconds_of_a_step(model: Any) -> float:
    """The mean over a run in which the commands change every HELD steps."""
    data, spent = mujoco.MjData(model), 0.0
    for _ in range(TIMED // HELD):
        _command(data)
        began = time.process_time()
        mujoco.mj_step(model, data, HELD)
        spent += time.process_time() - began
    return spent / TIMED


def _work(model: Any, plugin: Plugin, torque_constant: float) -> tuple[float, float]:
    """Work into the joints by the mean rates of each step, which is what they move with, and of the gas [J]."""
    data, into_joints, of_gas = mujoco.MjData(model), 0.0, 0.0
    before = dict.fromkeys(SIDES, 0.0)
    for _ in range(3 * TIMED):
        _command(data)
        angles, rates = data.qpos.copy(), data.qvel.copy()
        mujoco.mj_step(model, data)
        turned = data.qpos - angles
        into_joints += 0.5 * STEP * float(data.qfrc_actuator @ (rates + data.qvel))
        for side, angle in zip(SIDES, turned, strict=True):
            found = outputs_of(model, data, plugin, side)
            difference = found["pressure_1"] - found["pressure_2"]
            of_gas += 0.5 * (before[side] + difference) * torque_constant * float(angle)
            before[side] = difference
    return into_joints, of_gas


if __name__ == "__main__":
    sys.exit(main())
