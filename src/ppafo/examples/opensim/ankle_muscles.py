"""What the muscles of the right ankle have to give, with the device and without it, by OpenSim's static optimisation.

ppafo gait import MOTION.mot FORCES.mot --body-mass '72.6 kg' --speed '1.14 m/s' --name mine --out out/mine
python ankle_muscles.py MODEL.osim MOTION.mot FORCES.mot [WALK]
"""

import argparse
import sys
from pathlib import Path

import numpy as np
import opensim

from ppafo.errors import DataError, PpafoError
from ppafo.exports.opensim import device_torque
from ppafo.storage.opensim import read_opensim
from ppafo.walking.loading import load_walk
from ppafo.walking.walk import walk
from ppafo.worlds.opensim import ankle_muscles

GAIT = Path("out") / "mine" / "mine.toml"
FEET = {"calcn_r": "", "calcn_l": "l_"}
"""Bodies of the model, and what the columns of their force plates begin with."""
LOADED = 30.0
"""Vertical force [N] that counts as a foot on the ground."""
STRIDES = 2


def heel_strikes(forces: Path, start: float) -> tuple[float, ...]:
    """Times [s] at which the right foot is loaded, from a time on: as many strides as are wanted."""
    table = read_opensim(forces)
    if "ground_force_vy" not in table.columns:
        raise DataError(f"{forces}: has no column 'ground_force_vy', the force under the right foot")
    vertical = table.columns["ground_force_vy"]
    loaded = np.flatnonzero((vertical[1:] > LOADED) & (vertical[:-1] <= LOADED)) + 1
    strikes = tuple(time for time in table.time[loaded].tolist() if time > start)[: STRIDES + 1]
    if len(strikes) < 2:
        raise DataError(
            f"{forces}: the right foot is loaded {len(strikes)} times after {start:g} s; a stride needs two"
        )
    return strikes


def write_loads(forces: Path, path: Path) -> None:
    """Say which force of the file acts on which foot, as OpenSim's tools want it."""
    loads = opensim.ExternalLoads()
    loads.setDataFileName(str(forces.resolve()))
    for body, begin in FEET.items():
        force = opensim.ExternalForce()
        force.setName(f"ground_{body}")
        force.set_applied_to_body(body)
        force.set_force_expressed_in_body("ground")
        force.set_point_expressed_in_body("ground")
        force.set_force_identifier(f"{begin}ground_force_v")
        force.set_point_identifier(f"{begin}ground_force_p")
        force.set_torque_identifier(f"{begin}ground_torque_")
        loads.cloneAndAppend(force)
    loads.printToXML(str(path))


def main() -> None:
    """Let the device walk, lay its stride on the recording, and print what the muscles have to give."""
    parser = argparse.ArgumentParser(description="Muscles of the right ankle with the device and without it.")
    parser.add_argument("model", type=Path, help="a model of OpenSim (.osim)")
    parser.add_argument("motion", type=Path, help="its motion (.mot)")
    parser.add_argument("forces", type=Path, help="forces under the feet (.mot)")
    parser.add_argument("walk", nargs="?", default="proportional", help="a walk; default: proportional")
    parsed = parser.parse_args()
    # Muscles keep the measured ankle, whatever the device does: the motion is that of the recording.
    configuration = load_walk(parsed.walk, ["wearer.keeps_gait=1"], GAIT)
    strikes = heel_strikes(parsed.forces, float(read_opensim(parsed.motion).time[0]))
    result = walk(configuration, 0.2)
    write_loads(parsed.forces, Path("loads.xml"))
    found = ankle_muscles(parsed.model, parsed.motion, "loads.xml", device_torque(result, "right", strikes))
    print(found)
    Path("out").mkdir(exist_ok=True)
    found.plot().savefig(f"out/ankle-muscles-{Path(parsed.walk).stem}.png", dpi=110)
    print(f"written: loads.xml, out/ankle-muscles-{Path(parsed.walk).stem}.png")


if __name__ == "__main__":
    try:
        main()
    except PpafoError as error:
        print(f"ankle_muscles: {error}", file=sys.stderr)
        raise SystemExit(2) from None
