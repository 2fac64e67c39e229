"""A course of walking as values: from a name or a file to its segments, in SI units."""

import functools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from ppafo.documents.models import NAME, make_schema, one_of, optional, quote, table, validate
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import ScenarioError, nearest_name
from ppafo.model.declaration import Quantity
from ppafo.simulation.reading import Reading
from ppafo.simulation.schema import kind_field, model_name, number_type, quantity_fields

FILE = TomlKind("course", "course", resources.files("ppafo.walking") / "courses", ScenarioError)

SLOWEST, FASTEST = 0.4, 1.6
"""Walking speeds of a course [m/s]."""

SPEED = Quantity("speed", "m/s", "walking speed; that of the gait unless given", None, SLOWEST, FASTEST)
CADENCE = Quantity("cadence", "1/s", "steps of both legs in a time, in place of a speed", None, 0.5, 4.0)
DURATION = Quantity("duration", "s", "how long", None, 0.5, 3600.0)
WALKED_FOR = Quantity("duration", "s", "how long; to the nearest whole number of strides", None, 0.5, 3600.0)
STRIDES = Quantity("strides", "1", "number of strides, in place of a duration", None, 1.0, 1.0e4)
ONE_STRIDE = Quantity("strides", "1", "number of strides that it takes", 1.0, 1.0, 20.0)
CONTACT = Quantity("contact", "s", "how long the toes touch the ground in the swing", 0.04, 1.0e-3, 0.2)
TIME = Quantity("time", "1", "time of the stride over that of the others", 0.75, 0.6, 1.6)
LENGTH = Quantity("length", "1", "length in the middle of the stride over that of the others", 0.6, 0.2, 1.4)

_PACE = (SPEED, CADENCE, WALKED_FOR, STRIDES)
KINDS: dict[str, tuple[str, tuple[Quantity, ...]]] = {
    "stand": ("stands on both feet", (DURATION,)),
    "rest": ("sits, the foot flat on the ground and nearly unloaded", (DURATION,)),
    "start": ("starts to walk", (SPEED, CADENCE, ONE_STRIDE)),
    "walk": ("walks", _PACE),
    "ramp": ("changes the speed evenly", _PACE),
    "stop": ("stops and stands", (ONE_STRIDE,)),
    "stairs": ("climbs: the toes meet the ground before the heel", _PACE),
    "scuff": ("one stride in which the toes touch the ground in mid-swing", (CONTACT,)),
    "stumble": ("one stride of another time, shorter or longer in its middle", (TIME, LENGTH)),
}
"""Kinds of segment: what the wearer does, and the values that it takes."""

_STANDING = ("stand", "rest", "stop")
_NEED_WALKING = ("stop", "scuff", "stumble")
_OPTIONAL = _PACE
"""Values that may be left out."""


@dataclass(frozen=True, slots=True)
class Segment:
    """One segment of a course; ``values`` in SI units by name, without those that were not given."""

    kind: str
    values: dict[str, float]


@dataclass(frozen=True, slots=True)
class WalkingCourse:
    """What the wearer does one after the other, who stands at the beginning; ``file`` is what messages call it."""

    name: str
    description: str
    segments: tuple[Segment, ...]
    file: str

    def refusal(self, number: int, reason: str) -> ScenarioError:
        """Return the error that says why a segment, counted from 0, is not usable."""
        return ScenarioError(f"{self.file}: segment {number + 1} ({self.segments[number].kind}): {reason}")


def list_courses() -> tuple[str, ...]:
    """Return the names of the courses that come with the package."""
    return FILE.names()


def load_course(name_or_path: str | Path) -> WalkingCourse:
    """Return a course by its name in the package or by the path of a TOML file; ScenarioError for a mistake in it."""
    file = label(str(name_or_path))
    document = FILE.parse(FILE.read(name_or_path), file)
    validate(_outline(), document, file, ScenarioError)
    segments = []
    for number, given in enumerate(document["segment"], start=1):
        kind = given.get("kind")
        if not isinstance(kind, str) or kind not in KINDS:
            allowed = f"allowed: {', '.join(KINDS)}"
            if kind is None:
                raise ScenarioError(f"{file}: segment {number}: 'kind' is missing; {allowed}")
            hint = nearest_name(str(kind), KINDS)
            raise ScenarioError(f"{file}: segment {number}: kind = {quote(kind)} is not known{hint}; {allowed}")
        place = f"{file}: segment {number} ({kind})"
        validate(_segment_table(kind), given, place, ScenarioError)
        segments.append(_segment(Reading(place, given), kind))
    course = WalkingCourse(document["name"], document.get("description", ""), tuple(segments), file)
    for index, reason in _contradictions(course.segments):
        raise course.refusal(index, reason)
    return course


def _segment(reading: Reading, kind: str) -> Segment:
    given = [item for item in KINDS[kind][1] if item not in _OPTIONAL or item.name in reading.document]
    segment = Segment(kind, {item.name: reading.number(item.name, item) for item in given})
    strides = segment.values.get("strides")
    if strides is not None and strides != int(strides):
        raise reading.refusal("strides", "must be a whole number")
    return segment


def _contradictions(segments: Iterable[Segment]) -> Iterator[tuple[int, str]]:
    """Segments, counted from 0, that cannot be as they are where they are, with the reason."""
    walks = False
    for index, segment in enumerate(segments):
        values = segment.values
        if segment.kind in _NEED_WALKING and not walks:
            yield index, "the wearer is standing at this point; insert a walking segment first"
        if segment.kind == "start" and walks:
            yield index, "the wearer walks there already: take 'ramp', or stop before it"
        if "speed" in values and "cadence" in values:
            yield index, "give either speed or cadence, not both"
        if segment.kind in ("walk", "ramp", "stairs") and ("duration" in values) == ("strides" in values):
            yield index, "give either duration or strides" + (", not both" if "strides" in values else "")
        if segment.kind == "ramp" and not {"speed", "cadence"} & values.keys():
            yield index, "give the speed or the cadence at its end"
        walks = segment.kind not in _STANDING


@functools.cache
def _segment_table(kind: str) -> type[BaseModel]:
    summary, quantities = KINDS[kind]
    given = tuple(item for item in quantities if item not in _OPTIONAL)
    free = {item.name: optional(number_type(item), item.summary) for item in quantities if item in _OPTIONAL}
    return table(f"{model_name(kind)}Segment", kind_field(kind, summary) | quantity_fields(given) | free)


def _course_table(segment: Any, name: str) -> type[BaseModel]:
    fields: dict[str, Any] = {
        "schema_version": (Literal[1], Field(description="version of this layout")),
        "name": (str, Field(pattern=NAME, max_length=100)),
        "description": (str, Field("", description="who walks like this, and why it is tried")),
        "segment": (
            Annotated[list[segment], Field(min_length=1)],
            Field(description="what the wearer does one after the other, who stands at the beginning"),
        ),
    }
    return table(name, fields)


@functools.cache
def _outline() -> type[BaseModel]:
    """The layout of a course without what is in its segments, which is checked segment by segment."""
    return _course_table(dict[str, Any], "CourseOutline")


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a file of a course."""
    model = _course_table(one_of([_segment_table(kind) for kind in KINDS]), "CourseFile")
    return make_schema(model, "ppafo walk --course")
