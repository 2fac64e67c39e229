"""Shut-off valve for the safe state: normally closed, with a watchdog that switches off the power of all valves."""

from typing import NamedTuple

from ppafo.model.declaration import Quantity

NEVER = 1.0e9
"""Time [s] of an event that does not occur."""

SHUT_OFF = (
    Quantity("area", "m^2", "flow area of the shut-off valve", None, 0.0, 1.0e-3, minimum_allowed=False),
    Quantity("discharge_coefficient", "1", "discharge coefficient of the shut-off valve", 0.7, 0.01, 1.0),
    Quantity("delay", "s", "time from the alarm until the line is vented", 0.02, 0.0, 1.0),
    Quantity(
        "silence", "s", "watchdog: a controller that is silent for longer shuts the valve permanently", 0.01, 0.0, 1.0e9
    ),
    Quantity("mass", "kg", "mass of the shut-off valve", 0.06, 0.0, 1.0),
    Quantity(
        "power", "W", "electrical power that keeps the shut-off valve open while the device helps", 0.5, 0.0, 100.0
    ),
)
"""Settings of a shut-off valve; mass and power of a miniature 3/2 solenoid with a holding circuit, assumed."""


class ShutOff(NamedTuple):
    """Shut-off valve, normally closed 3/2: conductance [kg/(s Pa)], 0 if none is fitted, and delay [s].

    Its watchdog switches off the power of all valves if the controller is silent for longer than ``silence`` [s];
    ``NEVER`` if there is none.
    """

    conductance: float
    delay: float
    silence: float


NOT_FITTED = ShutOff(0.0, 0.0, NEVER)


class Unpowered(NamedTuple):
    """Times [s] for which the shut-off valve has been without power and the controller has been silent.

    The valve is without power after the controller stops the device, in a brown-out, and after the watchdog acts.
    """

    since: float
    silent: float


POWERED = Unpowered(0.0, 0.0)


def vents_line(shut_off: ShutOff, unpowered: Unpowered) -> bool:
    """Return whether the shut-off valve vents its downstream line to the atmosphere."""
    return (unpowered.since > shut_off.delay) & (shut_off.conductance > 0.0)


def is_silenced(shut_off: ShutOff, unpowered: Unpowered) -> bool:
    """Return whether the watchdog has switched off the power of all valves."""
    return unpowered.silent > shut_off.silence


def next_unpowered(
    shut_off: ShutOff, unpowered: Unpowered, runs: bool, stopped: bool, brown_out: bool, period: float
) -> Unpowered:
    """Time without power one sample ``period`` [s] later; ``runs`` is True if the controller is alive.

    The power is off after the controller has ``stopped`` the device, and at once in a ``brown_out``. A watchdog that
    has acted stays active, because the state of a returning controller is unknown.
    """
    silenced = is_silenced(shut_off, unpowered)
    silent = unpowered.silent if silenced else (0.0 if runs | brown_out else unpowered.silent + period)
    # The same test with the new silence: the sample that exceeds the limit already takes the power.
    since = unpowered.since + period if stopped | (silent > shut_off.silence) else 0.0
    return Unpowered(NEVER if brown_out else since, silent)
