"""The device on a walking leg: wearer, gait, sensors and event-based control, and the results."""

from ppafo.walking.comparison import Comparison, compare_walks
from ppafo.walking.configuration import Configuration
from ppafo.walking.loading import list_walks, load_walk
from ppafo.walking.population import Population, walk_population
from ppafo.walking.walk import WalkResult, walk

__all__ = [
    "Comparison",
    "Configuration",
    "Population",
    "WalkResult",
    "compare_walks",
    "list_walks",
    "load_walk",
    "walk",
    "walk_population",
]
