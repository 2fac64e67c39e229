"""Tasks of an agent: observation, error, and conversion of actions to commands.

All are pure functions of floats, which the kernel compiles together with the physics.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from ppafo.control.walking.assistance import TorqueProfile, profile_torque
from ppafo.engine.rows import leaf_paths
from ppafo.model.sensors import GaitMeasurement, Measurement
from ppafo.model.valves.kind import VENT
from ppafo.signals.recording import OF_SECOND_CHAMBER

BAR = 1.0e5
"""Pascals per bar, the unit of observed pressures."""
GRAM = 1.0e-3
"""Kilograms per gram, the unit of gas in the reward."""
LOADED, UNLOADED = 60.0, 30.0
"""Heel forces [N]: a heel counts as loaded above the first, and as unloaded below the second."""
LONGEST_SINCE = 10.0
"""Upper bound of the observed time since heel strike [s]."""


class Goal(NamedTuple):
    """Goal of an episode: target angle [rad], or torque profile of a stride; a task uses one field."""

    angle: float
    profile: TorqueProfile


class Memory(NamedTuple):
    """Memory between samples: supplied gas [kg]; in a walk time of heel strike [s], and 1 for a loaded heel."""

    supplied_mass: float
    strike: float
    loaded: float


class Requested(NamedTuple):
    """Requested torque of a scenario at a sample [N m], and its rate [N m/s]."""

    torque: float
    rate: float


class Sensed(NamedTuple):
    """Observation common to all tasks: angle [rad], absolute pressures [bar], torque from the pressures [N m]."""

    angle: float
    pressure_1: float
    pressure_2: float
    torque: float


class _TorqueView(NamedTuple):
    """Observation of the torque task: sensors, requested torque [N m], its rate [N m/s], last command [-]."""

    sensed: Sensed
    requested: float
    requested_rate: float
    command: float


class _AngleView(NamedTuple):
    """Observation of the angle task: sensors, requested angle [rad], last command [-]."""

    sensed: Sensed
    requested: float
    command: float


class _WalkView(NamedTuple):
    """Observation of the walking task: sensors, heel and toe force [N], time since heel strike [s], last command [-].

    Heel strikes are detected by the heel sensor. The command is -1 to 1, or 2 for venting.
    """

    sensed: Sensed
    heel_force: float
    toe_force: float
    since_strike: float
    command: float


class Outcome(NamedTuple):
    """Outcome of a step: reward [-], error, supplied gas [kg], and flags (1 or 0) for a failed or finished episode.

    The gas is since the start of the episode.
    """

    reward: float
    error: float
    supplied: float
    failed: float
    through: float


def sensed_of(seen: Measurement | GaitMeasurement) -> Sensed:
    """Return the sensor readings common to all tasks."""
    return Sensed(
        angle=seen.angle, pressure_1=seen.pressure_1 / BAR, pressure_2=seen.pressure_2 / BAR, torque=seen.torque
    )


def view_torque(
    seen: Measurement, goal: Goal, memory: Memory, wanted: Requested, command: float, time: float
) -> _TorqueView:
    """Return the observation of the torque task."""
    return _TorqueView(sensed=sensed_of(seen), requested=wanted.torque, requested_rate=wanted.rate, command=command)


def view_angle(
    seen: Measurement, goal: Goal, memory: Memory, wanted: Requested, command: float, time: float
) -> _AngleView:
    """Return the observation of the angle task."""
    return _AngleView(sensed=sensed_of(seen), requested=goal.angle, command=command)


def view_walk(
    seen: GaitMeasurement, goal: Goal, memory: Memory, wanted: Requested, command: float, time: float
) -> _WalkView:
    """Return the observation of the walking task at a time [s]."""
    return _WalkView(
        sensed=sensed_of(seen),
        heel_force=seen.heel_force,
        toe_force=seen.toe_force,
        since_strike=time - memory.strike,
        command=command,
    )


def remember(memory: Memory, supplied_mass: float, seen: Measurement, time: float) -> Memory:
    """Update the memory with the gas supplied so far [kg]."""
    return Memory(supplied_mass, memory.strike, memory.loaded)


def remember_strike(memory: Memory, supplied_mass: float, seen: GaitMeasurement, time: float) -> Memory:
    """Update the memory of a walk; a heel strike is detected from the heel force [N]."""
    # Two thresholds, so that noise about one of them is not counted as a row of strikes.
    strikes = (memory.loaded < 0.5) & (seen.heel_force > LOADED)
    stays = 0.0 if seen.heel_force < UNLOADED else memory.loaded
    return Memory(supplied_mass, time if strikes else memory.strike, 1.0 if strikes else stays)


def torque_error(goal: Goal, wanted: Requested, angle: float, phase: float, torque: float) -> float:
    """Torque error of the torque task [N m]: requested minus true torque."""
    return wanted.torque - torque


def angle_error(goal: Goal, wanted: Requested, angle: float, phase: float, torque: float) -> float:
    """Angle error of the angle task [rad]: requested minus true angle."""
    return goal.angle - angle


def stride_error(goal: Goal, wanted: Requested, angle: float, phase: float, torque: float) -> float:
    """Torque error of the walking task [N m]: profile torque at the true stride phase, minus true torque."""
    return profile_torque(goal.profile, phase) - torque


def reward_of(error: float, gas: float, error_weight: float, gas_weight: float, period: float) -> float:
    """Reward of a sample: minus the weighted squared error times the period [s], minus the weighted gas mass [kg]."""
    return -(error_weight * error * error * period + gas_weight * (gas / GRAM))


def finite(value: float) -> float:
    """Return a value, or 0 if it is not finite, as in a failed run."""
    return value if value - value == 0.0 else 0.0  # inf - inf and nan - nan are nan


def within(value: float, lowest: float, highest: float) -> float:
    """Clip a value to two bounds, as a converter does; nan becomes the lower bound."""
    above = value if value >= lowest else lowest
    return above if above <= highest else highest


def valve_command(action: float, other: float) -> float:
    """Convert an action to a valve command from -1 to 1; ``other`` is ignored."""
    return within(action, -1.0, 1.0)


def valve_or_vent(action: float, other: float) -> float:
    """Convert an action to a valve command from -1 to 1, or ``VENT`` if ``other`` is positive."""
    return VENT if other > 0.0 else within(action, -1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Task:
    """Task of an agent in the catalogue: observation, error, memory, reward weights and actions.

    ``view`` is the class of the observation. ``observed(seen, goal, memory, wanted, command, time)`` returns an
    observation, ``error(goal, wanted, angle, phase, torque)`` the error in ``unit``, ``kept(memory, supplied_mass,
    seen, time)`` the updated memory. ``error_weight`` and ``gas_weight`` are the default weights of the reward.
    ``command(action, other)`` returns the command of an action of ``actions`` numbers.
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

    def observed_rows(self, has_one_chamber: bool) -> dict[str, int]:
        """Rows of the observed numbers in ``view`` by name, such as ``angle``, without those of an absent chamber 2."""
        names = [path.rpartition(".")[2] for path in leaf_paths(self.view, "view")]
        absent = OF_SECOND_CHAMBER if has_one_chamber else frozenset()
        return {name: row for row, name in enumerate(names) if name not in absent}


TASKS = {
    task.name: task
    for task in (
        Task("torque", _TorqueView, view_torque, torque_error, remember, "N m", 1.0, 1.0),
        Task("angle", _AngleView, view_angle, angle_error, remember, "rad", 10.0, 1.0),
        Task("walk", _WalkView, view_walk, stride_error, remember_strike, "N m", 1.0, 1.0, valve_or_vent, 2),
    )
}
"""Catalogue of tasks by name."""
