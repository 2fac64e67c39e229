"""Are both chamber volumes positive over the angles in use? Equations (4) and (5)."""

import math
from collections.abc import Iterator

from ppafo.parameters.audit.evidence import Evidence
from ppafo.parameters.audit.finding import Finding, Side

_SLOPE = "actuator.volume_per_angle"
_STOPS = ("actuator.angle_min", "actuator.angle_max")
_DEAD = ("actuator.dead_volume_1", "actuator.dead_volume_2")


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield an error for each chamber that has no volume left at one end of the range."""
    found, angles = evidence.numbers(_SLOPE, *_STOPS), evidence.angle_range()
    if found is None or angles is None or found[0] <= 0.0:
        return
    _, stop_low, stop_high = found
    low_path, low, high_path, high = angles
    yield from _chamber(evidence, 1, low - stop_low, high - low, low_path)
    yield from _chamber(evidence, 2, stop_high - high, high - low, high_path)


def _chamber(evidence: Evidence, chamber: int, travel: float, turn: float, end_path: str) -> Iterator[Finding]:
    """``travel`` [rad] is left between the end of the range and the angle where the swept volume is zero."""
    slope = evidence.number(_SLOPE) or math.inf
    dead_path, stop_path = _DEAD[chamber - 1], _STOPS[chamber - 1]
    dead = evidence.number(dead_path) or 0.0
    smallest = dead + slope * travel
    if smallest > 0.0:
        return
    empty = min(-travel - dead / slope, turn)
    end = evidence.in_set_unit(end_path, evidence.number(end_path) or 0.0)
    yield Finding(
        id=f"volume-{chamber}",
        severity="error",
        title=f"volume of chamber {chamber} is not positive over the range of angles",
        values=evidence.values_of(_SLOPE, stop_path, dead_path, end_path),
        sides=(
            Side(f"V{chamber} at the end of the range", smallest, "m^3"),
            Side("dead volume that is needed at least", -slope * travel, "m^3"),
            Side("part of the range without volume", empty / turn if turn else 1.0, ""),
        ),
        paragraph=(
            f"At {end} the volume of chamber {chamber} is {1e6 * smallest:.3g} cm^3; it is not positive over the last "
            f"{math.degrees(empty):.3g} of {math.degrees(turn):.3g} deg. Reconciled by counting the volume from the "
            f"end of the range ({stop_path} = {end}) with a dead volume for line and clearance, or by a dead volume of "
            f"more than {-1e6 * slope * travel:.3g} cm^3."
        ),
    )
