"""One step of a neuromuscular gait model: muscles, reflexes, ground, and a device that acts on the left ankle.

It stands beside ``walking.py``, where a gait leads the leg: here the body step comes before the gas, with the
pressures at its begin, and the ankle that the gas sees is the body's. Device and body exchange torque and angle once a
step, which is 0.1 ms long. What sensors, faults, controllers and metrics read of a walk has the same names in both.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

from ppafo.engine.components import LegScheme, Phases, RarePhase
from ppafo.engine.run import LegGroups
from ppafo.engine.scheme.motion import clamp_angle, with_motion
from ppafo.engine.scheme.pneumatics import HeldChambers, held_chambers, held_pressures
from ppafo.engine.scheme.walking import NO_CLEARANCE, DeviceShare
from ppafo.model.contact import FLAT, HEEL, SWING, TOE
from ppafo.model.plant import PlantParameters, PlantState, actuator_torque
from ppafo.model.plant_faults import POWERED, PlantFaults, ShutOff, Unpowered
from ppafo.model.ports import friction_in_motion
from ppafo.model.sensors import NOTHING_SEEN, GaitSeen, GaitSensors
from ppafo.wearer.model.metabolic import rates_of_leg
from ppafo.wearer.model.muscle import Fibre, Muscle, tendon_force
from ppafo.wearer.model.nerves import SAMPLE, LegNerves, Nerves, arrived, balance_arrived, next_nerves
from ppafo.wearer.model.reflexes import Balance, Felt
from ppafo.wearer.model.segments import Limb
from ppafo.wearer.model.walker import (
    Answer,
    Assist,
    Fibres,
    LegNow,
    Muscles,
    Pull,
    Walker,
    Wearer,
    answer,
    joints,
    next_walker,
    rates_of_joints,
)
from ppafo.wearer.model.way import Pushed, footing, next_push, push_now

CREEP = 0.02
"""Rate [rad/s] below which friction of the vane grows with it, so that a step can take it implicitly."""

FALLEN = 0.6
"""A wearer whose hip is lower over the ground than this share of the straight leg has fallen."""

PASSING = 0.15
"""The toes must clear the ground while the swinging ankle is within this share of the leg's length of the hip."""

LOADED = 0.05
"""Load [body weights] with which a foot stands: less is a scuff."""

STANDING = -1.0
"""Time of a fall [s] of a wearer who has not fallen."""

SAME = 1.0e-9
"""Time [s] that is none."""


class WalkNow(NamedTuple):
    """Phase of the stride in turns of the one before, and angle of the shank [rad]."""

    phase: float
    shank: float


class ReactingState(NamedTuple):
    """Where the foot with the device stands, what the wearer gets, and totals since the start; as in ``WalkState``.

    ``since`` [s] the strike, ``stride_time`` [s] of the stride before. ``load`` and ``other_load`` [body weights] of
    both feet, ``muscle_work`` [J] that all muscles did as they shortened, ``fall_time`` [s], below 0 before a fall.
    ``clearance`` [m] is over the ground. ``pushed`` is the push on the trunk.
    """

    contact: float
    now: WalkNow
    external_torque: float
    heel_force: float
    toe_force: float
    toes_first: float
    clearance: float
    since: float
    stride_time: float
    strides: float
    toe_landings: float
    clearances: float
    positive_push_off_work: float
    net_push_off_work: float
    load: float
    other_load: float
    muscle_work: float
    fall_time: float
    pushed: Pushed


class Reflexes(NamedTuple):
    """What the reflexes have ordered, the phases of both legs, and the time until the nerves are sampled next [s].

    ``due`` is 1 where they are sampled now. Also the metabolic energy [J] of all muscles since the start by both
    models, sampled with the nerves.
    """

    ordered: Answer
    due: float
    until: float
    umberger: float
    bhargava: float


class FootEnd(NamedTuple):
    """The foot with the device at the begin of a step, and what the device did to its ankle.

    ``heel_up`` and ``ball_up`` [N] under it, ``place`` of its ankle in front of the hip and height of its ``toes`` [m],
    torque ``given`` by both pressures [N m], ``damping`` of the vane with its friction [N m s/rad].
    """

    heel_up: float
    ball_up: float
    place: float
    toes: float
    given: float
    damping: float


class BodyEnd(NamedTuple):
    """A wearer after a step, and what was felt and acted at its begin.

    ``due`` is 1 where the nerves are sampled, ``work`` is the muscles' [J].
    """

    after: Walker
    left_felt: Felt
    right_felt: Felt
    balance: Balance
    due: float
    work: float
    foot: FootEnd


class AnkleStep(NamedTuple):
    """Angle [rad] and rate [rad/s] of the ankle at the end of the step."""

    angle: float
    rate: float


def assist_of(plant: PlantParameters, share: DeviceShare, state: PlantState, held: HeldChambers) -> Assist:
    """What the device does to the ankle: torque of both pressures, friction and damping of the vane, its inertia."""
    pressure_1, pressure_2 = held_pressures(held, state)
    torque = actuator_torque(pressure_1, pressure_2, plant.torque_constant)
    # Friction as damping, torque over rate: implicit, it cannot turn the rate round within a step.
    friction = friction_in_motion(plant.dynamic_torque, state.angular_velocity, pressure_1, pressure_2)
    damping = share.viscous_damping + friction / max(abs(state.angular_velocity), CREEP)
    return Assist(torque, damping, share.inertia)


def shortened(muscle: Muscle, before: Fibre, after: Fibre, whole: float) -> float:
    """Work [J] of a muscle that shortens in a step; none where it is drawn out."""
    halfway = 0.5 * (before.length + after.length)
    return muscle.force * tendon_force(muscle, whole - halfway) * max(before.length - after.length, 0.0)


def work_of_leg(muscles: Muscles, before: Fibres, after: Fibres, pull: Pull) -> float:
    """Work [J] of the muscles of a leg that shorten in a step."""
    ankle = shortened(muscles.soleus, before.soleus, after.soleus, pull.soleus)
    ankle += shortened(muscles.tibialis, before.tibialis, after.tibialis, pull.tibialis)
    ankle += shortened(muscles.gastrocnemius, before.gastrocnemius, after.gastrocnemius, pull.gastrocnemius)
    hip = shortened(muscles.vastus, before.vastus, after.vastus, pull.vastus)
    hip += shortened(muscles.hamstring, before.hamstring, after.hamstring, pull.hamstring)
    hip += shortened(muscles.gluteus, before.gluteus, after.gluteus, pull.gluteus)
    hip += shortened(muscles.flexor, before.flexor, after.flexor, pull.flexor)
    return ankle + hip


def next_body(
    wearer: Wearer,
    walker: Walker,
    reflexes: Reflexes,
    walk: ReactingState,
    assist: Assist,
    step: float,
) -> BodyEnd:
    """The wearer after a step [s] with what the device does to the left ankle; one who has fallen lies still."""
    # A step of no length leaves everything where it is, without a branch in compiled code.
    moving = 0.0 if walk.fall_time >= 0.0 else step
    push = push_now(walk.pushed, step)
    ordered = reflexes.ordered
    to_right = Assist(0.0, 0.0, 0.0)
    stepped = next_walker(wearer, walker, ordered.to_left, ordered.to_right, assist, to_right, push, moving)
    left: LegNow = stepped.left
    right: LegNow = stepped.right
    after = stepped.after
    work = work_of_leg(wearer.left, walker.left.fibres, after.left.fibres, left.pull)
    work += work_of_leg(wearer.right, walker.right.fibres, after.right.fibres, right.pull)
    return BodyEnd(
        after=after,
        left_felt=stepped.left_felt,
        right_felt=stepped.right_felt,
        balance=stepped.balance,
        due=reflexes.due,
        work=work,
        foot=FootEnd(
            heel_up=left.heel_up,
            ball_up=left.ball_up,
            place=left.place,
            toes=left.toes,
            given=assist.torque,
            damping=assist.damping,
        ),
    )


def ankle_of(
    plant: PlantParameters, limb: Limb, limb_rates: Limb, lean: float, lean_rate: float, fall_time: float
) -> AnkleStep:
    """The ankle to which the body led a leg, as far as the vane can follow."""
    angle = joints(limb, lean).ankle
    rate = rates_of_joints(limb_rates, lean_rate).ankle
    # The ends of the body's own ankle are soft: it may turn farther than the vane can.
    reached = clamp_angle(plant, angle)
    return AnkleStep(reached, rate if fall_time < 0.0 and reached == angle else 0.0)


def waiting_reflexes(reflexes: Reflexes, fall_time: float, step: float) -> Reflexes:
    """The reflexes after a step [s]; one who has fallen has none."""
    until = reflexes.until - step
    return Reflexes(
        ordered=reflexes.ordered,
        due=1.0 if until <= SAME and fall_time < 0.0 else 0.0,
        until=until,
        umberger=reflexes.umberger,
        bhargava=reflexes.bhargava,
    )


def next_reflexes(wearer: Wearer, nerves: Nerves, reflexes: Reflexes, legs: Walker) -> Reflexes:
    """The reflexes from a sample of the nerves on."""
    left: LegNerves = nerves.left
    right: LegNerves = nerves.right
    before = reflexes.ordered
    ordered = answer(wearer, before.left, before.right, arrived(left), arrived(right), balance_arrived(nerves), SAMPLE)
    of_left = rates_of_leg(wearer.left, legs.left.fibres, before.to_left)
    of_right = rates_of_leg(wearer.right, legs.right.fibres, before.to_right)
    return Reflexes(
        ordered=ordered,
        due=reflexes.due,
        until=reflexes.until + SAMPLE,
        umberger=reflexes.umberger + SAMPLE * (of_left.umberger + of_right.umberger),
        bhargava=reflexes.bhargava + SAMPLE * (of_left.bhargava + of_right.bhargava),
    )


def advance_reacting(
    wearer: Wearer,
    share: DeviceShare,
    walk: ReactingState,
    body: BodyEnd,
    before: PlantState,
    after: PlantState,
    follow_rate: float,
    time: float,
    step: float,
) -> ReactingState:
    """What the sensors show and what adds up over the strides; ``time`` [s] is that at the end of the step [s].

    A strike is the foot that stands after the toes came by; what touches before is a scuff.
    """
    foot: FootEnd = body.foot
    limb: Limb = body.after.pose.left
    limb_rates: Limb = body.after.rates.left
    stood = walk.fall_time < 0.0
    leg = wearer.body.thigh.length + wearer.body.shank.length
    pose = body.after.pose
    heel, ball = foot.heel_up, foot.ball_up
    contact = (FLAT if ball > 0.0 else HEEL) if heel > 0.0 else (TOE if ball > 0.0 else SWING)
    load = (heel + ball) / wearer.weight
    # The ankle in front of the hip grows in the swing and falls in stance.
    forward = wearer.body.thigh.length * limb_rates.thigh + wearer.body.shank.length * limb_rates.shank > 0.0
    # Toes count while the swinging leg passes the standing one, where they are lowest and stumbling is likely.
    watched = stood and forward and abs(foot.place) < PASSING * leg
    passed = walk.clearance < NO_CLEARANCE
    strikes = stood and passed and load > LOADED and foot.place >= PASSING * leg
    lowest = min(walk.clearance, foot.toes if watched else walk.clearance)
    touches_first = ball > heel
    acceleration = (after.angular_velocity - before.angular_velocity) / max(step, 1.0e-30)
    given = foot.given - foot.damping * after.angular_velocity - share.inertia * acceleration
    turned = after.angle - before.angle
    follows = follow_rate * step / (1.0 + follow_rate * step)
    since = 0.0 if strikes else walk.since + step
    # Negated, so that a height that is no number is a fall too.
    falls = stood and not (pose.y - footing(wearer.way, pose.x).height > FALLEN * leg)
    work = 0.5 * (given + walk.external_torque) * turned if contact == TOE and stood else 0.0
    positive_work = max(work, 0.0)
    # The first strike ends no whole stride: the walk began within one.
    stride_time = walk.since if strikes and walk.strides > 0.5 else walk.stride_time
    muscle_work = walk.muscle_work + (body.work if stood else 0.0)
    toes_first = (1.0 if touches_first else 0.0) if strikes else walk.toes_first
    on_toes = 1.0 if strikes and touches_first else 0.0
    struck = 1.0 if strikes else 0.0
    external_torque = given if stood else 0.0
    clearance = NO_CLEARANCE if strikes else lowest
    cleared = lowest if strikes else 0.0
    fall_time = time if falls else walk.fall_time
    pushed = next_push(wearer.way, walk.pushed, pose.x, step)
    # Numba compiles no call of so many names with a choice inside.
    return ReactingState(
        contact=contact,
        now=WalkNow(min(since / stride_time, 1.0), limb.shank),
        external_torque=external_torque,
        heel_force=walk.heel_force + (heel - walk.heel_force) * follows,
        toe_force=walk.toe_force + (ball - walk.toe_force) * follows,
        toes_first=toes_first,
        clearance=clearance,
        since=since,
        stride_time=stride_time,
        strides=walk.strides + struck,
        toe_landings=walk.toe_landings + on_toes,
        clearances=walk.clearances + cleared,
        positive_push_off_work=walk.positive_push_off_work + positive_work,
        net_push_off_work=walk.net_push_off_work + work,
        load=load,
        other_load=body.right_felt.load,
        muscle_work=muscle_work,
        fall_time=fall_time,
        pushed=pushed,
    )


def find(_rows: Any) -> list[str]:
    """Lines that make what a step is handed by the one before; nothing but the chambers is."""
    return []


def lead(rows: Any) -> Phases:
    """Phases before the gas: the body, and where few steps sample them, the nerves and the reflexes."""
    add = rows.add
    stepped = f"{add(next_body)}(wearer, walker, reflexes, walk, assist, length)"
    limb = "body.after.pose.left, body.after.rates.left, body.after.pose.lean, body.after.rates.lean"
    ordered = f"{add(next_reflexes)}(wearer, nerves, reflexes, walker)"
    passed_on = f"{add(next_nerves)}(nerves, body.left_felt, body.right_felt, body.balance)"
    waits = f"{add(waiting_reflexes)}(reflexes, walk.fall_time, length)"
    return [
        # Its answer counts from the sample on; what is felt there arrives later and waits for the body.
        RarePhase(
            [
                *[rows.load(name) for name in ("wearer", "walker", "nerves", "reflexes")],
                "is_due = reflexes.due > 0.5",
                f"reflexes_after = {ordered}",
                *rows.store("reflexes", "reflexes_after", "is_due"),
            ],
            rows.cells["reflexes.due"],
        ),
        [
            *[rows.load(name) for name in ("wearer", "walker", "reflexes")],
            f"assist = {add(assist_of)}(plant, share, state, held)",
            f"body = {stepped}",
            f"begun = {add(ankle_of)}(plant, {limb}, walk.fall_time)",
            *rows.keep("body", "begun"),
            f"reflexes = {waits}",
            *rows.store("reflexes"),
        ],
        RarePhase(
            [
                *[rows.load(name) for name in ("nerves", "body")],
                "is_due = body.due > 0.5",
                f"passed_on = {passed_on}",
                *rows.store("nerves", "passed_on", "is_due"),
            ],
            rows.cells["body.due"],
        ),
    ]


def assume(rows: Any) -> list[str]:
    """Lines that find the chambers at the end of the step."""
    return [
        rows.load("begun"),
        "next_angle = begun.angle",
        f"ahead = {rows.add(held_chambers)}(plant, next_angle)",
        *rows.keep("ahead"),
    ]


def reach(_rows: Any, _fed: str) -> Phases:
    """No phases: the body has led the ankle already."""
    return []


def end(rows: Any) -> list[str]:
    """Lines that lead to the state ``after`` the step."""
    follow = rows.cells["gait_sensors.follow_rate"]
    given = f"wearer, share, walk, body, state, after, {follow}, time + length, length"
    return [
        *[rows.load(name) for name in ("begun", "ahead", "body", "wearer")],
        "held = ahead",
        *rows.keep("held"),
        f"after = {rows.add(with_motion)}(fed, begun.angle, begun.rate)",
        f"walk_after = {rows.add(advance_reacting)}({given})",
        *rows.program.gas.move(rows, "after", "begun.angle", "after.angle"),
        "walker_after = body.after",
    ]


def _scheme(fails: bool) -> LegScheme:
    faults = {"plant_faults": PlantFaults, "shut_off": ShutOff} if fails else {}
    return LegScheme(
        takes_task_sequence=False,
        parameters={"share": DeviceShare, "wearer": Wearer, "gait_sensors": GaitSensors, **faults},
        states={
            "walk": ReactingState,
            "gait_seen": GaitSeen,
            "walker": Walker,
            "reflexes": Reflexes,
            "nerves": Nerves,
            **({"unpowered": Unpowered} if fails else {}),
        },
        loads=("share", "walk", *faults, *(["unpowered"] if fails else [])),
        stored={"walk": "walk_after", "walker": "walker_after"},
        begun=AnkleStep,
        led={"body": BodyEnd},
        handed={},
        ended={"ahead": HeldChambers},
        find=find,
        lead=lead,
        assume=assume,
        reach=reach,
        end=end,
        fails=fails,
        reacts=True,
    )


REACTING, FAILING_REACTING = _scheme(fails=False), _scheme(fails=True)
"""A leg of a neuromuscular gait model, and the same with a plant that may fail, or whose line has a shut-off valve."""


@dataclass(frozen=True, slots=True)
class ReactingWalk:
    """A body with the device on its left leg, and where all of it begins."""

    share: DeviceShare
    body: Wearer
    sensors: GaitSensors
    initial: ReactingState
    walker: Walker
    reflexes: Reflexes
    nerves: Nerves
    failing: tuple[PlantFaults, ShutOff] | None = None

    def groups(self) -> LegGroups:
        """Its scheme, and its groups of rows in the order of ``Program``."""
        parameters = [self.share, self.body, self.sensors]
        states = [self.initial, NOTHING_SEEN, self.walker, self.reflexes, self.nerves]
        if self.failing is None:
            return LegGroups(REACTING, parameters, states)
        return LegGroups(FAILING_REACTING, [*parameters, *self.failing], [*states, POWERED])
