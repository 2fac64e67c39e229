"""PID control of the error, equation (13).

Units are given for a torque; where another quantity is controlled, read its unit in place of N m.
"""

from typing import Annotated, NamedTuple

from ppafo.control.kind import BelievedBand, ControllerKind
from ppafo.control.torque_loop import beyond_dead_band, integral_gain, integral_rate, proportional_gain
from ppafo.model.controlled import ANYTHING, OF_TORQUE, ErrorFunctions, seen_error
from ppafo.model.declaration import Number, quantities_of
from ppafo.model.sensors import Measurement


class PidGains(NamedTuple):
    """PID gains [1/(N m)], [1/(N m s)], [s/(N m)]; derivative filter time constant [s]; back-calculation gain [1/s]."""

    proportional_gain: Annotated[float, Number("1/(N m)", "k_p", None, 0.0, 1.0e6, follows=proportional_gain)]
    integral_gain: Annotated[float, Number("1/(N m s)", "k_i", None, 0.0, 1.0e9, follows=integral_gain)]
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
            follows=integral_rate,
        ),
    ]


class _PidParameters(NamedTuple):
    """Gains of a PID, and the assumed dead band of the valve [-]."""

    gains: PidGains
    dead_band: BelievedBand


class PidState(NamedTuple):
    """Integral part of the command [-], previous error [N m], filtered error rate [N m/s], 1 after the first sample."""

    integral: float = 0.0
    error: float = 0.0
    slope: float = 0.0
    started: float = 0.0


def pid_command(gains: PidGains, state: PidState, error: float, ahead: float, period: float) -> tuple[float, PidState]:
    """Opening u from -1 to 1 for a torque error e [N m], with a feed-forward opening ``ahead`` u_0 [-]. Equation (13):

        u = u_0 + k_p e + k_i (integral of e) + k_d (slope of e)

    The integral is a sum of rectangles. The slope is a backward difference through a filter of first order with the
    time constant ``derivative_filter``. Anti-windup by back-calculation: the excess of the command over its limits is
    subtracted from the integral at the rate ``anti_windup``; a law without an integral gain has none.
    """
    # The first sample has none before it: no kick of the derivative.
    change = (error - state.error) * state.started
    # Implicit filter: stable for any time constant, also 0, where it is the plain difference.
    slope = state.slope + (change - period * state.slope) / (period + gains.derivative_filter)
    integral = state.integral + gains.integral_gain * error * period
    unlimited = ahead + gains.proportional_gain * error + integral + gains.derivative_gain * slope
    command = max(-1.0, min(1.0, unlimited))
    # Back-calculation: it acts only while the command is clipped, since both are equal otherwise. Without an integral
    # gain it would leave a bias that nothing takes back.
    rate = gains.anti_windup if gains.integral_gain > 0.0 else 0.0
    integral = integral + rate * period * (command - unlimited)
    return command, PidState(integral=integral, error=error, slope=slope, started=1.0)


def pid_update(
    parameters: _PidParameters,
    state: PidState,
    reference: float,
    measurement: Measurement,
    period: float,
    *,
    parts: ErrorFunctions = OF_TORQUE,
) -> tuple[float, PidState]:
    """Command from -1 to 1 for the torque error [N m], equation (13), with dead-band compensation."""
    opening, after = pid_command(parameters.gains, state, seen_error(reference, measurement, parts=parts), 0.0, period)
    return beyond_dead_band(opening, parameters.dead_band), after


PID = ControllerKind(
    name="pid",
    summary="Proportional, integral and derivative action on the torque error.",
    source="the paper, equation (13); gains that are not given: Skogestad 2003, Simple analytic rules",
    quantities=quantities_of(_PidParameters),
    parameters=_PidParameters,
    initial=PidState(),
    update=pid_update,
    controls=ANYTHING,
)
