"""The neuromuscular gait model against an independent simulator, in which MuJoCo moves the segments.

First each part at random states: accelerations, torques of the muscles, velocities of fibres, stimulation, ground; then
energy and momentum of the body in the air by MuJoCo, step by step of the package; then walks.
"""

import ast
import math
import re
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from ppafo.wearer.loading import find_wearer, wearer_of, with_strengths
from ppafo.wearer.model.ground import Point, contact
from ppafo.wearer.model.muscle import Fibre, next_fibre
from ppafo.wearer.model.reflexes import Balance, Felt, Gait, stimulation
from ppafo.wearer.model.segments import Damping, Limb, Pose, accelerations, circle, freed, leg_matrix
from ppafo.wearer.model.walker import Assist, Fibres, Joints, Walker, Wearer, next_walker, pull
from ppafo.wearer.model.way import LEVEL, Piece, Way, footing
from ppafo.wearer.published import first_answer, start_of
from tests.reference import wearer as reference
from tests.reference.wearer_comparison import STEPS, Columns, by_package, by_reference, gap, strides_of

pytestmark = pytest.mark.long

PAGE = Path(__file__).parents[2] / "docs" / "evidence.md"
WEARER = wearer_of(find_wearer("healthy-128"))
ROUNDING = 1e-6
"""Torque [N m] that antagonists of up to 10 kN m each, who cancel, leave of their rounding."""

FEELINGS = (
    "soleus",
    "gastrocnemius",
    "soleus_stretch",
    "gastrocnemius_stretch",
    "tibialis",
    "vastus",
    "knee",
    "knee_rate",
    "hamstring",
    "gluteus",
    "hamstring_length",
    "flexor_length",
    "load",
)
"""Feelings in the reference's order."""


def to_joints(pose: Pose, offset: float) -> np.ndarray:
    """Coordinates of MuJoCo at a pose; of rates and accelerations without the ``offset`` of angles, 0 or 1."""
    half, quarter = offset * math.pi, offset * math.pi / 2.0
    legs = [
        (half - leg.thigh - pose.lean, half + leg.shank - leg.thigh, quarter + leg.shank - leg.foot)
        for leg in (pose.left, pose.right)
    ]
    return np.array([pose.x, pose.y, pose.lean, *legs[0], *legs[1]])


def drawn_pose(draw: np.random.Generator, size: float) -> Pose:
    numbers = draw.uniform(-size, size, 9).tolist()
    return Pose(*numbers[:3], Limb(*numbers[3:6]), Limb(*numbers[6:9]))


def body_of_reference(wearer: Wearer, device: reference.Device = reference.NONE) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(reference.body_file(wearer.body, device))
    return model, mujoco.MjData(model)


def test_mujoco_accelerates_the_body_as_the_package_does() -> None:
    wearer, device = WEARER, reference.Device(inertia=0.0084)
    model, data = body_of_reference(wearer, device)
    draw = np.random.default_rng(1)
    for _ in range(100):
        pose, rates = drawn_pose(draw, 1.2), drawn_pose(draw, 6.0)
        torques, points = draw.uniform(-200.0, 200.0, (2, 3)), draw.uniform(-2000.0, 2000.0, (2, 2, 2))
        data.qpos[:], data.qvel[:] = to_joints(pose, 1.0), to_joints(rates, 0.0)
        data.qfrc_applied[:] = [0.0, 0.0, 0.0, *torques[0], *torques[1]]
        mujoco.mj_fwdPosition(model, data)
        push, trunk = float(draw.uniform(-300.0, 300.0)), model.body("trunk").id
        mujoco.mj_applyFT(
            model, data, np.array([push, 0.0, 0.0]), np.zeros(3), data.xipos[trunk], trunk, data.qfrc_applied
        )
        for site in range(4):
            body, force = (
                model.site_bodyid[site],
                np.array([points[site // 2, site % 2, 0], 0.0, points[site // 2, site % 2, 1]]),
            )
            mujoco.mj_applyFT(model, data, force, np.zeros(3), data.site_xpos[site], body, data.qfrc_applied)
        mujoco.mj_forward(model, data)
        legs = []
        for number, (limb, rate, inertia) in enumerate(
            ((pose.left, rates.left, device.inertia), (pose.right, rates.right, 0.0))
        ):
            hip, knee, ankle = torques[number].tolist()
            none = Damping(*(0.0,) * 10, inertia)
            given = Limb(-knee - hip, ankle + knee, -ankle)
            forces = points[number].ravel().tolist()
            legs.append(freed(leg_matrix(wearer.body, circle(limb), rate, given, *forces, none, 0.0)))
        found = accelerations(wearer.body, pose.lean, rates.lean, -float(torques[:, 0].sum()), push, *legs)
        expected = np.array(data.qacc)
        assert to_joints(found, 0.0) == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def drawn_leg(draw: np.random.Generator) -> tuple[Joints, Joints, Fibres]:
    """Angles, rates and fibres of a leg, from slack to far above the largest forces."""
    angles = Joints(*np.radians(draw.uniform([60.0, 90.0, 120.0], [140.0, 185.0, 240.0])).tolist())
    own: list[Fibre] = []
    for name in reference.MUSCLES:
        muscle = getattr(WEARER.left, name)
        own.append(Fibre(float(draw.uniform(0.01, 1.0)), muscle.optimum * float(draw.uniform(0.35, 1.5)), 0.0))
    rates = Joints(*draw.uniform(-8.0, 8.0, 3).tolist())
    return angles, rates, Fibres._make(own)


def test_muscles_pull_and_move_as_those_of_the_reference() -> None:
    free = WEARER._replace(stop=WEARER.stop._replace(stiffness=0.0))
    numbers, draw = reference.numbers_of(free), np.random.default_rng(2)
    for _ in range(200):
        angles, rates, fibres = drawn_leg(draw)
        pulled = pull(WEARER.left, fibres, angles, rates, 0.0)
        q, v = np.zeros(9), np.zeros(9)
        q[3:6] = q[6:9] = [angles.hip, angles.knee, angles.ankle]
        v[3:6] = v[6:9] = [rates.hip, rates.knee, rates.ankle]
        activation, length = (
            np.array([[getattr(item, name) for item in fibres]] * 2) for name in ("activation", "length")
        )
        torque, speeds, felt = np.zeros(6), np.zeros((2, 7)), np.zeros(28)
        reference.forces_on_legs(numbers, q, v, activation, length, torque, speeds, felt)
        assert torque == pytest.approx([pulled.hip, pulled.knee, pulled.ankle] * 2, abs=ROUNDING)
        moved = [
            next_fibre(getattr(WEARER.left, name), getattr(fibres, name), 0.5, getattr(pulled, name), 0.0).velocity
            for name in reference.MUSCLES
        ]
        assert speeds == pytest.approx(np.array([moved, moved]), rel=1e-8, abs=1e-12)
        known = [getattr(pulled.felt, name) for name in FEELINGS]
        assert np.delete(felt[:13], [reference.V_SOL, reference.V_GAS, reference.LOAD]) == pytest.approx(
            np.delete(known, [reference.V_SOL, reference.V_GAS, reference.LOAD]), rel=1e-10, abs=1e-12
        )


def test_reflexes_answer_as_those_of_the_reference() -> None:
    draw, drawn = np.random.default_rng(3), set()
    for _ in range(500):
        gains = WEARER.left_gains._make(draw.uniform(0.0, 3.0, 27).tolist())
        numbers = reference.numbers_of(WEARER._replace(left_gains=gains, right_gains=gains))
        felt = draw.uniform(-0.5, 1.5, 26)
        felt[reference.PHI_K], felt[13 + reference.PHI_K] = draw.uniform(0.0, 3.2, 2)
        stands, rear = float(draw.integers(2)), float(draw.integers(2))
        lean, rate, left_at = draw.uniform(-1.0, 1.0, 3).tolist()
        own, other = (Felt(**dict(zip(FEELINGS, felt[a : a + 13].tolist(), strict=True))) for a in (0, 13))
        order = stimulation(gains, own, Balance(lean, rate), Gait(stands, 0.1, left_at), other.load, rear)
        given = np.zeros(7)
        stance = np.array([[stands, 0.1, left_at], [1.0, 0.0, 0.0]])
        reference.stimulate(numbers, felt, lean, rate, stance, 0, rear > 0.5, given)
        assert given == pytest.approx([getattr(order, name) for name in reference.MUSCLES], rel=1e-12)
        drawn |= {(stands, muscle) for muscle in np.flatnonzero((given > 0.01) & (given < 1.0)).tolist()}
    assert len(drawn) == 14, "every muscle is answered between its limits, in stance and in swing"


def way_with_slope(slope: float) -> Way:
    """Ground that rises through the origin."""
    first = Piece(-10.0, -10.0 * slope, slope, 1.0 / math.hypot(1.0, slope))
    return LEVEL._replace(pieces=(first, *LEVEL.pieces[1:]))


def test_the_ground_pushes_as_that_of_the_reference() -> None:
    draw, ground = np.random.default_rng(4), reference.numbers_of(WEARER).ground
    seen = set()
    for _ in range(300):
        state, point = np.zeros(2), Point(0.0, 0.0, 0.0, 0.0)
        # The reference has level ground; a slope is its coordinates turned.
        angle = float(draw.uniform(-0.2, 0.2))
        sine, cosine = math.sin(angle), math.cos(angle)
        x, speed = 0.0, float(draw.normal() * 10.0 ** draw.uniform(-3.0, 0.0))
        for _ in range(20):
            z, rise = float(draw.uniform(-0.02, 0.002)), float(draw.normal() * 0.02)
            speed += float(draw.normal() * 0.01)
            x += 0.01 * speed
            under = footing(way_with_slope(math.tan(angle)), cosine * x - sine * z)
            on_foot = contact(
                WEARER.ground,
                under,
                point,
                cosine * x - sine * z,
                sine * x + cosine * z,
                cosine * speed - sine * rise,
                sine * speed + cosine * rise,
                0.0,
            )
            along, up = reference.ground_force(ground, state, x, z, speed, rise, True)
            # A point that comes to rest sticks at once in the reference, and from the next step on in the package.
            rests = point.touches > 0.5 and point.sticks < 0.5 and abs(speed) < WEARER.ground.rest_speed
            pressed = cosine * on_foot.force_y - sine * on_foot.force_x
            assert pressed == pytest.approx(on_foot.normal, rel=1e-9, abs=1e-9)
            assert up == pytest.approx(on_foot.normal, rel=1e-9, abs=1e-9)
            held = cosine * on_foot.force_x + sine * on_foot.force_y
            assert rests or along == pytest.approx(held, rel=1e-9, abs=1e-6)
            seen.add(float(state[0]))
            point = on_foot.after
    assert seen == {reference.AIR, reference.STICKS, reference.SLIDES}


def flying(height: float) -> tuple[Wearer, Walker]:
    """A wearer without muscles and ends of joints, high above the ground, who tumbles."""
    names = dict.fromkeys(reference.MUSCLES, 0.0)
    wearer = WEARER._replace(
        left=with_strengths(WEARER.left, names),
        right=with_strengths(WEARER.right, names),
        stop=WEARER.stop._replace(stiffness=0.0),
    )
    walker = start_of(wearer, 1.3)
    rates = Pose(1.3, 2.0, 1.0, Limb(3.0, -2.0, 4.0), Limb(-2.0, 1.0, -3.0))
    return wearer, walker._replace(pose=walker.pose._replace(y=height), rates=rates, halfway=rates)


def drift(step: float, seconds: float) -> tuple[float, np.ndarray]:
    """Change of energy [J], and of momentum but for gravity [kg m/s, kg m/s, kg m^2/s], in the air by MuJoCo."""
    wearer, walker = flying(100.0)
    model, data = body_of_reference(wearer)
    weight = float(model.body_subtreemass[1]) * wearer.body.gravity
    ordered, free = first_answer(), Assist(0.0, 0.0, 0.0)
    energies, momenta = [], []
    for number in range(round(seconds / step) + 1):
        if number % round(0.01 / step) == 0:
            data.qpos[:], data.qvel[:] = to_joints(walker.pose, 1.0), to_joints(walker.rates, 0.0)
            mujoco.mj_forward(model, data)
            mujoco.mj_subtreeVel(model, data)
            energies.append(float(data.energy.sum()))
            linear = data.subtree_linvel[1] * model.body_subtreemass[1]
            momenta.append([linear[0], linear[2] + weight * number * step, data.subtree_angmom[1][1]])
        walker = next_walker(wearer, walker, ordered.to_left, ordered.to_right, free, free, 0.0, step).after
    return float(np.ptp(energies)), np.ptp(momenta, axis=0)


def test_in_the_air_energy_stays_and_gravity_alone_changes_momentum_to_second_order() -> None:
    """The step is a leap of the rates from the middle of one step to the next: half of it leaves a quarter."""
    (energy, momentum), (half_energy, half_momentum) = drift(4e-4, 1.0), drift(2e-4, 1.0)
    assert energy == pytest.approx(4.0 * half_energy, rel=0.05)
    assert momentum == pytest.approx(4.0 * half_momentum, rel=0.05, abs=1e-9)
    assert half_energy < 1e-5
    assert (half_momentum < 1e-5).all()


@pytest.fixture(scope="module")
def judged() -> Columns:
    """The first step of the reference."""
    return by_reference("healthy-128", seconds=0.32)


def test_the_first_step_comes_to_that_of_the_reference_as_the_step_shortens(judged: Columns) -> None:
    """A quarter of the step leaves less than a tenth of the error; the load is that at the begin of a step."""
    far, _, near = (by_package("healthy-128", step, seconds=5.5) for step in STEPS)
    coarse, fine = gap(far, judged, 0.3), gap(near, judged, 0.3)
    assert coarse.hip > 10.0 * fine.hip
    assert coarse.joints > 10.0 * fine.joints
    assert coarse.activation > 10.0 * fine.activation
    assert coarse.load > 4.0 * fine.load
    first = gap(far, judged, 0.1)
    assert first.hip < 0.005
    assert first.joints < 0.005
    assert first.load < 0.01
    assert first.activation < 2e-4


def test_the_reference_would_see_a_muscle_or_a_gain_that_is_wrong_by_two_in_a_thousand(judged: Columns) -> None:
    flaws = ("wearer.soleus_strength=0.998", "wearer.vastus_strength=0.998", "wearer.left_soleus_force=1.1611")
    sound, *wrong = (
        gap(by_package("healthy-128", 0.0125, 5.5, changes), judged, 0.3).hip
        for changes in ((), *((flaw,) for flaw in flaws))
    )
    assert min(wrong) > 1.7 * sound


def test_the_reference_has_nothing_of_the_package_but_the_numbers_of_wearers() -> None:
    tree = ast.parse(Path(reference.__file__).read_text(encoding="utf-8"))
    taken = [item.module for item in ast.walk(tree) if isinstance(item, ast.ImportFrom)]
    taken += [name.name for item in ast.walk(tree) if isinstance(item, ast.Import) for name in item.names]
    assert {name for name in taken if name and name.startswith("ppafo")} == {"ppafo.wearer.loading"}


@pytest.mark.thorough
def test_ten_strides_are_as_long_and_as_quick_as_those_of_the_reference() -> None:
    """At the package's own step, means are within half a percent."""
    expected = strides_of(by_reference("healthy-128", 80, 11.6))
    walked = strides_of(by_package("healthy-128", STEPS[0], 11.6))
    assert walked.strikes[:2] == pytest.approx(expected.strikes[:2], abs=0.01)
    assert walked.lengths == pytest.approx(expected.lengths, rel=0.03)
    assert walked[2:] == pytest.approx(expected[2:], rel=0.005)
    rows = re.findall(r"\| mean from stride 3 on, .*? \| ([\d.]+) \| ([\d.]+) \|", PAGE.read_text(encoding="utf-8"))
    by_page = np.array(rows[:4], dtype=float)
    assert expected[2:] == pytest.approx(by_page[:, 0], rel=1e-3)
    assert walked[2:] == pytest.approx(by_page[:, 1], rel=1e-3)
