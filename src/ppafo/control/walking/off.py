"""The device switched off: both chambers vented, the wearer walks with its friction and inertia alone."""

from typing import NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.model.command import VENT
from ppafo.model.gait_sensors import GaitMeasurement


class OffParameters(NamedTuple):
    """Nothing to set."""


class OffState(NamedTuple):
    """Nothing to remember."""


def update(
    parameters: OffParameters, state: OffState, reference: float, measurement: GaitMeasurement, period: float
) -> tuple[float, OffState]:
    """Command [-]: always ``VENT``."""
    return VENT, state


KIND = ControllerKind(
    name="off",
    summary="Both chambers vented.",
    source="comparison without assistance",
    quantities=(),
    parameters=OffParameters,
    initial=OffState(),
    update=update,
    only_switches=True,
)
