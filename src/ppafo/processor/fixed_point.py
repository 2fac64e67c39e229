"""Integer arithmetic of a small processor: products by shifts and additions, gains, converter readings.

A gain is a 15-bit fraction and a right shift: ``(value * fraction >> 15) >> places``, rounded down each time.
"""

import math
from typing import Annotated, NamedTuple

from ppafo.control.torque_loop import SHARPNESS
from ppafo.model.declaration import Number, Quantity
from ppafo.model.sensors import Measurement

FRACTION_BITS = 15
"""Number of fractional bits of a gain."""
LARGEST_FRACTION: int = 2**FRACTION_BITS - 1
"""Largest fraction in a signed 16-bit integer."""
MOST_PLACES = 30
"""Largest right shift of a 32-bit product [bits]."""
SHARPENED = int(1.0 / SHARPNESS)
"""Reciprocal of the smallest opening, relative to full opening, with full dead-band compensation [-]."""
FEWEST_BITS = 8
MOST_BITS = 14
COMMAND_STEPS = 1000
"""Integer command of a full command: half the timer ticks of a proportional valve's pulse."""
LARGEST_READING: int = 2**MOST_BITS - 1


def fraction_of(value: int, fraction: int) -> int:
    """Return ``value`` (at most 2^30 in magnitude) times ``fraction`` / 2^15, rounded down at every bit."""
    # The MSP430 has no multiplier, and a product in C would ask for a run-time library that the image does not have.
    total = 0
    left = fraction
    for _ in range(FRACTION_BITS):
        # Lowest bit first: halved after each addition, the sum stays below twice the value, and within 32 bits.
        total = (total + value if left & 1 == 1 else total) >> 1
        left = left >> 1
    return total


def beyond_band(opening: int, band: int, full: int) -> int:
    """Return the command for an ``opening`` from -``full`` to ``full``, with dead band ``band`` / 2^15 compensated.

    The law of ``control.torque_loop.beyond_dead_band``, rounded down to integer parts of ``full``; a ``band`` of 0
    returns the opening.
    """
    passed = limited(opening * SHARPENED, full)
    # Between both, which the proof of the ranges does not see.
    return limited(opening + fraction_of(passed - opening, band), full)


def shifted(value: int, places: int) -> int:
    """Return ``value`` divided by 2 to the power ``places``, rounded down."""
    result = value
    # One place at a time: a shift by a variable is a call of the run-time library too.
    for _ in range(places):
        result = result >> 1
    return result


def limited(value: int, limit: int) -> int:
    """Return ``value`` limited to the range from -``limit`` to ``limit``."""
    return max(min(value, limit), -limit)


def gain_of(factor: float) -> tuple[float, float]:
    """Return the 15-bit fraction and right shift for a gain of ``factor`` / 2^15, factor 0 to 32767.

    The fraction uses as many bits as possible; a larger factor is limited to the largest representable one.
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


SETTINGS = (
    Quantity("converter_bits", "", "bits of the converter, a whole number", 12.0, float(FEWEST_BITS), float(MOST_BITS)),
    Quantity(
        "converter_range",
        "Pa_a",
        "pressure at which the converter shows its largest number",
        None,
        1.0e4,
        1.0e8,
        follows="converter_range",
    ),
)
"""Converter settings of an integer controller."""


Flag = Annotated[int, Number("", "1 for true, 0 for false", None, 0.0, 1.0)]
"""Truth value of a law."""


class ConverterLimits(NamedTuple):
    """Largest converter reading, and mid-range reading of a reference of 0 N m [counts]."""

    top: Annotated[int, Number("", "largest reading of the converter", None, 0.0, float(LARGEST_READING))]
    middle: Annotated[
        int, Number("", "reading that stands for a reference of 0 N m", None, 0.0, float(2 ** (MOST_BITS - 1)))
    ]


class CountResolution(NamedTuple):
    """Pressure [Pa] and torque [N m] per converter count."""

    pressure_step: Annotated[float, Number("Pa_d", "pressure of one count", None, 0.0)]
    torque_step: Annotated[float, Number("N m", "torque of one count", None, 0.0)]


class ConverterCounts(NamedTuple):
    """Converter readings [counts]: reference, pressure in chamber 1, pressure in chamber 2."""

    reference: int
    pressure_1: int
    pressure_2: int


def converter_of(
    bits: float, pressure_range: float, torque_constant: float
) -> tuple[CountResolution, tuple[float, float]]:
    """Return resolution and limits of a converter with full scale ``pressure_range`` [Pa].

    A reference of 0 N m is in mid-range, and one count of the reference is the torque of one count of pressure.
    """
    top = float(2 ** int(bits) - 1)
    middle = float(2 ** (int(bits) - 1))
    step = pressure_range / top
    return CountResolution(pressure_step=step, torque_step=torque_constant * step), (top, middle)


def count_of(value: float, step: float, top: float) -> int:
    """Return the converter count of a value in the unit of ``step``, rounded and limited to 0 and ``top``."""
    # Adding a half rounds a number of at least 0, in C as in Python.
    return int(max(0.0, min(top, value / step + 0.5)))


def read(
    steps: CountResolution, limits: ConverterLimits, reference: float, measurement: Measurement
) -> ConverterCounts:
    """Return the converter readings of a reference [N m] and measured pressures [Pa]."""
    return ConverterCounts(
        reference=count_of(reference + limits.middle * steps.torque_step, steps.torque_step, limits.top),
        pressure_1=count_of(measurement.pressure_1, steps.pressure_step, limits.top),
        pressure_2=count_of(measurement.pressure_2, steps.pressure_step, limits.top),
    )


def is_inside(reading: int, top: int) -> bool:
    """Return whether a reading is inside its range, unlike a broken wire or a short circuit."""
    return reading > 0 and reading < top


def still_sound(sound: int, readings: ConverterCounts, limits: ConverterLimits) -> int:
    """Return 1 while all readings so far were inside their range, else 0 permanently."""
    inside = (
        is_inside(readings.reference, limits.top)
        and is_inside(readings.pressure_1, limits.top)
        and is_inside(readings.pressure_2, limits.top)
    )
    return sound if inside else 0


def error_of(readings: ConverterCounts, limits: ConverterLimits) -> int:
    """Return the torque error, reference minus torque, in counts of pressure."""
    return readings.reference - limits.middle - (readings.pressure_1 - readings.pressure_2)
