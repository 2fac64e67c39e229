"""PID control with a feed-forward command from the inverse valve model along the reference."""

from typing import NamedTuple

from ppafo.control.chamber_model import (
    NOMINAL_QUANTITIES,
    NominalChambers,
    TorqueRates,
    opening_for_rate,
    torque_rates,
)
from ppafo.control.controllers import pid
from ppafo.control.controllers.pid import PidParameters, PidState, pid_command
from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement

NEARLY_SUPPLY = 0.999
"""Largest fraction of the supply pressure that the feed-forward plans for: above it no opening follows a demand."""


class PidFeedforwardParameters(NamedTuple):
    """Gains of the feedback, weight of the feed-forward [-], and the believed device."""

    feedback: PidParameters
    feedforward: float
    nominal: NominalChambers


class PidFeedforwardState(NamedTuple):
    """The state of the PID, and the reference one sample ago [N m]."""

    feedback: PidState
    reference: float


def rates_on_reference(nominal: NominalChambers, reference: float, angle: float) -> TorqueRates:
    """Believed torque rates of a vane at rest whose torque is the reference [N m] with the other chamber vented."""
    ambient = nominal.atmospheric_pressure
    above = reference / nominal.torque_constant
    pressure_1 = min(ambient + max(above, 0.0), NEARLY_SUPPLY * nominal.supply_pressure)
    pressure_2 = min(ambient + max(-above, 0.0), NEARLY_SUPPLY * nominal.dorsiflexion_pressure)
    return torque_rates(nominal, angle, 0.0, pressure_1, pressure_2)


def update(
    parameters: PidFeedforwardParameters,
    state: PidFeedforwardState,
    reference: float,
    measurement: Measurement,
    period: float,
) -> tuple[float, PidFeedforwardState]:
    """Command from -1 to 1: PID of the torque error [N m], equation (13), and the opening for the reference's rate."""
    rate = (reference - state.reference) / period * state.feedback.started
    rates = rates_on_reference(parameters.nominal, reference, measurement.angle)
    ahead = parameters.feedforward * opening_for_rate(rates, rate)
    error = reference - measurement.torque
    command, feedback = pid_command(parameters.feedback, state.feedback, error, ahead, period)
    return command, PidFeedforwardState(feedback, reference)


def restart(state: PidFeedforwardState, requested: float, continues: float) -> PidFeedforwardState:
    """The state, reset where another task begins (``continues`` 0, else 1); the reference [N m] then has no rate."""
    feedback = pid.restart(state.feedback, requested, continues)
    return PidFeedforwardState(feedback=feedback, reference=state.reference)


KIND = ControllerKind(
    name="pid_feedforward",
    summary="PID on the torque error, with feed-forward from a valve model along the reference.",
    source="the paper, equation (13), with the inverse of equations (2) to (9); Åström and Hägglund 2006, Advanced PID",
    quantities=(
        Quantity("proportional_gain", "1/(N m)", "k_p", 1.1, 0.0, 1.0e3),
        Quantity("integral_gain", "1/(N m s)", "k_i", 3.3, 0.0, 1.0e5),
        Quantity("derivative_gain", "s/(N m)", "k_d", 0.0061, 0.0, 1.0e3),
        Quantity("derivative_filter", "s", "time constant of the filter on the slope of the error", 0.0025, 0.0, 10.0),
        Quantity("anti_windup", "1/s", "rate at which the integral is pulled back, 0 for none", 0.33, 0.0, 1.0e4),
        Quantity("feedforward", "", "weight of the feed-forward, 0 for none", 1.0, 0.0, 2.0),
        *NOMINAL_QUANTITIES,
    ),
    parameters=PidFeedforwardParameters,
    initial=PidFeedforwardState(PidState(integral=0.0, error=0.0, slope=0.0, started=0.0), 0.0),
    update=update,
    restart=restart,
)
