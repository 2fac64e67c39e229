"""The ground under a point of the foot: springs that yield, with damping that a step takes implicitly, and friction.

Contact of H. Geyer and H. Herr, IEEE Trans. Neural Syst. Rehabil. Eng. 18 (2010) 263: compressed by 1 cm under the
body's weight, and by 10 cm along; no force pulls. A point sticks where it met the ground until friction lets go.
"""

from typing import NamedTuple


class Ground(NamedTuple):
    """Stiffness normal to the ground and along it [N/m], largest speed at which it relaxes [m/s], friction [-].

    A point begins to slide at ``sticking`` times the normal force, slides at ``sliding`` times, and rests below
    ``rest_speed`` [m/s].
    """

    stiffness: float
    stiffness_along: float
    relaxing: float
    sticking: float
    sliding: float
    rest_speed: float


class Point(NamedTuple):
    """Where a point sticks [m], 1 while it does, and 1 while it touches the ground."""

    anchor: float
    sticks: float
    touches: float


class Contact(NamedTuple):
    """Forces on a point [N] along and up, their damping [N s/m], and the point after it."""

    along: float
    up: float
    damping_along: float
    damping_up: float
    after: Point


def contact(ground: Ground, point: Point, x: float, y: float, speed_x: float, speed_y: float) -> Contact:
    """Forces of the ground on a point at x, y [m] that moves [m/s]; y counts from the ground."""
    depth = max(-y, 0.0)
    touches = y < 0.0
    bracket = 1.0 - speed_y / ground.relaxing
    up = ground.stiffness * depth * max(bracket, 0.0)
    damping_up = ground.stiffness * depth / ground.relaxing if bracket > 0.0 else 0.0
    anchor = point.anchor if point.touches > 0.5 else x
    sticks = point.sticks > 0.5 or point.touches < 0.5
    away = x - anchor
    held = -ground.stiffness_along * (away + abs(away) * speed_x / ground.relaxing)
    slides = ground.sliding * up / max(abs(speed_x), ground.rest_speed)
    lets_go = sticks and abs(held) > ground.sticking * up
    rests = not sticks and abs(speed_x) < ground.rest_speed
    holds = sticks and not lets_go
    return Contact(
        along=held if holds else -slides * speed_x,
        up=up,
        damping_along=ground.stiffness_along * abs(away) / ground.relaxing if holds else slides,
        damping_up=damping_up,
        after=Point(
            anchor=anchor if holds else x,
            sticks=1.0 if (holds or rests) else 0.0,
            touches=1.0 if touches else 0.0,
        ),
    )
