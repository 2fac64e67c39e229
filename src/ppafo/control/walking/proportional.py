"""Proportional and integral action on the torque error, in walking."""

from typing import Annotated, NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.control.torque_loop import INTEGRAL_GAIN, PROPORTIONAL_GAIN
from ppafo.model.declaration import Number, quantities_of
from ppafo.model.sensors import Measurement


class ProportionalParameters(NamedTuple):
    """Gains on the torque error [1/(N m)] and its integral [1/(N m s)]."""

    torque_gain: Annotated[
        float, Number("1/(N m)", "opening per torque error", None, 0.0, 1.0e3, follows=(PROPORTIONAL_GAIN,))
    ]
    torque_integral_gain: Annotated[
        float,
        Number("1/(N m s)", "opening per integral of the torque error", None, 0.0, 1.0e6, follows=(INTEGRAL_GAIN,)),
    ]


class ProportionalState(NamedTuple):
    """Integral part of the command [-]."""

    integral: float


def proportional_update(
    parameters: ProportionalParameters,
    state: ProportionalState,
    reference: float,
    measurement: Measurement,
    period: float,
) -> tuple[float, ProportionalState]:
    """Command u from -1 to 1 and the next state, at a torque error e [N m] every ``period`` [s].

    u = torque_gain e + torque_integral_gain (integral of e)
    """
    error = reference - measurement.torque
    proposed = parameters.torque_gain * error + state.integral
    # The integral waits while the valve is fully open: more of it could not be carried out.
    added = parameters.torque_integral_gain * error * period
    integral = state.integral + (added if abs(proposed) < 1.0 else 0.0)
    return max(-1.0, min(1.0, proposed)), ProportionalState(integral)


def proportional_restart(state: ProportionalState, requested: float, continues: float) -> ProportionalState:
    """The state, reset where another task begins (``continues`` 0, else 1); ``requested`` [N m] is not used."""
    return ProportionalState(integral=state.integral * continues)


PROPORTIONAL = ControllerKind(
    name="proportional",
    summary="Proportional and integral action on the torque error.",
    source="profile of four parameters as in J. Zhang et al., Science 356 (2017) 1280",
    quantities=quantities_of(ProportionalParameters),
    parameters=ProportionalParameters,
    initial=ProportionalState(0.0),
    update=proportional_update,
    restart=proportional_restart,
)
