"""Which of many points no other beats: non-dominated sorting with constraints, and how crowded a front is.

Deb, Pratap, Agarwal and Meyarivan, A fast and elitist multiobjective genetic algorithm: NSGA-II, 2002. All objectives
are to be small.
"""

import numpy as np
from numpy.typing import NDArray

from ppafo.studies.design.candidates import Floats, Worth

_CHUNK = 512


def dominance(first: Worth, second: Worth) -> NDArray[np.bool_]:
    """Return (first, second): True where a point of the first dominates one of the second.

    Of two points of which not both keep the constraints, the one that violates them less dominates.
    """
    a, b = first.objectives[:, None, :], second.objectives[None, :, :]
    is_better = np.all(a <= b, axis=2) & np.any(a < b, axis=2)
    both = first.is_feasible[:, None] & second.is_feasible[None, :]
    violates_less = first.violation[:, None] < second.violation[None, :]
    return np.where(both, is_better, violates_less)


def non_dominated(worth: Worth) -> NDArray[np.bool_]:
    """Return which points (points,) no other dominates; equal points all stay."""
    kept = np.ones(worth.violation.size, dtype=bool)
    for start in range(0, kept.size, _CHUNK):
        # What is dominated cannot be needed to dominate others: its dominator dominates them too.
        members = np.flatnonzero(kept)
        part = np.arange(start, min(start + _CHUNK, kept.size))
        kept[part] &= ~dominance(worth.at(members), worth.at(part)).any(axis=0)
    return kept


def ranks(worth: Worth) -> NDArray[np.int64]:
    """Return the rank (points,): 0 for the points that none dominates, 1 for those that only these dominate, ..."""
    matrix = dominance(worth, worth)
    counts = matrix.sum(axis=0)
    found = np.full(counts.size, -1, dtype=np.int64)
    rank = 0
    while np.any(found < 0):
        front = (found < 0) & (counts == 0)
        found[front] = rank
        counts = counts - matrix[front].sum(axis=0)
        rank += 1
    return found


def crowding(objectives: Floats) -> Floats:
    """Return the crowding distance (points,) [-]: how far apart a point's neighbours are; infinite at the ends."""
    count = objectives.shape[0]
    distance = np.zeros(count)
    for column in objectives.T:
        order = np.argsort(column, kind="stable")
        span = column[order[-1]] - column[order[0]]
        distance[order[[0, -1]]] = np.inf
        if span > 0.0 and count > 2:
            distance[order[1:-1]] += (column[order[2:]] - column[order[:-2]]) / span
    return distance


def survivors(worth: Worth, count: int) -> NDArray[np.intp]:
    """Return the places of the ``count`` best points: lower ranks first, then the less crowded of the last front."""
    rank = ranks(worth)
    order = np.empty(0, dtype=np.intp)
    for value in range(int(rank.max()) + 1):
        front = np.flatnonzero(rank == value)
        if order.size + front.size > count:
            apart = crowding(np.nan_to_num(worth.objectives[front]))
            front = front[np.argsort(-apart, kind="stable")]
        order = np.concatenate([order, front])[:count]
    return order
