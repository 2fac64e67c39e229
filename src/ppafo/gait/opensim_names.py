"""A recording in OpenSim's names, zero and signs: what is written as ``.sto`` for its tools, and imported again.

``ankle_angle_r`` is 0 with the foot square to the shank and grows in dorsiflexion [rad]. ``ankle_angle_r_moment`` is
the moment along it [N m], below 0 in push-off, and ``ankle_angle_r_device_moment`` what a device adds.
``ground_force_r_vy`` is the vertical force [N]. ``shank_angle_r`` is no coordinate of OpenSim's models, whose legs have
hip and knee: it stays as the package has it, as do channels without a counterpart.
"""

import math

from ppafo.constants import STANDARD_GRAVITY
from ppafo.signals import Channel, Recording

_ANGLES = {"ankle_angle": "{}", "angle": "{}", "healthy_angle": "healthy_{}"}
_REVERSED = {"angular_velocity": "{}_speed", "ankle_moment": "{}_moment", "external_torque": "{}_device_moment"}
_KEPT = ("shank_angle",)
_PER_MASS = ("ankle_moment", "vertical_force")


def opensim_recording(
    recording: Recording, side: str = "right", body_mass: float | None = None
) -> tuple[Recording, tuple[str, ...]]:
    """Return a recording of a walk in OpenSim's names, zero and signs, and the channels that need ``body_mass`` [kg].

    Moment and force per mass become those of the body; without a body mass they are left out and named.
    """
    foot = side[0]
    missing = tuple(name for name in _PER_MASS if name in recording.names and _is_per_mass(recording, name))
    missing = missing if body_mass is None else ()
    channels = {}
    for name in recording.names:
        if name not in missing:
            renamed, channel = _rename(recording, name, foot, body_mass or 0.0)
            channels[renamed] = channel
    if {"heel_force", "toe_force"} <= set(recording.names):
        channels[f"ground_force_{foot}_vy"] = Channel(recording["heel_force"] + recording["toe_force"], "N")
    return Recording(recording.label, recording.time, channels, recording.kind), missing


def _is_per_mass(recording: Recording, name: str) -> bool:
    return recording.unit(name) in ("N m/kg", "-", "N/kg")


def _rename(recording: Recording, name: str, foot: str, body_mass: float) -> tuple[str, Channel]:
    """Return name and values of a channel as OpenSim has them."""
    values, unit = recording[name], recording.unit(name)
    ankle = f"ankle_angle_{foot}"
    if name in _ANGLES and unit == "rad":
        return _ANGLES[name].format(ankle), Channel(0.5 * math.pi - values, unit)
    if name in _REVERSED:
        factor = body_mass if unit == "N m/kg" else 1.0
        return _REVERSED[name].format(ankle), Channel(-factor * values, "N m" if unit == "N m/kg" else unit)
    if name == "vertical_force":
        factor = {"-": body_mass * STANDARD_GRAVITY, "N/kg": body_mass}.get(unit, 1.0)
        return f"ground_force_{foot}_vy", Channel(factor * values, "N")
    return (f"{name}_{foot}" if name in _KEPT else name), Channel(values, unit)
