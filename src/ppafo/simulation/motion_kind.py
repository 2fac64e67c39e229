"""Kinds of motion by name: what each brings to the runs of its scenarios, and where it is found.

A kind is loaded when a document or a scenario names it: a vane alone loads no walk, and a walk along a prescribed gait
no neuromuscular model.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ppafo.errors import one_line
from ppafo.kinds import Kinds, declared_kinds


@dataclass(frozen=True, slots=True, eq=False)
class MotionKind:
    """What a motion of a leg that wears the device brings to the runs of its scenarios, as functions of the scenario.

    ``plan`` gives the run and what may be wrong with it, as ``plan_runs`` does; ``rules`` which numbers contradict each
    other. Any number may be an array (runs,) in both. ``quantities`` declares the numbers of the scenario beside those
    of its device, ``places`` says by path which attributes lead to those that are not where all scenarios have them.
    ``clock(scenario, times)`` gives the clock with other times [s], which may be arrays too, and what is wrong with it.
    ``noise`` is the sum of all levels of noise that its controller receives, ``switches`` are settings that are 0 for
    all runs of a program or for none. ``lacks(scenario, metric)`` says why it has not what a metric needs, an empty
    text where it has it. ``measured(scenario, run, times, rows)`` gives recording and metrics of rows (samples,) by
    path, and how a run that was completed ended, in words. ``walk`` is what the kinds of walks differ in, a
    ``walking.kind.WalkKind``.
    """

    name: str
    plan: Callable[..., Any]
    rules: Callable[..., Any]
    quantities: Callable[..., Any]
    places: Mapping[str, tuple[str, ...]]
    clock: Callable[..., Any]
    switches: Callable[..., tuple[Any, ...]]
    noise: Callable[..., Any]
    lacks: Callable[..., str]
    measured: Callable[..., Any]
    walk: Any


WALK, REACT = "walk", "react"
"""The motion of a leg that a gait leads, and the motion of a neuromuscular gait model."""

_GROUP = "ppafo.motions"
WALKS: Kinds[MotionKind] = Kinds(_GROUP, "motion", MotionKind, declared_kinds(_GROUP))
"""Motions of a leg that walks with the device; their files have sections of their own (``walking/declaration.py``)."""

RENAMED_KEYS = {"wearer.reacts": 'motion.kind = "react" and wearer.name = "{value}"'}
"""Keys of files of the version before, and what to write in their place."""


def renamed_key(path: str, value: object) -> str:
    """Return what to write in the place of an old key, with its value; an empty text for a key of today."""
    return f"is now {RENAMED_KEYS[path].format(value=one_line(value))}" if path in RENAMED_KEYS else ""
