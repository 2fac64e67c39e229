"""Channels that can be traced at a sample, and the paths of their numbers in a run."""

from collections.abc import Mapping

from ppafo.engine.rows import leaf_paths
from ppafo.model.controlled import CONTROLLED
from ppafo.signals.meter import Sample

_OF_METERS = ("number", "value", "gas", "energy", "foot", "stride")
TRACED: dict[str, str] = {
    **{name: f"sample.{name}" for name in Sample._fields if name not in _OF_METERS},
    **{kind.reference: "sample.reference" for kind in CONTROLLED.values()},
    **{name: f"sample.gas.{name}" for name in ("mass_1", "mass_2", "supplied_mass", "vented_mass", "leaked_mass")},
}
"""Channels that can be traced, with their paths in a run."""
TRACED_IN_WALKS: dict[str, str] = {
    "strides": "walk.strides",
    "phase": "walk.now.phase",
    "contact": "walk.contact",
    "shank_angle": "walk.now.shank",
    "healthy_angle": "walk.now.ankle",
    "external_torque": "walk.external_torque",
    "heel_force": "walk.heel_force",
    "toe_force": "walk.toe_force",
    "positive_push_off_work": "walk.positive_push_off_work",
    "net_push_off_work": "walk.net_push_off_work",
    "controller_phase": "controller_state.phase.phase",
    "safe_state": "controller_state.safety.level",
    "gait_fraction": "clock.fraction",
}
"""Additional channels of a walk: end of the path of a state variable, which not every controller has."""
REQUEST = "controller_state.request.torque"
"""Path of the torque that a walking controller requests."""


def paths_of_traces(states: Mapping[str, type], walks: bool) -> dict[str, str]:
    """Return the path in a run of each traceable channel that is not a state variable of the same name."""
    if not walks:
        return TRACED
    paths = [path for name, row in states.items() for path in leaf_paths(row, name)]
    found = {
        name: next((path for path in paths if path.endswith(ending)), "") for name, ending in TRACED_IN_WALKS.items()
    }
    return TRACED | {name: path for name, path in found.items() if path}
