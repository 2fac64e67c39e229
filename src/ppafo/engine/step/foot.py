"""A foot on a prescribed shank in a step, without ground: the torque that it adds to an unconstrained vane."""

from ppafo.engine.program import Program
from ppafo.engine.scheme.motion import SAME_INSTANT
from ppafo.engine.step.lane import Lane
from ppafo.model.gait import foot_in_gait
from ppafo.model.leg import ShankNow, torque_on_foot, torque_on_resting_foot
from ppafo.signals.meter import FootSample


def shank(parts: Program, lane: Lane, time: float) -> ShankNow:
    """The shank at a time [s]; the knee of one that no gait leads rests."""
    assert parts.shank is not None, "a foot has a shank"
    if parts.is_on_gait:
        now: ShankNow = parts.shank.value(lane.shank, time)
        return now
    angle, rate, acceleration = parts.shank.value(lane.shank, time)
    return ShankNow(angle=angle, rate=rate, acceleration=acceleration, knee_forward=0.0, knee_up=0.0)


def until_jump(parts: Program, lane: Lane, time: float) -> float:
    """Time [s] from one [s] until the acceleration of the shank jumps; a jump that is due has happened."""
    assert parts.shank is not None, "a foot has a shank"
    assert parts.shank.until_jump is not None, "the shank jumps"
    behind: float = parts.shank.until_jump(lane.shank, time + SAME_INSTANT)
    return behind + SAME_INSTANT


def torque(parts: Program, lane: Lane, time: float, angle: float) -> float:
    """Torque on the vane [N m] at a time [s] and an angle [rad], positive in plantarflexion."""
    if parts.shank_rests:
        # A shank that rests needs one sine instead of two in each part of a step.
        return torque_on_resting_foot(lane.load, lane.shank.level, angle)
    return torque_on_foot(lane.load, shank(parts, lane, time), angle)


def sample(parts: Program, lane: Lane, time: float) -> FootSample:
    """The foot beside the one that was measured, at a time [s] of a gait."""
    angle, measured_angle, toe_difference = foot_in_gait(lane.shank, time, lane.state.angle)
    return FootSample(angle, measured_angle, toe_difference)
