"""Controlled quantity of a law: torque of the actuator, angle, pressure in a chamber, or pressure difference.

A law receives the functions of the quantity as ``*, parts: ErrorFunctions``, and passes them to ``seen_error``. To add
a quantity: a function and a line of ``CONTROLLED``.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ppafo.model.columns import larger, smaller
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement

# Names of the two quantities that other parts of the package treat separately.
TORQUE = "torque"
ANGLE = "angle"


def controlled(angle: float, pressure_1: float, pressure_2: float, torque: float) -> float:
    """Torque [N m] of a measurement, for a loop that controls the torque."""
    return torque


def controlled_angle(angle: float, pressure_1: float, pressure_2: float, torque: float) -> float:
    """Angle [rad] of a measurement, for a loop that controls the angle."""
    return angle


def controlled_pressure_1(angle: float, pressure_1: float, pressure_2: float, torque: float) -> float:
    """Absolute pressure in chamber 1 [Pa] of a measurement, for a loop that controls it."""
    return pressure_1


def controlled_pressure_2(angle: float, pressure_1: float, pressure_2: float, torque: float) -> float:
    """Absolute pressure in chamber 2 [Pa] of a measurement, for a loop that controls it."""
    return pressure_2


def controlled_difference(angle: float, pressure_1: float, pressure_2: float, torque: float) -> float:
    """Pressure in chamber 1 minus pressure in chamber 2 [Pa]."""
    return pressure_1 - pressure_2


def steered(error: float) -> float:
    """Error unchanged, for a quantity that a positive command raises."""
    return error


def turned_round(error: float) -> float:
    """Error with reversed sign, for a quantity that a positive command lowers."""
    return -error


class ErrorFunctions(NamedTuple):
    """Functions of the error on which a law acts.

    ``value(angle, pressure_1, pressure_2, torque)`` is the controlled quantity of a measurement; ``steered(error)`` is
    the error, in the unit of the reference, positive where a positive command is needed.
    """

    value: Callable[[float, float, float, float], float]
    steered: Callable[[float], float]


OF_TORQUE = ErrorFunctions(controlled, steered)
"""Functions of a torque error for supplies above the atmosphere; also used in every walk."""


def seen_value(measurement: Measurement, *, parts: ErrorFunctions) -> float:
    """Measured controlled quantity, in the unit of the reference."""
    return parts.value(measurement.angle, measurement.pressure_1, measurement.pressure_2, measurement.torque)


def seen_error(reference: float, measurement: Measurement, *, parts: ErrorFunctions) -> float:
    """Reference minus measured value, positive where a positive command is needed."""
    return parts.steered(reference - seen_value(measurement, parts=parts))


class Ends(NamedTuple):
    """Stops [rad] of an actuator, absolute pressures [Pa] of both supplies and the atmosphere; arrays (runs,) too."""

    angle_min: Any
    angle_max: Any
    supply_pressure: Any
    dorsiflexion_pressure: Any
    atmospheric_pressure: Any


def stops(ends: Ends) -> tuple[Any, Any]:
    """Return the angles [rad] of the lower and upper stop."""
    return ends.angle_min, ends.angle_max


def reach_of_pressure_1(ends: Ends) -> tuple[Any, Any]:
    """Return the lowest and highest pressure [Pa] in chamber 1: vented and supplied."""
    return _in_order(ends.atmospheric_pressure, ends.supply_pressure)


def reach_of_pressure_2(ends: Ends) -> tuple[Any, Any]:
    """Return the lowest and highest pressure [Pa] in chamber 2: vented and supplied."""
    return _in_order(ends.atmospheric_pressure, ends.dorsiflexion_pressure)


def reach_of_difference(ends: Ends) -> tuple[Any, Any]:
    """Return the lowest and highest pressure difference [Pa], with one chamber supplied and the other one vented."""
    room = ends.atmospheric_pressure
    return _in_order(room - ends.dorsiflexion_pressure, ends.supply_pressure - room)


def _in_order(one: Any, other: Any) -> tuple[Any, Any]:
    """Return the lower and the higher end of a range; a vacuum is below the atmosphere."""
    return smaller(one, other), larger(one, other)


@dataclass(frozen=True, slots=True)
class ControlledQuantity:
    """Controlled quantity: quantity that a reference can prescribe and a law controls.

    ``name`` is also its channel in a recording, which has a pressure difference only if that is controlled. ``words``
    name the quantity in a sentence, ``level`` declares a value, ``difference`` is the unit of a difference of
    two values. ``value(angle, pressure_1, pressure_2, torque)`` computes the quantity from sensor readings. ``size`` is
    the value that corresponds to a torque of 1 N m: it scales the ranges of gains. A positive command raises the
    quantity, or lowers it if ``sign`` is -1; the reverse if the supplies are below the atmosphere. ``reach`` returns
    the range of the quantity, called ``limits`` in a sentence; None for a torque, which depends on the external drive
    of the joint.
    """

    name: str
    words: str
    level: Quantity
    difference: str
    value: Callable[[float, float, float, float], float]
    size: float = 1.0
    sign: float = 1.0
    reach: Callable[[Ends], tuple[Any, Any]] | None = None
    limits: str = "the range of supply and valve"

    @property
    def reference(self) -> str:
        """Channel of the reference of this quantity in a recording."""
        return "reference" if self.name == TORQUE else f"reference_{self.name}"

    @property
    def unit(self) -> str:
        """Unit of its channels in a recording [SI]."""
        return "Pa" if self.level.unit == "Pa_a" else self.level.unit

    @property
    def plain_unit(self) -> str:
        """Unit of a difference without its reference point (gauge or absolute), as in the units of gains."""
        return self.difference.removesuffix("_d")

    def setting(self, quantity: Quantity) -> Quantity:
        """Return a setting of a torque law converted to this quantity.

        A non-zero default of the torque law has no meaning in another unit, and is dropped.
        """
        if self.name == TORQUE or "N m" not in quantity.unit:
            return quantity
        if quantity.unit == "N m":
            unit = self.difference
            scale = self.size
        else:
            unit = quantity.unit.replace("(N m)", self.plain_unit).replace("N m", self.plain_unit)
            scale = 1.0 / self.size
        return replace(
            quantity,
            unit=unit,
            default=0.0 if quantity.default == 0.0 else None,
            minimum=quantity.minimum * scale,
            maximum=quantity.maximum * scale,
        )


_PRESSURE = Quantity("level", "Pa_a", "", None, 1.0e3, 1.0e8)

CONTROLLED: dict[str, ControlledQuantity] = {
    item.name: item
    for item in (
        ControlledQuantity(TORQUE, "torque", Quantity("level", "N m", "", None, -1.0e4, 1.0e4), "N m", controlled),
        ControlledQuantity(
            ANGLE,
            "angle",
            Quantity("level", "rad", "", None, -10.0, 10.0),
            "rad",
            controlled_angle,
            reach=stops,
            limits="the stops",
        ),
        ControlledQuantity(
            "pressure_1",
            "chamber 1 pressure",
            _PRESSURE,
            "Pa_d",
            controlled_pressure_1,
            1.0e5,
            reach=reach_of_pressure_1,
        ),
        ControlledQuantity(
            "pressure_2",
            "chamber 2 pressure",
            _PRESSURE,
            "Pa_d",
            controlled_pressure_2,
            1.0e5,
            -1.0,
            reach=reach_of_pressure_2,
        ),
        ControlledQuantity(
            "pressure_difference",
            "pressure difference",
            Quantity("level", "Pa_d", "", None, -1.0e8, 1.0e8),
            "Pa_d",
            controlled_difference,
            1.0e5,
            reach=reach_of_difference,
        ),
    )
}
"""Controlled quantities by their value of ``reference.of`` in a file."""


def error_functions(name: str, has_vacuum: bool) -> ErrorFunctions:
    """Error functions of a controlled quantity, for supplies above the atmosphere or below it."""
    quantity = CONTROLLED[name]
    return ErrorFunctions(quantity.value, turned_round if (quantity.sign < 0.0) != has_vacuum else steered)


ANYTHING = tuple(CONTROLLED)
"""Names of all controlled quantities, for a law that acts on the error alone."""
