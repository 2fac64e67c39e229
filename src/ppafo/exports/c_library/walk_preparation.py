"""Preparation of a walk from its settings: plain functions that call the planning of walks.

Data derived from a gait (series, events, heel rocker) are written as constants. Rows that the
planning reads as mappings are structs in C; therefore Python runs only the functions of ``preparation``.
"""

from typing import Any

from ppafo.engine.rows import rebuilt, section_row
from ppafo.errors import ScenarioError
from ppafo.exports.c_library.library import ExportParameter, Relation, Rule, c_identifier
from ppafo.exports.c_library.preparation import counted, set_gas, set_plant, set_timing, start
from ppafo.exports.c_library.prepared import Preparation, PreparedLane, names_of
from ppafo.exports.c_library.settings import declared_settings, export_parameters, numbers_of_second_chamber
from ppafo.model.declaration import Quantity
from ppafo.model.gait import gait_at
from ppafo.model.sensors import NOTHING_SEEN
from ppafo.parameters.building import consistency
from ppafo.parameters.graph import Graph, Link, holding
from ppafo.simulation.declaration import RUN, SUPPLY_LINE, SUPPLY_LINES
from ppafo.simulation.numbers import device_numbers
from ppafo.simulation.profiles import profile_parameters
from ppafo.simulation.scenario import Scenario
from ppafo.walking.contradictions import BEYOND_STOP, LONGEST_FIRST, PAIRS, SHORTEST_FIRST, angles_of_gait
from ppafo.walking.declaration import STEP
from ppafo.walking.gait_series import fit_rocker, gait_series, gait_timing
from ppafo.walking.motion import record_interval, walk_of
from ppafo.walking.planning import NO_REFERENCE, law_of
from ppafo.walking.preparation import (
    HIGHEST_ANGLE,
    LOWEST_ANGLE,
    device_share,
    gait_sensors,
    rocker_on_heel,
    smallest_chamber,
    vented_state,
    walk_from_strike,
    walk_step_counts,
    with_leg,
)
from ppafo.walking.wearer import WEARER, leg_parameters

_FORCES = ("force_bandwidth", "force_noise", "force_resolution", "lost_share")
_OTHERS = ("angle_bandwidth", "pressure_bandwidth", "angle_lost_share", "pressure_lost_share")
_RELATIONS = (
    *((pair.path, pair.relation, pair.other) for pair in PAIRS),
    ("controller.swing_angle", "above", "actuator.angle_min"),
    ("controller.swing_angle", "below", "actuator.angle_max"),
)
"""Relations between two numbers of a walk file."""


def check_can_be_exported(configuration: Scenario) -> None:
    """Raise ScenarioError if a walk cannot be exported."""
    if walk_of(configuration).bottle is not None:
        raise ScenarioError(
            f"{configuration.name}: a walk with a bottle cannot be exported, because only Python computes bottle and "
            "device together, step by step; omit the bottle, or add [supply_line]"
        )


def settings_of_walk(configuration: Scenario) -> tuple[ExportParameter, ...]:
    """Return every number of a walk in SI units, by the path used in overrides."""
    run, control = configuration.run, _control(configuration)
    times = {
        "run.duration": run.duration,
        "run.step": run.step,
        "run.output_interval": record_interval(run.duration),
        "controller.period": configuration.controller.period,
    }
    declared = {
        **declared_settings(configuration),
        **control,
        **{f"run.{quantity.name}": quantity for quantity in (*RUN, STEP)},
    }
    # The structures of libraries have the device first, then the times of the run, the wearer and the controller.
    run_times = (path for path in times if path.startswith("run."))
    wearer = (f"wearer.{quantity.name}" for quantity in WEARER)
    ordered = dict.fromkeys(
        (*device_numbers(configuration.device), *run_times, *wearer, "controller.period", *control, *declared)
    )
    settings = {path: declared[path] for path in ordered if path in declared}
    return export_parameters(configuration, settings, times)


def _control(configuration: Scenario) -> dict[str, Quantity]:
    """Return the settings of the controller by path, in the order of its parameters."""
    return {f"controller.{quantity.name}": quantity for quantity in law_of(configuration).quantities}


def links_of_walk(configuration: Scenario) -> Graph:
    """Return the links by which settings of a walk follow others unless changed."""
    known = {setting.path: setting.value for setting in settings_of_walk(configuration)}
    recorded = {"run.output_interval": (Link(("run.duration",), record_interval),)}
    # A plant alone has no settings of the controller that its walk had.
    links = {path: links for path, links in {**configuration.graph, **recorded}.items() if path in known}
    return holding(links, known | numbers_of_second_chamber(configuration))


def relations_of_walk(configuration: Scenario) -> tuple[Relation, ...]:
    """Return the required relations between settings, as checked in a file."""
    rules = [(path, relation, other) for path, relation, other, _ in consistency(configuration.device)]
    if configuration.supply_lines is not None:
        rules.append(("supply.dorsiflexion_pressure", "at most", "supply.pressure"))
    rules += _RELATIONS
    known = {setting.path for setting in settings_of_walk(configuration)}
    return tuple(
        Relation(c_identifier(path), relation, c_identifier(other))
        for path, relation, other in rules
        if path in known and other in known
    )


def rules_of_walk(configuration: Scenario) -> tuple[Rule, ...]:
    """Return the rules of a walk file with the gait, and of three numbers (``walking/contradictions.py``)."""
    stride, (low, high) = walk_of(configuration).gait.stride_time, angles_of_gait(configuration)
    first, peak = "controller_first_stride_time", "controller_peak_time"
    rules: tuple[Rule, ...] = (
        ("actuator_angle_max", f"{{}} >= {high - BEYOND_STOP!r}", ("actuator_angle_max",)),
        ("actuator_angle_min", f"{{}} <= {low + BEYOND_STOP!r}", ("actuator_angle_min",)),
        (first, f"{{}} > {SHORTEST_FIRST * stride!r}", (first,)),
        (first, f"{{}} < {LONGEST_FIRST * stride!r}", (first,)),
        (peak, "{} + {} <= 1.0", (peak, "controller_fall_time")),
    )
    known = {setting.name for setting in settings_of_walk(configuration)}
    return tuple(rule for rule in rules if known.issuperset(rule[2]))


def put_walking_leg_on(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set leg, gait, and the plant with both; the heel rocker has been fitted to the gait beforehand."""
    gait = walk_of(parts.scenario).gait
    lane["wearer"] = section_row(parts.row("Wearer", names_of(WEARER)), settings, "wearer")
    lane["rocker"] = rocker_on_heel(
        fit_rocker(gait)[0], fit_rocker(gait)[1], fit_rocker(gait)[2], settings["wearer.heel_lever"]
    )
    lane.leg = leg_parameters(lane["wearer"], lane["rocker"])
    lane.share = device_share(lane["bare"], lane.leg.gravity)
    lane.plant = with_leg(lane["bare"], lane.leg)
    lane.gait = parts.constant(gait_series(gait))
    lane.gait_timing = parts.constant(gait_timing(gait))


def set_walk_sensors(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the sensors."""
    lane.gait_sensors = gait_sensors(
        section_row(parts.row("SensorNumbers", (*_FORCES, *_OTHERS)), settings, "sensors"),
        settings["controller.period"],
    )


def count_walk_steps(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set number and length of the steps, as limited by the smallest volume and by the stiffness of gas that warms."""
    lane["room"] = lane.plant.atmospheric_pressure
    lane["volume"] = smallest_chamber(
        parts.program.actuator.chambers(lane.plant, LOWEST_ANGLE, lane["room"], lane["room"]),
        parts.program.actuator.chambers(lane.plant, HIGHEST_ANGLE, lane["room"], lane["room"]),
    )
    if parts.scenario.supply_lines is not None:
        lane["volume"] = min(lane["volume"], *(settings[f"{SUPPLY_LINE}.{line}.volume"] for line in SUPPLY_LINES))
    lane.counts_of_steps = walk_step_counts(
        settings["run.duration"],
        settings["run.step"],
        settings["run.output_interval"],
        settings["controller.period"],
        lane.plant,
        lane["volume"],
        settings["gas.heat_capacity_ratio"] if parts.program.is_thermal else 1.0,
    )
    lane.needs_parts = False


def set_walking_law(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the controller parameters; a walk has no reference."""
    lane.controller = rebuilt(law_of(parts.scenario).parameters, (settings[path] for path in _control(parts.scenario)))
    lane.reference = parts.constant(profile_parameters(NO_REFERENCE))


def start_walk(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the initial leg and gas states, at a heel strike."""
    lane.walk = walk_from_strike(gait_at(lane.gait, lane.gait_timing, lane.leg, 0.0))
    lane.gait_seen = parts.constant(NOTHING_SEEN)
    lane.state = vented_state(
        lane.plant,
        parts.program.actuator.chambers(lane.plant, lane.walk.now.ankle, lane["room"], lane["room"]),
        lane.walk.now.ankle,
        lane.walk.now.ankle_rate,
    )


WALK_PREPARATION = (
    *(set_plant, put_walking_leg_on, set_walk_sensors, count_walk_steps, set_timing),
    *(set_walking_law, set_gas, start_walk, start, counted),
)
"""Functions that prepare the run of a walk, in order of calling; the last one returns the step counts."""
