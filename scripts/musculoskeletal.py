"""Puts the device of ``ppafo export mujoco`` on the four musculoskeletal models of assist_sim, and runs them.

    pip install assist_sim
    ppafo export mujoco torque-task-proportional --out out/plugin
    python scripts/musculoskeletal.py out/plugin

Each model begins at its first keyframe, both valves open for 0.1 s: what is shown is that it is built and runs.
"""

import sys
import tempfile
from pathlib import Path
from typing import Any

import mujoco

from ppafo.worlds.mujoco import Plugin, add_device, load_plugin, outputs_of

MODELS = ("myolegs22", "myolegs26", "myolegs", "myofullbody")
SIDES = ("r", "l")
TIME = 0.1


def combined(name: str, folder: Path, plugin: Plugin, work: Path) -> Any:
    """A model of assist_sim with the device's masses and, at both ankles, its plugin."""
    import assist_sim

    person, wearing = work / f"{name}.xml", work / f"{name}_wearing.xml"
    assist_sim.load_msk(name, export_xml=str(person))
    assist_sim.load_combined_model(
        human_xml=str(person), device_config=str(folder / "assist_sim" / "L1config.yaml"), export_xml=str(wearing)
    )
    spec = mujoco.MjSpec.from_file(str(wearing))
    for side in SIDES:
        # The ankle of these models counts dorsiflexion as positive.
        add_device(spec, plugin, f"exo_{side}", joint=f"ankle_angle_{side}", gear=-1.0)
    return spec.compile()


def main(words: list[str]) -> None:
    """Build each model, open both valves and print what the right device gives."""
    folder = Path(words[0])
    plugin = load_plugin(folder)
    for name in MODELS:
        with tempfile.TemporaryDirectory() as work:
            model = combined(name, folder, plugin, Path(work))
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        for side in SIDES:
            data.actuator(f"exo_{side}").ctrl[0] = 1.0
        mujoco.mj_step(model, data, round(TIME / model.opt.timestep))
        found = outputs_of(model, data, plugin, "exo_r")
        print(
            f"{name}: {model.body_mass.sum():.2f} kg, {model.nu} controls, torque {found['torque']:.3f} N m, "
            f"angle {found['angle']:.3f} rad, gas {found['supplied_mass'] * 1.0e3:.3f} g"
        )


if __name__ == "__main__":
    main(sys.argv[1:])
