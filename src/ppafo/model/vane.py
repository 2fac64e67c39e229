"""The vane with the foot plate: torques, stick-slip friction and acceleration. Equations (1), (2) and (10)."""

from ppafo.model.columns import Number

QUARTER_TURN = 1.5707963267948966


def actuator_torque(pressure_1: float, pressure_2: float, torque_constant: float) -> float:
    """Actuator torque [N m], positive in plantarflexion, of two absolute pressures [Pa]. Equation (2)."""
    return torque_constant * (pressure_1 - pressure_2)


def gravity_torque(angle: Number, largest_torque: float) -> Number:
    """Torque [N m] that gravity takes from the vane (it is subtracted in equation (1)), for an upright shank.

    The foot plate is level at 90 deg, where gravity pulls the toes down with ``largest_torque`` = m g l, that is in
    plantarflexion, so the value is negative. The cosine of the slope is a power series, good to 1e-8 within 0 to
    180 deg, because a library cosine cannot run in many lanes at once.
    """
    slope = angle - QUARTER_TURN
    square = slope * slope
    cosine = 1.0 / 479001600.0 * square - 1.0 / 3628800.0
    cosine = cosine * square + 1.0 / 40320.0
    cosine = cosine * square - 1.0 / 720.0
    cosine = cosine * square + 1.0 / 24.0
    cosine = cosine * square - 0.5
    cosine = cosine * square + 1.0
    return -largest_torque * cosine


def net_driving_torque(actuator: float, gravity: float, external: float) -> float:
    """Torque [N m] that drives the vane before friction and damping: actuator less gravity less T_ex. Equation (1)."""
    return actuator - gravity - external


def vane_acceleration(
    driving_torque: float, angular_velocity: float, friction: float, viscous_damping: float, inertia: float
) -> float:
    """Angular acceleration [rad/s^2]; friction [N m] and damping are subtracted. Equation (1)."""
    return (driving_torque - viscous_damping * angular_velocity - friction) / inertia


def sliding_friction(angular_velocity: float, dynamic_torque: float) -> float:
    """Friction torque [N m] of a moving vane, along the angular velocity [rad/s]: it is subtracted. Equation (10).

    The paper prints the opposite sign beside a friction that is subtracted too, which would drive the motion.
    """
    if angular_velocity > 0.0:
        return dynamic_torque
    if angular_velocity < 0.0:
        return -dynamic_torque
    return 0.0


def holds_still(net_torque: float, static_torque: float, at_lower_stop: bool, at_upper_stop: bool) -> bool:
    """True where a vane at rest stays at rest: static friction or a stop balances the net torque [N m]."""
    within = abs(net_torque) <= static_torque
    against_stop = (at_lower_stop and net_torque < 0.0) or (at_upper_stop and net_torque > 0.0)
    return within or against_stop
