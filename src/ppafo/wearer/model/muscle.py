"""A Hill muscle with its tendon: forces, and how its contractile element moves; and how muscles pull on joints.

Forces are in units of the muscle's largest, lengths in metres. H. Geyer, A. Seyfarth and R. Blickhan, Proc. R. Soc. B
270 (2003) 2173; H. Geyer and H. Herr, IEEE Trans. Neural Syst. Rehabil. Eng. 18 (2010) 263.
"""

from typing import NamedTuple

from ppafo.model.elementary import TURNS_OF_RADIAN, sine_and_cosine_of_turns

WIDTH = 0.56
"""Half width of the bell of force over length, in optimum lengths."""

AT_WIDTH = -2.995732273553991
"""Logarithm of the force that is left there, 5 %."""

TENDON_STRAIN = 0.04
"""Strain of the tendon at the largest isometric force."""

LARGEST_ECCENTRIC, CURVATURE = 1.5, 5.0
"""Force of a muscle that is drawn out fast, N, and shape of force over velocity, K."""

ECCENTRIC_SHAPE = 7.56
"""Ratio of curvatures of the eccentric branch to the concentric one."""

EXCITATION_TIME = 0.01
"""Time constant [s] from stimulation to activation."""

HALVINGS = 6
TERMS = 9


class Muscle(NamedTuple):
    """Largest isometric force [N], optimum length [m], largest velocity [optimum lengths/s], slack tendon [m].

    ``slow`` is the share of slow fibres [-], on which only the metabolic rate depends.
    """

    force: float
    optimum: float
    velocity: float
    slack: float
    slow: float


class Fibre(NamedTuple):
    """State of a muscle: activation [-], length of the contractile element [m], its velocity [m/s] in the last step."""

    activation: float
    length: float
    velocity: float


class Lever(NamedTuple):
    """How a muscle passes a joint: lever [m], angles where it is largest and where the muscle is at rest [rad], share.

    The share [-] is how much of its way the fibres take, which are pennate.
    """

    lever: float
    largest_at: float
    rest_at: float
    share: float


def bell(length: float) -> float:
    """Isometric force [-] at a length [optimum lengths], exp(ln(0.05) |(l - 1) / w|^3)."""
    away = abs(length - 1.0) / WIDTH
    # No library's exp: its last bits differ between processors. A Taylor polynomial of a 64th part, squared six times
    # (``HALVINGS``), has the same bits everywhere; below e^-60 the force is nothing, and the polynomial would be off.
    small = max(AT_WIDTH * away * away * away, -60.0) / 64.0
    series = 0.0
    for term in range(TERMS):
        series = (series + 1.0) * small / float(TERMS - term)
    value = 1.0 + series
    for _ in range(HALVINGS):
        value = value * value
    return value


def tendon_force(muscle: Muscle, length: float) -> float:
    """Force of the tendon [largest forces], none while it is slack; its length [m]."""
    # Quadratic, as published: at the strain of 4 % the tendon bears the largest force.
    strain = max(length / muscle.slack - 1.0, 0.0) / TENDON_STRAIN
    return strain * strain


def lengthening(force: float) -> float:
    """Velocity [largest velocities], above 0 while it lengthens, at which a muscle bears a force [isometric forces]."""
    shortening = (force - 1.0) / (1.0 + CURVATURE * force)
    excess = (force - LARGEST_ECCENTRIC) / (LARGEST_ECCENTRIC - 1.0)
    drawn = (1.0 + excess) / (1.0 - ECCENTRIC_SHAPE * CURVATURE * min(excess, 0.0))
    # The published curve ends at 1.5 N, at the largest velocity: beyond, it goes on with a small slope.
    drawn = drawn if excess < 0.0 else 1.0 + 0.01 * (force - LARGEST_ECCENTRIC)
    return shortening if force < 1.0 else drawn


def force_at(velocity: float) -> float:
    """Force [isometric forces] that a muscle bears at a velocity [largest velocities], the other way round."""
    shortens, lengthens = max(min(velocity, 0.0), -1.0), max(velocity, 0.0)
    shape = ECCENTRIC_SHAPE * CURVATURE
    drawn = LARGEST_ECCENTRIC - (LARGEST_ECCENTRIC - 1.0) * max(1.0 - lengthens, 0.0) / (1.0 + shape * lengthens)
    return (1.0 + shortens) / (1.0 - CURVATURE * shortens) if velocity < 0.0 else drawn


def slope_of_lengthening(force: float) -> float:
    """Slope of ``lengthening`` over the force [-]."""
    below = 1.0 + CURVATURE * force
    shape = ECCENTRIC_SHAPE * CURVATURE
    excess = min((force - LARGEST_ECCENTRIC) / (LARGEST_ECCENTRIC - 1.0), 0.0)
    above = 1.0 - shape * excess
    drawn = (1.0 + shape) / (above * above) / (LARGEST_ECCENTRIC - 1.0) if excess < 0.0 else 0.01
    return (1.0 + CURVATURE) / (below * below) if force < 1.0 else drawn


def next_fibre(muscle: Muscle, fibre: Fibre, stimulation: float, whole: float, step: float) -> Fibre:
    """The muscle after a step [s] at a stimulation [-], 0.01 to 1, and the length of muscle and tendon [m] halfway.

    f_v = (F_SE + F_BE) / (A f_l + F_PE). Both numbers move by the linearised rule of the middle: it bears how stiff a
    tendon is, and its error goes with the square of the step. Implicit Euler is out by 2 % in speed at 0.1 ms.
    """
    relative = fibre.length / muscle.optimum
    strain = max((whole - fibre.length) / muscle.slack - 1.0, 0.0) / TENDON_STRAIN
    stretched = max(relative - 1.0, 0.0) / WIDTH
    pressed = max(1.0 - WIDTH - relative, 0.0) / (0.5 * WIDTH)
    # First order, by the rule of the middle: half of the step counts with the new activation.
    activation = fibre.activation + (stimulation - fibre.activation) * step / (EXCITATION_TIME + 0.5 * step)
    isometric = 0.5 * (fibre.activation + activation) * bell(relative) + stretched * stretched
    # Force balance of tendon, buffer and active element, over the force that the element has standing still.
    borne = (strain * strain + pressed * pressed) / isometric
    speed = muscle.velocity * muscle.optimum
    # How the force that is borne falls with the length of the element: tendon and buffer; the bell is slow beside them.
    stiffness = 2.0 * strain / (TENDON_STRAIN * muscle.slack) + 2.0 * pressed / (0.5 * WIDTH * muscle.optimum)
    stiffness += borne * 2.0 * stretched / (WIDTH * muscle.optimum)
    slope = speed * slope_of_lengthening(borne) * stiffness / isometric
    velocity = speed * lengthening(borne) / (1.0 + 0.5 * step * slope)
    return Fibre(activation=activation, length=fibre.length + step * velocity, velocity=velocity)


def arm_and_way(lever: Lever, angle: float) -> tuple[float, float]:
    """Moment arm [m] at a joint angle [rad], and how far the fibres have moved from rest [m] as that angle grew."""
    sine, cosine = sine_and_cosine_of_turns((angle - lever.largest_at) * TURNS_OF_RADIAN)
    rest, _ = sine_and_cosine_of_turns((lever.rest_at - lever.largest_at) * TURNS_OF_RADIAN)
    return lever.lever * cosine, lever.share * lever.lever * (sine - rest)
