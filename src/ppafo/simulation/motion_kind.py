"""Motion types by name: interface of a motion type to runs of scenarios, and modules that define the types.

A motion is loaded when a document or a scenario names it: scenarios of a vane alone load no walk.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ppafo.kinds import Kinds, declared_kinds
from ppafo.model.declaration import Quantity

if TYPE_CHECKING:
    from ppafo.control.kind import ControllerKind
    from ppafo.engine.lanes import Floats
    from ppafo.engine.run import Run
    from ppafo.metrics.metric import Metric, MetricKind
    from ppafo.model.columns import Problem
    from ppafo.signals.recording import Recording

# File layouts of a vane alone and of a walking leg; the walking motion is also named ``walk``.
VANE = "vane"
WALK = "walk"
VANE_MOTIONS = ("free", "locked", "prescribed", "leg")
"""Motions of a vane alone in this package."""
_GROUP = "ppafo.motions"


class LawSignals(NamedTuple):
    """Signals of a controller: the joint whose controlled quantity it sees.

    ``profile`` is the kind of the profile in ``section`` that leads the angle of the joint; "" if none does.
    """

    profile: str = ""
    section: str = ""
    is_locked: bool = False
    has_leg: bool = False
    in_walk: bool = False


Measured = tuple["Recording", Mapping[str, "Metric"]]
"""Recording and metrics of a run."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionKind:
    """Motion type: functions of a scenario that plan, check and measure its runs.

    Any number of a scenario may be an array (runs,). ``layout`` is that of its files, libraries and pages: ``vane`` or
    ``walk``.

    - ``plan``: the run and its possible problems
    - ``measured``: recording and metrics of a run, from its rows (samples,) by path at times [s]
    - ``contradictions``: the checks of numbers that could contradict each other (``simulation/contradictions.py``)
    - ``quantities``: declarations of all numbers of a scenario except those of its device, by path
    - ``clock``: the times of runs [s] with other times, both by path, and the problems of contradictory times
    - ``flaws``: settings of the sensors, of which each, in one program, is 0 for all runs or for none
    - ``law``: catalogue entry of the controller, extended for this motion
    - ``asks_gradually``: of a law, True if it commands partial valve openings to follow what it tracks
    - ``sees``: signals that the controller reads
    - ``lacks``: reason why a metric does not apply; "" if it applies
    - ``section``: section ``[motion]`` in the file of a vane alone; None for a walk
    - ``places``: attribute names of numbers whose path in the file differs from their attributes, by path
    """

    name: str
    layout: str
    plan: "Callable[[Any], tuple[Run, tuple[Problem, ...]]]"
    measured: "Callable[[Any, Run, Floats, Mapping[str, Floats]], Measured]"
    contradictions: Callable[[Any], Iterable[Any]]
    quantities: Callable[[Any], dict[str, Quantity]]
    clock: "Callable[[Any, Mapping[str, Any]], tuple[dict[str, Any], tuple[Problem, ...]]]"
    flaws: Callable[[Any], tuple[Any, ...]]
    law: "Callable[[Any], ControllerKind]"
    asks_gradually: "Callable[[ControllerKind], bool]"
    sees: Callable[[Any], LawSignals]
    lacks: "Callable[[Any, MetricKind], str]"
    section: "MotionSection | None" = None
    places: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def command(self) -> str:
        """Subcommand of ``ppafo``, and function in Python, that shows the result of a scenario."""
        return "walk" if self.layout == WALK else "simulate"


@dataclass(frozen=True, slots=True)
class MotionSection:
    """Section ``[motion]`` for one motion of a vane alone: its numbers, and its profile table, if any.

    ``read(reading, folder)`` returns the motion; relative paths start from ``folder``.
    """

    summary: str
    numbers: tuple[Quantity, ...]
    read: Callable[[Any, Path], Any]
    profile: "ProfileTable | None" = None


@dataclass(frozen=True, slots=True)
class ProfileTable:
    """Table of a profile within ``[motion]``: its ``kind`` and settings; ``name`` is also the motion's attribute.

    ``settings(kind)`` declares its numbers. ``own`` maps ``kind`` values that are no profiles to the texts that each
    requires, with the meaning of each.
    """

    name: str
    summary: str
    settings: Callable[[str], tuple[Quantity, ...]]
    own: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


MOTIONS: Kinds[MotionKind] = Kinds(_GROUP, "motion", MotionKind, declared_kinds(_GROUP))
"""Motions of a vane alone, and of a leg that walks with the device."""


def is_walk(name: str) -> bool:
    """Tell whether the named motion is a walk; KindError for a motion that cannot be used."""
    kind = MOTIONS.get(name)
    return kind is not None and kind.layout == WALK
