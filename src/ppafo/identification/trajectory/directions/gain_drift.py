"""The gain of a sensor that drifts evenly over a recording."""

import numpy as np

from ppafo.identification.trajectory.directions.kind import Column
from ppafo.identification.trajectory.residuals import Residuals

LARGEST_DRIFT = 0.01
"""Change of a gain over a recording that can be believed, as a fraction."""
_NO_TIME = 1.0e-12


def drift_column(sensor: str, residuals: Residuals) -> Column:
    """Return the column of a gain of one sensor that drifts, the same in all recordings."""
    parts = []
    for one in residuals.experiments:
        away = 2.0 * (one.time - one.time[0]) / max(float(np.ptp(one.time)), _NO_TIME) - 1.0
        parts += [(c.name == sensor) * 0.5 * away * c.values / c.noise for c in one.channels]
    return Column(
        f"gain of {sensor}",
        f"the gain of {sensor} seems to drift by {{size}} over a recording",
        f"the gain of {sensor} does not drift by more than {{size}} over a recording",
        lambda size: f"{100.0 * size:.2g} %",
        -LARGEST_DRIFT,
        LARGEST_DRIFT,
        np.concatenate(parts),
    )
