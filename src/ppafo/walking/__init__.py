"""The device on a walking leg: wearer, gait, sensors and event-based control, and the results."""

from ppafo.simulation.scenario import Scenario
from ppafo.walking.loading import list_walks, load_walk
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import WalkComparison, compare_walks, walk

__all__ = [
    "Scenario",
    "WalkComparison",
    "WalkResult",
    "compare_walks",
    "list_walks",
    "load_walk",
    "walk",
]
