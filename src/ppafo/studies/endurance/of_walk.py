"""How long a bottle lasts on a walk: the gas that the walk took, repeated until the bottle ends."""

from ppafo.studies.endurance.bottle import PAPER_BOTTLE, load_bottle
from ppafo.studies.endurance.draw import Schedule, draw_of_numbers, largest_flow
from ppafo.studies.endurance.study import Endurance, endurance
from ppafo.walking import WalkResult

_LONGEST = 24.0 * 3600.0


def endurance_of_walk(result: WalkResult, bottle: str = PAPER_BOTTLE) -> Endurance | None:
    """Return how long a bottle lasts when the walk goes on; None where the walk took no gas.

    A step is a stride of the leg with the device.
    """
    gas = result.metrics.get("gas")
    if gas is None or gas.value <= 0.0:
        return None
    stride_time = result.configuration.gait.stride_time
    # An open valve may let gas back into the supply for moments, so the largest flow is that of a tenth of a second.
    peak = max(largest_flow(result.recording), gas.value / stride_time)
    draw = draw_of_numbers(gas.value, stride_time, peak)
    return endurance(load_bottle(bottle), draw, Schedule(_LONGEST, 0.0, _LONGEST))
