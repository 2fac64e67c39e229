"""Samples of a recording in sequence, for metrics that need no recording.

A meter is a state of a few floats that goes through the samples of a run once. Its functions are pure and scalar, so
that the engine can compile them into its lanes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

WALK, STEADY, REQUESTED, LED_SHANK = "walk", "steady strides", "requested torque", "shank of a gait"
"""Needs of a metric beside channels: walk, equal strides, requested torque of a walk, or a gait-led shank."""


class FootSample(NamedTuple):
    """Foot on the shank of a gait: its angle and the measured one over the horizontal [rad].

    ``toe_difference`` is how much higher its toes are than the measured ones [m].
    """

    angle: float
    measured_angle: float
    toe_difference: float


class StrideSample(NamedTuple):
    """Stride of a walk at a sample.

    ``supplied_mass`` [kg], ``strides``, ``positive_push_off_work`` and ``net_push_off_work`` [J], ``clearances`` [m]
    and ``toe_landings`` are totals since the start, as in the state of the leg; ``phase`` is the one that the
    controller sees, ``level`` how much it helps. ``time`` [s] since the start.
    """

    supplied_mass: float
    strides: float
    positive_push_off_work: float
    net_push_off_work: float
    clearances: float
    toe_landings: float
    phase: float
    level: float
    time: float


class GasSample(NamedTuple):
    """Gas at a sample [kg]: totals since the start of the run, and true masses in the chambers."""

    supplied_mass: float
    vented_mass: float
    leaked_mass: float
    mass_1: float
    mass_2: float


class EnergySample(NamedTuple):
    """Energies of the gas at a sample [J]: internal energy now, the others totals since the start of the run."""

    gas_energy: float
    supplied_enthalpy: float
    vented_enthalpy: float
    wall_heat: float
    gas_work: float


NO_GAS = GasSample(**dict.fromkeys(GasSample._fields, 0.0))
NO_ENERGY = EnergySample(**dict.fromkeys(EnergySample._fields, 0.0))
"""Initial energies, also of a gas without an energy balance."""


class Sample(NamedTuple):
    """Sample of a recording: its number from 0, channels in SI units, and those of gas, foot and stride.

    ``value`` is the controlled quantity, and ``reference`` in its unit. What a run does not have is 0: reference,
    temperatures and ``energy`` of gas without an energy balance, ``foot`` but on the shank of a gait, ``stride`` but in
    a walk. There ``reference`` is the torque that the controller requests.
    """

    number: float
    angle: float
    angular_velocity: float
    pressure_1: float
    pressure_2: float
    torque: float
    command: float
    value: float
    reference: float
    temperature_1: float
    temperature_2: float
    gas: GasSample
    energy: EnergySample
    foot: FootSample
    stride: StrideSample


class ReferenceSummary(NamedTuple):
    """Summary of the whole reference, in its unit, and the start of its rest.

    Its last value; the farthest that it goes over all samples, from 0 or, where it is no torque, from what is
    controlled as the run begins; ``tolerance`` is the difference from the last value up to which it counts as resting;
    ``hold_start`` is the number of the sample after the last one that did not rest, ``samples`` how many the run has.
    """

    last: float
    largest: float
    tolerance: float
    hold_start: float
    samples: float


SAME_LEVEL = 1.0e-9
"""Fraction of the largest reference up to which two values of it are the same level."""


def is_away(reference: float, last: float, tolerance: float) -> bool:
    """Tell whether a reference differs from its last value; all in its unit."""
    return abs(reference - last) > tolerance


def advance_course(course: ReferenceSummary, sample: Sample) -> ReferenceSummary:
    """Course of a monotone reference after one more sample: away from its last value first, then at rest."""
    # Sample by sample, because a run is not kept; the last value and the largest are known from the profile before.
    away = is_away(sample.reference, course.last, course.tolerance)
    return ReferenceSummary(
        last=course.last,
        largest=course.largest,
        tolerance=course.tolerance,
        hold_start=sample.number + 1.0 if away else course.hold_start,
        samples=course.samples,
    )


@dataclass(frozen=True, slots=True)
class MeterKind:
    """Meter: a running evaluation of samples; ``state`` is a NamedTuple class of floats, nested ones included.

    ``start(course, sample)`` makes it at the first sample, ``update(state, course, sample)`` at each later one. What
    ``course`` says of the hold is right up to this sample. A meter without ``needs_course`` must not look at it; one
    that is ``of_motion`` stays as it started while the vane stands still.
    """

    name: str
    state: type
    start: Callable[[ReferenceSummary, Any], Any]
    update: Callable[[Any, ReferenceSummary, Any], Any]
    needs_course: bool = False
    of_motion: bool = False
