"""What the valves of a walking device can do, for the optimiser: shares of time to openings."""

from typing import Any

from ppafo.studies.league.bound_model import Openings

MODES = 3
"""What a valve can do, each for a share of the time: feed chamber 1, feed chamber 2, vent both."""


def proportional_openings(towards_1: Any, towards_2: Any, vents: Any) -> tuple[Any, Any, Any, Any]:
    """Openings of the spool valve with its dump valve."""
    return towards_1, towards_2 + vents, towards_2, towards_1 + vents


def solenoid_openings(towards_1: Any, towards_2: Any, _vents: Any) -> tuple[Any, Any, Any, Any]:
    """Openings of the solenoid pair: a chamber that is not fed is vented, whatever else."""
    return towards_1, 1.0 - towards_1, towards_2, 1.0 - towards_2


OPENINGS: dict[str, Openings] = {"proportional": proportional_openings, "solenoid": solenoid_openings}
"""By the kind of the valve."""
