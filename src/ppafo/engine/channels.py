"""Channels that can be traced at a sample, and the paths of their numbers in a run."""

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
}
"""Additional channels of a walk: end of the path of a state variable, which not every controller has."""
REQUEST = "controller_state.request.torque"
"""Path of the torque that a walking controller requests."""
