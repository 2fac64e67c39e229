"""Rules of scenario files beside ranges: knots in order, no course beyond what can be reached, a possible actuator.

The functions take what those of ``preparation`` take. A fault is the place of the setting to name, counted from 1.
"""

from collections.abc import Callable
from typing import Any

from ppafo.control.profiles import TabulatedProfile, disordered_knot
from ppafo.engine.rows import section_row
from ppafo.exports.c_library.preparation import Preparation, PreparedLane, count_steps, set_laws, set_shank
from ppafo.model.actuators.kind import Range
from ppafo.model.binding import made_of
from ppafo.model.catalog import ACTUATORS
from ppafo.model.controlled import CONTROLLED, Ends
from ppafo.simulation.profiles import ProfileCourse, excursion, widened

KNOTS = {"reference": "reference.time_02", "path": "motion.profile.time_02", "shank": "motion.shank.time_02"}
"""Path of the time of the second knot of a profile, by the group of its settings."""

ENDS = (
    *("actuator.angle_min", "actuator.angle_max"),
    *("supply.pressure", "supply.dorsiflexion_pressure", "supply.atmospheric_pressure"),
)
"""Settings that decide what a reference may reach, in the order of ``Ends``."""


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


def check_knots(parts: Preparation, lane: PreparedLane, settings: Any) -> None:  # noqa: ARG001
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


def faults(parts: Preparation, lane: PreparedLane, settings: Any) -> float:  # noqa: ARG001
    """Return the fault that was found."""
    return lane.fault


PROFILE_RULES = (set_shank, count_steps, set_laws, check_knots, check_courses, check_actuator, faults)
"""Functions that check the profiles of a scenario, in order of calling; the last one returns the fault."""
WALK_RULES = (check_knots, check_actuator, faults)
"""The same of a walk, in which a profile has no knots and leads nowhere."""
