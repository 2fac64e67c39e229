"""Laws that act on the error alone: PID (equation (13)), sliding mode, and damped proportional control.

Units are those of a torque; of what else is controlled, its unit stands in the place of N m.
"""

from typing import Annotated, NamedTuple

from ppafo.control.kind import DEAD_BAND, BelievedBand, ControllerKind
from ppafo.control.torque_loop import (
    BOUNDARY,
    INTEGRAL_GAIN,
    INTEGRAL_RATE,
    PROPORTIONAL_GAIN,
    beyond_dead_band,
)
from ppafo.model.controlled import ANYTHING, OF_TORQUE, ErrorFunctions, seen_error, seen_value
from ppafo.model.declaration import Number, Quantity, quantities_of
from ppafo.model.sensors import Measurement


class PidGains(NamedTuple):
    """Gains [1/(N m)], [1/(N m s)], [s/(N m)]; time constant of the derivative filter [s]; back-calculation [1/s]."""

    proportional_gain: Annotated[float, Number("1/(N m)", "k_p", None, 0.0, 1.0e3, follows=(PROPORTIONAL_GAIN,))]
    integral_gain: Annotated[float, Number("1/(N m s)", "k_i", None, 0.0, 1.0e6, follows=(INTEGRAL_GAIN,))]
    derivative_gain: Annotated[float, Number("s/(N m)", "k_d", 0.0, 0.0, 1.0e3)]
    derivative_filter: Annotated[
        float, Number("s", "time constant of the derivative filter, 0 for none", 0.0, 0.0, 1.0)
    ]
    anti_windup: Annotated[
        float,
        Number(
            "1/s",
            "rate of back-calculation while the command is clipped, 0 for none",
            None,
            0.0,
            1.0e5,
            follows=(INTEGRAL_RATE,),
        ),
    ]


class PidParameters(NamedTuple):
    """Gains of a PID, and the dead band of the valve [-] that it believes in."""

    gains: PidGains
    dead_band: BelievedBand


class PidState(NamedTuple):
    """Integral part of the command [-], error one sample ago [N m], filtered slope of the error [N m/s], start mark."""

    integral: float
    error: float
    slope: float
    started: float


def pid_command(gains: PidGains, state: PidState, error: float, ahead: float, period: float) -> tuple[float, PidState]:
    """Opening u from -1 to 1 for a torque error e [N m], added to the opening ``ahead`` u_0 [-]. Equation (13):

        u = u_0 + k_p e + k_i (integral of e) + k_d (slope of e)

    The integral is a sum of rectangles. The slope is a backward difference through a filter of first order with the
    time constant ``derivative_filter``. What a clipped command lacks is taken off the integral, by ``anti_windup`` a
    second (back-calculation).
    """
    # The first sample has none before it: no kick of the derivative.
    change = (error - state.error) * state.started
    # Implicit filter: stable for any time constant, also 0, where it is the plain difference.
    slope = state.slope + (change - period * state.slope) / (period + gains.derivative_filter)
    integral = state.integral + gains.integral_gain * error * period
    unlimited = ahead + gains.proportional_gain * error + integral + gains.derivative_gain * slope
    command = max(-1.0, min(1.0, unlimited))
    # Back-calculation: it acts only while the command is clipped, since both are equal otherwise.
    integral = integral + gains.anti_windup * period * (command - unlimited)
    return command, PidState(integral=integral, error=error, slope=slope, started=1.0)


def pid_update(
    parameters: PidParameters,
    state: PidState,
    reference: float,
    measurement: Measurement,
    period: float,
    *,
    parts: ErrorFunctions = OF_TORQUE,
) -> tuple[float, PidState]:
    """Command from -1 to 1 from the torque error [N m], equation (13), beyond the dead band of the valve."""
    opening, after = pid_command(parameters.gains, state, seen_error(reference, measurement, parts=parts), 0.0, period)
    return beyond_dead_band(opening, parameters.dead_band), after


def pid_restart(state: PidState, requested: float, continues: float) -> PidState:
    """The state, reset where another task begins (``continues`` 0, else 1); ``requested`` [N m] is not used."""
    return state._replace(
        integral=state.integral * continues, slope=state.slope * continues, started=state.started * continues
    )


PID = ControllerKind(
    name="pid",
    summary="Proportional, integral and derivative action on the torque error.",
    source="the paper, equation (13); gains that are not given: Skogestad 2003, Simple analytic rules",
    quantities=quantities_of(PidParameters),
    parameters=PidParameters,
    initial=PidState(integral=0.0, error=0.0, slope=0.0, started=0.0),
    update=pid_update,
    restart=pid_restart,
    controls=ANYTHING,
)


class SlidingModeParameters(NamedTuple):
    """Slope of the surface [1/s], half width of the boundary layer [N m], opening outside of it [-]; dead band [-]."""

    surface_slope: Annotated[
        float,
        Number("1/s", "weight of the error's integral in the surface", None, 0.0, 1.0e5, follows=(INTEGRAL_RATE,)),
    ]
    boundary_layer: Annotated[
        float, Number("N m", "half width of the layer without switching", None, 1.0e-6, 1.0e4, follows=(BOUNDARY,))
    ]
    reaching_command: Annotated[float, Number("", "opening outside the layer", 1.0, 0.0, 1.0)]
    dead_band: BelievedBand


class SlidingModeState(NamedTuple):
    """State of a sliding-mode law: integral of the torque error [N m s]."""

    integral: float


def sliding_update(
    parameters: SlidingModeParameters,
    state: SlidingModeState,
    reference: float,
    measurement: Measurement,
    period: float,
    *,
    parts: ErrorFunctions = OF_TORQUE,
) -> tuple[float, SlidingModeState]:
    """Command [-] for the torque error e [N m], with the boundary layer phi [N m] and the slope lambda [1/s]:

        s = e + lambda (integral of e),    u = reaching_command min(1, max(-1, s / phi))

    The opening u is made a command beyond the dead band. The integral stands still outside the layer, where a longer
    error could not open the valve further.
    """
    error = seen_error(reference, measurement, parts=parts)
    integral = state.integral + period * error
    surface = error + parameters.surface_slope * integral
    is_inside = abs(surface) < parameters.boundary_layer
    fraction = max(-1.0, min(1.0, surface / parameters.boundary_layer))
    command = beyond_dead_band(parameters.reaching_command * fraction, parameters.dead_band)
    return command, SlidingModeState(integral if is_inside else state.integral)


def sliding_restart(state: SlidingModeState, requested: float, continues: float) -> SlidingModeState:
    """The state, reset where another task begins (``continues`` 0, else 1); ``requested`` [N m] is not used."""
    return SlidingModeState(integral=state.integral * continues)


SLIDING_MODE = ControllerKind(
    name="sliding_mode",
    summary="Sliding mode on the torque error and its integral, with a boundary layer.",
    source="Slotine and Li 1991, Applied Nonlinear Control, chapter 7; on pneumatic actuators Bone and Ning 2007",
    quantities=quantities_of(SlidingModeParameters),
    parameters=SlidingModeParameters,
    initial=SlidingModeState(0.0),
    update=sliding_update,
    restart=sliding_restart,
    controls=ANYTHING,
)


KNOTS = 31


class DampedProportionalParameters(NamedTuple):
    """Gain [1/(N m)], damping [s/(N m)], its filter [s], time between knots [s]; learnt commands [-] at the knots.

    ``dead_band`` is the believed smallest command [-] that opens the valve.
    """

    proportional_gain: float
    damping: float
    damping_filter: float
    knot_spacing: float
    knots: Annotated[tuple[float, ...], KNOTS]
    dead_band: float


class DampedGains(NamedTuple):
    """Gain [1/(N m)], damping [s/(N m)], time constant of its filter [s]."""

    proportional_gain: Annotated[
        float, Number("1/(N m)", "command per torque error", None, 0.0, 1.0e3, follows=(PROPORTIONAL_GAIN,))
    ]
    damping: Annotated[float, Number("s/(N m)", "command per rate of the torque, against it", 0.0, 0.0, 1.0e3)]
    damping_filter: Annotated[float, Number("s", "time constant of the filter on the torque's rate", 0.001, 0.0, 10.0)]


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
    # The last knot has no line after it: the line before it is used up to its end.
    before = min(int(position), KNOTS - 2)
    fraction = position - before
    first = parameters.knots[before]
    return first + fraction * (parameters.knots[before + 1] - first)


def damped_command(
    gains: DampedGains, course: TorqueSlope, reference: float, torque: float, ahead: float, period: float
) -> tuple[float, TorqueSlope]:
    """Command u from -1 to 1 for a reference r and a torque T [N m], added to the command ``ahead`` u_0 [-]:

        u = u_0 + proportional_gain (r - T) - damping dT/dt

    The rate is a backward difference over the period [s] through a filter of first order. Damping acts on the rate of
    the torque, not of the error, so that a step of the reference gives no kick.
    """
    change = (torque - course.torque) * course.started
    # Implicit, as in the PID: a filter of 0 s is the plain difference.
    slope = course.slope + (change - period * course.slope) / (period + gains.damping_filter)
    feedback = gains.proportional_gain * (reference - torque) - gains.damping * slope
    return max(-1.0, min(1.0, feedback + ahead)), TorqueSlope(torque, slope, 1.0)


def damped_update(
    parameters: DampedProportionalParameters,
    state: DampedProportionalState,
    reference: float,
    measurement: Measurement,
    period: float,
    *,
    parts: ErrorFunctions = OF_TORQUE,
) -> tuple[float, DampedProportionalState]:
    """Command from -1 to 1 by ``damped_command``, on top of the table's learnt command, beyond the dead band."""
    gains = DampedGains(parameters.proportional_gain, parameters.damping, parameters.damping_filter)
    ahead = learnt_command(parameters, state.elapsed)
    wanted, value = parts.steered(reference), parts.steered(seen_value(measurement, parts=parts))
    opening, course = damped_command(gains, state.course, wanted, value, ahead, period)
    return beyond_dead_band(opening, parameters.dead_band), DampedProportionalState(state.elapsed + period, course)


GAIN_QUANTITIES = quantities_of(DampedGains)
"""Fields of ``DampedGains`` in order."""

DAMPED_PROPORTIONAL = ControllerKind(
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
        DEAD_BAND,
    ),
    parameters=DampedProportionalParameters,
    initial=DampedProportionalState(0.0, TorqueSlope(0.0, 0.0, 0.0)),
    update=damped_update,
    controls=ANYTHING,
)
