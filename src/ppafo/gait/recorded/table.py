"""Motion recording as a table: time, and columns in the units of the file; short gaps can be filled."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ppafo.errors import DataError, refused_as
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import check_clock
from ppafo.wording import argument_text

# Kinds of events in a file: heel strike and toe-off.
STRIKE = "foot strike"
OFF = "foot off"

AXES = "xyz"
COORDINATES = (".x", ".y", ".z")
"""Suffixes of the columns of a marker's coordinates, ``LABEL.x``."""
_TURNS = 3
"""Number of repetitions of a mean stride: one whole stride lies within, wherever its table begins."""
_ENDS_OF_STRIDE = 5.0
"""Largest distance of the first and the last row of a mean stride to 0 and 100 % [%]."""
_LARGEST_JUMP = 3.0
"""Sampling interval, relative to the median interval, above which it counts as a gap [-]."""
MOST_ACCELERATION = 50.0
"""Acceleration [m/s^2] that a marker on a leg does not reach when it starts to move from rest."""
_COARSE = 5.0e-5
"""Least difference of coordinates [m] from which rounding may repeat the position of a marker at rest."""
LONGEST_FILLED = 0.25
"""Longest gap [s] that may be filled; beyond a quarter of a stride, interpolation is not possible."""


def bare_label(label: str) -> str:
    """Return the label of a marker without the subject's name before a colon."""
    return label.rpartition(":")[2].strip()


def marker_of(name: str) -> str:
    """Return the marker of a coordinate column; any other column name is returned unchanged."""
    return name[:-2] if name[-2:] in COORDINATES else name


Events = dict[tuple[str, str], list[float]]
"""Times [s] of the events in a file, by side and kind."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionTable:
    """Motion recording: columns over time [s] as stored in a file; a unit that the file does not state is empty.

    ``form`` is the name of the file format, set by the caller of the reader. ``kind`` is ``measured`` or ``synthetic``.
    ``remarks`` describe repairs. ``problem`` is a fault of the file that leaves its columns readable; the import
    refuses the file after it has checked them. ``is_mean_stride`` is true for a mean stride that was repeated.
    ``body_mass`` [kg] and ``stature`` [m] of the subject, and ``events``, are None if the file does not state them.
    """

    file: str
    time: Floats
    columns: Mapping[str, Floats]
    units: Mapping[str, str]
    form: str = ""
    kind: str = "measured"
    remarks: tuple[str, ...] = ()
    problem: str = ""
    is_mean_stride: bool = False
    body_mass: float | None = None
    stature: float | None = None
    events: Events | None = None


def mean_stride_table(table: MotionTable, stride_time: float) -> MotionTable:
    """Return a mean stride over percent, in its first column, over time, repeated; unchanged without such a column."""
    percent = next(iter(table.columns.values()))
    steps = np.diff(percent)
    ends = np.abs(percent[[0, -1]] - [0.0, 100.0])
    if not (np.all(steps > 0.0) and np.all(ends < _ENDS_OF_STRIDE) and percent[0] >= 0.0 and percent[-1] <= 100.0):
        return table
    # 100 % is 0 % of the next stride.
    kept = percent < 100.0
    time = (np.arange(_TURNS)[:, None] + percent[kept] / 100.0).ravel() * stride_time
    columns = {name: np.tile(values[kept], _TURNS) for name, values in table.columns.items()}
    remark = f"one mean stride, closed to {stride_time:.4g} s as given; the variation between strides is unknown"
    return replace(table, time=time, columns=columns, remarks=(*table.remarks, remark), problem="", is_mean_stride=True)


COUNTERS = (
    *("", "index", "frame", "frame#", "framenumber", "frame number"),
    *("sample", "samplenumber", "sample number", "packetcounter", "packet counter", "counter"),
)
"""Column names of row counters, in lower case: pandas' index, frames of cameras, samples of inertial sensors."""


def counted_table(table: MotionTable, rate: float) -> MotionTable:
    """Return a table without time column over time [s], by its column of frame numbers, or by its rows, at ``rate``.

    Frame numbers count from 1, or from 0 if the first is 0; a number that is left out is a missing row.
    """
    name, counted = next(iter(table.columns.items()))
    time = np.arange(table.time.size) / rate
    if name.lower() in COUNTERS:
        time = (counted - min(float(counted[0]), 1.0)) / rate
        with refused_as(DataError, table.file, DataError):
            check_clock(time, range(1, time.size + 1), "row")
    return replace(table, time=time, problem="")


def cut_table(
    table: MotionTable, longest_gap: float = 0.0, start: float | None = None, end: float | None = None
) -> MotionTable:
    """Return a table from ``start`` to ``end`` [s], with a remark on missing rows.

    A gap of up to ``longest_gap`` [s] is bridged. A longer gap gets one row of NaN, so that strides across it are
    rejected.
    """
    if table.time.size < 3:
        raise DataError(f"{table.file}: has only {table.time.size} rows, too few for a stride")
    low = float(table.time[0] if start is None else start)
    high = float(table.time[-1] if end is None else end)
    steps = np.diff(table.time)
    median = float(np.median(steps))
    # Gaps outside of what is used do not matter.
    seen = (table.time[:-1] >= low) & (table.time[1:] <= high)
    jumps = np.flatnonzero(seen & (steps > _LARGEST_JUMP * median)).tolist()
    long = [index for index in jumps if steps[index] > longest_gap + 1.5 * median]
    remarks = [
        f"rows from {table.time[i]:g} to {table.time[i + 1]:g} s are missing"
        + ("" if i in long else " and were bridged")
        for i in jumps
    ]
    table = replace(table, remarks=(*table.remarks, *remarks))
    if long:
        after = np.array(long) + 1
        middles = 0.5 * (table.time[long] + table.time[after])
        columns = {name: np.insert(values, after, np.nan) for name, values in table.columns.items()}
        table = replace(table, time=np.insert(table.time, after, middles), columns=columns)
    inside = (table.time >= low) & (table.time <= high)
    if not inside.any():
        asked = (("start", start), ("end", end))
        given = " and ".join(argument_text(name, f"{value:g} s") for name, value in asked if value is not None)
        raise DataError(f"{table.file}: {given}: leaves none of its samples, {table.time[0]:g} to {table.time[-1]:g} s")
    columns = {name: values[inside] for name, values in table.columns.items()}
    return replace(table, time=table.time[inside], columns=columns)


def metres_in(table: MotionTable, column: str) -> float:
    """Return the unit of a column [m]; most laboratories write mm, also where the file does not say so."""
    return {"m": 1.0, "cm": 0.01}.get(table.units.get(column, ""), 0.001)


def without_lost_markers(table: MotionTable, names: Iterable[str]) -> MotionTable:
    """Return the table with NaN for frames in which a marker of these columns was lost, and a remark on each marker.

    A marker is lost in three cases: a coordinate is not a number; all coordinates are exactly 0; or its position stays
    bitwise equal for three frames, which no camera sees twice of a moving person. Where the file is rounded to
    ``_COARSE`` or more, a marker at rest does so too: then only a jump after it, further than a marker can move from
    rest in one sample interval, ``MOST_ACCELERATION`` times the interval squared [m], shows that it was lost.
    """
    columns = dict(table.columns)
    remarks = []
    labels = dict.fromkeys(name[:-2] for name in names if name[-2:] in COORDINATES)
    interval = float(np.median(np.diff(table.time))) if table.time.size > 1 else 0.0
    for label in labels:
        own = [f"{label}.{axis}" for axis in AXES if f"{label}.{axis}" in columns]
        if len(own) < 2:
            continue
        at = np.array([columns[name] for name in own]) * metres_in(table, own[0])
        recorded = np.isfinite(at).all(axis=0)
        zero = (at == 0.0).all(axis=0)
        steps = np.abs(np.diff(at, axis=1))
        is_coarse = steps.any() and float(np.min(steps, initial=np.inf, where=steps > 0.0)) > _COARSE
        # A marker that is repeated up to the end of the file never jumps; one that never moves is a point of the lab.
        furthest = MOST_ACCELERATION * interval**2 if is_coarse else 0.0
        lengths = np.linalg.norm(np.diff(at, axis=1), axis=0)
        moves = np.flatnonzero(lengths != 0.0).tolist()
        held = np.zeros(lengths.size + 1, dtype=np.bool_)
        for before, after in pairwise([*moves, *([lengths.size] if moves and furthest == 0.0 else [])]):
            # Frames before + 1 to after have one place, of which the first was seen.
            if after - before > 2 and (after == lengths.size or lengths[after] > furthest):
                held[before + 2 : after + 1] = True
        causes = {
            "not recorded": ~recorded,
            # A marker that is 0 throughout stands at the origin.
            "all coordinates 0": zero & bool((recorded & ~zero).any()),
            "position unchanged": ~zero & held,
        }
        lost = {cause: frames for cause, frames in causes.items() if frames.any()}
        if not lost:
            continue
        gap = np.logical_or.reduce(list(lost.values()))
        for name in own:
            columns[name] = np.where(gap, np.nan, columns[name])
        how = " and ".join(lost)
        remarks.append(f"marker '{label}' was lost in {np.count_nonzero(gap)} of {table.time.size} frames ({how})")
    return replace(table, columns=columns, remarks=(*table.remarks, *remarks))


def fill_gaps(table: MotionTable, names: Iterable[str], longest: float) -> MotionTable:
    """Return the table with gaps of up to ``longest`` [s] in these columns filled by a cubic spline.

    Gaps at the ends and longer gaps remain NaN.
    """
    from scipy.interpolate import CubicSpline

    columns = dict(table.columns)
    remarks = []
    time = table.time
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
            remarks.append(
                f"column '{name}': {last - first} samples from {time[first]:g} to {time[last - 1]:g} s filled"
            )
        columns[name] = whole
    return replace(table, columns=columns, remarks=(*table.remarks, *remarks))
