"""Chambers of any actuator at an angle: torque per pressure, and volume.

If the joint angle is unknown, the chambers are evaluated at a right angle or, if the range has none, at mid-range.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from ppafo.model.actuators.kind import Chambers, Range
from ppafo.model.actuators.vane import VaneSettings
from ppafo.model.binding import made_of
from ppafo.model.catalog import ACTUATORS
from ppafo.model.declaration import PlainFunction
from ppafo.parameters.device import VANE, Actuator

RIGHT_ANGLE = 1.5707963267948966
INSIDE = 0.2
"""Smallest distance of the right angle from a stop [rad]."""
LEAST_GAUGE = 1.0
"""Smallest gauge pressure of a supply [Pa], which avoids a division by 0."""


class Surroundings(NamedTuple):
    """Supply pressures of both chambers, and atmospheric pressure [Pa absolute]."""

    supply_pressure: float
    dorsiflexion_pressure: float
    atmospheric_pressure: float


class MeanChambers(NamedTuple):
    """Chamber properties at an angle.

    ``torque_per_pressure`` [m^3] is the torque per pressure of each chamber. ``volume`` [m^3] is the gas content per
    pressure: volume, plus pressure times compliance. ``growth`` [m^3/rad] is the volume displaced per angle.
    """

    torque_per_pressure_1: float
    torque_per_pressure_2: float
    volume_1: float
    volume_2: float
    growth_1: float
    growth_2: float


class _RestingPlant(NamedTuple):
    """Actuator at rest in the layout of ``ShapedPlant``, the argument of an actuator's model functions."""

    shape: Any
    gas_product: float
    supply_pressure: float
    dorsiflexion_pressure: float
    atmospheric_pressure: float
    gravity_torque: float
    external_torque: float


class _MeasuredParts(NamedTuple):
    """Shape of a measured actuator: function ``prepare``, and its third argument, the measured table."""

    prepare: Callable[[Any, Range, Any], Any]
    table: Any


class _ShapedParts(NamedTuple):
    """Functions of an actuator with a shape: shape from settings and stops, both chambers, torque [N m]."""

    shape: Callable[[Any, Range], Any]
    chambers: Callable[[Any, float, float, float], Chambers]
    torque: Callable[[Any, float, float, float], float]


def measured_shape_of(settings: Any, stops: Range, *, parts: _MeasuredParts) -> Any:
    """Shape of an actuator with a measured table."""
    return parts.prepare(settings, stops, parts.table)


def usual_place(lowest: float, highest: float) -> float:
    """Angle [rad] for the gains of a joint of unknown angle: a right angle, or mid-range if that is out of range."""
    has_right_angle = lowest + INSIDE <= RIGHT_ANGLE <= highest - INSIDE
    return RIGHT_ANGLE if has_right_angle else 0.5 * (lowest + highest)


def gauge_of(supply: float, room: float) -> float:
    """Gauge pressure [Pa] of a supply in an atmosphere ``room`` [Pa absolute]: negative for a vacuum, never 0."""
    gauge = supply - room
    return gauge if gauge <= -LEAST_GAUGE else max(gauge, LEAST_GAUGE)


def vane_at(settings: VaneSettings, stops: Range, _around: Surroundings, angle: float) -> MeanChambers:
    """Both chambers of a vane at an angle [rad]. Equations (2), (4), (5)."""
    growth = settings.displacement_per_radian
    return MeanChambers(
        torque_per_pressure_1=settings.torque_constant,
        torque_per_pressure_2=settings.torque_constant,
        volume_1=stops.dead_volume_1 + growth * (angle - stops.angle_min),
        volume_2=stops.dead_volume_2 + growth * (stops.angle_max - angle),
        growth_1=growth,
        growth_2=growth,
    )


def shaped_at(settings: Any, stops: Range, around: Surroundings, angle: float, *, parts: _ShapedParts) -> MeanChambers:
    """Both chambers at an angle [rad] of an actuator with a shape, at half of the supply's gauge pressure."""
    room = around.atmospheric_pressure
    plant = _RestingPlant(
        shape=parts.shape(settings, stops),
        gas_product=1.0,
        supply_pressure=around.supply_pressure,
        dorsiflexion_pressure=around.dorsiflexion_pressure,
        atmospheric_pressure=room,
        gravity_torque=0.0,
        external_torque=0.0,
    )
    gauge_1 = gauge_of(around.supply_pressure, room)
    gauge_2 = gauge_of(around.dorsiflexion_pressure, room)
    half_1, half_2 = room + 0.5 * gauge_1, room + 0.5 * gauge_2
    filled = parts.chambers(plant, angle, half_1, half_2)
    vented = parts.torque(plant, angle, room, room)
    # By virtual work a chamber grows with the angle as its torque does with the pressure.
    growth_1 = abs((parts.torque(plant, angle, room + gauge_1, room) - vented) / gauge_1)
    growth_2 = abs((parts.torque(plant, angle, room, room + gauge_2) - vented) / gauge_2)
    return MeanChambers(
        torque_per_pressure_1=growth_1,
        torque_per_pressure_2=growth_2,
        volume_1=filled.volume_1 + half_1 * filled.compliance_1,
        volume_2=filled.volume_2 + half_2 * filled.compliance_2,
        growth_1=growth_1,
        growth_2=growth_2,
    )


def chambers_of(actuator: Actuator) -> PlainFunction:
    """Return the function of an actuator's settings, stops, surroundings and angle [rad] that gives its chambers."""
    if actuator.kind == VANE:
        return vane_at
    model, name = ACTUATORS[actuator.kind].model, actuator.kind
    shape = model.prepare
    if actuator.table is not None:
        shape = made_of(measured_shape_of, f"shape_of_{name}", _MeasuredParts(model.prepare, actuator.table))
    return made_of(shaped_at, f"chambers_at_of_{name}", _ShapedParts(shape, model.chambers, model.torque))
