"""Conversion of a walking recording to names, zeros and signs of OpenSim.

``ankle_angle_r`` [rad] is 0 with the foot at a right angle to the shank, positive in dorsiflexion.
``ankle_angle_r_moment`` is the ankle moment in this direction [N m], negative in push-off;
``ankle_angle_r_device_moment`` is the contribution of a device. ``ground_force_r_vy`` is the vertical force [N].
``shank_angle_r`` is no coordinate of OpenSim models, whose legs have hip and knee; it keeps the definition of this
package, as do all channels without a counterpart.
"""

import math
from dataclasses import replace

from ppafo.constants import STANDARD_GRAVITY
from ppafo.signals import Channel, Recording

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
    foot, coordinate, mass = side[0], f"ankle_angle_{side[0]}", body_mass or 0.0
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
