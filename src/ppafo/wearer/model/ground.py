"""The ground under a point of the foot: springs that yield, with damping and friction that a step takes implicitly.

Contact of H. Geyer and H. Herr, IEEE Trans. Neural Syst. Rehabil. Eng. 18 (2010) 263: compressed by 1 cm under the
body's weight, and by 10 cm along; no force pulls. A point sticks where it met the ground until friction lets go. On a
slope forces are normal to the ground and along it; a point that passes to another piece has its normal at once.
"""

from typing import NamedTuple

from ppafo.wearer.model.way import Footing


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
    """Where a point sticks, forward and up [m], 1 while it does, and 1 while it touches the ground."""

    anchor: float
    anchor_height: float
    sticks: float
    touches: float


class Contact(NamedTuple):
    """Force on a point [N], forward and up, that normal to the ground, damping [N s/m], and the point after it.

    ``damping_xy`` is how much less force forward there is for a speed up, ``damping_yx`` the other way round: friction
    of a point that slides falls as it rises and presses less, and what it presses does not depend on how it slides.
    """

    force_x: float
    force_y: float
    normal: float
    damping_xx: float
    damping_xy: float
    damping_yx: float
    damping_yy: float
    after: Point


def contact(
    ground: Ground, under: Footing, point: Point, x: float, y: float, speed_x: float, speed_y: float, last: float
) -> Contact:
    """Forces of the ground on a point at x, y [m] that moves [m/s].

    With c and s of the slope, a way (x, y) has c x + s y along the ground and c y - s x normal to it. A point that
    meets the ground did so within the ``last`` [s], and sticks where it was then.
    """
    sine, cosine = under.sine, under.cosine
    # The height is measured upright, the springs yield along the normal.
    depth = max((under.height - y) * cosine, 0.0)
    touches = y < under.height
    speed = cosine * speed_x + sine * speed_y
    rise = cosine * speed_y - sine * speed_x
    # A point that rises faster than the ground relaxes has lost it: no force pulls it back.
    bracket = 1.0 - rise / ground.relaxing
    normal = ground.stiffness * depth * max(bracket, 0.0)
    damping_normal = ground.stiffness * depth / ground.relaxing if bracket > 0.0 else 0.0
    # It met the ground between two steps, and sticks where it was then: the place must not hang on the step.
    since = min(depth / max(-rise, ground.rest_speed), last)
    anchor = point.anchor if point.touches > 0.5 else x - since * speed_x
    anchor_height = point.anchor_height if point.touches > 0.5 else y - since * speed_y
    sticks = point.sticks > 0.5 or point.touches < 0.5
    away = cosine * (x - anchor) + sine * (y - anchor_height)
    held = -ground.stiffness_along * (away + abs(away) * speed / ground.relaxing)
    # Friction that jumped with the sign of the speed would make a resting point go back and forth from step to step.
    quick = max(abs(speed), ground.rest_speed)
    slides = ground.sliding * normal / quick
    lets_go = sticks and abs(held) > ground.sticking * normal
    rests = not sticks and abs(speed) < ground.rest_speed
    holds = sticks and not lets_go
    along = held if holds else -slides * speed
    damping_along = ground.stiffness_along * abs(away) / ground.relaxing if holds else slides
    # The normal force that damping takes away also takes friction away, against the way that the point slides.
    drag = 0.0 if holds else -ground.sliding * damping_normal * speed / quick
    return Contact(
        force_x=cosine * along - sine * normal,
        force_y=cosine * normal + sine * along,
        normal=normal,
        damping_xx=cosine * (cosine * damping_along - sine * drag) + sine * sine * damping_normal,
        damping_xy=cosine * (sine * (damping_along - damping_normal) + cosine * drag),
        damping_yx=sine * (cosine * (damping_along - damping_normal) - sine * drag),
        damping_yy=cosine * cosine * damping_normal + sine * (sine * damping_along + cosine * drag),
        after=Point(
            anchor=anchor if holds else x,
            anchor_height=anchor_height if holds else y,
            sticks=1.0 if (holds or rests) else 0.0,
            touches=1.0 if touches else 0.0,
        ),
    )
