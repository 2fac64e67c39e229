"""An independent simulator of the neuromuscular gait model: MuJoCo moves the segments, the forces are written here.

It reads the numbers of a wearer (``Wearer``: lengths, masses, muscles, gains) and knows no step, no matrix and no
program of the package. Muscles, reflexes and ground follow H. Geyer and H. Herr, IEEE Trans. Neural Syst. Rehabil. Eng.
18 (2010) 263, and H. Geyer, A. Seyfarth and R. Blickhan, Proc. R. Soc. B 270 (2003) 2173. Coordinates are the joints'
angles, not those of the segments; nothing is implicit: the classical method of Runge and Kutta with a step of 10 us,
which follows the damping of the ground. MuJoCo is given no contact, no limit and no actuator.

Sense of all angles as in the package's recording: ankle grows in plantarflexion, knee and hip in extension [rad].
"""

import ctypes
import math
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numba import njit
from numpy.typing import NDArray

from ppafo.wearer.loading import find_wearer, wearer_of

Floats = NDArray[np.float64]

MUSCLES = ("soleus", "tibialis", "gastrocnemius", "vastus", "hamstring", "gluteus", "flexor")
SOL, TIB, GAS, VAS, HAM, GLU, FLX = range(7)
HIP, KNEE, ANKLE = range(3)
ROUTES = (
    (SOL, ANKLE, 1.0, "soleus_ankle"),
    (TIB, ANKLE, -1.0, "tibialis_ankle"),
    (GAS, ANKLE, 1.0, "gastrocnemius_ankle"),
    (GAS, KNEE, -1.0, "gastrocnemius_knee"),
    (VAS, KNEE, 1.0, "vastus_knee"),
    (HAM, KNEE, -1.0, "hamstring_knee"),
    (HAM, HIP, 1.0, "hamstring_hip"),
    (GLU, HIP, 1.0, "gluteus_hip"),
    (FLX, HIP, -1.0, "flexor_hip"),
)
"""Muscle, joint, 1 where its pull makes the angle grow, and the name of its lever in a wearer."""

GAINS = (
    "soleus_force",
    "gastrocnemius_force",
    "soleus_stretch",
    "gastrocnemius_stretch",
    "tibialis_length",
    "tibialis_rest",
    "soleus_on_tibialis",
    "vastus_force",
    "knee_stop",
    "knee_stop_angle",
    "load_on_vastus",
    "load_on_hip",
    "lean",
    "lean_rate",
    "lean_reference",
    "gluteus_share",
    "double_support",
    "hamstring_force",
    "gluteus_force",
    "flexor_length",
    "flexor_rest",
    "hamstring_on_flexor",
    "hamstring_rest",
    "lean_at_leaving",
    "tone",
    "tone_of_vastus",
    "tone_of_hip",
)
"""Gains in the order of ``stimulate``."""

AIR, STICKS, SLIDES = 0.0, 1.0, 2.0
MOVES = 9
"""Coordinates: hip along and up, lean of the trunk, then hip, knee and ankle of the left and of the right leg."""
SAMPLE, LATE, MIDDLE, EARLY = 1.0e-3, 20, 10, 5
"""Time [s] between samples of the reflexes, and delays in samples: 20, 10 and 5 ms of ankle, knee and hip."""
(
    F_SOL,
    F_GAS,
    V_SOL,
    V_GAS,
    L_TIB,
    F_VAS,
    PHI_K,
    DPHI_K,
    F_HAM,
    F_GLU,
    L_HAM,
    L_FLX,
    LOAD,
) = range(13)
FELT_AS_FORCE = np.array([F_SOL, -1, F_GAS, F_VAS, F_HAM, F_GLU, -1])
FELT_AS_LENGTH = np.array([-1, L_TIB, -1, -1, L_HAM, -1, L_FLX])
FELT_AS_STRETCH = np.array([V_SOL, -1, V_GAS, -1, -1, -1, -1])
"""Where each muscle is felt by force, length and stretch; -1 where it is not."""
DELAYS = np.array([LATE] * 5 + [MIDDLE] * 3 + [EARLY] * 5)
LEAN, LEAN_RATE = 26, 27
COLUMNS = (
    "time",
    "hip_position",
    "hip_height",
    "trunk_lean",
    "hip_angle",
    "knee_angle",
    "angle",
    "other_hip_angle",
    "other_knee_angle",
    "other_ankle_angle",
    "ground_force",
    "other_ground_force",
    *(f"{name}_activation" for name in MUSCLES),
    *(f"other_{name}_activation" for name in MUSCLES),
)
"""What is kept of each sample, by the names of the package's recording, SI units."""


class Numbers(NamedTuple):
    """A wearer as arrays: muscles (2, 7, 4), routes (2, 9, 7), stops, ground, gains (2, 27), and single numbers."""

    muscles: Floats
    routes: Floats
    stops: Floats
    ground: Floats
    gains: Floats
    ankle_stiffness: Floats
    ankle_rest: Floats
    weight: float
    device_damping: float
    device_friction: float
    device_creep: float


class Device(NamedTuple):
    """What a vented device still does to the left ankle.

    Inertia [kg m^2], damping [N m s/rad], friction [N m] and rate below which it grows with the rate [rad/s].
    """

    inertia: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    creep: float = 0.02


NONE = Device()
"""No device."""


class Walked(NamedTuple):
    """Samples of ``COLUMNS`` until the end or a fall, by name, and whether the wearer fell."""

    columns: dict[str, Floats]
    fell: bool


def body_file(body: Any, device: Device = NONE) -> str:
    """Return the body as a model of MuJoCo; angles of joints are those of anatomy."""

    def mass(part: Any, x: float, z: float) -> str:
        turning = f"{part.inertia!r} {part.inertia!r} {part.inertia!r}"
        return f'<inertial pos="{x!r} 0 {z!r}" mass="{part.mass!r}" diaginertia="{turning}"/>'

    def leg(side: str, armature: float) -> str:
        half, quarter = repr(math.pi), repr(math.pi / 2.0)
        thigh, shank = (mass(part, 0.0, -part.mass_centre) for part in (body.thigh, body.shank))
        return f"""
        <body name="{side}_thigh">
          <joint name="{side}_hip" type="hinge" axis="0 1 0" ref="{half}"/>{thigh}
          <body name="{side}_shank" pos="0 0 {-body.thigh.length!r}">
            <joint name="{side}_knee" type="hinge" axis="0 -1 0" ref="{half}"/>{shank}
            <body name="{side}_foot" pos="0 0 {-body.shank.length!r}">
              <joint name="{side}_ankle" type="hinge" axis="0 1 0" ref="{quarter}" armature="{armature!r}"/>
              {mass(body.foot, body.foot.mass_centre, 0.0)}
              <site name="{side}_heel" pos="{-body.heel!r} 0 0"/>
              <site name="{side}_ball" pos="{body.foot.length!r} 0 0"/>
            </body>
          </body>
        </body>"""

    return f"""<mujoco>
  <compiler angle="radian" autolimits="false"/>
  <option gravity="0 0 {-float(body.gravity)!r}">
    <flag contact="disable" constraint="disable" energy="enable"/>
  </option>
  <worldbody><body name="trunk">
    <joint name="along" type="slide" axis="1 0 0"/><joint name="up" type="slide" axis="0 0 1"/>
    <joint name="lean" type="hinge" axis="0 1 0"/>{mass(body.trunk, 0.0, body.trunk.mass_centre)}
    {leg("left", device.inertia)}{leg("right", 0.0)}
  </body></worldbody>
</mujoco>"""


def numbers_of(wearer: Any, device: Device = NONE) -> Numbers:
    """Return the numbers of a wearer as arrays."""
    legs = (wearer.left, wearer.right)
    muscle = [[getattr(leg, name) for name in MUSCLES] for leg in legs]
    stop, ground = wearer.stop, wearer.ground
    return Numbers(
        muscles=np.array([[(m.force, m.optimum, m.velocity * m.optimum, m.slack) for m in leg] for leg in muscle]),
        routes=np.array(
            [
                [
                    (number, joint, sign, way.lever, way.largest_at, way.rest_at, way.share)
                    for number, joint, sign, name in ROUTES
                    for way in (getattr(leg, name),)
                ]
                for leg in legs
            ]
        ),
        stops=np.array([stop.stiffness, stop.relaxing, stop.ankle_low, stop.ankle_high, stop.knee, stop.hip]),
        ground=np.array(
            [
                ground.stiffness,
                ground.stiffness_along,
                ground.relaxing,
                ground.sticking,
                ground.sliding,
                ground.rest_speed,
            ]
        ),
        gains=np.array([[getattr(own, name) for name in GAINS] for own in (wearer.left_gains, wearer.right_gains)]),
        ankle_stiffness=np.array([leg.ankle_stiffness for leg in legs]),
        ankle_rest=np.array([leg.ankle_rest for leg in legs]),
        weight=wearer.weight,
        device_damping=device.damping,
        device_friction=device.friction,
        device_creep=device.creep,
    )


@njit
def stretched_length(muscles: Floats, routes: Floats, angles: Floats, lengths: Floats) -> None:
    """Write the lengths of muscle with tendon [m] of a leg at its angles of hip, knee and ankle [rad]."""
    for m in range(7):
        lengths[m] = muscles[m, 1] + muscles[m, 3]
    for k in range(routes.shape[0]):
        m, joint = int(routes[k, 0]), int(routes[k, 1])
        sign, lever, largest, rest, share = routes[k, 2], routes[k, 3], routes[k, 4], routes[k, 5], routes[k, 6]
        way = angles[joint] - rest if joint == HIP else math.sin(angles[joint] - largest) - math.sin(rest - largest)
        lengths[m] -= sign * share * lever * way


@njit
def velocity_at(ratio: float) -> float:
    """Velocity [largest velocities], above 0 while lengthening, where F_SE + F_BE is ``ratio`` times A f_l + F_PE.

    Inverse of Hill's curve with K = 5 and N = 1.5; beyond N the curve ends, and the velocity grows by a hundredth.
    """
    if ratio < 1.0:
        return (ratio - 1.0) / (1.0 + 5.0 * ratio)
    if ratio < 1.5:
        # N + (N - 1) (1 - v) / (-1 - 7.56 K v) = ratio, solved for v.
        drop = (1.5 - ratio) / 0.5
        return (1.0 - drop) / (1.0 + 7.56 * 5.0 * drop)
    return 1.0 + 0.01 * (ratio - 1.5)


@njit
def end_torque(stiffness: float, relaxing: float, into: float, rate: float) -> float:
    """Torque [N m] of an end pressed by ``into`` [rad], deeper at a rate [rad/s]; it never pulls."""
    if into <= 0.0:
        return 0.0
    return stiffness * into * max(1.0 + rate / relaxing, 0.0)


@njit
def pull_of_muscles(
    muscles: Floats, whole: Floats, activation: Floats, fibre: Floats, pulls: Floats, speeds: Floats, felt: Floats
) -> None:
    """Write forces of the tendons (7,) [N], how fast fibres move (7,) [m/s], and what is felt of them."""
    for m in range(7):
        largest, optimum, fastest, slack = muscles[m, 0], muscles[m, 1], muscles[m, 2], muscles[m, 3]
        relative = fibre[m] / optimum
        tendon = (max(whole[m] - fibre[m] - slack, 0.0) / slack / 0.04) ** 2
        bell = math.exp(math.log(0.05) * abs((relative - 1.0) / 0.56) ** 3)
        parallel = (max(relative - 1.0, 0.0) / 0.56) ** 2
        buffer = (max(1.0 - 0.56 - relative, 0.0) / 0.28) ** 2
        speeds[m] = fastest * velocity_at((tendon + buffer) / (activation[m] * bell + parallel))
        pulls[m] = tendon * largest
        if FELT_AS_FORCE[m] >= 0:
            felt[FELT_AS_FORCE[m]] = tendon
        if FELT_AS_LENGTH[m] >= 0:
            felt[FELT_AS_LENGTH[m]] = relative
        if FELT_AS_STRETCH[m] >= 0:
            felt[FELT_AS_STRETCH[m]] = speeds[m] / optimum


@njit
def resist(n: Numbers, side: int, angles: Floats, rates: Floats, torque: Floats) -> None:
    """Add to the torques of a leg (3,) [N m] those of ends of joints, of a stiff ankle, and of a device."""
    stiffness, relaxing = n.stops[0], n.stops[1]
    torque[ANKLE] += end_torque(stiffness, relaxing, n.stops[2] - angles[ANKLE], -rates[ANKLE])
    torque[ANKLE] -= end_torque(stiffness, relaxing, angles[ANKLE] - n.stops[3], rates[ANKLE])
    torque[KNEE] -= end_torque(stiffness, relaxing, angles[KNEE] - n.stops[4], rates[KNEE])
    torque[HIP] -= end_torque(stiffness, relaxing, angles[HIP] - n.stops[5], rates[HIP])
    torque[ANKLE] -= n.ankle_stiffness[side] * (angles[ANKLE] - n.ankle_rest[side])
    if side == 0:
        rate = rates[ANKLE]
        torque[ANKLE] -= n.device_damping * rate + n.device_friction * min(max(rate / n.device_creep, -1.0), 1.0)


@njit
def forces_on_legs(
    n: Numbers, q: Floats, v: Floats, activation: Floats, fibre: Floats, torque: Floats, speeds: Floats, felt: Floats
) -> None:
    """Write torques on the joints (6,), how fast fibres move (2, 7) [m/s], and what both legs feel (26,)."""
    whole, pulls = np.empty(7), np.empty(7)
    for side in range(2):
        base = 3 + 3 * side
        angles, rates = q[base : base + 3], v[base : base + 3]
        own, feels = torque[3 * side : 3 * side + 3], felt[13 * side : 13 * side + 13]
        stretched_length(n.muscles[side], n.routes[side], angles, whole)
        pull_of_muscles(n.muscles[side], whole, activation[side], fibre[side], pulls, speeds[side], feels)
        feels[PHI_K], feels[DPHI_K] = angles[KNEE], rates[KNEE]
        own[:] = 0.0
        for k in range(n.routes.shape[1]):
            m, joint, arm = int(n.routes[side, k, 0]), int(n.routes[side, k, 1]), n.routes[side, k, 3]
            if joint != HIP:
                arm *= math.cos(angles[joint] - n.routes[side, k, 4])
            own[joint] += n.routes[side, k, 2] * arm * pulls[m]
        resist(n, side, angles, rates, own)


@njit
def ground_force(ground: Floats, state: Floats, x: float, z: float, speed: float, rise: float, switch: bool) -> Any:
    """Forces along and up [N] on a point; with ``switch`` its state, a mode and where it sticks [m], follows first."""
    if switch:
        if z >= 0.0:
            state[0] = AIR
        elif state[0] == AIR or (state[0] == SLIDES and abs(speed) < ground[5]):
            state[0], state[1] = STICKS, x
    if state[0] == AIR or z >= 0.0:
        return 0.0, 0.0
    up = -z * ground[0] * max(1.0 - rise / ground[2], 0.0)
    if state[0] == STICKS:
        away = x - state[1]
        along = -ground[1] * (away + abs(away) * speed / ground[2])
        if abs(along) <= ground[3] * up:
            return along, up
        if switch:
            state[0] = SLIDES
        else:
            return along, up
    return -ground[4] * up * min(max(speed / ground[5], -1.0), 1.0), up


@njit
def stimulate(
    n: Numbers, felt: Floats, lean: float, turning: float, stance: Floats, side: int, rear: bool, to: Floats
) -> None:
    """Write the stimulation of a leg's muscles (7,) from what arrives: both legs (26,), lean [rad] and its rate."""
    own, other = felt[13 * side : 13 * side + 13], felt[13 * (1 - side) : 13 * (1 - side) + 13]
    (
        sol,
        gas,
        sol_stretch,
        gas_stretch,
        tib,
        tib_rest,
        sol_on_tib,
        vas,
        stop,
        stop_angle,
        load_on_vas,
        load_on_hip,
        upright,
        turn,
        reference,
        glu_share,
        double,
        ham,
        glu,
        flx,
        flx_rest,
        ham_on_flx,
        ham_rest,
        leaving,
        tone,
        tone_vas,
        tone_hip,
    ) = n.gains[side]
    to[SOL] = tone + sol_stretch * max(own[V_SOL], 0.0)
    to[GAS] = tone + gas_stretch * max(own[V_GAS], 0.0)
    to[TIB] = tone + tib * (own[L_TIB] - tib_rest)
    if stance[side, 0] > 0.0:
        to[SOL] += sol * own[F_SOL]
        to[GAS] += gas * own[F_GAS]
        to[TIB] -= sol_on_tib * own[F_SOL]
        to[VAS] = tone_vas + vas * own[F_VAS]
        if own[PHI_K] > stop_angle and own[DPHI_K] > 0.0:
            to[VAS] -= stop * (own[PHI_K] - stop_angle)
        forward, rate = upright * (lean - reference), turn * turning
        carried = load_on_hip * own[LOAD]
        to[HAM] = tone_hip + carried * max(forward + rate, 0.0)
        to[GLU] = tone_hip + carried * max(glu_share * forward + rate, 0.0)
        to[FLX] = tone_hip + carried * max(-(forward + rate), 0.0)
        if rear:
            to[VAS] -= load_on_vas * other[LOAD]
            to[GLU] -= double
            to[FLX] += double
    else:
        to[VAS] = tone
        to[HAM] = tone + ham * own[F_HAM]
        to[GLU] = tone + glu * own[F_GLU]
        to[FLX] = tone_hip + flx * (own[L_FLX] - flx_rest) - ham_on_flx * max(own[L_HAM] - ham_rest, 0.0)
        to[FLX] += leaving * (stance[side, 2] - reference)
    for m in range(7):
        to[m] = min(max(to[m], 0.01), 1.0)


@njit
def reflexes(n: Numbers, past: Floats, newest: int, stance: Floats, to: Floats) -> None:
    """Write the stimulation of both legs (2, 7); ``past`` (21, 28) has the samples, ``newest`` the row of now.

    ``stance`` (2, 3) has for each leg whether it stands, time since it touched [s], and the lean when it left.
    """
    felt = np.empty(26)
    for k in range(26):
        felt[k] = past[(newest - DELAYS[k % 13]) % 21, k]
    lean, turning = past[(newest - EARLY) % 21, LEAN], past[(newest - EARLY) % 21, LEAN_RATE]
    for side in range(2):
        stands = felt[13 * side + LOAD] > 0.0
        if stands and stance[side, 0] == 0.0:
            stance[side, 0], stance[side, 1] = 1.0, 0.0
        else:
            stance[side, 1] += SAMPLE
            if not stands and stance[side, 0] == 1.0:
                stance[side, 0], stance[side, 2] = 0.0, lean
    both = stance[0, 0] > 0.0 and stance[1, 0] > 0.0
    for side in range(2):
        rear = both and stance[side, 1] > stance[1 - side, 1]
        stimulate(n, felt, lean, turning, stance, side, rear, to[side])


def _library() -> Any:
    """The library of MuJoCo, whose functions compiled code calls without Python between."""
    folder = Path(mujoco.__file__).parent
    found = sorted([*folder.glob("libmujoco*"), *folder.glob("mujoco.dll")])
    library = ctypes.CDLL(str(found[0]))
    for name in ("mj_fwdPosition", "mj_fwdVelocity", "mj_fwdAcceleration"):
        function = getattr(library, name)
        function.argtypes, function.restype = [ctypes.c_size_t, ctypes.c_size_t], None
    return library


_MUJOCO = _library()
place_segments = _MUJOCO.mj_fwdPosition
move_segments = _MUJOCO.mj_fwdVelocity
accelerate_segments = _MUJOCO.mj_fwdAcceleration


class Handles(NamedTuple):
    """Addresses of model and data of MuJoCo, views of its numbers, and which bodies and sites are the feet."""

    model: int
    data: int
    qpos: Floats
    qvel: Floats
    qacc: Floats
    on_joints: Floats
    on_bodies: Floats
    site: Floats
    centre: Floats
    motion: Floats
    about: Floats
    feet: Any


def handles_of(model: Any, data: Any) -> Handles:
    """Return what compiled code needs of a model and its data."""
    return Handles(
        model=model._address,
        data=data._address,
        qpos=data.qpos,
        qvel=data.qvel,
        qacc=data.qacc_smooth,
        on_joints=data.qfrc_applied,
        on_bodies=data.xfrc_applied,
        site=data.site_xpos,
        centre=data.xipos,
        motion=data.cvel,
        about=data.subtree_com,
        feet=np.array([model.body(name).id for name in ("left_foot", "right_foot")]),
    )


@njit
def derivative(
    n: Numbers, h: Handles, y: Floats, to: Floats, ground: Floats, switch: bool, dy: Floats, out: Any
) -> None:
    """Write how the state (46,) changes, and into ``out`` forces of the ground (2, 2) [N] and what is felt (28,)."""
    forces, felt = out
    for k in range(MOVES):
        h.qpos[k], h.qvel[k] = y[k], y[MOVES + k]
    place_segments(h.model, h.data)
    move_segments(h.model, h.data)
    activation, fibre = y[18:32].reshape(2, 7), y[32:46].reshape(2, 7)
    forces_on_legs(n, y[:MOVES], y[MOVES:18], activation, fibre, h.on_joints[3:], dy[32:46].reshape(2, 7), felt)
    for side in range(2):
        foot = h.feet[side]
        forces[side, 0] = forces[side, 1] = 0.0
        turn = 0.0
        for point in range(2):
            x, z = h.site[2 * side + point, 0], h.site[2 * side + point, 2]
            # A body's motion is given about the centre of the whole tree: rates of turning, then speeds.
            spin = h.motion[foot, 1]
            speed = h.motion[foot, 3] + spin * (z - h.about[1, 2])
            rise = h.motion[foot, 5] - spin * (x - h.about[1, 0])
            along, up = ground_force(n.ground, ground[2 * side + point], x, z, speed, rise, switch)
            forces[side, 0] += along
            forces[side, 1] += up
            turn += (z - h.centre[foot, 2]) * along - (x - h.centre[foot, 0]) * up
        h.on_bodies[foot, 0], h.on_bodies[foot, 2], h.on_bodies[foot, 4] = forces[side, 0], forces[side, 1], turn
        felt[13 * side + LOAD] = forces[side, 1] / n.weight
    felt[LEAN], felt[LEAN_RATE] = y[2], y[MOVES + 2]
    accelerate_segments(h.model, h.data)
    for k in range(MOVES):
        dy[k], dy[MOVES + k] = y[MOVES + k], h.qacc[k]
    for k in range(14):
        dy[18 + k] = (to[k // 7, k % 7] - y[18 + k]) / 0.01


@njit
def walk_on(n: Numbers, h: Handles, y: Floats, samples: int, steps: int, fallen: float, rows: Floats) -> int:
    """Walk for some samples of ``steps`` steps, keep each in ``rows``; return how many there are before a fall."""
    dt = SAMPLE / steps
    a, b, c, d, at = np.empty(46), np.empty(46), np.empty(46), np.empty(46), np.empty(46)
    to, ground, out = np.full((2, 7), 0.01), np.zeros((4, 2)), (np.zeros((2, 2)), np.zeros(28))
    stance = np.array([[1.0, 0.3, y[2]], [0.0, 0.0, y[2]]])
    # What is on its way at the start was felt in the pose of the start, at rest.
    still = y.copy()
    still[MOVES:18] = 0.0
    touched = ground.copy()
    derivative(n, h, still, to, touched, True, a, out)
    past = np.empty((21, 28))
    for k in range(21):
        past[k] = out[1]
    for sample in range(samples):
        for step in range(steps):
            derivative(n, h, y, to, ground, True, a, out)
            if step == 0:
                past[sample % 21] = out[1]
                reflexes(n, past, sample % 21, stance, to)
                for k in range(14):
                    a[18 + k] = (to[k // 7, k % 7] - y[18 + k]) / 0.01
                rows[sample, 0] = sample * SAMPLE
                rows[sample, 1:10] = y[:MOVES]
                rows[sample, 10], rows[sample, 11] = out[0][0, 1], out[0][1, 1]
                rows[sample, 12:26] = y[18:32]
                if y[1] < fallen:
                    return sample
            at[:] = y + 0.5 * dt * a
            derivative(n, h, at, to, ground, False, b, out)
            at[:] = y + 0.5 * dt * b
            derivative(n, h, at, to, ground, False, c, out)
            at[:] = y + dt * c
            derivative(n, h, at, to, ground, False, d, out)
            y += dt / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    return samples


def start(wearer: Any, numbers: Numbers, speed: float) -> Floats:
    """The state in which a walk begins: on the left leg, the right in front, at a speed [m/s], tendons just slack."""
    body, lean = wearer.body, 0.1
    y = np.zeros(46)
    y[2], y[MOVES] = lean, speed
    y[3:9] = np.radians([175.0, 175.0, 85.0, 140.0, 175.0, 90.0])
    # Down the standing leg: the hip is at rest where the lower end of the foot is 3 mm in the ground.
    thigh = math.pi - y[3] - lean
    shank = thigh + y[4] - math.pi
    foot = shank + math.pi / 2.0 - y[5]
    down = body.thigh.length * math.cos(thigh) + body.shank.length * math.cos(shank)
    y[1] = down + max(body.heel * math.sin(foot), -body.foot.length * math.sin(foot)) - 0.003
    y[18:32] = 0.05
    for side in range(2):
        lengths = np.empty(7)
        stretched_length(numbers.muscles[side], numbers.routes[side], y[3 + 3 * side : 6 + 3 * side], lengths)
        y[32 + 7 * side : 39 + 7 * side] = lengths - numbers.muscles[side, :, 3]
    return y


def walk_of_reference(name: str, seconds: float, steps: int, device: Device = NONE) -> Walked:
    """Walk a wearer by name for some seconds with ``steps`` steps a millisecond; 100 are 10 us each."""
    file = find_wearer(name)
    wearer = wearer_of(file)
    numbers = numbers_of(wearer, device)
    model = mujoco.MjModel.from_xml_string(body_file(wearer.body, device))
    data = mujoco.MjData(model)
    y = start(wearer, numbers, file.speed)
    rows = np.zeros((round(seconds / SAMPLE) + 1, len(COLUMNS)))
    fallen = 0.6 * (wearer.body.thigh.length + wearer.body.shank.length)
    count = walk_on(numbers, handles_of(model, data), y, rows.shape[0], steps, fallen, rows)
    return Walked(dict(zip(COLUMNS, rows[:count].T, strict=True)), count < rows.shape[0])
