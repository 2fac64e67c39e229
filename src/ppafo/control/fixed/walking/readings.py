"""What a converter shows of forces, angle and pressures, in counts of 14 bits whatever its own number of bits is."""

from typing import NamedTuple

from ppafo.control.fixed.converter import count_of
from ppafo.model.declaration import Quantity
from ppafo.model.gait_sensors import GaitMeasurement

SCALE_BITS = 14
TOP: int = 2**SCALE_BITS - 1
"""Largest reading: that of a converter of 14 bits. One of fewer leaves the lowest bits 0."""
FEWEST_BITS, MOST_BITS = 8, 14

SETTINGS = (
    Quantity("converter_bits", "", "bits of the converter, whole", 10.0, float(FEWEST_BITS), float(MOST_BITS)),
    Quantity("converter_range", "Pa_a", "pressure at which it shows its largest number", 1.0e6, 1.0e4, 1.0e8),
    Quantity("force_zero", "N", "force at which the converter shows 0", -200.0, -1.0e5, 0.0),
    Quantity("force_range", "N", "force at which it shows its largest number", 3.4e3, 100.0, 1.0e6),
    Quantity("angle_range", "rad", "angle at which it shows its largest number; 0 rad is 0", 2.8, 0.1, 10.0),
)
"""What a walk says of the converter of an integer controller; 10 bits are those of an MSP430G2553."""


class GaitConverter(NamedTuple):
    """Of one count at the converter's own bits: force [N], angle [rad], pressure [Pa]; force at 0 [N]; largest, scale.

    ``scale`` is how many counts of 14 bits one of its own is.
    """

    force_step: float
    angle_step: float
    pressure_step: float
    force_zero: float
    top: float
    scale: float


class GaitReadings(NamedTuple):
    """Forces under heel and toes, ankle angle, pressures of both chambers, in counts of 14 bits."""

    heel: int
    toe: int
    angle: int
    pressure_1: int
    pressure_2: int


OF_CONVERTER = (
    Quantity("force_step", "N", "force of one count", None, 0.0),
    Quantity("angle_step", "rad", "angle of one count", None, 0.0),
    Quantity("pressure_step", "Pa_d", "pressure of one count", None, 0.0),
    Quantity("force_zero", "N", "force at a count of 0", None),
    Quantity("top", "", "largest count of the converter", None, 0.0, float(TOP)),
    Quantity("scale", "", "counts of 14 bits to one of its own", None, 1.0, 64.0),
)
"""The numbers of ``GaitConverter``, in order."""


def gait_converter(
    bits: float, pressure_range: float, force_zero: float, force_range: float, angle_range: float
) -> GaitConverter:
    """The converter with some bits; the others are what it shows as its largest number [Pa], [N], [rad]."""
    top = float(2 ** int(bits) - 1)
    return GaitConverter(
        force_step=(force_range - force_zero) / top,
        angle_step=angle_range / top,
        pressure_step=pressure_range / top,
        force_zero=force_zero,
        top=top,
        scale=float(2 ** (SCALE_BITS - int(bits))),
    )


def read_gait(converter: GaitConverter, measurement: GaitMeasurement) -> GaitReadings:
    """What a converter shows of a measurement, in counts of 14 bits."""
    zero, scale = converter.force_zero, int(converter.scale)
    return GaitReadings(
        heel=count_of(measurement.heel_force - zero, converter.force_step, converter.top) * scale,
        toe=count_of(measurement.toe_force - zero, converter.force_step, converter.top) * scale,
        angle=count_of(measurement.angle, converter.angle_step, converter.top) * scale,
        pressure_1=count_of(measurement.pressure_1, converter.pressure_step, converter.top) * scale,
        pressure_2=count_of(measurement.pressure_2, converter.pressure_step, converter.top) * scale,
    )
