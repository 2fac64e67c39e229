"""What the league reports of a walk: torque in push-off, toes in the swing, slap, work, gas, switchings."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ppafo.control.walking.assistance import TorqueProfile, profile_torque
from ppafo.engine.lanes import Floats, run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, batch_of
from ppafo.errors import SimulationError
from ppafo.gait import Gait
from ppafo.model.command import VENTS_ABOVE
from ppafo.model.contact import SWING
from ppafo.model.gait import GaitTiming
from ppafo.model.plant import PlantParameters, chamber_pressures
from ppafo.questions.league.walking.stride import free_window, push_off_window
from ppafo.questions.league.walking.task import WalkingTask
from ppafo.simulation.scenario import Scenario
from ppafo.walking.event_times import EVENTS, TOO_FAR, Samples, event_errors, known_events, true_events, within
from ppafo.walking.gait_series import gait_timing, truncate
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import plan_walk
from ppafo.walking.posture import AnklePath, ankle_path
from ppafo.walking.recorded import SAFE_ROW
from ppafo.walking.result import REMEDY
from ppafo.walking.varying import with_duration
from ppafo.walking.wearer import Wearer

MEASURES = {
    "torque_error": ("N m", "RMS of actuator torque less the desired torque, in the push-off window"),
    "torque_lag": ("s", "delay of the desired torque that gives the minimum RMS error"),
    "lagged_error": ("N m", "RMS of actuator torque less the desired torque at that lag: the error of the law itself"),
    "mid_stance_torque": ("N m", "RMS of the actuator torque in mid-stance, where the shank should move freely"),
    "toe_height": ("m", "lowest toes over the ground in mid-swing, mean over the strides"),
    "toes_clear": (
        "-",
        "fraction of the strides in which the toes touched the ground neither in mid-swing nor first at landing",
    ),
    "toe_strikes": ("-", "fraction of the strides that begin on the toes"),
    "swing_error": ("rad", "RMS of the ankle angle less the healthy one in the swing"),
    "slap_rate": ("rad/s", "rate of the foot as it comes down, below 0 with the toes falling, mean over the strides"),
    "push_off_work": ("J", "work of T_ex while the foot rolls over the toes, in one stride"),
    "gas": ("kg", "gas taken from the supply in one stride"),
    "event_error": ("s", "RMS of the times at which the controller knows of the events of the stride, less the true"),
    "strike_error": ("s", "the same of the heel strikes alone"),
    "switchings": ("-", "changes of the valve's path in one stride: to chamber 1, to chamber 2, vented"),
    "safe_state": ("-", "1 if the controller paused or stopped"),
}
"""Unit and meaning of every measure."""
LAGS = np.arange(0.0, 0.0801, 0.002)
"""Lags [s] that are tried; recognising a heel strike takes some 30 ms."""
_PROFILE_PHASES = np.linspace(0.0, 1.0, 2001)
_PHASES = np.linspace(0.0, 1.0, 1001)


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """A walk as samples (samples,): phase in turns, contact, angles [rad], torque [N m], command, height of toes [m].

    ``known_events`` are the samples at which the controller knows of each event, {} where it knows of none.
    Running totals: gas [kg], slap rates [rad/s] and landings, strikes with the toes first, work [J]; ``vented`` 1 once
    the controller has paused or stopped.
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
    true_events: Mapping[str, Samples] = field(default_factory=dict)
    known_events: Mapping[str, Samples] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class Toes:
    """Where the toes of a wearer are: the path of the ankle, and the healthy toes over the ground [m] by phase."""

    path: AnklePath
    toe_off: float
    healthy: Floats

    def heights(
        self, timing: GaitTiming, stature: float, phase: Floats, shank: Floats, angles: tuple[Floats, Floats]
    ) -> Floats:
        """Toes over the ground [m] in the swing of a wearer with a gait and a stature of their own.

        The healthy toes are at the same fraction of the swing as high as those of the gait that is varied; ``angles``
        are the ankle's and the healthy one [rad].
        """
        fraction = (phase - timing.toe_off) / (1.0 - timing.toe_off)
        healthy = np.interp(self.toe_off + fraction * (1.0 - self.toe_off), _PHASES, self.healthy)
        path = replace(
            self.path,
            toe_lever=stature * self.path.toe_lever,
            height=stature * self.path.height,
            ground_angle=timing.ground_angle,
        )
        lifted, measured = (path.toe_height(phase, shank, angle) for angle in angles)
        return np.asarray(healthy + lifted - measured)


def toes_of(gait: Gait, wearer: Wearer) -> Toes:
    """The toes of a wearer with a gait."""
    timing = gait_timing(gait)
    path = ankle_path(gait, timing, wearer)
    shank, ankle = truncate(gait.shank_angle).values_at(_PHASES), truncate(gait.ankle_angle).values_at(_PHASES)
    # The path repeats: at its very end it is that of the next heel strike.
    return Toes(path, timing.toe_off, path.toe_height(np.minimum(_PHASES, 1.0 - 1.0e-9), shank, ankle))


def course_of(
    record: Mapping[str, Floats], plant: PlantParameters, timing: GaitTiming, toes: Toes, stature: float = 1.0
) -> Course:
    """The course of a walk from its rows (samples,) by path; ``stature`` over that of the wearer of ``toes``."""
    angle, healthy, phase = record["state.angle"], record["walk.now.ankle"], record["walk.now.phase"]
    pressures = chamber_pressures(plant, angle, record["state.mass_1"], record["state.mass_2"])
    return Course(
        phase=phase,
        contact=record["walk.contact"],
        angle=angle,
        healthy_angle=healthy,
        torque=plant.torque_constant * np.subtract(*pressures),
        command=record["result.command"],
        toe_height=toes.heights(timing, stature, phase, record["walk.now.shank"], (angle, healthy)),
        gas=record["state.supplied_mass"],
        slap_rates=record["walk.slap_rates"],
        landings=record["walk.landings"],
        toe_landings=record["walk.toe_landings"],
        push_off_work=record["walk.push_off_work"],
        vented=record.get(SAFE_ROW, np.zeros_like(phase)),
        true_events=true_events(record["walk.contact"]),
        known_events=known_events(record),
    )


def walk_course(task: WalkingTask, configuration: Scenario) -> Course:
    """The course of a walk, every sample of it; SimulationError where it diverges."""
    run = plan_walk(with_duration(configuration, task.seconds))
    assert run.walk is not None, "a league walks"
    outcome = run_batch(batch_of(run))
    rows = row_numbers(run.program.state_rows())
    final = outcome.states[:, 0]
    if final[rows["result.failure_time"]] < NEVER_FAILED or not np.isfinite(final).all():
        raise SimulationError(f"{configuration.control.kind} diverged; {REMEDY}")
    record = {name: outcome.record[:, row, 0] for name, row in rows.items()}
    return course_of(
        record, run.plant, run.walk.timing, toes_of(walk_of(configuration).gait, walk_of(configuration).wearer)
    )


def walk_measures(task: WalkingTask, configuration: Scenario) -> dict[str, float]:
    """The measures of the settled strides; SimulationError where the walk diverges."""
    run = plan_walk(with_duration(configuration, task.seconds))
    assert run.walk is not None, "a league walks"
    course = walk_course(task, configuration)
    return measures(course, task.profile, run.walk.timing, last_strides(course.phase))


def last_strides(phase: Floats) -> list[slice]:
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
    return _event_errors(course, part, len(strides), timing) | {
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


def _event_errors(course: Course, part: slice, strides: int, timing: GaitTiming) -> dict[str, float]:
    """RMS errors [s] of the event times; {} for a controller that knows of no events."""
    if not course.known_events:
        return {}
    stride_time = 1.0 / timing.frequency
    interval = strides * stride_time / (part.stop - part.start)
    true, room = within(course.true_events, part), round(TOO_FAR * stride_time / interval)
    known = within(course.known_events, slice(part.start - room, part.stop + room))
    found = {name: event_errors(true[name], known[name], interval, stride_time).errors for name in EVENTS}
    every = np.concatenate(list(found.values()))
    if not (every.size and found[EVENTS[0]].size):
        return {}
    return {"event_error": _rms(every), "strike_error": _rms(found[EVENTS[0]])}


def switchings(command: Floats) -> float:
    """How often a command changes what the valve does; a command of 0 in between does not count."""
    ways = np.where(command > VENTS_ABOVE, 2.0, np.sign(command))
    return float(np.count_nonzero(np.diff(ways[ways != 0.0])))


def _torque_errors(course: Course, part: slice, profile: TorqueProfile, timing: GaitTiming) -> list[float]:
    """RMS errors [N m] in the push-off window, both the window and what is desired later by each of ``LAGS``."""
    first, last = push_off_window(profile, timing)
    table = [profile_torque(profile, phase) for phase in _PROFILE_PHASES.tolist()]
    phase, torque = course.phase[part], course.torque[part]
    errors = []
    for late in (LAGS * timing.frequency).tolist():
        pushes = (phase >= first + late) & (phase <= min(last + late, timing.toe_off))
        missed = torque[pushes] - np.interp(phase[pushes] - late, _PROFILE_PHASES, table)
        errors.append(_rms(missed) if missed.size else float("inf"))
    return errors


def _mid_stance(course: Course, part: slice, profile: TorqueProfile) -> float:
    """RMS torque [N m] where none is desired; 0 where the push-off leaves no such time."""
    first, last = free_window(profile)
    free = (course.phase[part] >= first) & (course.phase[part] < last)
    return _rms(course.torque[part][free]) if free.any() else 0.0


def _toes(course: Course, timing: GaitTiming, strides: Sequence[slice]) -> tuple[float, float, float]:
    """Mean lowest toes in mid-swing [m], fractions of strides with clear toes and of those that begin on the toes."""
    lowest, ends, begins = [], [], []
    for stride in strides:
        phase = course.phase[stride]
        watched = (phase >= timing.clearance_from) & (phase <= timing.clearance_to)
        lowest.append(float(np.min(course.toe_height[stride][watched])))
        # A strike counts at the first sample of the stride that it begins: the landing of a swing is that after it.
        ends.append(_gain(course.toe_landings, stride) > 0.5)
        begins.append(_gain(course.toe_landings, slice(max(stride.start - 1, 0), stride.start)) > 0.5)
    clear = [height >= 0.0 and not first for height, first in zip(lowest, ends, strict=True)]
    return float(np.mean(lowest)), float(np.mean(clear)), float(np.mean(begins))


def _gain(total: Floats, part: slice) -> float:
    return float(total[min(part.stop, total.size - 1)] - total[part.start])


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))
