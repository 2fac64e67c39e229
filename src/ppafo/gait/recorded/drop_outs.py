"""Columns that stay constant while the wearer walks: drop-outs that were filled with the last value."""

from collections.abc import Mapping, Sequence

import numpy as np

from ppafo.errors import DataError
from ppafo.gait.recorded.columns import LOADS
from ppafo.gait.recorded.events import Stride
from ppafo.gait.recorded.signal import Signal
from ppafo.gait.recorded.table import MotionTable
from ppafo.signals.recording import Floats

LONGEST_HELD = 0.1
"""Seconds that a column may keep one value within the strides."""

_ABOUT_STANCE = 0.05
"""Of the stride, at either end of the stance, in which a load may rest too."""
_COARSE = 0.002
"""Fraction of the range; a sensor with coarser steps keeps a value where its curve turns round."""


def check_constant(
    walk: Mapping[str, Signal],
    tables: Sequence[MotionTable],
    strides: Sequence[Stride],
    covered: Mapping[str, Sequence[Stride]],
    left_out: Sequence[Stride],
) -> None:
    """Raise DataError for a column that keeps one value for more than 0.1 s within the strides; a load may in swing.

    Loads are checked in the strides that they cover, motions in strides that are left out too: a drop-out made
    those longer. A column that never moves is no drop-out, and a stretch that a coarse sensor enters and leaves by its
    smallest step is none either.
    """
    by_file = {table.file: table for table in tables}
    for name, signal in walk.items():
        table = by_file[signal.file]
        spans = [_span(name, item) for item in (covered[name] if name in LOADS else [*strides, *left_out])]
        for column, values in _series_of(name, signal, table):
            found = constant_stretch(table.time, values, spans)
            if found is not None:
                raise DataError(
                    f"{table.file}: column {column!r} of {name} keeps one value from {found[0]:.4g} to "
                    f"{found[1]:.4g} s while the wearer walks: a drop-out was filled with it; cut the file there and "
                    "give the longer part"
                )


def _series_of(name: str, signal: Signal, table: MotionTable) -> list[tuple[str, Floats]]:
    """Return the columns of a curve; plates that are summed rest in turn, so their sum is looked at."""
    columns = [(column, table.columns[column]) for column in signal.columns]
    if name not in LOADS or len(columns) < 2:
        return columns
    return [(" + ".join(signal.columns), np.sum([np.abs(values) for _, values in columns], axis=0))]


def constant_stretch(time: Floats, values: Floats, spans: Sequence[tuple[float, float]]) -> tuple[float, float] | None:
    """Return start and end [s] of the first stretch with one value that covers more than 0.1 s of the spans."""
    moves = np.flatnonzero(np.diff(values) != 0.0)
    if moves.size == 0:
        return None
    starts, ends = np.concatenate([[0], moves + 1]), np.concatenate([moves, [values.size - 1]])
    long = time[ends] - time[starts] > LONGEST_HELD
    for first, last in zip(starts[long].tolist(), ends[long].tolist(), strict=True):
        start, end = float(time[first]), float(time[last])
        inside = sum(max(0.0, min(end, high) - max(start, low)) for low, high in spans)
        if inside > LONGEST_HELD and not _by_coarse_steps(values, first, last):
            return start, end
    return None


def _by_coarse_steps(values: Floats, first: int, last: int) -> bool:
    """Tell whether the value changes by the smallest step of a coarse sensor on both sides of a stretch."""
    steps = np.abs(np.diff(values))
    # Rounding makes equal steps of a sensor differ in the last digits.
    smallest = 1.001 * float(np.min(steps[steps > 0.0]))
    beside = [float(steps[place]) for place in (first - 1, last) if 0 <= place < steps.size]
    return smallest > _COARSE * float(np.nanmax(values) - np.nanmin(values)) and max(beside) <= smallest


def _span(name: str, stride: Stride) -> tuple[float, float]:
    """Return the times between which a column of this curve moves all the time."""
    if name not in LOADS:
        return stride.start, stride.end
    slack = _ABOUT_STANCE * stride.time
    return stride.start + slack, stride.toe_off - slack
