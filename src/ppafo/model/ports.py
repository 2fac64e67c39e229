"""Ports of the physics at which effects act, each as it is without any: what passes through and nothing more.

The plant calls them where its equations have them. An effect gives a law for a place, and a program with that effect
calls the law instead (``model/effects/kind.py``). A law takes what its place takes, and its own row.
"""


def at_valve(command: float) -> float:
    """Command [-] that the valve follows, from the one that has reached it, -1 to 1, or the one that vents."""
    return command


def opening_time(time: float, is_coil_a: float) -> float:
    """Time [s] from energising a coil to flow, from that of a cold one; 1 for coil A (chamber 1), 0 for coil B."""
    return time


def supply_path(conductance: float) -> float:
    """Conductance [kg/(s Pa)] from a regulated supply to a chamber, from that of the open valve. Equation (8)."""
    return conductance


def exhaust_path(conductance: float) -> float:
    """Conductance [kg/(s Pa)] from a chamber to the atmosphere, from that of the open valve. Equation (8)."""
    return conductance


def leakage_path(conductance: float, pressure_1: float, pressure_2: float) -> float:
    """Conductance [kg/(s Pa)] of the leak between the chambers, from that of its orifice; absolute pressures [Pa]."""
    return conductance


def shown_signals(angle: float, pressure_1: float, pressure_2: float) -> tuple[float, float, float]:
    """Angle [rad] and absolute pressures [Pa] as the sensors of a controller show them, before noise and rounding."""
    return angle, pressure_1, pressure_2


def rebound(angular_velocity: float) -> float:
    """Angular velocity [rad/s] with which the vane leaves a stop, from that with which it meets it: 0, it stays."""
    return 0.0


def friction_at_rest(torque: float, pressure_1: float, pressure_2: float) -> float:
    """Largest friction torque at rest [N m], from that without gas; absolute pressures [Pa]. Equation (10)."""
    return torque


def friction_in_motion(torque: float, angular_velocity: float, pressure_1: float, pressure_2: float) -> float:
    """Size of friction in motion [N m], from the dynamic one; rate [rad/s], absolute pressures [Pa]. Equation (10)."""
    return torque


def gas_density(density: float) -> float:
    """Density [kg/m^3] of the gas in a chamber, from that of an ideal gas at its pressure. Equation (3)."""
    return density


def ideal_density(density: float) -> tuple[float, float]:
    """The inverse of ``gas_density`` [kg/m^3], and how it grows with the density [-]. Equation (3)."""
    return density, 1.0
