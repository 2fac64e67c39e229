"""Proportional control with damping on the rate of the controlled quantity, and a feed-forward table of commands.

Units are given for a torque; where another quantity is controlled, read its unit in place of N m.
"""

from typing import Annotated, NamedTuple

from ppafo.control.kind import DEAD_BAND, ControllerKind
from ppafo.control.torque_loop import beyond_dead_band, proportional_gain
from ppafo.model.controlled import ANYTHING, OF_TORQUE, ErrorFunctions, seen_value
from ppafo.model.declaration import Number, Quantity, quantities_of
from ppafo.model.sensors import Measurement

KNOTS = 31


class DampedGains(NamedTuple):
    """Gain [1/(N m)], damping [s/(N m)], time constant of its filter [s]."""

    proportional_gain: Annotated[
        float, Number("1/(N m)", "command per torque error", None, 0.0, 1.0e6, follows=proportional_gain)
    ]
    damping: Annotated[float, Number("s/(N m)", "command per rate of the torque, against it", 0.0, 0.0, 1.0e3)]
    damping_filter: Annotated[float, Number("s", "time constant of the filter on the torque's rate", 0.001, 0.0, 10.0)]


class _DampedProportionalParameters(NamedTuple):
    """Gains, time between knots [s], learnt commands [-] at the knots, and assumed dead band of the valve [-]."""

    gains: DampedGains
    knot_spacing: float
    knots: Annotated[tuple[float, ...], KNOTS]
    dead_band: float


class _DampedProportionalState(NamedTuple):
    """Time since the start [s], previous torque [N m], filtered torque rate [N m/s], and 1 after the first sample."""

    elapsed: float = 0.0
    torque: float = 0.0
    slope: float = 0.0
    started: float = 0.0


def learnt_command(parameters: _DampedProportionalParameters, elapsed: float) -> float:
    """Command [-] of the table at a time since the start [s]: linear between knots, constant after the last knot."""
    position = min(elapsed / parameters.knot_spacing, KNOTS - 1.0)
    # The last knot has no line after it: the line before it is used up to its end. A time that is no number reads no
    # memory but the table.
    before = max(0, min(int(position), KNOTS - 2))
    fraction = position - before
    first = parameters.knots[before]
    return first + fraction * (parameters.knots[before + 1] - first)


def damped_update(
    parameters: _DampedProportionalParameters,
    state: _DampedProportionalState,
    reference: float,
    measurement: Measurement,
    period: float,
    *,
    parts: ErrorFunctions = OF_TORQUE,
) -> tuple[float, _DampedProportionalState]:
    """Command u from -1 to 1 for a reference r and a torque T [N m], with the learnt command u_0 of the table:

        u = u_0 + proportional_gain (r - T) - damping dT/dt

    The rate is a backward difference over the period [s] through a filter of first order. Damping acts on the rate of
    the torque, not of the error, so that a step of the reference gives no kick. The command compensates the dead band.
    """
    gains = parameters.gains
    ahead = learnt_command(parameters, state.elapsed)
    wanted = parts.steered(reference)
    torque = parts.steered(seen_value(measurement, parts=parts))
    change = (torque - state.torque) * state.started
    # Implicit, as in the PID: a filter of 0 s is the plain difference.
    slope = state.slope + (change - period * state.slope) / (period + gains.damping_filter)
    feedback = gains.proportional_gain * (wanted - torque) - gains.damping * slope
    opening = max(-1.0, min(1.0, feedback + ahead))
    command = beyond_dead_band(opening, parameters.dead_band)
    return command, _DampedProportionalState(state.elapsed + period, torque, slope, 1.0)


DAMPED_PROPORTIONAL = ControllerKind(
    name="damped_proportional",
    summary="Proportional control with damping injection and a feed-forward table that iterative learning fills.",
    source="Zhang, Cheah and Collins 2015, Experimental comparison of torque control methods on an ankle exoskeleton",
    quantities=(
        *quantities_of(DampedGains),
        Quantity("knot_spacing", "s", "time between two knots of the table", 0.1, 1.0e-3, 1.0e3),
        *(
            Quantity(f"knot_{number}", "", f"learnt command at knot {number}", 0.0, -1.0, 1.0)
            for number in range(KNOTS)
        ),
        DEAD_BAND,
    ),
    parameters=_DampedProportionalParameters,
    initial=_DampedProportionalState(),
    update=damped_update,
    controls=ANYTHING,
)
