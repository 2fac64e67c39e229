"""The walk along a prescribed gait as a kind of motion: shank and loaded foot are led, whatever the device does."""

import shlex
from dataclasses import dataclass
from typing import ClassVar

from ppafo.control.kind import ControllerKind
from ppafo.simulation.law_signals import IN_WALK
from ppafo.simulation.motion_kind import WALK, LawSignals
from ppafo.simulation.scenario import Scenario
from ppafo.walking import contradictions, motion, planning, result


@dataclass(frozen=True, slots=True, eq=False)
class WalkKind:
    """Motion along a gait: each of its functions is the one of ``walking`` with the same meaning."""

    name: str
    section: ClassVar[None] = None
    layout: ClassVar[str] = WALK
    places = motion.PLACES
    command: ClassVar[str] = "walk"
    is_measured_at_once: ClassVar[bool] = True
    reads_forces: ClassVar[bool] = True
    is_repeated_for_its_error: ClassVar[bool] = False

    plan = staticmethod(planning.plan_walks)
    contradictory_numbers = staticmethod(contradictions.contradictory_numbers)
    quantities = staticmethod(motion.numbers_of_scenario)
    clock = staticmethod(motion.clock_with)
    switches = staticmethod(planning.switches)
    noise = staticmethod(planning.noise)
    law = staticmethod(planning.law_of)
    lacks = staticmethod(result.lacks)
    measured = staticmethod(result.measured)

    def sees(self, _scenario: Scenario) -> LawSignals:
        """Signals of the torque that the controller sees."""
        return IN_WALK

    def follows_reference(self, _scenario: Scenario) -> bool:
        """False: the controller makes its own reference in each phase of the gait."""
        return False

    def asks_gradually(self, law: ControllerKind) -> bool:
        """True where a law asks for openings between shut and open to follow the torque that it requests."""
        return planning.requests_torque(law) and not law.only_switches

    def python_call(self, name: str, overrides: str) -> str:
        """Return the call of Python that shows a walk of a name with overrides, which are quoted texts."""
        return f"ppafo.walk({name!r}, overrides=[{overrides}])"

    def further_command(self, file: str) -> str:
        """Return the command that compares the walk of a file with others, in one line."""
        return f"'ppafo walk {shlex.quote(file)}' compares it with no device and with a healthy ankle"


WALK_KIND = WalkKind(WALK)
"""The motion of a scenario that walks along a gait."""
