"""Usual errors of a test bench, as limits to either side: one table for every comparison with a recording.

Limits of agreement, causes of a disagreement and tolerances of a fit use the same numbers, so that a usual error of a
bench is never reported as a fault. A limit has the standard deviation limit / sqrt(3) (GUM, JCGM 100:2008, 4.3.7).
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

from ppafo.constants import PASCALS_PER_PSI
from ppafo.simulation.recorded.channels import ANGLE
from ppafo.units import split_pressure_kind, to_si

_MISTAKEN = {
    "Pa": {unit: to_si(1.0, f"{unit}_d", "Pa_d") for unit in ("psi", "kPa", "bar", "MPa")},
    "rad": {unit: to_si(1.0, unit, "rad") for unit in ("deg", "rad")},
    "N m": {unit: to_si(1.0, unit, "N m") for unit in ("N mm", "N cm", "N m")},
}
"""Units that are mistaken for each other, each with its value in SI, by SI unit."""


def misread_units(si_unit: str, stated: Iterable[str]) -> list[tuple[str, float]]:
    """Return the unit mistakes of channels, given the units that their files state (empty if none).

    A mistake is its description and the reading divided by the true value [-]: ``psi read as kPa`` with 0.145.
    A channel without a stated unit, or in Pa, may have been converted before, from any unit.
    """
    units = {split_pressure_kind(unit)[0] for unit in stated} - {"", "Pa"}
    scales = _MISTAKEN.get(si_unit, {})
    return [
        (f"{true} read as {read}", scales[read] / scales[true])
        for true in scales
        for read in scales
        if true != read and units <= {read}
    ]


class SensorErrors(NamedTuple):
    """Limits of the errors of a sensor: zero offset [SI unit of its channel], relative gain error [-], delay [s]."""

    zero: float
    gain: float
    delay: float


ANGLE_ERRORS = SensorErrors(zero=math.radians(0.5), gain=0.005, delay=1.0e-3)
"""Usual errors of an angle sensor [rad, -, s]."""
PRESSURE_ERRORS = SensorErrors(zero=0.3 * PASCALS_PER_PSI, gain=0.005, delay=1.0e-3)
"""Usual errors of a pressure sensor [Pa, -, s]."""
SUPPLY_ERROR = PASCALS_PER_PSI
"""Usual error of a supply pressure that was set but not recorded [Pa]."""


def usual_errors(channel: str) -> SensorErrors:
    """Return the usual errors of a channel's sensor: angle sensor or pressure sensor."""
    return ANGLE_ERRORS if channel == ANGLE else PRESSURE_ERRORS


def deviation_of_limit(limit: float) -> float:
    """Return the standard deviation of a quantity known within +/- ``limit``, in the unit of the limit."""
    return limit / math.sqrt(3.0)
