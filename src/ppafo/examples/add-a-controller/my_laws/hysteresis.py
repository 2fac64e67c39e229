"""On/off control that keeps its last command while the error is small."""

from typing import Annotated, NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Number, quantities_of
from ppafo.model.sensors import Measurement


class HysteresisParameters(NamedTuple):
    """Half width of the band [N m] in which nothing changes."""

    band: Annotated[float, Number("N m", "half width of the band", 0.2, 0.0, 100.0)]


class HysteresisState(NamedTuple):
    """The last command [-]."""

    command: float


def update(
    parameters: HysteresisParameters,
    state: HysteresisState,
    reference: float,
    measurement: Measurement,
    period: float,
) -> tuple[float, HysteresisState]:
    """Command [-]: 1 above the band of the error, -1 below it, unchanged inside."""
    error = reference - measurement.torque
    outside = 1.0 if error > 0.0 else -1.0
    command = outside if abs(error) > parameters.band else state.command
    return command, HysteresisState(command)


KIND = ControllerKind(
    name="hysteresis",
    summary="On/off with a band in which the last command stays.",
    source="the rule of equation (14) with a dead zone that remembers",
    quantities=quantities_of(HysteresisParameters),
    parameters=HysteresisParameters,
    initial=HysteresisState(0.0),
    update=update,
    only_switches=True,
)
