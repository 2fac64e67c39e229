"""Gains of torque controllers, derived from the device: SIMC rules for an integrator with dead time (Skogestad 2003).

A chamber of constant volume integrates the flow of the valve, so that the torque of a device responds to a command u by

    dT/dt = R u(t - theta)

R is the rate at full opening: K q max(P_1 / V_1, P_2 / V_2), with K the torque per pressure, q = R_gas T times the
conductance of the valve, supply pressures P and volumes V. theta is the total dead time: valve, sampling, sensors. With
the closed loop's time constant theta the rules of S. Skogestad, Journal of Process Control 13 (2003) 291, give

    k_p = 1 / (2 R theta),    T_i = 8 theta,    k_d = 0

The parameters of the other laws give the same bandwidth. Where a pressure or an angle is controlled in place of a
torque, R is the rate of that quantity, and its unit replaces N m.
"""

from typing import NamedTuple

LEAST_TORQUE = 1.0e-6
"""Smallest torque change within the dead time [N m] for which gains are computed; smaller ones use the same gains."""
LEAST_RATE = 1.0e-9
"""Smallest rate of a torque or a pressure that is divided by [SI]."""
LARGEST_OPENING = 0.77
"""Opening of the dead-zone law for a slow chamber; the rest of the torque change comes from the falling pressure."""
# Errors at which a dead-zone law opens the valve and closes it again, divided by the torque range [-]. Both are 0.21
# N m and 0.031 N m for the 5 N m that the paper's actuator reaches at 50 psi_g.
DEAD_ZONE_SHARE = 0.042
RELEASE_SHARE = 0.0062
SAMPLES_LATE = 1.5
"""Delay of a sampled command in sample periods: one for the computation, half of one for the zero-order hold."""
SHARPNESS = 1.0 / 128.0
"""Opening [-] within which the dead band is crossed: a jump at 0 would let the valve switch back and forth.

SHARPNESS is a power of two, so that laws in fixed point use the same value.
"""


class TorqueLoop(NamedTuple):
    """Torque rate R at full opening [N m/s], dead time theta [s], and the largest rate that the flow allows [N m/s].

    A valve that regulates pressures reaches the largest rate with less than its full opening. Its set pressure then
    runs ahead of the chamber, which delays large changes of the torque by ``ahead`` [s].
    """

    rate: float
    dead_time: float
    largest_rate: float
    ahead: float = 0.0


def beyond_dead_band(opening: float, dead_band: float) -> float:
    """Command u [-] for an opening o from -1 to 1, compensated for a valve dead band d [-]:

        u = (1 - d) o + d min(1, max(-1, o / SHARPNESS))

    Every law with continuous openings ends with this function. With d = 0 the command is the opening.
    """
    return (1.0 - dead_band) * opening + dead_band * max(-1.0, min(1.0, opening / SHARPNESS))


def torque_in_dead_time(loop: TorqueLoop) -> float:
    """Torque change R theta [N m] at full opening within the dead time."""
    return max(loop.rate * loop.dead_time, LEAST_TORQUE)


def proportional_gain(loop: TorqueLoop) -> float:
    """Gain k_p = 1 / (2 R theta) [1/(N m)] of a loop whose torque rises at R [N m/s] after a dead time theta [s]."""
    return 0.5 / torque_in_dead_time(loop)


def integral_rate(loop: TorqueLoop) -> float:
    """Ratio of integral to proportional gain, 1 / T_i = 1 / (8 theta) [1/s], at a dead time theta [s]."""
    return 0.125 / loop.dead_time


def integral_gain(loop: TorqueLoop, proportional: float) -> float:
    """Integral gain k_i = k_p / T_i [1/(N m s)] for a proportional gain k_p [1/(N m)]."""
    return proportional * integral_rate(loop)


def boundary_layer(loop: TorqueLoop) -> float:
    """Half width 2 R theta [N m] of a boundary layer, inside which the gain is k_p."""
    return 2.0 * torque_in_dead_time(loop)


def convergence_rate(loop: TorqueLoop) -> float:
    """Decay rate of an error [1/s]: 1 / (2 theta), which is k_p R."""
    return 0.5 / loop.dead_time


def dead_zone_opening(loop: TorqueLoop, dead_zone: float) -> float:
    """Opening [-] at which the torque does not cross the dead zone [N m] within the dead time."""
    return min(LARGEST_OPENING, dead_zone / torque_in_dead_time(loop))


def whole_reach(reach: float) -> float:
    """Full torque range of an actuator [N m], as a default for settings."""
    return reach


def dead_zone(reach: float) -> float:
    """Error [N m] at which a dead-zone law opens the valve, for the torque range ``reach`` of an actuator [N m]."""
    return DEAD_ZONE_SHARE * reach


def release(reach: float) -> float:
    """Error [N m] at which a dead-zone law closes the valve, for the torque range ``reach`` of an actuator [N m]."""
    return RELEASE_SHARE * reach


def torque_rate(loop: TorqueLoop) -> float:
    """Rate R [N m/s] at which the torque rises with the valve fully open."""
    return loop.rate


def dead_time(loop: TorqueLoop) -> float:
    """Dead time theta [s] from a command to the measured torque."""
    return loop.dead_time
