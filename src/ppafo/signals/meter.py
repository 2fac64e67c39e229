"""Meters: running evaluation of the samples of a run, for metrics without a recording.

A meter is a state of a few floats, updated once per sample of a run. Its functions are pure and scalar, so that the
engine can compile them into its loop.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

# Requirements of metrics besides channels: walk, requested torque, shank led by a gait.
WALK = "walk"
REQUESTED = "requested torque"
LED_SHANK = "shank of a gait"
SAME_LEVEL = 1.0e-9
"""Largest difference of equal levels of a reference, relative to its largest value [-]."""
SLOW_RATE = 0.75
"""Largest rate of a slow reference, relative to its largest value [1/s]: a lag behind it is within the largest one."""
START_UP = 1.0
"""Time for a value to meet a repeated reference and to settle [s], at most half of the run."""
# Length of the shortest stretch [s] or, if that is less, divided by the run's [-]; and its least number of samples.
SHORTEST_REST = 0.1
SHORTEST_SHARE = 0.1
FEWEST_OF_REST = 2.0


class FootSample(NamedTuple):
    """Foot on the shank of a gait: ``angle`` and ``measured_angle`` relative to the horizontal [rad].

    ``toe_difference`` is the toe height minus the measured toe height [m].
    """

    angle: float
    measured_angle: float
    toe_difference: float


class StrideSample(NamedTuple):
    """State of a walk at a sample.

    ``supplied_mass`` [kg], ``strides``, ``positive_push_off_work`` and ``net_push_off_work`` [J], ``clearances`` [m]
    and ``toe_landings`` are totals since the start, as in the state of the leg. ``phase`` is the gait phase seen by the
    controller.
    """

    supplied_mass: float
    strides: float
    positive_push_off_work: float
    net_push_off_work: float
    clearances: float
    toe_landings: float
    phase: float


class GasSample(NamedTuple):
    """Gas at a sample [kg]: totals since the start of the run, and masses in the chambers."""

    supplied_mass: float
    vented_mass: float
    leaked_mass: float
    mass_1: float
    mass_2: float


class EnergySample(NamedTuple):
    """Energies of the gas at a sample [J]: current internal energy, and totals since the start of the run."""

    gas_energy: float
    supplied_enthalpy: float
    vented_enthalpy: float
    wall_heat: float
    gas_work: float


NO_GAS = GasSample(**dict.fromkeys(GasSample._fields, 0.0))
NO_ENERGY = EnergySample(**dict.fromkeys(EnergySample._fields, 0.0))
"""Energies at the start of a run [J], and of a gas without energy balance."""


class Sample(NamedTuple):
    """Sample of a run: its number from 0, channels [SI], and records of gas, energy, foot and stride.

    ``value`` is the controlled quantity and ``reference`` its reference, in the same unit; in a walk the reference is
    the torque requested by the controller. Values absent from a run are 0: the reference, temperatures and ``energy``
    of gas without an energy balance, ``foot`` unless on the shank of a gait, ``stride`` except in a walk.
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
    """Summary of a whole reference, in its unit, with the start of its final hold, and its present rest or move.

    ``last`` is the last value. ``largest`` is the largest distance over all samples from 0 for a torque, otherwise from
    the initial value of the controlled quantity. ``tolerance`` is the difference from the last value up to which the
    reference rests. ``hold_start`` is the number of the sample after the last one not at rest, ``samples`` the number
    of samples. ``start_up`` is the number of samples before a repeated reference is judged, 0 for another.
    ``interval`` is the time between two samples [s], and ``of_joint`` 0 for an angle, 1 for a quantity that a moving
    joint disturbs.

    The present part of the reference begins after sample ``part_start``; ``rests`` is 1 for a slow straight stretch and
    0 for a move, ``is_new`` is 1 at the first sample of a part after the first, and ``in_first_half`` in the first
    half of a stretch. The reference is straight from sample
    ``line_start`` on, ``previous`` is its value at the sample before, and ``change`` its change up to that sample.
    """

    last: float
    largest: float
    tolerance: float
    hold_start: float
    samples: float
    start_up: float = 0.0
    interval: float = 0.0
    of_joint: float = 1.0
    previous: float = 0.0
    change: float = 1.0e300
    line_start: float = 0.0
    part_start: float = 0.0
    rests: float = 0.0
    is_new: float = 0.0
    in_first_half: float = 0.0


def is_away(reference: float, last: float, tolerance: float) -> bool:
    """Return whether a reference differs from its last value by more than ``tolerance``."""
    return abs(reference - last) > tolerance


def advance_course(course: ReferenceSummary, sample: Sample) -> ReferenceSummary:
    """Update the start of the final hold in the summary of a monotone reference, with a new sample."""
    # Sample by sample, because a run is not kept; the last value and the largest are known from the profile before.
    away = is_away(sample.reference, course.last, course.tolerance)
    return course._replace(hold_start=sample.number + 1.0 if away else course.hold_start)


def start_up_of(period: float, duration: float, is_wave: bool) -> float:
    """Return the time before a repeated reference is judged [s]; 0 for a table that does not repeat."""
    return min(START_UP, 0.5 * duration) if is_wave or period < duration else 0.0


def is_straight(course: ReferenceSummary, change: float, later: float, samples: float) -> bool:
    """Return whether a reference changes by ``later`` in some samples, as by ``change`` in one."""
    return abs(later - change * samples) <= course.tolerance * samples


def shortest_rest(course: ReferenceSummary) -> float:
    """Return the least number of samples of a slow stretch."""
    least = min(SHORTEST_REST / course.interval, SHORTEST_SHARE * course.samples)
    return max(FEWEST_OF_REST, float(int(least)) + 1.0)


def deciding_sample(course: ReferenceSummary, number: float, reference: float) -> float:
    """Return the number of the later sample whose reference decides whether sample ``number`` is in a slow stretch.

    That is the end of the shortest stretch that would be one, or of a stretch of which the present sample is in the
    middle.
    """
    goes_on = is_straight(course, course.change, reference - course.previous, 1.0)
    middle = 2.0 * number - course.line_start + 1.0
    return middle if goes_on and course.rests > 0.0 else number - 1.0 + shortest_rest(course)


def advance_part(
    course: ReferenceSummary, number: float, reference: float, later: float, reference_later: float
) -> ReferenceSummary:
    """Update the present part of the reference with sample ``number``, and with the reference at sample ``later``."""
    change = reference - course.previous
    goes_on = is_straight(course, course.change, change, 1.0)
    line_start = course.line_start if goes_on else number - 1.0
    is_slow = abs(change) <= SLOW_RATE * course.largest * course.interval
    lasts = later <= course.samples - 1.0 and is_straight(course, change, reference_later - reference, later - number)
    rested = course.rests > 0.0
    begins = is_slow and lasts and not goes_on
    ends = rested and not goes_on
    # After its first half, a stretch may be followed by a pulse that leads back to its level.
    waits = rested and goes_on and course.in_first_half > 0.0
    return course._replace(
        previous=reference,
        change=change,
        line_start=line_start,
        part_start=line_start if begins or ends else course.part_start,
        rests=1.0 if begins or (rested and goes_on) else 0.0,
        is_new=1.0 if begins or ends else 0.0,
        in_first_half=1.0 if lasts and (begins or waits) else 0.0,
    )


@dataclass(frozen=True, slots=True)
class MeterKind:
    """Meter in the catalogue: running evaluation of samples, with a ``state`` of floats (NamedTuple class).

    ``start(course, sample)`` creates the state at the first sample, ``update(state, course, sample)`` updates it at
    each later one. The start of the hold in ``course`` is valid up to this sample. A meter without ``needs_course``
    must not use ``course``, and one without ``end_part`` not its present part: that updates the state before the
    first sample of a new part, which ends the one before; a meter that is ``of_motion`` keeps
    its initial state while the vane stands still.
    """

    name: str
    state: type
    start: Callable[[ReferenceSummary, Any], Any]
    update: Callable[[Any, ReferenceSummary, Any], Any]
    needs_course: bool = False
    of_motion: bool = False
    end_part: Callable[[Any, ReferenceSummary], Any] | None = None
