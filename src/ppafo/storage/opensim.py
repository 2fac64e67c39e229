"""Recordings written as tables of OpenSim (``.sto``), also a walk with the names, zeros and signs of OpenSim.

``ankle_angle_r`` [rad] is 0 with the foot at a right angle to the shank, positive in dorsiflexion.
``ankle_angle_r_moment`` is the ankle moment in this direction [N m], negative in push-off;
``ankle_angle_r_device_moment`` is the contribution of a device. ``ground_force_r_vy`` is the vertical force [N].
``shank_angle_r`` is no coordinate of OpenSim models, whose legs have hip and knee; it keeps the definition of this
package, as do all channels without a counterpart. ``gait/recorded/forms/opensim.py`` reads such tables.
"""

import math
import re
from dataclasses import replace
from pathlib import Path

from ppafo.constants import STANDARD_GRAVITY
from ppafo.signals import Channel, Recording
from ppafo.signals.recording import TIME
from ppafo.storage.files import write_file
from ppafo.wording import one_line

END = "endheader"
"""Last line of the header."""
KIND = "kind="
"""Header key for the kind of a recording that was not measured, in files of this package."""
_SIGNS = {
    r"(healthy_)?ankle_angle_[rl]": "is 0 with the foot square to the shank and above 0 in dorsiflexion",
    r"ankle_angle_[rl]_speed": "is above 0 towards dorsiflexion",
    r"ankle_angle_[rl]_moment": "is what the wearer gives, above 0 in dorsiflexion",
    r"ankle_angle_[rl]_device(_moment)?": "is what the device gives the wearer, above 0 in dorsiflexion",
    r"ground_force_[rl]_vy": "is above 0 upward",
}
"""Sign conventions for the header, by column name of OpenSim."""
_ANGLES = {"ankle_angle": "{}", "angle": "{}", "healthy_angle": "healthy_{}"}
"""OpenSim name pattern by angle channel [rad]; in OpenSim 0 is the foot at a right angle to the shank."""
_REVERSED = {"angular_velocity": "{}_speed", "ankle_moment": "{}_moment", "external_torque": "{}_device_moment"}
"""OpenSim name pattern by channel of reversed sign: positive in dorsiflexion instead of plantarflexion."""
_OF_A_SIDE = ("shank_angle",)
"""Channels renamed only by the letter of the side."""
_PER_MASS = ("ankle_moment", "vertical_force")
"""Channels that may be normalised by body mass [N m/kg], [N/kg] or by body weight [-]."""


def opensim_recording(
    recording: Recording, side: str = "right", body_mass: float | None = None
) -> tuple[Recording, tuple[str, ...]]:
    """Convert a walking recording to names, zeros and signs of OpenSim; also return channels omitted without body mass.

    Moment and force per mass are multiplied by ``body_mass`` [kg]; without a body mass they are omitted and named.
    """
    foot = side[0]
    coordinate = f"ankle_angle_{side[0]}"
    mass = body_mass or 0.0
    units = {name: recording.unit(name) for name in recording.names}
    per_mass = [name for name in _PER_MASS if units.get(name) in ("N m/kg", "-", "N/kg")]
    missing = tuple(per_mass) if body_mass is None else ()
    channels = {}
    for name, unit in units.items():
        values = recording[name]
        if name in missing:
            continue
        if name in _ANGLES and unit == "rad":
            channels[_ANGLES[name].format(coordinate)] = Channel(0.5 * math.pi - values, unit)
        elif name in _REVERSED:
            factor = mass if unit == "N m/kg" else 1.0
            channels[_REVERSED[name].format(coordinate)] = Channel(-factor * values, unit.removesuffix("/kg"))
        elif name == "vertical_force":
            factor = {"-": mass * STANDARD_GRAVITY, "N/kg": mass}.get(unit, 1.0)
            channels[f"ground_force_{foot}_vy"] = Channel(factor * values, "N")
        else:
            channels[f"{name}_{foot}" if name in _OF_A_SIDE else name] = Channel(values, unit)
    if {"heel_force", "toe_force"} <= set(recording.names):
        channels[f"ground_force_{foot}_vy"] = Channel(recording["heel_force"] + recording["toe_force"], "N")
    return replace(recording, channels=channels), missing


def opensim_bytes(recording: Recording) -> bytes:
    """Return the ``.sto`` file of a recording: SI units, angles in radians, labels ``time`` and channel names.

    The header states units and signs as text, which OpenSim preserves, and the kind of a recording that was not
    measured.
    """
    units = ", ".join(f"{name} [{recording.unit(name)}]" for name in recording.names)
    signs = [f"{name} {sign}" for name in recording.names for form, sign in _SIGNS.items() if re.fullmatch(form, name)]
    signs.append(f"{'other columns' if signs else 'columns'} have the signs of ppafo")
    head = [
        one_line(recording.label),
        "version=1",
        f"nRows={len(recording)}",
        f"nColumns={1 + len(recording.names)}",
        "inDegrees=no",
        f"{KIND}{recording.kind}",
        f"units={units}",
        f"signs={'; '.join(signs)}",
        END,
        "\t".join((TIME, *recording.names)),
    ]
    columns = [recording.time, *(recording[name] for name in recording.names)]
    rows = ["\t".join(map(repr, row)) for row in zip(*(column.tolist() for column in columns), strict=True)]
    return ("\n".join([*head, *rows]) + "\n").encode()


def write_opensim(path: str | Path, recording: Recording) -> Path:
    """Write a recording as a ``.sto`` file for OpenSim. Returns the path."""
    return write_file(path, opensim_bytes(recording))
