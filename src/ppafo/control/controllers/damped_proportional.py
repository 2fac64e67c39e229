"""Proportional control with damping injection, and a learnt feed-forward command as a table over the task."""

from typing import NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement

KNOTS = 31
FIRST_KNOT = 4
"""Place of the first knot among the parameters."""


class DampedProportionalParameters(NamedTuple):
    """Gain [1/(N m)], damping [s/(N m)], its filter [s], time between knots [s]; learnt commands [-] at the knots."""

    proportional_gain: float
    damping: float
    damping_filter: float
    knot_spacing: float
    knot_0: float
    knot_1: float
    knot_2: float
    knot_3: float
    knot_4: float
    knot_5: float
    knot_6: float
    knot_7: float
    knot_8: float
    knot_9: float
    knot_10: float
    knot_11: float
    knot_12: float
    knot_13: float
    knot_14: float
    knot_15: float
    knot_16: float
    knot_17: float
    knot_18: float
    knot_19: float
    knot_20: float
    knot_21: float
    knot_22: float
    knot_23: float
    knot_24: float
    knot_25: float
    knot_26: float
    knot_27: float
    knot_28: float
    knot_29: float
    knot_30: float


class DampedGains(NamedTuple):
    """Gain [1/(N m)], damping [s/(N m)], time constant of its filter [s]."""

    proportional_gain: float
    damping: float
    damping_filter: float


class TorqueSlope(NamedTuple):
    """Torque one sample ago [N m], its filtered rate [N m/s], start mark."""

    torque: float
    slope: float
    started: float


class DampedProportionalState(NamedTuple):
    """Time since the start [s], and the torque's course."""

    elapsed: float
    course: TorqueSlope


def learnt_command(parameters: DampedProportionalParameters, elapsed: float) -> float:
    """Command [-] of the table at a time since the start [s]: straight between knots, the last one held."""
    position = min(elapsed / parameters.knot_spacing, KNOTS - 1.0)
    before = min(int(position), KNOTS - 2)
    share = position - before
    first = parameters[FIRST_KNOT + before]
    return first + share * (parameters[FIRST_KNOT + before + 1] - first)


def damped_command(
    gains: DampedGains, course: TorqueSlope, reference: float, torque: float, ahead: float, period: float
) -> tuple[float, TorqueSlope]:
    """Command: gain times torque error [N m], less damping times the torque's own rate, plus what is given ahead [-].

    Damping acts on the rate of the torque, not of the error, so that a step of the reference gives no kick.
    """
    change = (torque - course.torque) * course.started
    slope = course.slope + (change - period * course.slope) / (period + gains.damping_filter)
    feedback = gains.proportional_gain * (reference - torque) - gains.damping * slope
    return max(-1.0, min(1.0, feedback + ahead)), TorqueSlope(torque, slope, 1.0)


def update(
    parameters: DampedProportionalParameters,
    state: DampedProportionalState,
    reference: float,
    measurement: Measurement,
    period: float,
) -> tuple[float, DampedProportionalState]:
    """Command of ``damped_command`` with what the table has learnt ahead of it."""
    gains = DampedGains(parameters.proportional_gain, parameters.damping, parameters.damping_filter)
    ahead = learnt_command(parameters, state.elapsed)
    command, course = damped_command(gains, state.course, reference, measurement.torque, ahead, period)
    return command, DampedProportionalState(state.elapsed + period, course)


GAIN_QUANTITIES = (
    Quantity("proportional_gain", "1/(N m)", "command per torque error", 1.7, 0.0, 1.0e3),
    Quantity("damping", "s/(N m)", "command per rate of the torque, against it", 0.0067, 0.0, 1.0e3),
    Quantity("damping_filter", "s", "time constant of the filter on the torque's rate", 0.0011, 0.0, 10.0),
)
"""Fields of ``DampedGains`` in order."""

KIND = ControllerKind(
    name="damped_proportional",
    summary="Proportional control with damping injection and a feed-forward table that iterative learning fills.",
    source="Zhang, Cheah and Collins 2015, Experimental comparison of torque control methods on an ankle exoskeleton",
    quantities=(
        *GAIN_QUANTITIES,
        Quantity("knot_spacing", "s", "time between two knots of the table", 0.1, 1.0e-3, 1.0e3),
        *(
            Quantity(f"knot_{number}", "", f"learnt command at knot {number}", 0.0, -1.0, 1.0)
            for number in range(KNOTS)
        ),
    ),
    parameters=DampedProportionalParameters,
    initial=DampedProportionalState(0.0, TorqueSlope(0.0, 0.0, 0.0)),
    update=update,
)
