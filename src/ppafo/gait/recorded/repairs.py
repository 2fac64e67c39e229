"""Gaps in the columns that a gait is made of: filled up to a length that the user states, each named."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ppafo.gait.recorded.table import MotionTable
from ppafo.signals.recording import Floats

LONGEST_FILLED = 0.25
"""Seconds; over a quarter of a stride no curve can be drawn through what was not seen."""

Gap = tuple[int, int]
"""First sample of a gap and the first after it."""


def fill_gaps(table: MotionTable, names: Iterable[str], longest: float) -> MotionTable:
    """Return the table with gaps of no longer than ``longest`` [s] in these columns filled by a cubic spline.

    What is missing at the ends stays so, and longer gaps too: whoever uses the column refuses them.
    """
    columns, said = dict(table.columns), []
    for name in dict.fromkeys(names):
        if name in columns and longest > 0.0:
            columns[name], filled = _fill(table.time, columns[name], longest)
            said += [
                f"column '{name}': {last - first} samples from {table.time[first]:g} to {table.time[last - 1]:g} s "
                "filled"
                for first, last in filled
            ]
    return replace(table, columns=columns, remarks=(*table.remarks, *said))


def _fill(time: Floats, values: Floats, longest: float) -> tuple[Floats, list[Gap]]:
    from scipy.interpolate import CubicSpline

    gaps = [gap for gap in gaps_within(values) if time[gap[1]] - time[gap[0] - 1] <= longest + 1e-9]
    if not gaps:
        return values, []
    known = np.isfinite(values)
    through = CubicSpline(time[known], values[known])
    whole = values.copy()
    for first, last in gaps:
        whole[first:last] = through(time[first:last])
    return whole, gaps


def gaps_within(values: Floats) -> list[Gap]:
    """Return the stretches without a number between the first number and the last."""
    known = np.flatnonzero(np.isfinite(values)).tolist()
    return [(before + 1, after) for before, after in pairwise(known) if after > before + 1]
