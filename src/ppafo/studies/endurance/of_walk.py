"""How long a bottle lasts on a walk: the gas that the walk took, repeated until the bottle ends."""

from collections.abc import Iterable

from ppafo.studies.endurance.bottle import PAPER_BOTTLE, Bottle, load_bottle
from ppafo.studies.endurance.draw import Schedule
from ppafo.studies.endurance.reuse import parse_reuse
from ppafo.studies.endurance.study import Endurance, endurance
from ppafo.studies.endurance.walked import Walked, draw_of_walk, full_chambers, walked
from ppafo.walking import WalkResult

_LONGEST = 24.0 * 3600.0
WITHOUT_REST = Schedule(_LONGEST, 0.0, _LONGEST)


def endurance_of_walk(result: WalkResult, bottle: str = PAPER_BOTTLE, reuse: Iterable[str] = ()) -> Endurance | None:
    """Return how long a bottle lasts when the walk goes on; None where the walk took no gas.

    A step is a stride of the leg with the device. ``reuse`` are texts such as ``reservoir_volume=50 cm^3``: what they
    do not say of the chambers is taken from the walk.
    """
    walk = walked(result)
    if walk.gas_per_stride <= 0.0:
        return None
    return endurance_of_walked(walk, load_bottle(bottle), WITHOUT_REST, reuse)


def endurance_of_walked(walk: Walked, bottle: Bottle, schedule: Schedule, reuse: Iterable[str] = ()) -> Endurance:
    """Return how long a bottle lasts when a walk goes on; DataError where it took no gas."""
    given = tuple(reuse)
    draw = draw_of_walk(walk)
    return endurance(bottle, draw, schedule, parse_reuse(given, bottle, full_chambers(walk)) if given else None)
