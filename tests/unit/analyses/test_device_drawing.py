"""The drawing of the device: what is joined to what."""

from itertools import pairwise

import pytest

from ppafo.analyses.reproduce.drawing import device_figure
from ppafo.report.style import CHAMBER_1, CHAMBER_2, PROPORTIONAL

Point = tuple[float, float]


def lies_on(point: Point, start: Point, end: Point) -> bool:
    """Whether a point lies on a horizontal or vertical piece of a line."""
    return all(min(a, b) - 1e-9 <= x <= max(a, b) + 1e-9 for x, a, b in zip(point, start, end, strict=True))


@pytest.mark.parametrize("colour_of_branch", [CHAMBER_1.colour, CHAMBER_2.colour])
def test_the_proportional_valve_is_coupled_to_the_regulator_and_the_chamber_of_each_direction(
    colour_of_branch: str,
) -> None:
    (axes,) = device_figure().axes
    lines = [(line.get_color(), [(float(x), float(y)) for x, y in line.get_xydata()]) for line in axes.get_lines()]
    ends = [points[-1] for colour, points in lines if colour == PROPORTIONAL.colour]
    pieces = [piece for colour, points in lines if colour == colour_of_branch for piece in pairwise(points)]
    assert sum(any(lies_on(end, *piece) for piece in pieces) for end in set(ends)) == 2
