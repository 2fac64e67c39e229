"""Common part of single and vector environments: settings, spaces and episodes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from ppafo.control.walking.assistance import TorqueProfile
from ppafo.engine.lanes import Clock, Floats
from ppafo.engine.program import Program
from ppafo.engine.rows import numbers
from ppafo.engine.run import batch_of
from ppafo.errors import ScenarioError, SimulationError
from ppafo.gym.lanes import BatchStep, Environments, EpisodeStarts, FromOutside, Places, RewardWeights, episode_program
from ppafo.gym.scenario_episodes import Ranges, ScenarioEpisodes, scenario_episodes
from ppafo.gym.tasks import BAR, LONGEST_SINCE, TASKS, Goal, Task
from ppafo.model.controlled import TORQUE
from ppafo.parameters.device import Device
from ppafo.parameters.overrides import over
from ppafo.plugins import Plugins, name_plugins
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import LARGEST_SEED, Scenario
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.person import draw_people
from ppafo.walking.planning import batch_of_many, plan_walk
from ppafo.walking.walk import lasting
from ppafo.wording import known_names, nearest_name


@dataclass(frozen=True, slots=True)
class _WalkEpisodes:
    """Episodes of a walk with external commands; ``randomise`` draws wearer and gait of each episode."""

    base: Scenario
    commanded: Scenario
    program: Program
    clock: Clock
    randomise: bool
    plain: EpisodeStarts

    def draw(self, generators: Sequence[np.random.Generator]) -> tuple[EpisodeStarts, Floats]:
        """Draw an episode for each generator; the second value is empty, because a wearer is not a list of numbers."""
        columns = self.plain.repeated(len(generators))
        for number, generator in enumerate(generators if self.randomise else ()):
            # Person 0 of a population is always the one of the configuration; the second one is drawn.
            seed = float(generator.integers(0, LARGEST_SEED))
            drawn = replace(self.commanded, sensors=replace(self.commanded.sensors, seed=int(seed)))
            batch = batch_of_many(drawn, draw_people(walk_of(self.base).gait, 2, generator))
            columns.parameters[:, number], columns.states[:, number] = batch.parameters[:, 1], batch.states[:, 1]
        return columns, np.zeros((0, len(generators)))

    def shown(self, drawn: Floats) -> Scenario:  # noqa: ARG002 - a wearer is no list of numbers
        """Return the walk of the configuration, before any draw."""
        return self.base


def walk_episodes(configuration: Scenario, randomise: bool, seconds: float) -> _WalkEpisodes:
    """Return the episodes of a walk of a given length [s]; the controller's profile is the requested torque.

    Raises ScenarioError for a walk with a task sequence or a bottle, or with a controller without a profile.
    """
    for name in ("task_sequence", "bottle"):
        if getattr(walk_of(configuration), name) is not None:
            raise ScenarioError(f"{configuration.origin.file}: {name}: not supported in an environment; omit this key")
    settings = configuration.controller.settings
    if not set(TorqueProfile._fields) <= set(settings):
        kind = configuration.controller.kind
        raise ScenarioError(
            f"{configuration.origin.file}: an environment needs a torque profile, which controller.kind = '{kind}' "
            "does not have; use controller.kind = 'event_pid' with a proportional valve"
        )
    goal = Goal(angle=0.0, profile=TorqueProfile(**{name: settings[name] for name in TorqueProfile._fields}))
    commanded = with_duration(configuration, seconds).controlled_by(FromOutside())
    batch = batch_of(plan_walk(commanded))
    program, clock = episode_program(batch)
    plain = EpisodeStarts(batch.parameters, batch.states, np.array([numbers(goal)]).T)
    # Nothing is recorded between two samples: an agent sees what is observed.
    return _WalkEpisodes(configuration, commanded, program, replace(clock, record_every=0), randomise, plain)


FLAWED_SENSORS = (
    "sensors.delay=3 ms",
    "sensors.angle_noise=0.2 deg",
    "sensors.pressure_noise=0.1 psi_d",
    "sensors.angle_resolution=0.1 deg",
    "sensors.pressure_resolution=0.05 psi_d",
)
"""Default sensor errors of a scenario: delay, noise and resolution, as in torque-task-slow-valve."""
FLAWED_WALK_SENSORS = (
    *FLAWED_SENSORS[1:],
    "sensors.force_noise=5 N",
    "sensors.force_resolution=1 N",
    *(
        f"faults.{sensor}.{setting}"
        for sensor in ("heel", "toe", "angle", "pressure_1", "pressure_2")
        for setting in ("kind=distorted", "time=0 s", "delay=3 ms")
    ),
)
"""Default sensor errors of a walk; the delay is a fault that starts at time 0."""
DEFAULTS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "torque": ("torque-task-proportional", FLAWED_SENSORS),
    "angle": (
        "step-response",
        ("motion.kind=free", "controller.rate=1 kHz", "run.duration=1 s", *FLAWED_SENSORS),
    ),
    "walk": ("proportional", FLAWED_WALK_SENSORS),
}
"""Default scenario or walk of each task, with overrides."""
VARIED: Mapping[str, Ranges] = {"torque": {"reference.level": ("1 N m", "4.5 N m")}}
"""Default ranges drawn by task, in addition to the intervals of the parameter set."""
TARGETS = ("40 deg", "110 deg")
WALKING_TIME = 6.0
"""Length of a walking episode [s]."""
CONTINUOUS, ON_OFF = "continuous", "on_off"
PHYSICAL, SCALED = "physical", "scaled"
COMMANDS = 3
"""Number of commands of a pair of on/off valves: -1, 0 and 1."""
LARGEST_RATE, LARGEST_FORCE = 1.0e3, 5.0e3
"""Bounds of the observed rate of requested torque [N m/s], and of observed forces [N]."""
HEADROOM = 2.0
"""Ratio of the largest observed pressure to the highest of supply and atmosphere [-]; motion compresses gas."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _EnvironmentSettings:
    """Settings of an environment besides its task, documented in ``PneumaticEnv``."""

    scenario: str | Path | None = None
    overrides: Sequence[str] = ()
    actions: str = CONTINUOUS
    randomise: bool = True
    vary: Ranges | None = None
    targets: tuple[str, str] = TARGETS
    duration: float | None = None
    error_weight: float | None = None
    gas_weight: float | None = None
    frame_skip: int = 1
    observations: str = PHYSICAL
    plugins: Plugins | str | Path = ()

    def __post_init__(self) -> None:
        # Before a scenario is loaded that names what is in them.
        name_plugins(self.plugins)
        allowed_words = {"actions": (CONTINUOUS, ON_OFF), "observations": (PHYSICAL, SCALED)}
        for name, allowed in allowed_words.items():
            word = getattr(self, name)
            if word not in allowed:
                hint = nearest_name(word, allowed)
                raise ScenarioError(f"{name} = {word!r}: must be '{allowed[0]}' or '{allowed[1]}'{hint}")
        if self.vary and not self.randomise:
            raise ScenarioError("vary: has no effect with randomise = False; omit one of them")
        if not (isinstance(self.frame_skip, int) and self.frame_skip >= 1):
            raise ScenarioError(f"frame_skip = {self.frame_skip!r}: must be a whole number of at least 1")


def settings_of(arguments: Mapping[str, Any]) -> _EnvironmentSettings:
    """Return settings from keyword arguments. Raises ScenarioError for an unknown name."""
    names = [field.name for field in fields(_EnvironmentSettings)]
    for name in arguments:
        if name not in names:
            raise ScenarioError(f"an environment has no argument '{name}'{known_names(name, names)}")
    return _EnvironmentSettings(**arguments)


def episodes_of(
    task: str, file: str | Path, overrides: Sequence[str], varied: Ranges, settings: _EnvironmentSettings
) -> ScenarioEpisodes | _WalkEpisodes:
    """Return the episodes of a task in a scenario or walk. Raises ScenarioError if they do not fit together."""
    duration = settings.duration
    if task == "walk":
        if varied:
            raise ScenarioError(
                f"vary: {', '.join(varied)}: cannot be varied, because a walk varies only wearer and gait; omit vary"
            )
        walk = load_walk(file, overrides)
        seconds = lasting(walk, (WALKING_TIME if duration is None else duration) / 60.0).run.duration
        return walk_episodes(walk, settings.randomise, seconds)
    length = () if duration is None else (f"run.duration={float(duration)!r} s",)
    scenario = load_scenario(file, over(overrides, length, ScenarioError))
    if task == "torque" and scenario.controlled != TORQUE:
        raise ScenarioError(
            f"{scenario.name}: reference.of = '{scenario.controlled}', but the task 'torque' needs a torque "
            "reference; choose another scenario, or the task 'angle'"
        )
    return scenario_episodes(scenario, settings.randomise, varied, settings.targets)


class World:
    """Common part of single and vector environments: episodes, spaces, and creation of environments."""

    def __init__(self, task: str, settings: _EnvironmentSettings) -> None:
        self.settings = settings
        self.task = TASKS[task]
        default_file, flaws = DEFAULTS[task]
        is_default = settings.scenario is None
        file = default_file if settings.scenario is None else settings.scenario
        overrides = over(flaws if is_default else (), settings.overrides, ScenarioError)
        varied = VARIED.get(task, {}) if settings.vary is None and is_default else settings.vary or {}
        self.episodes = episodes_of(task, file, overrides, varied, settings)
        self.observed = tuple(self.task.observed_rows(self.episodes.program.has_one_chamber))
        bounds = observed_bounds(self.task, self.observed, self.episodes.base.device)
        self.judging = RewardWeights(
            error_weight=self.task.error_weight if settings.error_weight is None else settings.error_weight,
            gas_weight=self.task.gas_weight if settings.gas_weight is None else settings.gas_weight,
            bounds=bounds,
        )
        self.observation_space = gymnasium.spaces.Box(*bounds.astype(np.float32), dtype=np.float32)
        self._middle, self._half = 0.5 * (bounds[0] + bounds[1]), 0.5 * (bounds[1] - bounds[0])
        self.is_scaled = settings.observations == SCALED
        if self.is_scaled:
            self.observation_space = gymnasium.spaces.Box(-1.0, 1.0, bounds.shape[1:], np.float32)
        self.is_continuous = settings.actions == CONTINUOUS
        self.action_space: Any = gymnasium.spaces.Discrete(COMMANDS)
        if self.is_continuous:
            self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (self.task.actions,), np.float32)

    def __reduce__(self) -> "tuple[type[World], tuple[str, _EnvironmentSettings]]":
        """Reduce to task and settings for pickle; programs are compiled again."""
        return World, (self.task.name, self.settings)

    def __copy__(self) -> "World":
        """Return the object itself, which is immutable."""
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> "World":
        """Return the object itself; an environment copies its spaces with their generators separately."""
        return self

    def lanes(self, count: int) -> Environments:
        """Create ``count`` environments of the program."""
        return Environments(self.episodes.program, self.episodes.clock, self.task, count, self.judging)

    def begin(
        self, lanes: Environments, places: Places, generators: Sequence[np.random.Generator]
    ) -> tuple[BatchStep, Floats]:
        """Draw and start episodes of some environments; return the observations of all, and the drawn numbers."""
        columns, drawn = self.episodes.draw(generators)
        return self._scaled(lanes.begin(places, columns)), drawn

    def act(self, lanes: Environments, actions: Any) -> BatchStep:
        """Apply actions for ``frame_skip`` samples, or up to the end of an episode; rewards are summed.

        Raises SimulationError for an action that is not finite.
        """
        numbers_of_actions = lanes.actions
        if self.is_continuous:
            numbers_of_actions[:] = np.reshape(actions, numbers_of_actions.shape)
        else:
            # Vent valve first: where there is none, the last column is the command, which the next line sets.
            numbers_of_actions[:, -1] = 0.0
            numbers_of_actions[:, 0] = np.subtract(actions, 1)
        bad = np.flatnonzero(~np.isfinite(numbers_of_actions).all(axis=1))
        if bad.size:
            raise SimulationError(f"action of environment {bad[0]} is {numbers_of_actions[bad[0]]}: must be finite")
        result = lanes.step()
        for _ in range(self.settings.frame_skip - 1):
            result = result.then(lanes.step())
        return self._scaled(result)

    def _scaled(self, result: BatchStep) -> BatchStep:
        """Scale the observations of a result to -1 to 1, if requested."""
        if self.is_scaled:
            result.observations[:] = np.clip((result.observations - self._middle) / self._half, -1.0, 1.0)
        return result


def observed_bounds(task: Task, names: Sequence[str], device: Device) -> Floats:
    """Return lowest and highest value of each observation (2, observed), in the units of the task's view."""
    pressure = HEADROOM * max(
        device.supply.pressure, device.supply.dorsiflexion_pressure, device.supply.atmospheric_pressure
    )
    torque = device.actuator.torque_constant * pressure
    known = {
        "angle": (-np.pi, np.pi),
        "pressure_1": (0.0, pressure / BAR),
        "pressure_2": (0.0, pressure / BAR),
        "torque": (-torque, torque),
        "requested": (-torque, torque) if task.unit == "N m" else (-np.pi, np.pi),
        "requested_rate": (-LARGEST_RATE, LARGEST_RATE),
        "heel_force": (0.0, LARGEST_FORCE),
        "toe_force": (0.0, LARGEST_FORCE),
        "since_strike": (0.0, LONGEST_SINCE),
        "command": (-1.0, 2.0),
    }
    # Rounded as the space has them, so that what is cut off at a bound lies within it.
    return np.array([known[name] for name in names], dtype=np.float32).T.astype(np.float64, order="C")
