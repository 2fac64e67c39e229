"""What the league says of a walk: torque in push-off, toes in the swing, slap, work, gas, switchings."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ppafo.control.walking.torque_profile import TorqueProfile, profile_torque
from ppafo.engine.lanes import Floats
from ppafo.model.command import VENTS_ABOVE
from ppafo.model.contact import SWING
from ppafo.model.gait import GaitTiming
from ppafo.studies.league.walking.stride import free_window, push_off_window

MEASURES = {
    "torque_error": ("N m", "RMS of actuator torque less the wanted one, in the push-off window"),
    "torque_lag": ("s", "by how much the wanted torque has to come later for the least RMS error"),
    "lagged_error": ("N m", "RMS of actuator torque less the wanted one at that lag: what the law itself misses"),
    "mid_stance_torque": ("N m", "RMS of the actuator torque in mid-stance, where the shank shall roll freely"),
    "toe_height": ("m", "lowest toes over the ground in mid-swing, mean over the strides"),
    "toes_clear": ("-", "share of the strides in which the toes touched the ground neither in mid-swing nor first"),
    "toe_strikes": ("-", "share of the strides that begin on the toes"),
    "swing_error": ("rad", "RMS of the ankle angle less the healthy one in the swing"),
    "slap_rate": ("rad/s", "rate of the foot as it comes down, below 0 with the toes falling, mean over the strides"),
    "push_off_work": ("J", "work of T_ex while the foot rolls over the toes, in one stride"),
    "gas": ("kg", "gas taken from the supply in one stride"),
    "switchings": ("-", "changes of the valve's way in one stride: towards 1, towards 2, vented"),
    "safe_state": ("-", "1 where the controller vented for good"),
}
"""Unit and meaning of every measure."""

LAGS = np.arange(0.0, 0.0801, 0.002)
"""Lags [s] that are tried; recognising a heel strike takes some 30 ms."""
_PHASES = np.linspace(0.0, 1.0, 2001)


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """A walk as samples (samples,): phase in turns, contact, angles [rad], torque [N m], command, height of toes [m].

    Running totals: gas [kg], slap rates [rad/s] and landings, strikes with the toes first, work [J]; ``vented`` 1 once
    the controller has vented for good.
    """

    phase: Floats
    contact: Floats
    angle: Floats
    healthy_angle: Floats
    torque: Floats
    command: Floats
    toe_height: Floats
    gas: Floats
    slap_rates: Floats
    landings: Floats
    toe_landings: Floats
    push_off_work: Floats
    vented: Floats


def settled_strides(phase: Floats) -> list[slice]:
    """Whole strides of the second half, from heel strike to heel strike; none where there is no whole stride."""
    strikes = np.flatnonzero(np.diff(phase) < -0.5) + 1
    strides = [slice(int(begin), int(end)) for begin, end in itertools.pairwise(strikes)]
    return strides[len(strides) // 2 :]


def measures(course: Course, profile: TorqueProfile, timing: GaitTiming, strides: Sequence[slice]) -> dict[str, float]:
    """The values of ``MEASURES`` over some strides, at least one."""
    part = slice(strides[0].start, strides[-1].stop)
    errors = _torque_errors(course, part, profile, timing)
    best = int(np.argmin(errors))
    swings = course.contact[part] == SWING
    lowest, clear, struck = _toes(course, timing, strides)
    landings = max(_gain(course.landings, part), 1.0)
    return {
        "torque_error": errors[0],
        "torque_lag": float(LAGS[best]),
        "lagged_error": errors[best],
        "mid_stance_torque": _mid_stance(course, part, profile),
        "toe_height": lowest,
        "toes_clear": clear,
        "toe_strikes": struck,
        "swing_error": _rms((course.angle - course.healthy_angle)[part][swings]),
        "slap_rate": _gain(course.slap_rates, part) / landings,
        "push_off_work": _gain(course.push_off_work, part) / len(strides),
        "gas": _gain(course.gas, part) / len(strides),
        "switchings": switchings(course.command[part]) / len(strides),
        "safe_state": float(course.vented[part].any()),
    }


def switchings(command: Floats) -> float:
    """How often a command changes what the valve does; a command of 0 in between does not count."""
    ways = np.where(command > VENTS_ABOVE, 2.0, np.sign(command))
    return float(np.count_nonzero(np.diff(ways[ways != 0.0])))


def _torque_errors(course: Course, part: slice, profile: TorqueProfile, timing: GaitTiming) -> list[float]:
    """RMS errors [N m] in the push-off window, both the window and what is wanted later by each of ``LAGS``."""
    first, last = push_off_window(profile, timing)
    table = [profile_torque(profile, phase) for phase in _PHASES.tolist()]
    phase, torque = course.phase[part], course.torque[part]
    errors = []
    for late in (LAGS * timing.frequency).tolist():
        pushes = (phase >= first + late) & (phase <= min(last + late, timing.toe_off))
        missed = torque[pushes] - np.interp(phase[pushes] - late, _PHASES, table)
        errors.append(_rms(missed) if missed.size else float("inf"))
    return errors


def _mid_stance(course: Course, part: slice, profile: TorqueProfile) -> float:
    """RMS torque [N m] where none is wanted; 0 where the push-off leaves no such time."""
    first, last = free_window(profile)
    free = (course.phase[part] >= first) & (course.phase[part] < last)
    return _rms(course.torque[part][free]) if free.any() else 0.0


def _toes(course: Course, timing: GaitTiming, strides: Sequence[slice]) -> tuple[float, float, float]:
    """Mean lowest toes in mid-swing [m], and the shares of strides with clear toes and with toes that struck first."""
    lowest, struck = [], []
    for stride in strides:
        phase = course.phase[stride]
        watched = (phase >= timing.clearance_from) & (phase <= timing.clearance_to)
        lowest.append(float(np.min(course.toe_height[stride][watched])))
        struck.append(_gain(course.toe_landings, stride) > 0.5)
    clear = [height >= 0.0 and not first for height, first in zip(lowest, struck, strict=True)]
    return float(np.mean(lowest)), float(np.mean(clear)), float(np.mean(struck))


def _gain(total: Floats, part: slice) -> float:
    return float(total[min(part.stop, total.size - 1)] - total[part.start])


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))
