"""Ground of a neuromuscular gait model: slopes, steps and pushes, of a task sequence or of settings, as one path.

Any number may be an array (runs,), or one that an export writes down.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ppafo.errors import ScenarioError
from ppafo.model.declaration import Quantity
from ppafo.walking.task_sequence import FORCE, HEIGHT, PUSHED_FOR, TaskSequence
from ppafo.wearer.model.way import LEVEL, PIECES, PUSHES, UNUSED, UNUSED_PUSH, Piece, Push, Way

_REFLEXES = ("walk", "step", "push")
"""What reflexes can do, or what can be done to them."""
_LEVEL_START = 1.0
"""Way [m] on level ground with which a task sequence begins."""

EDGE = 0.01
"""Length [m] of the steep piece that a step is: its edges are not sharp."""

SLOPE = Quantity("slope", "1", "rise of the ground over the way, above 0 uphill", 0.0, -0.2, 0.2)
STEP_HEIGHT = replace(HEIGHT, name="step_height", summary="height of one step of the ground, below 0 down", default=0.0)
GROUND_FROM = Quantity("ground_from", "m", "way on level ground before its slope and its step", 3.0, 1.0, 1.0e4)
PUSH = replace(FORCE, name="push", default=0.0)
PUSH_FROM = Quantity("push_from", "m", "way before the push", 5.0, 0.01, 1.0e4)
PUSH_DURATION = replace(PUSHED_FOR, name="push_duration", summary="how long the push lasts")
OF_THE_WAY = (SLOPE, STEP_HEIGHT, GROUND_FROM, PUSH, PUSH_FROM, PUSH_DURATION)
"""Numbers of a way without a task sequence."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """A part of the way: what it is (``walk``, ``step`` or ``push``), where it begins [m], and its numbers [SI]."""

    kind: str
    start: Any
    values: Mapping[str, Any]

    @property
    def title(self) -> str:
        """The stretch in words, of plain numbers."""
        if self.kind == "walk":
            slope = self.values["slope"]
            return f"slope of {100.0 * slope:+.3g} %" if slope else "level ground"
        if self.kind == "step":
            return f"step of {100.0 * self.values['height']:+.3g} cm"
        return f"push of {self.values['force']:+.3g} N for {self.values['duration']:.3g} s"

    @property
    def is_plain(self) -> bool:
        """Whether it is level ground, or a step or push of nothing."""
        return not any(self.values.get(name) for name in ("slope", "height", "force"))


REACH = 0.6
"""How far in front of the hip a foot meets the ground [m]."""


def met_by(stretches: Sequence[Stretch], hip: float) -> str:
    """Where a wearer of plain numbers is whose hip has come to a place [m]; an empty text before there is anything."""
    met = [item for item in stretches if item.start <= hip + (0.0 if item.kind == "push" else REACH)]
    last = next((item for item in reversed(met) if not item.is_plain), None)
    if last is None:
        return ""
    if last.kind == "walk" and last is met[-1]:
        return f"on the {last.title}"
    # A foot that is still on what was met, or has just left it, may have stumbled over it.
    beyond = hip - last.start
    return f"on the {last.title}" if beyond < REACH else f"{beyond:.1f} m after the {last.title}"


def stretches_of_settings(settings: Mapping[str, Any]) -> tuple[Stretch, ...]:
    """The way that the numbers of a wearer say: level, one step, a slope, and a push wherever it is."""
    start, level = settings[GROUND_FROM.name], {"distance": settings[GROUND_FROM.name], "slope": 0.0}
    push = {"force": settings[PUSH.name], "duration": settings[PUSH_DURATION.name]}
    return (
        Stretch("walk", 0.0, level),
        Stretch("step", start, {"height": settings[STEP_HEIGHT.name]}),
        Stretch("walk", start + EDGE, {"distance": math.inf, "slope": settings[SLOPE.name]}),
        Stretch("push", settings[PUSH_FROM.name], push),
    )


def check_reacting_task_sequence(sequence: TaskSequence) -> None:
    """Raise ScenarioError for what a neuromuscular gait model cannot do."""
    for index, segment in enumerate(sequence.segments):
        if segment.kind not in _REFLEXES:
            raise sequence.refusal(
                index,
                "a neuromuscular gait model walks on, for the reflexes know nothing else; its task sequence has walk "
                "(with distance and slope), step and push",
            )
        others = [name for name in segment.values if segment.kind == "walk" and name not in ("distance", "slope")]
        if others:
            raise sequence.refusal(
                index, f"{others[0]}: the reflexes set the pace of a neuromuscular gait model: give distance, and slope"
            )
    first = sequence.segments[0]
    if first.kind != "walk" or first.values["distance"] < _LEVEL_START or first.values.get("slope"):
        raise sequence.refusal(0, f"a neuromuscular gait model begins with a level walk of {_LEVEL_START:g} m or more")


def stretches_of_task_sequence(sequence: TaskSequence) -> tuple[Stretch, ...]:
    """The way of a task sequence, which was checked to be one of a neuromuscular gait model."""
    place, found = 0.0, []
    for segment in sequence.segments:
        values = dict(segment.values)
        if segment.kind == "walk":
            values["slope"] = math.tan(values.get("slope", 0.0))
        found.append(Stretch(segment.kind, place, values))
        place += EDGE if segment.kind == "step" else values.get("distance", 0.0)
    return tuple(found)


def way_of(stretches: Sequence[Stretch]) -> Way:
    """The ground and the pushes of stretches, the first of which is level.

    Each piece begins at the height at which the one before ends; behind a step the slope is that before it.
    """
    pieces, pushes, slope = [LEVEL.pieces[0]], [], 0.0
    for stretch, after in zip(stretches[1:], (*stretches[2:], None), strict=True):
        values = stretch.values
        if stretch.kind == "push":
            pushes.append(Push(stretch.start, values["force"], values["duration"]))
        elif stretch.kind == "step":
            # Times the inverse: a number that an export writes down knows no division by a plain one.
            pieces.append(_piece(pieces[-1], stretch.start, values["height"] * (1.0 / EDGE)))
            if after is None or after.kind != "walk":
                pieces.append(_piece(pieces[-1], stretch.start + EDGE, slope))
        else:
            slope = values["slope"]
            pieces.append(_piece(pieces[-1], stretch.start, slope))
    if len(pieces) > PIECES or len(pushes) > PUSHES:
        raise ScenarioError(
            f"the ground has {len(pieces)} pieces, {PIECES} at most, and there are {len(pushes)} pushes, {PUSHES} at "
            "most: leave segments out"
        )
    return Way(
        (*pieces, *(UNUSED,) * (PIECES - len(pieces))),
        (*pushes, *(UNUSED_PUSH,) * (PUSHES - len(pushes))),
    )


def _piece(before: Piece, start: Any, slope: Any) -> Piece:
    # A sum with a negative factor, as such numbers know no difference either.
    height = before.height + before.slope * (start + -1.0 * before.start)
    return Piece(start=start, height=height, slope=slope, cosine=1.0 / np.sqrt(1.0 + slope * slope))
