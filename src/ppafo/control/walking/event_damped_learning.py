"""Damped proportional torque control whose feed-forward for the push-off is learnt from stride to stride, walking.

The law of Zhang, Cheah and Collins (2015), with the table of ``learnt_table``.
"""

from typing import NamedTuple

from ppafo.control.controllers import damped_proportional
from ppafo.control.controllers.damped_proportional import DampedGains, TorqueSlope, damped_command
from ppafo.control.kind import ControllerKind
from ppafo.control.walking import assistance, learnt_table, phases, safety
from ppafo.control.walking.assistance import Assistance, TorqueRequest, assess
from ppafo.control.walking.declaration import ASSISTING_QUANTITIES, with_defaults
from ppafo.control.walking.learnt_table import LearningRules, LearntTable
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.safety import SafetyState
from ppafo.control.walking.signs import SafetyRules
from ppafo.control.walking.timing.thresholds import ThresholdClock, ThresholdRules
from ppafo.model.declaration import Quantity
from ppafo.model.gait_sensors import GaitMeasurement


class EventDampedLearningParameters(NamedTuple):
    """Gains of the law and of learning, what is requested, and the rules of phases, safety and timing."""

    law: DampedGains
    learning: LearningRules
    assistance: Assistance
    phases: PhaseRules
    safety: SafetyRules
    timing: ThresholdRules


class EventDampedLearningState(NamedTuple):
    """Phase, clock, safety, the requested torque, the torque's course, and what was learnt."""

    phase: PhaseState
    clock: ThresholdClock
    safety: SafetyState
    request: TorqueRequest
    law: TorqueSlope
    table: LearntTable


def update(
    parameters: EventDampedLearningParameters,
    state: EventDampedLearningState,
    reference: float,
    measurement: GaitMeasurement,
    period: float,
) -> tuple[float, EventDampedLearningState]:
    """Command from -1 to 1, or ``VENT``; the reference is not used."""
    assessment = assess(parameters, state, measurement, period)
    phase, torque, profile = assessment.phase, measurement.torque, parameters.assistance.push_off
    since_strike = assessment.time.since_strike
    pushes = phase.phase == phases.PUSH_OFF
    table = learnt_table.learn(
        parameters.learning,
        state.table,
        profile,
        since_strike,
        phase.stride_time,
        assessment.request.torque - torque if pushes else 0.0,
        period * assessment.acts if pushes else 0.0,
    )
    place = learnt_table.place_in_table(profile, since_strike, phase.stride_time)
    ahead = learnt_table.command_at(table, place) if pushes else 0.0
    law = TorqueSlope(
        state.law.torque, state.law.slope * assessment.continues, state.law.started * assessment.continues
    )
    command, law = damped_command(parameters.law, law, assessment.request.torque, torque, ahead, period)
    command, watch = assistance.valve_command(assessment, command, period)
    return command, EventDampedLearningState(
        phase=phase,
        clock=assessment.clock,
        safety=watch,
        request=assessment.request,
        law=law,
        table=table,
    )


TUNED = {
    "proportional_gain": 1.4,
    "damping": 0.0046,
    "damping_filter": 0.001,
}
"""SI units; found with ``python scripts/walking_gains.py event_damped_learning``."""

KIND = ControllerKind(
    name="event_damped_learning",
    summary="Event-based torque profiles for each phase, tracked by damped control that learns the push-off.",
    source=f"the paper, figure 1A (phases); {damped_proportional.KIND.source}",
    quantities=(
        *with_defaults(damped_proportional.GAIN_QUANTITIES, TUNED),
        Quantity("learning_gain", "1/(N m)", "command learnt per mean torque error of a stride", 0.67, 0.0, 1.0e3),
        Quantity("forgetting", "1", "fraction of what was learnt that a stride forgets", 0.005, 0.0, 1.0),
        Quantity("lead", "s", "time by which the table is read ahead of where it was learnt", 0.02, 0.0, 0.2),
        *ASSISTING_QUANTITIES,
    ),
    parameters=EventDampedLearningParameters,
    initial=EventDampedLearningState(
        phase=phases.START,
        clock=ThresholdClock(),
        safety=safety.START,
        request=assistance.START,
        law=TorqueSlope(0.0, 0.0, 0.0),
        table=learnt_table.EMPTY,
    ),
    update=update,
)
