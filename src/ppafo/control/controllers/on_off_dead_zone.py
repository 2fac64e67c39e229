"""On/off control with a dead zone and hysteresis: a small error is left alone."""

from typing import NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement


class OnOffDeadZoneParameters(NamedTuple):
    """Errors at which the valve opens and at which it closes again [N m]; command while it is open [-]."""

    dead_zone: float
    release: float
    opening: float


class OnOffDeadZoneState(NamedTuple):
    """Direction in which the valve is open: 1, 0 or -1."""

    direction: float


def update(
    parameters: OnOffDeadZoneParameters,
    state: OnOffDeadZoneState,
    reference: float,
    measurement: Measurement,
    period: float,
) -> tuple[float, OnOffDeadZoneState]:
    """Command: the opening, towards the reference, beyond the dead zone of the error [N m]; 0 inside.

    Once open, the valve stays so until the error is below ``release``. 0 closes a proportional valve and vents both
    chambers of a solenoid pair.
    """
    error = reference - measurement.torque
    release = min(parameters.release, parameters.dead_zone)
    limit_up = release if state.direction > 0.0 else parameters.dead_zone
    limit_down = release if state.direction < 0.0 else parameters.dead_zone
    direction = 1.0 if error > limit_up else (-1.0 if error < -limit_down else 0.0)
    return direction * parameters.opening, OnOffDeadZoneState(direction)


def restart(state: OnOffDeadZoneState, requested: float, continues: float) -> OnOffDeadZoneState:
    """The state, reset where another task begins (``continues`` 0, else 1); ``requested`` [N m] is not used."""
    return OnOffDeadZoneState(direction=state.direction * continues)


KIND = ControllerKind(
    name="on_off_dead_zone",
    summary="On/off with a dead zone and hysteresis: the valve opens for a large error and closes for a small one.",
    source="relay with dead zone and hysteresis: Gelb and Vander Velde 1968, Multiple-Input Describing Functions",
    quantities=(
        Quantity("dead_zone", "N m", "error at which the valve opens", 0.038, 0.0, 100.0),
        Quantity("release", "N m", "error at which it closes again; the dead zone at most", 0.038, 0.0, 100.0),
        Quantity("opening", "", "command while it is open", 0.12, 0.0, 1.0),
    ),
    parameters=OnOffDeadZoneParameters,
    initial=OnOffDeadZoneState(0.0),
    update=update,
    restart=restart,
    only_switches=True,
)
