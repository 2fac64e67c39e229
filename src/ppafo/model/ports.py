"""Ports of the physics at which effects act, each as it is without any: what passes through and nothing more.

The plant calls them where its equations have them. An effect gives a law for a port, and a program with that effect
calls the law instead (``model/effects/kind.py``). A law takes what its port takes, and its own parameters.
"""

from ppafo.model.orifice import FlowCurve


def at_valve(command: float) -> float:
    """Command [-] that the valve follows, given the one that has reached it: -1 to 1, or the one that vents."""
    return command


def opening_time(time: float, is_coil_a: float) -> float:
    """Time [s] from energising a coil to flow, given a cold coil's; 1 for coil A (chamber 1), 0 for coil B."""
    return time


def supply_path(conductance: float) -> float:
    """Conductance [kg/(s Pa)] from a regulated supply to a chamber, given the open valve's. Equation (8)."""
    return conductance


def exhaust_path(conductance: float) -> float:
    """Conductance [kg/(s Pa)] from a chamber to the atmosphere, given the open valve's. Equation (8)."""
    return conductance


def leakage_path(conductance: float, pressure_1: float, pressure_2: float, curve: FlowCurve) -> float:
    """Conductance [kg/(s Pa)] of the leak between the chambers, given its orifice's; absolute pressures [Pa].

    The leak then flows as an orifice of this conductance would, with the flow function of ``curve``.
    """
    return conductance


def shown_signals(angle: float, pressure_1: float, pressure_2: float) -> tuple[float, float, float]:
    """Angle [rad] and absolute pressures [Pa] as the sensors of a controller show them, before noise and rounding."""
    return angle, pressure_1, pressure_2


def rebound(angular_velocity: float) -> float:
    """Angular velocity [rad/s] after an impact on a stop, given the velocity before it: 0, the vane stays."""
    return 0.0


def friction_at_rest(torque: float, pressure_1: float, pressure_2: float) -> float:
    """Largest friction torque at rest [N m], given the torque without gas; absolute pressures [Pa]. Equation (10)."""
    return torque


def friction_in_motion(torque: float, angular_velocity: float, pressure_1: float, pressure_2: float) -> float:
    """Size of friction in motion [N m], given the dynamic one; rate [rad/s], absolute pressures [Pa]. Equation (10)."""
    return torque


def load_torque(torque: float, angle: float, rate: float) -> float:
    """Torque [N m] that a load takes from the joint at an angle [rad] and a rate [rad/s]; it is subtracted.

    Given what other loads take, 0 without any. Equation (1). What it takes at a rate of 0 friction may hold, as it does
    the weight of the foot plate; the rest is a drag.
    """
    return torque


def gas_density(density: float) -> float:
    """Density [kg/m^3] of the gas in a chamber, given an ideal gas's at its pressure. Equation (3)."""
    return density


def ideal_density(density: float) -> tuple[float, float]:
    """The inverse of ``gas_density`` [kg/m^3], and how it grows with the density [-]. Equation (3)."""
    return density, 1.0
