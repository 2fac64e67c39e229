"""Plant: vane, chambers and the ports of a valve, composed as functions of floats.

First the structs of a device's parameters and of its state. Then the vane with its foot plate, equations (1), (2) and
(10): torques, stick-slip friction, acceleration. Then the two chambers, equations (3) to (5): volume, pressure and
mass.

Last the connections of a chamber during one step, equation (8), for a steady or a changing valve. A ``SinglePort``
connects a chamber to one node, source or atmosphere. A ``BlendedPort`` connects the chamber to both, each with the mean
opening over the step, for a valve that moves or switches within a step. Flows are positive into the chamber; the
engine is composed with the function of one kind of port. A source does not take gas back, unless its
regulator is a relieving one: a flow back into a node is multiplied by ``is_relieving``, 1 for the atmosphere and for a
relieving supply, 0 for a supply with a check valve.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from ppafo.model.columns import Numeric
from ppafo.model.elementary import QUARTER_TURN, TURNS_OF_RADIAN, sine_and_cosine_of_turns
from ppafo.model.orifice import FlowCurve, orifice_flow
from ppafo.model.ports import exhaust_path, load_torque, supply_path


class PlantParameters(NamedTuple):
    """Constant parameters of a device and its test bench, SI units; conductances are Cd A C1 [kg/(s Pa)].

    ``relieving`` is 1 where the supplies are relieving, 0 where they take no gas back.
    """

    gas_product: float
    torque_constant: float
    displacement_per_radian: float
    angle_min: float
    angle_max: float
    dead_volume_1: float
    dead_volume_2: float
    static_torque: float
    dynamic_torque: float
    viscous_damping: float
    inertia: float
    gravity_torque: float
    external_torque: float
    supply_pressure: float
    dorsiflexion_pressure: float
    atmospheric_pressure: float
    valve_conductance: float
    leak_conductance: float
    valve_curve: FlowCurve
    leak_curve: FlowCurve
    relieving: float


class PlantState(NamedTuple):
    """Angle [rad], angular velocity [rad/s], gas in the chambers [kg]; gas totals [kg] since the start of the run.

    The gas in a chamber is counted at the reference temperature, ``P V M / (R T_0)``: isothermal gas has that mass.
    """

    angle: float
    angular_velocity: float
    mass_1: float
    mass_2: float
    supplied_mass: float
    vented_mass: float
    leaked_mass: float


class ThermalParameters(NamedTuple):
    """Parameters of the energy balance: heat capacity ratio [-], and wall heat transfer h a (k - 1)/R [kg/(s m^3)].

    ``h`` is the heat transfer coefficient, ``a`` the wall area divided by the volume, ``R`` the specific gas constant.
    ``temperature`` [K] of walls and source is the reference temperature of the gas in ``PlantState``.
    """

    heat_capacity_ratio: float
    wall_exchange: float
    temperature: float


class ThermalState(NamedTuple):
    """True masses of the gas in both chambers [kg]; ``PlantState`` has equivalent masses at the reference temperature.

    Totals since the start of the run: energy from the supplies, to the atmosphere and from the walls, expressed as gas
    content [kg], and work of the gas on the vane [J].
    """

    mass_1: float
    mass_2: float
    supplied_content: float
    vented_content: float
    heat_content: float
    gas_work: float


class ActuatorFunctions(NamedTuple):
    """Functions of an actuator, as parts of stepping, measuring and recording; SI units, first argument a plant."""

    chambers: Callable[..., Any]
    """``Chambers`` at an angle and two absolute pressures."""
    pressures: Callable[..., tuple[float, float]]
    """Absolute pressures at an angle for two masses."""
    torque: Callable[..., float]
    """Torque at an angle and two absolute pressures."""
    rest_volumes: Callable[..., tuple[float, float]]
    """Volumes of both chambers at an angle; for compliant chambers at their supply pressures."""
    held_pressures: Callable[..., tuple[float, float]]
    """Absolute pressures of the chambers in a ``HeldChambers`` state."""


class Openings(NamedTuple):
    """Fraction of the valve's full area that joins each chamber to the source and to the atmosphere, each 0 to 1."""

    source_1: float
    vent_1: float
    source_2: float
    vent_2: float


def actuator_torque(pressure_1: Numeric, pressure_2: Numeric, torque_constant: float) -> Numeric:
    """Actuator torque [N m], positive in plantarflexion, of two absolute pressures [Pa]. Equation (2)."""
    return torque_constant * (pressure_1 - pressure_2)


def pressure_for_torque(torque: float, torque_constant: float) -> float:
    """Pressure difference [Pa] of an actuator torque [N m]; the inverse of equation (2)."""
    return torque / actuator_torque(1.0, 0.0, torque_constant)


def joint_torque(plant: PlantParameters, _angle: float, pressure_1: float, pressure_2: float) -> float:
    """Torque of the actuator [N m] at an angle [rad] and two absolute pressures [Pa]. Equation (2).

    For a vane the torque does not depend on the angle.
    """
    return actuator_torque(pressure_1, pressure_2, plant.torque_constant)


def gravity_torque(angle: float, largest_torque: float) -> float:
    """Gravity torque [N m] against the vane for an upright shank; it is subtracted in equation (1).

    The foot plate is level at 90 deg, where gravity pulls the toes down with ``largest_torque`` = m g l, that is in
    plantarflexion, so the value is negative.
    """
    _, cosine = sine_and_cosine_of_turns((angle - QUARTER_TURN) * TURNS_OF_RADIAN)
    return -largest_torque * cosine


def torque_less_loads(torque: float, angle: float) -> float:
    """Torque [N m] minus the load torques at an angle [rad] for a joint at rest. Equation (1)."""
    return torque - load_torque(0.0, angle, 0.0)


def viscous_torque(viscous_damping: float, angular_velocity: float) -> float:
    """Viscous torque [N m] of a damping [N m s/rad] at an angular velocity [rad/s], to be subtracted. Equation (1).

    A step is implicit in it, with its change up to 1 rad/s as the slope.
    """
    return viscous_damping * angular_velocity


def direction_of(value: float) -> float:
    """Sign of a number [-]: 1, -1 or 0."""
    return (1.0 if value > 0.0 else 0.0) - (1.0 if value < 0.0 else 0.0)


def net_torque(
    driving: float, way: float, dynamic_torque: float, viscous_damping: float, angle: float, angular_velocity: float
) -> float:
    """Net torque [N m] that accelerates the joint: equations (1) and (10), defined here only.

    ``driving`` [N m] is the torque minus the loads at rest (``torque_less_loads``). The additional load torque of a
    moving joint is subtracted here, as are friction and viscous torque. ``way`` is the direction of motion, 1 or -1,
    or that in which a joint at rest starts to move, 0 if it does not.
    """
    # Along the motion, because it is subtracted: with the sign of the paper friction would drive the joint.
    friction = way * dynamic_torque
    damping = viscous_torque(viscous_damping, angular_velocity)
    moving = load_torque(0.0, angle, angular_velocity) - load_torque(0.0, angle, 0.0)
    return driving - friction - moving - damping


def holds_still(torque: float, static_torque: float, at_lower_stop: bool, at_upper_stop: bool) -> bool:
    """Return whether a vane at rest stays at rest: static friction or a stop balances the torque [N m]."""
    # Equal torques hold: without friction and torque a resting vane rests.
    within = abs(torque) <= static_torque
    against_stop = (at_lower_stop and torque < 0.0) or (at_upper_stop and torque > 0.0)
    return within or against_stop


def driving_torque(plant: PlantParameters, torque: float, angle: float) -> float:
    """Torque on a vane at rest, before friction [N m], of the actuator's ``torque`` [N m]. Equation (1)."""
    gravity = gravity_torque(angle, plant.gravity_torque)
    return torque_less_loads(torque - gravity - plant.external_torque, angle)


def chamber_1_volume(angle: Numeric, angle_min: float, displacement_per_radian: float, dead_volume: float) -> Numeric:
    """Volume of chamber 1 [m^3], increasing with the angle [rad]; equation (4) with a dead volume and a lower stop."""
    return dead_volume + displacement_per_radian * (angle - angle_min)


def chamber_2_volume(angle: Numeric, angle_max: float, displacement_per_radian: float, dead_volume: float) -> Numeric:
    """Volume of chamber 2 [m^3], decreasing with the angle [rad]; equation (5) with a dead volume and an upper stop."""
    return dead_volume + displacement_per_radian * (angle_max - angle)


def chamber_volumes(plant: PlantParameters, angle: Numeric) -> tuple[Numeric, Numeric]:
    """Volumes of both chambers [m^3] at an angle [rad]. Equations (4), (5)."""
    volume_1 = chamber_1_volume(angle, plant.angle_min, plant.displacement_per_radian, plant.dead_volume_1)
    volume_2 = chamber_2_volume(angle, plant.angle_max, plant.displacement_per_radian, plant.dead_volume_2)
    return volume_1, volume_2


def chamber_mass(pressure: float, volume: Numeric, gas_product: float) -> Numeric:
    """Mass [kg] of gas in ``volume`` [m^3] at an absolute pressure [Pa]; the inverse of equation (3)."""
    return pressure * volume / gas_product


def pressures_per_mass(gas_product: float, volume_1: Numeric, volume_2: Numeric) -> tuple[Numeric, Numeric]:
    """Pressures divided by masses [Pa/kg] of two chambers from their volumes [m^3]. Equation (3)."""
    # One division for both, which costs ten products.
    per_volumes = gas_product / (volume_1 * volume_2)
    return volume_2 * per_volumes, volume_1 * per_volumes


def chamber_pressures(
    plant: PlantParameters, angle: Numeric, mass_1: Numeric, mass_2: Numeric
) -> tuple[Numeric, Numeric]:
    """Absolute pressures of both chambers [Pa]. Equation (3)."""
    volume_1, volume_2 = chamber_volumes(plant, angle)
    per_mass_1, per_mass_2 = pressures_per_mass(plant.gas_product, volume_1, volume_2)
    return mass_1 * per_mass_1, mass_2 * per_mass_2


class SinglePort(NamedTuple):
    """Open path: conductance [kg/(s Pa)], absolute pressure of the node [Pa], and 1 if the node is the source.

    ``is_relieving`` is 1 where gas may flow back into the node, else 0.
    """

    conductance: float
    node_pressure: float
    source_fraction: float
    is_relieving: float


class BlendedPort(NamedTuple):
    """Two open paths: conductances [kg/(s Pa)] to the source and to the atmosphere and their pressures [Pa].

    ``is_relieving`` is 1 where gas may flow back into the source, else 0.
    """

    source_conductance: float
    source_pressure: float
    vent_conductance: float
    vent_pressure: float
    is_relieving: float


def spool_openings(towards_1: float, towards_2: float) -> Openings:
    """Openings [-] of one spool that opens towards chamber 1 or chamber 2, each 0 to 1. Equation (8)."""
    # The spool that opens chamber 1 to the source opens chamber 2 to the atmosphere.
    return Openings(source_1=towards_1, vent_1=towards_2, source_2=towards_2, vent_2=towards_1)


def openings_of(opening: float) -> Openings:
    """Openings [-] of a spool for an opening from -1 to 1 (clipped); positive feeds chamber 1."""
    clipped = max(-1.0, min(1.0, opening))
    return spool_openings(max(clipped, 0.0), max(-clipped, 0.0))


def blended_ports(plant: PlantParameters, openings: Openings) -> tuple[BlendedPort, BlendedPort]:
    """Ports of both chambers for four openings, which may be mean values over a step. Equation (8)."""
    full = plant.valve_conductance
    back = plant.relieving
    ambient = plant.atmospheric_pressure
    return BlendedPort(
        source_conductance=supply_path(openings.source_1 * full),
        source_pressure=plant.supply_pressure,
        vent_conductance=exhaust_path(openings.vent_1 * full),
        vent_pressure=ambient,
        is_relieving=back,
    ), BlendedPort(
        source_conductance=supply_path(openings.source_2 * full),
        source_pressure=plant.dorsiflexion_pressure,
        vent_conductance=exhaust_path(openings.vent_2 * full),
        vent_pressure=ambient,
        is_relieving=back,
    )


def open_path(port: BlendedPort, is_fed: bool) -> SinglePort:
    """Path of a port to the source, or to the atmosphere, where the other one is closed."""
    return SinglePort(
        conductance=port.source_conductance if is_fed else port.vent_conductance,
        node_pressure=port.source_pressure if is_fed else port.vent_pressure,
        source_fraction=1.0 if is_fed else 0.0,
        is_relieving=port.is_relieving if is_fed else 1.0,
    )


def single_ports(plant: PlantParameters, opening: float) -> tuple[SinglePort, SinglePort]:
    """Open paths of ``blended_ports`` for an opening [-], -1 to 1: positive feeds chamber 1 and vents 2."""
    port_1, port_2 = blended_ports(plant, spool_openings(max(opening, 0.0), max(-opening, 0.0)))
    # An opening of exactly 0 has no conductance: which chamber it takes to be fed does not matter.
    return open_path(port_1, opening >= 0.0), open_path(port_2, opening < 0.0)


class PortFlow(NamedTuple):
    """Flow into the chamber [kg/s], and the part of the flow from the source [kg/s]."""

    total: float
    from_source: float


class PortSlopes(NamedTuple):
    """Derivatives of a ``PortFlow`` with respect to the chamber's pressure [kg/(s Pa)]."""

    total: float
    from_source: float


def admitted_flow(flow: float, is_relieving: float) -> float:
    """Flow out of a node [kg/s]; 0 for a backflow into a node that is not relieving. Equation (8)."""
    return max(flow, flow * is_relieving)


def single_port_flow(pressure: float, port: SinglePort, curve: FlowCurve) -> tuple[PortFlow, PortSlopes]:
    """Flow into a chamber at ``pressure`` [Pa absolute] through one open path, and its derivatives. Eqs (6) to (8)."""
    flow, _, slope = orifice_flow(port.node_pressure, pressure, port.conductance, port.is_relieving, curve)
    share = port.source_fraction
    return PortFlow(flow, flow * share), PortSlopes(slope, slope * share)


def blended_port_flow(pressure: float, port: BlendedPort, curve: FlowCurve) -> tuple[PortFlow, PortSlopes]:
    """Flow into a chamber at ``pressure`` [Pa absolute] through two open paths, and its derivatives. Eqs (6) to (8)."""
    source, by_source = single_port_flow(pressure, open_path(port, True), curve)
    vent, by_vent = single_port_flow(pressure, open_path(port, False), curve)
    return PortFlow(source.total + vent.total, source.from_source), PortSlopes(
        by_source.total + by_vent.total, by_source.from_source
    )
