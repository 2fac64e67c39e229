"""The channels in which a model and a recording are compared, and the full range that each error is a share of."""

from collections.abc import Callable
from dataclasses import dataclass

from ppafo.parameters.device import Device

ANGLE, PRESSURE_1, PRESSURE_2 = "angle", "pressure_1", "pressure_2"
PRESSURE_DIFFERENCE, TORQUE = "pressure_difference", "torque"


@dataclass(frozen=True, slots=True)
class Compared:
    """A channel: unit of an error in it (``Pa_d``: a pressure difference), the unit to show, and its full range.

    ``full_range(device, gauge)`` takes the gauge pressure of the supply [Pa].
    """

    unit: str
    shown_unit: str
    title: str
    full_range: Callable[[Device, float], float]


def angle_range(device: Device, gauge: float) -> float:  # noqa: ARG001  # all ranges share one signature
    """Angle between the stops [rad]."""
    return device.actuator.angle_max - device.actuator.angle_min


def pressure_range(device: Device, gauge: float) -> float:  # noqa: ARG001
    """Gauge pressure of the supply [Pa]."""
    return gauge


def difference_range(device: Device, gauge: float) -> float:  # noqa: ARG001
    """Twice the gauge pressure of the supply [Pa]: from full supply on one side to full supply on the other."""
    return 2.0 * gauge


def torque_range(device: Device, gauge: float) -> float:
    """Torque from full supply on one side to full supply on the other [N m]. Equation (2)."""
    return 2.0 * gauge * device.actuator.torque_constant


COMPARED: dict[str, Compared] = {
    ANGLE: Compared("rad", "deg", "Vane angle", angle_range),
    PRESSURE_1: Compared("Pa_d", "psi_d", "Pressure in chamber 1", pressure_range),
    PRESSURE_2: Compared("Pa_d", "psi_d", "Pressure in chamber 2", pressure_range),
    PRESSURE_DIFFERENCE: Compared("Pa_d", "psi_d", "Pressure difference", difference_range),
    TORQUE: Compared("N m", "N m", "Actuator torque", torque_range),
}
"""As the paper has them: 110 deg, 55 psi, 55 psi and 110 psi; the torque follows from the pressure difference."""
