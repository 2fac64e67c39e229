"""Where the strides of a recording come from: force, events of the file, the shank, or one cycle that wraps around."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.gait import REQUIRED
from ppafo.gait.plausible.checked import SignSource
from ppafo.gait.plausible.loads import check_force_scale
from ppafo.gait.recorded.columns import LOADS
from ppafo.gait.recorded.events import UNLOADED, Contact, Stride, contacts_of, strides_from_force, strides_from_shank
from ppafo.gait.recorded.mapping import Side
from ppafo.gait.recorded.one_cycle import wrap_cycle
from ppafo.gait.recorded.signal import Signal
from ppafo.gait.recorded.strides import strides_within
from ppafo.gait.recorded.table import MotionTable

_NEAR = 0.15
"""Seconds between a strike or an off seen in the shank and by a plate, for both to be the same."""
_ABOUT_STANCE = 0.05
"""Of the stride, at either end of the stance, which a load need not cover."""
_COVERED = 0.9
"""Share of the rest of the stance on the plate, for the load to be that of the stride."""

LEAST_STRIDES = 2
"""Where nobody states it; a walk past a plate and one cycle have one."""

FORCE, SHANK, FILE = "vertical_force", "shank_angle", "events of the file"


@dataclass(frozen=True, slots=True, eq=False)
class Footfalls:
    """The walk, its strides, where these come from, remarks; ``is_overground``: some of them are off the plates."""

    walk: Mapping[str, Signal]
    strides: list[Stride]
    events: str
    remarks: tuple[str, ...] = ()
    is_overground: bool = False
    is_one_cycle: bool = False


def find_footfalls(
    walk: Mapping[str, Signal],
    tables: Sequence[MotionTable],
    side: Side,
    signs_from: SignSource,
    given_least: int | None,
) -> Footfalls:
    """Return the strides of a walk: from the force where it has enough of them, else from where there are more."""
    least = given_least or LEAST_STRIDES
    found = _of_walk(walk, tables, side, signs_from, least)
    usable = usable_strides(walk, found.strides)
    if len(usable) >= (1 if found.is_overground else least) or least > LEAST_STRIDES:
        return found
    cycle = wrap_cycle(walk)
    if cycle is None:
        return found
    again = _of_walk(cycle.walk, (), side, signs_from, 1)
    whole = usable_strides(cycle.walk, again.strides)
    if not whole:
        return found
    span = walk[SHANK].time[-1] - walk[SHANK].time[0]
    said = (
        f"one cycle that wraps around: {span:.3g} s of data around a stride of {cycle.period:.4g} s, whose start and "
        f"end differ by {100.0 * cycle.misfit:.1f} % of the ranges; how much strides differ is not known"
    )
    return replace(again, walk=cycle.walk, strides=whole[:1], remarks=(*again.remarks, said), is_one_cycle=True)


def usable_strides(walk: Mapping[str, Signal], strides: Sequence[Stride]) -> list[Stride]:
    """Return the strides over which both angles were recorded."""
    return [item for item in strides if all(strides_within(walk[name], [item]) for name in REQUIRED)]


def _of_walk(
    walk: Mapping[str, Signal], tables: Sequence[MotionTable], side: Side, signs_from: SignSource, least: int
) -> Footfalls:
    recorded = _strides_of_file(tables, side)
    if FORCE not in walk:
        if recorded:
            return Footfalls(walk, recorded, FILE, is_overground=True)
        return Footfalls(walk, strides_from_shank(walk[SHANK]), SHANK)
    check_force_scale(walk[FORCE].file, walk[FORCE].values, signs_from)
    forced = strides_from_force(walk[FORCE])
    if len(usable_strides(walk, forced)) >= least:
        return Footfalls(walk, forced, FORCE)
    contacts = [(a, b) for a, b in contacts_of(walk[FORCE]) if a is not None or b is not None]
    if recorded and contacts and len(usable_strides(walk, recorded)) > len(usable_strides(walk, forced)):
        return Footfalls(walk, recorded, FILE, is_overground=True)
    moved = _strides_of_shank(walk) if contacts else []
    if len(usable_strides(walk, moved)) <= len(usable_strides(walk, forced)):
        return Footfalls(walk, forced, FORCE)
    shifted, said = _by_contacts(moved, contacts)
    return Footfalls(walk, shifted, SHANK, (said,), is_overground=True)


def _strides_of_shank(walk: Mapping[str, Signal]) -> list[Stride]:
    try:
        return strides_from_shank(walk[SHANK])
    except DataError:
        # The force has a stride or none, and its message says more.
        return []


def _strides_of_file(tables: Sequence[MotionTable], side: Side) -> list[Stride]:
    """Return the strides between the events that a C3D file has of a foot; a stride needs its toe-off."""
    trials = [table.trial for table in tables if table.trial is not None]
    if len(trials) != 1:
        return []
    strikes, offs = trials[0].strikes(side), trials[0].offs(side)
    strides = []
    for start, end in pairwise(strikes):
        between = [time for time in offs if start < time < end]
        if len(between) == 1:
            strides.append(Stride(start, between[0], end))
    return strides


def _by_contacts(strides: list[Stride], contacts: Sequence[Contact]) -> tuple[list[Stride], str]:
    """Return strides from the shank, moved by what contacts on plates say of its strikes and of its offs."""
    early = [
        (start - item.start, end - item.toe_off)
        for item in strides
        for start, end in contacts
        if start is not None and end is not None
        if abs(start - item.start) < _NEAR and abs(end - item.toe_off) < _NEAR
    ]
    if not early:
        return strides, "strides from the shank, which no plate corrects: heel strikes and toe-offs are less exact"
    strike, off = (float(np.mean(values)) for values in zip(*early, strict=True))
    moved = [Stride(item.start + strike, item.toe_off + off, item.end + strike) for item in strides]
    return moved, (
        f"few contacts on plates: strides from the shank, its strikes moved by {1000.0 * strike:.0f} ms and its "
        f"toe-offs by {1000.0 * off:.0f} ms as {len(early)} contact{'' if len(early) == 1 else 's'} on plates show"
    )


def strides_of_curve(footfalls: Footfalls, name: str, signal: Signal, strides: Sequence[Stride]) -> list[Stride]:
    """Return the strides that a curve covers: those within its record, and of a load those that it was measured in."""
    inside = strides_within(signal, strides)
    if name not in LOADS or not (footfalls.is_overground or signal.absent is not None):
        return inside
    return [item for item in inside if _is_loaded(footfalls.is_overground, name, signal, item)]


def _is_loaded(is_overground: bool, name: str, signal: Signal, stride: Stride) -> bool:
    slack = _ABOUT_STANCE * stride.time
    stance = (signal.time >= stride.start + slack) & (signal.time <= stride.toe_off - slack)
    if not stance.any() or (signal.absent is not None and bool(signal.absent[stance].any())):
        return False
    values = signal.values[stance]
    there = values > UNLOADED if name == FORCE else values != 0.0
    return not is_overground or float(np.mean(there)) >= _COVERED
