"""The body without muscles: energy and momentum by code of its own, and the equations of motion against Lagrange's."""

import numpy as np
import pytest

from ppafo.wearer.model.segments import (
    Body,
    Damping,
    Limb,
    Pose,
    Segment,
    accelerations,
    circle,
    freed,
    leg_matrix,
)

BODY = Body(
    trunk=Segment(length=0.8, mass_centre=0.35, mass=53.5, inertia=3.0),
    thigh=Segment(length=0.5, mass_centre=0.2, mass=8.5, inertia=0.15),
    shank=Segment(length=0.5, mass_centre=0.2, mass=3.5, inertia=0.05),
    foot=Segment(length=0.16, mass_centre=0.02, mass=1.25, inertia=0.005),
    heel=0.04,
    gravity=9.81,
)
NONE = Damping(*(0.0,) * 11)


def pose_of(numbers: np.ndarray) -> Pose:
    x, y, lean, *angles = map(float, numbers)
    return Pose(x, y, lean, Limb(*angles[:3]), Limb(*angles[3:]))


def numbers_of(pose: Pose) -> np.ndarray:
    return np.array([pose.x, pose.y, pose.lean, *pose.left, *pose.right])


def moved(
    body: Body, q: np.ndarray, v: np.ndarray, damping: Damping = NONE, lag: float = 0.0, push: float = 0.0
) -> np.ndarray:
    pose, rates = pose_of(q), pose_of(v)
    no = Limb(0.0, 0.0, 0.0)
    legs = [
        freed(leg_matrix(body, circle(limb), rate, no, 0.0, 0.0, 0.0, 0.0, damping, lag))
        for limb, rate in ((pose.left, rates.left), (pose.right, rates.right))
    ]
    return numbers_of(accelerations(body, pose.lean, rates.lean, 0.0, push, *legs))


def masses(body: Body, q: np.ndarray) -> list[tuple[float, float, np.ndarray, float]]:
    """Mass, inertia, place of the mass centre and angle that grows anticlockwise, of all segments."""
    hip = q[:2]
    every = [
        (
            body.trunk.mass,
            body.trunk.inertia,
            hip + body.trunk.mass_centre * np.array([np.sin(q[2]), np.cos(q[2])]),
            -q[2],
        )
    ]
    for leg in (q[3:6], q[6:9]):
        joint = hip
        for segment, angle in zip((body.thigh, body.shank), leg[:2], strict=True):
            down = np.array([np.sin(angle), -np.cos(angle)])
            every.append((segment.mass, segment.inertia, joint + segment.mass_centre * down, angle))
            joint = joint + segment.length * down
        forward = np.array([np.cos(leg[2]), np.sin(leg[2])])
        every.append((body.foot.mass, body.foot.inertia, joint + body.foot.mass_centre * forward, leg[2]))
    return every


def motion(body: Body, q: np.ndarray, v: np.ndarray) -> tuple[float, np.ndarray]:
    """Energy [J] and momentum, linear [kg m/s] and angular about the origin [kg m^2/s], by central differences."""
    small = 1e-6
    ahead, behind, now = masses(body, q + small * v), masses(body, q - small * v), masses(body, q)
    energy, momentum = 0.0, np.zeros(3)
    for (mass, inertia, place, _), (*_, after, turned), (*_, before, angle) in zip(now, ahead, behind, strict=True):
        speed, rate = (after - before) / (2 * small), (turned - angle) / (2 * small)
        energy += 0.5 * mass * speed @ speed + 0.5 * inertia * rate**2 + mass * body.gravity * place[1]
        cross = place[0] * speed[1] - place[1] * speed[0]
        momentum += [mass * speed[0], mass * speed[1], mass * cross + inertia * rate]
    return float(energy), momentum


def drawn(seed: int) -> tuple[np.ndarray, np.ndarray]:
    draw = np.random.default_rng(seed)
    return draw.uniform(-0.8, 0.8, 9), draw.uniform(-4.0, 4.0, 9)


@pytest.mark.parametrize("seed", range(5))
def test_no_energy_is_made_or_lost_in_the_air(seed: int) -> None:
    q, v = drawn(seed)
    a = moved(BODY, q, v)
    small = 1e-4
    ahead, _ = motion(BODY, q + small * v + 0.5 * small**2 * a, v + small * a)
    behind, _ = motion(BODY, q - small * v + 0.5 * small**2 * a, v - small * a)
    power = np.abs(v) @ np.abs(a)
    assert abs(ahead - behind) / (2 * small) < 1e-5 * power


@pytest.mark.parametrize("seed", range(5))
def test_gravity_alone_changes_momentum_in_the_air(seed: int) -> None:
    q, v = drawn(seed)
    a = moved(BODY, q, v)
    small = 1e-4
    _, ahead = motion(BODY, q + small * v + 0.5 * small**2 * a, v + small * a)
    _, behind = motion(BODY, q - small * v + 0.5 * small**2 * a, v - small * a)
    mass = BODY.trunk.mass + 2 * (BODY.thigh.mass + BODY.shank.mass + BODY.foot.mass)
    centre = sum(mass * place[0] for mass, _, place, _ in masses(BODY, q))
    expected = [0.0, -mass * BODY.gravity, -centre * BODY.gravity]
    assert (ahead - behind) / (2 * small) == pytest.approx(expected, abs=1e-3 * mass * BODY.gravity)


def test_a_push_changes_momentum_as_a_force_on_the_middle_of_the_trunk_does() -> None:
    q, v = drawn(3)
    force, small = 800.0, 1e-4
    added = np.zeros(3)
    for push, sign in ((force, 1.0), (0.0, -1.0)):
        a = moved(BODY, q, v, push=push)
        _, ahead = motion(BODY, q + small * v + 0.5 * small**2 * a, v + small * a)
        _, behind = motion(BODY, q - small * v + 0.5 * small**2 * a, v - small * a)
        added += sign * (ahead - behind) / (2 * small)
    height = masses(BODY, q)[0][2][1]
    assert added == pytest.approx([force, 0.0, -force * height], abs=1e-4 * force)


def test_damping_at_the_end_of_a_step_is_that_of_the_rates_there() -> None:
    """A step with damping D of the ball equals M (v' - v) = h (Q - J' D J v') solved with all matrices written out."""
    q, v = drawn(7)
    damping, step = Damping(300.0, -700.0, 200.0, 2000.0, 500.0, 900.0, 0.0, 4000.0, 3.0, 5.0, 0.02), 1e-4
    # Columns of M by unit accelerations are not at hand: they come from the kinetic energy, E = v' M v / 2.
    still = BODY._replace(gravity=0.0)
    unit = np.eye(9)
    kinetic = [[motion(still, q, unit[i] + unit[j])[0] for j in range(9)] for i in range(9)]
    single = [motion(still, q, unit[i])[0] for i in range(9)]
    matrix = np.array([[kinetic[i][j] - single[i] - single[j] for j in range(9)] for i in range(9)])
    free = matrix @ moved(BODY, q, v)
    added = np.zeros((9, 9))
    for first in (3, 6):
        for behind, xx, xy, yx, yy in (
            (-BODY.heel, 300.0, -700.0, 200.0, 2000.0),
            (BODY.foot.length, 500.0, 900.0, 0.0, 4000.0),
        ):
            thigh, shank, foot = q[first : first + 3]
            row_x, row_y = np.zeros(9), np.zeros(9)
            row_x[0] = row_y[1] = 1.0
            row_x[first : first + 3] = [0.5 * np.cos(thigh), 0.5 * np.cos(shank), -behind * np.sin(foot)]
            row_y[first : first + 3] = [0.5 * np.sin(thigh), 0.5 * np.sin(shank), behind * np.cos(foot)]
            added += xx * np.outer(row_x, row_x) + yy * np.outer(row_y, row_y)
            added += xy * np.outer(row_x, row_y) + yx * np.outer(row_y, row_x)
        ankle, knee = np.zeros(9), np.zeros(9)
        ankle[first + 1 : first + 3] = [1.0, -1.0]
        knee[first : first + 2] = [-1.0, 1.0]
        added += 3.0 * np.outer(ankle, ankle) + 5.0 * np.outer(knee, knee)
        matrix += 0.02 * np.outer(ankle, ankle)
    assert moved(BODY, q, v, damping, step) == pytest.approx(np.linalg.solve(matrix + step * added, free), rel=1e-5)
