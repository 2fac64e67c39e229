"""Walking leg with the device in an integration step: prescribed shank, foot free or on the ground."""

from ppafo.engine.groups import Groups, given, handed, kept
from ppafo.engine.program import Program
from ppafo.engine.scheme import walking
from ppafo.engine.scheme.pneumatics import HeldChambers, held_chambers
from ppafo.engine.scheme.walking import CarriedFoot, DeviceShare, WalkEnd, WalkState, WalkStep
from ppafo.engine.step import gas
from ppafo.engine.step.lane import Lane, Now
from ppafo.engine.step.phases import length_of, time_of
from ppafo.model.gait import (
    GaitMeasured,
    GaitNow,
    GaitPlace,
    GaitSeries,
    GaitTiming,
    gait_of,
    measured_at,
    place_at,
)
from ppafo.model.leg import LegParameters
from ppafo.model.sensors import GaitSeen, GaitSensors


def groups(_parts: Program) -> Groups:
    """Groups for a walking leg: leg and gait, state of the walk, and values passed between phases."""
    return {
        "leg": given(LegParameters),
        "share": given(DeviceShare),
        "gait": given(GaitSeries),
        "gait_timing": given(GaitTiming),
        "gait_sensors": given(GaitSensors),
        "walk": kept(WalkState),
        "gait_seen": kept(GaitSeen),
        "place": handed(GaitPlace),
        "measured": handed(GaitMeasured),
        "next_gait": handed(GaitNow),
        "carried": handed(CarriedFoot),
        "walk_begun": handed(WalkStep),
        "ahead": handed(HeldChambers),
        "ended": handed(WalkEnd),
    }


# Before the gas.


def carry(parts: Program, lane: Lane) -> None:
    """Set the torques of the foot before the first step."""
    lane.carried = walking.carried_foot(lane.leg, lane.share, lane.walk.now, lane.walk.foot)


def find_place(parts: Program, lane: Lane, now: Now) -> None:
    """Set the gait phase at the end of the step."""
    lane.place = place_at(lane.gait_timing, time_of(parts, lane, now) + length_of(parts, lane))


def find_measured(parts: Program, lane: Lane) -> None:
    """Set the measured gait at the phase where the step ends."""
    lane.measured = measured_at(lane.gait, lane.gait_timing, lane.leg, lane.place)


def find_gait(parts: Program, lane: Lane) -> None:
    """Set the gait at the end of the step, for the leg of this wearer."""
    lane.next_gait = gait_of(lane.leg, lane.measured)


def begin(parts: Program, lane: Lane) -> None:
    """Set the predicted step of the foot, free and on the ground."""
    lane.walk_begun = walking.begin_walk(
        lane.plant,
        lane.leg,
        lane.gait_timing,
        lane.state,
        lane.held,
        lane.walk,
        lane.carried,
        lane.next_gait,
        length_of(parts, lane),
        parts=parts.functions,
    )


def assumed_angle(parts: Program, lane: Lane) -> float:
    """Return the joint angle [rad] at which the chamber volumes end in a step of a walk."""
    return walking.next_angle(lane.plant, lane.leg, lane.walk, lane.walk_begun)


def hold_ahead(parts: Program, lane: Lane) -> None:
    """Set the chambers at the angle where the volumes end."""
    lane.ahead = held_chambers(lane.plant, assumed_angle(parts, lane), parts=parts.functions)


# Behind it.


def reach(parts: Program, lane: Lane) -> None:
    """Set the state at the end of a step in which the foot neither reverses nor starts to move."""
    gas.add(parts, lane)
    lane.ended, lane.carried = walking.reach_end(
        lane.plant,
        lane.leg,
        lane.share,
        lane.gait_timing,
        lane.fed,
        lane.walk,
        lane.walk_begun,
        lane.next_gait,
        lane.ahead,
        length_of(parts, lane),
        parts=parts.functions,
    )


def depart(parts: Program, lane: Lane) -> None:
    """Set the end of a step in which the foot reverses or starts to move, which is rare."""
    gas.add(parts, lane)
    lane.ended, lane.ahead = walking.depart_in_walk(
        lane.plant, lane.fed, lane.walk_begun, lane.ended, lane.ahead, length_of(parts, lane), parts=parts.functions
    )


def end(parts: Program, lane: Lane, length: float) -> None:
    """Set the states of plant and leg at the end of the step."""
    lane.held = lane.ahead
    lane.after, lane.walk_after = walking.end_walk(
        lane.plant,
        lane.leg,
        lane.share,
        lane.gait_timing,
        lane.gait_sensors.follow_rate,
        lane.fed,
        lane.walk,
        lane.walk_begun,
        lane.ended,
        lane.held,
        lane.carried,
        lane.next_gait,
        length,
        parts=parts.functions,
    )
