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
    """Command from -1 to 1 for a torque error [N m], added to the command ``ahead`` [-]. Equation (13)."""
    change = (error - state.error) * state.started
    slope = state.slope + (change - period * state.slope) / (period + parameters.derivative_filter)
    integral = state.integral + parameters.integral_gain * error * period
    unlimited = ahead + parameters.proportional_gain * error + integral + parameters.derivative_gain * slope
    command = max(-1.0, min(1.0, unlimited))
    integral = integral + parameters.anti_windup * period * (command - unlimited)
    return command, PidState(integral=integral, error=error, slope=slope, started=1.0)


def update(
    parameters: PidParameters, state: PidState, reference: float, measurement: Measurement, period: float
) -> tuple[float, PidState]:
    """Command from -1 to 1 from the torque error [N m]; rectangular integral, backward difference. Equation (13)."""
    return pid_command(parameters, state, reference - measurement.torque, 0.0, period)


def restart(state: PidState, requested: float, continues: float) -> PidState:
    """The state, reset where another task begins (``continues`` 0, else 1); ``requested`` [N m] is not used."""
    return PidState(
        integral=state.integral * continues,
        error=state.error,
        slope=state.slope * continues,
        started=state.started * continues,
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
