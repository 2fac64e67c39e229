"""Kinds of motion by name: what each brings to the runs of its scenarios, and where it is found.

A kind is loaded when a document or a scenario names it: a vane alone loads no walk.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar, runtime_checkable

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

ScenarioType_contra = TypeVar("ScenarioType_contra", contravariant=True)
"""A scenario, which has a motion and is defined above it."""


@dataclass(frozen=True, slots=True)
class RunTimes:
    """Duration, longest step, output interval and sample period [s]; the step divides the sample period."""

    duration: float
    step: float
    output_interval: float
    period: float


class LawSignals(NamedTuple):
    """Signals of a law: the row of its signals, their delay, and the paths that fill the row.

    ``places`` makes the two angles [rad] between which the joint is of the stops and the row. ``turning`` makes inertia
    and gravity torque of the row for a law of an angle; None for any other.
    """

    signals: type
    late: PlainFunction
    paths: tuple[str, ...]
    places: PlainFunction
    turning: PlainFunction | None = None


Measured = tuple["Recording", Mapping[str, "Metric"], str]
"""Recording and metrics of a run, and how it ended if it was completed, in words."""


@runtime_checkable
class MotionKind(Protocol[ScenarioType_contra]):
    """Contribution of a motion to the runs of its scenarios. Any number of a scenario may be an array (runs,)."""

    @property
    def name(self) -> str:
        """Name under which its catalogue has it."""

    @property
    def section(self) -> "MotionSection | None":
        """Table ``[motion]`` in the file of a vane alone; None in the layout of a walk."""

    @property
    def layout(self) -> str:
        """Layout of its files, libraries and pages: ``vane`` or ``walk``."""

    @property
    def places(self) -> Mapping[str, tuple[str, ...]]:
        """Attributes that lead to the numbers that are not where their path says, by path."""

    @property
    def command(self) -> str:
        """Word behind ``ppafo`` on the command line that shows what a scenario comes to."""

    @property
    def is_measured_at_once(self) -> bool:
        """True where the status of a run says what was measured, so that it cannot wait until somebody asks."""

    @property
    def reads_forces(self) -> bool:
        """True where a controller reads the forces under the foot beside the angle and the pressures."""

    @property
    def is_repeated_for_its_error(self) -> bool:
        """True where a run is so short that a second one tells the error of the first without being asked for."""

    def plan(self, scenario: ScenarioType_contra, /) -> "tuple[Run, tuple[Problem, ...]]":
        """Return the run and what may be wrong with it, as ``plan_vane`` does."""

    def contradictory_numbers(self, scenario: ScenarioType_contra, /) -> "tuple[Problem, ...]":
        """Return the numbers that do not go together."""

    def quantities(self, scenario: ScenarioType_contra, /) -> dict[str, Quantity]:
        """Return the declaration of the numbers of a scenario beside those of its device, by path."""

    def clock(
        self, scenario: ScenarioType_contra, times: Mapping[str, Any], /
    ) -> "tuple[RunTimes, tuple[Problem, ...]]":
        """Return the clock with other times [s], by path, and what is wrong with it."""

    def switches(self, scenario: ScenarioType_contra, /) -> tuple[Any, ...]:
        """Return settings that are 0 for all runs of a program or for none."""

    def noise(self, scenario: ScenarioType_contra, /) -> Any:
        """Return the sum of all levels of noise that the controller receives."""

    def law(self, scenario: ScenarioType_contra, /) -> "ControllerKind":
        """Return the controller with what the motion adds to it."""

    def sees(self, scenario: ScenarioType_contra, /) -> LawSignals:
        """Return how the controller sees what it controls."""

    def follows_reference(self, scenario: ScenarioType_contra, /) -> bool:
        """Tell whether the controller follows the reference of the scenario, and none that it makes itself."""

    def asks_gradually(self, law: "ControllerKind", /) -> bool:
        """Tell whether a law asks for openings between shut and open to follow what it wants."""

    def lacks(self, scenario: ScenarioType_contra, metric: "MetricKind", /) -> str:
        """Return why a scenario has not what a metric needs, an empty text where it has it."""

    def python_call(self, name: str, overrides: str, /) -> str:
        """Return the call of Python that shows a scenario of a name with overrides, which are quoted texts."""

    def further_command(self, file: str, /) -> str:
        """Return which command says more of a scenario than a run, in one line; an empty text where none does."""

    def measured(
        self, scenario: ScenarioType_contra, run: "Run", times: "Floats", rows: "Mapping[str, Floats]", /
    ) -> Measured:
        """Return what a run came to, from its rows (samples,) by path at times [s]."""


@dataclass(frozen=True, slots=True)
class MotionSection:
    """Table ``[motion]`` of a kind of motion of a vane alone: its numbers, and the table of a profile, if any.

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


VANE, WALK = "vane", "walk"
"""The layouts of a vane alone, and of a leg that a gait leads; the motion of that has the same name."""

VANE_MOTIONS = ("free", "locked", "prescribed", "leg")
"""Motions of a vane alone that this package has."""

_GROUP = "ppafo.motions"
MOTIONS: Kinds[MotionKind[Any]] = Kinds(_GROUP, "motion", MotionKind, declared_kinds(_GROUP))
"""Motions of a vane alone, and of a leg that walks with the device."""


def is_walk(name: str) -> bool:
    """Tell whether a kind of motion is a walk; KindError where the kind cannot be used."""
    kind = MOTIONS.get(name)
    return kind is not None and kind.layout == WALK
