"""Preparation of a run from its settings: plain functions in the same form as the functions of a step.

All functions take ``parts``, the data independent of the settings (``Preparation``), ``lane``, the groups of the run to
be filled, and ``settings``, one number each in SI units. Python runs these functions directly. A library contains them
in C, concatenated into one function (``engine.generator``), with all conditions on ``parts`` evaluated beforehand.
"""

from collections import namedtuple
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, numbers, rebuilt
from ppafo.engine.run import NEVER_FAILED, moment_at_start, whole_and_rest
from ppafo.engine.scheme.motion import StepControl
from ppafo.engine.scheme.pneumatics import is_slow
from ppafo.engine.step.lane import Lane, LaneResult, LaneTiming
from ppafo.exports.c_library.library import c_identifier
from ppafo.model.actuators.kind import Range, mean_growth
from ppafo.model.catalog import VALVES
from ppafo.model.columns import larger, smaller
from ppafo.model.declaration import Quantity
from ppafo.model.effects.kind import Effect
from ppafo.model.gait import ShankSeries
from ppafo.model.gas import specific_gas_constant
from ppafo.model.plant import PlantParameters
from ppafo.model.regulator import SupplyLines, lines_at_start
from ppafo.model.sensors import SensorParameters
from ppafo.parameters.declaration import members
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.parameters.effects import SEEN_BY_EFFECTS
from ppafo.parameters.plant import area_restriction, plant_with, sonic_restriction
from ppafo.simulation.declaration import LOCKED_ANGLE, SUPPLY_LINE, SUPPLY_LINES, THERMAL_GAS
from ppafo.simulation.leg import foot_load, with_load
from ppafo.simulation.numbers import path_of_locked_angle
from ppafo.simulation.plan import StepCounts, relative_tolerance, state_with_volumes, step_counts, thermal_gas
from ppafo.simulation.scenario import Leg, Scenario, vane_motion

OF_VANE = ("torque_constant", "displacement_per_radian")
"""Parameters of the vane without meaning for an actuator of another shape."""
OF_FOOT = ("foot_mass", "foot_mass_centre", "foot_inertia", "shank_length")
"""Settings of a foot on a prescribed shank, in the order of ``foot_load``."""


class PreparedLane(Lane):
    """Numbers of one run by group, and intermediate numbers of its preparation."""

    counts_of_steps: StepCounts
    tolerance: float  # error that a step may have, over the default [-]
    needs_parts: bool  # True where the error decides about the parts of a step
    step: float  # length of a step [s]
    signal_delay: float  # of the slowest sensor of a walk [s]
    signal_steps: float  # whole steps in the delay of the sensors [-]
    command_steps: float  # whole steps in the dead time of the valve [-]
    gas: Any
    device: Any


@dataclass(frozen=True, slots=True)
class Preparation:
    """Scenario and program of a library: all data that does not depend on the settings."""

    scenario: Scenario
    program: Program

    @property
    def device(self) -> Device:
        """Device of the scenario."""
        return self.scenario.device

    @property
    def leg(self) -> Leg | None:
        """Leg on a prescribed shank, attached to the vane; None for other motions and in a walk."""
        return None if self.program.walks else vane_motion(self.scenario).leg

    @property
    def shank_numbers(self) -> dict[str, float]:
        """Numbers of a shank prescribed by a gait, by path."""
        assert self.leg is not None, "a shank is of a leg"
        return dict(zip(leaf_paths(ShankSeries, "shank"), numbers(self.leg.curves), strict=True))

    @property
    def bare(self) -> str:
        """Variable name of the plant before a walking leg is added."""
        return "bare" if self.program.walks else "plant"

    @property
    def vane(self) -> str:
        """Variable name of the plant before the shape of its actuator is set."""
        return self.bare if self.program.actuator.shape is None else f"vane_{self.bare}"

    @property
    def unread(self) -> tuple[str, ...]:
        """Vane parameters without meaning for an actuator of another shape; empty for a vane."""
        return () if self.program.actuator.shape is None else OF_VANE

    @property
    def level(self) -> str:
        """Name of the setting for the angle of a locked joint."""
        return c_identifier(path_of_locked_angle(self.scenario) or LOCKED_ANGLE)

    @property
    def line_settings(self) -> list[str]:
        """Names of droop, largest flow and volume of each supply line, then ``relieving``, which is no setting."""
        of_line = ("droop", "largest_flow", "volume")
        found = [c_identifier(f"{SUPPLY_LINE}.{line}.{name}") for line in SUPPLY_LINES for name in of_line]
        return [*found, "relieving"]

    @property
    def valve_settings(self) -> list[str]:
        """Names of the settings of the valve."""
        return named(VALVES[self.device.valve.kind].quantities)

    @property
    def tables(self) -> list[Any]:
        """Table of a measured actuator as a list; empty for other actuators."""
        return [] if self.device.actuator.table is None else [self.device.actuator.table]

    def names(self, section: str, own: Iterable[str] | None = None) -> list[str]:
        """Return the C names of settings of a section: the names in ``own``, else all numbers visible to effects."""
        found = named(members(section, self.device.actuator.kind)) if own is None else own
        return [c_identifier(f"{section}.{name}") for name in found]

    def row(self, name: str, fields: Iterable[str]) -> Any:
        """Return a NamedTuple class of settings with the given field names."""
        make: Any = namedtuple
        made = make(name, list(fields), module=__name__)
        made.__doc__ = ""  # not the list of its fields, which stands in the library below it
        return made

    def section(self, name: str, *further: str) -> Any:
        """Return a NamedTuple class of a device section as visible to effects, with ``further`` fields."""
        fields = named(members(name, self.device.actuator.kind))
        return self.row(name.title().replace("_", ""), [*fields, *further])

    def effect_settings(self, effect: Effect) -> Any:
        """Return a NamedTuple class of the settings of an effect."""
        return self.row(f"{effect.name.title().replace('_', '')}Settings", named(effect.quantities))

    def orifice(self, section: str) -> Any:
        """Return a NamedTuple class of an orifice in its given form."""
        if self.is_sonic(section):
            return self.row("SonicOrifice", ("sonic_conductance", "critical_ratio"))
        return self.row("Orifice", ("area", "discharge_coefficient"))

    def is_sonic(self, section: str) -> bool:
        """True for an orifice in the form of ISO 6358."""
        return isinstance(self.device.valve.orifice if section == "valve" else self.device.actuator.leak, SonicOrifice)

    def constant(self, row: Any) -> Any:
        """Return a NamedTuple of numbers that no setting changes, all as floats."""
        return rebuilt(type(row), numbers(row))


def named(quantities: Iterable[Quantity]) -> list[str]:
    """Return the names of declared numbers."""
    return [quantity.name for quantity in quantities]


def set_plant(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the plant parameters without a walking leg, and the parameters of effects."""
    lane.gas = parts.section("gas", "specific_gas_constant")(
        *(getattr(settings, name) for name in parts.names("gas")),
        specific_gas_constant(UNIVERSAL_GAS_CONSTANT, settings.gas_molar_mass),
    )
    lane["actuator"] = parts.section("actuator", *parts.unread)(
        *(getattr(settings, name) for name in parts.names("actuator")), *(0.0 for _ in parts.unread)
    )
    lane["friction"] = parts.section("friction")(*(getattr(settings, name) for name in parts.names("friction")))
    lane["foot_plate"] = parts.section("foot_plate")(*(getattr(settings, name) for name in parts.names("foot_plate")))
    lane["supply"] = parts.section("supply", "relieving")(
        *(getattr(settings, name) for name in parts.names("supply")),
        # Lines have a check valve of their own, so that the valve may push gas back into them.
        float(parts.device.supply.takes_back or parts.scenario.supply_lines is not None),
    )
    lane.device = parts.row("Device", SEEN_BY_EFFECTS)(*(lane[section] for section in SEEN_BY_EFFECTS))
    for section, orifice in (("valve", "valve"), ("leak", "actuator.leak")):
        lane[f"{section}_restriction"] = (sonic_restriction if parts.is_sonic(orifice) else area_restriction)(
            parts.orifice(orifice)(
                *(getattr(settings, name) for name in parts.names(orifice, parts.orifice(orifice)._fields))
            ),
            lane.gas,
            settings.flow_linear_ratio,
        )
    for effect in parts.program.effects:
        if effect.prepare is None:
            lane[effect.name] = effect.parameters(
                *(getattr(settings, name) for name in parts.names(effect.section, named(effect.quantities)))
            )
        else:
            lane[effect.name] = effect.prepare(
                parts.effect_settings(effect)(
                    *(getattr(settings, name) for name in parts.names(effect.section, named(effect.quantities)))
                ),
                lane.device,
            )
    is_led = parts.program.angle is not None or parts.program.walks
    lane[parts.vane] = plant_with(
        lane.device,
        lane["valve_restriction"],
        lane["leak_restriction"],
        0.0 if is_led else (settings.motion_external_torque if parts.leg is None else -settings.motion_ankle_torque),
    )
    if parts.program.actuator.shape is not None:
        stops = rebuilt(Range, (getattr(settings, name) for name in parts.names("actuator", Range._fields)))
        # What came from a file that the set names is constant.
        shape = parts.program.actuator.prepare(
            parts.row("ActuatorSettings", parts.device.actuator.settings)(
                *(getattr(settings, name) for name in parts.names("actuator", parts.device.actuator.settings))
            ),
            stops,
            *(parts.constant(table) for table in parts.tables),
        )
        # The mean growth is taken at the supply's pressure, at which most of the work is done.
        growth = mean_growth(
            shape,
            stops,
            lane[parts.vane].supply_pressure - lane[parts.vane].atmospheric_pressure,
            parts.program.actuator.chambers,
        )
        lane[parts.bare] = parts.program.actuator.plant(
            *(growth if name in OF_VANE else getattr(lane[parts.vane], name) for name in PlantParameters._fields),
            shape,
        )


def put_leg_on(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Add a foot on a prescribed shank to the plant; of a gait only the start is a setting."""
    if parts.leg is not None:
        lane.load = foot_load(
            lane.plant.inertia,
            lane.plant.gravity_torque,
            *(getattr(settings, name) for name in parts.names("motion", OF_FOOT)),
        )
        lane.plant = with_load(lane.plant, lane.load)
        if parts.leg.curves is None:
            shank = parts.program.shank
            assert shank is not None, "a leg has a shank"
            lane.shank = rebuilt(
                shank.parameters,
                (getattr(settings, name) for name in parts.names("motion.shank", named(shank.quantities))),
            )
        else:
            lane.shank = rebuilt(
                ShankSeries,
                (
                    settings.motion_shank_start
                    if path == "shank.start"
                    else (settings.motion_toe_lever if path == "shank.toe_lever" else parts.shank_numbers[path])
                    for path in parts.shank_numbers
                ),
            )


def count_steps(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set number and length of the steps."""
    lane.counts_of_steps = step_counts(
        settings.run_duration, settings.run_step, settings.run_output_interval, settings.controller_period
    )
    lane.tolerance = relative_tolerance(settings.run_tolerance)


def set_timing(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set valve parameters, delays in steps, and the time grid."""
    lane["valve_settings"] = parts.row("ValveSettings", parts.valve_settings)(
        *(getattr(settings, name) for name in parts.names("valve", parts.valve_settings))
    )
    lane.valve = parts.program.valve.prepare(lane["valve_settings"])
    # The step that the counts found, not the one that was asked for.
    lane.step = lane.counts_of_steps.step
    command_delay = parts.program.valve.command_delay(lane["valve_settings"])
    lane.command_steps, command_lag = whole_and_rest(command_delay, lane.step)
    lane.signal_steps, signal_lag = whole_and_rest(
        lane.signal_delay if parts.program.walks else settings.sensors_delay, lane.step
    )
    lane.timing = LaneTiming(
        step=lane.step,
        period=lane.step * lane.counts_of_steps.steps_per_sample,
        command_lag=command_lag,
        signal_lag=signal_lag,
        tolerance=1.0 if parts.program.walks else lane.tolerance,
    )


def choose_parts(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Decide, for a locked joint with rigid chambers, if error control divides the steps into parts."""
    if not parts.program.chooses_parts:
        lane.needs_parts = True
    else:
        smallest = parts.program.actuator.chambers(
            lane.plant,
            smaller(larger(getattr(settings, parts.level), lane.plant.angle_min), lane.plant.angle_max),
            lane.plant.atmospheric_pressure,
            lane.plant.atmospheric_pressure,
        )
        lane.needs_parts = not is_slow(
            lane.plant,
            lane.step / smaller(1.0, lane.tolerance),
            smallest.volume_1,
            smallest.volume_2,
            # By how much faster the pressure of the gas follows than at one temperature.
            settings.gas_heat_capacity_ratio if parts.program.is_thermal else 1.0,
        )


def set_laws(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the parameters of controller, reference and prescribed angle."""
    controller, reference, path = parts.program.controller, parts.program.reference, parts.program.angle
    if controller is not None:
        lane.controller = rebuilt(
            controller.parameters,
            (getattr(settings, name) for name in parts.names("controller", named(controller.quantities))),
        )
    # Where no reference is followed, the one that stands in its place is written out.
    lane.reference = rebuilt(
        reference.parameters,
        (
            getattr(settings, c_identifier(f"reference.{name}"))
            if parts.scenario.follows_reference
            else parts.scenario.reference.settings[name]
            for name in named(reference.quantities)
        ),
    )
    if path is not None:
        lane.path = rebuilt(
            path.parameters,
            (
                getattr(settings, parts.level)
                if name == "level" and path_of_locked_angle(parts.scenario) is not None
                else getattr(settings, c_identifier(f"motion.profile.{name}"))
                for name in named(path.quantities)
            ),
        )


def set_gas(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set sensor noise, heat transfer to the gas, and supply lines."""
    flaws = parts.names("sensors", SensorParameters._fields)
    lane.sensors = rebuilt(SensorParameters, (getattr(settings, name) for name in flaws))
    if parts.program.is_thermal:
        lane.thermal = thermal_gas(
            parts.row("Walls", named(THERMAL_GAS))(
                *(getattr(settings, name) for name in parts.names("gas_model", named(THERMAL_GAS)))
            ),
            lane.gas,
        )
    if parts.scenario.supply_lines is not None:
        relieving = parts.scenario.supply_lines.relieving
        lane.lines = rebuilt(
            SupplyLines,
            (relieving if name == "relieving" else getattr(settings, name) for name in parts.line_settings),
        )


def fill_chambers(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the initial angle, angular velocity and gas."""
    path = parts.program.angle
    if path is not None:
        angle, angular_velocity, _ = path.value(lane.path, 0.0)
    filled = parts.program.actuator.chambers(
        lane.plant,
        settings.motion_angle if path is None else angle,
        settings.initial_pressure_1,
        settings.initial_pressure_2,
    )
    lane.state = state_with_volumes(
        lane.plant,
        settings.motion_angle if path is None else angle,
        settings.motion_angular_velocity if path is None else angular_velocity,
        filled.volume_1,
        filled.volume_2,
        settings.initial_pressure_1,
        settings.initial_pressure_2,
    )


def start(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set all other initial states."""
    program = parts.program
    lane.result = LaneResult(0.0, NEVER_FAILED, 0.0)
    lane.pace = StepControl(lane.step)
    for name, of_plant in program.groups_of_plant.items():
        lane[name] = of_plant(lane.plant)
    if program.gas.START is not None:
        lane.masses = program.gas.START(lane.plant, lane.state, parts=program.functions)
    lane.valve_state = parts.constant(program.valve.initial())
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
    *(set_plant, put_leg_on, count_steps, set_timing, choose_parts),
    *(set_laws, set_gas, fill_chambers, start, counted),
)
"""Functions that prepare the run of a scenario, in order of calling; the last one returns the step counts."""
