"""Torque loop, torque reach and joint of a device, each computed from the numbers of a scenario when it is asked for.

The functions ``set_NAME`` compute the group ``lane.NAME`` from other groups and ``settings``, numbers [SI] by path;
``parts`` is known before any number. Python calls them for a file, a change and each run of a study; an exported
library has them in C, concatenated into one function.
"""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.constants import STANDARD_GRAVITY, UNIVERSAL_GAS_CONSTANT
from ppafo.control import angle_loop
from ppafo.control.angle_loop import Joint
from ppafo.control.profiles import TABLE, table_bounds
from ppafo.control.torque_loop import LEAST_RATE, SAMPLES_LATE, TorqueLoop
from ppafo.engine.rows import component_row, section_row
from ppafo.model.actuators.kind import Chambers, Range
from ppafo.model.actuators.vane import VaneSettings
from ppafo.model.binding import made_of
from ppafo.model.catalog import ACTUATORS, VALVES
from ppafo.model.columns import first, over_combinations, over_runs
from ppafo.model.controlled import ANGLE, TORQUE
from ppafo.model.declaration import PlainFunction
from ppafo.model.gas import specific_gas_constant
from ppafo.model.orifice import area_conductance, sonic_conductance_mass
from ppafo.parameters.device import VANE, Actuator, Device, SonicOrifice
from ppafo.parameters.graph import Asked, Link
from ppafo.parameters.plant import valve_settings
from ppafo.simulation.declaration import LOCKED_ANGLE
from ppafo.simulation.motion_kind import LawSignals

_TABLES = ("tabulated", "smooth")
_LEADING = ("constant", "ramp_hold", "sine", *_TABLES)
"""Kinds of profiles whose extreme angles are known."""
_OF_PAIR = {"opening_delay", "closing_delay", "switching_interval"}
"""Settings of a pair of on/off valves."""
_OF_PRESSURE = {"pressure_1": (1.0, 0.0), "pressure_2": (0.0, 1.0), "pressure_difference": (1.0, 1.0)}
"""Derivatives of a controlled pressure with respect to the pressure of each chamber [-]."""
RIGHT_ANGLE = 1.5707963267948966
INSIDE = 0.2
"""Smallest distance of the right angle from a stop [rad]."""
LEAST_GAUGE = 1.0
"""Smallest gauge pressure of a supply [Pa], which avoids a division by 0."""
AT_WORK = 0.3
"""Gauge pressure of a chamber of a joint in motion, as a part of its supply's [-]."""


class Surroundings(NamedTuple):
    """Supply pressures of both chambers, and atmospheric pressure [Pa absolute]."""

    supply_pressure: float
    dorsiflexion_pressure: float
    atmospheric_pressure: float


class MeanChambers(NamedTuple):
    """Chamber properties at an angle.

    ``torque_per_pressure`` [m^3] is the torque per pressure of each chamber. ``volume`` [m^3] is the gas content per
    pressure: volume, plus pressure times compliance. ``growth`` [m^3/rad] is the volume displaced per angle.
    """

    torque_per_pressure_1: float
    torque_per_pressure_2: float
    volume_1: float
    volume_2: float
    growth_1: float
    growth_2: float


class _RestingPlant(NamedTuple):
    """Actuator at rest in the layout of ``ShapedPlant``, the argument of an actuator's model functions."""

    shape: Any
    gas_product: float
    supply_pressure: float
    dorsiflexion_pressure: float
    atmospheric_pressure: float
    gravity_torque: float
    external_torque: float


class _MeasuredParts(NamedTuple):
    """Shape of a measured actuator: function ``prepare``, and its third argument, the measured table."""

    prepare: Callable[[Any, Range, Any], Any]
    table: Any


class _ShapedParts(NamedTuple):
    """Functions of an actuator with a shape: shape from settings and stops, both chambers, torque [N m]."""

    shape: Callable[[Any, Range], Any]
    chambers: Callable[[Any, float, float, float], Chambers]
    torque: Callable[[Any, float, float, float], float]


def measured_shape_of(settings: Any, stops: Range, *, parts: _MeasuredParts) -> Any:
    """Shape of an actuator with a measured table."""
    return parts.prepare(settings, stops, parts.table)


def usual_place(lowest: float, highest: float) -> float:
    """Angle [rad] for the gains of a joint of unknown angle: a right angle, or mid-range if that is out of range."""
    has_right_angle = lowest + INSIDE <= RIGHT_ANGLE <= highest - INSIDE
    return RIGHT_ANGLE if has_right_angle else 0.5 * (lowest + highest)


def gauge_of(supply: float, room: float) -> float:
    """Gauge pressure [Pa] of a supply in an atmosphere ``room`` [Pa absolute]: negative for a vacuum, never 0."""
    gauge = supply - room
    return gauge if gauge <= -LEAST_GAUGE else max(gauge, LEAST_GAUGE)


def vane_at(settings: VaneSettings, stops: Range, _around: Surroundings, angle: float) -> MeanChambers:
    """Both chambers of a vane at an angle [rad]. Equations (2), (4), (5)."""
    growth = settings.displacement_per_radian
    return MeanChambers(
        torque_per_pressure_1=settings.torque_constant,
        torque_per_pressure_2=settings.torque_constant,
        volume_1=stops.dead_volume_1 + growth * (angle - stops.angle_min),
        volume_2=stops.dead_volume_2 + growth * (stops.angle_max - angle),
        growth_1=growth,
        growth_2=growth,
    )


def shaped_at(settings: Any, stops: Range, around: Surroundings, angle: float, *, parts: _ShapedParts) -> MeanChambers:
    """Both chambers at an angle [rad] of an actuator with a shape, at half of the supply's gauge pressure."""
    room = around.atmospheric_pressure
    plant = _RestingPlant(
        shape=parts.shape(settings, stops),
        gas_product=1.0,
        supply_pressure=around.supply_pressure,
        dorsiflexion_pressure=around.dorsiflexion_pressure,
        atmospheric_pressure=room,
        gravity_torque=0.0,
        external_torque=0.0,
    )
    gauge_1 = gauge_of(around.supply_pressure, room)
    gauge_2 = gauge_of(around.dorsiflexion_pressure, room)
    half_1 = room + 0.5 * gauge_1
    half_2 = room + 0.5 * gauge_2
    filled = parts.chambers(plant, angle, half_1, half_2)
    vented = parts.torque(plant, angle, room, room)
    # By virtual work a chamber grows with the angle as its torque does with the pressure.
    growth_1 = abs((parts.torque(plant, angle, room + gauge_1, room) - vented) / gauge_1)
    growth_2 = abs((parts.torque(plant, angle, room, room + gauge_2) - vented) / gauge_2)
    return MeanChambers(
        torque_per_pressure_1=growth_1,
        torque_per_pressure_2=growth_2,
        volume_1=filled.volume_1 + half_1 * filled.compliance_1,
        volume_2=filled.volume_2 + half_2 * filled.compliance_2,
        growth_1=growth_1,
        growth_2=growth_2,
    )


def chambers_of(actuator: Actuator) -> PlainFunction:
    """Return the function of an actuator's settings, stops, surroundings and angle [rad] that gives its chambers."""
    if actuator.kind == VANE:
        return vane_at
    model = ACTUATORS[actuator.kind].model
    name = actuator.kind
    shape = (
        made_of(measured_shape_of, f"shape_of_{name}", _MeasuredParts(model.prepare, actuator.table))
        if actuator.table is not None
        else model.prepare
    )
    return made_of(shaped_at, f"chambers_at_of_{name}", _ShapedParts(shape, model.chambers, model.torque))


class _Groups:
    """Groups of one run by name, as the functions ``set_NAME`` see them: computed when they are first read."""

    __slots__ = ("__dict__", "compute")

    def __init__(self, compute: Callable[[str], Any]) -> None:
        self.compute = compute

    def __getattr__(self, name: str) -> Any:
        found = vars(self)[name] = self.compute(name)
        return found


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
    def chambers_at(self) -> PlainFunction:
        """Function for the chambers of the actuator at an angle."""
        return chambers_of(self.device.actuator)

    @property
    def regulates(self) -> bool:
        """True for a valve whose command is a set pressure."""
        return VALVES[self.device.valve.kind].regulation is not None

    @property
    def is_sonic(self) -> bool:
        """True for a valve given by its sonic conductance."""
        return isinstance(self.device.valve.orifice, SonicOrifice)

    def group(self, name: str, settings: Mapping[str, float], kept: dict[str, Any]) -> Any:
        """Return a group from numbers of one run; ``kept`` has the groups of this run that were computed before."""
        if name not in kept:
            asked = settings if name in self.reads else Asked(settings.__getitem__)
            lane = _Groups(lambda other: self.group(other, asked, kept))
            self.function_of(name)(self, lane, asked)
            # Those that it read are there already.
            kept.update(vars(lane))
            if name not in self.reads:
                self.reads.update((each, tuple(asked)) for each in vars(lane) if each not in self.reads)
        elif isinstance(settings, Asked):
            # Whoever asks for a group depends on its numbers.
            for path in self.reads[name]:
                settings[path]
        return kept[name]

    def functions(self, groups: Collection[str], present: Callable[[str], Any]) -> list[PlainFunction]:
        """Return the functions that compute some groups, in order of calling."""
        kept = dict[str, Any]()
        for name in groups:
            self.group(name, Asked(present), kept)
        return list(dict.fromkeys(map(self.function_of, kept)))

    def function_of(self, name: str) -> PlainFunction:
        """Return the function that computes a group."""
        return set_regulated_loop if self.regulates and name == "torque_loop" else GROUPS[name]

    def combinations(
        self, groups: tuple[str, ...], present: Callable[[str], Any]
    ) -> tuple[list[list[Any]], NDArray[np.intp] | None]:
        """Return groups for each combination of numbers, and the index of the combination of each run.

        The index is None if no number is an array (runs,).
        """
        for name in groups:
            if name not in self.reads:
                self.group(name, Asked(lambda path: first(present(path))), {})
        settings = {path: first(present(path)) for name in groups for path in self.reads[name]}
        kept = dict[str, Any]()
        alone = [self.group(name, settings, kept) for name in groups]
        varied = [path for path in settings if np.ndim(present(path))]
        same = {name: group for name, group in kept.items() if not set(varied).intersection(self.reads[name])}

        def of_run(*numbers: float) -> list[Any]:
            own = {**settings, **dict(zip(varied, numbers, strict=True))}
            of_own = dict(same)
            return [self.group(name, own, of_own) for name in groups]

        return over_combinations(of_run, *map(present, varied)) if varied else ([alone], None)


@dataclass(frozen=True, slots=True)
class LoopLink(Link):
    """Link to a function whose first arguments are ``groups`` of ``parts``."""

    groups: tuple[str, ...] = ()
    parts: LoopParts = field(kw_only=True)

    @property
    def sources(self) -> tuple[str, ...]:
        """Paths of all numbers that decide the default, known once it was computed."""
        return tuple(dict.fromkeys((*self.direct, *(path for name in self.groups for path in self.parts.reads[name]))))

    def without_gap(self, present: Callable[[str], Any], computed: dict[Any, Any]) -> Any:
        """Return the default without its gap; ``computed`` keeps groups for all links to them."""
        key = (self.parts, self.groups)
        function = self.function
        assert function is not None, "groups are arguments of a function"
        if key not in computed:
            computed[key] = self.parts.combinations(self.groups, present)
        results, combination_of_run = computed[key]
        return over_runs(
            lambda combination, *others: float(function(*results[int(combination)], *others)),
            0 if combination_of_run is None else combination_of_run.astype(np.float64),
            *map(present, self.direct),
        )


def set_device(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the settings of the actuator, its stops and dead volumes, and the pressures around the device."""
    lane.actuator = section_row(ACTUATORS[parts.device.actuator.kind].settings, settings, "actuator")
    lane.stops = section_row(Range, settings, "actuator")
    supply = settings["supply.pressure"]
    other = settings["supply.dorsiflexion_pressure"]
    if parts.regulates:
        supply = min(supply, settings["valve.highest_pressure"])
        other = min(other, settings["valve.highest_pressure"])
    lane.around = Surroundings(supply, other, settings["supply.atmospheric_pressure"])


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


def set_bounds(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the lowest and highest value of a table [rad]; curves exceed the knots slightly."""
    lane.bounds = table_bounds(component_row(TABLE, settings, parts.seen.section))


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
        lane.places = within(lane.stops, lane.bounds[0], lane.bounds[1])
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


def product_of(molar_mass: float, temperature: float) -> float:
    """Specific gas constant times temperature, R T / M [J/kg], from molar mass [kg/mol] and temperature [K]."""
    return specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass) * temperature


def conductance_of_area(molar_mass: float, ratio: float, temperature: float, area: float, discharge: float) -> float:
    """Mass-flow conductance [kg/(s Pa)] of an orifice area [m^2], from molar mass [kg/mol], k [-], temperature [K].

    Equation (6).
    """
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass)
    return area_conductance(area, discharge, ratio, constant, temperature)


def conductance_of_sonic(molar_mass: float, temperature: float, sonic: float) -> float:
    """Mass-flow conductance [kg/(s Pa)] of a sonic conductance [m^3/(s Pa)] of ISO 6358-1.

    Takes molar mass [kg/mol] and temperature [K].
    """
    return sonic_conductance_mass(sonic, specific_gas_constant(UNIVERSAL_GAS_CONSTANT, molar_mass), temperature)


def set_flow(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the flow coefficient of the valve [m^3/s]: R T times its conductance."""
    mass = settings["gas.molar_mass"]
    temperature = settings["gas.temperature"]
    if parts.is_sonic:
        conductance = conductance_of_sonic(mass, temperature, settings["valve.sonic_conductance"])
    else:
        ratio = settings["gas.heat_capacity_ratio"]
        discharge = settings["valve.discharge_coefficient"]
        conductance = conductance_of_area(mass, ratio, temperature, settings["valve.area"], discharge)
    lane.flow = product_of(mass, temperature) * conductance


def set_valve_time(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the delay [s] from a sample to the flow: switching delay and wait of a pair; spool, and sample delay."""
    kind = VALVES[parts.device.valve.kind]
    valve = section_row(kind.settings, settings, "valve")
    sampled = SAMPLES_LATE * settings["controller.period"]
    if _OF_PAIR.issubset(quantity.name for quantity in kind.quantities):
        lane.valve_time = max(valve.opening_delay, valve.closing_delay) + max(sampled, valve.switching_interval)
    else:
        follow_time = kind.lag or kind.choose(valve_settings(parts.device.valve)).command_delay
        lane.valve_time = follow_time(valve) + sampled


def per_flow(mean: MeanChambers, around: Surroundings, by_1: float, by_2: float) -> float:
    """Rate of the controlled quantity per volume flow, max(K P / V), with K its derivatives by both pressures."""
    # A chamber at a vacuum is filled from the room, quicker than it is emptied.
    source_1 = max(around.supply_pressure, around.atmospheric_pressure)
    source_2 = max(around.dorsiflexion_pressure, around.atmospheric_pressure)
    return max(by_1 * source_1 / mean.volume_1, by_2 * source_2 / mean.volume_2)


def torque_per_flow(mean: MeanChambers, around: Surroundings) -> float:
    """Rate of the torque per volume flow [N m/m^3]."""
    return per_flow(mean, around, mean.torque_per_pressure_1, mean.torque_per_pressure_2)


def set_torque_loop(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:  # noqa: ARG001
    """Set the torque or pressure loop at constant volume: R = K q max(P_1 / V_1, P_2 / V_2), theta.

    R is the larger value of the two extreme joint angles, at which the loop is fastest; theta is the dead time.
    """
    by = _OF_PRESSURE.get(parts.controlled)
    here = parts.chambers_at(lane.actuator, lane.stops, lane.around, lane.places[0])
    there = parts.chambers_at(lane.actuator, lane.stops, lane.around, lane.places[1])
    if by is None:
        quickest = max(torque_per_flow(here, lane.around), torque_per_flow(there, lane.around))
    else:
        quickest = max(per_flow(here, lane.around, by[0], by[1]), per_flow(there, lane.around, by[0], by[1]))
    rate = lane.flow * quickest
    lane.torque_loop = TorqueLoop(rate, lane.valve_time + lane.late, rate, 0.0)


def set_regulated_loop(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the torque or pressure loop of a valve that regulates pressures: R = K p / (tau_1 + theta), theta.

    An opening of 1 sets the pressure by p, the pressure per command, beyond the present one. The set pressure and the
    chamber follow with a lag each; of the shorter one a half is added to the longer one tau_1, a half to the dead time
    (the half rule of Skogestad 2003). The flow limits the rate to R_q. A set pressure that asks for more runs ahead of
    the chamber and has to come back: by the same rule a delay of tau_1/2, times 1 - R_q/R, the part beyond the flow.
    """
    kind = VALVES[parts.device.valve.kind]
    by = _OF_PRESSURE.get(parts.controlled)
    assert kind.regulation is not None, "the valve regulates pressures"
    pressure, band, set_lag = kind.regulation(section_row(kind.settings, settings, "valve"))
    mean = parts.chambers_at(lane.actuator, lane.stops, lane.around, lane.places[0])
    if by is None:
        gain = max(mean.torque_per_pressure_1, mean.torque_per_pressure_2)
        largest = lane.flow * torque_per_flow(mean, lane.around)
    else:
        gain = max(by[0], by[1])
        largest = lane.flow * per_flow(mean, lane.around, by[0], by[1])
    chamber_lag = gain * band / max(largest, LEAST_RATE)
    shorter = 0.5 * min(set_lag, chamber_lag)
    late = lane.valve_time + lane.late + shorter
    longer = max(set_lag, chamber_lag) + shorter
    rate = gain * pressure / (longer + late)
    ahead = 0.5 * longer * max(1.0 - largest / rate, 0.0)
    lane.torque_loop = TorqueLoop(rate, late, largest, ahead)


def set_reach(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:  # noqa: ARG001
    """Set the largest change of torque [N m] or pressure [Pa] from one supply while the other chamber is vented."""
    by = _OF_PRESSURE.get(parts.controlled)
    gauge_1 = abs(lane.around.supply_pressure - lane.around.atmospheric_pressure)
    gauge_2 = abs(lane.around.dorsiflexion_pressure - lane.around.atmospheric_pressure)
    if by is None:
        mean = parts.chambers_at(lane.actuator, lane.stops, lane.around, lane.places[0])
        lane.reach = max(mean.torque_per_pressure_1 * gauge_1, mean.torque_per_pressure_2 * gauge_2, 0.0)
    else:
        lane.reach = max(by[0] * gauge_1, by[1] * gauge_2, 0.0)


def set_joint(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:
    """Set the joint of a device with its gas at atmospheric pressure, where the gas spring is softest, and at work."""
    room = lane.around.atmospheric_pressure
    mean = lane.usual
    inertia = settings["foot_plate.inertia"]
    weight = settings["foot_plate.gravity_torque"]
    if parts.seen.has_leg:
        moment = settings["motion.foot_mass"] * settings["motion.foot_mass_centre"]
        inertia = inertia + settings["motion.foot_inertia"] + moment * settings["motion.foot_mass_centre"]
        weight = weight + moment * STANDARD_GRAVITY
    spring_1 = mean.torque_per_pressure_1 * mean.growth_1 / mean.volume_1
    spring_2 = mean.torque_per_pressure_2 * mean.growth_2 / mean.volume_2
    gauge_1 = lane.around.supply_pressure - room
    gauge_2 = lane.around.dorsiflexion_pressure - room
    at_work = spring_1 * (room + AT_WORK * gauge_1) + spring_2 * (room + AT_WORK * gauge_2)
    lane.joint = Joint(
        inertia=inertia,
        stiffness=room * (spring_1 + spring_2),
        shut_in=0.0 if parts.regulates else at_work,
        damping=settings["friction.viscous_damping"],
        friction=settings["friction.dynamic_torque"],
        static_friction=settings["friction.static_torque"],
        span=lane.stops.angle_max - lane.stops.angle_min,
        travel=0.0 if parts.controls_torque else settings["controller.error_limit"],
        gravity=weight,
        resolution=settings["sensors.angle_resolution"],
        noise=settings["sensors.angle_noise"],
    )


def set_loop(parts: LoopParts, lane: Any, settings: Mapping[str, float]) -> None:  # noqa: ARG001
    """Set the loop that the controller closes: of an angle that of a law that opens the valve by its error."""
    is_slow = parts.controls_torque and parts.controlled == ANGLE
    lane.loop = angle_loop.slow_loop(lane.torque_loop, lane.joint) if is_slow else lane.torque_loop


GROUPS: Mapping[str, PlainFunction] = {
    **dict.fromkeys(("actuator", "stops", "around"), set_device),
    "usual": set_usual,
    "bounds": set_bounds,
    "places": set_places,
    "late": set_late,
    "flow": set_flow,
    "valve_time": set_valve_time,
    "torque_loop": set_torque_loop,
    "reach": set_reach,
    "joint": set_joint,
    "loop": set_loop,
}
"""Function that sets each group, by the name of the group."""


def quicker_at(parts: LoopParts, numbers: Mapping[str, float], angle: float) -> float:
    """Ratio of the rates of the controlled quantity [-]: at an angle [rad], to the angle for which gains are computed.

    It is 1 where the extreme angles are known, because gains are then computed for these.
    """
    if parts.seen.is_locked or parts.seen.profile in _LEADING:
        return 1.0
    kept = dict[Any, Any]()
    by = _OF_PRESSURE.get(parts.controlled)
    actuator, stops, around = (parts.group(name, numbers, kept) for name in ("actuator", "stops", "around"))
    places = parts.chambers_at(actuator, stops, around, angle), parts.group("usual", numbers, kept)
    rates = [torque_per_flow(mean, around) if by is None else per_flow(mean, around, *by) for mean in places]
    return rates[0] / rates[1] if rates[1] > 0.0 else 1.0
