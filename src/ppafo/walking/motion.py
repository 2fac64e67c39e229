"""The motion of a walk: who walks how, with which sensors, as frozen values in SI units. It makes a scenario a walk."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ppafo.gait import Gait
from ppafo.gait.plausible import gait_file_remarks
from ppafo.simulation.scenario import MotionKind, Scenario
from ppafo.walking.bottle import BottleSupply
from ppafo.walking.course import WalkingCourse
from ppafo.walking.preparation import FaultSettings
from ppafo.walking.wearer import Wearer, who_walks


@dataclass(frozen=True, slots=True)
class WalkMotion:
    """The device on a leg whose shank and loaded foot a gait leads, while it moves the free foot.

    ``timing`` is how the controller knows the time in the stride, ``forces`` are the settings [SI] of sensors that no
    vane has, by name, and ``faults`` those that fail, by sensor. ``course`` is what the wearer does one after the
    other, None where stride follows equal stride; ``bottle`` the one that the device hangs on, None where its supply
    does not end. ``wearer_origin`` says in words whose body mass it is. ``person`` is the number of the person of the
    population who walks, 0 for the wearer with the gait as it is, or a ``Person`` who is drawn already. It, and numbers
    of wearer, ``forces`` and ``faults``, may be arrays (runs,).
    """

    kind: MotionKind = field(compare=False)
    gait: Gait
    wearer: Wearer
    timing: str
    forces: Mapping[str, Any]
    faults: Mapping[str, FaultSettings]
    course: WalkingCourse | None = None
    bottle: BottleSupply | None = None
    wearer_origin: str = "the paper's subject"
    person: Any = 0.0

    @property
    def label(self) -> str:
        """The motion in a few words."""
        return f"a walk, gait {self.gait.name}" + ("" if self.course is None else f", course {self.course.name}")


def walk_of(scenario: Scenario) -> WalkMotion:
    """The motion of a scenario that is a walk."""
    motion = scenario.motion
    assert isinstance(motion, WalkMotion), "only walks come here"
    return motion


def person_remarks(scenario: Scenario) -> list[str]:
    """Return who walks, and what is odd about the zero of the gait's ankle."""
    motion = walk_of(scenario)
    remarks = [f"remark: {text}" for text in gait_file_remarks(motion.gait)]
    return [who_walks(motion.wearer, motion.gait, motion.wearer_origin), *remarks]
