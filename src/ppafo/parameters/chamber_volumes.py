"""What the chambers of the paper's device may be: its two printed facts about them exclude each other.

By virtual work the torque constant and the volume per angle are one number but for losses; printed they differ by a
factor of 3.5 (docs/decisions/0014). Every figure of gas rests on them, so it is shown for each reading.
"""

import math
from dataclasses import dataclass

from ppafo.parameters.device import Actuator
from ppafo.parameters.loading import load_device

PRINTED_VOLUMES, CONSISTENT_VOLUMES = "ppafo2011", "ppafo2011-consistent"
SHORT_LINES = f"{CONSISTENT_VOLUMES}, short lines"
"""The vane by virtual work, with the dead volumes of the set that has the printed vane."""

_SAME = 1.0e-9
"""Relative difference of numbers that are the same but for their conversion to SI."""

_FIELDS = ("volume_per_angle", "dead_volume_1", "dead_volume_2")


@dataclass(frozen=True, slots=True)
class ChamberVolumes:
    """One reading: its name, volume per angle [m^3/rad] and both dead volumes [m^3]."""

    name: str
    volume_per_angle: float
    dead_volume_1: float
    dead_volume_2: float

    def numbers(self) -> dict[str, float]:
        """Return the same by path, in SI units; whatever follows the chambers moves with them."""
        return {f"actuator.{name}": getattr(self, name) for name in _FIELDS}

    def overrides(self) -> tuple[str, ...]:
        """Return the same as overrides, which whatever is set by the chambers follows."""
        units = ("m^3/rad", "m^3", "m^3")
        return tuple(
            f"actuator.{name}={getattr(self, name)!r} {unit}" for name, unit in zip(_FIELDS, units, strict=True)
        )

    def fits(self, actuator: Actuator) -> bool:
        """Tell whether an actuator has these chambers."""
        return all(math.isclose(getattr(self, name), getattr(actuator, name), rel_tol=_SAME) for name in _FIELDS)


def readings() -> tuple[ChamberVolumes, ...]:
    """Return the readings of the paper's chambers: as printed, by virtual work, and that with short lines."""
    printed, consistent = (load_device(name).actuator for name in (PRINTED_VOLUMES, CONSISTENT_VOLUMES))
    return (
        ChamberVolumes(PRINTED_VOLUMES, *(getattr(printed, name) for name in _FIELDS)),
        ChamberVolumes(CONSISTENT_VOLUMES, *(getattr(consistent, name) for name in _FIELDS)),
        ChamberVolumes(SHORT_LINES, consistent.volume_per_angle, printed.dead_volume_1, printed.dead_volume_2),
    )


def other_readings(actuator: Actuator) -> tuple[ChamberVolumes, ...]:
    """Return the readings other than that of an actuator; none for one that has other volumes or torque."""
    known = readings()
    torque_constant = load_device(PRINTED_VOLUMES).actuator.torque_constant
    is_of_the_paper = math.isclose(actuator.torque_constant, torque_constant, rel_tol=_SAME)
    if not is_of_the_paper or not any(reading.fits(actuator) for reading in known):
        return ()
    return tuple(reading for reading in known if not reading.fits(actuator))


def own_reading(actuator: Actuator) -> ChamberVolumes | None:
    """Return the reading that an actuator has, None where it is none of them."""
    return next((reading for reading in readings() if reading.fits(actuator)), None)
