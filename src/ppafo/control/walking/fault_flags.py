"""Fault flags of a walking controller: one table of names, assistance levels, causes, readings and settings.

A flag reduces the assistance to lifting, pauses it or stops it. If the heel is not detected, the foot is still lifted
in the swing, but not pushed. A pause vents both chambers and is for readings that walking can cause too: assistance
resumes after some good strides. A stop is permanent, for readings that only a fault causes.

A flag is a number in the state of a run, in order of urgency: first the flags that stop, then pause, then lift.
"""

from dataclasses import dataclass

from ppafo.model.helping import HELPS, LIFTS, PAUSED, STOPPED

FORCES = ("heel_force", "toe_force")
PRESSURES = ("pressure_1", "pressure_2")
SEEN = ("nominal_flow", "nominal_supply_pressure")


@dataclass(frozen=True, slots=True)
class FaultFlag:
    """Fault flag: name, requested assistance level, cause, and the readings and settings that the check uses."""

    name: str
    level: float
    summary: str
    readings: tuple[str, ...]
    settings: tuple[str, ...]


NO_FLAG = 0.0
NOT_RAISED = 1.0e3
"""Number larger than every flag: the smallest result of several checks is the most urgent flag."""

FAULT_FLAGS = {
    (FORCE_RANGE := 1.0): FaultFlag(
        "force_range", STOPPED, "implausible foot force", FORCES, ("lowest_force", "largest_force")
    ),
    (ANGLE_RANGE := 2.0): FaultFlag(
        "angle_range", STOPPED, "implausible ankle angle", ("angle",), ("lowest_angle", "highest_angle")
    ),
    (PRESSURE_RANGE := 3.0): FaultFlag(
        "pressure_range", STOPPED, "implausible chamber pressure", PRESSURES, ("lowest_pressure", "highest_pressure")
    ),
    (NO_RISE := 4.0): FaultFlag(
        "no_rise",
        STOPPED,
        "no pressure in a chamber that the open valve has filled",
        PRESSURES,
        ("filled_pressure", "fill_time"),
    ),
    (NO_FALL := 5.0): FaultFlag(
        "no_fall",
        STOPPED,
        "pressure that does not fall in a vented chamber",
        PRESSURES,
        ("filled_pressure", "vent_time", "follow_time"),
    ),
    (SUPPLY_HIGH := 6.0): FaultFlag(
        "supply_high",
        STOPPED,
        "more gas in a chamber than its supply can have given: supply pressure too high",
        PRESSURES,
        SEEN,
    ),
    (SUPPLY_LOW := 7.0): FaultFlag(
        "supply_low",
        STOPPED,
        "less gas in a chamber than its supply gives: supply pressure too low, or a hose kinked",
        PRESSURES,
        SEEN,
    ),
    (SUPPLY_LOST := 8.0): FaultFlag(
        "supply_lost",
        STOPPED,
        "no gas reaches a chamber: supply lost, hose off, or a valve that never opens",
        PRESSURES,
        SEEN,
    ),
    (VALVE_OPEN := 9.0): FaultFlag(
        "valve_open",
        STOPPED,
        "gas enters a chamber that is not fed: a valve stuck open, or a leak across the vane",
        PRESSURES,
        SEEN,
    ),
    (VALVE_SHUT := 10.0): FaultFlag(
        "valve_shut",
        STOPPED,
        "a vented chamber has too much gas: a valve stuck shut, a hose kinked, or a leak across the vane",
        PRESSURES,
        SEEN,
    ),
    (LEAK := 11.0): FaultFlag(
        "leak", STOPPED, "a chamber loses gas that its valve keeps in: a leak, also across the vane", PRESSURES, SEEN
    ),
    (PRESSURE_SENSOR := 12.0): FaultFlag(
        "pressure_sensor",
        STOPPED,
        "reading of a vented chamber that does not fall and does not match its gas",
        PRESSURES,
        ("filled_pressure", "vent_time"),
    ),
    (FROZEN_HEEL := 13.0): FaultFlag(
        "frozen_heel", STOPPED, "heel force frozen while the toe force changes", FORCES, ("frozen_time",)
    ),
    (FROZEN_TOE := 14.0): FaultFlag(
        "frozen_toe", STOPPED, "toe force frozen while the heel force changes", FORCES, ("frozen_time",)
    ),
    (FROZEN_ANGLE := 15.0): FaultFlag("frozen_angle", STOPPED, "angle frozen for a whole stride", ("angle",), ()),
    (FORCE_GONE := 16.0): FaultFlag(
        "force_gone", STOPPED, "large force lost within one sample", FORCES, ("largest_drop",)
    ),
    (STILL_HEEL := 17.0): FaultFlag(
        "still_heel", PAUSED, "force of a loaded heel unchanged while other readings move", FORCES, ("frozen_time",)
    ),
    (STILL_TOE := 18.0): FaultFlag(
        "still_toe", PAUSED, "force of loaded toes unchanged while other readings move", FORCES, ("frozen_time",)
    ),
    (STILL_ANGLE := 19.0): FaultFlag(
        "still_angle", PAUSED, "angle unchanged in stance while other readings move", ("angle",), ("frozen_time",)
    ),
    (ENDLESS_PHASE := 20.0): FaultFlag(
        "endless_phase", PAUSED, "swing, heel-only or toe-only contact lasting too long", FORCES, ("longest_phase",)
    ),
    (RESTLESS := 21.0): FaultFlag(
        "restless", PAUSED, "endless stance in which heel or toe contact comes and goes", FORCES, ("longest_phase",)
    ),
    (NO_TOES := 22.0): FaultFlag("no_toes", PAUSED, "swing right after heel strike, without toe contact", FORCES, ()),
    (NOT_FLAT := 23.0): FaultFlag(
        "not_flat", PAUSED, "no toe load in flat-foot stance", FORCES, ("flat_from", "flat_to")
    ),
    (FLAT_ANGLE := 24.0): FaultFlag(
        "flat_angle",
        PAUSED,
        "implausible ankle angle in flat-foot stance",
        ("angle",),
        ("lowest_flat_angle", "highest_flat_angle"),
    ),
    (SHORT_SWING := 25.0): FaultFlag(
        "short_swing", PAUSED, "swing too short for its stride", FORCES, ("shortest_swing",)
    ),
    (NO_TOE_OFF := 26.0): FaultFlag(
        "no_toe_off", PAUSED, "stance without toe-off: heel and toe sensors show the same, or are swapped", FORCES, ()
    ),
    (NO_HEEL := 27.0): FaultFlag(
        "no_heel", LIFTS, "no heel load in flat-foot stance", FORCES, ("flat_from", "flat_to")
    ),
    (TOE_STRIDES := 28.0): FaultFlag(
        "toe_strides", LIFTS, "consecutive strides on the toes alone", FORCES, ("most_toe_strides",)
    ),
    (LATE_FORCES := 29.0): FaultFlag(
        "late_forces",
        LIFTS,
        "two strides in which the ankle angle shows foot flat or toe-off before the forces do",
        (*FORCES, "angle"),
        ("highest_toe_off_angle",),
    ),
}
"""Fault flags by number; each number has a constant for the functions that raise the flag."""

# Levels from the order of the numbers: a comparison in vector code instead of a table.
_LAST_STOP = max(number for number, flag in FAULT_FLAGS.items() if flag.level == STOPPED)
_FIRST_LIFT = min(number for number, flag in FAULT_FLAGS.items() if flag.level == LIFTS)


def level_of(flag: float) -> float:
    """Assistance level requested by a fault flag: ``HELPS`` without a flag, ``STOPPED``, ``PAUSED`` or ``LIFTS``."""
    level = LIFTS if flag >= _FIRST_LIFT else PAUSED
    level = STOPPED if flag <= _LAST_STOP else level
    return level if flag > NO_FLAG else HELPS


def raised(flag: float, is_contradicted: bool) -> float:
    """Return the flag if its check is contradicted, else ``NOT_RAISED``; the smallest flag is the most urgent."""
    return flag if is_contradicted else NOT_RAISED
