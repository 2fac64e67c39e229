"""Opening in proportion to the torque error, with an integral: the simplest law that follows a torque while walking.

``pid`` adds a filtered slope and back-calculation.
"""

from typing import NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement


class ProportionalParameters(NamedTuple):
    """Gains on the torque error [1/(N m)] and its integral [1/(N m s)]."""

    torque_gain: float
    torque_integral_gain: float


class ProportionalState(NamedTuple):
    """Integral part of the command [-]."""

    integral: float


def update(
    parameters: ProportionalParameters,
    state: ProportionalState,
    reference: float,
    measurement: Measurement,
    period: float,
) -> tuple[float, ProportionalState]:
    """Command from -1 to 1 of the torque error [N m]."""
    error = reference - measurement.torque
    proposed = parameters.torque_gain * error + state.integral
    # The integral waits while the valve is fully open: more of it could not be carried out.
    added = parameters.torque_integral_gain * error * period
    integral = state.integral + (added if abs(proposed) < 1.0 else 0.0)
    return max(-1.0, min(1.0, proposed)), ProportionalState(integral)


def restart(state: ProportionalState, requested: float, continues: float) -> ProportionalState:
    """The state, reset where another task begins (``continues`` 0, else 1); ``requested`` [N m] is not used."""
    return ProportionalState(integral=state.integral * continues)


KIND = ControllerKind(
    name="proportional",
    summary="Proportional and integral action on the torque error.",
    source="profile of four parameters as in J. Zhang et al., Science 356 (2017) 1280",
    quantities=(
        Quantity("torque_gain", "1/(N m)", "opening per torque error", 1.3, 0.0, 1.0e3),
        Quantity("torque_integral_gain", "1/(N m s)", "opening per integral of the torque error", 0.2, 0.0, 1.0e3),
    ),
    parameters=ProportionalParameters,
    initial=ProportionalState(0.0),
    update=update,
    restart=restart,
)
