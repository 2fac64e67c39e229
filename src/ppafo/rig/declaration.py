"""Every value that a preset of the rig can hold: section, name, SI unit, range and meaning."""

from ppafo.model.declaration import Quantity

GAS = (
    Quantity("heat_transfer_coefficient", "W/(m^2 K)", "heat transfer between gas and wall", minimum=0.0, maximum=1e9),
    Quantity(
        "wall_area_per_volume", "1/m", "inner surface of chamber or line over its volume", minimum=0.0, maximum=1e5
    ),
    Quantity(
        "wall_temperature_difference", "K", "wall and room above the set's temperature", minimum=-80.0, maximum=80.0
    ),
    Quantity(
        "supply_temperature_difference", "K", "supplied gas above the set's temperature", minimum=-80.0, maximum=80.0
    ),
    Quantity(
        "real_gas_share", "", "fraction of the gas's second virial coefficient, 0: ideal", minimum=0.0, maximum=1.0
    ),
)
SUPPLY = (
    Quantity("droop", "Pa s/kg", "fall of a regulated pressure per mass flow", minimum=0.0, maximum=1e9),
    Quantity(
        "recovery_time",
        "s",
        "time constant with which the regulated pressure falls and recovers",
        minimum=0.0,
        maximum=10.0,
    ),
)
LINE = (
    Quantity("volume", "m^3", "volume of each line, a part of the dead volume, 0 for none", minimum=0.0, maximum=1e-2),
    Quantity(
        "area",
        "m^2",
        "area of an orifice between line and chamber with the same pressure loss",
        minimum=0.0,
        maximum=1e-2,
    ),
    Quantity("discharge_coefficient", "", "discharge coefficient of that orifice", minimum=0.0, maximum=2.0),
    Quantity("delay", "s", "time that a wave needs through the line, added to the command", minimum=0.0, maximum=0.1),
)
VALVE = (
    Quantity("hysteresis", "", "play between command and spool, whole width", minimum=0.0, maximum=0.5),
    Quantity("dead_band", "", "proportional: smallest command that opens the valve", minimum=0.0, maximum=0.9),
    Quantity("delay", "s", "proportional: dead time between command and spool", minimum=0.0, maximum=0.2),
    Quantity(
        "spool_frequency", "Hz", "proportional: undamped frequency of the spool, 0 for none", minimum=0.0, maximum=2e3
    ),
    Quantity("spool_damping_ratio", "", "proportional: damping ratio of the spool", minimum=0.05, maximum=5.0),
    Quantity("opening_delay", "s", "solenoid: time from energising to flow from the source", minimum=0.0, maximum=0.2),
    Quantity("closing_delay", "s", "solenoid: time from de-energising to venting", minimum=0.0, maximum=0.2),
)
FRICTION = (
    Quantity(
        "static_per_pressure", "m^3", "static limit per pressure difference across the vane", minimum=0.0, maximum=1e-2
    ),
    Quantity("dynamic_per_pressure", "m^3", "dynamic friction per pressure difference", minimum=0.0, maximum=1e-2),
    Quantity(
        "stribeck_velocity", "rad/s", "speed over which friction falls to its dynamic value", minimum=0.0, maximum=1e2
    ),
    Quantity("scatter", "", "standard deviation of the static limit from reading to reading", minimum=0.0, maximum=0.5),
)
LEAK = (
    Quantity("conductance_factor", "", "leak of the device times this", minimum=0.0, maximum=1e3),
    Quantity(
        "laminar_conductance",
        "kg/(s Pa^2)",
        "further leak per difference of squared pressures",
        minimum=0.0,
        maximum=1e-8,
    ),
)
SAMPLING = (Quantity("rate", "Hz", "samples recorded per second", minimum=1.0, maximum=1e5),)


def _sensor(unit: str, what: str) -> tuple[Quantity, ...]:
    return (
        Quantity("noise", unit, f"standard deviation of the noise of the {what}", minimum=0.0),
        Quantity("offset", unit, f"standard deviation of the offset of the {what}, drawn once", minimum=0.0),
        Quantity("quantum", unit, f"step of the {what}, 0 for none", minimum=0.0),
    )


def _quick_sensor(unit: str, what: str) -> tuple[Quantity, ...]:
    bandwidth = Quantity(
        "bandwidth", "Hz", f"first-order bandwidth of the {what}, 0 for none", minimum=0.0, maximum=1e5
    )
    return (bandwidth, *_sensor(unit, what))


SECTIONS: dict[str, tuple[Quantity, ...]] = {
    "gas": GAS,
    "supply": SUPPLY,
    "line": LINE,
    "valve": VALVE,
    "friction": FRICTION,
    "leak": LEAK,
    "sampling": SAMPLING,
    "angle_sensor": _quick_sensor("rad", "angle sensor"),
    "pressure_sensor": _quick_sensor("Pa_d", "pressure sensors"),
    "torque_sensor": _sensor("N m", "scale"),
    "flow_sensor": _sensor("kg/s", "flow meter"),
}
"""All values are needed in every preset: what is off says so with a 0 and a reason."""

PATHS: dict[str, Quantity] = {
    f"{section}.{quantity.name}": quantity for section, members in SECTIONS.items() for quantity in members
}
