"""Contacts of a foot with the ground, and strides of a recording: from force, events, the shank, or a repeated cycle.

A record slightly longer than a stride, starting anywhere in it, is treated as one periodic cycle.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.errors import DataError
from ppafo.gait.gait import REQUIRED
from ppafo.gait.plausible import SHANK_RANGE, range_faults
from ppafo.gait.recorded.mapping import Side
from ppafo.gait.recorded.signal import LOADS, CurveColumns, Signal, low_pass, with_absence
from ppafo.gait.recorded.table import OFF, STRIKE, MotionTable
from ppafo.wording import count_of

# Names of the sources of strides: vertical force, shank angle, and events stored in the file.
FORCE = "vertical_force"
SHANK = "shank_angle"
FILE = "events of the file"
LEAST_STRIDES = 2
"""Default of the smallest number of strides; 1 for a walk across a force plate and for a single cycle."""
_SMOOTH = 6.0
"""Cut-off frequency [Hz] of the low pass for the shank angle before events are searched."""
_SHORTEST_STRIDE = 0.5
"""Shortest time between two heel strikes of one foot [s]."""
_TOP = 0.35
"""Upper fraction of the range of the shank angle in which heel strikes lie [-]."""
_DEEPEST = np.radians(-15.0)
"""Shank angle [rad] below which the shank must lean backwards before the swing."""
_NEAR = 0.15
"""Largest time difference [s] between an event found from the shank and the same event on a plate."""
_ABOUT_STANCE = 0.05
"""Interval at both ends of the stance [strides] that a load need not cover."""
_COVERED = 0.9
"""Fraction of the remaining stance that must be on the plate for a load to count in a stride."""
_LEAST_OF_CYCLE = 0.75
"""Shortest stride in a cycle, relative to the period of the cycle [-]."""
_RATE = 200.0
"""Sampling rate [Hz] for the comparison of the ends of a cycle."""
_SHORTEST = 0.5
"""Shortest plausible stride time [s]."""
LONGEST = 1.5
"""Largest length of a record of one cycle [strides]; strides are counted in a longer record."""
_MISFIT = 0.06
"""Largest RMS difference between start and end in their overlap, of values and rates relative to their ranges [-]; two
strides of one healthy walk differ by 0.03."""
# Thresholds of the force [body weights]: the foot is on the ground above the first, and off it below the second.
LOADED = 0.05
UNLOADED = 0.03
SHORTEST_CONTACT = 0.1
"""Duration [s] below which a contact, or a time off the ground, is noise of the force plate."""
_LEAST_LEAN = 0.5
"""Least decrease of the shank angle over a contact of the same foot, relative to its range [-]; over a contact of the
other foot the angle increases."""
_LEAST_LEAN_OF_PART = 0.1
"""Least decrease of the shank angle, relative to its range [-], over a contact cut by an end of the record."""

_IN_SWING = 0.1
"""Fraction of the samples [-] that are in swing at least."""
# Least and largest zero error of a plate [body weights].
_LEAST_ZERO = 0.0075
_LARGEST_ZERO = 0.1
_END_OF_SWING = 0.15
"""Ends of a swing in which the plate may be loaded [swings]."""
_TOUCHED = 0.1
"""Largest part of the rest of a swing in which noise loads the plate [swings]."""
_SHIFTED = 0.2
"""Largest difference of an event in force and shank [strides]."""
_REPEATS = 0.1
"""Spread of strides that confirm others [strides]."""

Contact = tuple[float | None, float | None]
"""Heel strike and toe-off [s]; None for an end that is outside the record."""


def contacts_of(force: Signal) -> list[Contact]:
    """Return heel strike and toe-off of every contact [s]; None for an end that is outside the record."""
    # Between both thresholds the foot is as it was before.
    is_loaded = force.values > LOADED
    is_unloaded = force.values < UNLOADED
    is_decided = is_loaded | is_unloaded
    first_decided = int(np.argmax(is_decided))
    latest = np.maximum.accumulate(np.where(is_decided, np.arange(is_decided.size), first_decided))
    on_ground = is_loaded[latest]
    time = force.time
    size = on_ground.size
    edges = [0, *(np.flatnonzero(np.diff(on_ground.astype(int))) + 1).tolist(), size]
    # Short breaks are closed first: a contact in pieces would otherwise be dropped piece by piece.
    joined: list[tuple[int, int]] = []
    for first, last in pairwise(edges):
        if not on_ground[first]:
            continue
        if joined and time[first] - time[joined[-1][1]] < SHORTEST_CONTACT:
            joined[-1] = joined[-1][0], last
        else:
            joined.append((first, last))
    return [
        (
            None if first == 0 else _crossing(force, first, LOADED),
            None if last == size else _crossing(force, last, UNLOADED),
        )
        for first, last in joined
        if first == 0 or last == size or time[last] - time[first] >= SHORTEST_CONTACT
    ]


def _crossing(signal: Signal, index: int, level: float) -> float:
    """Return the time [s] at which the line between the samples before and at ``index`` crosses a level."""
    before = signal.values[index - 1]
    after = signal.values[index]
    fraction = 0.5 if after == before else float(np.clip((level - before) / (after - before), 0.0, 1.0))
    return float(signal.time[index - 1] + fraction * (signal.time[index] - signal.time[index - 1]))


def force_of_plates(
    tables: Sequence[MotionTable], names: Sequence[str], shank: Signal, body_mass: float
) -> tuple[Signal | None, list[str]]:
    """Return the vertical force [body weights] of one foot, summed over its contacts on force plates, and remarks."""
    total: Signal | None = None
    chosen = []
    for table in tables:
        for name in [column for column in names if column in table.columns]:
            values, _ = CurveColumns("vertical_force.unit", table, ((1.0, name),)).in_unit(None, ("N",))
            plate = with_absence(Signal(table.file, table.time, values / (body_mass * STANDARD_GRAVITY)))
            contacts = [(start, end) for start, end in contacts_of(plate) if _is_of_foot(start, end, plate, shank)]
            if contacts:
                inside = np.zeros(plate.time.size, dtype=np.bool_)
                step = 1.0 / plate.rate
                for start, end in contacts:
                    is_after = plate.time >= (-np.inf if start is None else start - step)
                    inside |= is_after & (plate.time <= (np.inf if end is None else end + step))
                # Only over this foot's contacts: the same plate may carry the other foot before or after.
                force = np.where(inside, plate.values, 0.0)
                other_plates = 0.0 if total is None else np.interp(plate.time, total.time, total.values)
                total = Signal(table.file, table.time, force + other_plates)
                chosen.append(f"'{name}' ({len(contacts)})")
    if total is None:
        return None, ["vertical force: no plate measured this foot, from the lean of the shank"] if names else []
    return total, [
        f"vertical force: sum of the contacts of this foot, from the lean of the shank, on {', '.join(chosen)}"
    ]


def _is_of_foot(start: float | None, end: float | None, plate: Signal, shank: Signal) -> bool:
    """Return whether the shank leans forward over a contact, which shows a contact of the same foot."""
    least = _LEAST_LEAN_OF_PART if start is None or end is None else _LEAST_LEAN
    first = max(float(plate.time[0] if start is None else start), float(shank.time[0]))
    last = min(float(plate.time[-1] if end is None else end), float(shank.time[-1]))
    if last <= first:
        return False
    # Over its own contact the shank leans forward, so that its angle falls.
    before, after = np.interp([first, last], shank.time, shank.values)
    return bool(before - after > least * np.ptp(shank.values))


def wrap_cycle(walk: Mapping[str, Signal]) -> tuple[dict[str, Signal], float, float] | None:
    """Return one cycle repeated three times, its period [s], and the misfit of its ends relative to the ranges [-].

    None is returned if start and end of the record are not the same motion. Where both ends overlap they are blended;
    of a load the value of larger magnitude is used, because the other may be off the plate. A position advances by the
    distance walked in each cycle.
    """
    start = max(walk[name].time[0] for name in REQUIRED)
    end = min(walk[name].time[-1] for name in REQUIRED)
    # One even clock for both curves, whatever the rates of their files.
    time = np.arange(start, end, 1.0 / _RATE)
    shortest = max(_SHORTEST, (end - start) / LONGEST)
    first = int(np.ceil(shortest * _RATE))
    if time.size <= max(first, 3):
        return None
    curves = np.array(
        [np.interp(time, walk[name].time, walk[name].values) / np.ptp(walk[name].values) for name in REQUIRED]
    )
    rates = np.gradient(curves, axis=1)
    features = np.concatenate([curves, rates / np.ptp(rates, axis=1, keepdims=True)])
    # Every length of a cycle that leaves an overlap is tried; the best overlap is the period.
    shifts = np.arange(first, time.size)
    misfits = np.array(
        [np.sqrt(np.mean((features[:, shift:] - features[:, : time.size - shift]) ** 2)) for shift in shifts]
    )
    best = int(np.argmin(misfits))
    # Start and end are not the same motion: the record is no whole cycle, or the walk is not steady.
    if misfits[best] > _MISFIT:
        return None
    period = float(shifts[best]) / _RATE
    wrapped = {}
    turns = np.arange(3)
    for name, signal in walk.items():
        slack = 1.0 / signal.rate
        if signal.time[0] > start + slack or signal.time[-1] < start + period - slack:
            continue
        count = max(2, round(period * signal.rate))
        instants = start + period * np.arange(count) / count
        values, later = (np.interp(instants + shift, signal.time, signal.values) for shift in (0.0, period))
        overlap = min(float(end), float(signal.time[-1])) - start - period
        inside = instants <= start + max(overlap, 0.0)
        distance = float(np.mean((later - values)[inside])) if signal.is_position else 0.0
        weight = np.clip((instants - start) / overlap, 0.0, 1.0) if overlap > 0.0 else np.ones(count)
        blend = (
            np.where(np.abs(later) > np.abs(values), later, values)
            if name in LOADS
            else weight * values + (1.0 - weight) * (later - distance)
        )
        again = (turns[:, None] * period + instants[None, :]).ravel()
        repeated = (turns[:, None] * distance + np.where(inside, blend, values)[None, :]).ravel()
        wrapped[name] = replace(signal, time=again, values=repeated, columns=(), absent=None)
    return wrapped, period, float(misfits[best])


@dataclass(frozen=True, slots=True)
class Stride:
    """Stride: times [s] of a heel strike, of the following toe-off, and of the next heel strike of the same foot."""

    start: float
    toe_off: float
    end: float

    @property
    def time(self) -> float:
        """Duration of the stride [s]."""
        return self.end - self.start

    @property
    def stance_share(self) -> float:
        """Fraction [-] of the stride until toe-off."""
        return (self.toe_off - self.start) / self.time


@dataclass(frozen=True, slots=True, eq=False)
class Footfalls:
    """Strides found in a walk, with their source.

    ``walk`` holds the signals by name, ``events`` names the source of the strides. ``is_overground`` is True if some
    strides are off the plates, ``is_one_cycle`` if the record is one cycle that was repeated. ``shared`` are strides
    left out with the other foot on the plate.
    """

    walk: Mapping[str, Signal]
    strides: list[Stride]
    events: str
    remarks: tuple[str, ...] = ()
    is_overground: bool = False
    is_one_cycle: bool = False
    shared: tuple[Stride, ...] = ()


def find_footfalls(
    walk: Mapping[str, Signal], tables: Sequence[MotionTable], side: Side, given_least: int | None
) -> Footfalls:
    """Return the strides of a walk: from the force if it shows enough, otherwise from the source with more strides."""
    if any(table.is_mean_stride for table in tables):
        turned = _of_walk(walk, (), side, 1)
        return replace(turned, strides=usable_strides(walk, turned.strides)[:1], is_one_cycle=True)
    least = given_least or LEAST_STRIDES
    # In swing a plate shows its zero, with the other foot on it in most of them too.
    zero = float(np.quantile(walk[FORCE].values, _IN_SWING)) if FORCE in walk else 0.0
    remarks: tuple[str, ...] = ()
    if _LEAST_ZERO < abs(zero) < _LARGEST_ZERO:
        walk = {**walk, FORCE: replace(walk[FORCE], values=walk[FORCE].values - zero)}
        remarks = (f"vertical_force reads {100.0 * zero:+.2g} % of body weight in swing: taken as zero of the plate",)
    footfalls = _of_walk(walk, tables, side, least)
    footfalls = replace(footfalls, remarks=(*footfalls.remarks, *remarks))
    usable = usable_strides(walk, footfalls.strides)
    if len(usable) >= (1 if footfalls.is_overground else least) or least > LEAST_STRIDES:
        return footfalls
    # A cycle must not wrap around what was bridged.
    wrapped = None if any(signal.lost is not None for signal in walk.values()) else wrap_cycle(walk)
    if wrapped is None:
        return footfalls
    cycle, period, misfit = wrapped
    # Three cycles in a row have one whole stride in the middle, wherever the record begins.
    again = _of_walk(cycle, (), side, 1)
    whole = usable_strides(cycle, again.strides)
    # A record of two strides wraps around too, as one cycle that is twice as long.
    if not whole or whole[0].time < _LEAST_OF_CYCLE * period:
        return footfalls
    span = walk[SHANK].time[-1] - walk[SHANK].time[0]
    remark = (
        f"the recording is one cycle: {span:.3g} s of data were closed to a stride of {period:.4g} s; start and end "
        f"differ by {100.0 * misfit:.1f} % of the ranges, and the variation between strides is unknown"
    )
    return replace(again, walk=cycle, strides=whole[:1], remarks=(*again.remarks, remark), is_one_cycle=True)


def _of_walk(walk: Mapping[str, Signal], tables: Sequence[MotionTable], side: Side, least: int) -> Footfalls:
    """Return the strides from the force, if these are at least ``least``, or from the source with more strides."""
    trials = [table.events for table in tables if table.events is not None]
    recorded = []
    # Events of two trials have two clocks.
    if len(trials) == 1:
        strikes, offs = (trials[0].get((side, kind), []) for kind in (STRIKE, OFF))
        for start, end in pairwise(strikes):
            between = [time for time in offs if start < time < end]
            # Two toe-offs between two strikes are a missed strike: such a stride is none.
            recorded += [Stride(start, between[0], end)] if len(between) == 1 else []
    if FORCE not in walk:
        if recorded:
            return Footfalls(walk, recorded, FILE, is_overground=True)
        return Footfalls(walk, strides_from_shank(walk[SHANK]), SHANK)
    leaning = _leaning(walk)
    forced = strides_from_force(walk[FORCE])
    alone = _without_other_foot(Footfalls(walk, forced, FORCE), leaning)
    if len(usable_strides(walk, alone.strides)) >= least:
        return alone
    contacts = [ends for ends in contacts_of(walk[FORCE]) if ends != (None, None)]
    if recorded and contacts and len(usable_strides(walk, recorded)) > len(usable_strides(walk, forced)):
        return Footfalls(walk, recorded, FILE, is_overground=True)
    if not contacts or len(usable_strides(walk, leaning)) <= len(usable_strides(walk, alone.strides)):
        return Footfalls(walk, forced, FORCE)
    corrected, remark = _by_contacts(leaning, contacts)
    by_shank = Footfalls(walk, corrected, SHANK, (remark,), is_overground=True)
    alone = _without_other_foot(by_shank, ())
    return alone if len(usable_strides(walk, alone.strides)) >= least else by_shank


def _leaning(walk: Mapping[str, Signal]) -> list[Stride]:
    """Return the strides from the shank, none if it shows no toe-off: beside a force its message says less."""
    with suppress(DataError):
        return strides_from_shank(walk[SHANK])
    return []


def _without_other_foot(footfalls: Footfalls, leaning: Sequence[Stride]) -> Footfalls:
    """Return the strides of a force that the shank confirms and in or before whose swing the plate is free.

    The events of one foot in force and shank are near each other in every stride; where the other foot is on the plate
    they are not. A shank whose strides do not repeat confirms nothing, and none beyond its own is refuted.
    """
    force = footfalls.walk[FORCE]
    times = [stride.time for stride in leaning]
    repeats = len(times) >= LEAST_STRIDES and np.std(times) < _REPEATS * np.mean(times)

    def is_alone(stride: Stride) -> bool:
        if repeats and stride.end > leaning[0].start + _NEAR and stride.start < leaning[-1].end - _NEAR:
            of = min(leaning, key=lambda each: abs(each.start - stride.start))
            events = stride.start - of.start, stride.toe_off - of.toe_off, stride.end - of.end
            if max(map(abs, events)) > _SHIFTED * of.time:
                return False
        margin = _END_OF_SWING * (stride.end - stride.toe_off)
        # Before the strike the last part of the swing counts.
        swings = (stride.start - 2.0 * margin, stride.start - margin), (stride.toe_off + margin, stride.end - margin)
        inside = np.any([(force.time > first) & (force.time < last) for first, last in swings], axis=0)
        return float(np.mean(force.values[inside] > LOADED)) <= _TOUCHED if inside.any() else True

    # A force and a shank that agree in no stride are of two feet, or have a wrong sign, which is told.
    alone = [stride for stride in footfalls.strides if is_alone(stride)] or footfalls.strides
    others = (stride for stride in footfalls.strides if stride not in alone)
    return replace(footfalls, strides=alone, shared=(*footfalls.shared, *others))


def _by_contacts(strides: list[Stride], contacts: Sequence[Contact]) -> tuple[list[Stride], str]:
    """Return strides from the shank, with events shifted to match the contacts on plates, and a remark."""
    shifts = [
        (start - stride.start, end - stride.toe_off)
        for stride in strides
        for start, end in contacts
        if start is not None and end is not None
        if abs(start - stride.start) < _NEAR and abs(end - stride.toe_off) < _NEAR
    ]
    if not shifts:
        return strides, "heel strikes and toe-offs from shank_angle, less exact than from a force plate"
    # Strikes and toe-offs of the shank are early or late by one time for a person, which the plates show.
    strike, off = (float(np.mean(values)) for values in zip(*shifts, strict=True))
    moved = [Stride(stride.start + strike, stride.toe_off + off, stride.end + strike) for stride in strides]
    return moved, (
        f"few contacts on force plates: heel strikes and toe-offs from shank_angle, shifted by {1000.0 * strike:.0f} "
        f"ms and {1000.0 * off:.0f} ms to match {count_of(len(shifts), 'plate contact')}"
    )


def strides_from_force(force: Signal) -> list[Stride]:
    """Return the whole strides in a vertical force [body weights]; thresholds with hysteresis, interpolated in time."""
    return [
        Stride(start, toe_off, following)
        for (start, toe_off), (following, _) in pairwise(contacts_of(force))
        if start is not None and toe_off is not None and following is not None
    ]


def strides_from_shank(shank: Signal) -> list[Stride]:
    """Return the whole strides in a shank angle phi [rad], positive with the ankle in front of the knee.

    Heel strike is the end of the forward swing of the shank, at its largest angle. Toe-off is the time of the fastest
    backward lean before the swing. The method follows Aminian et al. 2002, J Biomech 35:689, who detect both events
    with a gyroscope on the shank. Raises DataError if there is no toe-off.
    """
    smooth = low_pass(shank, _SMOOTH)
    # A unit that is wrong would be told as a sign that is.
    for fault in range_faults(f"{shank.file}: shank_angle", smooth.values, SHANK_RANGE, is_whole=True):
        raise DataError(fault)
    peaks = _ends_of_swings(smooth)
    rate = np.gradient(smooth.values, smooth.time)
    strides = []
    for first, last in pairwise(peaks):
        lowest = first + int(np.argmin(smooth.values[first:last]))
        # Toe-off lies in the second half of the lean: the shank turns as fast just after heel strike.
        middle = first + (lowest - first) // 2
        if lowest - middle < 2 or smooth.values[lowest] > _DEEPEST:
            raise DataError(
                f"{shank.file}: no toe-off was found: after {smooth.time[first]:g} s, the shank does not lean forward "
                "far enough before the swing"
            )
        off = middle + int(np.argmin(rate[middle:lowest]))
        strides.append(Stride(*(float(smooth.time[sample]) for sample in (first, off, last))))
    return strides


def _ends_of_swings(smooth: Signal) -> list[int]:
    """Return the samples at which the forward swings of a smoothed shank angle end."""
    from scipy.signal import find_peaks

    high = float(np.max(smooth.values))
    low = float(np.min(smooth.values))
    apart = max(1, int(_SHORTEST_STRIDE * smooth.rate))
    return [int(peak) for peak in find_peaks(smooth.values, height=high - _TOP * (high - low), distance=apart)[0]]


def heel_strikes(events: str, walk: Mapping[str, Signal]) -> list[float]:
    """Return the times [s] of all heel strikes in a force or shank angle, with or without a complete stride."""
    if events == FORCE:
        return [start for start, _ in contacts_of(walk[FORCE]) if start is not None]
    smooth = low_pass(walk[SHANK], _SMOOTH)
    return [float(smooth.time[peak]) for peak in _ends_of_swings(smooth)]


def usable_strides(walk: Mapping[str, Signal], strides: Sequence[Stride]) -> list[Stride]:
    """Return the strides over which both shank and ankle angle were recorded."""
    return [stride for stride in strides if all(is_within(walk[name], stride) for name in REQUIRED)]


def is_within(signal: Signal, stride: Stride) -> bool:
    """Return whether a stride lies within a signal, to half a sample, and contains no lost sample."""
    slack = 0.5 / signal.rate
    is_inside = stride.start >= signal.time[0] - slack and stride.end <= signal.time[-1] + slack
    return is_inside and not lost_in(signal, stride)


def lost_in(signal: Signal, stride: Stride) -> int:
    """Return the number of lost samples of a motion in a stride."""
    if signal.lost is None:
        return 0
    return int(np.count_nonzero(signal.lost & (signal.time >= stride.start) & (signal.time <= stride.end)))


def covers(footfalls: Footfalls, name: str, stride: Stride) -> bool:
    """Return whether a stride lies within the record of a curve, and for a load with the stance measured."""
    signal = footfalls.walk[name]
    if not is_within(signal, stride) or name not in LOADS:
        return is_within(signal, stride)
    slack = _ABOUT_STANCE * stride.time
    stance = (signal.time >= stride.start + slack) & (signal.time <= stride.toe_off - slack)
    if signal.absent is not None and (not stance.any() or bool(signal.absent[stance].any())):
        return False
    is_on_plate = signal.values[stance] > UNLOADED if name == FORCE else signal.values[stance] != 0.0
    # Overground the foot may have been on the plate for a part of the stance only.
    return not footfalls.is_overground or (is_on_plate.size > 0 and float(np.mean(is_on_plate)) >= _COVERED)
