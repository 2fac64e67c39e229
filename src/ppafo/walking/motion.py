"""Motion of a walk: wearer, gait and sensors as frozen values in SI units; it makes a scenario a walk.

The functions below declare the values that may vary: numbers by path, and times as scalars or as arrays of an ensemble.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from ppafo.gait import Gait
from ppafo.gait.plausible import gait_file_remarks
from ppafo.model.columns import Problem, at, over_runs
from ppafo.model.declaration import Quantity
from ppafo.parameters.declared import quantities_in
from ppafo.simulation.declaration import THERMAL
from ppafo.simulation.motion_kind import MOTIONS, MotionKind
from ppafo.simulation.scenario import Scenario
from ppafo.walking.bottle.supply import BottleSupply
from ppafo.walking.declaration import FORCES, declared
from ppafo.walking.wearer import WEARER, Wearer, who_walks

SHORTEST_STRIDES = 5
"""Least number of strides of a walk; the controller adapts during the first two."""
LONGEST_MINUTES = 60.0
"""Longest duration of a walk [min]."""
_SECTIONS = "wearer", "controller", "sensors", "run", "gas_model", "supply_line"
"""Sections with numbers of a walk, in the order in which they are listed."""


@dataclass(frozen=True, slots=True)
class WalkMotion:
    """Walk of a wearer with the device; the gait prescribes shank and loaded foot, the device moves the free foot.

    The numbers of ``wearer`` and ``forces`` may be arrays (runs,).

    - ``kind``: name of this type of motion
    - ``gait``: prescribed gait
    - ``wearer``: leg of the wearer
    - ``forces``: settings [SI] of the force sensors, by name
    - ``bottle``: gas bottle, None for an unlimited supply
    - ``wearer_origin``: description of the origin of the body mass
    """

    kind: str = field(compare=False)
    gait: Gait
    wearer: Wearer
    forces: Mapping[str, Any]
    bottle: BottleSupply | None = None
    wearer_origin: str = "the paper's subject"
    locked_angle: ClassVar[None] = None

    @property
    def motion_kind(self) -> MotionKind:
        """Kind of this motion: its contribution to the runs."""
        return MOTIONS[self.kind]

    @property
    def stride_time(self) -> float:
        """Stride time of the gait [s]."""
        return float(self.gait.stride_time)

    @property
    def label(self) -> str:
        """Short description of the motion."""
        return f"a walk, gait {self.gait.name}"


def walk_of(scenario: Scenario) -> WalkMotion:
    """Return the motion of a walk scenario, with gait and wearer."""
    motion = scenario.motion
    assert isinstance(motion, WalkMotion), "only walks come here"
    return motion


def person_remarks(scenario: Scenario) -> list[str]:
    """Return remarks on the wearer, and on an unusual zero of the gait's ankle angle."""
    motion = walk_of(scenario)
    remarks = [f"remark: {text}" for text in gait_file_remarks(motion.gait)]
    return [who_walks(motion.wearer, motion.gait, motion.wearer_origin), *remarks]


PLACES: Mapping[str, tuple[str, ...]] = {
    **{f"wearer.{quantity.name}": ("motion", "wearer", quantity.name) for quantity in WEARER},
    **{f"sensors.{name}": ("motion", "forces", name) for name in FORCES},
}
"""Attributes or keys that lead to the numbers of a walk that other scenarios do not have, by path."""


def numbers_of_scenario(scenario: Scenario) -> dict[str, Quantity]:
    """Return the declarations of all numbers of a walk except those of the device, by path."""
    document: dict[str, Any] = {"controller": {"kind": scenario.controller.kind}}
    document |= {} if scenario.gas_model is None else {"gas_model": {"kind": THERMAL}}
    found = quantities_in(declared(document))
    sections = _SECTIONS if scenario.supply_lines is not None else _SECTIONS[:-1]
    return {path: found[path] for section in sections for path in found if path.partition(".")[0] == section}


def record_interval(seconds: float) -> float:
    """Return the sample interval of the recording [s] for a walk of this duration [s]; it is longer for a long walk."""
    return 1.0e-3 if seconds <= 61.0 else (5.0e-3 if seconds <= 601.0 else 2.0e-2)


def with_duration(scenario: Scenario, seconds: float) -> Scenario:
    """Return the walk with another duration [s] and the matching sample interval of the recording."""
    run = replace(scenario.run, duration=seconds, output_interval=record_interval(seconds))
    return replace(scenario, run=run)


def duration_problems(scenario: Scenario, seconds: Any) -> tuple[Problem, ...]:
    """Return the problems of a walk's duration [s], which may be an array (runs,)."""
    # The controller learns over the first strides, and means leave them out: a walk needs more than these.
    shortest = SHORTEST_STRIDES * walk_of(scenario).gait.stride_time
    fits = np.logical_and(seconds >= shortest, seconds <= 60.0 * LONGEST_MINUTES)

    def line(run: int) -> str:
        limits = f"at least {shortest / 60.0:.2g} min ({SHORTEST_STRIDES} strides) and at most {LONGEST_MINUTES:g} min"
        return f"a walk of {at(seconds, run) / 60.0:.6g} min: must be {limits}"

    return ((np.logical_not(fits), line),)


def clock_with(scenario: Scenario, times: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[Problem, ...]]:
    """Return the times of a walk [s] with other times [s], both by path, and the problems of these times.

    The times may be arrays (runs,).
    """
    clock = {path: time for path, time in times.items() if path != "controller.rate"}
    # A rate is another word for the period, and stands in its place.
    if "controller.rate" in times:
        clock["controller.period"] = 1.0 / times["controller.rate"]
    if "run.duration" not in times:
        return clock, ()
    clock["run.output_interval"] = over_runs(record_interval, times["run.duration"])
    return clock, duration_problems(scenario, times["run.duration"])
