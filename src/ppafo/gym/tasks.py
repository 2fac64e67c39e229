"""Tasks of an agent: what it observes, what its error is, and what a command means.

Pure functions of floats, which the kernel has beside the physics.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from ppafo.control.walking.assistance import TorqueProfile, profile_torque
from ppafo.engine.rows import leaf_paths
from ppafo.model.sensors import GaitMeasurement, Measurement
from ppafo.model.valves.kind import VENT

BAR = 1.0e5
"""Pascals of a bar, the unit in which an agent sees pressures."""
GRAM = 1.0e-3
"""Kilograms of a gram, the unit in which gas is paid for."""
LOADED, UNLOADED = 60.0, 30.0
"""Force under the heel [N] above which it counts as loaded and below which it does not, as in the walking laws."""
LONGEST_SINCE = 10.0
"""Longest time since a heel strike that is observed [s]."""


class Goal(NamedTuple):
    """Goal of an episode: an angle [rad] to turn to, or the torque of a stride; each task uses its own field."""

    angle: float
    profile: TorqueProfile


class Memory(NamedTuple):
    """Gas from the supply up to the last sample [kg]; of a walk the time of the last heel strike [s], 1 if loaded."""

    supplied_mass: float
    strike: float
    loaded: float


class Requested(NamedTuple):
    """The reference of a scenario at a sample [N m], and how fast it changes [N m/s]."""

    torque: float
    rate: float


class Sensed(NamedTuple):
    """Observation common to all tasks: angle [rad], absolute pressures [bar], torque computed from them [N m]."""

    angle: float
    pressure_1: float
    pressure_2: float
    torque: float


class TorqueView(NamedTuple):
    """Observation: sensors, requested torque [N m], its rate [N m/s], last command [-]."""

    sensed: Sensed
    requested: float
    requested_rate: float
    command: float


class AngleView(NamedTuple):
    """Observation: sensors, requested angle [rad], last command [-]."""

    sensed: Sensed
    requested: float
    command: float


class WalkView(NamedTuple):
    """Observation: sensors, forces of heel and toe [N], time since the heel was loaded [s], last command [-].

    The time counts from the last strike that the heel sensor showed; a command is -1 to 1, or 2 for venting.
    """

    sensed: Sensed
    heel_force: float
    toe_force: float
    since_strike: float
    command: float


class Outcome(NamedTuple):
    """Result of a step: reward [-], error, gas from the supply so far [kg], 1 for a failed or finished episode.

    Gas counts from the begin of the episode.
    """

    reward: float
    error: float
    supplied: float
    failed: float
    through: float


def sensed_of(seen: Measurement | GaitMeasurement) -> Sensed:
    """Readings that an agent of any task is shown of a measurement."""
    return Sensed(
        angle=seen.angle, pressure_1=seen.pressure_1 / BAR, pressure_2=seen.pressure_2 / BAR, torque=seen.torque
    )


def view_torque(
    seen: Measurement, goal: Goal, memory: Memory, wanted: Requested, command: float, time: float
) -> TorqueView:
    """Observation while a torque is followed."""
    return TorqueView(sensed=sensed_of(seen), requested=wanted.torque, requested_rate=wanted.rate, command=command)


def view_angle(
    seen: Measurement, goal: Goal, memory: Memory, wanted: Requested, command: float, time: float
) -> AngleView:
    """Observation while the vane turns to an angle."""
    return AngleView(sensed=sensed_of(seen), requested=goal.angle, command=command)


def view_walk(
    seen: GaitMeasurement, goal: Goal, memory: Memory, wanted: Requested, command: float, time: float
) -> WalkView:
    """Readings that an agent is shown at a time [s] of a walk."""
    return WalkView(
        sensed=sensed_of(seen),
        heel_force=seen.heel_force,
        toe_force=seen.toe_force,
        since_strike=time - memory.strike,
        command=command,
    )


def remember(memory: Memory, supplied_mass: float, seen: Measurement, time: float) -> Memory:
    """The memory after a sample, with the gas [kg] that the supply has given by then."""
    return Memory(supplied_mass, memory.strike, memory.loaded)


def remember_strike(memory: Memory, supplied_mass: float, seen: GaitMeasurement, time: float) -> Memory:
    """The memory of a walk after a sample, where the heel sensor shows a force [N] at a time [s]."""
    # Two thresholds, so that noise about one of them is not counted as a row of strikes.
    strikes = (memory.loaded < 0.5) & (seen.heel_force > LOADED)
    stays = 0.0 if seen.heel_force < UNLOADED else memory.loaded
    return Memory(supplied_mass, time if strikes else memory.strike, 1.0 if strikes else stays)


def torque_error(goal: Goal, wanted: Requested, angle: float, phase: float, torque: float) -> float:
    """Error of the torque [N m]: requested less true."""
    return wanted.torque - torque


def angle_error(goal: Goal, wanted: Requested, angle: float, phase: float, torque: float) -> float:
    """Error of the angle [rad]: requested less true."""
    return goal.angle - angle


def stride_error(goal: Goal, wanted: Requested, angle: float, phase: float, torque: float) -> float:
    """Torque of the profile at a phase of the true stride, in turns, less the true torque [N m]."""
    return profile_torque(goal.profile, phase) - torque


def reward_of(error: float, gas: float, error_weight: float, gas_weight: float, period: float) -> float:
    """Reward of a sample: less the squared error over a period [s] and gas [kg], each times its weight."""
    return -(error_weight * error * error * period + gas_weight * (gas / GRAM))


def finite(value: float) -> float:
    """The value, 0 where it is not finite: an agent can use nothing of a run that failed."""
    return value if value - value == 0.0 else 0.0  # inf - inf and nan - nan are nan


def within(value: float, lowest: float, highest: float) -> float:
    """The value between two bounds, the lowest one for nan: a converter shows nothing else."""
    above = value if value >= lowest else lowest
    return above if above <= highest else highest


def valve_command(action: float, other: float) -> float:
    """Command from -1 to 1 of an action; the other one is not used."""
    return within(action, -1.0, 1.0)


def valve_or_vent(action: float, other: float) -> float:
    """Command from -1 to 1, or ``VENT`` where the other action is above 0."""
    return VENT if other > 0.0 else within(action, -1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Task:
    """A task: what is observed, and what its error is.

    ``view`` has the observed numbers. ``observed(seen, goal, memory, wanted, command, time)`` makes one of them,
    ``error(goal, wanted, angle, phase, torque)`` the error, ``kept(memory, supplied_mass, seen, time)`` the memory.
    ``unit`` is the unit of the error. ``command(action, other)`` makes the command of an action of ``actions`` numbers.
    """

    name: str
    view: type
    observed: Callable[[Any, Goal, Memory, Requested, float, float], Any]
    error: Callable[[Goal, Requested, float, float, float], float]
    kept: Callable[[Memory, float, Any, float], Memory]
    unit: str
    error_weight: float
    gas_weight: float
    command: Callable[[float, float], float] = valve_command
    actions: int = 1

    @property
    def observed_paths(self) -> list[str]:
        """Paths of the observed numbers, in order, such as ``view.sensed.angle``."""
        return leaf_paths(self.view, "view")


TASKS = {
    task.name: task
    for task in (
        Task("torque", TorqueView, view_torque, torque_error, remember, "N m", 1.0, 1.0),
        Task("angle", AngleView, view_angle, angle_error, remember, "rad", 10.0, 1.0),
        Task("walk", WalkView, view_walk, stride_error, remember_strike, "N m", 1.0, 1.0, valve_or_vent, 2),
    )
}
"""Tasks by the name with which an environment is made."""
