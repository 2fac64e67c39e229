"""A law that holds an angle: it asks for the torque that the joint needs, and opens the valve for that torque."""

from typing import Annotated, NamedTuple

from ppafo.control.angle_loop import ANGLE_DAMPING, ANGLE_STIFFNESS, FRICTION, GRAVITY, INERTIA, INNER_GAIN, RATE_FILTER
from ppafo.control.kind import ControllerKind
from ppafo.model.controlled import ANGLE
from ppafo.model.declaration import Number, quantities_of
from ppafo.model.plant import gravity_torque
from ppafo.model.sensors import Measurement


class CascadeParameters(NamedTuple):
    """Torque per error of the angle [N m/rad], per its rate [N m s/rad] and integral [N m/(rad s)], and the inner gain.

    ``rate_filter`` [s] smooths the measured rate, ``torque_gain`` [1/(N m)] opens the valve, ``gravity_torque`` and
    ``friction_torque`` [N m] are the largest gravity torque and the friction in motion that the law makes up for.
    """

    error_limit: Annotated[
        float, Number("rad", "angle error that the law acts on at most: far away it goes at a speed", 0.1, 1.0e-4, 10.0)
    ]
    angle_stiffness: Annotated[
        float, Number("N m/rad", "torque per angle error", None, 0.0, 1.0e6, follows=(ANGLE_STIFFNESS,))
    ]
    angle_damping: Annotated[
        float, Number("N m s/rad", "torque per rate of the angle error", None, 0.0, 1.0e6, follows=(ANGLE_DAMPING,))
    ]
    angle_integral: Annotated[
        float, Number("N m/(rad s)", "torque per integral of the angle error; friction makes it cycle", 0.0, 0.0, 1.0e6)
    ]
    rate_filter: Annotated[
        float, Number("s", "time constant of the filter on the angle's rate", None, 0.0, 10.0, follows=(RATE_FILTER,))
    ]
    torque_gain: Annotated[
        float, Number("1/(N m)", "command per torque error", None, 0.0, 1.0e3, follows=(INNER_GAIN,))
    ]
    gravity_torque: Annotated[
        float, Number("N m", "believed largest gravity torque, 0 for none", None, 0.0, 1.0e4, follows=(GRAVITY,))
    ]
    friction_torque: Annotated[
        float, Number("N m", "believed friction in motion, 0 for none", None, 0.0, 1.0e4, follows=(FRICTION,))
    ]
    inertia: Annotated[
        float, Number("kg m^2", "believed inertia about the joint, 0 for none", None, 0.0, 1.0e3, follows=(INERTIA,))
    ]


class CascadeState(NamedTuple):
    """Integral of the torque asked for [N m]; reference and angle one sample ago [rad], and their rates.

    ``quickening`` is the filtered rate of the reference's rate [rad/s^2], ``started`` the number of samples, 2 at most.
    """

    integral: float
    reference: float
    angle: float
    rate: float
    asked: float
    quickening: float
    started: float


SMOOTHING = 8.0
"""How much slower the filter on the reference's acceleration is than the one on the measured rate: it may jump."""
SLOW = 0.05
"""rad/s: rate of the reference from which on all of the friction is made up for."""


def cascade_update(
    parameters: CascadeParameters, state: CascadeState, reference: float, measurement: Measurement, period: float
) -> tuple[float, CascadeState]:
    """Command u from -1 to 1 for an angle error e [rad], and the torque T [N m] that the sensors show:

        T_wanted = k_a e + d_a (rate of e) + k_i (integral of e) + gravity + friction,    u = k_p (T_wanted - T)

    The measured rate is a backward difference through a filter of first order. Friction has the sign of the reference's
    rate. The integral stands still while the valve is fully open, where a longer error could not open it further.
    """
    error = reference - measurement.angle
    turned = (measurement.angle - state.angle) * min(state.started, 1.0)
    rate = state.rate + (turned - period * state.rate) / (period + parameters.rate_filter)
    asked = (reference - state.reference) / period * min(state.started, 1.0)
    # A rate of the reference has one before it from the third sample on.
    jerk = ((asked - state.asked) * max(state.started - 1.0, 0.0) - period * state.quickening) / (
        period + SMOOTHING * parameters.rate_filter
    )
    quickening = state.quickening + jerk
    integral = state.integral + parameters.angle_integral * error * period
    against = gravity_torque(measurement.angle, parameters.gravity_torque)
    against += parameters.inertia * quickening + parameters.friction_torque * max(-1.0, min(1.0, asked / SLOW))
    acting = max(-parameters.error_limit, min(parameters.error_limit, error))
    wanted = parameters.angle_stiffness * acting + parameters.angle_damping * (asked - rate) + integral + against
    unlimited = parameters.torque_gain * (wanted - measurement.torque)
    command = max(-1.0, min(1.0, unlimited))
    return command, CascadeState(
        integral=integral if command == unlimited else state.integral,
        reference=reference,
        angle=measurement.angle,
        rate=rate,
        asked=asked,
        quickening=quickening,
        started=min(state.started + 1.0, 2.0),
    )


CASCADE = ControllerKind(
    name="cascade",
    summary="Holds an angle: a torque in proportion to the angle error and its rate, made by an inner torque loop.",
    source="cascade of a position and a pressure loop: Bone and Ning 2007; gains by Skogestad 2003",
    quantities=quantities_of(CascadeParameters),
    parameters=CascadeParameters,
    initial=CascadeState(integral=0.0, reference=0.0, angle=0.0, rate=0.0, asked=0.0, quickening=0.0, started=0.0),
    update=cascade_update,
    controls=(ANGLE,),
)
