"""The device on a walking leg: wearer, gait, sensors and event-based control, and the results."""

from ppafo.simulation.scenario import Scenario
from ppafo.walking.loading import list_walks, load_walk
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import Population, WalkComparison, compare_walks, walk, walk_population

__all__ = [
    "Population",
    "Scenario",
    "WalkComparison",
    "WalkResult",
    "compare_walks",
    "list_walks",
    "load_walk",
    "walk",
    "walk_population",
]
