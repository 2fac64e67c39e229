"""Force plates that do not say whose foot they carried: each contact is of the foot whose shank leans over it."""

from collections.abc import Sequence

import numpy as np

from ppafo.constants import STANDARD_GRAVITY
from ppafo.gait.recorded.columns import CurveColumns
from ppafo.gait.recorded.events import Contact, contacts_of
from ppafo.gait.recorded.signal import Signal, with_absence
from ppafo.gait.recorded.table import MotionTable

_LEAST_LEAN = 0.5
"""Share of the range of the shank angle by which the shank leans forward over its own contact; over one of the other
foot it swings back."""
_LEAST_LEAN_OF_PART = 0.1
"""The same of a contact that the record cuts."""


def force_of_plates(
    tables: Sequence[MotionTable], names: Sequence[str], shank: Signal, body_mass: float
) -> tuple[Signal | None, list[str]]:
    """Return the vertical force [body weights] of one foot, summed over its contacts on plates, and remarks."""
    total: Signal | None = None
    chosen = []
    for table in tables:
        for name in [item for item in names if item in table.columns]:
            values, _ = CurveColumns("vertical_force.unit", table, ((1.0, name),), True).in_unit(None, ("N",))
            plate = with_absence(Signal(table.file, table.time, values / (body_mass * STANDARD_GRAVITY)))
            own = [contact for contact in contacts_of(plate) if _is_own(contact, plate, shank)]
            if own:
                inside = np.any([_within(contact, plate) for contact in own], axis=0)
                force = np.where(inside, plate.values, 0.0)
                other = 0.0 if total is None else np.interp(plate.time, total.time, total.values)
                total = Signal(table.file, table.time, force + other)
                chosen.append(f"'{name}' ({len(own)})")
    if total is None:
        return None, ["vertical force: no plate carries this foot, by the lean of its shank"] if names else []
    return total, [
        f"vertical force: the contacts of this foot, by the lean of its shank, summed over {', '.join(chosen)}"
    ]


def _is_own(contact: Contact, plate: Signal, shank: Signal) -> bool:
    start, end = (
        plate.time[0] if contact[0] is None else contact[0],
        plate.time[-1] if contact[1] is None else contact[1],
    )
    start, end = max(float(start), float(shank.time[0])), min(float(end), float(shank.time[-1]))
    if end <= start:
        return False
    before, after = np.interp([start, end], shank.time, shank.values)
    least = _LEAST_LEAN if None not in contact else _LEAST_LEAN_OF_PART
    return bool(before - after > least * np.ptp(shank.values))


def _within(contact: Contact, plate: Signal) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
    step = 1.0 / plate.rate
    low = -np.inf if contact[0] is None else contact[0] - step
    high = np.inf if contact[1] is None else contact[1] + step
    return np.asarray((plate.time >= low) & (plate.time <= high), dtype=np.bool_)
