"""Metrics of a walk stride by stride, without a recording: one meter that goes through the samples once.

``walking/strides.py`` counts the same in a recording with its mean curves; tests compare the two.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from ppafo.metrics.metric import Floats, MetricKind, ReadAt, Readings, less, time_if_any
from ppafo.model.columns import choose, larger, root
from ppafo.model.helping import HELPS, PUSH_OFF
from ppafo.signals.meter import REQUESTED, STEADY, WALK, Course, MeterKind, Sample, StrideSample

SETTLING = 2
"""First strides that are left out of averages: the controller learns the stride time in them."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """A quantity of every stride: unit, meaning, and the running total in the record whose gain it is."""

    unit: str
    summary: str
    total: str


PER_STRIDE: dict[str, Quantity] = {
    "gas": Quantity("kg", "gas taken from the supply in one stride", "state.supplied_mass"),
    "positive_push_off_work": Quantity(
        "J", "positive work of T_ex while the foot rolls over the toes", "walk.positive_push_off_work"
    ),
    "net_push_off_work": Quantity("J", "net work of T_ex while the foot rolls over the toes", "walk.net_push_off_work"),
    "toe_clearance": Quantity("m", "lowest toe height in mid-swing, relative to the healthy gait", "walk.clearances"),
    "toe_landing": Quantity("-", "1 where the toes met the ground before the heel", "walk.toe_landings"),
}

NOT_YET = -1.0
"""Time of what has not happened."""


class StrideTotals(NamedTuple):
    """Totals since the start, or what a stride adds to them: gas [kg], works [J], height [m], landings."""

    gas: float
    positive_push_off_work: float
    net_push_off_work: float
    toe_clearance: float
    toe_landing: float


class StrideNow(NamedTuple):
    """The stride under way: totals at its strike, 1 where it lacked help; error in push-off [(N m)^2], samples of it.

    ``is_whole`` is 1 of one that began with a strike, which the walk itself does not, ``on_toes`` of one that began on
    the toes: the totals at its strike have that landing already.
    """

    is_whole: float
    on_toes: float
    begun: StrideTotals
    was_vented: float
    squares: float
    samples: float


class Counted(NamedTuple):
    """Whole strides: how many there are, had help and count for means; their sums and errors."""

    whole: float
    helped: float
    counted: float
    sums: StrideTotals
    squares: float
    samples: float


class Strides(NamedTuple):
    """A walk up to a sample: ``strikes``, gas [kg] from the supply at the first sample and now, its strides.

    ``safe_time`` [s] is the time of the first sample with less help, below 0 without one.
    """

    strikes: float
    first_gas: float
    gas: float
    stride: StrideNow
    counted: Counted
    safe_time: float


def totals_at(now: StrideSample) -> StrideTotals:
    """Totals since the start."""
    return StrideTotals(
        gas=now.supplied_mass,
        positive_push_off_work=now.positive_push_off_work,
        net_push_off_work=now.net_push_off_work,
        toe_clearance=now.clearances,
        toe_landing=now.toe_landings,
    )


def sum_with(sums: StrideTotals, now: StrideTotals, begun: StrideTotals, on_toes: float) -> StrideTotals:
    """Sums with the sums of a stride that went from one to the other; ``on_toes`` is 1 where it began on the toes."""
    return StrideTotals(
        gas=sums.gas + (now.gas - begun.gas),
        positive_push_off_work=sums.positive_push_off_work
        + (now.positive_push_off_work - begun.positive_push_off_work),
        net_push_off_work=sums.net_push_off_work + (now.net_push_off_work - begun.net_push_off_work),
        toe_clearance=sums.toe_clearance + (now.toe_clearance - begun.toe_clearance),
        toe_landing=sums.toe_landing + on_toes,
    )


def _start(_course: Course, sample: Sample) -> Strides:
    nothing = StrideTotals(
        gas=0.0, positive_push_off_work=0.0, net_push_off_work=0.0, toe_clearance=0.0, toe_landing=0.0
    )
    return Strides(
        strikes=sample.stride.strides,
        first_gas=sample.stride.supplied_mass,
        gas=sample.stride.supplied_mass,
        stride=StrideNow(
            is_whole=0.0, on_toes=0.0, begun=totals_at(sample.stride), was_vented=0.0, squares=0.0, samples=0.0
        ),
        counted=Counted(whole=0.0, helped=0.0, counted=0.0, sums=nothing, squares=0.0, samples=0.0),
        safe_time=sample.stride.time if sample.stride.level > HELPS else NOT_YET,
    )


def _update(strides: Strides, _course: Course, sample: Sample) -> Strides:
    # Counts are floats in the state of a run: half way between two of them is safe from rounding.
    strikes = sample.stride.strides - strides.strikes > 0.5
    on_toes = sample.stride.toe_landings - strides.stride.begun.toe_landing
    begun = StrideNow(
        is_whole=1.0, on_toes=on_toes, begun=totals_at(sample.stride), was_vented=0.0, squares=0.0, samples=0.0
    )
    stride = begun if strikes else strides.stride
    is_first = sample.stride.level > HELPS and strides.safe_time < 0.0
    return Strides(
        strikes=sample.stride.strides,
        first_gas=strides.first_gas,
        gas=sample.stride.supplied_mass,
        stride=go_on(stride, sample),
        counted=count(strides.counted, strides.stride, sample) if strikes else strides.counted,
        safe_time=sample.stride.time if is_first else strides.safe_time,
    )


def go_on(stride: StrideNow, sample: Sample) -> StrideNow:
    """The stride under way with one sample more."""
    error = sample.reference - sample.torque
    pushes = sample.stride.phase == PUSH_OFF
    return StrideNow(
        is_whole=stride.is_whole,
        on_toes=stride.on_toes,
        begun=stride.begun,
        was_vented=1.0 if sample.stride.level > HELPS else stride.was_vented,
        squares=stride.squares + (error * error if pushes else 0.0),
        samples=stride.samples + (1.0 if pushes else 0.0),
    )


def count(counted: Counted, stride: StrideNow, sample: Sample) -> Counted:
    """The strides with the one that ends at the first sample after a heel strike."""
    # A stride with less help in a part of it is no example; in the first ones the controller still learns their time.
    now = totals_at(sample.stride)
    helps = stride.is_whole > 0.5 and stride.was_vented < 0.5
    counts = helps and counted.whole >= float(SETTLING)
    return Counted(
        whole=counted.whole + stride.is_whole,
        helped=counted.helped + (1.0 if helps else 0.0),
        counted=counted.counted + (1.0 if counts else 0.0),
        sums=sum_with(counted.sums, now, stride.begun, stride.on_toes) if counts else counted.sums,
        squares=counted.squares + (stride.squares if counts else 0.0),
        samples=counted.samples + (stride.samples if counts else 0.0),
    )


METER = MeterKind("strides", Strides, _start, _update)


def mean_of(total: Floats, count: Floats) -> Floats:
    """A sum over how many there are, in its unit; nan for none."""
    # Both sides of a choice are computed, in the lanes too: the divisor is never 0.
    found: Floats = choose(count > 0.0, total / larger(count, 1.0), math.nan)
    return found


def _push_off_error(readings: Readings) -> Floats:
    counted = readings.meters["strides"].counted
    found: Floats = root(mean_of(counted.squares, counted.samples))
    return found


def _kind(name: str, unit: str, summary: str, read: Callable[[Readings], Floats], *needs: str) -> MetricKind:
    return MetricKind(name, unit, summary, (), None, read, (METER,), needs=(WALK, *needs))


def _mean(name: str, *needs: str) -> MetricKind:
    """A mean over the strides with help, without the first ones; in a task sequence it would be over other strides."""
    quantity = PER_STRIDE[name]
    read = ReadAt((f"meters.strides.counted.sums.{name}", "meters.strides.counted.counted"), mean_of)
    return _kind(name, quantity.unit, f"{quantity.summary}, mean", read, STEADY, *needs)


METRICS = (
    _mean("gas"),
    _mean("positive_push_off_work"),
    _mean("net_push_off_work"),
    _mean("toe_clearance"),
    _mean("toe_landing"),
    _kind(
        "counted_strides",
        "-",
        "strides over which the means are taken",
        ReadAt(("meters.strides.counted.counted",)),
        STEADY,
    ),
    _kind(
        "push_off_error",
        "N m",
        "RMS of requested torque less actuator torque in push-off",
        _push_off_error,
        STEADY,
        REQUESTED,
    ),
    _kind("strides", "-", "whole strides of the walk", ReadAt(("meters.strides.counted.whole",))),
    _kind(
        "helped_strides",
        "-",
        "whole strides with help from strike to strike",
        ReadAt(("meters.strides.counted.helped",)),
    ),
    _kind(
        "vented_strides",
        "-",
        "whole strides with less help (lifted only, paused or stopped) in at least a part of them",
        ReadAt(("meters.strides.counted.whole", "meters.strides.counted.helped"), less),
    ),
    _kind(
        "total_gas",
        "kg",
        "gas taken from the supply in the whole walk",
        ReadAt(("meters.strides.gas", "meters.strides.first_gas"), less),
    ),
    _kind(
        "safe_state_time",
        "s",
        "time at which the controller first lifted only, paused or stopped",
        ReadAt(("meters.strides.safe_time",), time_if_any),
    ),
)
"""Metrics of a walk that need neither a mean curve nor the healthy gait."""
