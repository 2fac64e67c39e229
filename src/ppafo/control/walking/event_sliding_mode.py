"""Sliding mode control of the torque that each phase of the gait wants."""

from typing import NamedTuple

from ppafo.control.controllers import sliding_mode
from ppafo.control.controllers.sliding_mode import SlidingModeParameters, SlidingModeState
from ppafo.control.kind import ControllerKind
from ppafo.control.walking import assistance, phases, safety
from ppafo.control.walking.assistance import Assistance, Wish
from ppafo.control.walking.declaration import ASSISTING_QUANTITIES, with_defaults
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.safety import SafetyRules, SafetyState
from ppafo.model.gait_sensors import GaitMeasurement


class EventSlidingModeParameters(NamedTuple):
    """The surface, what is wanted, and the rules of phases and safety."""

    law: SlidingModeParameters
    assistance: Assistance
    phases: PhaseRules
    safety: SafetyRules


class EventSlidingModeState(NamedTuple):
    """Phase, safety, the torque wanted, and the state of the law."""

    phase: PhaseState
    safety: SafetyState
    wish: Wish
    law: SlidingModeState


def update(
    parameters: EventSlidingModeParameters,
    state: EventSlidingModeState,
    reference: float,
    measurement: GaitMeasurement,
    period: float,
) -> tuple[float, EventSlidingModeState]:
    """Command from -1 to 1, or ``VENT``; the reference is not used."""
    assisted = assistance.followed(parameters, state, measurement, period)
    law = SlidingModeState(state.law.integral * assisted.goes_on)
    seen = assistance.torque_seen(measurement)
    command, law = sliding_mode.update(parameters.law, law, assisted.wish.torque, seen, period)
    command, watch = assistance.given(assisted, command, period)
    return command, EventSlidingModeState(assisted.phase, watch, assisted.wish, law)


TUNED = {
    "surface_slope": 71.0,
    "boundary_layer": 0.35,
    "reaching_command": 0.78,
}
"""SI units; found with ``python -m ppafo.studies.league.walking_tuning event_sliding_mode``."""

KIND = ControllerKind(
    name="event_sliding_mode",
    summary="Event-based torque profiles for each phase, followed by a sliding mode law with a boundary layer.",
    source=f"the paper, figure 1A (phases); {sliding_mode.KIND.source}",
    quantities=(*with_defaults(sliding_mode.KIND.quantities, TUNED), *ASSISTING_QUANTITIES),
    parameters=EventSlidingModeParameters,
    initial=EventSlidingModeState(phases.START, safety.START, assistance.START, SlidingModeState(0.0)),
    update=update,
)
