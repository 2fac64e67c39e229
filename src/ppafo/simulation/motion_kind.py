"""Motion types by name: interface of a motion type to runs of scenarios, and modules that define the types.

A motion is loaded when a document or a scenario names it: scenarios of a vane alone load no walk.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar, runtime_checkable

from ppafo.kinds import Kinds, declared_kinds
from ppafo.model.declaration import Quantity

if TYPE_CHECKING:
    from ppafo.control.kind import ControllerKind
    from ppafo.engine.lanes import Floats
    from ppafo.engine.run import Run
    from ppafo.metrics.metric import Metric, MetricKind
    from ppafo.model.columns import Problem
    from ppafo.parameters.device import Device
    from ppafo.signals.recording import Recording

ScenarioType_contra = TypeVar("ScenarioType_contra", contravariant=True)
"""Scenario class of a motion type, defined in a package that imports this package."""


@dataclass(frozen=True, slots=True)
class RunTimes:
    """Duration, longest step, output interval and sample period [s]; the step divides the sample period."""

    duration: float
    step: float
    output_interval: float
    period: float


class LawSignals(NamedTuple):
    """Signals of a controller: the joint whose controlled quantity it sees.

    ``profile`` is the kind of the profile in ``section`` that leads the angle of the joint; "" if none does.
    """

    profile: str = ""
    section: str = ""
    is_locked: bool = False
    has_leg: bool = False
    in_walk: bool = False


Measured = tuple["Recording", Mapping[str, "Metric"], str]
"""Recording and metrics of a run, and a sentence on the end of a completed run."""


@runtime_checkable
class MotionKind(Protocol[ScenarioType_contra]):
    """Motion type: functions that plan, check and measure the runs of its scenarios.

    Any number of a scenario may be an array (runs,).
    """

    @property
    def name(self) -> str:
        """Name of the motion in its catalogue."""

    @property
    def section(self) -> "MotionSection | None":
        """Section ``[motion]`` in the file of a vane alone; None for a walk."""

    @property
    def layout(self) -> str:
        """Layout of the motion's files, libraries and pages: ``vane`` or ``walk``."""

    @property
    def places(self) -> Mapping[str, tuple[str, ...]]:
        """Attribute names of numbers whose path in the file differs from their attributes, keyed by path."""

    @property
    def command(self) -> str:
        """Subcommand of ``ppafo`` that shows the result of a scenario."""

    @property
    def python_call(self) -> str:
        """Template of the Python call that shows a scenario, with ``{name!r}`` and the quoted ``{overrides}``."""

    @property
    def is_measured_at_once(self) -> bool:
        """True if the status of a run depends on its metrics, which are then computed at once, not on first use."""

    @property
    def is_repeated_for_its_error(self) -> bool:
        """True if runs are short enough to be repeated for an error estimate without request."""

    def plan(self, scenario: ScenarioType_contra, /) -> "tuple[Run, tuple[Problem, ...]]":
        """Return the run and its possible problems, as ``plan_vane`` does."""

    def contradictory_numbers(self, scenario: ScenarioType_contra, /) -> "tuple[Problem, ...]":
        """Return the problems of contradictory numbers."""

    def quantities(self, scenario: ScenarioType_contra, /) -> dict[str, Quantity]:
        """Return the declarations of all numbers of a scenario except those of its device, keyed by path."""

    def clock(
        self, scenario: ScenarioType_contra, times: Mapping[str, Any], /
    ) -> "tuple[RunTimes, tuple[Problem, ...]]":
        """Return the clock with other times [s], by path, and the problems of contradictory times."""

    def switches(self, scenario: ScenarioType_contra, /) -> tuple[Any, ...]:
        """Return settings of which each, in one program, is either 0 for all runs or nonzero for all."""

    def noise(self, scenario: ScenarioType_contra, /) -> Any:
        """Return the sum of all noise levels of the controller's sensors, which is 0 only without noise."""

    def law(self, scenario: ScenarioType_contra, /) -> "ControllerKind":
        """Return the catalogue entry of the controller, extended for this motion."""

    def sees(self, scenario: ScenarioType_contra, /) -> LawSignals:
        """Return the signals that the controller reads."""

    def follows_reference(self, scenario: ScenarioType_contra, /) -> bool:
        """Tell whether the controller follows the reference of the scenario, and not one that it generates itself."""

    def asks_gradually(self, law: "ControllerKind", /) -> bool:
        """Tell whether a controller commands partial valve openings to follow its reference."""

    def lacks(self, scenario: ScenarioType_contra, metric: "MetricKind", /) -> str:
        """Return the reason why a metric does not apply to a scenario; "" if it applies."""

    def further_command(self, file: str, /) -> str:
        """Return the command that reports more about a scenario than a run does, in one line; "" if there is none."""

    def measured(
        self, scenario: ScenarioType_contra, run: "Run", times: "Floats", rows: "Mapping[str, Floats]", /
    ) -> Measured:
        """Return recording, metrics and end of a run, from its rows (samples,) by path at times [s]."""


@dataclass(frozen=True, slots=True)
class MotionSection:
    """Section ``[motion]`` for one motion of a vane alone: its numbers, and its profile table, if any.

    ``read(reading, device, duration, step, folder)`` returns the motion; ``duration`` and ``step`` are in seconds, and
    relative paths start from ``folder``.
    """

    summary: str
    numbers: tuple[Quantity, ...]
    read: "Callable[[Any, Device, float, float, Path], Any]"
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


VANE, WALK = "vane", "walk"
"""File layouts of a vane alone and of a walking leg; the walking motion is also named ``walk``."""

VANE_MOTIONS = ("free", "locked", "prescribed", "leg")
"""Motions of a vane alone in this package."""

_GROUP = "ppafo.motions"
MOTIONS: Kinds[MotionKind[Any]] = Kinds(_GROUP, "motion", MotionKind, declared_kinds(_GROUP))
"""Motions of a vane alone, and of a leg that walks with the device."""


def is_walk(name: str) -> bool:
    """Tell whether the named motion is a walk; KindError for a motion that cannot be used."""
    kind = MOTIONS.get(name)
    return kind is not None and kind.layout == WALK
