"""Foot on a prescribed shank, without ground contact, in an integration step: torque on an unconstrained vane."""

from ppafo.control.profiles import CONSTANT
from ppafo.engine.program import Program
from ppafo.engine.scheme.motion import SAME_INSTANT
from ppafo.engine.step.lane import Lane
from ppafo.model.gait import foot_in_gait
from ppafo.model.leg import ShankNow, torque_on_foot, torque_on_resting_foot
from ppafo.signals.meter import FootSample


def shank(parts: Program, lane: Lane, time: float) -> ShankNow:
    """Return the shank motion at a time [s]; without a gait, the knee is at rest."""
    assert parts.shank is not None, "a foot has a shank"
    if parts.is_on_gait:
        now: ShankNow = parts.shank.value(lane.shank, time)
        return now
    angle, rate, acceleration = parts.shank.value(lane.shank, time)
    return ShankNow(angle=angle, rate=rate, acceleration=acceleration, knee_forward=0.0, knee_up=0.0)


def until_jump(parts: Program, lane: Lane, time: float) -> float:
    """Time [s] from ``time`` [s] to the next jump of the shank acceleration; a jump due now has already happened."""
    assert parts.shank is not None, "a foot has a shank"
    assert parts.shank.until_jump is not None, "the shank jumps"
    behind: float = parts.shank.until_jump(lane.shank, time + SAME_INSTANT)
    return behind + SAME_INSTANT


def torque(parts: Program, lane: Lane, time: float, angle: float) -> float:
    """Return the torque on the vane [N m] at a time [s] and an angle [rad], positive in plantarflexion."""
    if parts.shank is CONSTANT:
        # A shank that rests needs one sine instead of two in each part of a step.
        return torque_on_resting_foot(lane.load, lane.shank.level, angle)
    return torque_on_foot(lane.load, shank(parts, lane, time), angle)


def sample(parts: Program, lane: Lane, time: float) -> FootSample:
    """Return the foot motion relative to the measured foot at a time [s] of a gait."""
    angle, measured_angle, toe_difference = foot_in_gait(lane.shank, time, lane.state.angle)
    return FootSample(angle, measured_angle, toe_difference)
