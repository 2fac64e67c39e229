"""Model-based control laws: parameters of the nominal device, the inverse of its model, and two controllers.

The model is equations (2) to (9) for a proportional valve, with the ellipse of ISO 6358 for the flow function. All
parameters belong to the controller, so that they can differ from the device as in a real controller.
"""

import math
from typing import Annotated, NamedTuple

from ppafo.control.controllers.pid import PidGains, PidState, pid_command
from ppafo.control.kind import BelievedBand, ControllerKind
from ppafo.control.torque_loop import beyond_dead_band, convergence_rate
from ppafo.model.declaration import Number, Quantity, quantities_of
from ppafo.model.plant import chamber_1_volume, chamber_2_volume
from ppafo.model.sensors import Measurement

SMALLEST_GAIN = 1.0e-3
"""Torque rate at full opening [N m/s] below which the valve opens fully and the result is clipped."""
NEARLY_SUPPLY = 0.999
"""Largest fraction of the supply pressure used by the feed-forward; above it no opening meets the request."""


def _believed(name: str, unit: str, what: str, minimum: float, maximum: float) -> Quantity:
    """Declare a parameter of the nominal device, which defaults to the value of the device."""
    return Quantity("", unit, f"believed {what}", None, minimum, maximum, follows=name)


class NominalChambers(NamedTuple):
    """Nominal device of a controller, SI units; conductance is Cd A C1 [kg/(s Pa)], ``gas_product`` is R T / M [J/kg].

    The valve opens for commands beyond ``dead_band`` [-].
    """

    torque_constant: Annotated[float, _believed("torque_constant", "m^3", "K_actuator", 1.0e-12, 1.0)]
    displacement_per_radian: Annotated[float, _believed("displacement_per_radian", "m^3/rad", "B_vane", 1.0e-12, 1.0)]
    angle_min: Annotated[float, _believed("angle_min", "rad", "lower stop", -10.0, 10.0)]
    angle_max: Annotated[float, _believed("angle_max", "rad", "upper stop", -10.0, 10.0)]
    dead_volume_1: Annotated[float, _believed("dead_volume_1", "m^3", "dead volume of chamber 1", 1.0e-12, 1.0)]
    dead_volume_2: Annotated[float, _believed("dead_volume_2", "m^3", "dead volume of chamber 2", 1.0e-12, 1.0)]
    gas_product: Annotated[float, _believed("gas_product", "J/kg", "R T / M", 1.0e3, 1.0e7)]
    valve_conductance: Annotated[
        float, _believed("valve_conductance", "kg/(s Pa)", "Cd A C1 of the valve", 1.0e-15, 1.0)
    ]
    leak_conductance: Annotated[float, _believed("leak_conductance", "kg/(s Pa)", "Cd A C1 of the leak", 0.0, 1.0)]
    critical_ratio: Annotated[float, _believed("critical_ratio", "", "critical pressure ratio, ISO 6358", 0.01, 0.95)]
    supply_pressure: Annotated[float, _believed("supply_pressure", "Pa_a", "pressure to chamber 1", 1.0e3, 1.0e8)]
    dorsiflexion_pressure: Annotated[
        float, _believed("dorsiflexion_pressure", "Pa_a", "pressure to chamber 2", 1.0e3, 1.0e8)
    ]
    atmospheric_pressure: Annotated[float, _believed("atmospheric_pressure", "Pa_a", "atmosphere", 1.0e3, 1.0e8)]
    dead_band: BelievedBand


class TorqueRates(NamedTuple):
    """Torque rate with the valve closed [N m/s], and its increase and decrease at full opening [N m/s]."""

    closed: float
    rising: float
    falling: float


NOMINAL_QUANTITIES = quantities_of(NominalChambers)
"""Fields of ``NominalChambers`` in order; each defaults to the value of the device."""


def ellipse_flow(pressure_a: float, pressure_b: float, conductance: float, critical_ratio: float) -> float:
    """Mass flow from a to b [kg/s] by the ellipse of ISO 6358, antisymmetric; conductance C [kg/(s Pa)].

    C P_up sqrt(1 - ((r - b) / (1 - b))^2),    r = P_down / P_up above the critical ratio b, else r = b
    """
    upstream = max(pressure_a, pressure_b)
    ratio = min(pressure_a, pressure_b) / upstream
    position = max(0.0, min(1.0, (ratio - critical_ratio) / (1.0 - critical_ratio)))
    flow = conductance * upstream * math.sqrt(1.0 - position * position)
    return flow if pressure_a >= pressure_b else -flow


def torque_rates(
    nominal: NominalChambers, angle: float, angular_velocity: float, pressure_1: float, pressure_2: float
) -> TorqueRates:
    """Nominal rates of T = K (P_1 - P_2) [N m/s] at an angle [rad], its rate w [rad/s] and absolute pressures [Pa].

    Equations (2) to (9), with the volumes V = V_dead + B (angle from the stop) and the flows m_1 and m_2 into them:

        dT/dt = K (R T_gas / M) (m_1 / V_1 - m_2 / V_2) - K B w (P_1 / V_1 + P_2 / V_2)

    Opening the valve raises or lowers the torque as intended only where both pressures are above the atmosphere,
    because the nominal supplies let no gas flow back.
    """
    # A measured angle beyond a stop must not make a believed volume 0 or less.
    least = min(nominal.dead_volume_1, nominal.dead_volume_2)
    volume_1 = chamber_1_volume(angle, nominal.angle_min, nominal.displacement_per_radian, nominal.dead_volume_1)
    volume_2 = chamber_2_volume(angle, nominal.angle_max, nominal.displacement_per_radian, nominal.dead_volume_2)
    volume_1 = max(volume_1, least)
    volume_2 = max(volume_2, least)
    ratio = nominal.critical_ratio
    valve = nominal.valve_conductance
    leak = ellipse_flow(pressure_1, pressure_2, nominal.leak_conductance, ratio)
    # A check valve: gas does not go back into a supply that has less.
    feed_1 = max(ellipse_flow(nominal.supply_pressure, pressure_1, valve, ratio), 0.0)
    vent_2 = ellipse_flow(pressure_2, nominal.atmospheric_pressure, valve, ratio)
    feed_2 = max(ellipse_flow(nominal.dorsiflexion_pressure, pressure_2, valve, ratio), 0.0)
    vent_1 = ellipse_flow(pressure_1, nominal.atmospheric_pressure, valve, ratio)
    per_flow = nominal.torque_constant * nominal.gas_product
    swept = nominal.torque_constant * nominal.displacement_per_radian * angular_velocity
    closed = -per_flow * leak * (1.0 / volume_1 + 1.0 / volume_2)
    closed = closed - swept * (pressure_1 / volume_1 + pressure_2 / volume_2)
    rising = per_flow * (feed_1 / volume_1 + vent_2 / volume_2)
    falling = per_flow * (vent_1 / volume_1 + feed_2 / volume_2)
    return TorqueRates(closed, rising, falling)


def opening_for_rate(rates: TorqueRates, requested: float) -> float:
    """Opening from -1 to 1 for a requested torque rate [N m/s]: inverse of ``torque_rates``, limited to -1 and 1."""
    needed = requested - rates.closed
    gain = rates.rising if needed >= 0.0 else rates.falling
    # Where full opening moves the torque hardly at all, the quotient is limited, not the command's sign.
    return max(-1.0, min(1.0, needed / max(gain, SMALLEST_GAIN)))


class _PidFeedforwardParameters(NamedTuple):
    """Gains of the feedback, weight of the feed-forward [-], and the nominal device."""

    feedback: PidGains
    feedforward: float
    nominal: NominalChambers


class _PidFeedforwardState(NamedTuple):
    """State of the PID, and the reference at the previous sample [N m]."""

    feedback: PidState = PidState()
    reference: float = 0.0


def feedforward_update(
    parameters: _PidFeedforwardParameters,
    state: _PidFeedforwardState,
    reference: float,
    measurement: Measurement,
    period: float,
) -> tuple[float, _PidFeedforwardState]:
    """Command from -1 to 1: PID on the torque error [N m], equation (13), plus feed-forward of the reference rate."""
    rate = (reference - state.reference) / period * state.feedback.started
    # Along the reference, with the other chamber vented, not at the measured state: the feed-forward must not see the
    # noise.
    nominal = parameters.nominal
    ambient = nominal.atmospheric_pressure
    above = reference / nominal.torque_constant
    pressure_1 = min(ambient + max(above, 0.0), NEARLY_SUPPLY * nominal.supply_pressure)
    pressure_2 = min(ambient + max(-above, 0.0), NEARLY_SUPPLY * nominal.dorsiflexion_pressure)
    rates = torque_rates(nominal, measurement.angle, 0.0, pressure_1, pressure_2)
    ahead = parameters.feedforward * opening_for_rate(rates, rate)
    error = reference - measurement.torque
    opening, feedback = pid_command(parameters.feedback, state.feedback, error, ahead, period)
    command = beyond_dead_band(opening, nominal.dead_band)
    return command, _PidFeedforwardState(feedback, reference)


PID_FEEDFORWARD = ControllerKind(
    name="pid_feedforward",
    summary="PID on the torque error, with feed-forward from a valve model along the reference.",
    source="the paper, equation (13), with the inverse of equations (2) to (9); Åström and Hägglund 2006, Advanced PID",
    quantities=(
        *quantities_of(PidGains),
        Quantity("feedforward", "", "weight of the feed-forward, 0 for none", 1.0, 0.0, 2.0),
        *NOMINAL_QUANTITIES,
    ),
    parameters=_PidFeedforwardParameters,
    initial=_PidFeedforwardState(),
    update=feedforward_update,
)


class _FeedbackLinearisationParameters(NamedTuple):
    """Decay rate of the error [1/s], time constant of the velocity filter [s], and the nominal device."""

    convergence_rate: Annotated[
        float, Number("1/s", "rate at which the torque error decays", None, 0.0, 1.0e6, follows=convergence_rate)
    ]
    # Of the angle sensor and not of the device: some samples at 1 kHz, short against any valve.
    rate_filter: Annotated[float, Number("s", "time constant of the filter on the angle's rate", 0.0018, 0.0, 10.0)]
    nominal: NominalChambers


class FeedbackLinearisationState(NamedTuple):
    """Previous reference [N m] and angle [rad], filtered angular velocity [rad/s], and 1 after the first sample."""

    reference: float = 0.0
    angle: float = 0.0
    angular_velocity: float = 0.0
    started: float = 0.0


def linearising_update(
    parameters: _FeedbackLinearisationParameters,
    state: FeedbackLinearisationState,
    reference: float,
    measurement: Measurement,
    period: float,
) -> tuple[float, FeedbackLinearisationState]:
    """Command for a nominal torque rate r' + convergence_rate (r - torque) [N m/s], with the reference r [N m]."""
    reference_rate = (reference - state.reference) / period * state.started
    turned = (measurement.angle - state.angle) * state.started
    velocity = state.angular_velocity
    # Implicit first-order filter of the angle's difference.
    velocity = velocity + (turned - period * velocity) / (period + parameters.rate_filter)
    rates = torque_rates(
        parameters.nominal, measurement.angle, velocity, measurement.pressure_1, measurement.pressure_2
    )
    requested = reference_rate + parameters.convergence_rate * (reference - measurement.torque)
    command = beyond_dead_band(opening_for_rate(rates, requested), parameters.nominal.dead_band)
    return command, FeedbackLinearisationState(
        reference=reference, angle=measurement.angle, angular_velocity=velocity, started=1.0
    )


def linearising_restart(
    state: FeedbackLinearisationState, requested: float, continues: float
) -> FeedbackLinearisationState:
    """Return the state; at a new task (``continues`` 0) the requested torque [N m] becomes the previous reference."""
    return state._replace(reference=state.reference if continues > 0.5 else requested)


FEEDBACK_LINEARISATION = ControllerKind(
    name="feedback_linearisation",
    summary="Chamber dynamics inverted at the measured pressures and angle: the torque error decays at a chosen rate.",
    source="Slotine and Li 1991, Applied Nonlinear Control, chapter 6; on pneumatic actuators Richer and Hurmuzlu 2000",
    quantities=quantities_of(_FeedbackLinearisationParameters),
    parameters=_FeedbackLinearisationParameters,
    initial=FeedbackLinearisationState(),
    update=linearising_update,
    restart=linearising_restart,
)
