"""The integer walking controller in the lanes, which keep whole numbers in floats, and its declaration."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from ppafo.control.fixed.converter import COMMAND_STEPS
from ppafo.control.fixed.walking.event_on_off import WalkCounts, WalkNumbers, sample
from ppafo.control.fixed.walking.numbers import NUMBERS, whole_numbers
from ppafo.control.fixed.walking.phases import HALVES, LONGEST, PUSH_OFF, SEVERAL, PhaseCounts, SwitchCounts
from ppafo.control.fixed.walking.readings import OF_CONVERTER, TOP, GaitConverter, GaitReadings, read_gait
from ppafo.control.fixed.walking.rows import kept_walk_counts, whole_walk_counts, whole_walk_numbers
from ppafo.control.fixed.walking.signs import LATE_FORCES, MOST_STRIDES, STOPPED, PressureCounts, SafetyCounts
from ppafo.control.fixed.walking.traces import MOST_LATE, EmptyingCounts, LandingCounts, SensorCounts, TraceCounts
from ppafo.control.kind import ControllerKind
from ppafo.control.walking.event_on_off import KIND as FLOAT_KIND
from ppafo.control.walking.safety import START as SAFETY_START
from ppafo.control.walking.safety import Finding, later_finding
from ppafo.model.command import VENT
from ppafo.model.declaration import Quantity
from ppafo.model.gait_sensors import GaitMeasurement


class WalkRows(NamedTuple):
    """The converter, and the numbers of the law."""

    converter: GaitConverter
    numbers: WalkNumbers


class PhaseShown(NamedTuple):
    """The phase, where recordings look for it."""

    phase: float


class SafetyShown(NamedTuple):
    """Level, how often help got less, and the last sign with the readings then: what recordings tell of a walk."""

    level: float
    ventings: float
    finding: Finding


class WalkStateRows(NamedTuple):
    """What recordings look for, and the state of the law."""

    phase: PhaseShown
    safety: SafetyShown
    counts: WalkCounts


def update(
    parameters: WalkRows, state: WalkStateRows, reference: float, measurement: GaitMeasurement, period: float
) -> tuple[float, WalkStateRows]:
    """Command [-] that ``sample`` gives for what the converter shows: 1, -1 or ``VENT``."""
    before = whole_walk_counts(state.counts)
    readings = read_gait(parameters.converter, measurement)
    steps, after = sample(whole_walk_numbers(parameters.numbers), before, readings)
    command = float(steps) / COMMAND_STEPS if steps != 0 else VENT
    vents = after.safety.level > before.safety.level
    shown = SafetyShown(
        level=float(after.safety.level),
        ventings=state.safety.ventings + (1.0 if vents else 0.0),
        finding=later_finding(vents, float(after.safety.sign), measurement, state.safety.finding),
    )
    return command, WalkStateRows(PhaseShown(float(after.phase.phase)), shown, kept_walk_counts(after))


_TRACE = TraceCounts(last=0, still=0, slow=0)
START_COUNTS = WalkCounts(
    phase=PhaseCounts(
        phase=0,
        heel=SwitchCounts(0, 0),
        toe=SwitchCounts(0, 0),
        spell=0,
        since_strike=0,
        stride=0,
        strikes=0,
    ),
    safety=SafetyCounts(
        level=0,
        sign=0,
        good_strides=0,
        heel_seen=0,
        toe_seen=0,
        toe_strides=0,
        steady=0,
        side=0,
        held=0,
        seen=SensorCounts(_TRACE, _TRACE, _TRACE),
        landing=LandingCounts(lowest=0, mark=0, late=0, late_toes=0),
        emptying=EmptyingCounts(lowest=0, angle=0, rising=0),
        slow=PressureCounts(0, 0),
        thin=0,
    ),
    lifting=0,
)
"""Nothing seen yet."""

_BIT, _TIME, _READING = (0, 1), (0, LONGEST), (0, TOP)
STATE_RANGES = {
    "phase": (0, PUSH_OFF),
    "loaded": _BIT,
    "against": _TIME,
    "spell": _TIME,
    "since_strike": _TIME,
    "stride": (0, HALVES),
    "strikes": (0, SEVERAL),
    "level": (0, STOPPED),
    "sign": (0, LATE_FORCES),
    "good_strides": (-1, MOST_STRIDES),
    "heel_seen": _BIT,
    "toe_seen": _BIT,
    "toe_strides": (0, MOST_STRIDES),
    "steady": _BIT,
    "side": (-1, 1),
    "held": _TIME,
    "last": _READING,
    "still": _TIME,
    "slow": _READING,
    "lowest": _READING,
    "mark": _READING,
    "late": (0, MOST_LATE),
    "late_toes": (0, MOST_LATE),
    "angle": _READING,
    "rising": _TIME,
    "first": _READING,
    "second": _READING,
    "thin": _TIME,
    "lifting": _BIT,
}
"""Lowest and highest of every number of ``WalkCounts``, by its own name."""


@dataclass(frozen=True, slots=True)
class FixedWalk:
    """The integer form of a walking controller.

    ``kind`` runs it in the lanes. ``sample(numbers, state, readings)`` is the law itself, on whole numbers only:
    command in steps, 0 to vent, and the next state. ``prepare(settings, period, converter)`` makes the whole numbers by
    name, in the order of ``number_quantities``, which may not be within their ranges yet.
    """

    kind: ControllerKind
    sample: Callable[..., Any]
    numbers: type
    readings: type
    begins: Any
    state_ranges: Mapping[str, tuple[int, int]]
    number_quantities: tuple[Quantity, ...]
    prepare: Callable[[Mapping[str, float], float, GaitConverter], dict[str, float]]

    @property
    def name(self) -> str:
        """That of the controller whose form it is."""
        return self.kind.name


EVENT_ON_OFF = FixedWalk(
    kind=ControllerKind(
        name=FLOAT_KIND.name,
        summary=FLOAT_KIND.summary,
        source=FLOAT_KIND.source,
        quantities=(*OF_CONVERTER, *NUMBERS),
        parameters=WalkRows,
        initial=WalkStateRows(
            PhaseShown(0.0), SafetyShown(0.0, 0.0, SAFETY_START.finding), kept_walk_counts(START_COUNTS)
        ),
        update=update,
        only_switches=True,
    ),
    sample=sample,
    numbers=WalkNumbers,
    readings=GaitReadings,
    begins=START_COUNTS,
    state_ranges=STATE_RANGES,
    number_quantities=NUMBERS,
    prepare=whole_numbers,
)
FIXED_WALKS: dict[str, FixedWalk] = {EVENT_ON_OFF.name: EVENT_ON_OFF}
"""Walking controllers that have an integer form, by name."""
