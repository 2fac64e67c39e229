"""What the kinds of walks differ in: who walks, with which numbers, and what a walk comes to."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ppafo.errors import KindError
from ppafo.model.declaration import Quantity
from ppafo.simulation.declaration import kind_at
from ppafo.simulation.motion_kind import MOTIONS, WALK


@dataclass(frozen=True, slots=True, eq=False)
class WalkKind:
    """A kind of walk: a leg that a gait leads, or a body that walks by itself.

    ``summary`` is for the layout of its files, ``label(motion)`` for messages. ``numbers`` and ``texts`` of
    ``[wearer]`` have their meaning, ``step`` is the largest step, ``interval(seconds)`` the time [s] between two
    samples of the record of a walk of this length [s]. ``read(reading, folder, instead, task_sequence)`` gives the
    attributes of ``WalkMotion`` that say who walks, after ``check_task_sequence``; ``links`` how the wearer's numbers
    follow others, ``duration(motion)`` how long a task sequence takes unless given [s], None where the motion does not
    say.

    ``subject`` is the word of metrics for what walks. ``result(scenario, run, time, record, status, supply)`` is that
    of the rows up to where a run failed, ``remarks(motion)`` say who walks, ``document(motion)`` has that as data.
    ``without`` gives the same walk without the help of the device, ``healthy`` the numbers to compare it with.
    ``finding`` and ``exported`` are places, ``module:NAME``, of what an analysis and an exported library have for it.
    """

    name: str
    summary: str
    label: Callable[[Any], str]
    numbers: tuple[Quantity, ...]
    texts: Mapping[str, str]
    step: Quantity
    interval: Callable[[float], float]
    check_task_sequence: Callable[[Any], None]
    read: Callable[..., Mapping[str, Any]]
    links: Callable[[Mapping[str, Any]], Any]
    duration: Callable[[Any], float | None]
    subject: str
    result: Callable[..., Any]
    remarks: Callable[[Any], list[str]]
    document: Callable[[Any], dict[str, Any]]
    without: Callable[[Any], Any]
    healthy: Callable[[Any], Any]
    finding: str
    exported: str


def kind_of_walk(name: str) -> WalkKind:
    """Return what a kind of motion is as a walk; KindError where it is none."""
    kind = MOTIONS.get(name or WALK)
    if kind is None or not isinstance(kind.walk, WalkKind):
        raise KindError(f"motion '{name}' is no walk")
    return kind.walk


def walk_kind_of(document: Mapping[str, Any]) -> WalkKind:
    """Return the kind of walk of a document, which is that along a gait unless its motion says otherwise."""
    return kind_of_walk(kind_at(document, "motion"))
