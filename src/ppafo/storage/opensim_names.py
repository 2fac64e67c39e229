"""A recording of a walk in the names, zero and signs of OpenSim.

``ankle_angle_r`` is 0 with the foot square to the shank and grows in dorsiflexion [rad]. ``ankle_angle_r_moment`` is
the moment along it [N m], below 0 in push-off, and ``ankle_angle_r_device_moment`` what a device adds.
``ground_force_r_vy`` is the vertical force [N]. ``shank_angle_r`` is no coordinate of OpenSim's models, whose legs have
hip and knee: it stays as the package has it, as do channels without a counterpart.
"""

import math

from ppafo.constants import STANDARD_GRAVITY
from ppafo.signals import Channel, Recording

_ANGLES = {"ankle_angle": "{}", "angle": "{}", "healthy_angle": "healthy_{}"}
"""Names of angles [rad], with the coordinate of the ankle in them; OpenSim counts them from the square foot."""
_REVERSED = {"angular_velocity": "{}_speed", "ankle_moment": "{}_moment", "external_torque": "{}_device_moment"}
"""Names of what OpenSim counts above 0 in dorsiflexion, and the package in plantarflexion."""
_OF_A_SIDE = ("shank_angle",)
"""Channels that only get the letter of their side."""
_PER_MASS = ("ankle_moment", "vertical_force")
"""Channels that may be per mass of the body: [N m/kg], and [N/kg] or multiples of the body's weight [-]."""


def opensim_recording(
    recording: Recording, side: str = "right", body_mass: float | None = None
) -> tuple[Recording, tuple[str, ...]]:
    """Return a recording of a walk in OpenSim's names, zero and signs, and the channels that need ``body_mass`` [kg].

    Moment and force per mass become the body's; without a body mass they are left out and named.
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
    return Recording(recording.label, recording.time, channels, recording.kind), missing
