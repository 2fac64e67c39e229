"""Presentation of a vane alone and of a walk on a page: tab, colour, claims, limits of the settings."""

import math
from collections.abc import Collection, Mapping
from typing import Any, ClassVar, final

from ppafo.report.style import PAGE_LOOKS
from ppafo.simulation.declaration import OF_A_VANE, DeclaredContent
from ppafo.simulation.motion_kind import VANE, WALK
from ppafo.simulation.scenario import Scenario, vane_motion

_FIRST_STRIDE = "controller.first_stride_time"
_WALKED = 6
"""Length [s] of a walk in a page, unless somebody wants more: five strides."""


@final
class _VaneAlone:
    """Presentation of scenarios of a vane."""

    claims: ClassVar[str] = "claims"
    """Section of ``words.toml`` with the claims of a page about it."""

    def declared(self) -> DeclaredContent:
        """Return what its file can hold."""
        return OF_A_VANE

    def look(self, scenario: Scenario) -> int:
        """Return the number of its colour."""
        return PAGE_LOOKS.get(scenario.device.valve.kind, 0)

    def tab(self, scenario: Scenario) -> str:
        """Return the title of the tab that it shares."""
        motion = vane_motion(scenario)
        if motion.profile is None:
            return "Step response" if scenario.controller.is_open_loop else "Unconstrained vane"
        return "Moving ankle" if motion.locked_angle is None else "Torque task"

    def usual_changes(self, _scenario: Scenario) -> dict[str, str]:
        """Return the changes with which it begins, texts by key."""
        return {}

    def with_limits(self, entry: Mapping[str, Any], _scenario: Scenario) -> dict[str, Any]:
        """Return a setting with the limits that its file has and its program has not."""
        return dict(entry)

    def relations(self, _keys: Collection[str]) -> list[dict[str, Any]]:
        """Return contradictions of settings that its file refuses and its program does not."""
        return []


@final
class _Walk:
    """Presentation of walks, with the same attributes."""

    claims: ClassVar[str] = "claims_of_walks"

    def declared(self) -> DeclaredContent:
        from ppafo.walking.declaration import OF_A_WALK

        return OF_A_WALK

    def look(self, _scenario: Scenario) -> int:
        # With and without the device, a walk takes colours in their order, as its figures do.
        return 0

    def tab(self, _scenario: Scenario) -> str:
        return "Walk"

    def usual_changes(self, scenario: Scenario) -> dict[str, str]:
        from ppafo.walking.motion import SHORTEST_STRIDES

        # A walk is short here.
        return {"run.duration": f"{max(_WALKED, math.ceil(SHORTEST_STRIDES * scenario.motion.stride_time))} s"}

    def with_limits(self, entry: Mapping[str, Any], scenario: Scenario) -> dict[str, Any]:
        from ppafo.walking.motion import LONGEST_MINUTES, SHORTEST_STRIDES

        stride = scenario.motion.stride_time
        if entry["key"] == _FIRST_STRIDE:
            return {**entry, "minimum": 0.5 * stride, "maximum": 2.0 * stride}
        if entry["key"] == "run.duration":
            limits = {"minimum": SHORTEST_STRIDES * stride, "maximum": 60.0 * LONGEST_MINUTES}
            return {**entry, **limits, "is_minimum_allowed": True}
        return dict(entry)

    def relations(self, keys: Collection[str]) -> list[dict[str, Any]]:
        from ppafo.walking.contradictions import COMPRESSION

        above = (
            ("controller.highest_pressure", "supply.pressure", COMPRESSION),
            ("controller.highest_pressure", "supply.dorsiflexion_pressure", COMPRESSION),
            ("controller.frozen_time", "controller.period", 2.0),
            ("controller.fill_time", "valve.delay", 1.0),
            ("controller.vent_time", "valve.delay", 1.0),
        )
        return [
            {"key": key, "relation": "above", "other": other, "factor": factor, "slack": 0.0}
            for key, other, factor in above
            if {key, other} <= set(keys)
        ]


_MOTIONS: Mapping[str, _VaneAlone | _Walk] = {VANE: _VaneAlone(), WALK: _Walk()}


def shown_motion(scenario: Scenario) -> _VaneAlone | _Walk:
    """Return what a page shows and asks of a scenario."""
    return _MOTIONS[scenario.motion.motion_kind.layout]
