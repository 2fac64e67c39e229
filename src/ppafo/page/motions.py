"""Scenarios and walks on a page: tab title, initial changes, and limits declared only in files."""

import math
from collections.abc import Mapping
from typing import Any

from ppafo.model.controlled import TORQUE
from ppafo.simulation.declaration import OF_A_VANE, DeclaredContent
from ppafo.simulation.motion_kind import WALK
from ppafo.simulation.scenario import Scenario, vane_motion

_WALKED = 6
"""Initial duration of a walk on a page [s]."""


def is_walk(scenario: Scenario) -> bool:
    """Return whether a scenario is a walk."""
    return scenario.motion.motion_kind.layout == WALK


def declared_content(scenario: Scenario) -> DeclaredContent:
    """Return the declared content of a scenario or walk file."""
    if not is_walk(scenario):
        return OF_A_VANE
    from ppafo.walking.declaration import OF_A_WALK

    return OF_A_WALK


def tab_title(scenario: Scenario) -> str:
    """Return the title of the tab for scenarios of equal motion."""
    if is_walk(scenario):
        return "Walk"
    motion = vane_motion(scenario)
    if motion.profile is None:
        return "Step response" if scenario.controller.is_open_loop else "Free motion"
    if motion.locked_angle is None:
        return "Moving ankle"
    return "Torque task" if scenario.controlled == TORQUE else "Pressure task"


def usual_changes(scenario: Scenario) -> dict[str, str]:
    """Return the initial changes of a scenario on a page, as texts by key; a walk is shortened."""
    if not is_walk(scenario):
        return {}
    from ppafo.walking.motion import SHORTEST_STRIDES

    return {"run.duration": f"{max(_WALKED, math.ceil(SHORTEST_STRIDES * scenario.motion.stride_time))} s"}


def with_limits(entry: Mapping[str, Any], scenario: Scenario) -> dict[str, Any]:
    """Add the limits of a setting that a scenario file checks and a program does not."""
    if is_walk(scenario):
        from ppafo.walking.motion import LONGEST_MINUTES, SHORTEST_STRIDES

        stride = scenario.motion.stride_time
        if entry["key"] == "controller.first_stride_time":
            return {**entry, "minimum": 0.5 * stride, "maximum": 2.0 * stride}
        if entry["key"] == "run.duration":
            limits = {"minimum": SHORTEST_STRIDES * stride, "maximum": 60.0 * LONGEST_MINUTES}
            return {**entry, **limits, "is_minimum_allowed": True}
    return dict(entry)
