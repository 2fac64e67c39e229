"""Stick-slip friction of the vane, equation (10), with the sign that opposes the motion."""


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
