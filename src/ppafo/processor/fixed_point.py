"""Arithmetic of a small processor: products by shifts and additions, integer gains, converter readings.

A gain is a fraction of 15 bits and a number of places: ``(value * fraction >> 15) >> places``, rounded down each time.
"""

import math
from typing import NamedTuple

from ppafo.control.kind import nominal_term
from ppafo.control.torque_loop import SHARPNESS
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement

FRACTION_BITS = 15
"""Bits behind the point of a fraction."""
LARGEST_FRACTION: int = 2**FRACTION_BITS - 1
"""Largest fraction in 16 bits with a sign."""
MOST_PLACES = 30
"""Places that a product of 32 bits is shifted right by at most."""
SHARPENED = int(1.0 / SHARPNESS)
"""Openings that pass a dead band in full are this part of full opening or more."""


def fraction_of(value: int, fraction: int) -> int:
    """``value`` (2^30 at most in size) times ``fraction`` / 2^15, rounded down at every bit of the fraction."""
    # The MSP430 has no multiplier, and a product in C would ask for a run-time library that the image does not have.
    total = 0
    left = fraction
    for _ in range(FRACTION_BITS):
        # Lowest bit first: halved after each addition, the sum stays below twice the value, and within 32 bits.
        total = (total + value if left & 1 == 1 else total) >> 1
        left = left >> 1
    return total


def beyond_band(opening: int, band: int, full: int) -> int:
    """Command for an ``opening`` from -``full`` to ``full``, beyond a dead band of ``band`` / 2^15; 0 leaves it as is.

    The law of ``control.torque_loop.beyond_dead_band``, rounded down to whole parts of ``full``.
    """
    passed = limited(opening * SHARPENED, full)
    # Between both, which the proof of the ranges does not see.
    return limited(opening + fraction_of(passed - opening, band), full)


def shifted(value: int, places: int) -> int:
    """``value`` divided by 2 to the power ``places``, rounded down."""
    result = value
    # One place at a time: a shift by a variable is a call of the run-time library too.
    for _ in range(places):
        result = result >> 1
    return result


def limited(value: int, limit: int) -> int:
    """``value`` within ``limit`` to both sides."""
    return max(min(value, limit), -limit)


def gain_of(factor: float) -> tuple[float, float]:
    """A factor from 0 to 32767 times 2^15 as a fraction of 15 bits and the places by which a product is shifted right.

    It has as many bits as there are, and is the largest one where the factor is larger.
    """
    if not factor > 0.0:
        return 0.0, 0.0
    _, exponent = math.frexp(factor)
    places = min(MOST_PLACES, max(0, FRACTION_BITS - exponent))
    fraction = math.floor(math.ldexp(factor, places) + 0.5)
    # Rounding up can carry into a sixteenth bit.
    if fraction > LARGEST_FRACTION and places > 0:
        places -= 1
        fraction = math.floor(math.ldexp(factor, places) + 0.5)
    return float(min(fraction, LARGEST_FRACTION)), float(places)


FEWEST_BITS, MOST_BITS = 8, 14
COMMAND_STEPS = 1000
"""Steps from a command of 0 to one of 1: half the ticks of the pulse that drives a proportional valve."""
LARGEST_READING: int = 2**MOST_BITS - 1

SETTINGS = (
    Quantity("converter_bits", "", "bits of the converter, a whole number", 12.0, float(FEWEST_BITS), float(MOST_BITS)),
    Quantity(
        "converter_range",
        "Pa_a",
        "pressure at which the converter shows its largest number",
        None,
        1.0e4,
        1.0e8,
        follows=(nominal_term("converter_range"),),
    ),
)
"""Settings of the converter of an integer controller."""


class ConverterLimits(NamedTuple):
    """The largest reading of a converter, and the one that stands for a reference of 0 N m."""

    top: int
    middle: int


class CountResolution(NamedTuple):
    """Pressure and torque of one count of a converter [Pa], [N m]."""

    pressure_step: float
    torque_step: float


class ConverterCounts(NamedTuple):
    """Converter readings, from 0 to the largest one: reference, pressure in chamber 1 and in chamber 2."""

    reference: int
    pressure_1: int
    pressure_2: int


OF_STEPS = (
    Quantity("pressure_step", "Pa_d", "pressure of one count", None, 0.0),
    Quantity("torque_step", "N m", "torque of one count", None, 0.0),
)
OF_LIMITS = (
    Quantity("top", "", "largest reading of the converter", None, 0.0, float(LARGEST_READING)),
    Quantity("middle", "", "reading that stands for a reference of 0 N m", None, 0.0, float(2 ** (MOST_BITS - 1))),
)
"""Fields of ``CountResolution`` and of ``ConverterLimits``, in order."""


def converter_of(
    bits: float, pressure_range: float, torque_constant: float
) -> tuple[CountResolution, tuple[float, float]]:
    """Steps and limits of a converter with some bits that shows ``pressure_range`` [Pa] as its largest number.

    The reference has its 0 N m in the middle, and a count of it is the torque of a count of pressure.
    """
    top, middle = float(2 ** int(bits) - 1), float(2 ** (int(bits) - 1))
    step = pressure_range / top
    return CountResolution(pressure_step=step, torque_step=torque_constant * step), (top, middle)


def count_of(value: float, step: float, top: float) -> int:
    """Count that a converter shows for a value in the unit of its ``step``: rounded, and within 0 and ``top``."""
    # What is not negative is rounded by adding a half, in C as in Python.
    return int(max(0.0, min(top, value / step + 0.5)))


def read(
    steps: CountResolution, limits: ConverterLimits, reference: float, measurement: Measurement
) -> ConverterCounts:
    """Converter readings of a reference [N m] and of the measured pressures [Pa]."""
    return ConverterCounts(
        reference=count_of(reference + limits.middle * steps.torque_step, steps.torque_step, limits.top),
        pressure_1=count_of(measurement.pressure_1, steps.pressure_step, limits.top),
        pressure_2=count_of(measurement.pressure_2, steps.pressure_step, limits.top),
    )


def is_inside(reading: int, top: int) -> bool:
    """False for a reading at an end of its range, where a broken wire or a short circuit puts it."""
    return reading > 0 and reading < top


def still_sound(sound: int, readings: ConverterCounts, limits: ConverterLimits) -> int:
    """1 as long as no reading was ever at an end of its range, else 0, for good."""
    inside = (
        is_inside(readings.reference, limits.top)
        and is_inside(readings.pressure_1, limits.top)
        and is_inside(readings.pressure_2, limits.top)
    )
    return sound if inside else 0


def error_of(readings: ConverterCounts, limits: ConverterLimits) -> int:
    """Reference less torque, in counts of pressure."""
    return readings.reference - limits.middle - (readings.pressure_1 - readings.pressure_2)
