"""PID control of the torque that each phase of the gait wants, with anti-windup."""

from typing import NamedTuple

from ppafo.control.controllers import pid
from ppafo.control.controllers.pid import PidParameters, PidState
from ppafo.control.kind import ControllerKind
from ppafo.control.walking import assistance, phases, safety
from ppafo.control.walking.assistance import Assistance, Wish
from ppafo.control.walking.declaration import ASSISTING_QUANTITIES, with_defaults
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.safety import SafetyRules, SafetyState
from ppafo.model.gait_sensors import GaitMeasurement


class EventPidParameters(NamedTuple):
    """Gains of the PID, what is wanted, and the rules of phases and safety."""

    law: PidParameters
    assistance: Assistance
    phases: PhaseRules
    safety: SafetyRules


class EventPidState(NamedTuple):
    """Phase, safety, the torque wanted, and the state of the law."""

    phase: PhaseState
    safety: SafetyState
    wish: Wish
    law: PidState


def restarted(law: PidState, goes_on: float) -> PidState:
    """The state of the law, forgotten where another task begins."""
    return PidState(law.integral * goes_on, law.error, law.slope * goes_on, law.started * goes_on)


def update(
    parameters: EventPidParameters,
    state: EventPidState,
    reference: float,
    measurement: GaitMeasurement,
    period: float,
) -> tuple[float, EventPidState]:
    """Command from -1 to 1, or ``VENT``; the reference is not used."""
    assisted = assistance.followed(parameters, state, measurement, period)
    law = restarted(state.law, assisted.goes_on)
    seen = assistance.torque_seen(measurement)
    command, law = pid.update(parameters.law, law, assisted.wish.torque, seen, period)
    command, watch = assistance.given(assisted, command, period)
    return command, EventPidState(assisted.phase, watch, assisted.wish, law)


TUNED = {
    "proportional_gain": 1.5,
    "integral_gain": 100.0,
    "derivative_gain": 0.033,
    "derivative_filter": 0.0023,
    "anti_windup": 97.0,
}
"""SI units; found with ``python -m ppafo.studies.league.walking_tuning event_pid``."""

KIND = ControllerKind(
    name="event_pid",
    summary="Event-based torque profiles for each phase, followed by a PID with anti-windup.",
    source=f"the paper, figure 1A (phases); {pid.KIND.source}",
    quantities=(*with_defaults(pid.KIND.quantities, TUNED), *ASSISTING_QUANTITIES),
    parameters=EventPidParameters,
    initial=EventPidState(phases.START, safety.START, assistance.START, PidState(0.0, 0.0, 0.0, 0.0)),
    update=update,
)
