"""The plant: all components of one device put together, as floats."""

from typing import NamedTuple

from ppafo.model.chambers import chamber_1_volume, chamber_2_volume
from ppafo.model.columns import Number
from ppafo.model.orifice import FlowCurve
from ppafo.model.places import way_in, way_out
from ppafo.model.ports import BlendedPort, SinglePort
from ppafo.model.vane import actuator_torque, gravity_torque, net_driving_torque


class PlantParameters(NamedTuple):
    """Everything fixed about a device and the bench it stands on, SI units; conductances are Cd A C1 [kg/(s Pa)].

    ``relieving`` is 1 where the supplies take gas back, 0 where they let it in only.
    """

    gas_product: float
    torque_constant: float
    volume_per_angle: float
    angle_min: float
    angle_max: float
    dead_volume_1: float
    dead_volume_2: float
    restitution: float
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
    """Gas with an energy balance: heat capacity ratio [-], and what the walls give, h a (k - 1)/R [kg/(s m^3)].

    ``h`` is the heat transfer coefficient, ``a`` the wall's area over the volume, ``R`` the specific gas constant.
    ``temperature`` is that of the walls and the source [K], at which ``PlantState`` counts the gas.
    """

    heat_capacity_ratio: float
    wall_exchange: float
    temperature: float


class ThermalState(NamedTuple):
    """True masses of the gas in both chambers [kg], where ``PlantState`` counts it at the reference temperature.

    Totals since the start of the run: energy from the supplies, to the atmosphere and from the walls, counted as
    contents of chambers are [kg], and work of the gas on the vane [J].
    """

    mass_1: float
    mass_2: float
    supplied_content: float
    vented_content: float
    heat_content: float
    gas_work: float


class Openings(NamedTuple):
    """Fraction of the valve's full area that joins each chamber to the source and to the atmosphere, each 0 to 1."""

    source_1: float
    vent_1: float
    source_2: float
    vent_2: float


def chamber_volumes(plant: PlantParameters, angle: Number) -> tuple[Number, Number]:
    """Volumes of both chambers [m^3] at an angle [rad]. Equations (4), (5)."""
    volume_1 = chamber_1_volume(angle, plant.angle_min, plant.volume_per_angle, plant.dead_volume_1)
    volume_2 = chamber_2_volume(angle, plant.angle_max, plant.volume_per_angle, plant.dead_volume_2)
    return volume_1, volume_2


def pressures_per_mass(plant: PlantParameters, angle: Number) -> tuple[Number, Number]:
    """Pressures over masses [Pa/kg] of both chambers at an angle [rad], in one division, which costs ten products."""
    volume_1, volume_2 = chamber_volumes(plant, angle)
    per_volumes = plant.gas_product / (volume_1 * volume_2)
    return volume_2 * per_volumes, volume_1 * per_volumes


def chamber_pressures(plant: PlantParameters, angle: Number, mass_1: Number, mass_2: Number) -> tuple[Number, Number]:
    """Absolute pressures of both chambers [Pa]. Equation (3)."""
    per_mass_1, per_mass_2 = pressures_per_mass(plant, angle)
    return mass_1 * per_mass_1, mass_2 * per_mass_2


def driving_torque(plant: PlantParameters, angle: float, pressure_1: float, pressure_2: float) -> float:
    """Torque on the vane before friction and damping [N m], positive in plantarflexion. Equations (1), (2)."""
    actuator = actuator_torque(pressure_1, pressure_2, plant.torque_constant)
    gravity = gravity_torque(angle, plant.gravity_torque)
    return net_driving_torque(actuator, gravity, plant.external_torque)


def single_ports(plant: PlantParameters, opening: float) -> tuple[SinglePort, SinglePort]:
    """Ports of both chambers for a steady opening [-], -1 to 1: above 0 feeds chamber 1 and vents 2. Equation (8)."""
    conductance = abs(opening) * plant.valve_conductance
    fed, vented = way_in(conductance), way_out(conductance)
    feeds_1 = opening >= 0.0
    node_1 = plant.supply_pressure if feeds_1 else plant.atmospheric_pressure
    node_2 = plant.atmospheric_pressure if feeds_1 else plant.dorsiflexion_pressure
    share_1 = 1.0 if feeds_1 else 0.0
    back_1 = plant.relieving if feeds_1 else 1.0
    back_2 = 1.0 if feeds_1 else plant.relieving
    return SinglePort(
        conductance=fed if feeds_1 else vented, node_pressure=node_1, source_fraction=share_1, takes_back=back_1
    ), SinglePort(
        conductance=vented if feeds_1 else fed,
        node_pressure=node_2,
        source_fraction=1.0 - share_1,
        takes_back=back_2,
    )


def blended_ports(plant: PlantParameters, openings: Openings) -> tuple[BlendedPort, BlendedPort]:
    """Ports of both chambers for four openings, which may be means over a step. Equation (8)."""
    full, back = plant.valve_conductance, plant.relieving
    ambient = plant.atmospheric_pressure
    port_1 = BlendedPort(
        source_conductance=way_in(openings.source_1 * full),
        source_pressure=plant.supply_pressure,
        vent_conductance=way_out(openings.vent_1 * full),
        vent_pressure=ambient,
        takes_back=back,
    )
    port_2 = BlendedPort(
        source_conductance=way_in(openings.source_2 * full),
        source_pressure=plant.dorsiflexion_pressure,
        vent_conductance=way_out(openings.vent_2 * full),
        vent_pressure=ambient,
        takes_back=back,
    )
    return port_1, port_2
