"""Equations of the simulated bench in continuous time, as pure functions on floats, compiled as one program.

Beyond the identified model: energy balance of the gas with heat transfer through the walls, real-gas factor, line with
an orifice between valve and chamber, laminar part of the leak, pressure-dependent friction, and sensors of limited
bandwidth.
"""

from typing import NamedTuple

from ppafo.engine.scheme.actuators import VANE_FUNCTIONS
from ppafo.model.effects.seal_friction import SealFriction, dynamic_seal_friction, static_seal_friction
from ppafo.model.effects.second_virial import gas_enthalpy, real_density, real_pressure
from ppafo.model.effects.stribeck import Stribeck, stribeck_friction
from ppafo.model.gas import energy_rate, gas_temperature, heat_from_wall, temperature_flow_factor
from ppafo.model.orifice import ExactOrifice, exact_flow
from ppafo.model.plant import (
    Openings,
    PlantParameters,
    admitted_flow,
    chamber_volumes,
    driving_torque,
    vane_acceleration,
)
from ppafo.model.sensors import follow_rate


class RigPhysics(NamedTuple):
    """Physics of the simulated bench beyond the plant model, in SI units.

    ``virial`` is the second virial coefficient b [m^3/kg]. A follow rate [1/s] of 0 means a sensor without lag; a
    ``supply_rate`` [1/s] of 0 means a regulator without droop.
    """

    gas_constant: float
    heat_capacity: float
    reference_temperature: float
    wall_temperature: float
    supply_temperature: float
    heat_transfer_coefficient: float
    wall_area_per_volume: float
    virial: float
    supply_droop: float
    supply_rate: float
    line_volume: float
    laminar_conductance: float
    seal_friction: SealFriction
    stribeck: Stribeck
    angle_follow_rate: float
    pressure_follow_rate: float
    chambers_open: float
    ports_open: float


class RigNumbers(NamedTuple):
    """Parameters of one run, in the order in which the compiled functions read them."""

    plant: PlantParameters
    rig: RigPhysics
    valve_orifice: ExactOrifice
    leak_orifice: ExactOrifice
    line_orifice: ExactOrifice


class RigState(NamedTuple):
    """Unknowns of the simulated bench, in SI units.

    Angle and velocity of the vane, mass [kg] and internal energy [J] of chambers and lines, totals since the start
    [kg], [J], droop of the regulated pressures [Pa], and the outputs of the sensors after their lag.
    """

    angle: float
    angular_velocity: float
    mass_1: float
    energy_1: float
    mass_2: float
    energy_2: float
    line_mass_1: float
    line_energy_1: float
    line_mass_2: float
    line_energy_2: float
    supplied_mass: float
    vented_mass: float
    leaked_mass: float
    supply_drop_1: float
    supply_drop_2: float
    enthalpy_in: float
    work_done: float
    heat_in: float
    sensor_angle: float
    sensor_pressure_1: float
    sensor_pressure_2: float


class _Node(NamedTuple):
    """Gas state in a volume: absolute pressure [Pa], temperature [K], specific enthalpy [J/kg]."""

    pressure: float
    temperature: float
    enthalpy: float


class Exchange(NamedTuple):
    """Mass flow [kg/s] and enthalpy flow [W], both positive from a to b."""

    mass: float
    energy: float


class _ChamberFlows(NamedTuple):
    """Mass flows [kg/s] and enthalpy flows [W] between the valve and one chamber.

    ``supplied_mass``: mass flow from the source through the valve
    ``vented_mass``: mass flow through the valve to the atmosphere
    ``enthalpy_in``: net enthalpy flow through the valve towards the chamber
    ``into_mass``, ``into_energy``: mass and enthalpy flow into the chamber
    ``line_mass``, ``line_energy``: time derivatives of mass and internal energy of the gas in the line
    ``line_heat``: heat flow from the wall into the gas in the line
    """

    supplied_mass: float
    vented_mass: float
    enthalpy_in: float
    into_mass: float
    into_energy: float
    line_mass: float
    line_energy: float
    line_heat: float


class VaneInputs(NamedTuple):
    """Inputs of the vane equations: angle [rad], prescribed angular velocity [rad/s], torque of a leg [N m].

    ``rate`` is 0 for an unconstrained vane, whose angular velocity is an unknown of the equations.
    """

    angle: float
    rate: float
    added_torque: float


class Inputs(NamedTuple):
    """Inputs of a call of the compiled equations, in array order: valve openings and vane inputs."""

    openings: Openings
    vane: VaneInputs


class Observables(NamedTuple):
    """Observable quantities of the simulated bench.

    ``pressure_1``, ``pressure_2``: chamber pressures [Pa absolute]
    ``torque``: driving torque, with the torque of a leg [N m]
    ``static_limit``: static limit of friction [N m]
    """

    pressure_1: float
    pressure_2: float
    torque: float
    static_limit: float


def gas_node(rig: RigPhysics, mass: float, energy: float, volume: float) -> _Node:
    """Return the gas state from mass [kg], internal energy [J] and volume [m^3]."""
    temperature = gas_temperature(energy, mass, rig.heat_capacity)
    pressure = real_pressure(mass, volume, temperature, rig.gas_constant, rig.virial)
    enthalpy = gas_enthalpy(temperature, mass / volume, rig.gas_constant, rig.heat_capacity, rig.virial)
    return _Node(pressure, temperature, enthalpy)


def ambient_node(rig: RigPhysics, pressure: float, temperature: float) -> _Node:
    """Return the state of gas outside the chambers at an absolute pressure [Pa] and a temperature [K]."""
    density = real_density(pressure, temperature, rig.gas_constant, rig.virial)
    enthalpy = gas_enthalpy(temperature, density, rig.gas_constant, rig.heat_capacity, rig.virial)
    return _Node(pressure, temperature, enthalpy)


def orifice_exchange(
    rig: RigPhysics, a: _Node, b: _Node, fraction: float, orifice: ExactOrifice, is_relieving: float
) -> Exchange:
    """Mass flow [kg/s] and enthalpy flow [W] through an orifice, positive from a to b. Equations (6) to (8).

    ``fraction`` [-] scales the conductance of the orifice. The gas enters at the upstream temperature. ``is_relieving``
    is 1 if gas may flow back into a, else 0.
    """
    flow = admitted_flow(exact_flow(a.pressure, b.pressure, fraction * orifice.conductance, orifice), is_relieving)
    upstream_temperature = a.temperature if flow >= 0.0 else b.temperature
    enthalpy = a.enthalpy if flow >= 0.0 else b.enthalpy
    # The conductance is stated at the temperature of the set; flow goes with one over the root of it.
    flow = flow * temperature_flow_factor(rig.reference_temperature, upstream_temperature)
    return Exchange(flow, flow * enthalpy)


def leak_exchange(rig: RigPhysics, a: _Node, b: _Node, orifice: ExactOrifice) -> Exchange:
    """Leak flow across the vane [kg/s], [W], positive from a to b, through an orifice and a laminar gap."""
    through_orifice = orifice_exchange(rig, a, b, 1.0, orifice, 1.0)
    laminar = rig.laminar_conductance * (a.pressure * a.pressure - b.pressure * b.pressure)
    # Gas brings the enthalpy of where it comes from.
    enthalpy = a.enthalpy if laminar >= 0.0 else b.enthalpy
    return Exchange(through_orifice.mass + laminar, through_orifice.energy + laminar * enthalpy)


def wall_heat(rig: RigPhysics, node: _Node, volume: float) -> float:
    """Heat flow [W] from the wall of a volume [m^3] into the gas."""
    area = rig.wall_area_per_volume * volume
    return heat_from_wall(node.temperature, rig.wall_temperature, rig.heat_transfer_coefficient, area)


def chamber_nodes(plant: PlantParameters, rig: RigPhysics, state: RigState, angle: float) -> tuple[_Node, _Node]:
    """Return the gas state of both chambers at an angle [rad]; ambient air for open chambers."""
    # A number, not a truth value: all that the compiled functions read is a float.
    if rig.chambers_open > 0.5:
        room = ambient_node(rig, plant.atmospheric_pressure, rig.wall_temperature)
        return room, room
    volume_1, volume_2 = chamber_volumes(plant, angle)
    node_1 = gas_node(rig, state.mass_1, state.energy_1, volume_1)
    node_2 = gas_node(rig, state.mass_2, state.energy_2, volume_2)
    return node_1, node_2


def observables(given: RigNumbers, state: RigState, inputs: Inputs) -> Observables:
    """Return the observable quantities of the bench in a state."""
    plant, rig, vane = given.plant, given.rig, inputs.vane
    node_1, node_2 = chamber_nodes(plant, rig, state, vane.angle)
    torque = driving_torque(plant, vane.angle, node_1.pressure, node_2.pressure, parts=VANE_FUNCTIONS)
    return Observables(
        pressure_1=node_1.pressure,
        pressure_2=node_2.pressure,
        torque=torque + vane.added_torque,
        static_limit=static_seal_friction(plant.static_torque, node_1.pressure, node_2.pressure, rig.seal_friction),
    )


def side(
    given: RigNumbers, node: _Node, regulated: float, line_mass: float, line_energy: float, source: float, vent: float
) -> _ChamberFlows:
    """Return the flows [kg/s], [W] between the valve and one chamber.

    ``source`` and ``vent`` are openings of the valve [-], ``regulated`` is the supply pressure [Pa]; ``line_mass`` [kg]
    and ``line_energy`` [J] are mass and internal energy of the gas in the line.
    """
    plant, rig, orifice = given.plant, given.rig, given.valve_orifice
    supply = ambient_node(rig, regulated, rig.supply_temperature)
    room = ambient_node(rig, plant.atmospheric_pressure, rig.wall_temperature)
    # Without a line its port is the chamber itself.
    port = node if rig.line_volume <= 0.0 else gas_node(rig, line_mass, line_energy, rig.line_volume)
    supplied = orifice_exchange(rig, supply, port, rig.ports_open * source, orifice, plant.relieving)
    vented = orifice_exchange(rig, port, room, rig.ports_open * vent, orifice, 1.0)
    mass, energy = supplied.mass - vented.mass, supplied.energy - vented.energy
    into = Exchange(mass, energy)
    if rig.line_volume > 0.0:
        into = orifice_exchange(rig, port, node, 1.0, given.line_orifice, 1.0)
    # Without a line its gas keeps its 0 kg: all that the valve passes enters the chamber, and there is no wall.
    heat = wall_heat(rig, port, rig.line_volume)
    return _ChamberFlows(
        supplied_mass=supplied.mass,
        vented_mass=vented.mass,
        enthalpy_in=energy,
        into_mass=into.mass,
        into_energy=into.energy,
        line_mass=mass - into.mass,
        line_energy=energy_rate(energy - into.energy, port.pressure, 0.0, heat),
        line_heat=heat,
    )


def rig_rates(given: RigNumbers, state: RigState, inputs: Inputs, direction: float) -> RigState:
    """Time derivatives of all unknowns [SI].

    ``direction`` is the sliding direction of the vane, 0 if the vane is stuck or prescribed. Equations (1), (10):
    kinetic friction, with the Stribeck increase near standstill.
    """
    plant, rig, speed = given.plant, given.rig, state.angular_velocity
    openings, angle = inputs.openings, inputs.vane.angle
    node_1, node_2 = chamber_nodes(plant, rig, state, angle)
    volume_1, volume_2 = chamber_volumes(plant, angle)
    regulated_1 = plant.supply_pressure - state.supply_drop_1
    regulated_2 = plant.dorsiflexion_pressure - state.supply_drop_2
    side_1 = side(
        given, node_1, regulated_1, state.line_mass_1, state.line_energy_1, openings.source_1, openings.vent_1
    )
    side_2 = side(
        given, node_2, regulated_2, state.line_mass_2, state.line_energy_2, openings.source_2, openings.vent_2
    )
    leak = leak_exchange(rig, node_1, node_2, given.leak_orifice)
    torque = driving_torque(plant, angle, node_1.pressure, node_2.pressure, parts=VANE_FUNCTIONS)
    torque = torque + inputs.vane.added_torque
    pressed = dynamic_seal_friction(plant.dynamic_torque, speed, node_1.pressure, node_2.pressure, rig.seal_friction)
    friction = direction * stribeck_friction(pressed, speed, node_1.pressure, node_2.pressure, rig.stribeck)
    acceleration = vane_acceleration(torque, friction, plant.viscous_damping, plant.inertia, angle, speed)
    grows = plant.displacement_per_radian * (speed if direction != 0.0 else inputs.vane.rate)
    heat_1, heat_2 = wall_heat(rig, node_1, volume_1), wall_heat(rig, node_2, volume_2)
    # Chambers that are open to the room take part in nothing, and their gas stays as it was.
    gas = 1.0 - rig.chambers_open
    return RigState(
        angle=speed if direction != 0.0 else 0.0,
        angular_velocity=acceleration if direction != 0.0 else 0.0,
        mass_1=gas * (side_1.into_mass - leak.mass),
        energy_1=gas * energy_rate(side_1.into_energy - leak.energy, node_1.pressure, grows, heat_1),
        mass_2=gas * (side_2.into_mass + leak.mass),
        energy_2=gas * energy_rate(side_2.into_energy + leak.energy, node_2.pressure, -grows, heat_2),
        line_mass_1=gas * side_1.line_mass,
        line_energy_1=gas * side_1.line_energy,
        line_mass_2=gas * side_2.line_mass,
        line_energy_2=gas * side_2.line_energy,
        supplied_mass=gas * (side_1.supplied_mass + side_2.supplied_mass),
        vented_mass=gas * (side_1.vented_mass + side_2.vented_mass),
        leaked_mass=gas * leak.mass,
        supply_drop_1=rig.supply_rate * (rig.supply_droop * side_1.supplied_mass - state.supply_drop_1),
        supply_drop_2=rig.supply_rate * (rig.supply_droop * side_2.supplied_mass - state.supply_drop_2),
        enthalpy_in=gas * (side_1.enthalpy_in + side_2.enthalpy_in),
        work_done=gas * grows * (node_1.pressure - node_2.pressure),
        heat_in=gas * (heat_1 + heat_2 + side_1.line_heat + side_2.line_heat),
        sensor_angle=follow_rate(rig.angle_follow_rate, state.sensor_angle, angle),
        sensor_pressure_1=follow_rate(rig.pressure_follow_rate, state.sensor_pressure_1, node_1.pressure),
        sensor_pressure_2=follow_rate(rig.pressure_follow_rate, state.sensor_pressure_2, node_2.pressure),
    )
