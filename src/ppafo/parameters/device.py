"""Device in SI units, as immutable data classes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Protocol

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.errors import ParameterError
from ppafo.model.actuators.vane import SMALLEST_VOLUME
from ppafo.model.catalog import ACTUATORS, VALVES
from ppafo.model.columns import first, larger, smaller
from ppafo.model.declaration import Number
from ppafo.model.gas import specific_gas_constant
from ppafo.parameters.graph import SAME_PRESSURE, Graph
from ppafo.parameters.joint import ANKLE, JointNames
from ppafo.units.shown import counted_from, shown_in, shown_text

VANE = "vane"
"""Catalogue name of the paper's actuator."""


class _Holding(Protocol):
    """Section of a device or scenario with numbers of its fields ``HELD`` as attributes."""

    HELD: ClassVar[tuple[str, ...]]


def held_in(section: _Holding, name: str) -> str | None:
    """Return the field of ``HELD`` that contains a number, None if no field does."""
    for field_name in section.HELD:
        holder = getattr(section, field_name)
        if name in holder if isinstance(holder, Mapping) else hasattr(holder, name):
            return field_name
    return None


def held(section: _Holding, name: str) -> Any:
    """Return a number from the fields of ``HELD``, for ``__getattr__``. Raises AttributeError if absent."""
    # A copy asks for names that begin so, and for the fields themselves, before there are any.
    if not name.startswith("_") and name not in section.HELD:
        field_name = held_in(section, name)
        if field_name is not None:
            holder = getattr(section, field_name)
            return holder[name] if isinstance(holder, Mapping) else getattr(holder, name)
    raise AttributeError(f"{type(section).__name__} has no '{name}'")


@dataclass(frozen=True, slots=True)
class Gas:
    """Gas at constant temperature: molar mass [kg/mol], heat capacity ratio [-], temperature [K]."""

    species: str
    molar_mass: Annotated[float, Number("kg/mol", "molar mass", minimum=1e-3, maximum=0.5)]
    heat_capacity_ratio: Annotated[float, Number("", "ratio of heat capacities k", minimum=1.01, maximum=1.67)]
    temperature: Annotated[float, Number("K", "gas temperature, constant", minimum=150.0, maximum=600.0)]

    @property
    def specific_gas_constant(self) -> float:
        """Specific gas constant R/M [J/(kg K)]; equation (3)."""
        return specific_gas_constant(UNIVERSAL_GAS_CONSTANT, self.molar_mass)


@dataclass(frozen=True, slots=True)
class Orifice:
    """Orifice in the paper's form: area [m^2], discharge coefficient [-]; equations (6) and (7)."""

    area: Annotated[float, Number("m^2", "area of the opening", minimum=0.0, maximum=1e-2)]
    discharge_coefficient: Annotated[
        float, Number("", "discharge coefficient Cd, flow over A C1 P", minimum=0.0, maximum=2.0, minimum_allowed=False)
    ]


@dataclass(frozen=True, slots=True)
class SonicOrifice:
    """Orifice in the form of ISO 6358: sonic conductance [m^3/(s Pa)], critical pressure ratio [-]."""

    sonic_conductance: Annotated[
        float, Number("m^3/(s Pa)", "sonic conductance C of ISO 6358", minimum=0.0, maximum=1e-4)
    ]
    critical_ratio: Annotated[float, Number("", "critical pressure ratio b of ISO 6358", minimum=0.0, maximum=0.95)]


@dataclass(frozen=True, slots=True)
class Actuator:
    """Actuator between two stops; chamber 1 grows with the angle. Equations (2), (4), (5).

    torque_constant [m^3], displacement_per_radian [m^3/rad], angle_min and angle_max [rad], dead_volume_1 and
    dead_volume_2 [m^3], restitution of the stops [-], leak between the chambers. ``kind`` is the name in the catalogue
    of actuators. For kinds other than the vane, ``settings`` are the complete settings [SI], and torque_constant and
    displacement_per_radian are means over the angle range. ``table`` is the ``model.actuators.table.Table`` of a
    measured actuator.
    """

    torque_constant: float
    displacement_per_radian: float
    angle_min: Annotated[float, Number("rad", "lower stop, where chamber 1 is smallest", minimum=-10.0, maximum=10.0)]
    angle_max: Annotated[float, Number("rad", "upper stop, where chamber 1 is largest", minimum=-10.0, maximum=10.0)]
    dead_volume_1: Annotated[
        float,
        Number(
            "m^3", "line and clearance of chamber 1, added to its swept or tabulated volume", None, SMALLEST_VOLUME, 1.0
        ),
    ]
    dead_volume_2: Annotated[
        float,
        Number(
            "m^3", "line and clearance of chamber 2, added to its swept or tabulated volume", None, SMALLEST_VOLUME, 1.0
        ),
    ]
    restitution: float
    leak: Orifice | SonicOrifice
    kind: str = VANE
    settings: Mapping[str, float] = field(default_factory=dict)
    table: Any = None
    HELD: ClassVar[tuple[str, ...]] = ("settings",)

    def __getattr__(self, name: str) -> Any:
        """Return a setting by its name."""
        return held(self, name)

    @property
    def has_one_chamber(self) -> bool:
        """True if chamber 2 consists only of the dead volume at the second port of the valve."""
        return ACTUATORS[self.kind].has_one_chamber(self.table)


@dataclass(frozen=True, slots=True)
class Friction:
    """Friction of the vane: static limit and dynamic torque [N m], viscous damping [N m s/rad]; equations (1), (10)."""

    static_torque: Annotated[float, Number("N m", "maximum friction torque at rest", minimum=0.0, maximum=1e4)]
    dynamic_torque: Annotated[float, Number("N m", "friction torque in motion", minimum=0.0, maximum=1e4)]
    viscous_damping: Annotated[
        float, Number("N m s/rad", "friction torque per angular velocity", minimum=0.0, maximum=1e4)
    ]


@dataclass(frozen=True, slots=True)
class FootPlate:
    """Foot plate: inertia about the ankle [kg m^2], largest gravity torque m g l [N m]; equation (1).

    Above 0, gravity pulls towards 180 deg, as it does the toes; below 0 towards 0 deg, as in an elbow that flexes.
    """

    inertia: Annotated[
        float, Number("kg m^2", "inertia about the ankle", minimum=0.0, maximum=1e3, minimum_allowed=False)
    ]
    gravity_torque: Annotated[
        float, Number("N m", "largest gravity torque about the joint, m g l", minimum=-1e4, maximum=1e4)
    ]


@dataclass(frozen=True, slots=True)
class Supply:
    """Supply pressures of chamber 1 and of chamber 2 (dorsiflexion), and atmospheric pressure, all [Pa absolute].

    ``relieving`` is True if the regulators vent a chamber whose pressure exceeds their set pressure. A supply below the
    atmosphere is a vacuum and takes gas from the chamber.
    """

    pressure: Annotated[float, Number("Pa_a", "regulated pressure to chamber 1", minimum=1e3, maximum=1e8)]
    dorsiflexion_pressure: Annotated[float, Number("Pa_a", "regulated pressure to chamber 2", minimum=1e3, maximum=1e8)]
    atmospheric_pressure: Annotated[
        float, Number("Pa_a", "ambient pressure, the zero of gauge", minimum=1e3, maximum=1e6)
    ]
    relieving: bool = False

    @property
    def has_one_pressure(self) -> bool:
        """True if both regulators are set to the same pressure, so that they change together."""
        # Two texts of one pressure in two units differ in the last bits.
        return math.isclose(self.pressure, self.dorsiflexion_pressure, rel_tol=SAME_PRESSURE)

    @property
    def is_vacuum(self) -> bool:
        """True if a supply is below the atmosphere; in an ensemble the first run decides for all."""
        return min(first(self.pressure), first(self.dorsiflexion_pressure)) < first(self.atmospheric_pressure)

    @property
    def takes_back(self) -> bool:
        """True if gas may flow from a chamber back into its supply."""
        return self.relieving or self.is_vacuum


@dataclass(frozen=True, slots=True)
class Valve:
    """Valve: kind in the catalogue, orifice when fully open, and all settings [SI].

    Settings and orifice numbers are attributes: ``valve.area``, ``valve.dead_band``.
    """

    kind: str
    orifice: Orifice | SonicOrifice
    settings: Mapping[str, float]
    HELD: ClassVar[tuple[str, ...]] = ("settings", "orifice")

    def __getattr__(self, name: str) -> Any:
        """Return a setting or a number of the orifice by its name."""
        return held(self, name)


@dataclass(frozen=True, slots=True)
class Flow:
    """Numerical setting of the flow: pressure ratio [-] above which flow is linear in the ratio, as in ISO 6358."""

    linear_ratio: Annotated[
        float, Number("", "pressure ratio above which flow is linear", minimum=0.99, maximum=0.9999)
    ]


@dataclass(frozen=True, slots=True)
class Device:
    """Complete device with its chosen valve: all hardware data of a run.

    ``effects`` has the settings [SI] of each mentioned effect by name; all other effects are off. ``links`` define the
    numbers that follow others when these are varied. ``joint`` names the turned joint and its movements. ``units`` maps
    each SI unit to the unit used by the author of the parameter set.
    """

    name: str
    gas: Gas
    actuator: Actuator
    friction: Friction
    foot_plate: FootPlate
    supply: Supply
    valve: Valve
    flow: Flow
    valve_name: str
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    links: Graph = field(default_factory=dict, compare=False, repr=False)
    joint: JointNames = ANKLE
    units: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)

    @property
    def shown(self) -> dict[str, str]:
        """Display units of the device by SI unit, and the atmosphere as zero of gauge pressures."""
        return counted_from(self.units, first(self.supply.atmospheric_pressure))

    @property
    def highest_pressures(self) -> tuple[Any, Any]:
        """Highest pressures that the chambers can be filled to [Pa absolute]; a regulator may be set no higher."""
        supplies = (self.supply.pressure, self.supply.dorsiflexion_pressure)
        highest = self.valve.settings
        if VALVES[self.valve.kind].regulation is None:
            return supplies
        return smaller(supplies[0], highest["highest_pressure"]), smaller(supplies[1], highest["highest_pressure"])

    @property
    def lowest_pressure(self) -> Any:
        """Lowest pressure that a supply above the atmosphere lets a chamber fall to [Pa absolute]."""
        room = self.supply.atmospheric_pressure
        settings = self.valve.settings
        return room if VALVES[self.valve.kind].regulation is None else larger(room, settings["lowest_pressure"])

    @property
    def has_torque_constant(self) -> bool:
        """True if the torque is a constant times the pressure difference of the chambers."""
        return ACTUATORS[self.actuator.kind].model.has_torque_constant

    def check_pressurised(self, what: str, remedy: str = "") -> None:
        """Raise ParameterError, with a remedy, if a supply is a vacuum, which ``what`` does not allow."""
        if self.supply.is_vacuum:
            pressures = self.supply.pressure, self.supply.dorsiflexion_pressure
            with shown_in(self.shown):
                plantar, dorsi = (shown_text(float(first(pressure)), "Pa_a", ".4g") for pressure in pressures)
            raise ParameterError(
                f"{what} needs a supply above atmospheric pressure; '{self.name}' has a vacuum: supply.pressure = "
                f"{plantar}, supply.dorsiflexion_pressure = {dorsi}{remedy}"
            )

    def check_torque_constant(self, what: str, remedy: str = "") -> None:
        """Raise ParameterError, with a remedy, if the torque is not proportional to the pressure difference.

        ``what`` names the computation that needs a proportional torque.
        """
        if not self.has_torque_constant:
            raise ParameterError(
                f"{what} needs a torque proportional to the pressure difference, as of a vane; the torque of the "
                f"actuator '{self.actuator.kind}' of '{self.name}' also depends on the angle{remedy}"
            )
