"""Model-based torque control: the chamber dynamics inverted, so that the torque error decays at a chosen rate."""

from typing import NamedTuple

from ppafo.control.chamber_model import NOMINAL_QUANTITIES, NominalChambers, opening_for_rate, torque_rates
from ppafo.control.kind import ControllerKind
from ppafo.model.declaration import Quantity
from ppafo.model.sensors import Measurement


class FeedbackLinearisationParameters(NamedTuple):
    """Decay rate of the error [1/s], filter of the angle's rate [s], and the believed device."""

    convergence_rate: float
    rate_filter: float
    nominal: NominalChambers


class FeedbackLinearisationState(NamedTuple):
    """Reference [N m] and angle [rad] one sample ago, filtered angular velocity [rad/s], start mark."""

    reference: float
    angle: float
    angular_velocity: float
    started: float


def update(
    parameters: FeedbackLinearisationParameters,
    state: FeedbackLinearisationState,
    reference: float,
    measurement: Measurement,
    period: float,
) -> tuple[float, FeedbackLinearisationState]:
    """Command: the opening for which the believed chambers change the torque by r' + rate (r - torque) [N m/s]."""
    reference_rate = (reference - state.reference) / period * state.started
    turned = (measurement.angle - state.angle) * state.started
    velocity = state.angular_velocity
    velocity = velocity + (turned - period * velocity) / (period + parameters.rate_filter)
    rates = torque_rates(
        parameters.nominal, measurement.angle, velocity, measurement.pressure_1, measurement.pressure_2
    )
    requested = reference_rate + parameters.convergence_rate * (reference - measurement.torque)
    return opening_for_rate(rates, requested), FeedbackLinearisationState(
        reference=reference, angle=measurement.angle, angular_velocity=velocity, started=1.0
    )


def restart(state: FeedbackLinearisationState, requested: float, continues: float) -> FeedbackLinearisationState:
    """The state; where another task begins (``continues`` 0, else 1), the requested torque [N m] has no rate yet."""
    return FeedbackLinearisationState(
        reference=state.reference if continues > 0.5 else requested,
        angle=state.angle,
        angular_velocity=state.angular_velocity,
        started=state.started,
    )


KIND = ControllerKind(
    name="feedback_linearisation",
    summary="Chamber dynamics inverted at the measured pressures and angle: the torque error decays at a chosen rate.",
    source="Slotine and Li 1991, Applied Nonlinear Control, chapter 6; on pneumatic actuators Richer and Hurmuzlu 2000",
    quantities=(
        Quantity("convergence_rate", "1/s", "rate at which the torque error decays", 93.0, 0.0, 1.0e5),
        Quantity("rate_filter", "s", "time constant of the filter on the angle's rate", 0.0054, 0.0, 10.0),
        *NOMINAL_QUANTITIES,
    ),
    parameters=FeedbackLinearisationParameters,
    initial=FeedbackLinearisationState(reference=0.0, angle=0.0, angular_velocity=0.0, started=0.0),
    update=update,
    restart=restart,
)
