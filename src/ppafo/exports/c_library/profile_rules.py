"""Rules of scenario files beside ranges: knots in order, no course beyond what can be reached, a possible actuator.

The functions take what those of ``preparation`` take. A fault is the place of the setting to name, counted from 1.
"""

from typing import Any

from ppafo.control.profiles import TabulatedProfile, disordered_knot
from ppafo.engine.rows import section_row
from ppafo.exports.c_library.preparation import count_steps, set_laws, set_shank
from ppafo.exports.c_library.prepared import Preparation, PreparedLane
from ppafo.model.actuators.kind import Range
from ppafo.model.controlled import Ends
from ppafo.simulation.profiles import excursion, widened

KNOTS = {"reference": "reference.time_02", "path": "motion.profile.time_02", "shank": "motion.shank.time_02"}
"""Path of the time of the second knot of a profile, by the group of its settings."""


def fault_of_knots(profile: TabulatedProfile, second: float) -> float:
    """Return the place of the time of a knot that is not in order, from that of the second knot; 0 for none."""
    number = disordered_knot(profile)
    # Each knot has a time and a value.
    return second + 2.0 * (number - 2.0) if number > 0.0 else 0.0


def first_fault(found: float, further: float) -> float:
    """Return a fault, or a further one if there is none."""
    return found if found > 0.0 else further


def check_knots(parts: Preparation, lane: PreparedLane, settings: Any) -> None:  # noqa: ARG001
    """Set the fault of the knots of reference, prescribed angle and shank."""
    lane.fault = 0.0
    for group, second in KNOTS.items():
        if second in parts.places:
            lane.fault = first_fault(lane.fault, fault_of_knots(lane[group], parts.place_of(second)))


def check_courses(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the fault of a prescribed angle beyond the stops, or of a reference out of reach."""
    if parts.moves_on_path:
        lane["stops"] = widened(settings["actuator.angle_min"], settings["actuator.angle_max"])
        lane["outside"] = excursion(
            lane.path,
            lane["stops"][0],
            lane["stops"][1],
            settings["run.duration"],
            lane.counts_of_steps.step,
            parts=parts.course_of_angle,
        )
        lane.fault = first_fault(
            lane.fault, parts.place_of("motion.profile.level") if lane["outside"][0] >= 0.0 else 0.0
        )
    if parts.reach is not None:
        lane["reach"] = parts.reach(
            parts.row("Ends", Ends._fields)(
                settings["actuator.angle_min"],
                settings["actuator.angle_max"],
                settings["supply.pressure"],
                settings["supply.dorsiflexion_pressure"],
                settings["supply.atmospheric_pressure"],
            )
        )
        lane["limits"] = widened(lane["reach"][0], lane["reach"][1])
        lane["beyond"] = excursion(
            lane.reference,
            lane["limits"][0],
            lane["limits"][1],
            settings["run.duration"],
            lane.counts_of_steps.step,
            parts=parts.course_of_reference,
        )
        lane.fault = first_fault(lane.fault, parts.place_of("reference.level") if lane["beyond"][0] >= 0.0 else 0.0)


def check_actuator(parts: Preparation, lane: PreparedLane, settings: Any) -> None:
    """Set the fault of an actuator whose numbers are impossible together."""
    if parts.flaw is not None:
        lane["flaw"] = parts.flaw(
            section_row(parts.actuator_settings, settings, "actuator"), section_row(Range, settings, "actuator")
        )
        lane.fault = first_fault(
            lane["flaw"] + (parts.place_of(parts.first_of_actuator) - 1.0) if lane["flaw"] > 0.0 else 0.0, lane.fault
        )


def faults(parts: Preparation, lane: PreparedLane, settings: Any) -> float:  # noqa: ARG001
    """Return the fault that was found."""
    return lane.fault


PROFILE_RULES = (set_shank, count_steps, set_laws, check_knots, check_courses, check_actuator, faults)
"""Functions that check the profiles of a scenario, in order of calling; the last one returns the fault."""
