"""Proportional control with damping injection, and a learnt feed-forward command as a table over the task."""

from typing import Annotated, NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement

KNOTS = 31


class DampedProportionalParameters(NamedTuple):
    """Gain [1/(N m)], damping [s/(N m)], its filter [s], time between knots [s]; learnt commands [-] at the knots."""

    proportional_gain: float
    damping: float
    damping_filter: float
    knot_spacing: float
    knots: Annotated[tuple[float, ...], KNOTS]


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
    fraction = position - before
    first = parameters.knots[before]
    return first + fraction * (parameters.knots[before + 1] - first)


def damped_command(
    gains: DampedGains, course: TorqueSlope, reference: float, torque: float, ahead: float, period: float
) -> tuple[float, TorqueSlope]:
    """Command from -1 to 1: gain times torque error, less damping times the rate of the torque, plus ``ahead`` [-].

    Reference and torque [N m], period [s]. Damping acts on the rate of the torque, not of the error, so that a step of
    the reference gives no kick.
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
    """Command from -1 to 1 by ``damped_command``, on top of the learnt command of the table."""
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
