"""Sets with a soft actuator of one or two chambers, which grow under pressure."""

from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent
OF_SECOND_CHAMBER = """
[actuator.dead_volume_2]
value = 10.0
unit = "cm^3"
origin = "assumed"
source = "0.8 m of tube of 4 mm bore"

[actuator.leak.area]
value = 0.0
unit = "mm^2"
origin = "assumed"
source = "chambers apart"

[actuator.leak.discharge_coefficient]
value = 0.6
unit = ""
origin = "assumed"
source = "of no effect while the area is 0"
"""


def soft(folder: Path, chambers: int = 2) -> str:
    """A set with a soft actuator of one or two chambers as strong as the vane of the paper; how an override names it.

    Its chambers grow by half from vented to full, most of it at low pressure, as cloth does until it is taut.
    """
    angles, gauges = np.linspace(20.0, 110.0, 4), (0.0, 40.0, 400.0)
    lines = ["angle [deg],pressure [kPa_g],volume_1 [mL]" + ",volume_2 [mL]" * (chambers - 1)]
    for angle in angles:
        turn = np.radians(angle - 20.0)
        for gauge, more in zip(gauges, (0.0, 0.3, 0.5), strict=True):
            first = float((30.0 + 40.0 * turn) * (1.0 + more))
            second = float((30.0 + 20.0 * (np.radians(90.0) - turn)) * (1.0 + more))
            lines.append(f"{angle},{gauge},{first!r}" + f",{second!r}" * (chambers - 1))
    (folder / "soft.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    text = (FOLDER / "measured-bladder.toml").read_text(encoding="utf-8")
    text = text.replace("measured-bladder.csv", "soft.csv").replace("measured-bladder", "soft")
    text = text.replace("value = 166.8", "value = 300.0")
    if chambers == 2:
        text += OF_SECOND_CHAMBER
    (folder / "soft.toml").write_text(text, encoding="utf-8")
    return f"device.set={folder / 'soft.toml'}"
