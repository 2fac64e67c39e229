"""The walk along a prescribed gait as a kind of motion: shank and loaded foot are led, whatever the device does."""

from ppafo.simulation.motion_kind import WALK, MotionKind, Seen
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.torque_loop import IN_WALK
from ppafo.walking.contradictions import rules
from ppafo.walking.motion import PLACES, clock_with, numbers_of_scenario
from ppafo.walking.planning import law_of, noise, plan_walks, switches
from ppafo.walking.result import lacks, measured


def _sees(_scenario: Scenario) -> Seen:
    return IN_WALK


WALK_KIND = MotionKind(
    name=WALK,
    plan=plan_walks,
    rules=rules,
    quantities=numbers_of_scenario,
    places=PLACES,
    clock=clock_with,
    switches=switches,
    noise=noise,
    law=law_of,
    sees=_sees,
    lacks=lacks,
    measured=measured,
)
"""The motion of a scenario that walks along a gait."""
