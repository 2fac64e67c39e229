"""One stride on a grid, from toe-off to toe-off: which instants are free, and what the gait prescribes at each."""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.control.walking.assistance import TorqueProfile, profile_torque
from ppafo.engine.lanes import Floats
from ppafo.engine.run import Walk
from ppafo.model import contact as ground
from ppafo.model.gait import GaitNow, GaitTiming, gait_at

DEGREE = 2
"""Collocation points in an interval; Radau's, of third order."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Intervals of a stride, shortened where something begins or ends: ``starts`` and ``lengths`` [s] after toe-off.

    ``times`` [s] and integration ``weights`` [s] are those of all collocation points, ``slopes`` (degree + 1, degree)
    differentiate within an interval of length 1. Intervals before ``free_intervals`` have a free foot.
    """

    starts: Floats
    lengths: Floats
    times: Floats
    weights: Floats
    slopes: Floats
    free_intervals: int

    @property
    def free_points(self) -> int:
        """Number of collocation points at which the foot is free."""
        return DEGREE * self.free_intervals


@dataclass(frozen=True, slots=True)
class Stride:
    """A stride whose foot comes down flat at the phase ``landing``, with the gait and what is requested at every point.

    ``wanted`` [N m], ``asks_torque`` and ``asks_freedom`` for each point; ``asks_height`` for each free point;
    ``prescribed`` are the angles [rad] and rates [rad/s] of the points on the ground; ``begin`` those at toe-off.
    ``phases`` of the points and ``middle_phases`` of the intervals count on from the heel strike before the toe-off.
    """

    grid: Grid
    landing: float
    now: tuple[GaitNow, ...]
    contacts: tuple[float, ...]
    prescribed: tuple[ground.Ankle, ...]
    begin: ground.Ankle
    wanted: Floats
    asks_torque: Floats
    asks_freedom: Floats
    asks_height: NDArray[np.bool_]
    phases: Floats
    middle_phases: Floats

    @property
    def before_landing(self) -> list[int]:
        """Free points from the heel strike on at which the foot is not flat yet."""
        on_heel = np.flatnonzero(np.array(self.contacts[: self.grid.free_points]) == ground.HEEL)
        return [int(on_heel[0]) - 1, *on_heel[:-1].tolist()]


FREE_FROM = 0.2
"""Phase from which the shank shall roll freely over the foot, until the push-off; the foot is flat long before."""


def free_window(profile: TorqueProfile) -> tuple[float, float]:
    """Phases of mid-stance between which no torque is desired; the same twice where the push-off begins before."""
    begin = max(profile.peak_time - profile.rise_time, 0.0)
    return min(FREE_FROM, begin), begin


def push_off_window(profile: TorqueProfile, timing: GaitTiming) -> tuple[float, float]:
    """Phases between which a torque is requested, up to toe-off at most."""
    begin = profile.peak_time - profile.rise_time
    return max(begin, 0.0), min(profile.peak_time + profile.fall_time, timing.toe_off)


def stride_of(walk: Walk, profile: TorqueProfile, landing: float, intervals: int, lag: float = 0.0) -> Stride:
    """The stride of a gait with about so many intervals; ``landing`` in turns after the heel strike.

    The torque of ``profile`` is desired later by a lag [s]; mid-stance is free up to where it would begin without.
    """
    timing = walk.timing
    late = profile._replace(peak_time=profile.peak_time + lag * timing.frequency)
    windows = (*push_off_window(late, timing), *free_window(profile))
    grid = _grid(timing, (late.peak_time, *windows), landing, intervals)
    now = [_gait(walk, time) for time in grid.times]
    phases = timing.toe_off + timing.frequency * grid.times
    contacts = [_contact(timing, landing, phase) for phase in phases.tolist()]
    prescribed = [
        _prescribed_ankle(walk, contact, phase) for contact, phase in zip(contacts, phases.tolist(), strict=True)
    ]
    first, last, free_first, free_last = (1.0 + phase for phase in windows)
    return Stride(
        grid,
        landing,
        tuple(now),
        tuple(contacts),
        tuple(prescribed[grid.free_points :]),
        _prescribed_ankle(walk, ground.TOE, 1.0 + timing.toe_off),
        np.array([profile_torque(late, phase - 1.0) for phase in phases.tolist()]),
        ((phases > first) & (phases < last + 1.0e-9)).astype(np.float64),
        ((phases > free_first) & (phases < free_last + 1.0e-9)).astype(np.float64),
        ((phases > timing.clearance_from) & (phases < timing.clearance_to + 1.0e-9))[: grid.free_points],
        phases,
        timing.toe_off + timing.frequency * (grid.starts + 0.5 * grid.lengths),
    )


def _grid(timing: GaitTiming, phases: tuple[float, ...], landing: float, intervals: int) -> Grid:
    """About so many intervals, with a mark wherever something begins or ends; ``phases`` of what is desired."""
    import casadi

    marks = [timing.toe_off, timing.clearance_from, timing.clearance_to, 1.0, 1.0 + landing, 1.0 + timing.heel_off]
    marks += [1.0 + min(phase, timing.toe_off) for phase in phases]
    marks = sorted({*marks, 1.0 + timing.toe_off})
    edges = [marks[0]]
    for begin, end in itertools.pairwise(marks):
        parts = max(1, round((end - begin) * intervals))
        edges += [begin + (end - begin) * (part + 1) / parts for part in range(parts)]
    starts = (np.array(edges[:-1]) - timing.toe_off) / timing.frequency
    lengths = np.diff(edges) / timing.frequency
    roots = casadi.collocation_points(DEGREE, "radau")
    slopes, _, weights = (np.array(item) for item in casadi.collocation_coeff(roots))
    times = (starts[:, None] + lengths[:, None] * np.array(roots)).ravel()
    free = int(np.count_nonzero(np.array(edges[1:]) < 1.0 + landing + 1.0e-9))
    return Grid(starts, lengths, times, (lengths[:, None] * weights.ravel()).ravel(), slopes, free)


def _gait(walk: Walk, time: float) -> GaitNow:
    """The gait at a time [s] after toe-off."""
    timing = walk.timing._replace(start=walk.timing.toe_off)
    return gait_at(walk.gait, timing, walk.leg, time)


def _contact(timing: GaitTiming, landing: float, phase: float) -> float:
    """Contact just before a phase that counts on from the last heel strike but one."""
    on_ground = ground.FLAT if phase <= 1.0 + timing.heel_off else ground.TOE
    on_ground = ground.HEEL if phase <= 1.0 + landing + 1.0e-9 else on_ground
    return ground.SWING if phase <= 1.0 else on_ground


def _prescribed_ankle(walk: Walk, contact: float, phase: float) -> ground.Ankle:
    """Where the ground leads the ankle: after the heel's rise what is left of the difference to the measured ankle."""
    timing = walk.timing
    ankle = ground.prescribed_ankle(contact, _at(walk, phase), timing.ground_angle, keeps_gait=0.0)
    if contact != ground.TOE:
        return ankle
    rise = _at(walk, timing.heel_off)
    flat = ground.prescribed_ankle(ground.FLAT, rise, timing.ground_angle, keeps_gait=0.0)
    since = (phase - 1.0 - timing.heel_off) / timing.frequency
    offset = (flat.angle - rise.ankle) * float(np.exp(-since / ground.FADING_TIME))
    return ground.Ankle(ankle.angle + offset, ankle.rate - offset / ground.FADING_TIME, ankle.acceleration)


def _at(walk: Walk, phase: float) -> GaitNow:
    return _gait(walk, (phase - walk.timing.toe_off) / walk.timing.frequency % (1.0 / walk.timing.frequency))
