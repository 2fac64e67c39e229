"""Preparation of a run from its settings: initial state, parameters, time grid; and rules of files beside ranges.

All functions take ``parts``, the data independent of the settings (``Preparation``), ``lane``, the groups of the run to
be filled, and ``settings``, numbers in SI units by path. A library contains them in C, concatenated into one function
(``engine.generator``), with all conditions on ``parts`` evaluated beforehand.
"""

from collections import namedtuple
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.control.profiles import TabulatedProfile, disordered_knot
from ppafo.engine.program import Program
from ppafo.engine.rows import component_row, leaf_paths, numbers, rebuilt, section_row
from ppafo.engine.run import NEVER_FAILED, moment_at_start, whole_and_rest
from ppafo.engine.scheme.actuators import state_at_pressures
from ppafo.engine.scheme.motion import StepControl
from ppafo.engine.scheme.pneumatics import is_slow
from ppafo.engine.scheme.thermal_gas import masses_at_start
from ppafo.engine.step.lane import Lane, LaneResult, LaneTiming
from ppafo.model.actuators.kind import Range, mean_growth
from ppafo.model.binding import made_of
from ppafo.model.catalog import ACTUATORS, VALVES
from ppafo.model.columns import larger, smaller
from ppafo.model.controlled import CONTROLLED, Ends
from ppafo.model.declaration import Quantity, quantities_of
from ppafo.model.gait import ShankSeries
from ppafo.model.gas import specific_gas_constant
from ppafo.model.plant import PlantParameters
from ppafo.model.regulator import SupplyLines, lines_at_start
from ppafo.model.sensors import SensorParameters
from ppafo.parameters.declaration import members
from ppafo.parameters.device import SonicOrifice
from ppafo.parameters.effects import SEEN_BY_EFFECTS
from ppafo.parameters.plant import area_restriction, plant_with, sonic_restriction
from ppafo.simulation.declaration import LOCKED_ANGLE, SUPPLY_LINE, SUPPLY_LINES, THERMAL_GAS
from ppafo.simulation.leg import foot_load, with_load
from ppafo.simulation.numbers import path_of_locked_angle
from ppafo.simulation.plan import StepCounts, relative_tolerance, step_counts, thermal_gas
from ppafo.simulation.profiles import ProfileCourse, excursion, profile_parameters, widened
from ppafo.simulation.scenario import Leg, Scenario, vane_motion

FOOT_SETTINGS = ("foot_mass", "foot_mass_centre", "foot_inertia", "shank_length")
"""Settings of a foot on a prescribed shank, in the order of ``foot_load``."""
OF_SHANK = {"shank.start": "motion.shank.start", "shank.toe_lever": "motion.toe_lever"}
"""Paths of the settings of a shank on a gait, by the path of the number in ``ShankSeries``."""
LINE_PATHS = tuple(
    f"{SUPPLY_LINE}.{line}.{name}" for line in SUPPLY_LINES for name in ("droop", "largest_flow", "volume")
)
"""Settings of the supply lines, in the order of ``SupplyLines``, whose last number is no setting."""
VANE_ONLY_FIELDS = ("torque_constant", "displacement_per_radian")
"""Parameters of the vane without meaning for an actuator of another shape."""
KNOTS = {"reference": "reference.time_02", "path": "motion.profile.time_02", "shank": "motion.shank.time_02"}
"""Path of the time of the second knot of a profile, by the group of its settings."""

ENDS = (
    *("actuator.angle_min", "actuator.angle_max"),
    *("supply.pressure", "supply.dorsiflexion_pressure", "supply.atmospheric_pressure"),
)
"""Settings that decide what a reference may reach, in the order of ``Ends``."""


class PreparedLane(Lane):
    """Numbers of one run by group, and intermediate numbers of its preparation."""

    counts_of_steps: StepCounts
    tolerance: float  # error that a step may have, over the default [-]
    needs_parts: bool  # True where the error decides about the parts of a step
    step: float  # length of a step [s]
    signal_steps: float  # whole steps in the delay of the sensors [-]
    command_steps: float  # whole steps in the dead time of the valve [-]
    fault: float  # place of the setting that breaks a rule on profiles, counted from 1; 0 for none [-]
    gas: Any
    device: Any


@dataclass(frozen=True, slots=True)
class Preparation:
    """Scenario and program of a library: all data that does not depend on the settings.

    ``places`` has the place of each setting in the library, counted from 1, by path.
    """

    scenario: Scenario
    program: Program
    places: Mapping[str, float] = field(default_factory=dict)

    @property
    def leg(self) -> Leg | None:
        """Leg on a prescribed shank, attached to the vane; None for other motions and in a walk."""
        return None if self.program.walks else vane_motion(self.scenario).leg

    @property
    def locked_angle(self) -> str:
        """Path of the setting for the angle of a locked joint."""
        return path_of_locked_angle(self.scenario) or LOCKED_ANGLE

    @property
    def moves_on_path(self) -> bool:
        """True for a joint that a profile moves."""
        return self.program.angle is not None and path_of_locked_angle(self.scenario) is None

    @property
    def actuator_settings(self) -> Any:
        """Class of the settings of the actuator."""
        return ACTUATORS[self.scenario.device.actuator.kind].settings

    def row(self, name: str, fields: Iterable[str]) -> Any:
        """Return a NamedTuple class of settings with the given field names."""
        new_class: Any = namedtuple
        row = new_class(name.title().replace("_", ""), list(fields), module=__name__)
        row.__doc__ = ""  # not the list of its fields, which stands in the library below it
        return row

    def class_of_section(self, name: str, *further: str) -> Any:
        """Return a NamedTuple class of a device section as visible to effects, with ``further`` fields."""
        return self.row(name, [*names_of(members(name, self.scenario.device.actuator.kind)), *further])

    def constant(self, row: Any) -> Any:
        """Return a NamedTuple of constants that no setting changes, converted to floats."""
        return rebuilt(type(row), numbers(row))


def names_of(quantities: Iterable[Quantity]) -> list[str]:
    """Return the names of declared quantities."""
    return [quantity.name for quantity in quantities]


def set_plant(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the plant parameters without a walking leg, and the parameters of effects."""
    plant_without_leg = "bare" if parts.program.walks else "plant"
    # An actuator of another shape has no parameters of a vane; its shape comes last.
    vane_only = () if parts.program.actuator.shape is None else VANE_ONLY_FIELDS
    of_vane = f"vane_{plant_without_leg}" if vane_only else plant_without_leg
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, settings["gas.molar_mass"])
    # Lines have a check valve of their own, so that the valve may push gas back into them.
    relieving = float(parts.scenario.device.supply.takes_back or parts.scenario.supply_lines is not None)
    lane.gas = section_row(parts.class_of_section("gas", "specific_gas_constant"), settings, "gas", constant)
    actuator = parts.class_of_section("actuator", *vane_only)
    lane["actuator"] = section_row(actuator, settings, "actuator", *(0.0 for _ in vane_only))
    for section in ("friction", "foot_plate"):
        lane[section] = section_row(parts.class_of_section(section), settings, section)
    lane["supply"] = section_row(parts.class_of_section("supply", "relieving"), settings, "supply", relieving)
    lane.device = parts.row("Device", SEEN_BY_EFFECTS)(*(lane[section] for section in SEEN_BY_EFFECTS))
    device = parts.scenario.device
    orifices = (("valve", "valve", device.valve.orifice), ("leak", "actuator.leak", device.actuator.leak))
    for name, section, orifice in orifices:
        restriction = sonic_restriction if isinstance(orifice, SonicOrifice) else area_restriction
        form: type = type(orifice)
        given = section_row(parts.row(f"{name}_orifice", names_of(quantities_of(form))), settings, section)
        lane[f"{name}_restriction"] = restriction(given, lane.gas, settings["flow.linear_ratio"])
    for effect in parts.program.effects:
        if effect.prepare is None:
            lane[effect.name] = section_row(effect.parameters, settings, effect.section)
        else:
            own = parts.row(f"{effect.name}_settings", names_of(effect.quantities))
            lane[effect.name] = effect.prepare(section_row(own, settings, effect.section), lane.device)
    if parts.program.angle is not None or parts.program.walks:
        torque = 0.0
    else:
        torque = settings["motion.external_torque"] if parts.leg is None else -settings["motion.ankle_torque"]
    lane[of_vane] = plant_with(lane.device, lane["valve_restriction"], lane["leak_restriction"], torque)
    if vane_only:
        stops = section_row(Range, settings, "actuator")
        tables = [] if parts.scenario.device.actuator.table is None else [parts.scenario.device.actuator.table]
        shape = parts.program.actuator.prepare(
            section_row(parts.actuator_settings, settings, "actuator"),
            stops,
            # Tables from a file that the set names are constant.
            *(parts.constant(table) for table in tables),
        )
        # The mean growth is taken at the supply's pressure, at which most of the work is done.
        gauge = lane[of_vane].supply_pressure - lane[of_vane].atmospheric_pressure
        growth = mean_growth(shape, stops, gauge, parts.program.actuator.chambers)
        lane[plant_without_leg] = parts.program.actuator.plant(
            *(growth if name in VANE_ONLY_FIELDS else getattr(lane[of_vane], name) for name in PlantParameters._fields),
            shape,
        )


def put_leg_on(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Add a foot on a prescribed shank to the plant."""
    if parts.leg is not None:
        lane.load = foot_load(
            lane.plant.inertia, lane.plant.gravity_torque, *(settings[f"motion.{name}"] for name in FOOT_SETTINGS)
        )
        lane.plant = with_load(lane.plant, lane.load)


def set_shank(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the motion of the shank that carries a foot; of a gait, only start time and toe lever can be set."""
    if parts.leg is not None:
        shank = parts.program.shank
        assert shank is not None, "a leg has a shank"
        if parts.leg.curves is None:
            lane.shank = component_row(shank, settings, "motion.shank")
        else:
            of_gait = dict(zip(leaf_paths(ShankSeries, "shank"), numbers(parts.leg.curves), strict=True))
            lane.shank = rebuilt(
                ShankSeries, (settings[OF_SHANK[path]] if path in OF_SHANK else of_gait[path] for path in of_gait)
            )


def count_steps(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set number and length of the steps."""
    lane.counts_of_steps = step_counts(
        settings["run.duration"], settings["run.step"], settings["run.output_interval"], settings["controller.period"]
    )
    lane.tolerance = relative_tolerance(settings["run.tolerance"])


def set_timing(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set valve parameters, delays in steps, and the time grid."""
    lane["valve_settings"] = section_row(VALVES[parts.scenario.device.valve.kind].settings, settings, "valve")
    lane.valve = parts.program.valve.prepare(lane["valve_settings"])
    # The step that the counts found, not the one that was asked for.
    lane.step = lane.counts_of_steps.step
    command_delay = parts.program.valve.command_delay(lane["valve_settings"])
    lane.command_steps, command_lag = whole_and_rest(command_delay, lane.step)
    lane.signal_steps, signal_lag = whole_and_rest(0.0 if parts.program.walks else settings["sensors.delay"], lane.step)
    lane.timing = LaneTiming(
        step=lane.step,
        period=lane.step * lane.counts_of_steps.steps_per_sample,
        command_lag=command_lag,
        signal_lag=signal_lag,
        tolerance=1.0 if parts.program.walks else lane.tolerance,
    )


def choose_parts(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set whether error control divides the steps, which a locked joint with rigid chambers may not need."""
    if not parts.program.chooses_parts:
        lane.needs_parts = True
    else:
        smallest = parts.program.actuator.chambers(
            lane.plant,
            smaller(larger(settings[parts.locked_angle], lane.plant.angle_min), lane.plant.angle_max),
            lane.plant.atmospheric_pressure,
            lane.plant.atmospheric_pressure,
        )
        lane.needs_parts = not is_slow(
            lane.plant,
            lane.step / smaller(1.0, lane.tolerance),
            smallest.volume_1,
            smallest.volume_2,
            # By how much faster the pressure of the gas follows than at one temperature.
            settings["gas.heat_capacity_ratio"] if parts.program.is_thermal else 1.0,
        )


def set_laws(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the parameters of the controller, the reference and the prescribed angle."""
    controller = parts.program.controller
    reference = parts.program.reference
    path = parts.program.angle
    if controller is not None:
        lane.controller = component_row(controller, settings, "controller")
    if parts.scenario.follows_reference:
        lane.reference = component_row(reference, settings, "reference")
    else:
        # The one that stands in its place is written out.
        lane.reference = parts.constant(profile_parameters(parts.scenario.reference))
    if parts.moves_on_path:
        lane.path = component_row(path, settings, "motion.profile")
    elif path is not None:
        lane.path = path.parameters(settings[parts.locked_angle])


def set_gas(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set sensor noise, heat transfer to the gas, and supply lines."""
    lane.sensors = section_row(SensorParameters, settings, "sensors")
    if parts.program.is_thermal:
        walls = parts.row("Walls", names_of(THERMAL_GAS))
        lane.thermal = thermal_gas(section_row(walls, settings, "gas_model"), lane.gas)
    if parts.scenario.supply_lines is not None:
        relieving = parts.scenario.supply_lines.relieving
        lane.lines = rebuilt(
            SupplyLines, (relieving if path == "relieving" else settings[path] for path in (*LINE_PATHS, "relieving"))
        )


def fill_chambers(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the initial angle, angular velocity and gas."""
    if parts.program.angle is not None:
        angle, angular_velocity, _ = parts.program.angle.value(lane.path, 0.0)
    else:
        angle = settings["motion.angle"]
        angular_velocity = settings["motion.angular_velocity"]
    pressure_1 = settings["initial.pressure_1"]
    pressure_2 = settings["initial.pressure_2"]
    lane.state = state_at_pressures(
        lane.plant, angle, angular_velocity, pressure_1, pressure_2, parts=parts.program.functions
    )


def start(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set all other initial states."""
    program = parts.program
    lane.result = LaneResult(0.0, NEVER_FAILED, 0.0)
    lane.pace = StepControl(lane.step)
    for name, of_plant in program.groups_of_plant.items():
        lane[name] = of_plant(lane.plant)
    if program.is_thermal:
        lane.masses = masses_at_start(lane.state)
    lane.valve_state = parts.constant(program.valve.state())
    if program.controller is not None:
        lane.controller_state = parts.constant(program.controller.initial)
    if program.feed is not None:
        lane.line_state = lines_at_start(lane.plant, lane.lines)
    if any(kind.start is not None for kind in program.stated.values()):
        lane["at_start"] = moment_at_start(lane.plant, lane.state, parts=program.functions)
    for name, kind in program.stated.items():
        if kind.start is None:
            lane[f"{name}_state"] = parts.constant(kind.row())
        else:
            lane[f"{name}_state"] = kind.start(lane[name], lane["at_start"])


def counted(parts: Preparation, lane: PreparedLane, settings: Any) -> tuple[float, ...]:
    """Return the step counts of the run, in the order of ``COUNTS``."""
    return (
        lane.counts_of_steps.record_every,
        lane.counts_of_steps.step_count,
        lane.counts_of_steps.steps_per_sample,
        lane.signal_steps,
        lane.command_steps,
        1.0 if lane.needs_parts else 0.0,
    )


VANE_PREPARATION = (
    *(set_plant, put_leg_on, set_shank, count_steps, set_timing, choose_parts),
    *(set_laws, set_gas, fill_chambers, start, counted),
)
"""Functions that prepare the run of a scenario, in order of calling; the last one returns the step counts."""


def fault_of_knots(profile: TabulatedProfile, second: float) -> float:
    """Return the place of the time of a knot that is not in order, from that of the second knot; 0 for none."""
    number = disordered_knot(profile)
    # Each knot has a time and a value.
    return second + 2.0 * (number - 2.0) if number > 0.0 else 0.0


def first_fault(found: float, further: float) -> float:
    """Return a fault, or a further one if there is none."""
    return found if found > 0.0 else further


def reach_of(parts: Preparation) -> Callable[[Ends], tuple[float, float]] | None:
    """Return the function for the range of the reference; None for a reference that nothing limits."""
    return CONTROLLED[parts.scenario.controlled].reach if parts.scenario.follows_reference else None


def has_rules(parts: Preparation) -> bool:
    """Return whether there are rules on the profiles, of knots or of what they may reach, or on the actuator."""
    has_knots = not parts.places.keys().isdisjoint(KNOTS.values())
    flaw = ACTUATORS[parts.scenario.device.actuator.kind].flaw
    return has_knots or flaw is not None or reach_of(parts) is not None or parts.moves_on_path


def check_knots(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the fault of the knots of reference, prescribed angle and shank."""
    lane.fault = 0.0
    for group, second in KNOTS.items():
        if second in parts.places:
            lane.fault = first_fault(lane.fault, fault_of_knots(lane[group], parts.places[second]))


def check_courses(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the fault of a prescribed angle beyond the stops, or of a reference out of reach."""
    duration = settings["run.duration"]
    if parts.moves_on_path:
        assert parts.program.angle is not None, "a joint on a path"
        stops = widened(settings["actuator.angle_min"], settings["actuator.angle_max"])
        of_path = made_of(excursion, "excursion_of_path", ProfileCourse(parts.program.angle.value))
        outside = of_path(lane.path, stops[0], stops[1], duration, lane.counts_of_steps.step)
        lane.fault = first_fault(lane.fault, parts.places["motion.profile.level"] if outside[0] >= 0.0 else 0.0)
    reach = reach_of(parts)
    if reach is not None:
        reached = reach(parts.row("Ends", Ends._fields)(*(settings[path] for path in ENDS)))
        limits = widened(reached[0], reached[1])
        of_reference = made_of(excursion, "excursion_of_reference", ProfileCourse(parts.program.reference.value))
        beyond = of_reference(lane.reference, limits[0], limits[1], duration, lane.counts_of_steps.step)
        lane.fault = first_fault(lane.fault, parts.places["reference.level"] if beyond[0] >= 0.0 else 0.0)


def check_actuator(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the fault of an actuator whose numbers are impossible together."""
    find_flaw = ACTUATORS[parts.scenario.device.actuator.kind].flaw
    if find_flaw is not None:
        flaw = find_flaw(
            section_row(parts.actuator_settings, settings, "actuator"), section_row(Range, settings, "actuator")
        )
        before_first = parts.places[f"actuator.{next(iter(parts.scenario.device.actuator.settings))}"] - 1.0
        lane.fault = first_fault(flaw + before_first if flaw > 0.0 else 0.0, lane.fault)


def faults(parts: Preparation, lane: PreparedLane, settings: Any) -> float:
    """Return the fault that was found."""
    return lane.fault


PROFILE_RULES = (set_shank, count_steps, set_laws, check_knots, check_courses, check_actuator, faults)
"""Functions that check the profiles of a scenario, in order of calling; the last one returns the fault."""
WALK_RULES = (check_knots, check_actuator, faults)
"""The same of a walk, in which a profile has no knots and leads nowhere."""
