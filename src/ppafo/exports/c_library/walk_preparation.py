"""Preparation of a walk from its settings: plain functions that call the planning of walks.

Data derived from a gait (series, events, heel rocker) are written as constants. Rows that the
planning reads as mappings are structs in C; therefore Python runs only the functions of ``preparation``.
"""

from collections.abc import Iterable
from typing import Any

from ppafo.engine.rows import component_row, section_row
from ppafo.engine.scheme.actuators import state_at_pressures
from ppafo.errors import ScenarioError
from ppafo.exports.c_library.library import Condition, ExportParameter, Relation
from ppafo.exports.c_library.preparation import (
    Preparation,
    PreparedLane,
    counted,
    names_of,
    set_gas,
    set_plant,
    set_timing,
    start,
)
from ppafo.model.gait import gait_at
from ppafo.model.sensors import NOTHING_SEEN
from ppafo.parameters.graph import Graph, Link
from ppafo.simulation.declaration import SUPPLY_LINE, SUPPLY_LINES
from ppafo.simulation.profiles import profile_parameters
from ppafo.simulation.scenario import Scenario
from ppafo.walking.contradictions import BEYOND_STOP, LONGEST_FIRST, PAIRS, SHORTEST_FIRST, angles_of_gait
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
    walk_from_strike,
    walk_step_counts,
    with_leg,
)
from ppafo.walking.wearer import WEARER, leg_parameters

_FORCES = ("force_bandwidth", "force_noise", "force_resolution", "lost_share")
_OTHERS = ("angle_bandwidth", "pressure_bandwidth", "angle_lost_share", "pressure_lost_share")
RELATIONS_OF_WALK = (
    *(Relation(pair.path, pair.relation, pair.other) for pair in PAIRS),
    Relation("controller.swing_angle", "above", "actuator.angle_min"),
    Relation("controller.swing_angle", "below", "actuator.angle_max"),
)
"""Relations between two numbers of a walk file."""
LINKS_OF_WALK: Graph = {"run.output_interval": (Link(("run.duration",), record_interval),)}
"""Link of the time that follows from the duration of a walk."""


def check_can_be_exported(configuration: Scenario) -> None:
    """Raise ScenarioError if a walk cannot be exported."""
    if walk_of(configuration).bottle is not None:
        raise ScenarioError(
            f"{configuration.name}: a walk with a bottle cannot be exported, because only Python computes bottle and "
            "device together, step by step; omit the bottle, or add [supply_line]"
        )


def rules_of_walk(configuration: Scenario, settings: Iterable[ExportParameter]) -> tuple[Condition, ...]:
    """Return the rules of a walk file with the gait, and of three numbers (``walking/contradictions.py``)."""
    stride = walk_of(configuration).gait.stride_time
    low, high = angles_of_gait(configuration)
    first = "controller_first_stride_time"
    peak = "controller_peak_time"
    rules = (
        (f"settings->actuator_angle_max >= {high - BEYOND_STOP!r}", "actuator_angle_max"),
        (f"settings->actuator_angle_min <= {low + BEYOND_STOP!r}", "actuator_angle_min"),
        (f"settings->{first} > {SHORTEST_FIRST * stride!r}", first),
        (f"settings->{first} < {LONGEST_FIRST * stride!r}", first),
        (f"settings->{peak} + settings->controller_fall_time <= 1.0", peak),
    )
    known = {setting.name for setting in settings}
    return tuple(rule for rule in rules if rule[1] in known)


def put_walking_leg_on(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set leg, gait, the plant with both, and the sensors; the heel rocker has been fitted to the gait beforehand."""
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
    lane.controller = component_row(law_of(parts.scenario), settings, "controller")
    lane.reference = parts.constant(profile_parameters(NO_REFERENCE))


def start_walk(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the initial leg and gas states, at a heel strike."""
    lane.walk = walk_from_strike(gait_at(lane.gait, lane.gait_timing, lane.leg, 0.0))
    lane.gait_seen = parts.constant(NOTHING_SEEN)
    lane.state = state_at_pressures(
        lane.plant,
        lane.walk.now.ankle,
        lane.walk.now.ankle_rate,
        lane["room"],
        lane["room"],
        parts=parts.program.functions,
    )


WALK_PREPARATION = (
    *(set_plant, put_walking_leg_on, count_walk_steps, set_timing),
    *(set_walking_law, set_gas, start_walk, start, counted),
)
"""Functions that prepare the run of a walk, in order of calling; the last one returns the step counts."""
