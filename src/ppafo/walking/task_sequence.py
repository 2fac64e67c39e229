"""Task sequence: loading by name or file, its segments, and their conversion to timed parts in SI units."""

import functools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, Field

from ppafo.documents.models import SchemaVersion, make_schema, one_of, optional, table, validate
from ppafo.documents.problems import NAME, quote
from ppafo.documents.toml_text import TomlKind, label
from ppafo.engine.rows import leaves
from ppafo.errors import ScenarioError
from ppafo.gait import Gait
from ppafo.model.declaration import Quantity
from ppafo.model.elementary import sine_and_cosine
from ppafo.model.gait import NEVER, PARTS, STANDS_AT, GaitNow, GaitTiming, SequencePart, TimedSequence
from ppafo.model.leg import LegParameters
from ppafo.signals.recording import Floats
from ppafo.simulation.document import DocumentReader
from ppafo.simulation.schema import kind_field, model_name, number_type, quantity_fields
from ppafo.walking.preparation import standing_on
from ppafo.wording import nearest_name

FILE = TomlKind("task sequence", "task-sequence", resources.files("ppafo.walking") / "task_sequences", ScenarioError)

SLOWEST, FASTEST = 0.4, 1.6
"""Range of walking speeds in a task sequence [m/s]."""

SPEED = Quantity("speed", "m/s", "walking speed; the gait's unless given", None, SLOWEST, FASTEST)
CADENCE = Quantity("cadence", "1/s", "steps of both legs in a time, in place of a speed", None, 0.5, 4.0)
DURATION = Quantity("duration", "s", "how long", None, 0.5, 3600.0)
WALKED_FOR = Quantity("duration", "s", "how long; to the nearest whole number of strides", None, 0.5, 3600.0)
STRIDES = Quantity("strides", "1", "number of strides, in place of a duration", None, 1.0, 1.0e4)
ONE_STRIDE = Quantity("strides", "1", "number of strides that it takes", 1.0, 1.0, 20.0)
CONTACT = Quantity("contact", "s", "how long the toes touch the ground in the swing", 0.04, 1.0e-3, 0.2)
TIME = Quantity("time", "1", "time of the stride over the others'", 0.75, 0.6, 1.6)
LENGTH = Quantity("length", "1", "length in the middle of the stride over the others'", 0.6, 0.2, 1.4)
SLOPE = Quantity("slope", "rad", "slope of the ground, above 0 uphill; level unless given", None, -0.175, 0.175)
RADIUS = Quantity("radius", "m", "radius of the turn; below 0 where the device is on the outer leg", 1.0, -10.0, 10.0)

_PACE = (SPEED, CADENCE, WALKED_FOR, STRIDES)
KINDS: dict[str, tuple[str, tuple[Quantity, ...]]] = {
    "stand": ("stands on both feet", (DURATION,)),
    "rest": ("sits, the foot flat on the ground and nearly unloaded", (DURATION,)),
    "start": ("starts to walk", (SPEED, CADENCE, ONE_STRIDE)),
    "walk": ("walks", (*_PACE, SLOPE)),
    "ramp": ("changes the speed evenly", _PACE),
    "turn": ("walks along a curve: the inner leg takes shorter steps than the outer one", (*_PACE, RADIUS)),
    "stop": ("stops and stands", (ONE_STRIDE,)),
    "stairs": ("climbs: the toes meet the ground before the heel", _PACE),
    "scuff": ("one stride in which the toes touch the ground in mid-swing", (CONTACT,)),
    "stumble": ("one stride of another time, shorter or longer in its middle", (TIME, LENGTH)),
}
"""Kinds of segment: description and values."""

_STANDING = ("stand", "rest", "stop")
_NEED_WALKING = ("stop", "scuff", "stumble")
_OPTIONAL = (*_PACE, SLOPE)
"""Optional values of a segment."""

Numbers = Any
"""Float, or array (wearers,): the same arithmetic applies to both."""

STANDING_LOAD, RESTING_LOAD = 0.5, 0.1
"""Force on the foot [body weights]: in standing, with both feet loaded equally, and in sitting, from shank, foot and a
part of the thigh. The second is assumed; the segments alone are 0.061 (Winter 2009, table 4.1)."""

TIGHTEST, STEP_WIDTH = 0.5, 0.1
"""Smallest radius of a turn, and lateral distance between the feet [m]. Assumed."""

LOADING_TIME = 1.0
"""Time [s] for the change of load between standing and sitting, at most half of the segment. Assumed."""

TOES_DOWN = math.radians(10.0)
"""Angle [rad] by which the toes of the healthy foot point down, relative to flat, at contact with a stair. Assumed. A
device may hold the foot at another angle; only the forefoot is on the stair in any case."""


@dataclass(frozen=True, slots=True)
class TaskSegment:
    """Segment of a task sequence; ``values`` are the given numbers in SI units, by name."""

    kind: str
    values: dict[str, float]


@dataclass(frozen=True, slots=True)
class TaskSequence:
    """Consecutive tasks of a wearer, who initially stands; ``file`` is the file name for messages."""

    name: str
    description: str
    segments: tuple[TaskSegment, ...]
    file: str

    def refusal(self, number: int, reason: str) -> ScenarioError:
        """Return the error for an unusable segment, counted from 0, with the reason."""
        return ScenarioError(f"{self.file}: segment {number + 1} ({self.segments[number].kind}): {reason}")


def load_task_sequence(name_or_path: str | Path) -> TaskSequence:
    """Return a task sequence by name or path; raises ScenarioError for a mistake in the file."""
    file = label(str(name_or_path))
    document = FILE.parse(FILE.read(name_or_path), file)
    # What is in the segments is checked segment by segment.
    validate(_task_sequence_table(dict[str, Any], "TaskSequenceOutline"), document, file, ScenarioError)
    segments = []
    for number, segment in enumerate(document["segment"], start=1):
        kind = segment.get("kind")
        if not isinstance(kind, str) or kind not in KINDS:
            allowed = f"allowed: {', '.join(KINDS)}"
            if kind is None:
                raise ScenarioError(f"{file}: segment {number}: 'kind' is missing; {allowed}")
            hint = nearest_name(str(kind), KINDS)
            raise ScenarioError(f"{file}: segment {number}: kind = {quote(kind)} is not known{hint}; {allowed}")
        where = f"{file}: segment {number} ({kind})"
        validate(_segment_table(kind), segment, where, ScenarioError)
        reading = DocumentReader(where, segment)
        present = [quantity for quantity in KINDS[kind][1] if quantity not in _OPTIONAL or quantity.name in segment]
        values = {quantity.name: reading.number(quantity.name, quantity) for quantity in present}
        strides = values.get("strides")
        if strides is not None and strides != int(strides):
            raise reading.refusal("strides", "must be a whole number")
        segments.append(TaskSegment(kind, values))
    sequence = TaskSequence(document["name"], document.get("description", ""), tuple(segments), file)
    for index, reason in _contradictions(sequence.segments):
        raise sequence.refusal(index, reason)
    return sequence


def _contradictions(segments: Iterable[TaskSegment]) -> Iterator[tuple[int, str]]:
    """Yield each contradictory segment by its index from 0, with the reason."""
    walks = False
    for index, segment in enumerate(segments):
        values = segment.values
        if segment.kind in _NEED_WALKING and not walks:
            yield index, "the wearer is standing at this point; insert a walking segment first"
        if segment.kind == "start" and walks:
            yield index, "the wearer walks there already: take 'ramp', or stop before it"
        if "speed" in values and "cadence" in values:
            yield index, "give either speed or cadence, not both"
        if "radius" in values and abs(values["radius"]) < TIGHTEST:
            yield index, f"radius must be at least {TIGHTEST:g} m, either way"
        lengths = [name for name in ("duration", "strides") if name in values]
        if segment.kind in ("walk", "ramp", "stairs", "turn") and len(lengths) != 1:
            yield index, "give either duration or strides" + (", not both" if lengths else "")
        if segment.kind == "ramp" and not {"speed", "cadence"} & values.keys():
            yield index, "give the speed or the cadence at its end"
        walks = segment.kind not in _STANDING


@functools.cache
def _segment_table(kind: str) -> type[BaseModel]:
    summary, quantities = KINDS[kind]
    required = tuple(quantity for quantity in quantities if quantity not in _OPTIONAL)
    free = {
        quantity.name: optional(number_type(quantity), quantity.summary)
        for quantity in quantities
        if quantity in _OPTIONAL
    }
    return table(f"{model_name(kind)}Segment", kind_field(kind, summary) | quantity_fields(required) | free)


@functools.cache
def _task_sequence_table(segment: Any, name: str) -> type[BaseModel]:
    fields: dict[str, Any] = {
        "schema_version": (SchemaVersion, ...),
        "name": (str, Field(pattern=NAME, max_length=100)),
        "description": (str, Field("", description="who walks like this, and why it is tried")),
        "segment": (
            Annotated[list[segment], Field(min_length=1)],
            Field(description="what the wearer does one after the other, who stands at the beginning"),
        ),
    }
    return table(name, fields)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a file of a task sequence."""
    model = _task_sequence_table(one_of([_segment_table(kind) for kind in KINDS]), "TaskSequenceFile")
    return make_schema(model, "ppafo walk --task-sequence")


@dataclass(frozen=True, slots=True)
class TimedSegment:
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
    spans: tuple[TimedSegment, ...]
    steady: tuple[tuple[Numbers, Numbers], ...]
    duration: Numbers


class _Planner:
    """Builder of consecutive parts of a task sequence.

    ``ratio`` is the stride frequency relative to the recorded one [-], 0 for standing.
    """

    def __init__(self, frequency: Numbers, standing: Numbers, load: float) -> None:
        self.frequency = frequency
        # Zero in the shape of the frequency, which may be an array (wearers,).
        self.time: Numbers = 0.0 * frequency
        self.turns: Numbers = standing + self.time
        self.ratio = 0.0
        self.load = load
        self.stride = 0.0
        self.slope = 0.0
        self.parts: list[SequencePart] = []

    def stay(self, length: Numbers, load: float) -> None:
        """Stand for a time [s], while the load changes to its new value."""
        self.go(0.0, 0.0, 0.0, load, length=length)

    def go(
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
    resting = sequence.segments[0].kind == "rest"
    planner = _Planner(frequency, STANDS_AT * timing.heel_off, RESTING_LOAD if resting else STANDING_LOAD)
    spans: list[TimedSegment] = []
    steady: list[tuple[Numbers, Numbers]] = []
    for index, segment in enumerate(sequence.segments):
        start = planner.time
        ratio = _ratio(sequence, index, gait)
        steady += _strides(planner, segment, ratio, strike_angle)
        spans.append(TimedSegment(segment.kind, _title(segment), start, planner.time))
    duration = planner.time
    if planner.ratio == 0.0:
        # The last part never ends, so that a step beyond the last segment has a part too.
        planner.stay(NEVER, planner.load)
    else:
        planner.go(NEVER, planner.ratio, planner.stride, slope=planner.slope)
    if len(planner.parts) > PARTS:
        raise ScenarioError(
            f"{sequence.file}: has {len(planner.parts)} parts, changes of speed included, but at most {PARTS} are "
            f"allowed: omit segments, or split it into two task sequences"
        )
    # The engine has a fixed number of parts, and a part that never begins changes nothing.
    unused = planner.parts[0]._replace(start=NEVER)
    parts = (*planner.parts, *(unused,) * (PARTS - len(planner.parts)))
    return PlannedSequence(TimedSequence(parts), tuple(spans), tuple(steady), duration)


def _strides(
    planner: _Planner, segment: TaskSegment, ratio: float, strike_angle: Numbers
) -> Iterator[tuple[Numbers, Numbers]]:
    """Plan a segment; yield the interval [s] of steady strides on level ground, if any."""
    kind, values = segment.kind, segment.values
    if kind in ("stand", "rest"):
        left, load = values["duration"], RESTING_LOAD if kind == "rest" else STANDING_LOAD
        if planner.ratio > 0.0:
            planner.go(1.0, 0.0, 0.0, load)
        elif planner.load != load:
            changing = min(LOADING_TIME, 0.5 * left)
            planner.stay(changing + 0.0 * planner.frequency, load)
            left -= changing
        planner.stay(left + 0.0 * planner.frequency, load)
    elif kind == "stop":
        planner.go(values["strides"], 0.0, 0.0)
    elif kind == "start":
        planner.go(values["strides"], ratio, ratio)
    elif kind == "scuff":
        planner.go(1.0, planner.ratio, planner.ratio, scuff=values["contact"], slope=planner.slope)
    elif kind == "stumble":
        # Both frequencies of a half have the mean usual / time, so that it takes ``time`` of its usual time.
        usual = planner.ratio
        planner.go(0.5, usual * (2.0 / values["time"] - 1.0), usual * values["length"], slope=planner.slope)
        planner.go(0.5, usual, usual, slope=planner.slope)
    elif kind == "ramp":
        planner.go(_count(planner, values, 0.5 * (planner.ratio + ratio), 0.0), ratio, ratio)
    else:
        tilt = ratio * strike_angle + TOES_DOWN if kind == "stairs" else 0.0
        # Both feet turn by the same angle about the middle of the curve, each on its own circle.
        shorter = 1.0 - 0.5 * STEP_WIDTH / values["radius"] if kind == "turn" else 1.0
        slope = values.get("slope", 0.0)
        stride, begun = ratio * shorter, planner.time
        # Where speed, stride or slope is another than before, the first stride leads to it.
        changes = (planner.ratio, planner.stride, planner.slope) != (ratio, stride, slope)
        if changes:
            planner.go(1.0, ratio, stride, tilt=tilt, slope=slope)
        if changes and values.get("strides") == 1.0:
            return
        whole = _count(planner, values, ratio, planner.time - begun) - (changes if "strides" in values else 0)
        start = planner.time
        planner.go(whole, ratio, stride, tilt=tilt, slope=slope)
        if kind == "walk" and slope == 0.0:
            yield start, planner.time


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
                index, f"speed: gait '{gait.name}' has no walking speed, so it cannot be scaled to one; give a cadence"
            )
        # Step length over cadence stays as it is over the speeds of walking, so both go with the root.
        return math.sqrt(values["speed"] / recorded)
    # A cadence counts the steps of both legs.
    ratio = 0.5 * values["cadence"] * gait.stride_time if "cadence" in values else 1.0
    speed = (recorded or 1.0) * ratio * ratio
    if "cadence" in values and recorded is not None and not SLOWEST <= speed <= FASTEST:
        raise sequence.refusal(
            index,
            f"cadence: with the walk ratio of gait '{gait.name}' that is {speed:.3g} m/s; a task sequence goes at "
            f"{SLOWEST:g} to {FASTEST:g} m/s",
        )
    return ratio


def _title(segment: TaskSegment) -> str:
    """Return the name of a segment with its speed or cadence, for tables."""
    values = segment.values
    if "speed" in values:
        return f"{segment.kind}, {values['speed']:.3g} m/s"
    if "cadence" in values:
        return f"{segment.kind}, {60.0 * values['cadence']:.3g} steps/min"
    return segment.kind


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
