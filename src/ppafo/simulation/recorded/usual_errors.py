"""Usual errors of a bench, as limits on either side: the one table that every comparison with a recording reads.

Limits of agreement, causes of a disagreement and tolerances of a fit take the same numbers, so that what one counts as
an error of any bench no other calls a fault. A limit has the standard deviation limit / sqrt(3) (GUM, JCGM 100:2008,
4.3.7).
"""

import math
from typing import NamedTuple

from ppafo.constants import PASCALS_PER_PSI
from ppafo.simulation.recorded.channels import ANGLE


class SensorErrors(NamedTuple):
    """Limits of the errors of a sensor: zero [SI unit of its channel], gain less 1 [-], delay [s]."""

    zero: float
    gain: float
    delay: float


ANGLE_ERRORS = SensorErrors(zero=math.radians(0.5), gain=0.005, delay=1.0e-3)
"""Usual errors of an angle sensor [rad, -, s]."""
PRESSURE_ERRORS = SensorErrors(zero=0.3 * PASCALS_PER_PSI, gain=0.005, delay=1.0e-3)
"""Usual errors of a pressure sensor [Pa, -, s]."""
SUPPLY_ERROR = PASCALS_PER_PSI
"""Usual error of a supply pressure that was set and not recorded [Pa]."""


def usual_errors(channel: str) -> SensorErrors:
    """Return the usual errors of the sensor of a channel: the angle's, or those of a pressure."""
    return ANGLE_ERRORS if channel == ANGLE else PRESSURE_ERRORS


def deviation_of_limit(limit: float) -> float:
    """Return the standard deviation of a number known within a limit on either side, in the unit of the limit."""
    return limit / math.sqrt(3.0)
