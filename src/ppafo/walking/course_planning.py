"""From the segments of a course to its parts in time, for the strides of one wearer or of many."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.engine.rows import leaves
from ppafo.errors import ScenarioError
from ppafo.gait import Gait
from ppafo.model.course import NEVER, PARTS, STANDS_AT, Course, CoursePart
from ppafo.model.elementary import sine_and_cosine
from ppafo.model.gait import GaitNow, GaitTiming
from ppafo.model.leg import LegParameters
from ppafo.signals.recording import Floats
from ppafo.walking.course import FASTEST, SLOWEST, Segment, WalkingCourse
from ppafo.walking.preparation import standing_on

Numbers = Any
"""A float, or an array (wearers,): the arithmetic is the same."""

STANDING_LOAD, RESTING_LOAD = 0.5, 0.1
"""Body weights on the foot in standing, shared by both feet, and in sitting: shank and foot, and what rests of the
thigh. The second is assumed; the segments alone are 0.061 (Winter 2009, table 4.1)."""

LOADING_TIME = 1.0
"""Time [s] in which the load changes between standing and sitting, or half the segment. Assumed."""

TOES_DOWN = math.radians(10.0)
"""Angle of the healthy foot below the flat one where it meets a stair. Assumed. A device may hold the foot higher; only
the forefoot is on the stair all the same."""


@dataclass(frozen=True, slots=True)
class Span:
    """A segment in time: its kind, a title for tables, start and end [s], floats or arrays (wearers,)."""

    kind: str
    title: str
    start: Numbers
    end: Numbers


@dataclass(frozen=True, slots=True)
class PlannedCourse:
    """The parts of a course for the engine, its segments in time, and parts [s] of equal strides on level ground."""

    course: Course
    spans: tuple[Span, ...]
    steady: tuple[tuple[Numbers, Numbers], ...]
    duration: Numbers


class _Planner:
    """Puts part after part; ``ratio`` is of strides per second over the recorded ones, 0 in standing."""

    def __init__(self, frequency: Numbers, standing: Numbers, load: float) -> None:
        self.frequency = frequency
        self.time: Numbers = 0.0 * frequency
        self.turns: Numbers = standing + self.time
        self.ratio = 0.0
        self.load = load
        self.parts: list[CoursePart] = []

    def stay(self, length: Numbers, load: float) -> None:
        """Stand for a time [s]; the load changes over it."""
        self._add(length, 0.0, 0.0, 0.0, load, 0.0, 0.0)

    def go(
        self,
        turns: Numbers,
        ratio: float,
        stride: float,
        load: float = STANDING_LOAD,
        tilt: Numbers = 0.0,
        scuff: float = 0.0,
    ) -> None:
        """Walk some strides, over which strides per second and stride go to these values over the recorded ones."""
        length = turns / (0.5 * (self.ratio + ratio) * self.frequency)
        self._add(length, turns, ratio, stride, load, tilt, scuff)

    def _add(
        self, length: Numbers, turns: Numbers, ratio: float, stride: float, load: float, tilt: Numbers, scuff: float
    ) -> None:
        before = self.parts[-1].stride + self.parts[-1].stride_gain if self.parts else 0.0
        frequency = self.ratio * self.frequency
        self.parts.append(
            CoursePart(
                start=self.time,
                length=length,
                turns=self.turns,
                frequency=frequency,
                frequency_gain=ratio * self.frequency - frequency,
                stride=before,
                stride_gain=stride - before,
                load=self.load,
                load_gain=load - self.load,
                tilt=tilt,
                scuff=scuff,
            )
        )
        self.time, self.turns = self.time + length, self.turns + turns
        self.ratio, self.load = ratio, load


def plan_course(
    course: WalkingCourse, gait: Gait, frequency: Numbers, timing: GaitTiming, strike_angle: Numbers
) -> PlannedCourse:
    """The course of a wearer with these strides per second [Hz], or of many; ``strike_angle`` [rad] over flat.

    A speed or cadence is relative to that of the gait: people of a population walk each at their own. ScenarioError for
    a segment that the gait does not allow, or more parts than there are.
    """
    resting = course.segments[0].kind == "rest"
    planner = _Planner(frequency, STANDS_AT * timing.heel_off, RESTING_LOAD if resting else STANDING_LOAD)
    spans: list[Span] = []
    steady: list[tuple[Numbers, Numbers]] = []
    for index, segment in enumerate(course.segments):
        start = planner.time
        ratio = _ratio(course, index, gait)
        steady += _strides(planner, segment, ratio, strike_angle)
        spans.append(Span(segment.kind, _title(segment), start, planner.time))
    duration = planner.time
    if planner.ratio == 0.0:
        planner.stay(NEVER, planner.load)
    else:
        planner.go(NEVER, planner.ratio, planner.ratio)
    if len(planner.parts) > PARTS:
        raise ScenarioError(
            f"{course.file}: takes {len(planner.parts)} parts, a change of speed counted apart, and {PARTS} is the "
            "most: leave segments out, or make it two courses"
        )
    unused = planner.parts[0]._replace(start=NEVER)
    parts = (*planner.parts, *(unused,) * (PARTS - len(planner.parts)))
    return PlannedCourse(Course(parts), tuple(spans), tuple(steady), duration)


def _strides(
    planner: _Planner, segment: Segment, ratio: float, strike_angle: Numbers
) -> Iterator[tuple[Numbers, Numbers]]:
    """Plan a segment; where it walks on evenly and on level ground, that time [s] is given."""
    kind, values = segment.kind, segment.values
    if kind in ("stand", "rest"):
        _stand(planner, values["duration"], RESTING_LOAD if kind == "rest" else STANDING_LOAD)
    elif kind == "stop":
        planner.go(values["strides"], 0.0, 0.0)
    elif kind == "start":
        planner.go(values["strides"], ratio, ratio)
    elif kind == "scuff":
        planner.go(1.0, planner.ratio, planner.ratio, scuff=values["contact"])
    elif kind == "stumble":
        usual = planner.ratio
        planner.go(0.5, usual * (2.0 / values["time"] - 1.0), usual * values["length"])
        planner.go(0.5, usual, usual)
    elif kind == "ramp":
        planner.go(_count(planner, values, 0.5 * (planner.ratio + ratio), 0.0), ratio, ratio)
    else:
        tilt = ratio * strike_angle + TOES_DOWN if kind == "stairs" else 0.0
        yield from _walk(planner, values, ratio, tilt, is_level=kind == "walk")


def _stand(planner: _Planner, duration: float, load: float) -> None:
    if planner.ratio > 0.0:
        planner.go(1.0, 0.0, 0.0, load)
    elif planner.load != load:
        changing = min(LOADING_TIME, 0.5 * duration)
        planner.stay(changing + 0.0 * planner.frequency, load)
        duration -= changing
    planner.stay(duration + 0.0 * planner.frequency, load)


def _walk(
    planner: _Planner, values: dict[str, float], ratio: float, tilt: Numbers, is_level: bool
) -> Iterator[tuple[Numbers, Numbers]]:
    """Walk at one speed; where it is another than before, the first stride leads to it."""
    begun, changes = planner.time, planner.ratio != ratio
    if changes:
        planner.go(1.0, ratio, ratio, tilt=tilt)
    if changes and values.get("strides") == 1.0:
        return
    count = values["strides"] - changes if "strides" in values else None
    whole = _count(planner, values, ratio, planner.time - begun) if count is None else count
    start = planner.time
    planner.go(whole, ratio, ratio, tilt=tilt)
    if is_level:
        yield start, planner.time


def _count(planner: _Planner, values: dict[str, float], ratio: float, used: Numbers) -> Numbers:
    """Whole strides, one or more, in the time [s] of a segment of which some is used, at a mean ratio."""
    if "strides" in values:
        return values["strides"]
    return np.maximum(np.rint((values["duration"] - used) * ratio * planner.frequency), 1.0)


def _ratio(course: WalkingCourse, index: int, gait: Gait) -> float:
    """Strides per second over the recorded ones: the square root of the speed over the recorded one."""
    values, recorded = course.segments[index].values, gait.walking_speed
    if "speed" in values:
        if recorded is None:
            raise course.refusal(
                index, f"speed: gait '{gait.name}' has no walking speed, so it cannot be scaled to one; give a cadence"
            )
        return math.sqrt(values["speed"] / recorded)
    ratio = 0.5 * values["cadence"] * gait.stride_time if "cadence" in values else 1.0
    speed = (recorded or 1.0) * ratio * ratio
    if "cadence" in values and recorded is not None and not SLOWEST <= speed <= FASTEST:
        raise course.refusal(
            index,
            f"cadence: with the walk ratio of gait '{gait.name}' that is {speed:.3g} m/s; a course goes at {SLOWEST:g} "
            f"to {FASTEST:g} m/s",
        )
    return ratio


def _title(segment: Segment) -> str:
    """Name of a segment with its speed or cadence, for tables."""
    values = segment.values
    if "speed" in values:
        return f"{segment.kind}, {values['speed']:.3g} m/s"
    if "cadence" in values:
        return f"{segment.kind}, {60.0 * values['cadence']:.3g} steps/min"
    return segment.kind


@dataclass(frozen=True, slots=True, eq=False)
class PaceInTime:
    """Phase [turns], strides per second [Hz] and stride over the recorded one [-] at many times."""

    turns: Floats
    frequency: Floats
    stride: Floats


def pace_in_time(course: Course, time: Floats) -> PaceInTime:
    """Where one wearer is on a course at times [s]; the same polynomials as ``model.course``, for arrays."""
    table = np.array([leaves(part) for part in course.parts], dtype=np.float64)
    row = table[np.searchsorted(table[:, 0], time, side="right") - 1].T
    start, length, turns, frequency, frequency_gain, stride, stride_gain = row[:7]
    fraction = np.minimum((time - start) / length, 1.0)
    value = fraction**3 * (10.0 + fraction * (6.0 * fraction - 15.0))
    integral = fraction**4 * (2.5 + fraction * (fraction - 3.0))
    return PaceInTime(
        turns + frequency * (time - start) + frequency_gain * length * integral,
        frequency + frequency_gain * value,
        stride + stride_gain * value,
    )


def turns_walked(course: Course, time: float) -> Numbers:
    """Strides, parts of one included, from the start of a course to a time [s]; floats or arrays (wearers,)."""
    turns: Numbers = 0.0
    for part in course.parts:
        passed = np.clip(time - part.start, 0.0, part.length)
        fraction = passed / part.length
        integral = fraction**4 * (2.5 + fraction * (fraction - 3.0))
        turns = turns + part.frequency * passed + part.frequency_gain * part.length * integral
    return turns


def standing_gait(leg: LegParameters, timing: GaitTiming, course: Course) -> GaitNow:
    """Where a course begins: shank vertical, foot flat, both at rest; numbers may be arrays (wearers,)."""
    first = course.parts[0]
    sine, cosine = flat_foot(timing)
    return standing_on(leg, timing.ground_angle, sine, cosine, first.turns, first.load)


def flat_foot(timing: GaitTiming) -> tuple[Numbers, Numbers]:
    """Sine and cosine of the angle of the flat foot over the horizontal; floats or arrays (wearers,)."""
    ground: Numbers = timing.ground_angle
    return sine_and_cosine(ground / (2.0 * math.pi))
