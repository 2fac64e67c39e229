"""Meters: running evaluation of the samples of a run, for metrics without a recording.

A meter is a state of a few floats, updated once per sample of a run. Its functions are pure and scalar, so that the
engine can compile them into its loop.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

WALK, REQUESTED, LED_SHANK = "walk", "requested torque", "shank of a gait"
"""Requirements of metrics besides channels: walk, requested torque, shank led by a gait."""


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
    """Summary of a whole reference, in its unit, with the start of its final hold.

    ``last`` is the last value. ``largest`` is the largest distance over all samples from 0 for a torque, otherwise from
    the initial value of the controlled quantity. ``tolerance`` is the difference from the last value up to which the
    reference rests. ``hold_start`` is the number of the sample after the last one not at rest, ``samples`` the number
    of samples. ``is_repeated`` is 1 for a table that repeats within the run, whose last rest is one of many, else 0.
    """

    last: float
    largest: float
    tolerance: float
    hold_start: float
    samples: float
    is_repeated: float = 0.0


SAME_LEVEL = 1.0e-9
"""Largest difference of equal levels of a reference, relative to its largest value [-]."""


def is_away(reference: float, last: float, tolerance: float) -> bool:
    """Return whether a reference differs from its last value by more than ``tolerance``."""
    return abs(reference - last) > tolerance


def advance_course(course: ReferenceSummary, sample: Sample) -> ReferenceSummary:
    """Update the start of the final hold in the summary of a monotone reference, with a new sample."""
    # Sample by sample, because a run is not kept; the last value and the largest are known from the profile before.
    away = is_away(sample.reference, course.last, course.tolerance)
    return course._replace(hold_start=sample.number + 1.0 if away else course.hold_start)


@dataclass(frozen=True, slots=True)
class MeterKind:
    """Meter in the catalogue: running evaluation of samples, with a ``state`` of floats (NamedTuple class).

    ``start(course, sample)`` creates the state at the first sample, ``update(state, course, sample)`` updates it at
    each later one. The start of the hold in ``course`` is valid up to this sample. A meter without ``needs_course``
    must not use ``course``; a meter that is ``of_motion`` keeps its initial state while the vane stands still.
    """

    name: str
    state: type
    start: Callable[[ReferenceSummary, Any], Any]
    update: Callable[[Any, ReferenceSummary, Any], Any]
    needs_course: bool = False
    of_motion: bool = False
