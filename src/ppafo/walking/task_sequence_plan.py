"""Task sequence in time: its segments as consecutive parts for the engine, for one wearer or for many.

Numbers are floats or arrays (wearers,).
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ppafo.engine.rows import leaves
from ppafo.errors import ScenarioError
from ppafo.gait import Gait
from ppafo.model.elementary import sine_and_cosine
from ppafo.model.gait import NEVER, PARTS, STANDS_AT, GaitNow, GaitTiming, SequencePart, TimedSequence
from ppafo.model.leg import LegParameters
from ppafo.signals.recording import Floats
from ppafo.walking.preparation import standing_on
from ppafo.walking.task_sequence import FASTEST, SLOWEST, TaskSegment, TaskSequence

Numbers = Any
"""Float, or array (wearers,): the same arithmetic applies to both."""

STANDING_LOAD, RESTING_LOAD = 0.5, 0.1
"""Force on the foot [body weights]: in standing, with both feet loaded equally, and in sitting, from shank, foot and a
part of the thigh. The second is assumed; the segments alone are 0.061 (Winter 2009, table 4.1)."""

STEP_WIDTH = 0.1
"""Lateral distance between the feet [m]. Assumed."""

LOADING_TIME = 1.0
"""Time [s] for the change of load between standing and sitting, at most half of the segment. Assumed."""

TOES_DOWN = math.radians(10.0)
"""Angle [rad] by which the toes of the healthy foot point down, relative to flat, at contact with a stair. Assumed. A
device may hold the foot at another angle; only the forefoot is on the stair in any case."""


@dataclass(frozen=True, slots=True)
class _TimedSegment:
    """Segment in time: kind, title for tables, start and end [s] as floats or arrays (wearers,)."""

    kind: str
    title: str
    start: Numbers
    end: Numbers


@dataclass(frozen=True, slots=True)
class PlannedSequence:
    """Task sequence in time.

    ``timed`` holds the parts for the engine, ``spans`` the segments with start and end, ``steady`` the intervals [s] of
    equal strides on level ground, and ``duration`` is in [s].
    """

    timed: TimedSequence
    spans: tuple[_TimedSegment, ...]
    steady: tuple[tuple[Numbers, Numbers], ...]
    duration: Numbers


class _Planner:
    """Builder of consecutive parts of a task sequence, which keeps the wearer's pace at the end of the last part.

    - ``time``, ``turns``: time [s] and running phase [strides]
    - ``ratio``, ``stride``: stride frequency and stride relative to the recorded ones [-], 0 for standing
    - ``load``, ``slope``: force on the standing foot [body weights], and slope of the ground [rad]
    - ``parts``, ``steady``: planned parts, and intervals [s] of equal strides on level ground
    """

    def __init__(self, frequency: Numbers, turns: Numbers, load: float) -> None:
        self.frequency = frequency
        # Zero in the shape of the frequency, which may be an array (wearers,).
        self.time: Numbers = 0.0 * frequency
        self.turns: Numbers = turns + self.time
        self.ratio = 0.0
        self.load = load
        self.stride = 0.0
        self.slope = 0.0
        self.parts: list[SequencePart] = []
        self.steady: list[tuple[Numbers, Numbers]] = []

    def stand(self, length: Numbers, load: float) -> None:
        """Stand for a time [s], while the load changes to its new value."""
        self.walk(0.0, 0.0, 0.0, load, length=length)

    def walk(
        self,
        turns: Numbers,
        ratio: float,
        stride: float,
        load: float = STANDING_LOAD,
        tilt: Numbers = 0.0,
        scuff: float = 0.0,
        slope: float = 0.0,
        length: Numbers = None,
    ) -> None:
        """Walk a number of strides; stride frequency and stride change to new values relative to the recorded ones.

        The slope of the ground [rad] changes to its new value too. ``length`` [s] is computed from the strides by
        default.
        """
        if length is None:
            # The frequency changes evenly over the part, so its mean is that of both ends.
            length = turns / (0.5 * (self.ratio + ratio) * self.frequency)
        frequency = self.ratio * self.frequency
        self.parts.append(
            SequencePart(
                start=self.time,
                length=length,
                turns=self.turns,
                frequency=frequency,
                frequency_gain=ratio * self.frequency - frequency,
                stride=self.stride,
                stride_gain=stride - self.stride,
                load=self.load,
                load_gain=load - self.load,
                slope=self.slope,
                slope_gain=slope - self.slope,
                tilt=tilt,
                scuff=scuff,
            )
        )
        self.time, self.turns = self.time + length, self.turns + turns
        self.ratio, self.stride, self.load, self.slope = ratio, stride, load, slope


def plan_task_sequence(
    sequence: TaskSequence, gait: Gait, frequency: Numbers, timing: GaitTiming, strike_angle: Numbers
) -> PlannedSequence:
    """Return the task sequence in time for a wearer, or for many, with this stride frequency [Hz].

    ``strike_angle`` [rad] is the foot angle at heel strike relative to the flat foot. A speed or cadence is relative to
    the gait's, so each person of a population has an individual pace. Raises ScenarioError for a segment that the gait
    does not allow, or for too many parts.
    """
    load = RESTING_LOAD if sequence.segments[0].kind == "rest" else STANDING_LOAD
    planner = _Planner(frequency, STANDS_AT * timing.heel_off, load)
    spans: list[_TimedSegment] = []
    for index, segment in enumerate(sequence.segments):
        start, title = planner.time, segment.kind
        if "speed" in segment.values:
            title += f", {segment.values['speed']:.3g} m/s"
        elif "cadence" in segment.values:
            title += f", {60.0 * segment.values['cadence']:.3g} steps/min"
        _plan_segment(planner, segment, _ratio(sequence, index, gait), strike_angle)
        spans.append(_TimedSegment(segment.kind, title, start, planner.time))
    duration = planner.time
    if planner.ratio == 0.0:
        # The last part is endless, for steps after the last segment.
        planner.stand(NEVER, planner.load)
    else:
        planner.walk(NEVER, planner.ratio, planner.stride, slope=planner.slope)
    if len(planner.parts) > PARTS:
        raise ScenarioError(
            f"{sequence.file}: has {len(planner.parts)} parts including changes of speed, but at most {PARTS} are "
            f"allowed: omit segments, or split the file into two task sequences"
        )
    # The engine has a fixed number of parts: unused ones never begin.
    unused = planner.parts[0]._replace(start=NEVER)
    parts = (*planner.parts, *(unused,) * (PARTS - len(planner.parts)))
    return PlannedSequence(TimedSequence(parts), tuple(spans), tuple(planner.steady), duration)


def _plan_segment(planner: _Planner, segment: TaskSegment, ratio: float, strike_angle: Numbers) -> None:
    """Add the parts of a segment with a stride frequency relative to the recorded one [-]."""
    kind, values = segment.kind, segment.values
    if kind in ("stand", "rest"):
        rest, load = values["duration"], RESTING_LOAD if kind == "rest" else STANDING_LOAD
        if planner.ratio > 0.0:
            planner.walk(1.0, 0.0, 0.0, load)
        elif planner.load != load:
            loading = min(LOADING_TIME, 0.5 * rest)
            planner.stand(loading + 0.0 * planner.frequency, load)
            rest -= loading
        planner.stand(rest + 0.0 * planner.frequency, load)
    elif kind == "stop":
        planner.walk(values["strides"], 0.0, 0.0)
    elif kind == "start":
        planner.walk(values["strides"], ratio, ratio)
    elif kind == "scuff":
        planner.walk(1.0, planner.ratio, planner.ratio, scuff=values["contact"], slope=planner.slope)
    elif kind == "stumble":
        # The mean frequency of each half is usual / time, so that the stride takes ``time`` of the usual time.
        usual = planner.ratio
        planner.walk(0.5, usual * (2.0 / values["time"] - 1.0), usual * values["length"], slope=planner.slope)
        planner.walk(0.5, usual, usual, slope=planner.slope)
    elif kind == "ramp":
        planner.walk(_count(planner, values, 0.5 * (planner.ratio + ratio), 0.0), ratio, ratio)
    else:
        _plan_walk(planner, segment, ratio, strike_angle)


def _plan_walk(planner: _Planner, segment: TaskSegment, ratio: float, strike_angle: Numbers) -> None:
    """Add a segment of equal strides; where the pace or the slope changes, its first stride makes the change."""
    kind, values = segment.kind, segment.values
    tilt = ratio * strike_angle + TOES_DOWN if kind == "stairs" else 0.0
    # Both feet turn by the same angle about the centre of the curve, each on its own circle.
    stride = ratio * (1.0 - 0.5 * STEP_WIDTH / values["radius"] if kind == "turn" else 1.0)
    slope = values.get("slope", 0.0)
    start, changes = planner.time, (planner.ratio, planner.stride, planner.slope) != (ratio, stride, slope)
    if changes:
        planner.walk(1.0, ratio, stride, tilt=tilt, slope=slope)
        if values.get("strides") == 1.0:
            return
    count = _count(planner, values, ratio, planner.time - start) - (changes if "strides" in values else 0)
    start = planner.time
    planner.walk(count, ratio, stride, tilt=tilt, slope=slope)
    if kind == "walk" and slope == 0.0:
        planner.steady.append((start, planner.time))


def _count(planner: _Planner, values: dict[str, float], ratio: float, used: Numbers) -> Numbers:
    """Return the number of whole strides, at least 1, in the rest of a segment after ``used`` [s].

    ``ratio`` is the mean stride frequency relative to the recorded one [-].
    """
    if "strides" in values:
        return values["strides"]
    return np.maximum(np.rint((values["duration"] - used) * ratio * planner.frequency), 1.0)


def _ratio(sequence: TaskSequence, index: int, gait: Gait) -> float:
    """Return the stride frequency relative to the recorded one: the square root of the ratio of the speeds."""
    values, recorded = sequence.segments[index].values, gait.walking_speed
    if "speed" in values:
        if recorded is None:
            raise sequence.refusal(
                index, f"speed: gait '{gait.name}' has no walking speed and cannot be scaled; give a cadence"
            )
        # The ratio of step length and cadence is constant over the walking speeds: both follow the root of the speed.
        return math.sqrt(values["speed"] / recorded)
    # A cadence counts the steps of both legs.
    ratio = 0.5 * values["cadence"] * gait.stride_time if "cadence" in values else 1.0
    speed = (recorded or 1.0) * ratio * ratio
    if "cadence" in values and recorded is not None and not SLOWEST <= speed <= FASTEST:
        raise sequence.refusal(
            index,
            (
                f"cadence: results in {speed:.3g} m/s with the walk ratio of gait '{gait.name}'; must be "
                f"{SLOWEST:g} to {FASTEST:g} m/s"
            ),
        )
    return ratio


def pace_in_time(sequence: TimedSequence, time: Floats) -> tuple[Floats, Floats, Floats]:
    """Return phase [turns], stride frequency [Hz] and stride relative to the recorded one [-] at times [s].

    For one wearer; the polynomials are the ones of ``model.gait``, evaluated for arrays.
    """
    table = np.array([leaves(part) for part in sequence.parts], dtype=np.float64)
    row = table[np.searchsorted(table[:, 0], time, side="right") - 1].T
    start, length, turns, frequency, frequency_gain, stride, stride_gain = row[:7]
    fraction = np.minimum((time - start) / length, 1.0)
    value = fraction**3 * (10.0 + fraction * (6.0 * fraction - 15.0))
    integral = fraction**4 * (2.5 + fraction * (fraction - 3.0))
    return (
        turns + frequency * (time - start) + frequency_gain * length * integral,
        frequency + frequency_gain * value,
        stride + stride_gain * value,
    )


def turns_walked(sequence: TimedSequence, time: float) -> Numbers:
    """Return the number of strides, fractions included, from the start of a task sequence to a time [s].

    The numbers are floats or arrays (wearers,).
    """
    turns: Numbers = 0.0
    for part in sequence.parts:
        passed = np.clip(time - part.start, 0.0, part.length)
        fraction = passed / part.length
        integral = fraction**4 * (2.5 + fraction * (fraction - 3.0))
        turns = turns + part.frequency * passed + part.frequency_gain * part.length * integral
    return turns


def standing_gait(leg: LegParameters, timing: GaitTiming, sequence: TimedSequence) -> GaitNow:
    """Return the gait at the start of a task sequence: shank vertical, foot flat, both at rest.

    The numbers may be arrays (wearers,).
    """
    first = sequence.parts[0]
    return standing_on(leg, timing.ground_angle, *flat_foot(timing), first.turns, first.load)


def flat_foot(timing: GaitTiming) -> tuple[Numbers, Numbers]:
    """Return sine and cosine of the flat foot's angle from the horizontal, as floats or arrays (wearers,)."""
    ground: Numbers = timing.ground_angle
    return sine_and_cosine(ground / (2.0 * math.pi))
