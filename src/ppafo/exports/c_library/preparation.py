"""Preparation of a run from its settings: initial state, parameters, and time grid.

All functions take ``parts``, the data independent of the settings (``Preparation``), ``lane``, the groups of the run to
be filled, and ``settings``, numbers in SI units by path. A library contains them in C, concatenated into one function
(``engine.generator``), with all conditions on ``parts`` evaluated beforehand.
"""

from typing import Any

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.engine.rows import rebuilt, section_row
from ppafo.engine.run import NEVER_FAILED, moment_at_start, whole_and_rest
from ppafo.engine.scheme.motion import StepControl
from ppafo.engine.scheme.pneumatics import is_slow
from ppafo.engine.step.lane import LaneResult, LaneTiming
from ppafo.exports.c_library.prepared import VANE_ONLY_FIELDS, Preparation, PreparedLane, names_of
from ppafo.model.actuators.kind import Range, mean_growth
from ppafo.model.columns import larger, smaller
from ppafo.model.gait import ShankSeries
from ppafo.model.gas import specific_gas_constant
from ppafo.model.plant import PlantParameters
from ppafo.model.regulator import SupplyLines, lines_at_start
from ppafo.model.sensors import SensorParameters
from ppafo.parameters.effects import SEEN_BY_EFFECTS
from ppafo.parameters.plant import area_restriction, plant_with, sonic_restriction
from ppafo.simulation.declaration import THERMAL_GAS
from ppafo.simulation.leg import foot_load, with_load
from ppafo.simulation.numbers import path_of_locked_angle
from ppafo.simulation.plan import relative_tolerance, state_with_volumes, step_counts, thermal_gas

FOOT_SETTINGS = ("foot_mass", "foot_mass_centre", "foot_inertia", "shank_length")
"""Settings of a foot on a prescribed shank, in the order of ``foot_load``."""


def set_plant(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the plant parameters without a walking leg, and the parameters of effects."""
    constant = specific_gas_constant(UNIVERSAL_GAS_CONSTANT, settings["gas.molar_mass"])
    lane.gas = section_row(parts.section_row("gas", "specific_gas_constant"), settings, "gas", constant)
    lane["actuator"] = section_row(
        parts.section_row("actuator", *parts.vane_only_fields),
        settings,
        "actuator",
        *(0.0 for _ in parts.vane_only_fields),
    )
    for section in ("friction", "foot_plate"):
        lane[section] = section_row(parts.section_row(section), settings, section)
    # Lines have a check valve of their own, so that the valve may push gas back into them.
    relieving = float(parts.device.supply.takes_back or parts.scenario.supply_lines is not None)
    lane["supply"] = section_row(parts.section_row("supply", "relieving"), settings, "supply", relieving)
    lane.device = parts.row("Device", SEEN_BY_EFFECTS)(*(lane[section] for section in SEEN_BY_EFFECTS))
    for section, orifice in (("valve", "valve"), ("leak", "actuator.leak")):
        lane[f"{section}_restriction"] = (sonic_restriction if parts.is_sonic(orifice) else area_restriction)(
            section_row(parts.orifice_row(orifice), settings, orifice), lane.gas, settings["flow.linear_ratio"]
        )
    for effect in parts.program.effects:
        if effect.prepare is None:
            lane[effect.name] = section_row(effect.parameters, settings, effect.section)
        else:
            lane[effect.name] = effect.prepare(
                section_row(parts.effect_row(effect), settings, effect.section), lane.device
            )
    is_led = parts.program.angle is not None or parts.program.walks
    lane[parts.plant_of_vane] = plant_with(
        lane.device,
        lane["valve_restriction"],
        lane["leak_restriction"],
        0.0
        if is_led
        else (settings["motion.external_torque"] if parts.leg is None else -settings["motion.ankle_torque"]),
    )
    if parts.program.actuator.shape is not None:
        stops = section_row(Range, settings, "actuator")
        # What came from a file that the set names is constant.
        shape = parts.program.actuator.prepare(
            section_row(parts.actuator_settings, settings, "actuator"),
            stops,
            *(parts.constant(table) for table in parts.tables),
        )
        # The mean growth is taken at the supply's pressure, at which most of the work is done.
        growth = mean_growth(
            shape,
            stops,
            lane[parts.plant_of_vane].supply_pressure - lane[parts.plant_of_vane].atmospheric_pressure,
            parts.program.actuator.chambers,
        )
        lane[parts.plant_without_leg] = parts.program.actuator.plant(
            *(
                growth if name in VANE_ONLY_FIELDS else getattr(lane[parts.plant_of_vane], name)
                for name in PlantParameters._fields
            ),
            shape,
        )


def put_leg_on(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Add a foot on a prescribed shank to the plant."""
    if parts.leg is not None:
        lane.load = foot_load(
            lane.plant.inertia,
            lane.plant.gravity_torque,
            *(settings[f"motion.{name}"] for name in FOOT_SETTINGS),
        )
        lane.plant = with_load(lane.plant, lane.load)


def set_shank(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the motion of the shank that carries a foot; of a gait, only start time and toe lever can be set."""
    if parts.leg is not None:
        if parts.leg.curves is None:
            shank = parts.program.shank
            assert shank is not None, "a leg has a shank"
            lane.shank = rebuilt(
                shank.parameters,
                (settings[f"motion.shank.{name}"] for name in names_of(shank.quantities)),
            )
        else:
            lane.shank = rebuilt(
                ShankSeries,
                (
                    settings["motion.shank.start"]
                    if path == "shank.start"
                    else (settings["motion.toe_lever"] if path == "shank.toe_lever" else parts.shank_numbers[path])
                    for path in parts.shank_numbers
                ),
            )


def count_steps(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set number and length of the steps."""
    lane.counts_of_steps = step_counts(
        settings["run.duration"],
        settings["run.step"],
        settings["run.output_interval"],
        settings["controller.period"],
    )
    lane.tolerance = relative_tolerance(settings["run.tolerance"])


def set_timing(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set valve parameters, delays in steps, and the time grid."""
    lane["valve_settings"] = section_row(parts.valve_settings, settings, "valve")
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
    controller, reference, path = parts.program.controller, parts.program.reference, parts.program.angle
    if controller is not None:
        lane.controller = rebuilt(
            controller.parameters,
            (settings[f"controller.{name}"] for name in names_of(controller.quantities)),
        )
    # Where no reference is followed, the one that stands in its place is written out.
    lane.reference = rebuilt(
        reference.parameters,
        (
            settings[f"reference.{name}"]
            if parts.scenario.follows_reference
            else parts.scenario.reference.settings[name]
            for name in names_of(reference.quantities)
        ),
    )
    if path is not None:
        lane.path = rebuilt(
            path.parameters,
            (
                settings[parts.locked_angle]
                if name == "level" and path_of_locked_angle(parts.scenario) is not None
                else settings[f"motion.profile.{name}"]
                for name in names_of(path.quantities)
            ),
        )


def set_gas(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set sensor noise, heat transfer to the gas, and supply lines."""
    lane.sensors = section_row(SensorParameters, settings, "sensors")
    if parts.program.is_thermal:
        lane.thermal = thermal_gas(
            section_row(parts.row("Walls", names_of(THERMAL_GAS)), settings, "gas_model"), lane.gas
        )
    if parts.scenario.supply_lines is not None:
        relieving = parts.scenario.supply_lines.relieving
        lane.lines = rebuilt(
            SupplyLines, (relieving if path == "relieving" else settings[path] for path in parts.line_fields)
        )


def fill_chambers(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the initial angle, angular velocity and gas."""
    path = parts.program.angle
    if path is not None:
        angle, angular_velocity, _ = path.value(lane.path, 0.0)
    filled = parts.program.actuator.chambers(
        lane.plant,
        settings["motion.angle"] if path is None else angle,
        settings["initial.pressure_1"],
        settings["initial.pressure_2"],
    )
    lane.state = state_with_volumes(
        lane.plant,
        settings["motion.angle"] if path is None else angle,
        settings["motion.angular_velocity"] if path is None else angular_velocity,
        filled.volume_1,
        filled.volume_2,
        settings["initial.pressure_1"],
        settings["initial.pressure_2"],
    )


def start(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set all other initial states."""
    program = parts.program
    lane.result = LaneResult(0.0, NEVER_FAILED, 0.0)
    lane.pace = StepControl(lane.step)
    for name, of_plant in program.groups_of_plant.items():
        lane[name] = of_plant(lane.plant)
    if program.gas.START is not None:
        lane.masses = program.gas.START(lane.state)
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
    *(set_plant, put_leg_on, set_shank, count_steps, set_timing, choose_parts),
    *(set_laws, set_gas, fill_chambers, start, counted),
)
"""Functions that prepare the run of a scenario, in order of calling; the last one returns the step counts."""
