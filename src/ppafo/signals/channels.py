"""The channels that the package knows by name: SI unit, meaning, and how to read between two samples."""

from dataclasses import dataclass
from typing import Literal, get_args

TIME = "time"
TIME_UNIT = "s"
PLAIN_NUMBER = "-"

Between = Literal["hold", "linear"]
"""What a channel does between two samples: it keeps the earlier value, or runs straight from one to the other."""
BETWEEN: tuple[Between, ...] = get_args(Between)


@dataclass(frozen=True, slots=True)
class ChannelKind:
    """A known channel; a held one keeps its value until the next sample, the others run straight to it.

    So it is where a recording does not declare otherwise.
    """

    unit: str
    summary: str
    is_held: bool = False


CHANNELS: dict[str, ChannelKind] = {
    "angle": ChannelKind("rad", "ankle angle, growing in plantarflexion"),
    "angular_velocity": ChannelKind("rad/s", "ankle angular velocity"),
    "pressure_1": ChannelKind("Pa", "absolute pressure in chamber 1, the one that grows with the angle"),
    "pressure_2": ChannelKind("Pa", "absolute pressure in chamber 2"),
    "torque": ChannelKind("N m", "actuator torque, positive in plantarflexion"),
    "reference": ChannelKind("N m", "torque requested of the controller"),
    "command": ChannelKind(PLAIN_NUMBER, "command to the valve, from -1 to 1; 2 vents both chambers", is_held=True),
    "supplied_mass": ChannelKind("kg", "gas taken from the supply since the start"),
    "vented_mass": ChannelKind("kg", "gas vented to the atmosphere since the start"),
    "leaked_mass": ChannelKind(
        "kg", "gas from chamber to chamber, leaked or through a valve, either way, since the start"
    ),
    "external_torque": ChannelKind("N m", "torque on the wearer, T_ex of equation (1)"),
    "shank_angle": ChannelKind("rad", "shank from the vertical, above 0 while the ankle is in front of the knee"),
    "foot_angle": ChannelKind("rad", "foot over the horizontal, above 0 with the toes up"),
    "measured_foot_angle": ChannelKind("rad", "foot of the measured gait over the horizontal at the same instant"),
    "toe_difference": ChannelKind("m", "toes over those of the measured gait at the same instant"),
    "healthy_angle": ChannelKind(
        "rad", "ankle angle of the gait that the wearer would walk, growing in plantarflexion"
    ),
    "device_power": ChannelKind("W", "power that the device gives to the wearer, T_ex times the angular velocity"),
    "swing_knee_torque": ChannelKind(
        "N m", "T_1 of equation (11) in the swing, what moves shank and foot; 0 on the ground"
    ),
    "walking_speed": ChannelKind("m/s", "speed on a course, from length and time of the strides"),
    "stride_frequency": ChannelKind("Hz", "strides per second on a course, 0 in standing"),
    "contact": ChannelKind(PLAIN_NUMBER, "foot and ground: 0 free, 1 on the heel, 2 flat, 3 on the toes", is_held=True),
    "controller_phase": ChannelKind(
        PLAIN_NUMBER, "phase that the controller sees: 0 swing, 1 landing, 2 mid-stance, 3 push-off", is_held=True
    ),
    "gait_fraction": ChannelKind(
        PLAIN_NUMBER, "fraction of the stride that the controller takes it to be, where it predicts"
    ),
    "gait_event": ChannelKind(
        PLAIN_NUMBER, "last event that it knows of: 0 heel strike, 1 toes on, 2 heel off, 3 toes off", is_held=True
    ),
    "safe_state": ChannelKind(
        PLAIN_NUMBER,
        "0 while the controller helps, 1 lifts the foot only, 2 pauses, 3 has stopped for good",
        is_held=True,
    ),
    "heel_force": ChannelKind("N", "force under the heel as its sensor follows it"),
    "toe_force": ChannelKind("N", "force under the toes as its sensor follows it"),
    "dorsiflexor_moment": ChannelKind("N m", "moment of the muscles that lift the foot, 0 or more"),
    "toe_height": ChannelKind(
        "m", "toes over the ground, against the healthy gait with a flat foot at the same instant"
    ),
    "mass_1": ChannelKind("kg", "gas in chamber 1"),
    "mass_2": ChannelKind("kg", "gas in chamber 2"),
    "temperature_1": ChannelKind("K", "temperature of the gas in chamber 1, of a gas with an energy balance"),
    "temperature_2": ChannelKind("K", "temperature of the gas in chamber 2, of a gas with an energy balance"),
    "gas_energy": ChannelKind("J", "internal energy of the gas in both chambers, of a gas with an energy balance"),
    "supplied_enthalpy": ChannelKind("J", "enthalpy taken from the supply since the start, less what went back"),
    "vented_enthalpy": ChannelKind("J", "enthalpy vented to the atmosphere since the start"),
    "wall_heat": ChannelKind("J", "heat that the walls gave to the gas since the start"),
    "gas_work": ChannelKind("J", "work of the gas in both chambers since the start, pressure times change of volume"),
    "bottle_mass": ChannelKind("kg", "gas in the bottle, liquid and vapour"),
    "liquid_mass": ChannelKind("kg", "liquid in the bottle"),
    "bottle_temperature": ChannelKind("K", "temperature of the content of the bottle"),
    "wall_temperature": ChannelKind("K", "temperature of the wall of the bottle"),
    "bottle_pressure": ChannelKind("Pa", "absolute pressure in the bottle"),
    "line_pressure_1": ChannelKind("Pa", "absolute pressure in the line behind the bottle's regulator"),
    "line_pressure_2": ChannelKind("Pa", "absolute pressure in the dorsiflexion line, behind the second regulator"),
    "regulated_mass": ChannelKind("kg", "gas let through by the bottle's regulator since the start"),
    "supply_pressure": ChannelKind("Pa", "absolute pressure at the inlet of the valve"),
    "dorsiflexion_pressure": ChannelKind("Pa", "absolute pressure at the inlet of the valve for chamber 2"),
    "pressure_difference": ChannelKind("Pa_d", "pressure in chamber 1 minus that in chamber 2"),
    "upstream_pressure": ChannelKind("Pa", "absolute pressure on the side that the gas comes from"),
    "downstream_pressure": ChannelKind("Pa", "absolute pressure on the side that the gas goes to"),
    "mass_flow": ChannelKind("kg/s", "gas through the part on the bench, positive into chamber 1"),
    "direction": ChannelKind(PLAIN_NUMBER, "1 while the pressure rises, -1 while it falls", is_held=True),
    "repetition": ChannelKind(PLAIN_NUMBER, "number of the repetition", is_held=True),
}
"""To add one: one line here. A recording may also have channels that are not listed."""
