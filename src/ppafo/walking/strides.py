"""A walk stride by stride: numbers of each stride, and curves averaged over strides at equal phases."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

PHASES = np.linspace(0.0, 1.0, 101)
"""Phases from heel strike to heel strike at which curves are averaged."""

SETTLING = 2
"""First strides that are left out of averages: the controller learns the stride time in them."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """What is known of every stride: unit, meaning, and the running total in the record that it is the gain of."""

    unit: str
    summary: str
    total: str


PER_STRIDE: dict[str, Quantity] = {
    "gas": Quantity("kg", "gas taken from the supply in one stride", "state.supplied_mass"),
    "push_off_work": Quantity("J", "work of T_ex while the foot rolls over the toes", "walk.push_off_work"),
    "slap_rate": Quantity(
        "rad/s", "rate of the foot when it lands flat, below 0 with the toes falling", "walk.slap_rates"
    ),
    "toe_clearance": Quantity("m", "lowest toes in mid-swing against the healthy gait", "walk.clearances"),
    "toe_landing": Quantity("-", "1 where the toes met the ground before the heel", "walk.toe_landings"),
}


@dataclass(frozen=True, slots=True)
class Curves:
    """Mean and standard deviation over strides of one channel at ``PHASES``."""

    mean: Floats
    deviation: Floats
    unit: str


def stride_starts(strides: Floats) -> NDArray[np.intp]:
    """Samples right after each heel strike, from the running number of strikes."""
    return np.flatnonzero(np.diff(strides) > 0.5) + 1


def per_stride(totals: Mapping[str, Floats], starts: NDArray[np.intp]) -> dict[str, Floats]:
    """Numbers of each whole stride [SI], shape (strides,), from running totals at the heel strikes."""
    return {name: np.diff(totals[item.total][starts]) for name, item in PER_STRIDE.items()}


def averaged(time: Floats, values: Floats, unit: str, starts: NDArray[np.intp]) -> Curves:
    """Mean and deviation over strides of a channel, each stride brought to the same phases."""
    strides = [
        np.interp(time[first] + PHASES * (time[last] - time[first]), time, values) for first, last in pairwise(starts)
    ]
    together = np.array(strides)
    return Curves(together.mean(axis=0), together.std(axis=0), unit)
