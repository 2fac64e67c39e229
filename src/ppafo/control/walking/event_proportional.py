"""Event-based control of a proportional valve: opening in proportion to the torque error, with an integral.

The torque wanted is a profile in each phase, about an angle that is held in swing and landing. The simplest law that
follows it; ``event_pid`` adds a filtered slope and back-calculation.
"""

from typing import NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.control.walking import assistance, phases, safety
from ppafo.control.walking.assistance import Assistance, Wish
from ppafo.control.walking.declaration import ASSISTING_QUANTITIES
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.safety import SafetyRules, SafetyState
from ppafo.model.declaration import Quantity
from ppafo.model.gait_sensors import GaitMeasurement


class EventProportionalParameters(NamedTuple):
    """Gains on the torque error [1/(N m)] and its integral [1/(N m s)], what is wanted, rules of phases and safety."""

    torque_gain: float
    torque_integral_gain: float
    assistance: Assistance
    phases: PhaseRules
    safety: SafetyRules


class EventProportionalState(NamedTuple):
    """Phase, safety, the torque wanted, and the integral part of the command [-]."""

    phase: PhaseState
    safety: SafetyState
    wish: Wish
    integral: float


def update(
    parameters: EventProportionalParameters,
    state: EventProportionalState,
    reference: float,
    measurement: GaitMeasurement,
    period: float,
) -> tuple[float, EventProportionalState]:
    """Command from -1 to 1, or ``VENT``; the reference is not used."""
    assisted = assistance.followed(parameters, state, measurement, period)
    error = assisted.wish.torque - measurement.torque
    integral = state.integral * assisted.goes_on
    proposed = parameters.torque_gain * error + integral
    # The integral waits while the valve is fully open: more of it could not be carried out.
    added = parameters.torque_integral_gain * error * period
    integral = integral + (added if abs(proposed) < 1.0 else 0.0)
    command, watch = assistance.given(assisted, max(-1.0, min(1.0, proposed)), period)
    return command, EventProportionalState(assisted.phase, watch, assisted.wish, integral)


KIND = ControllerKind(
    name="event_proportional",
    summary="Event-based torque profiles for each phase, followed by proportional and integral action.",
    source="the paper, figures 1A and 6; profile of four parameters as in J. Zhang et al., Science 356 (2017) 1280",
    quantities=(
        Quantity("torque_gain", "1/(N m)", "opening per torque error", 1.3, 0.0, 1.0e3),
        Quantity("torque_integral_gain", "1/(N m s)", "opening per integral of the torque error", 0.2, 0.0, 1.0e3),
        *ASSISTING_QUANTITIES,
    ),
    parameters=EventProportionalParameters,
    initial=EventProportionalState(phases.START, safety.START, assistance.START, 0.0),
    update=update,
)
