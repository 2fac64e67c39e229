"""PID control of a proportional valve, equation (13), with anti-windup and derivative filter as options."""

from typing import NamedTuple

from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement


class PidParameters(NamedTuple):
    """Gains [1/(N m)], [1/(N m s)], [s/(N m)]; time constant of the derivative filter [s]; back-calculation [1/s]."""

    proportional_gain: float
    integral_gain: float
    derivative_gain: float
    derivative_filter: float
    anti_windup: float


class PidState(NamedTuple):
    """Integral part of the command [-], error one sample ago [N m], filtered slope of the error [N m/s], start mark."""

    integral: float
    error: float
    slope: float
    started: float


def pid_command(
    parameters: PidParameters, state: PidState, error: float, ahead: float, period: float
) -> tuple[float, PidState]:
    """Command from -1 to 1 of a torque error [N m] on top of a command that is given ahead [-]. Equation (13)."""
    change = (error - state.error) * state.started
    slope = state.slope + (change - period * state.slope) / (period + parameters.derivative_filter)
    integral = state.integral + parameters.integral_gain * error * period
    wanted = ahead + parameters.proportional_gain * error + integral + parameters.derivative_gain * slope
    command = max(-1.0, min(1.0, wanted))
    integral = integral + parameters.anti_windup * period * (command - wanted)
    return command, PidState(integral=integral, error=error, slope=slope, started=1.0)


def update(
    parameters: PidParameters, state: PidState, reference: float, measurement: Measurement, period: float
) -> tuple[float, PidState]:
    """Command from -1 to 1 of the torque error; integral by rectangles, slope by backward difference. Equation (13)."""
    return pid_command(parameters, state, reference - measurement.torque, 0.0, period)


def restart(state: PidState, wanted: float, goes_on: float) -> PidState:
    """The state, forgotten (``goes_on`` 0, else 1) where another task begins."""
    return PidState(
        integral=state.integral * goes_on,
        error=state.error,
        slope=state.slope * goes_on,
        started=state.started * goes_on,
    )


KIND = ControllerKind(
    name="pid",
    summary="Proportional, integral and derivative action on the torque error.",
    source="the paper, equation (13); gains k_p 0.095, k_i 0.25, k_d 0.006",
    quantities=(
        Quantity("proportional_gain", "1/(N m)", "k_p", 0.095, 0.0, 1.0e3),
        Quantity("integral_gain", "1/(N m s)", "k_i", 0.25, 0.0, 1.0e4),
        Quantity("derivative_gain", "s/(N m)", "k_d", 0.006, 0.0, 1.0e3),
        Quantity("derivative_filter", "s", "time constant of the derivative filter, 0 for none", 0.0, 0.0, 1.0),
        Quantity(
            "anti_windup", "1/s", "rate of back-calculation while the command is clipped, 0 for none", 0.0, 0.0, 1.0e3
        ),
    ),
    parameters=PidParameters,
    initial=PidState(integral=0.0, error=0.0, slope=0.0, started=0.0),
    update=update,
    restart=restart,
)
