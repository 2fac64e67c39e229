"""The device on a walking leg: wearer, gait, sensors and event-based control, and the results."""

from ppafo.simulation.scenario import Scenario
from ppafo.walking.loading import list_walks, load_walk
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import Comparison, Population, compare_walks, walk, walk_population

__all__ = [
    "Comparison",
    "Population",
    "Scenario",
    "WalkResult",
    "compare_walks",
    "list_walks",
    "load_walk",
    "walk",
    "walk_population",
]
