"""The signs by which a controller of walking helps less: what each is, and whether it lifts only, pauses or stops.

Where the heel is missed the foot is still held up in the swing, and not pushed. A pause vents both chambers, for what
walking does too: help comes back after some good strides. A stop is for what only a fault does: it is for good. A sign
is a number in the lanes, and 0 is none.
"""

from dataclasses import dataclass
from typing import NamedTuple

from ppafo.model.declaration import PRESSURE_LAG, VALVE_LAG, Quantity

HELPS = 0.0
LIFTS = 1.0
PAUSED = 2.0
STOPPED = 3.0

NO_SIGN = 0.0
FORCE_RANGE = 1.0
ANGLE_RANGE = 2.0
PRESSURE_RANGE = 3.0
NO_RISE = 4.0
NO_FALL = 5.0
FROZEN_HEEL = 6.0
FROZEN_TOE = 7.0
FROZEN_ANGLE = 8.0
FORCE_GONE = 9.0
STILL_HEEL = 10.0
STILL_TOE = 11.0
STILL_ANGLE = 12.0
ENDLESS_PHASE = 13.0
RESTLESS = 14.0
NO_TOES = 15.0
NOT_FLAT = 16.0
FLAT_ANGLE = 17.0
SHORT_SWING = 18.0
NO_HEEL = 19.0
TOE_STRIDES = 20.0
LATE_FORCES = 21.0

FORCES = ("heel_force", "toe_force")
PRESSURES = ("pressure_1", "pressure_2")


class SafetyRules(NamedTuple):
    """What readings can be, and how long a contradiction may last; ``declaration.SAFETY_QUANTITIES`` says it of each.

    Force [N], angles [rad], times in stride times (``longest_phase``, ``flat_from``, ``flat_to``, ``shortest_swing``)
    or [s], strides, and absolute pressures [Pa]. ``fill_time`` is that of a valve fully open; half open it takes twice
    as long.
    """

    lowest_force: float
    largest_force: float
    lowest_angle: float
    highest_angle: float
    longest_phase: float
    frozen_time: float
    most_toe_strides: float
    flat_from: float
    flat_to: float
    lowest_pressure: float
    highest_pressure: float
    filled_pressure: float
    fill_time: float
    vent_time: float
    shortest_swing: float
    resume_strides: float
    largest_drop: float
    lowest_flat_angle: float
    highest_flat_angle: float
    follow_time: float
    highest_toe_off_angle: float


@dataclass(frozen=True, slots=True)
class Sign:
    """A sign: its name, what is seen, and the names of the readings and settings that it goes by."""

    name: str
    summary: str
    readings: tuple[str, ...]
    settings: tuple[str, ...]


SIGNS: dict[float, Sign] = {
    FORCE_RANGE: Sign("force_range", "implausible foot force", FORCES, ("lowest_force", "largest_force")),
    ANGLE_RANGE: Sign("angle_range", "an angle that no ankle has", ("angle",), ("lowest_angle", "highest_angle")),
    PRESSURE_RANGE: Sign(
        "pressure_range", "implausible chamber pressure", PRESSURES, ("lowest_pressure", "highest_pressure")
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
        ("filled_pressure", "vent_time", "follow_time"),
    ),
    FROZEN_HEEL: Sign("frozen_heel", "a heel force that stays the same while the toes move", FORCES, ("frozen_time",)),
    FROZEN_TOE: Sign("frozen_toe", "a toe force that stays the same while the heel moves", FORCES, ("frozen_time",)),
    FROZEN_ANGLE: Sign("frozen_angle", "an angle that stays the same for a whole stride", ("angle",), ()),
    FORCE_GONE: Sign("force_gone", "a large force that is gone within a sample", FORCES, ("largest_drop",)),
    STILL_HEEL: Sign(
        "still_heel", "a loaded heel whose force stays the same while something else moves", FORCES, ("frozen_time",)
    ),
    STILL_TOE: Sign(
        "still_toe", "loaded toes whose force stays the same while something else moves", FORCES, ("frozen_time",)
    ),
    STILL_ANGLE: Sign(
        "still_angle", "an angle in stance that stays the same while something else moves", ("angle",), ("frozen_time",)
    ),
    ENDLESS_PHASE: Sign(
        "endless_phase", "swing, heel-only or toe-only contact lasting too long", FORCES, ("longest_phase",)
    ),
    RESTLESS: Sign("restless", "a stance without end in which heel or toes come and go", FORCES, ("longest_phase",)),
    NO_TOES: Sign("no_toes", "a swing right after the heel strike, without the toes", FORCES, ()),
    NOT_FLAT: Sign(
        "not_flat", "a foot that must stand flat and does not load the toes", FORCES, ("flat_from", "flat_to")
    ),
    FLAT_ANGLE: Sign(
        "flat_angle",
        "an angle that no ankle has while the foot must stand flat",
        ("angle",),
        ("lowest_flat_angle", "highest_flat_angle"),
    ),
    SHORT_SWING: Sign("short_swing", "a swing that is too short for its stride", FORCES, ("shortest_swing",)),
    NO_HEEL: Sign(
        "no_heel", "a foot that must stand flat and does not load the heel", FORCES, ("flat_from", "flat_to")
    ),
    TOE_STRIDES: Sign("toe_strides", "strides on the toes alone, one after the other", FORCES, ("most_toe_strides",)),
    LATE_FORCES: Sign(
        "late_forces",
        "two strides in which the ankle shows the foot flat, or in the air, before the forces do",
        (*FORCES, "angle"),
        ("highest_toe_off_angle",),
    ),
}
"""Every sign by its number: those up to ``FORCE_GONE`` stop, from ``NO_HEEL`` on the foot is lifted only."""


def level_of(sign: float) -> float:
    """The level that a sign asks for: ``HELPS`` without one, ``STOPPED``, ``PAUSED`` or ``LIFTS``."""
    level = LIFTS if sign >= NO_HEEL else PAUSED
    level = STOPPED if sign <= FORCE_GONE else level
    return level if sign > NO_SIGN else HELPS


def first_sign(some: float, others: float) -> float:
    """The sign of two that comes first: one that stops before one that pauses, either before none."""
    lower = min(some, others)
    return lower if lower > NO_SIGN else max(some, others)


SAFETY_QUANTITIES = (
    Quantity("lowest_force", "N", "a force below this is not a valid reading", -40.0, -1.0e5, 0.0),
    Quantity("largest_force", "N", "a force above this is not a valid reading", 3.0e3, 100.0, 1.0e5),
    Quantity("lowest_angle", "rad", "an angle below this is not a valid reading", 0.3, -10.0, 10.0),
    Quantity("highest_angle", "rad", "an angle above this is not a valid reading", 2.4, -10.0, 10.0),
    Quantity("longest_phase", "1", "longest stance or swing, in stride times", 1.2, 0.3, 20.0),
    Quantity("frozen_time", "s", "a loaded sensor whose reading does not change for longer is frozen", 0.24, 0.01, 5.0),
    Quantity("most_toe_strides", "1", "strides in a row that may be on the toes alone", 1.0, 0.0, 1.0e6),
    Quantity(
        "flat_from", "1", "from this fraction of a steady stride on, heel and toes are both loaded", 0.16, 0.05, 0.6
    ),
    Quantity("flat_to", "1", "and until this fraction", 0.24, 0.05, 0.6),
    Quantity("lowest_pressure", "Pa_a", "a chamber pressure below this is not a valid reading", 4.5e4, 0.0, 1.0e5),
    Quantity("highest_pressure", "Pa_a", "a chamber pressure above this is not a valid reading", 2.0e6, 1.1e5, 1.0e8),
    Quantity(
        "filled_pressure", "Pa_a", "a filled chamber has a higher pressure, a vented one a lower", 1.25e5, 1.0e4, 1.0e8
    ),
    Quantity("fill_time", "s", "a chamber is filled when the open valve has fed it for this long", 0.05, 1.0e-3, 10.0),
    Quantity(
        "vent_time", "s", "both chambers are vented when the valve has vented them for this long", 0.25, 1.0e-3, 10.0
    ),
    Quantity("shortest_swing", "1", "shortest swing that is seen in a steady stride, fraction of it", 0.25, 0.0, 0.6),
    Quantity("resume_strides", "1", "good strides in a row after which a pause ends", 2.0, 1.0, 1.0e3),
    Quantity("largest_drop", "N", "no force as large as this is gone within a sample", 300.0, 10.0, 1.0e5),
    Quantity("lowest_flat_angle", "rad", "no ankle has less while the foot must stand flat", 1.22, -10.0, 10.0),
    Quantity("highest_flat_angle", "rad", "no ankle has more while the foot must stand flat", 1.92, -10.0, 10.0),
    Quantity(
        "follow_time",
        "s",
        "a pressure follows the valve within this, and the lags of valve and sensor",
        8.0e-3,
        0.0,
        1.0,
        follows=(VALVE_LAG, PRESSURE_LAG),
    ),
    Quantity("highest_toe_off_angle", "rad", "no ankle has more while its toes still carry", 2.06, -10.0, 10.0),
)
