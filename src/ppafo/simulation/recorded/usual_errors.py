"""Usual errors of a test bench, as limits to either side: one table for every comparison with a recording.

Limits of agreement, causes of a disagreement and tolerances of a fit use the same numbers, so that a usual error of a
bench is never reported as a fault. A limit has the standard deviation limit / sqrt(3) (GUM, JCGM 100:2008, 4.3.7).
"""

import math
from typing import NamedTuple

from ppafo.constants import PASCALS_PER_PSI
from ppafo.simulation.recorded.channels import ANGLE


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
