"""On/off control with a dead zone of the torque that each phase of the gait wants; for either valve."""

from typing import NamedTuple

from ppafo.control.controllers import on_off_dead_zone
from ppafo.control.controllers.on_off_dead_zone import OnOffDeadZoneParameters, OnOffDeadZoneState
from ppafo.control.kind import ControllerKind
from ppafo.control.walking import assistance, phases, safety
from ppafo.control.walking.assistance import Assistance, Wish
from ppafo.control.walking.declaration import ASSISTING_QUANTITIES, with_defaults
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.safety import SafetyRules, SafetyState
from ppafo.model.gait_sensors import GaitMeasurement


class EventOnOffDeadZoneParameters(NamedTuple):
    """The dead zone, what is wanted, and the rules of phases and safety."""

    law: OnOffDeadZoneParameters
    assistance: Assistance
    phases: PhaseRules
    safety: SafetyRules


class EventOnOffDeadZoneState(NamedTuple):
    """Phase, safety, the torque wanted, and the state of the law."""

    phase: PhaseState
    safety: SafetyState
    wish: Wish
    law: OnOffDeadZoneState


def update(
    parameters: EventOnOffDeadZoneParameters,
    state: EventOnOffDeadZoneState,
    reference: float,
    measurement: GaitMeasurement,
    period: float,
) -> tuple[float, EventOnOffDeadZoneState]:
    """Command from -1 to 1, or ``VENT``; the reference is not used."""
    assisted = assistance.followed(parameters, state, measurement, period)
    law = OnOffDeadZoneState(state.law.direction * assisted.goes_on)
    seen = assistance.torque_seen(measurement)
    command, law = on_off_dead_zone.update(parameters.law, law, assisted.wish.torque, seen, period)
    command, watch = assistance.given(assisted, command, period)
    return command, EventOnOffDeadZoneState(assisted.phase, watch, assisted.wish, law)


TUNED = {"dead_zone": 0.21, "release": 0.031, "opening": 0.77}
"""SI units; found with ``python -m ppafo.studies.league.walking_tuning event_on_off_dead_zone``."""

KIND = ControllerKind(
    name="event_on_off_dead_zone",
    summary="Event-based torque profiles for each phase, followed by on/off switching with a dead zone.",
    source=f"the paper, figure 1A (phases); {on_off_dead_zone.KIND.source}",
    quantities=(*with_defaults(on_off_dead_zone.KIND.quantities, TUNED), *ASSISTING_QUANTITIES),
    parameters=EventOnOffDeadZoneParameters,
    initial=EventOnOffDeadZoneState(phases.START, safety.START, assistance.START, OnOffDeadZoneState(0.0)),
    update=update,
)
