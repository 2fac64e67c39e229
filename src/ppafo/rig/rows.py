"""Groups of numbers that the rig computes with, SI units."""

from typing import NamedTuple


class RigPhysics(NamedTuple):
    """What the rig has beyond the plant, SI units.

    ``virial`` is b [m^3/kg]. A sensor with a follow rate [1/s] of 0 shows the present; a ``supply_rate`` [1/s] of 0 is
    a regulator without droop.
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
    static_per_pressure: float
    dynamic_per_pressure: float
    stribeck_velocity: float
    angle_follow_rate: float
    pressure_follow_rate: float
    chambers_open: float
    ports_open: float


class RigState(NamedTuple):
    """Unknowns of the rig, SI units.

    Vane, gas and energy of chambers and lines, totals since the start [kg], [J], fall of the regulated pressures [Pa],
    and what slow sensors show.
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


class Node(NamedTuple):
    """Gas at one place: absolute pressure [Pa], temperature [K], specific enthalpy [J/kg]."""

    pressure: float
    temperature: float
    enthalpy: float


class Exchange(NamedTuple):
    """Mass flow [kg/s] and the enthalpy that it carries [W], both positive from a to b."""

    mass: float
    energy: float


class Side(NamedTuple):
    """Between valve and one chamber: gas from the source and to the room [kg/s], net enthalpy through the valve [W].

    Then what enters the chamber [kg/s], [W], and the slopes of the line's gas [kg/s], [W] and the heat into it [W].
    """

    supplied_mass: float
    vented_mass: float
    enthalpy_in: float
    into_mass: float
    into_energy: float
    line_mass: float
    line_energy: float
    line_heat: float


class Observables(NamedTuple):
    """What a bench could observe: both nodes, driving torque [N m] and the static limit of friction [N m] now."""

    node_1: Node
    node_2: Node
    torque: float
    static_limit: float
