"""Metrics of a walk by strides, from a meter without a recording.

``walking/strides.py`` computes the same from a recording with its mean curves; tests compare the two.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from ppafo.metrics.metric import Floats, MetricKind, ReadAt, Readings, less, mean_of, root_mean
from ppafo.model.helping import PUSH_OFF
from ppafo.signals.meter import REQUESTED, WALK, MeterKind, ReferenceSummary, Sample, StrideSample

SETTLING = 2
"""Number of initial strides excluded from averages, while the controller learns the stride time."""


@dataclass(frozen=True, slots=True)
class _StrideQuantity:
    """Quantity per stride: unit, meaning, path of its running total, and direction in which it is better."""

    unit: str
    summary: str
    total: str
    better: int | None = None


PER_STRIDE: dict[str, _StrideQuantity] = {
    "gas": _StrideQuantity("kg", "gas taken from the supply in one stride", "state.supplied_mass", -1),
    "positive_push_off_work": _StrideQuantity(
        "J", "positive work of T_ex while the foot rolls over the toes", "walk.positive_push_off_work", 1
    ),
    "net_push_off_work": _StrideQuantity(
        "J", "net work of T_ex while the foot rolls over the toes", "walk.net_push_off_work", 1
    ),
    "toe_clearance": _StrideQuantity(
        "m", "lowest toe height in mid-swing, relative to the healthy gait", "walk.clearances", 1
    ),
    "toe_landing": _StrideQuantity("-", "1 where the toes met the ground before the heel", "walk.toe_landings"),
}


class _StrideTotals(NamedTuple):
    """Running totals of a walk: supplied gas [kg], work of T_ex [J], toe clearances [m], toe landings.

    Fields have the names of ``PER_STRIDE``.
    """

    gas: float
    positive_push_off_work: float
    net_push_off_work: float
    toe_clearance: float
    toe_landing: float


class _CurrentStride(NamedTuple):
    """Sums over the stride in progress.

    ``is_whole`` is 1 for a stride that started with a heel strike; the first stride of a walk did not. ``on_toes`` is 1
    for a stride that started with a landing on the toes. ``at_strike`` are the totals since the start of the walk at
    the heel strike, including such a landing. ``squared_errors`` [(N m)^2] is the sum of squared torque errors over
    ``push_off_samples`` samples in push-off.
    """

    is_whole: float
    on_toes: float
    at_strike: _StrideTotals
    squared_errors: float
    push_off_samples: float


class _EndedStrides(NamedTuple):
    """Sums over completed strides.

    ``whole`` counts all but a partial first one, and ``averaged`` those without the first strides of the walk. ``sums``
    are the increases of the totals, ``squared_errors`` the sum of squared torque errors in push-off [(N m)^2], and
    ``push_off_samples`` the number of samples in push-off, all over the averaged strides.
    """

    whole: float
    averaged: float
    sums: _StrideTotals
    squared_errors: float
    push_off_samples: float


class StrideMeter(NamedTuple):
    """State of the stride meter: heel strikes, supplied gas at first and now [kg], current and ended strides."""

    strikes: float
    first_gas: float
    gas: float
    current: _CurrentStride
    ended: _EndedStrides


def totals_at(sample: StrideSample) -> _StrideTotals:
    """Return the running totals of a walk at a sample."""
    return _StrideTotals(
        gas=sample.supplied_mass,
        positive_push_off_work=sample.positive_push_off_work,
        net_push_off_work=sample.net_push_off_work,
        toe_clearance=sample.clearances,
        toe_landing=sample.toe_landings,
    )


def begun_stride(sample: StrideSample, is_whole: float, on_toes: float) -> _CurrentStride:
    """Return a new stride that starts at a sample, with zero sums."""
    return _CurrentStride(
        is_whole=is_whole,
        on_toes=on_toes,
        at_strike=totals_at(sample),
        squared_errors=0.0,
        push_off_samples=0.0,
    )


def _start(_course: ReferenceSummary, sample: Sample) -> StrideMeter:
    no_sums = _StrideTotals(
        gas=0.0, positive_push_off_work=0.0, net_push_off_work=0.0, toe_clearance=0.0, toe_landing=0.0
    )
    return StrideMeter(
        strikes=sample.stride.strides,
        first_gas=sample.stride.supplied_mass,
        gas=sample.stride.supplied_mass,
        current=begun_stride(sample.stride, 0.0, 0.0),
        ended=_EndedStrides(whole=0.0, averaged=0.0, sums=no_sums, squared_errors=0.0, push_off_samples=0.0),
    )


def _update(strides: StrideMeter, _course: ReferenceSummary, sample: Sample) -> StrideMeter:
    # Counts are floats in the state of a run: half way between two of them is safe from rounding.
    is_strike = sample.stride.strides - strides.strikes > 0.5
    on_toes = sample.stride.toe_landings - strides.current.at_strike.toe_landing
    begun = begun_stride(sample.stride, 1.0, on_toes)
    return StrideMeter(
        strikes=sample.stride.strides,
        first_gas=strides.first_gas,
        gas=sample.stride.supplied_mass,
        current=stride_with_sample(begun if is_strike else strides.current, sample),
        ended=ended_with_stride(strides.ended, strides.current, sample) if is_strike else strides.ended,
    )


def stride_with_sample(stride: _CurrentStride, sample: Sample) -> _CurrentStride:
    """Update the current stride with a sample."""
    error = sample.reference - sample.torque
    pushes = sample.stride.phase == PUSH_OFF
    return stride._replace(
        squared_errors=stride.squared_errors + (error * error if pushes else 0.0),
        push_off_samples=stride.push_off_samples + (1.0 if pushes else 0.0),
    )


def ended_with_stride(ended: _EndedStrides, stride: _CurrentStride, sample: Sample) -> _EndedStrides:
    """Add a stride to the completed strides; ``sample`` is the first sample after its heel strike.

    A landing on the toes at the start of the stride belongs to it, one at its end to the next stride.
    """
    # In the first strides the controller still learns their time.
    is_averaged = stride.is_whole > 0.5 and ended.whole >= float(SETTLING)
    at_strike, at_end, sums = stride.at_strike, totals_at(sample.stride), ended.sums
    # Field by field: compiled code has no loop over a row.
    with_stride = _StrideTotals(
        gas=sums.gas + (at_end.gas - at_strike.gas),
        positive_push_off_work=sums.positive_push_off_work
        + (at_end.positive_push_off_work - at_strike.positive_push_off_work),
        net_push_off_work=sums.net_push_off_work + (at_end.net_push_off_work - at_strike.net_push_off_work),
        toe_clearance=sums.toe_clearance + (at_end.toe_clearance - at_strike.toe_clearance),
        toe_landing=sums.toe_landing + stride.on_toes,
    )
    return _EndedStrides(
        whole=ended.whole + stride.is_whole,
        averaged=ended.averaged + (1.0 if is_averaged else 0.0),
        sums=with_stride if is_averaged else sums,
        squared_errors=ended.squared_errors + (stride.squared_errors if is_averaged else 0.0),
        push_off_samples=ended.push_off_samples + (stride.push_off_samples if is_averaged else 0.0),
    )


METER = MeterKind("strides", StrideMeter, _start, _update)


def _kind(
    name: str,
    unit: str,
    summary: str,
    read: Callable[[Readings], Floats],
    *needs: str,
    better: int | None = None,
) -> MetricKind:
    """Declare a metric of a walk; ``needs`` are its additional requirements."""
    return MetricKind(name, unit, summary, (), None, read, (METER,), needs=(WALK, *needs), better=better)


METRICS = (
    *(
        _kind(
            name,
            quantity.unit,
            f"{quantity.summary}, mean",
            ReadAt((f"meters.strides.ended.sums.{name}", "meters.strides.ended.averaged"), mean_of),
            better=quantity.better,
        )
        for name, quantity in PER_STRIDE.items()
    ),
    _kind(
        "counted_strides",
        "-",
        "strides over which the means are taken",
        ReadAt(("meters.strides.ended.averaged",)),
    ),
    _kind(
        "push_off_error",
        "N m",
        "RMS of requested torque less actuator torque in push-off",
        ReadAt(("meters.strides.ended.squared_errors", "meters.strides.ended.push_off_samples"), root_mean),
        REQUESTED,
        better=-1,
    ),
    _kind("strides", "-", "whole strides of the walk", ReadAt(("meters.strides.ended.whole",))),
    _kind(
        "total_gas",
        "kg",
        "gas taken from the supply in the whole walk",
        ReadAt(("meters.strides.gas", "meters.strides.first_gas"), less),
    ),
)
"""Metrics of a walk computed without mean curve and healthy gait."""
