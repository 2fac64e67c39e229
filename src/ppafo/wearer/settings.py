"""A neuromuscular gait model in the file of a walk: whose reflexes, strength of each muscle, speed at the start.

The device is on the left leg. A strength is a muscle's of the left leg over the one that
the wearer's file gives it; the body, the right leg and all gains are the file's.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ppafo.engine.scheme.walking import NO_CLEARANCE
from ppafo.errors import DataError, ScenarioError, refused_as
from ppafo.model.contact import FLAT
from ppafo.model.declaration import Quantity
from ppafo.simulation.declaration import Reading, value_at
from ppafo.simulation.motion_kind import REACT
from ppafo.walking.motion import WalkMotion
from ppafo.walking.task_sequence import TaskSequence
from ppafo.wearer.loading import (
    FASTEST_START,
    IN_RADIANS,
    LARGEST_GAINS,
    SLOWEST_START,
    WearerFile,
    find_wearer,
    wearer_of,
    with_strengths,
)
from ppafo.wearer.model.nerves import Nerves, settled_nerves
from ppafo.wearer.model.reflexes import Gains
from ppafo.wearer.model.segments import Limb, Pose
from ppafo.wearer.model.walker import Fibres, Walker, Wearer, joints
from ppafo.wearer.model.way import NOT_PUSHED
from ppafo.wearer.published import felt_at, first_answer, start_of, start_with_size, with_size
from ppafo.wearer.scheme import STANDING, ReactingState, Reflexes, WalkNow
from ppafo.wearer.way import OF_THE_WAY, Stretch, stretches_of_settings, stretches_of_task_sequence, way_of

NAME = "wearer.name"
"""Where the file of a walk names the wearer."""
DEFAULT_NAME = "healthy-128"
NAME_SUMMARY = f"name of a wearer of the package, or the path of its file; {DEFAULT_NAME} unless given"

STRENGTHS = tuple(
    Quantity(f"{name}_strength", "1", f"strength of the {name} of the left leg, over the wearer's", 1.0, 0.01, 2.0)
    for name in Fibres._fields
)
GAINS = tuple(
    Quantity(
        f"{side}_{name}",
        "rad" if name in IN_RADIANS else "1",
        f"reflex gain {name} of the {side} leg; the wearer's unless given",
        0.0,
        0.0,
        LARGEST_GAINS[name],
    )
    for side in ("left", "right")
    for name in Gains._fields
)
"""Gains of the reflexes of both legs, forces in largest forces, lengths in optimum lengths."""

RATIOS = tuple(
    Quantity(f"{name}_ratio", "1", f"reflex gain {name} of both legs, over left_{name} and right_{name}", 1.0, 0.0, 5.0)
    for name in Gains._fields
)
"""Gains of both legs in proportion, for studies that scatter them whoever walks."""

LENGTH_RATIO = Quantity(
    "length_ratio", "1", "lengths of the body, its muscles and levers, over the wearer's", 1.0, 0.7, 1.3
)
MASS_RATIO = Quantity(
    "mass_ratio", "1", "masses of the body and forces of its muscles, over the wearer's", 1.0, 0.3, 2.0
)
START_SPEED = Quantity("start_speed", "m/s", "speed with which the walk begins", 1.3, SLOWEST_START, FASTEST_START)
REACTIONS = (*STRENGTHS, *GAINS, *RATIOS, LENGTH_RATIO, MASS_RATIO, START_SPEED, *OF_THE_WAY)
"""Numbers of a neuromuscular gait model."""

LONGEST_STEP = 1.0e-4
"""Longest step [s] of a neuromuscular gait model, and the default: 0.2 ms is wrong by 4 % in the speed of walking."""

STEP_OF_BODY = Quantity("step", "s", "largest step; 0.1 ms unless given", LONGEST_STEP, 1.0e-6, LONGEST_STEP)

FIRST_STRIDE = 1.0
"""Time [s] that stands for the stride before the first one."""


@dataclass(frozen=True, slots=True)
class ReactingWearer:
    """A neuromuscular gait model: its file, the body with muscles and gains that this gives, and its numbers by name.

    ``settings`` has the numbers of ``REACTIONS``, without the way's where there is a ``task_sequence``; each may be an
    array (runs,).
    """

    file: WearerFile
    body: Wearer
    settings: Mapping[str, Any]
    task_sequence: TaskSequence | None = None

    @property
    def name(self) -> str:
        """Name of the wearer."""
        return self.file.name

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """What the wearer meets on the way, one after the other."""
        if self.task_sequence is None:
            return stretches_of_settings(self.settings)
        return stretches_of_task_sequence(self.task_sequence)

    @property
    def weight(self) -> Any:
        """Weight of the body [N], an array where its mass is one."""
        return self.body.weight * self.settings[MASS_RATIO.name]

    @property
    def mass(self) -> Any:
        """Mass of the body [kg], likewise."""
        return self.weight / self.body.body.gravity

    def row(self) -> Wearer:
        """The body with the strengths of the leg with the device, as the engine takes it."""
        own = self.settings
        muscles = with_strengths(self.body.left, {name: own[f"{name}_strength"] for name in Fibres._fields})
        left, right = (
            Gains._make(own[f"{side}_{name}"] * own[f"{name}_ratio"] for name in Gains._fields)
            for side in ("left", "right")
        )
        body = self.body._replace(left=muscles, left_gains=left, right_gains=right, way=way_of(self.stretches))
        return with_size(body, own[LENGTH_RATIO.name], own[MASS_RATIO.name])


def wearer_of_walk(motion: WalkMotion) -> ReactingWearer:
    """Return the body that walks."""
    assert isinstance(motion.body, ReactingWearer), "the walk of a neuromuscular gait model"
    return motion.body


@dataclass(frozen=True, slots=True)
class BodyStart:
    """Where a wearer begins: body, reflexes, nerves, and of the left leg ankle [rad] and what counts the strides."""

    walker: Walker
    reflexes: Reflexes
    nerves: Nerves
    ankle: float
    walk: ReactingState


_AT_REST = Pose(x=0.0, y=0.0, lean=0.0, left=Limb(0.0, 0.0, 0.0), right=Limb(0.0, 0.0, 0.0))


def start_of_body(wearer: ReactingWearer) -> BodyStart:
    """The start of a wearer: standing on the left leg, the right one swings, at the start speed."""
    walker = start_of(wearer.body, wearer.settings[START_SPEED.name])
    # At rest: what the legs feel in the pose of the start depends neither on the speed nor on their size, which may be
    # arrays; only the load does, for 20 ms.
    nerves = settled_nerves(*felt_at(wearer.body, walker._replace(rates=_AT_REST, halfway=_AT_REST), LONGEST_STEP))
    pose = walker.pose
    return BodyStart(
        walker=start_with_size(walker, wearer.settings[LENGTH_RATIO.name]),
        reflexes=Reflexes(ordered=first_answer(), due=1.0, until=0.0, umberger=0.0, bhargava=0.0),
        nerves=nerves,
        ankle=joints(pose.left, pose.lean).ankle,
        walk=_standing(pose.left, 0.5 * wearer.weight),
    )


def _standing(limb: Limb, force: Any) -> ReactingState:
    """The left leg as it strikes at the start, with this force [N] on heel and toes each."""
    return ReactingState(
        contact=FLAT,
        now=WalkNow(0.0, limb.shank),
        external_torque=0.0,
        heel_force=force,
        toe_force=force,
        toes_first=0.0,
        clearance=NO_CLEARANCE,
        since=0.0,
        stride_time=FIRST_STRIDE,
        strides=0.0,
        toe_landings=0.0,
        clearances=0.0,
        positive_push_off_work=0.0,
        net_push_off_work=0.0,
        load=1.0,
        other_load=0.0,
        muscle_work=0.0,
        fall_time=STANDING,
        pushed=NOT_PUSHED,
    )


def _check_way(reading: Reading, given: Mapping[str, Any], sequence: TaskSequence) -> None:
    """Raise ScenarioError for a task sequence with more pieces than there are, or beside a way that the wearer has."""
    with refused_as(ScenarioError, sequence.file, ScenarioError):
        way_of(stretches_of_task_sequence(sequence))
    for item in OF_THE_WAY:
        if item.name in given:
            raise reading.refusal(
                f"wearer.{item.name}", f"does not go with task sequence '{sequence.name}', which has the way"
            )


def read_reacting(
    reading: Reading, folder: Path, instead: Mapping[str, str], sequence: TaskSequence | None
) -> ReactingWearer:
    """Return the neuromuscular gait model of the file of a walk.

    A relative path begins in ``folder``; ``instead`` has the files that options name in place of the ones of the
    document. ScenarioError for what does not go with a neuromuscular gait model;
    DataError for a file that cannot be used.
    """
    name = value_at(reading.document, NAME) or DEFAULT_NAME
    given = reading.document.get("wearer", {})
    if "gait" in instead:
        raise ScenarioError(
            f"{reading.file}: gait '{instead['gait']}' does not go with motion.kind = '{REACT}' yet: leave it out"
        )
    if "gait" in reading.document:
        raise reading.refusal("gait", f"does not go with motion.kind = '{REACT}' yet: leave it out")
    if sequence is not None:
        _check_way(reading, given, sequence)
    with refused_as(DataError, reading.quote(NAME), DataError):
        file = find_wearer(folder / name if Path(name).suffix == ".toml" else name)
    own = {f"left_{name}": value for name, value in file.left_gains._asdict().items()}
    own |= {f"right_{name}": value for name, value in file.right_gains._asdict().items()}
    own |= {START_SPEED.name: file.speed}
    read = REACTIONS if sequence is None else tuple(item for item in REACTIONS if item not in OF_THE_WAY)
    # The file's numbers are the defaults of the settings, so that a walk file or an override changes any of them.
    numbers = tuple(replace(item, default=own.get(item.name, item.default)) for item in read)
    return ReactingWearer(file, wearer_of(file), reading.section("wearer", numbers), sequence)
