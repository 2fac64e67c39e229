"""Metrics of a neuromuscular gait model, without a recording: falls and their time, speed, toes, muscles."""

import math
from collections.abc import Callable
from typing import NamedTuple

from ppafo.metrics.metric import REACTS, WALK, Floats, MetricKind, ReadAt, Readings, time_if_any
from ppafo.metrics.strides import NOT_YET, SETTLING, mean_of
from ppafo.model.columns import choose, larger
from ppafo.signals.meter import Course, MeterKind, WearerSample


class WearerTotals(NamedTuple):
    """The samples after the strike with which the counted strides begin, and after the last one; the latest sample.

    The time of a strike is below 0 before there was one.
    """

    first: WearerSample
    last: WearerSample
    now: WearerSample


def _start(_course: Course, sample: WearerSample) -> WearerTotals:
    none = WearerSample(
        strides=0.0, way=0.0, clearances=0.0, muscle_work=0.0, umberger=0.0, bhargava=0.0, fall_time=0.0, time=NOT_YET
    )
    return WearerTotals(first=none, last=none, now=sample)


def _update(totals: WearerTotals, _course: Course, sample: WearerSample) -> WearerTotals:
    # Counts are floats in the state of a run; only the first strike behind the settling begins the counted strides.
    strikes = sample.strides - totals.now.strides > 0.5
    begins = strikes and sample.strides > float(SETTLING) and totals.first.time < 0.0
    first = totals.first
    last = totals.last
    return WearerTotals(
        first=chosen(begins, sample, first),
        last=chosen(strikes, sample, last),
        now=sample,
    )


def chosen(is_new: bool, new: WearerSample, old: WearerSample) -> WearerSample:
    """One of two samples."""
    return WearerSample(
        strides=new.strides if is_new else old.strides,
        way=new.way if is_new else old.way,
        clearances=new.clearances if is_new else old.clearances,
        muscle_work=new.muscle_work if is_new else old.muscle_work,
        umberger=new.umberger if is_new else old.umberger,
        bhargava=new.bhargava if is_new else old.bhargava,
        fall_time=new.fall_time if is_new else old.fall_time,
        time=new.time if is_new else old.time,
    )


METER = MeterKind("wearer", WearerTotals, _start, _update, of_wearer=True)


def _stays_up(readings: Readings) -> Floats:
    found: Floats = choose(readings.meters["wearer"].now.fall_time < 0.0, 1.0, 0.0)
    return found


def _walked_time(readings: Readings) -> Floats:
    now = readings.meters["wearer"].now
    found: Floats = choose(now.fall_time >= 0.0, now.fall_time, now.time)
    return found


def counted_strides(totals: WearerTotals) -> Floats:
    """Number of whole strides without the first ones."""
    found: Floats = choose(totals.first.time >= 0.0, totals.last.strides - totals.first.strides, 0.0)
    return found


def per_stride(totals: WearerTotals, last: Floats, first: Floats) -> Floats:
    """Mean over the strides of what a total gained in them."""
    return mean_of(last - first, counted_strides(totals))


def per_second(totals: WearerTotals, last: Floats, first: Floats) -> Floats:
    """What a total gained over the time of the strides."""
    # Both sides of a choice are computed: the divisor is never 0.
    in_time = (last - first) / larger(totals.last.time - totals.first.time, 1.0e-9)
    found: Floats = choose(counted_strides(totals) > 0.5, in_time, math.nan)
    return found


def _kind(name: str, unit: str, summary: str, read: Callable[[Readings], Floats]) -> MetricKind:
    return MetricKind(name, unit, summary, (), None, read, (METER,), needs=(WALK, REACTS))


def _mean(name: str, unit: str, summary: str, total: str, over: Callable[..., Floats]) -> MetricKind:
    """A mean over whole strides without the first ones of what a total of the samples gains."""
    places = ("meters.wearer", f"meters.wearer.last.{total}", f"meters.wearer.first.{total}")
    return _kind(name, unit, summary, ReadAt(places, over))


METRICS = (
    _kind("stays_up", "-", "1 of a wearer who walks on to the end, 0 of one who falls", _stays_up),
    _kind("fall_time", "s", "time at which the wearer falls", ReadAt(("meters.wearer.now.fall_time",), time_if_any)),
    _kind("walked_time", "s", "time until the wearer falls, or until the end", _walked_time),
    _mean("walking_speed", "m/s", "speed, mean over whole strides without the first ones", "way", per_second),
    _mean("stride_time", "s", "time of a stride, mean over whole strides without the first ones", "time", per_stride),
    _mean(
        "lowest_toes",
        "m",
        "lowest toe height above ground in mid-swing, mean over the strides",
        "clearances",
        per_stride,
    ),
    _mean(
        "muscle_work", "J", "work of all muscles of both legs as they shorten, in one stride", "muscle_work", per_stride
    ),
    _mean("muscle_power", "W", "mean power of all muscles of both legs as they shorten", "muscle_work", per_second),
    _mean("metabolic_power_umberger", "W", "metabolic rate of all muscles, Umberger 2010", "umberger", per_second),
    _mean("metabolic_power_bhargava", "W", "metabolic rate of all muscles, Bhargava 2004", "bhargava", per_second),
)
"""Those of a neuromuscular gait model; gas and the others of a walk are in ``strides``."""
