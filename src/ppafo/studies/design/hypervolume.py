"""Hypervolume: the part of a box that a front of three objectives dominates, exactly."""

from bisect import bisect_left

from ppafo.studies.design.candidates import Floats


def hypervolume(points: Floats, reference: Floats) -> float:
    """Return the volume that points (points, 3) dominate up to a reference point (3,); all objectives to be small.

    The points are taken in order of the third objective; between two of them the dominated area in the plane of the
    other two, bounded by a staircase, stays the same.
    """
    inside = points[(points < reference).all(axis=1)]
    if inside.size == 0:
        return 0.0
    ordered = inside[inside[:, 2].argsort(kind="stable")]
    heights = [*ordered[:, 2].tolist(), float(reference[2])]
    stairs = _Staircase(float(reference[0]), float(reference[1]))
    volume = area = 0.0
    for (x, y, height), above in zip(ordered.tolist(), heights[1:], strict=True):
        area += stairs.add(x, y)
        volume += area * (above - height)
    return volume


class _Staircase:
    """Points of a plane of which none dominates another: x grows, y falls."""

    def __init__(self, right: float, top: float) -> None:
        self._right, self._top = right, top
        self._x: list[float] = []
        self._y: list[float] = []

    def add(self, x: float, y: float) -> float:
        """Add a point and return the area that it dominates and no point before it did."""
        place = bisect_left(self._x, x)
        left_height = self._y[place - 1] if place else self._top
        if left_height <= y or (place < len(self._x) and self._x[place] == x and self._y[place] <= y):
            return 0.0
        area, start, height, end = 0.0, x, left_height, place
        while end < len(self._x) and self._y[end] >= y:
            area += (self._x[end] - start) * (height - y)
            start, height, end = self._x[end], self._y[end], end + 1
        stop = self._x[end] if end < len(self._x) else self._right
        area += (stop - start) * (height - y)
        self._x[place:end], self._y[place:end] = [x], [y]
        return area
