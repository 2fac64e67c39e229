"""Kinds of motion by name: what each brings to the runs of its scenarios, and where it is found.

A kind is loaded when a document or a scenario names it: a vane alone loads no walk.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

from ppafo.kinds import Kinds, declared_kinds
from ppafo.model.declaration import PlainFunction, Quantity

if TYPE_CHECKING:
    from ppafo.control.kind import ControllerKind
    from ppafo.engine.lanes import Floats
    from ppafo.engine.run import Run
    from ppafo.metrics.metric import Metric, MetricKind
    from ppafo.model.columns import Problem
    from ppafo.parameters.device import Device
    from ppafo.signals.recording import Recording

ScenarioType = TypeVar("ScenarioType")
"""A scenario, which has a motion and is defined above it."""


@dataclass(frozen=True, slots=True)
class Clock:
    """Duration, longest step, output interval and sample period [s]; the step divides the sample period."""

    duration: float
    step: float
    output_interval: float
    period: float


class Seen(NamedTuple):
    """How a law sees what it controls: the row of its signals, how late they are, and the paths that fill the row.

    ``turning`` makes inertia and gravity torque of the row for a law of an angle; None for any other.
    """

    signals: type
    late: PlainFunction
    paths: tuple[str, ...]
    turning: PlainFunction | None = None


@dataclass(frozen=True, slots=True, eq=False)
class MotionKind(Generic[ScenarioType]):
    """What a motion brings to the runs of its scenarios, as functions of the scenario.

    ``plan`` gives the run and what may be wrong with it, as ``plan_runs`` does; ``rules`` which numbers contradict each
    other. Any number may be an array (runs,) in both. ``quantities`` declares the numbers of the scenario beside those
    of its device, ``places`` says by path which attributes lead to those that are not where their path says.
    ``clock(scenario, times)`` gives the clock with other times [s], which may be arrays too, and what is wrong with it.
    ``switches`` are settings that are 0 for all runs of a program or for none, ``noise`` is the sum of all levels of
    noise that its controller receives, ``law`` that controller with what the motion adds to it, and ``sees`` how it
    sees what it controls. ``lacks(scenario, metric)`` says why it has not what a metric needs, an empty text where it
    has it. ``measured(scenario, run, times, rows)`` gives
    recording and metrics of rows (samples,) by path, and how a run that was completed ended, in words.

    ``section`` is what the file of a vane alone has as ``[motion]``, None of a walk, whose file is laid out in another
    way.
    """

    name: str
    plan: "Callable[[ScenarioType], tuple[Run, tuple[Problem, ...]]]"
    rules: "Callable[[ScenarioType], tuple[Problem, ...]]"
    quantities: Callable[[ScenarioType], dict[str, Quantity]]
    places: Mapping[str, tuple[str, ...]]
    clock: "Callable[[ScenarioType, Mapping[str, Any]], tuple[Clock, tuple[Problem, ...]]]"
    switches: Callable[[ScenarioType], tuple[Any, ...]]
    noise: Callable[[ScenarioType], Any]
    law: "Callable[[ScenarioType], ControllerKind]"
    sees: Callable[[ScenarioType], Seen]
    lacks: "Callable[[ScenarioType, MetricKind], str]"
    measured: "Callable[[ScenarioType, Run, Floats, Mapping[str, Floats]], Measured]"
    section: "MotionSection | None" = None


Measured = tuple["Recording", Mapping[str, "Metric"], str]
"""Recording and metrics of a run, and how it ended if it was completed, in words."""


@dataclass(frozen=True, slots=True)
class MotionSection:
    """What ``[motion]`` holds for a kind of motion of a vane alone: its numbers, and the table of a profile, if any.

    ``read(reading, device, duration, step, folder)`` gives the motion; times are in seconds, and in ``folder`` relative
    paths begin.
    """

    summary: str
    numbers: tuple[Quantity, ...]
    read: "Callable[[Any, Device, float, float, Path], Any]"
    profile: "ProfileTable | None" = None


@dataclass(frozen=True, slots=True)
class ProfileTable:
    """A table of ``[motion]`` with the kind of a profile and its settings, an attribute ``name`` of the motion.

    ``settings(kind)`` declares its numbers, ``layout()`` is the model of the table. ``own`` are its kinds that are no
    profiles, with the texts that each needs.
    """

    name: str
    summary: str
    settings: Callable[[str], tuple[Quantity, ...]]
    layout: Callable[[], Any]
    own: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


WALK = "walk"
"""The motion of a leg that a gait leads."""

VANE_MOTIONS = ("free", "locked", "prescribed", "leg")
"""Motions of a vane alone that this package has."""

_GROUP = "ppafo.motions"
MOTIONS: Kinds[MotionKind[Any]] = Kinds(_GROUP, "motion", MotionKind, declared_kinds(_GROUP))
"""Motions of a vane alone, and of a leg that walks with the device."""


def is_walk(name: str) -> bool:
    """Tell whether a kind of motion is a walk; KindError where the kind cannot be used."""
    kind = MOTIONS.get(name)
    return kind is not None and kind.section is None
