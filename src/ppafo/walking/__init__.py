"""The device on a leg that walks: wearer, gait, sensors and event-based control put together, and what came of it."""

from ppafo.walking.configuration import Configuration
from ppafo.walking.loading import list_configurations, load_configuration
from ppafo.walking.walk import WalkResult, walk

__all__ = ["Configuration", "WalkResult", "list_configurations", "load_configuration", "walk"]
