"""Motion type of a walk along a prescribed gait: shank and loaded foot follow the gait, whatever the device does."""

import shlex
from dataclasses import dataclass
from typing import ClassVar

from ppafo.control.kind import ControllerKind
from ppafo.simulation.motion_kind import WALK, LawSignals
from ppafo.simulation.scenario import Scenario
from ppafo.walking import contradictions, evaluation, motion, planning


@dataclass(frozen=True, slots=True, eq=False)
class WalkKind:
    """Motion along a prescribed gait; each method delegates to the function of ``walking`` for the same purpose."""

    name: str
    section: ClassVar[None] = None
    layout: ClassVar[str] = WALK
    places = motion.PLACES
    command: ClassVar[str] = "walk"
    python_call: ClassVar[str] = "ppafo.walk({name!r}, overrides=[{overrides}])"
    is_measured_at_once: ClassVar[bool] = True
    is_repeated_for_its_error: ClassVar[bool] = False

    plan = staticmethod(planning.plan_walks)
    contradictory_numbers = staticmethod(contradictions.contradictory_numbers)
    quantities = staticmethod(motion.numbers_of_scenario)
    clock = staticmethod(motion.clock_with)
    switches = staticmethod(planning.flaws)
    noise = staticmethod(planning.noise)
    law = staticmethod(planning.law_of)
    lacks = staticmethod(evaluation.lacks)
    measured = staticmethod(evaluation.measured)

    def sees(self, _scenario: Scenario) -> LawSignals:
        """Return the torque signals that the controller receives."""
        return LawSignals(in_walk=True)

    def follows_reference(self, _scenario: Scenario) -> bool:
        """Return False: the controller generates its own reference in each phase of the gait."""
        return False

    def asks_gradually(self, law: ControllerKind) -> bool:
        """Return True if a control law requests partial valve openings to track its torque request."""
        return planning.requests_torque(law) and not law.only_switches

    def further_command(self, file: str) -> str:
        """Return the one-line command that compares the walk in a file with others."""
        return f"'ppafo walk {shlex.quote(file)}' compares it with a walk without device and a healthy ankle"


WALK_KIND = WalkKind(WALK)
"""Motion type of walk scenarios."""
