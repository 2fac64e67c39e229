"""Torque loop, torque reach and joint of a device, each computed from the numbers of a scenario when it is asked for.

The functions ``set_NAME`` compute the group ``lane.NAME`` from other groups and ``settings``, numbers [SI] by path;
``parts`` is known before any number. Python calls them for a file, a change and each run of a study; an exported
library has them in C, concatenated into one function.
"""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from ppafo.constants import STANDARD_GRAVITY, UNIVERSAL_GAS_CONSTANT
from ppafo.control import angle_loop
from ppafo.control.angle_loop import Joint
from ppafo.control.profiles import TABLE, TabulatedProfile, table_bounds
from ppafo.control.torque_loop import SAMPLES_LATE, TorqueLoop
from ppafo.engine.rows import rebuilt, section_row
from ppafo.model.actuators.kind import Range
from ppafo.model.catalog import ACTUATORS, VALVES
from ppafo.model.columns import first
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.model.declaration import PlainFunction
from ppafo.model.gas import specific_gas_constant
from ppafo.model.orifice import area_conductance, sonic_conductance_mass
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.parameters.plant import valve_settings
from ppafo.simulation.declaration import LOCKED_ANGLE
from ppafo.simulation.mean_chambers import MeanChambers, Surroundings, chambers_of, usual_place
from ppafo.simulation.motion_kind import LawSignals

_TABLES = ("tabulated", "smooth")
LEADING = ("constant", "ramp_hold", "sine", *_TABLES)
"""Kinds of profiles whose extreme angles are known."""
_CHOSEN = {"pressure_1": (1.0, 0.0), "pressure_2": (0.0, 1.0), "pressure_difference": (1.0, 1.0)}
"""Derivatives of a controlled pressure with respect to the pressure of each chamber [-]."""


class Asked(dict[str, Any]):
    """Numbers by path, read by ``present`` when they are asked for; the keys are the paths asked for, in order."""

    def __init__(self, present: Callable[[str], Any]) -> None:
        super().__init__()
        self.present = present

    def __missing__(self, path: str) -> Any:
        self[path] = self.present(path)
        return self[path]


class _Groups:
    """Groups of one run by name, as the functions ``set_NAME`` see them: computed when they are first read."""

    def __init__(self, compute: Callable[[str], Any]) -> None:
        self.compute = compute

    def __getattr__(self, name: str) -> Any:
        return self.compute(name)


@dataclass(frozen=True, slots=True, eq=False)
class LoopParts:
    """Device, signals of the controller and controlled quantity: what decides the loop besides numbers.

    ``controls_torque`` is False for a law of the angle alone, which has the torque loop inside it. ``reads`` are the
    paths of the numbers that each computed group depends on.
    """

    device: Device
    seen: LawSignals
    controlled: str = TORQUE
    controls_torque: bool = True
    reads: dict[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def actuator_settings(self) -> Any:
        """Class of the actuator's settings."""
        return ACTUATORS[self.device.actuator.kind].settings

    @property
    def chambers_at(self) -> PlainFunction:
        """Function for the chambers of the actuator at an angle."""
        return chambers_of(self.device.actuator)

    @property
    def valve_settings(self) -> Any:
        """Class of the valve's settings."""
        return VALVES[self.device.valve.kind].settings

    @property
    def is_pair(self) -> bool:
        """True for a pair of on/off valves."""
        return {"opening_delay", "closing_delay", "switching_interval"}.issubset(self.valve_settings._fields)

    @property
    def follow_time(self) -> PlainFunction:
        """Function for the time [s] that the spool of a proportional valve takes to follow a command."""
        kind = VALVES[self.device.valve.kind]
        return kind.lag or kind.choose(valve_settings(self.device.valve)).command_delay

    @property
    def is_sonic(self) -> bool:
        """True for a valve given by its sonic conductance."""
        return isinstance(self.device.valve.orifice, SonicOrifice)

    @property
    def of_pressure(self) -> tuple[float, float] | None:
        """Derivatives of a controlled pressure with respect to both chambers' pressures; None for a torque or angle."""
        return _CHOSEN.get(self.controlled)

    @property
    def is_slow(self) -> bool:
        """True for a controller that opens the valve in proportion to the error of an angle."""
        return self.controls_torque and self.controlled == ANGLE

    def group(self, name: str, numbers: Mapping[str, float], computed: dict[Any, Any]) -> Any:
        """Return a group from numbers of one run; ``computed`` keeps it for the same numbers."""
        if name in self.reads:
            key = (id(self), name, *(numbers[path] for path in self.reads[name]))
            if key in computed:
                return computed[key]
        settings = Asked(numbers.__getitem__)
        lane = _Groups(lambda other: self.group(other, settings, computed))
        GROUPS[name](self, lane, settings)
        self.reads[name] = tuple(settings)
        return computed.setdefault((id(self), name, *settings.values()), vars(lane)[name])

    def functions(self, groups: Collection[str], present: Callable[[str], Any]) -> list[PlainFunction]:
        """Return the functions that compute some groups, in order of calling."""
        alone = replace(self, reads={})
        alone.note_reads(groups, present, {})
        return [GROUPS[name] for name in alone.reads]

    def note_reads(self, groups: Collection[str], present: Callable[[str], Any], computed: dict[Any, Any]) -> None:
        """Find the paths of the numbers that decide some groups, which those of the first run tell."""
        for name in groups:
            if name not in self.reads:
                self.group(name, Asked(lambda path: first(present(path))), computed)


def set_actuator(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the settings of the actuator."""
    lane.actuator = section_row(parts.actuator_settings, settings, "actuator")


def set_stops(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:  # noqa: ARG001
    """Set stops and dead volumes."""
    lane.stops = section_row(Range, settings, "actuator")


def set_around(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:  # noqa: ARG001
    """Set the pressures around the device."""
    lane.around = Surroundings(
        settings["supply.pressure"], settings["supply.dorsiflexion_pressure"], settings["supply.atmospheric_pressure"]
    )


def set_valve(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the settings of the valve."""
    lane.valve = section_row(parts.valve_settings, settings, "valve")


def set_usual(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:  # noqa: ARG001
    """Set the chambers at the usual angle, for an unknown joint angle."""
    lane.usual = parts.chambers_at(
        lane.actuator, lane.stops, lane.around, usual_place(lane.stops.angle_min, lane.stops.angle_max)
    )


def within(stops: Range, one: float, other: float) -> tuple[float, float]:
    """Two angles [rad], limited to the range between the stops."""
    return between(stops, one), between(stops, other)


def between(stops: Range, angle: float) -> float:
    """Angle [rad], limited to the range between the stops."""
    return float(min(max(angle, stops.angle_min), stops.angle_max))


def set_places(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the two extreme angles of the joint [rad]: where it is locked or its profile leads, else the usual angle."""
    kind = parts.seen.profile
    of_profile = f"{parts.seen.section}."
    if parts.seen.is_locked:
        lane.places = (settings[LOCKED_ANGLE], settings[LOCKED_ANGLE])
    elif kind == "constant":
        lane.places = within(lane.stops, settings[of_profile + "level"], settings[of_profile + "level"])
    elif kind == "ramp_hold":
        lane.places = within(lane.stops, settings[of_profile + "start_level"], settings[of_profile + "level"])
    elif kind == "sine":
        level = settings[of_profile + "level"]
        amplitude = settings[of_profile + "amplitude"]
        lane.places = within(lane.stops, level - amplitude, level + amplitude)
    elif kind in _TABLES:
        # Curves exceed the knots slightly.
        bounds = table_bounds(
            rebuilt(TabulatedProfile, (settings[of_profile + quantity.name] for quantity in TABLE.quantities))
        )
        lane.places = within(lane.stops, bounds[0], bounds[1])
    else:
        place = usual_place(lane.stops.angle_min, lane.stops.angle_max)
        lane.places = (place, place)


def lag_of_sensor(bandwidth: float) -> float:
    """Time constant [s] of a sensor with a bandwidth [Hz]; 0 for bandwidth 0, which means an ideal sensor."""
    return 1.0 / (2.0 * math.pi * bandwidth) if bandwidth > 0.0 else 0.0


def set_late(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the delay of the measurements [s]: transport, which a walk has not, and lag of the slowest sensor."""
    lag = lag_of_sensor(settings["sensors.pressure_bandwidth"])
    if parts.controlled == ANGLE:
        lane.late = settings["sensors.delay"] + max(lag, lag_of_sensor(settings["sensors.angle_bandwidth"]))
    elif parts.seen.in_walk:
        lane.late = lag
    else:
        lane.late = settings["sensors.delay"] + lag


def flow_of_area(molar_mass: float, ratio: float, temperature: float, area: float, discharge: float) -> float:
    """Flow coefficient of an orifice area: R T times its conductance [m^3/s]. Equation (6)."""
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass)
    return constant * temperature * area_conductance(area, discharge, ratio, constant, temperature)


def flow_of_sonic(molar_mass: float, temperature: float, sonic: float) -> float:
    """Flow coefficient of a sonic orifice: R T times its conductance [m^3/s]. ISO 6358-1."""
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass)
    return constant * temperature * sonic_conductance_mass(sonic, constant, temperature)


def set_flow(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the flow coefficient of the valve [m^3/s]."""
    if parts.is_sonic:
        lane.flow = flow_of_sonic(
            settings["gas.molar_mass"], settings["gas.temperature"], settings["valve.sonic_conductance"]
        )
    else:
        lane.flow = flow_of_area(
            settings["gas.molar_mass"],
            settings["gas.heat_capacity_ratio"],
            settings["gas.temperature"],
            settings["valve.area"],
            settings["valve.discharge_coefficient"],
        )


def set_valve_time(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the delay [s] from a sample to the flow: switching delay and wait of a pair; spool, and sample delay."""
    sampled = SAMPLES_LATE * settings["controller.period"]
    if parts.is_pair:
        lane.valve_time = max(lane.valve.opening_delay, lane.valve.closing_delay) + max(
            sampled, lane.valve.switching_interval
        )
    else:
        lane.valve_time = parts.follow_time(lane.valve) + sampled


class _PerPressure(NamedTuple):
    """Derivatives of the controlled quantity with respect to the pressure of each chamber, both positive."""

    one: float
    other: float


def per_flow(mean: MeanChambers, by: _PerPressure, source_1: float, source_2: float) -> float:
    """Larger rate of the controlled quantity for a volume flow from the sources [Pa]: K P / V."""
    return max(by.one * source_1 / mean.volume_1, by.other * source_2 / mean.volume_2)


def by_torque(mean: MeanChambers) -> _PerPressure:
    """Derivatives of the torque with respect to the pressure of each chamber [m^3]."""
    return _PerPressure(mean.torque_per_pressure_1, mean.torque_per_pressure_2)


def set_torque_loop(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:  # noqa: ARG001
    """Set the torque or pressure loop at constant volume: R = K q max(P_1 / V_1, P_2 / V_2), theta.

    R is the larger value of the two extreme joint angles, at which the loop is fastest; theta is the dead time.
    """
    # A chamber at a vacuum is filled from the room, quicker than it is emptied.
    source_1 = max(lane.around.supply_pressure, lane.around.atmospheric_pressure)
    source_2 = max(lane.around.dorsiflexion_pressure, lane.around.atmospheric_pressure)
    here = parts.chambers_at(lane.actuator, lane.stops, lane.around, lane.places[0])
    there = parts.chambers_at(lane.actuator, lane.stops, lane.around, lane.places[1])
    if parts.of_pressure is None:
        quickest = max(
            per_flow(here, by_torque(here), source_1, source_2), per_flow(there, by_torque(there), source_1, source_2)
        )
    else:
        by = _PerPressure(parts.of_pressure[0], parts.of_pressure[1])
        quickest = max(per_flow(here, by, source_1, source_2), per_flow(there, by, source_1, source_2))
    lane.torque_loop = TorqueLoop(lane.flow * quickest, lane.valve_time + lane.late)


def set_reach(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:  # noqa: ARG001
    """Set the largest change of torque [N m] or pressure [Pa] from one supply while the other chamber is vented."""
    gauge_1 = abs(lane.around.supply_pressure - lane.around.atmospheric_pressure)
    gauge_2 = abs(lane.around.dorsiflexion_pressure - lane.around.atmospheric_pressure)
    if parts.of_pressure is None:
        mean = parts.chambers_at(lane.actuator, lane.stops, lane.around, lane.places[0])
        lane.reach = max(mean.torque_per_pressure_1 * gauge_1, mean.torque_per_pressure_2 * gauge_2, 0.0)
    else:
        lane.reach = max(parts.of_pressure[0] * gauge_1, parts.of_pressure[1] * gauge_2, 0.0)


def set_joint(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the joint of a device with its gas at atmospheric pressure, where the gas spring is softest."""
    room = lane.around.atmospheric_pressure
    mean = lane.usual
    inertia = settings["foot_plate.inertia"]
    weight = settings["foot_plate.gravity_torque"]
    if parts.seen.has_leg:
        moment = settings["motion.foot_mass"] * settings["motion.foot_mass_centre"]
        inertia = inertia + settings["motion.foot_inertia"] + moment * settings["motion.foot_mass_centre"]
        weight = weight + moment * STANDARD_GRAVITY
    lane.joint = Joint(
        inertia=inertia,
        stiffness=mean.torque_per_pressure_1 * mean.growth_1 * room / mean.volume_1
        + mean.torque_per_pressure_2 * mean.growth_2 * room / mean.volume_2,
        damping=settings["friction.viscous_damping"],
        friction=settings["friction.dynamic_torque"],
        static_friction=settings["friction.static_torque"],
        travel=0.0 if parts.controls_torque else settings["controller.error_limit"],
        gravity=weight,
        resolution=settings["sensors.angle_resolution"],
        noise=settings["sensors.angle_noise"],
    )


def set_loop(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:  # noqa: ARG001
    """Set the loop that the controller closes."""
    lane.loop = angle_loop.slow_loop(lane.torque_loop, lane.joint) if parts.is_slow else lane.torque_loop


GROUPS: Mapping[str, PlainFunction] = {
    "actuator": set_actuator,
    "stops": set_stops,
    "around": set_around,
    "valve": set_valve,
    "usual": set_usual,
    "places": set_places,
    "late": set_late,
    "flow": set_flow,
    "valve_time": set_valve_time,
    "torque_loop": set_torque_loop,
    "reach": set_reach,
    "joint": set_joint,
    "loop": set_loop,
}
"""Function of each group by the name of the group, which it sets."""
