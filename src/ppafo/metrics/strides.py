"""Metrics of a walk by strides, from a meter without a recording.

``walking/strides.py`` computes the same from a recording with its mean curves; tests compare the two.
"""

from dataclasses import dataclass
from typing import NamedTuple

from ppafo.metrics.metric import MetricKind, ReadAt, less, mean_of, root_mean
from ppafo.model.declaration import PlainFunction
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


class StrideMeter(NamedTuple):
    """State of the stride meter: heel strikes, supplied gas at first and now [kg], current stride and ended strides.

    ``is_whole`` is 1 for a stride that started with a heel strike; the first stride of a walk did not. ``on_toes`` is 1
    for a stride that started with a landing on the toes. ``at_strike`` are the totals since the start of the walk at
    the heel strike, including such a landing. ``squared_errors`` [(N m)^2] is the sum of squared torque errors over
    ``push_off_samples`` samples in push-off.

    ``whole`` counts the ended strides but a partial first one, and ``averaged`` those without the first strides of the
    walk. Over the averaged strides, ``sums`` are the increases of the totals, ``averaged_errors`` the sum of squared
    torque errors in push-off [(N m)^2], and ``averaged_samples`` the number of samples in push-off.
    """

    strikes: float
    first_gas: float
    gas: float
    is_whole: float
    on_toes: float
    at_strike: _StrideTotals
    squared_errors: float
    push_off_samples: float
    whole: float
    averaged: float
    sums: _StrideTotals
    averaged_errors: float
    averaged_samples: float


def totals_at(sample: StrideSample) -> _StrideTotals:
    """Return the running totals of a walk at a sample."""
    return _StrideTotals(
        gas=sample.supplied_mass,
        positive_push_off_work=sample.positive_push_off_work,
        net_push_off_work=sample.net_push_off_work,
        toe_clearance=sample.clearances,
        toe_landing=sample.toe_landings,
    )


def _start(_course: ReferenceSummary, sample: Sample) -> StrideMeter:
    gas = sample.stride.supplied_mass
    no_sums = _StrideTotals(0.0, 0.0, 0.0, 0.0, 0.0)
    return StrideMeter(
        sample.stride.strides, gas, gas, 0.0, 0.0, totals_at(sample.stride), 0.0, 0.0, 0.0, 0.0, no_sums, 0.0, 0.0
    )


def _update(state: StrideMeter, _course: ReferenceSummary, sample: Sample) -> StrideMeter:
    at_strike = state.at_strike
    at_end = totals_at(sample.stride)
    sums = state.sums
    # Counts are floats in the state of a run: half way between two of them is safe from rounding.
    is_strike = sample.stride.strides - state.strikes > 0.5
    # In the first strides the controller still learns their time.
    is_averaged = is_strike and state.is_whole > 0.5 and state.whole >= float(SETTLING)
    # A landing on the toes at the start of a stride belongs to it, one at its end to the next. Field by field: compiled
    # code has no loop over a row.
    with_stride = _StrideTotals(
        gas=sums.gas + (at_end.gas - at_strike.gas),
        positive_push_off_work=sums.positive_push_off_work
        + (at_end.positive_push_off_work - at_strike.positive_push_off_work),
        net_push_off_work=sums.net_push_off_work + (at_end.net_push_off_work - at_strike.net_push_off_work),
        toe_clearance=sums.toe_clearance + (at_end.toe_clearance - at_strike.toe_clearance),
        toe_landing=sums.toe_landing + state.on_toes,
    )
    error = sample.reference - sample.torque
    pushes = sample.stride.phase == PUSH_OFF
    return StrideMeter(
        strikes=sample.stride.strides,
        first_gas=state.first_gas,
        gas=sample.stride.supplied_mass,
        is_whole=1.0 if is_strike else state.is_whole,
        on_toes=at_end.toe_landing - at_strike.toe_landing if is_strike else state.on_toes,
        at_strike=at_end if is_strike else at_strike,
        squared_errors=(0.0 if is_strike else state.squared_errors) + (error * error if pushes else 0.0),
        push_off_samples=(0.0 if is_strike else state.push_off_samples) + (1.0 if pushes else 0.0),
        whole=state.whole + (state.is_whole if is_strike else 0.0),
        averaged=state.averaged + (1.0 if is_averaged else 0.0),
        sums=with_stride if is_averaged else sums,
        averaged_errors=state.averaged_errors + (state.squared_errors if is_averaged else 0.0),
        averaged_samples=state.averaged_samples + (state.push_off_samples if is_averaged else 0.0),
    )


METER = MeterKind("strides", StrideMeter, _start, _update)


def _kind(
    name: str, unit: str, summary: str, numbers: str, function: PlainFunction | None = None, better: int | None = None
) -> MetricKind:
    """Declare a metric of a walk, read as ``numbers`` of the meter or a function of them."""
    read = ReadAt(tuple(f"meters.strides.{number}" for number in numbers.split()), function)
    needs = (WALK, REQUESTED) if name == "push_off_error" else (WALK,)
    return MetricKind(name, unit, summary, (), None, read, (METER,), needs=needs, better=better)


_PUSH_OFF = "RMS of requested torque less actuator torque in push-off"
METRICS = (
    *(
        _kind(name, quantity.unit, f"{quantity.summary}, mean", f"sums.{name} averaged", mean_of, quantity.better)
        for name, quantity in PER_STRIDE.items()
    ),
    _kind("counted_strides", "-", "strides over which the means are taken", "averaged"),
    _kind("push_off_error", "N m", _PUSH_OFF, "averaged_errors averaged_samples", root_mean, -1),
    _kind("strides", "-", "whole strides of the walk", "whole"),
    _kind("total_gas", "kg", "gas taken from the supply in the whole walk", "gas first_gas", less),
)
"""Metrics of a walk computed without mean curve and healthy gait."""

OF_MEAN_STRIDE = {
    "healthy_positive_work": ("J", "positive work of the healthy ankle in one stride"),
    "push_off_share": ("-", "positive work of T_ex in push-off over the healthy ankle's positive work"),
    "dorsiflexor_moment": ("N m", "moment of the wearer's dorsiflexors, mean over the stride"),
    "lowest_toes": ("m", "lowest toe height above ground in mid-swing of the mean stride; below 0 the toes would drag"),
    "angle_difference": ("rad", "RMS difference of the mean ankle angle to the healthy one"),
}
"""Units and meanings of the other metrics of a walk, by name: of its mean stride and of the healthy gait."""
