"""The way before a wearer: the height of the ground over it, in straight pieces, and pushes on the trunk.

x [m] is along the horizontal, from where the hip starts. The ground is a line without gaps: a step is a short steep
piece, whose own normal holds a toe that runs into it.
"""

from typing import Annotated, NamedTuple

PIECES, PUSHES = 8, 2
"""Most pieces of the ground, and most pushes."""

NEVER = 1.0e6
"""Where a piece or a push begins that is not used [m]."""


class Piece(NamedTuple):
    """A straight piece of the ground: where it begins and its height there [m], its slope [-], the cosine of that."""

    start: float
    height: float
    slope: float
    cosine: float


class Push(NamedTuple):
    """A force on the trunk [N], forward above 0: where the hip is as it begins [m], and how long it lasts [s]."""

    place: float
    force: float
    duration: float


class Way(NamedTuple):
    """Pieces in the order of their starts, the first from far behind on, and pushes; the unused begin at ``NEVER``."""

    pieces: Annotated[tuple[Piece, ...], PIECES]
    pushes: Annotated[tuple[Push, ...], PUSHES]


UNUSED = Piece(start=NEVER, height=0.0, slope=0.0, cosine=1.0)
UNUSED_PUSH = Push(NEVER, 0.0, 0.0)
LEVEL = Way((UNUSED._replace(start=-NEVER), *(UNUSED,) * (PIECES - 1)), (UNUSED_PUSH,) * PUSHES)
"""Level ground, and no push."""


class Footing(NamedTuple):
    """The ground under a place: its height [m], and sine and cosine [-] of its slope, which is above 0 uphill."""

    height: float
    sine: float
    cosine: float


class Pushed(NamedTuple):
    """How far the hip has come [m], the push that acts [N], and how long it still does [s]."""

    come: float
    force: float
    left: float


NOT_PUSHED = Pushed(0.0, 0.0, 0.0)
"""At the start."""


def footing(way: Way, x: float) -> Footing:
    """The ground under a place x [m]: h = h_0 + s (x - x_0) on its piece, whose slope is s = tan(angle)."""
    # Chosen number by number, not piece by piece: compiled code and C know choices of numbers alone.
    found = way.pieces[0]
    for piece in way.pieces[1:]:
        begun = x >= piece.start
        found = Piece(
            start=piece.start if begun else found.start,
            height=piece.height if begun else found.height,
            slope=piece.slope if begun else found.slope,
            cosine=piece.cosine if begun else found.cosine,
        )
    return Footing(found.height + found.slope * (x - found.start), found.slope * found.cosine, found.cosine)


def next_push(way: Way, pushed: Pushed, x: float, step: float) -> Pushed:
    """The push after a step [s] that leads the hip to x [m]: one begins as the hip first comes to its place."""
    force, left = pushed.force, max(pushed.left - step, 0.0)
    for push in way.pushes:
        # By the farthest place so far, so that a hip that swings back and forth over it is pushed once.
        begins = pushed.come < push.place and push.place <= x
        force = push.force if begins else force
        left = push.duration if begins else left
    return Pushed(max(pushed.come, x), force, left)


def push_now(pushed: Pushed, step: float) -> float:
    """Force [N] on the trunk, mean over a step [s]: its impulse is force times duration, to rounding."""
    return pushed.force * min(pushed.left, step) / max(step, 1.0e-30)
