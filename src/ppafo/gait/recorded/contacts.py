"""Contacts of a foot with the ground: heel strike and toe-off from a vertical force, and force plates of one foot."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.gait.recorded.columns import CurveColumns
from ppafo.gait.recorded.signal import Signal, with_absence
from ppafo.gait.recorded.table import MotionTable

LOADED, UNLOADED = 0.05, 0.03
"""Thresholds of the force [body weights]: the foot is on the ground above the first, and off it below the second."""
SHORTEST_CONTACT = 0.1
"""Duration [s] below which a contact, or a time off the ground, is noise of the force plate."""
_LEAST_LEAN = 0.5
"""Least decrease of the shank angle over a contact of the same foot, relative to its range [-]; over a contact of the
other foot the angle increases."""
_LEAST_LEAN_OF_PART = 0.1
"""Least decrease of the shank angle, relative to its range [-], over a contact cut by an end of the record."""

Contact = tuple[float | None, float | None]
"""Heel strike and toe-off [s]; None for an end that is outside the record."""


def contacts_of(force: Signal) -> list[Contact]:
    """Return heel strike and toe-off of every contact [s]; None for an end that is outside the record."""
    # Between both thresholds the foot is as it was before.
    is_loaded, is_unloaded = force.values > LOADED, force.values < UNLOADED
    is_decided = is_loaded | is_unloaded
    first_decided = int(np.argmax(is_decided))
    latest = np.maximum.accumulate(np.where(is_decided, np.arange(is_decided.size), first_decided))
    on_ground = is_loaded[latest]
    time, size = force.time, on_ground.size
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
    before, after = signal.values[index - 1], signal.values[index]
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
            values, _ = CurveColumns("vertical_force.unit", table, ((1.0, name),), True).in_unit(None, ("N",))
            plate = with_absence(Signal(table.file, table.time, values / (body_mass * STANDARD_GRAVITY)))
            contacts = [(start, end) for start, end in contacts_of(plate) if _is_of_foot(start, end, plate, shank)]
            if contacts:
                inside, step = np.zeros(plate.time.size, dtype=np.bool_), 1.0 / plate.rate
                for start, end in contacts:
                    is_after = plate.time >= (-np.inf if start is None else start - step)
                    inside |= is_after & (plate.time <= (np.inf if end is None else end + step))
                # Only over this foot's contacts: the same plate may carry the other foot before or after.
                force = np.where(inside, plate.values, 0.0)
                other_plates = 0.0 if total is None else np.interp(plate.time, total.time, total.values)
                total = Signal(table.file, table.time, force + other_plates)
                chosen.append(f"'{name}' ({len(contacts)})")
    if total is None:
        return None, ["vertical force: no plate measured this foot, judged by the lean of the shank"] if names else []
    return total, [
        f"vertical force: sum of the contacts of this foot, judged by the lean of the shank, on {', '.join(chosen)}"
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
