"""Signals by which a controller measures the controlled quantity: their rows, delays, and the joint's range of angles.

If nothing prescribes the joint angle, gains are computed for the usual angle.
"""

import math
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

from ppafo.constants import STANDARD_GRAVITY
from ppafo.control.profiles import TABLE, Knot, TabulatedProfile, table_bounds
from ppafo.model.actuators.kind import Range
from ppafo.model.controlled import ANGLE
from ppafo.model.declaration import Number, row_with
from ppafo.simulation.declaration import LOCKED_ANGLE
from ppafo.simulation.mean_chambers import usual_place
from ppafo.simulation.motion_kind import LawSignals

PERIOD_PATH = "controller.period"
MOVED = "motion.profile"
"""Table of the profile that prescribes the joint angle."""
_OF_DEVICE = (
    "foot_plate.inertia",
    "foot_plate.gravity_torque",
    "friction.viscous_damping",
    "friction.dynamic_torque",
    "friction.static_torque",
)
_OF_ANGLE = ("sensors.angle_bandwidth", "sensors.angle_resolution", "sensors.angle_noise")
LEG_PATHS = ("motion.foot_mass", "motion.foot_mass_centre", "motion.foot_inertia")
"""Paths of the foot of a leg."""

_Seconds = Annotated[float, Number("s", "")]
_Hertz = Annotated[float, Number("Hz", "")]
_Inertia = Annotated[float, Number("kg m^2", "")]
_Torque = Annotated[float, Number("N m", "")]
_Damping = Annotated[float, Number("N m s/rad", "")]
_Angle = Annotated[float, Number("rad", "")]
_Mass = Annotated[float, Number("kg", "")]
_Length = Annotated[float, Number("m", "")]


class _SignalsOfWalk(NamedTuple):
    """Sample period [s] and bandwidth of the pressure sensors [Hz] in a walk, which has no transport delay."""

    period: _Seconds
    bandwidth: _Hertz


class Signals(NamedTuple):
    """Sample period [s], bandwidth of the pressure sensors [Hz] and transport delay of a measurement [s]."""

    period: _Seconds
    bandwidth: _Hertz
    delay: _Seconds


_Joint = {
    "angle_resolution": _Angle,
    "angle_noise": _Angle,
    "inertia": _Inertia,
    "gravity_torque": _Torque,
    "viscous_damping": _Damping,
    "dynamic_torque": _Torque,
    "static_torque": _Torque,
}
Locked: Any = row_with("Locked", Signals, locked_angle=_Angle)
"""Signals of a locked joint, with its angle [rad]."""
OfJoint: Any = row_with("OfJoint", Signals, angle_bandwidth=_Hertz, **_Joint)
"""Signals of a scenario; bandwidth [Hz], resolution and noise [rad] of its angle sensor; moving mass and friction."""
OfLeg: Any = row_with("OfLeg", OfJoint, foot_mass=_Mass, foot_mass_centre=_Length, foot_inertia=_Inertia)
"""Signals, and a joint with a foot: foot mass [kg], distance to its centre of mass [m], inertia about that [kg m^2]."""
_Ramp = {"start_level": _Angle, "level": _Angle}
_Sine = {"level": _Angle, "amplitude": _Angle}
_KNOTS = tuple(quantity.name for quantity in TABLE.quantities)
# The signals have a period of their own.
_Table = {
    name.replace("period", "repetition"): _Angle if name.startswith(("level", "value")) else _Seconds for name in _KNOTS
}
JointAtLevel: Any = row_with("JointAtLevel", OfJoint, level=_Angle)
LegAtLevel: Any = row_with("LegAtLevel", OfLeg, level=_Angle)
JointOnRamp: Any = row_with("JointOnRamp", OfJoint, **_Ramp)
LegOnRamp: Any = row_with("LegOnRamp", OfLeg, **_Ramp)
JointOnSine: Any = row_with("JointOnSine", OfJoint, **_Sine)
LegOnSine: Any = row_with("LegOnSine", OfLeg, **_Sine)
JointOnTable: Any = row_with("JointOnTable", OfJoint, **_Table)
LegOnTable: Any = row_with("LegOnTable", OfLeg, **_Table)
"""Signals with the settings of a reference of the angle [rad]."""
MovedToLevel: Any = row_with("MovedToLevel", Signals, level=_Angle)
MovedOnRamp: Any = row_with("MovedOnRamp", Signals, **_Ramp)
MovedOnSine: Any = row_with("MovedOnSine", Signals, **_Sine)
MovedOnTable: Any = row_with("MovedOnTable", Signals, **_Table)
"""Signals of a joint whose angle is prescribed, with the settings of its profile [rad]."""


def anywhere(stops: Range, _signals: Any) -> tuple[float, float]:
    """Lowest and highest angle [rad] of a joint without prescribed angle; both are the usual angle."""
    place = usual_place(stops.angle_min, stops.angle_max)
    return place, place


def where_locked(_stops: Range, signals: Any) -> tuple[float, float]:
    """Lowest and highest angle [rad] of a locked joint: the locked angle for both."""
    return signals.locked_angle, signals.locked_angle


def at_level(stops: Range, signals: Any) -> tuple[float, float]:
    """Lowest and highest angle [rad] of a joint with constant reference angle: that angle for both."""
    return between(stops, signals.level), between(stops, signals.level)


def at_both_levels(stops: Range, signals: Any) -> tuple[float, float]:
    """Start and final angle [rad] of a joint whose reference is a ramp, limited to the stops."""
    return between(stops, signals.start_level), between(stops, signals.level)


def at_both_crests(stops: Range, signals: Any) -> tuple[float, float]:
    """Lowest and highest angle [rad] of a joint whose reference is a sine, limited to the stops."""
    return between(stops, signals.level - signals.amplitude), between(stops, signals.level + signals.amplitude)


def between(stops: Range, angle: float) -> float:
    """Angle [rad], limited to the range between the stops."""
    return float(min(max(angle, stops.angle_min), stops.angle_max))


def at_knots(stops: Range, signals: Any) -> tuple[float, float]:
    """Lowest and highest angle [rad] of a joint whose reference is a table; curves exceed the knots slightly."""
    lowest, highest = table_bounds(table_of(signals))
    return between(stops, lowest), between(stops, highest)


def table_of(row: Any) -> TabulatedProfile:
    """Tabulated profile from a row that lists its settings one by one."""
    return TabulatedProfile(
        level=row.level,
        period=row.repetition,
        value_01=row.value_01,
        knots=(
            Knot(row.time_02, row.value_02),
            Knot(row.time_03, row.value_03),
            Knot(row.time_04, row.value_04),
            Knot(row.time_05, row.value_05),
            Knot(row.time_06, row.value_06),
            Knot(row.time_07, row.value_07),
            Knot(row.time_08, row.value_08),
            Knot(row.time_09, row.value_09),
            Knot(row.time_10, row.value_10),
            Knot(row.time_11, row.value_11),
            Knot(row.time_12, row.value_12),
            Knot(row.time_13, row.value_13),
            Knot(row.time_14, row.value_14),
            Knot(row.time_15, row.value_15),
            Knot(row.time_16, row.value_16),
            Knot(row.time_17, row.value_17),
            Knot(row.time_18, row.value_18),
            Knot(row.time_19, row.value_19),
            Knot(row.time_20, row.value_20),
            Knot(row.time_21, row.value_21),
            Knot(row.time_22, row.value_22),
            Knot(row.time_23, row.value_23),
            Knot(row.time_24, row.value_24),
            Knot(row.time_25, row.value_25),
            Knot(row.time_26, row.value_26),
            Knot(row.time_27, row.value_27),
            Knot(row.time_28, row.value_28),
            Knot(row.time_29, row.value_29),
            Knot(row.time_30, row.value_30),
            Knot(row.time_31, row.value_31),
            Knot(row.time_32, row.value_32),
        ),
    )


def lag_of_sensor(bandwidth: float) -> float:
    """Time constant [s] of a sensor with a bandwidth [Hz]; 0 for bandwidth 0, which means an ideal sensor."""
    return 1.0 / (2.0 * math.pi * bandwidth) if bandwidth > 0.0 else 0.0


def time_in_scenario(signals: Signals) -> float:
    """Delay of a pressure measurement [s]: transport delay plus pressure-sensor lag."""
    return signals.delay + lag_of_sensor(signals.bandwidth)


def time_in_walk(signals: _SignalsOfWalk) -> float:
    """Lag of the pressure sensors in a walk [s]."""
    return lag_of_sensor(signals.bandwidth)


def time_with_angle(signals: Any) -> float:
    """Measurement delay [s]: transport delay plus lag of the slower of angle and pressure sensors."""
    late: float = max(lag_of_sensor(signals.bandwidth), lag_of_sensor(signals.angle_bandwidth))
    age: float = signals.delay
    return age + late


def turning_alone(signals: Any) -> tuple[float, float]:
    """Inertia [kg m^2] and largest gravity torque [N m] of the parts that the actuator moves."""
    return signals.inertia, signals.gravity_torque


def turning_with_foot(signals: Any) -> tuple[float, float]:
    """Inertia [kg m^2] and largest gravity torque [N m] of actuator and foot about the ankle."""
    moment = signals.foot_mass * signals.foot_mass_centre
    inertia = signals.inertia + signals.foot_inertia + moment * signals.foot_mass_centre
    return inertia, signals.gravity_torque + moment * STANDARD_GRAVITY


_PRESSURES = (PERIOD_PATH, "sensors.pressure_bandwidth")
_ANGLE = (*_PRESSURES, "sensors.delay", *_OF_ANGLE, *_OF_DEVICE)
IN_WALK = LawSignals(signals=_SignalsOfWalk, late=time_in_walk, paths=_PRESSURES, places=anywhere)
"""Signals of a torque controller in a walk."""
IN_SCENARIO = LawSignals(signals=Signals, late=time_in_scenario, paths=(*_PRESSURES, "sensors.delay"), places=anywhere)
"""Signals of a controller of torque or pressure, for a vane alone."""
LOCKED = LawSignals(
    signals=Locked, late=time_in_scenario, paths=(*_PRESSURES, "sensors.delay", LOCKED_ANGLE), places=where_locked
)
"""Signals of a controller of torque or pressure whose joint is locked at an angle."""
_PLACES: dict[str, tuple[tuple[type, type, type], tuple[str, ...], Callable[[Range, Any], tuple[float, float]]]] = {
    "": ((Signals, OfJoint, OfLeg), (), anywhere),
    "constant": ((MovedToLevel, JointAtLevel, LegAtLevel), ("level",), at_level),
    "ramp_hold": ((MovedOnRamp, JointOnRamp, LegOnRamp), ("start_level", "level"), at_both_levels),
    "sine": ((MovedOnSine, JointOnSine, LegOnSine), ("level", "amplitude"), at_both_crests),
    "tabulated": ((MovedOnTable, JointOnTable, LegOnTable), _KNOTS, at_knots),
    "smooth": ((MovedOnTable, JointOnTable, LegOnTable), _KNOTS, at_knots),
}
"""Row types, settings that determine the range of joint angles, and function for this range, by kind of profile.

Row types are for a joint moved along the profile, a joint whose angle is controlled, and the latter with a leg's foot.
"""


def seen_in_scenario(
    controlled: str, has_leg: bool, is_locked: bool = False, reference: str = "", moved: str = ""
) -> LawSignals:
    """Return the signals of the controller of a vane alone, for its controlled quantity and kind of reference.

    The joint may carry the foot of a leg, be locked, or be moved along a profile of the kind ``moved``.
    """
    if controlled == ANGLE:
        rows, names, places = _PLACES.get(reference, _PLACES[""])
        return LawSignals(
            signals=rows[1 + has_leg],
            late=time_with_angle,
            paths=(*_ANGLE, *(LEG_PATHS if has_leg else ()), *(f"reference.{name}" for name in names)),
            places=places,
            turning=turning_with_foot if has_leg else turning_alone,
        )
    if is_locked:
        return LOCKED
    rows, names, places = _PLACES.get(moved, _PLACES[""])
    paths = (*IN_SCENARIO.paths, *(f"{MOVED}.{name}" for name in names))
    return LawSignals(signals=rows[0], late=time_in_scenario, paths=paths, places=places)
