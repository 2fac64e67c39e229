"""The zero of a sensor that is off."""

import math

import numpy as np

from ppafo.identification.trajectory.directions.kind import Column
from ppafo.identification.trajectory.problem import ZERO_OF
from ppafo.identification.trajectory.residuals import Residuals

LARGEST_ZERO = {"angle": math.radians(1.0), "pressure_1": 3.0e3, "pressure_2": 3.0e3}
"""Error of the zero of a sensor that can be believed [rad], [Pa]."""


def zero_columns(sensor: str, residuals: Residuals) -> list[Column]:
    """Return the column of a zero of one sensor, the same in all recordings; none where the zero itself is fitted."""
    if any(item.path == f"{ZERO_OF}{sensor}" for item in residuals.ranges):
        return []
    parts = [
        np.full(len(channel.values), float(channel.name == sensor) / channel.noise)
        for one in residuals.experiments
        for channel in one.channels
    ]
    return [
        Column(
            f"zero of {sensor}",
            f"the zero of {sensor} seems to be off by {{size}}",
            f"the zero of {sensor} is not off by more than {{size}}",
            size_of_angle if sensor == "angle" else size_of_pressure,
            -LARGEST_ZERO[sensor],
            LARGEST_ZERO[sensor],
            np.concatenate(parts),
        )
    ]


def size_of_angle(size: float) -> str:
    """Return an angle [rad] in words."""
    return f"{math.degrees(size):.2g} deg"


def size_of_pressure(size: float) -> str:
    """Return a difference of pressures [Pa] in words."""
    return f"{1e-3 * size:.2g} kPa"
