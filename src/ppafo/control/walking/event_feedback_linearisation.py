"""Inverted chamber dynamics for the torque that each phase of the gait wants."""

from typing import NamedTuple

from ppafo.control.controllers import feedback_linearisation
from ppafo.control.controllers.feedback_linearisation import FeedbackLinearisationParameters, FeedbackLinearisationState
from ppafo.control.kind import ControllerKind
from ppafo.control.walking import assistance, phases, safety
from ppafo.control.walking.assistance import Assistance, Wish
from ppafo.control.walking.declaration import ASSISTING_QUANTITIES, with_defaults
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.safety import SafetyRules, SafetyState
from ppafo.model.gait_sensors import GaitMeasurement


class EventFeedbackLinearisationParameters(NamedTuple):
    """Rates and believed device, what is wanted, and the rules of phases and safety."""

    law: FeedbackLinearisationParameters
    assistance: Assistance
    phases: PhaseRules
    safety: SafetyRules


class EventFeedbackLinearisationState(NamedTuple):
    """Phase, safety, the torque wanted, and the state of the law."""

    phase: PhaseState
    safety: SafetyState
    wish: Wish
    law: FeedbackLinearisationState


def restarted(law: FeedbackLinearisationState, wanted: float, goes_on: float) -> FeedbackLinearisationState:
    """The state of the law; where another task begins, the torque wanted [N m] has no rate yet."""
    reference = law.reference if goes_on > 0.5 else wanted
    return FeedbackLinearisationState(reference, law.angle, law.angular_velocity, law.started)


def update(
    parameters: EventFeedbackLinearisationParameters,
    state: EventFeedbackLinearisationState,
    reference: float,
    measurement: GaitMeasurement,
    period: float,
) -> tuple[float, EventFeedbackLinearisationState]:
    """Command from -1 to 1, or ``VENT``; the reference is not used."""
    assisted = assistance.followed(parameters, state, measurement, period)
    law = restarted(state.law, assisted.wish.torque, assisted.goes_on)
    seen = assistance.torque_seen(measurement)
    command, law = feedback_linearisation.update(parameters.law, law, assisted.wish.torque, seen, period)
    command, watch = assistance.given(assisted, command, period)
    return command, EventFeedbackLinearisationState(assisted.phase, watch, assisted.wish, law)


TUNED = {
    "convergence_rate": 91.0,
    "rate_filter": 0.0018,
}
"""SI units; found with ``python -m ppafo.studies.league.walking_tuning event_feedback_linearisation``."""

KIND = ControllerKind(
    name="event_feedback_linearisation",
    summary="Event-based torque profiles for each phase, followed by inverting the chamber dynamics.",
    source=f"the paper, figure 1A (phases); {feedback_linearisation.KIND.source}",
    quantities=(*with_defaults(feedback_linearisation.KIND.quantities, TUNED), *ASSISTING_QUANTITIES),
    parameters=EventFeedbackLinearisationParameters,
    initial=EventFeedbackLinearisationState(
        phases.START, safety.START, assistance.START, FeedbackLinearisationState(0.0, 0.0, 0.0, 0.0)
    ),
    update=update,
)
