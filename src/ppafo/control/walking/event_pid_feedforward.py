"""PID control with the inverse valve model ahead of it, of the torque that each phase of the gait wants."""

from typing import NamedTuple

from ppafo.control.controllers import pid_feedforward
from ppafo.control.controllers.pid import PidState
from ppafo.control.controllers.pid_feedforward import PidFeedforwardParameters, PidFeedforwardState
from ppafo.control.kind import ControllerKind
from ppafo.control.walking import assistance, phases, safety
from ppafo.control.walking.assistance import Assistance, Wish
from ppafo.control.walking.declaration import ASSISTING_QUANTITIES, with_defaults
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.safety import SafetyRules, SafetyState
from ppafo.model.gait_sensors import GaitMeasurement


class EventPidFeedforwardParameters(NamedTuple):
    """Gains and believed device, what is wanted, and the rules of phases and safety."""

    law: PidFeedforwardParameters
    assistance: Assistance
    phases: PhaseRules
    safety: SafetyRules


class EventPidFeedforwardState(NamedTuple):
    """Phase, safety, the torque wanted, and the state of the law."""

    phase: PhaseState
    safety: SafetyState
    wish: Wish
    law: PidFeedforwardState


def restarted(law: PidFeedforwardState, goes_on: float) -> PidFeedforwardState:
    """The state of the law, forgotten where another task begins; the reference then has no rate."""
    kept = law.feedback
    fresh = PidState(kept.integral * goes_on, kept.error, kept.slope * goes_on, kept.started * goes_on)
    return PidFeedforwardState(fresh, law.reference)


def update(
    parameters: EventPidFeedforwardParameters,
    state: EventPidFeedforwardState,
    reference: float,
    measurement: GaitMeasurement,
    period: float,
) -> tuple[float, EventPidFeedforwardState]:
    """Command from -1 to 1, or ``VENT``; the reference is not used."""
    assisted = assistance.followed(parameters, state, measurement, period)
    law = restarted(state.law, assisted.goes_on)
    seen = assistance.torque_seen(measurement)
    command, law = pid_feedforward.update(parameters.law, law, assisted.wish.torque, seen, period)
    command, watch = assistance.given(assisted, command, period)
    return command, EventPidFeedforwardState(assisted.phase, watch, assisted.wish, law)


TUNED = {
    "proportional_gain": 1.2,
    "integral_gain": 53.0,
    "derivative_gain": 0.02,
    "derivative_filter": 0.0012,
    "anti_windup": 34.0,
}
"""SI units; found with ``python -m ppafo.studies.league.walking_tuning event_pid_feedforward``."""

KIND = ControllerKind(
    name="event_pid_feedforward",
    summary="Event-based torque profiles for each phase, followed by a PID and the inverse of a valve model.",
    source=f"the paper, figure 1A (phases); {pid_feedforward.KIND.source}",
    quantities=(*with_defaults(pid_feedforward.KIND.quantities, TUNED), *ASSISTING_QUANTITIES),
    parameters=EventPidFeedforwardParameters,
    initial=EventPidFeedforwardState(
        phases.START, safety.START, assistance.START, PidFeedforwardState(PidState(0.0, 0.0, 0.0, 0.0), 0.0)
    ),
    update=update,
)
