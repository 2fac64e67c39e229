"""Table of commands over the push-off, learnt from stride to stride while walking.

The law of Zhang, Cheah and Collins (2015) for a knot of the table, from one stride n to the next:

    table_{n+1} = (1 - forgetting) table_n + gain e_n

Here e_n is the mean torque error over the time of the knot, which replaces their filter over strides. The table is
read a lead earlier than it was learnt, because the torque lags behind the command. Knots learn while the stride passes
over them, so that no stride has to be stored. The knots are written out one by one, so that all runs are computed
without branches.
"""

from typing import Annotated, NamedTuple

from ppafo.control.controllers import damped_proportional
from ppafo.control.controllers.damped_proportional import DampedGains, TorqueSlope, damped_command
from ppafo.control.kind import DEAD_BAND, BelievedBand, ControllerKind
from ppafo.control.torque_loop import LEAD, LEARNING_GAIN, beyond_dead_band
from ppafo.control.walking import assistance
from ppafo.control.walking.assistance import ASSISTING_QUANTITIES, Assistance, TorqueProfile, TorqueRequest, assess
from ppafo.control.walking.phases import PhaseRules, PhaseState
from ppafo.control.walking.timing import AT_THRESHOLDS, ClockParts
from ppafo.model.declaration import EmptyRow, Number, quantities_of
from ppafo.model.helping import PUSH_OFF
from ppafo.model.sensors import GaitMeasurement

KNOTS = 16


class LearningRules(NamedTuple):
    """Gain [1/(N m)], fraction of a knot that a stride forgets [-], lead [s]."""

    learning_gain: Annotated[
        float,
        Number(
            "1/(N m)", "command learnt per mean torque error of a stride", None, 0.0, 1.0e3, follows=(LEARNING_GAIN,)
        ),
    ]
    forgetting: Annotated[float, Number("1", "fraction of what was learnt that a stride forgets", 0.005, 0.0, 1.0)]
    lead: Annotated[
        float,
        Number("s", "time by which the table is read ahead of where it was learnt", None, 0.0, 0.5, follows=(LEAD,)),
    ]


Knots = Annotated[tuple[float, ...], KNOTS]
"""Learnt commands [-] at knots spaced evenly from start to end of the torque profile."""
EMPTY = (0.0,) * KNOTS


def near(position: float, knot: float) -> float:
    """Weight [-] of a knot at a position, both in knots: 1 at the knot, decreasing linearly to 0 at its neighbours."""
    return max(0.0, 1.0 - abs(position - knot))


def command_at(table: Knots, position: float) -> float:
    """Command [-] at a position in knots: linear between knots, 0 outside of the table."""
    command = table[0] * near(position, 0.0)
    for knot in range(1, KNOTS):
        command = command + table[knot] * near(position, float(knot))
    return command


def next_knot(knot: float, weight: float, step: float, forgetting: float) -> float:
    """Command [-] of a knot after a weighted sample: reduced by forgetting, changed by a step, within -1 to 1."""
    # Commands have these limits; a larger knot would take strides to return.
    return max(-1.0, min(1.0, knot + weight * (step - forgetting * knot)))


def table_position(profile: TorqueProfile, since_strike: float, stride_time: float) -> float:
    """Position in the table, in knots, for a time since the heel strike and a stride time, both [s]."""
    since_start = since_strike / stride_time - profile.peak_time + profile.rise_time
    return since_start / (profile.rise_time + profile.fall_time) * (KNOTS - 1.0)


def learn(
    rules: LearningRules,
    table: Knots,
    profile: TorqueProfile,
    since_strike: float,
    stride_time: float,
    error: float,
    duration: float,
) -> Knots:
    """Table after a sample with a torque error [N m] of a duration [s]; a duration of 0 changes nothing.

    The weights of the samples of one stride add up to 1 at each knot.
    """
    # The weight of a sample is its duration divided by the time of a knot.
    knot_time = (profile.rise_time + profile.fall_time) * stride_time / (KNOTS - 1.0)
    # The torque lags behind the command: an error is due to the command a lead before.
    position = table_position(profile, since_strike - rules.lead, stride_time)
    return next_table(table, position, duration / knot_time, rules.learning_gain * error, rules.forgetting)


def next_table(table: Knots, position: float, weight: float, step: float, forgetting: float) -> Knots:
    """Table after a sample at a position in knots.

    The two neighbouring knots change, each by its part of the sample's ``weight`` [-] and of ``step`` [-].
    """
    return (
        next_knot(table[0], near(position, 0.0) * weight, step, forgetting),
        next_knot(table[1], near(position, 1.0) * weight, step, forgetting),
        next_knot(table[2], near(position, 2.0) * weight, step, forgetting),
        next_knot(table[3], near(position, 3.0) * weight, step, forgetting),
        next_knot(table[4], near(position, 4.0) * weight, step, forgetting),
        next_knot(table[5], near(position, 5.0) * weight, step, forgetting),
        next_knot(table[6], near(position, 6.0) * weight, step, forgetting),
        next_knot(table[7], near(position, 7.0) * weight, step, forgetting),
        next_knot(table[8], near(position, 8.0) * weight, step, forgetting),
        next_knot(table[9], near(position, 9.0) * weight, step, forgetting),
        next_knot(table[10], near(position, 10.0) * weight, step, forgetting),
        next_knot(table[11], near(position, 11.0) * weight, step, forgetting),
        next_knot(table[12], near(position, 12.0) * weight, step, forgetting),
        next_knot(table[13], near(position, 13.0) * weight, step, forgetting),
        next_knot(table[14], near(position, 14.0) * weight, step, forgetting),
        next_knot(table[15], near(position, 15.0) * weight, step, forgetting),
    )


class _EventDampedLearningParameters(NamedTuple):
    """Gains of law and learning, assumed dead band [-], assistance, and rules of phases and timing."""

    law: DampedGains
    learning: LearningRules
    dead_band: BelievedBand
    assistance: Assistance
    phases: PhaseRules
    timing: EmptyRow


class _EventDampedLearningState(NamedTuple):
    """Phase, clock, torque request, state of the torque law, and learnt table."""

    phase: PhaseState = PhaseState()
    clock: EmptyRow = EmptyRow()
    request: TorqueRequest = TorqueRequest()
    law: TorqueSlope = TorqueSlope()
    table: Knots = EMPTY


USUAL_CLOCK = ClockParts(AT_THRESHOLDS, _EventDampedLearningState)
"""State class and timing functions of the law with the default gait phase estimator."""


def update(
    parameters: _EventDampedLearningParameters,
    state: _EventDampedLearningState,
    reference: float,
    measurement: GaitMeasurement,
    period: float,
    *,
    parts: ClockParts = USUAL_CLOCK,
) -> tuple[float, _EventDampedLearningState]:
    """Command from -1 to 1, or ``VENT``; the reference is not used."""
    assessment = assess(parameters, state, measurement, period, parts=parts.timing)
    phase, torque, profile = assessment.phase, measurement.torque, parameters.assistance.push_off
    since_strike = assessment.time.since_strike
    pushes = phase.phase == PUSH_OFF
    table = learn(
        parameters.learning,
        state.table,
        profile,
        since_strike,
        phase.stride_time,
        assessment.request.torque - torque if pushes else 0.0,
        period * assessment.acts if pushes else 0.0,
    )
    position = table_position(profile, since_strike, phase.stride_time)
    feedforward = command_at(table, position) if pushes else 0.0
    law = state.law._replace(
        slope=state.law.slope * assessment.continues, started=state.law.started * assessment.continues
    )
    opening, law = damped_command(parameters.law, law, assessment.request.torque, torque, feedforward, period)
    command = beyond_dead_band(opening, parameters.dead_band)
    command = assistance.valve_command(assessment, command)
    following: _EventDampedLearningState = parts.state(
        phase=phase, clock=assessment.clock, request=assessment.request, law=law, table=table
    )
    return command, following


KIND = ControllerKind(
    name="event_damped_learning",
    summary="Event-based torque profiles for each phase, tracked by damped control that learns the push-off.",
    source=f"the paper, figure 1A (phases); {damped_proportional.DAMPED_PROPORTIONAL.source}",
    quantities=(*damped_proportional.GAIN_QUANTITIES, *quantities_of(LearningRules), DEAD_BAND, *ASSISTING_QUANTITIES),
    parameters=_EventDampedLearningParameters,
    initial=_EventDampedLearningState(),
    update=update,
)
