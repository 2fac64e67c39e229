"""The signs by which a controller of walking vents both chambers: what each is, and whether it pauses or stops.

A pause is for what walking does too: help comes back after some good strides. A stop is for what only a fault does: it
is for good. A sign is a number in the lanes, and 0 is none.
"""

from dataclasses import dataclass

HELPS = 0.0
PAUSED = 1.0
STOPPED = 2.0

NO_SIGN = 0.0
FORCE_RANGE = 1.0
ANGLE_RANGE = 2.0
PRESSURE_RANGE = 3.0
NO_RISE = 4.0
NO_FALL = 5.0
FROZEN_HEEL = 6.0
FROZEN_TOE = 7.0
FROZEN_ANGLE = 8.0
STILL_HEEL = 9.0
STILL_TOE = 10.0
STILL_ANGLE = 11.0
ENDLESS_PHASE = 12.0
NO_TOES = 13.0
NOT_FLAT = 14.0
TOE_STRIDES = 15.0
SHORT_SWING = 16.0

FORCES = ("heel_force", "toe_force")
PRESSURES = ("pressure_1", "pressure_2")


@dataclass(frozen=True, slots=True)
class Sign:
    """A sign: its name, what is seen, and the names of the readings and settings that it goes by."""

    name: str
    summary: str
    readings: tuple[str, ...]
    settings: tuple[str, ...]


SIGNS: dict[float, Sign] = {
    FORCE_RANGE: Sign("force_range", "a force that no foot gives", FORCES, ("lowest_force", "largest_force")),
    ANGLE_RANGE: Sign("angle_range", "an angle that no ankle has", ("angle",), ("lowest_angle", "highest_angle")),
    PRESSURE_RANGE: Sign(
        "pressure_range", "a pressure that no chamber has", PRESSURES, ("lowest_pressure", "highest_pressure")
    ),
    NO_RISE: Sign(
        "no_rise",
        "a chamber that the open valve has filled and that shows no pressure",
        PRESSURES,
        ("filled_pressure", "fill_time"),
    ),
    NO_FALL: Sign(
        "no_fall",
        "a vented chamber that shows a pressure which does not fall",
        PRESSURES,
        ("filled_pressure", "vent_time"),
    ),
    FROZEN_HEEL: Sign("frozen_heel", "a heel force that stays the same while the toes move", FORCES, ("frozen_time",)),
    FROZEN_TOE: Sign("frozen_toe", "a toe force that stays the same while the heel moves", FORCES, ("frozen_time",)),
    FROZEN_ANGLE: Sign("frozen_angle", "an angle that stays the same for a whole stride", ("angle",), ()),
    STILL_HEEL: Sign("still_heel", "a loaded heel whose force stays the same", FORCES, ("frozen_time",)),
    STILL_TOE: Sign("still_toe", "loaded toes whose force stays the same", FORCES, ("frozen_time",)),
    STILL_ANGLE: Sign("still_angle", "an angle in stance that stays the same", ("angle",), ("frozen_time",)),
    ENDLESS_PHASE: Sign("endless_phase", "a stance or a swing without end", FORCES, ("longest_phase",)),
    NO_TOES: Sign("no_toes", "a swing right after the heel strike, without the toes", FORCES, ()),
    NOT_FLAT: Sign(
        "not_flat", "a foot that must stand flat and loads only one sensor, or none", FORCES, ("flat_from", "flat_to")
    ),
    TOE_STRIDES: Sign(
        "toe_strides", "strides that begin on the toes, one after the other", FORCES, ("most_toe_strides",)
    ),
    SHORT_SWING: Sign("short_swing", "a swing that is too short for its stride", FORCES, ("shortest_swing",)),
}
"""Every sign by its number: those up to ``FROZEN_ANGLE`` stop, the others pause."""


def level_of(sign: float) -> float:
    """The level that a sign asks for: ``HELPS`` without one, ``STOPPED`` or ``PAUSED``."""
    stopped = STOPPED if sign <= FROZEN_ANGLE else PAUSED
    return stopped if sign > NO_SIGN else HELPS
