"""Ports of the physics at which effects act, each as an identity or a constant without effects.

The plant calls a port at its place in the equations. An effect defines a law for a port, and a program with that effect
calls the law instead (``model/effects/kind.py``). A law takes the arguments of its port, and its own parameters.
"""

from ppafo.model.orifice import FlowCurve


def at_valve(command: float) -> float:
    """Command [-] that the valve follows, given the command at the valve: -1 to 1, or ``VENT``."""
    return command


def sent_command(command: float) -> float:
    """Command [-] that a law sends, given the command to a valve whose opening is its command: -1 to 1, or ``VENT``."""
    return command


def opening_time(time: float, is_coil_a: float) -> float:
    """Time [s] from energising a coil to flow, given a cold coil's; 1 for coil A (chamber 1), 0 for coil B."""
    return time


def supply_path(conductance: float) -> float:
    """Conductance [kg/(s Pa)] from a supply to a chamber, given the open valve's conductance. Equation (8)."""
    return conductance


def exhaust_path(conductance: float) -> float:
    """Conductance [kg/(s Pa)] from a chamber to the atmosphere, given the open valve's conductance. Equation (8)."""
    return conductance


def leakage_path(conductance: float, pressure_1: float, pressure_2: float, curve: FlowCurve) -> float:
    """Conductance [kg/(s Pa)] of the leak between the chambers, given its orifice's; pressures [Pa]. Equation (8).

    The flow is the flow of an orifice with this conductance and the flow function of ``curve``.
    """
    return conductance


def shown_signals(angle: float, pressure_1: float, pressure_2: float) -> tuple[float, float, float]:
    """Readings of a controller's sensors before noise and quantisation: angle [rad] and absolute pressures [Pa]."""
    return angle, pressure_1, pressure_2


def rebound(angular_velocity: float) -> float:
    """Angular velocity [rad/s] after an impact on a stop, given the velocity before: 0 without effects."""
    return 0.0


def friction_at_rest(torque: float, pressure_1: float, pressure_2: float) -> float:
    """Largest friction torque at rest [N m], given the torque without gas; absolute pressures [Pa]. Equation (10)."""
    return torque


def friction_in_motion(torque: float, angular_velocity: float, pressure_1: float, pressure_2: float) -> float:
    """Friction torque in motion [N m], without sign, given the dynamic friction torque [N m]. Equation (10)."""
    return torque


def load_torque(torque: float, angle: float, rate: float) -> float:
    """Load torque [N m] on the joint at an angle [rad] and a rate [rad/s], to be subtracted in equation (1).

    ``torque`` is the torque of other loads, 0 without any. The load at a rate of 0 may be carried by static friction,
    as is the weight of the foot plate; the rest is a drag.
    """
    return torque
