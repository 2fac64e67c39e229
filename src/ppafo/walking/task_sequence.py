"""Task sequence: file, loading by name or path, and its segments in SI units."""

import functools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field

from ppafo.documents.models import SchemaVersion, make_schema, one_of, optional, table, validate
from ppafo.documents.problems import NAME, quote
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import PpafoError, ScenarioError, noted_in, raise_noted
from ppafo.model.declaration import Quantity
from ppafo.simulation.document import DocumentReader
from ppafo.simulation.schema import kind_field, model_name, number_type, quantity_fields
from ppafo.wording import nearest_name

FILE = TomlKind("task sequence", "task-sequence", resources.files("ppafo.walking") / "task_sequences", ScenarioError)

SLOWEST, FASTEST = 0.4, 1.6
"""Range of walking speeds in a task sequence [m/s]."""

SPEED = Quantity("speed", "m/s", "walking speed; the gait's unless given", None, SLOWEST, FASTEST)
CADENCE = Quantity("cadence", "1/s", "cadence, steps of both legs per time, in place of a speed", None, 0.5, 4.0)
DURATION = Quantity("duration", "s", "how long", None, 0.5, 3600.0)
WALKED_FOR = Quantity("duration", "s", "duration, rounded to whole strides", None, 0.5, 3600.0)
STRIDES = Quantity("strides", "1", "number of strides, in place of a duration", None, 1.0, 1.0e4)
ONE_STRIDE = Quantity("strides", "1", "number of strides of the transition", 1.0, 1.0, 20.0)
CONTACT = Quantity("contact", "s", "duration of toe contact in the swing", 0.04, 1.0e-3, 0.2)
TIME = Quantity("time", "1", "stride time relative to a regular stride", 0.75, 0.6, 1.6)
LENGTH = Quantity("length", "1", "length in the middle of the stride over the others'", 0.6, 0.2, 1.4)
SLOPE = Quantity("slope", "rad", "slope of the ground, above 0 uphill; level unless given", None, -0.175, 0.175)
RADIUS = Quantity("radius", "m", "radius of the turn; below 0 where the device is on the outer leg", 1.0, -10.0, 10.0)

_PACE = (SPEED, CADENCE, WALKED_FOR, STRIDES)
KINDS: dict[str, tuple[str, tuple[Quantity, ...]]] = {
    "stand": ("stands on both feet", (DURATION,)),
    "rest": ("sits, the foot flat on the ground and nearly unloaded", (DURATION,)),
    "start": ("starts to walk", (SPEED, CADENCE, ONE_STRIDE)),
    "walk": ("walks", (*_PACE, SLOPE)),
    "ramp": ("changes speed at a constant rate", _PACE),
    "turn": ("walks along a curve: the inner leg takes shorter steps than the outer one", (*_PACE, RADIUS)),
    "stop": ("stops and stands", (ONE_STRIDE,)),
    "stairs": ("climbs: the toes meet the ground before the heel", _PACE),
    "scuff": ("one stride in which the toes touch the ground in mid-swing", (CONTACT,)),
    "stumble": ("one stride of another time, shorter or longer in its middle", (TIME, LENGTH)),
}
"""Segment types by name: description and values."""

_STANDING = ("stand", "rest", "stop")
_NEED_WALKING = ("stop", "scuff", "stumble")
_OPTIONAL = (*_PACE, SLOPE)
"""Optional values of a segment."""

TIGHTEST = 0.5
"""Smallest radius of a turn [m]. Assumed."""


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
    # The content of the segments is checked segment by segment, so that messages name the segment.
    validate(_task_sequence_table(dict[str, Any], "TaskSequenceOutline"), document, file, ScenarioError)
    segments, wrong = [], list[PpafoError]()
    for number, segment in enumerate(document["segment"], start=1):
        with noted_in(wrong):
            kind = segment.get("kind")
            if not isinstance(kind, str) or kind not in KINDS:
                allowed = f"allowed: {', '.join(KINDS)}"
                if kind is None:
                    raise ScenarioError(f"{file}: segment {number}: 'kind' is missing; {allowed}")
                hint = nearest_name(str(kind), KINDS)
                raise ScenarioError(f"{file}: segment {number}: kind = {quote(kind)} is not known{hint}; {allowed}")
            prefix = f"{file}: segment {number} ({kind})"
            validate(_segment_table(kind), segment, prefix, ScenarioError)
            reading = DocumentReader(prefix, segment)
            present = [quantity for quantity in KINDS[kind][1] if quantity not in _OPTIONAL or quantity.name in segment]
            values = {quantity.name: reading.number(quantity.name, quantity) for quantity in present}
            strides = values.get("strides")
            if strides is not None and strides != int(strides):
                raise reading.refusal("strides", "must be a whole number")
            segments.append(TaskSegment(kind, values))
    raise_noted(wrong)
    sequence = TaskSequence(document["name"], document.get("description", ""), tuple(segments), file)
    raise_noted([sequence.refusal(index, reason) for index, reason in _contradictions(sequence.segments)])
    return sequence


def _contradictions(segments: Iterable[TaskSegment]) -> Iterator[tuple[int, str]]:
    """Yield each contradictory segment by its index from 0, with the reason."""
    walks = False
    for index, segment in enumerate(segments):
        values = segment.values
        if segment.kind in _NEED_WALKING and not walks:
            yield index, "the wearer is standing at this point; insert a walking segment first"
        if segment.kind == "start" and walks:
            yield index, "the wearer is already walking at this point: use 'ramp', or insert a 'stop' segment first"
        if "speed" in values and "cadence" in values:
            yield index, "give either speed or cadence, not both"
        if "radius" in values and abs(values["radius"]) < TIGHTEST:
            yield index, f"radius must be at least {TIGHTEST:g} m, or at most -{TIGHTEST:g} m"
        extents = [name for name in ("duration", "strides") if name in values]
        if segment.kind in ("walk", "ramp", "stairs", "turn") and len(extents) != 1:
            yield index, "give either duration or strides" + (", not both" if extents else "")
        if segment.kind == "ramp" and not {"speed", "cadence"} & values.keys():
            yield index, "give speed or cadence at the end of the ramp"
        walks = segment.kind not in _STANDING


@functools.cache
def _segment_table(kind: str) -> type[BaseModel]:
    """Return the Pydantic model of a segment of type ``kind``."""
    summary, quantities = KINDS[kind]
    required = tuple(quantity for quantity in quantities if quantity not in _OPTIONAL)
    not_required = {
        quantity.name: optional(number_type(quantity), quantity.summary)
        for quantity in quantities
        if quantity in _OPTIONAL
    }
    return table(f"{model_name(kind)}Segment", kind_field(kind, summary) | quantity_fields(required) | not_required)


@functools.cache
def _task_sequence_table(segment: Any, name: str) -> type[BaseModel]:
    """Return the Pydantic model of a task-sequence file with segments of the model ``segment``."""
    fields: dict[str, Any] = {
        "schema_version": (SchemaVersion, ...),
        "name": (str, Field(pattern=NAME, max_length=100)),
        "description": (str, Field("", description="description: who walks like this, and the purpose")),
        "segment": (
            Annotated[list[segment], Field(min_length=1)],
            Field(description="segments in order; the wearer starts from standing"),
        ),
    }
    return table(name, fields)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a file of a task sequence."""
    model = _task_sequence_table(one_of([_segment_table(kind) for kind in KINDS]), "TaskSequenceFile")
    return make_schema(model, "ppafo walk --task-sequence")
