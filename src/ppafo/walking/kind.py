"""Motion type of a walk along a prescribed gait: shank and loaded foot follow the gait, whatever the device does."""

from ppafo.simulation.motion_kind import WALK, LawSignals, MotionKind
from ppafo.walking import contradictions, evaluation, motion, planning

WALK_KIND = MotionKind(
    WALK,
    layout=WALK,
    plan=planning.plan_walks,
    measured=evaluation.measured,
    contradictions=contradictions.contradictions,
    quantities=motion.numbers_of_scenario,
    clock=motion.clock_with,
    flaws=planning.flaws,
    law=planning.law_of,
    asks_gradually=lambda law: planning.requests_torque(law) and not law.only_switches,
    sees=lambda _scenario: LawSignals(in_walk=True),
    lacks=evaluation.lacks,
    places=motion.PLACES,
)
"""Motion type of walk scenarios."""
