"""A recording of motion in one form: time, and columns with the unit of the file; gaps filled where that is honest."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from ppafo.errors import DataError
from ppafo.signals.recording import Floats

STRIKE, OFF = "foot strike", "foot off"
"""Kinds of events."""

Events = dict[tuple[str, str], list[float]]


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """Data of a file beside its columns: subject (kg, m; None where not stated), events [s] by side and kind.

    ``remarks`` say how its events were read, or why they were not.
    """

    body_mass: float | None = None
    stature: float | None = None
    events: Events = field(default_factory=dict)
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class MotionTable:
    """Columns over time [s] as a file has them; a unit is empty where the file does not say it.

    ``form`` is the name of its form, which the reader of any form fills in. ``kind`` is ``measured`` or ``synthetic``.
    ``remarks`` say what was mended, ``trial`` is what the file says of subject and events.
    """

    file: str
    time: Floats
    columns: Mapping[str, Floats]
    units: Mapping[str, str]
    form: str = ""
    kind: str = "measured"
    remarks: tuple[str, ...] = ()
    trial: Trial | None = None


_LARGEST_JUMP = 3.0
"""Times the median interval; a longer one is a gap, not jitter of the clock."""


def cut_table(
    table: MotionTable, longest_gap: float = 0.0, start: float | None = None, end: float | None = None
) -> MotionTable:
    """Return a table from ``start`` to ``end`` [s], whose clock runs without a gap there.

    Rows missing for no longer than ``longest_gap`` [s] are bridged and remarked; DataError for longer ones.
    """
    if table.time.size < 3:
        raise DataError(f"{table.file}: has {table.time.size} rows; a stride needs several tens")
    low = float(table.time[0] if start is None else start)
    high = float(table.time[-1] if end is None else end)
    steps = np.diff(table.time)
    median = float(np.median(steps))
    # Gaps outside of what is used do not matter.
    seen = (table.time[:-1] >= low) & (table.time[1:] <= high)
    jumps = np.flatnonzero(seen & (steps > _LARGEST_JUMP * median)).tolist()
    for index in jumps:
        if steps[index] > longest_gap + 1.5 * median:
            raise DataError(
                f"{table.file}: the time jumps in row {index + 2} from {table.time[index]:g} s to "
                f"{table.time[index + 1]:g} s, the usual interval is {median:.3g} s; cut the file there or fill the gap"
                " (--start, --end, --fill-gaps)"
            )
    said = [f"rows from {table.time[i]:g} to {table.time[i + 1]:g} s are missing and were bridged" for i in jumps]
    table = replace(table, remarks=(*table.remarks, *said))
    inside = (table.time >= low) & (table.time <= high)
    if not inside.any():
        raise DataError(
            f"{table.file}: nothing is left of it from {low:g} to {high:g} s; it goes from {table.time[0]:g} to "
            f"{table.time[-1]:g} s: choose --start and --end within"
        )
    columns = {name: values[inside] for name, values in table.columns.items()}
    return replace(table, time=table.time[inside], columns=columns)


LONGEST_FILLED = 0.25
"""Seconds; over a quarter of a stride no curve can be drawn through what was not seen."""


def fill_gaps(table: MotionTable, names: Iterable[str], longest: float) -> MotionTable:
    """Return the table with gaps of no longer than ``longest`` [s] in these columns filled by a cubic spline.

    What is missing at the ends stays so, and longer gaps too: the user of the column refuses them.
    """
    from scipy.interpolate import CubicSpline

    columns, said, time = dict(table.columns), [], table.time
    for name in dict.fromkeys(names):
        if name not in columns or longest <= 0.0:
            continue
        whole = columns[name].copy()
        known = np.flatnonzero(np.isfinite(whole))
        stretches = [(before + 1, after) for before, after in pairwise(known.tolist()) if after > before + 1]
        short = [gap for gap in stretches if time[gap[1]] - time[gap[0] - 1] <= longest + 1e-9]
        if not short:
            continue
        # Through all that was seen, not only the neighbours of the gap: slopes at its ends count.
        through = CubicSpline(time[known], whole[known])
        for first, last in short:
            whole[first:last] = through(time[first:last])
            said.append(f"column '{name}': {last - first} samples from {time[first]:g} to {time[last - 1]:g} s filled")
        columns[name] = whole
    return replace(table, columns=columns, remarks=(*table.remarks, *said))
