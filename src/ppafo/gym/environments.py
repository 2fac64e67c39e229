"""The environments as Gymnasium has them: one, or many side by side."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ppafo.engine.lanes import Floats
from ppafo.errors import ScenarioError, SimulationError, nearest_name
from ppafo.gym.episodes import (
    Environments,
    Flags,
    Judging,
    Places,
    Ranges,
    ScenarioEpisodes,
    Seen,
    WalkEpisodes,
    scenario_episodes,
    walk_episodes,
)
from ppafo.gym.pictures import picture
from ppafo.gym.tasks import BAR, LONGEST_SINCE, TASKS, Task
from ppafo.model.controlled import TORQUE
from ppafo.parameters.device import Device
from ppafo.parameters.overrides import over
from ppafo.plugins import Plugins, name_plugins
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario
from ppafo.walking.loading import load_walk
from ppafo.walking.walk import lasting

FLAWED_SENSORS = (
    "sensors.delay=3 ms",
    "sensors.angle_noise=0.2 deg",
    "sensors.pressure_noise=0.1 psi_d",
    "sensors.angle_resolution=0.1 deg",
    "sensors.pressure_resolution=0.05 psi_d",
)
"""Delay, noise and resolution of the sensors of the scenario torque-task-slow-valve."""
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
"""Late from the beginning, which is a fault with a delay and nothing else."""
DEFAULTS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "torque": ("torque-task-proportional", FLAWED_SENSORS),
    "angle": (
        "step-response",
        ("motion.kind=free", "controller.rate=1 kHz", "run.duration=1 s", *FLAWED_SENSORS),
    ),
    "walk": ("proportional", FLAWED_WALK_SENSORS),
}
"""Scenario or walk of each task where none is given, and the overrides that make it."""
VARIED: Mapping[str, Ranges] = {"torque": {"reference.level": ("1 N m", "4.5 N m")}}
"""What is drawn in these beside what the parameter set has intervals for."""
TARGETS = ("40 deg", "110 deg")
WALKING_TIME = 6.0
"""Length of an episode on a leg that walks [s]."""
CONTINUOUS, ON_OFF = "continuous", "on_off"
PHYSICAL, SCALED = "physical", "scaled"
PICTURE = "rgb_array"
COMMANDS = 3
"""Of a pair of on/off valves: -1, 0 and 1."""
LARGEST_RATE, LARGEST_FORCE = 1.0e3, 5.0e3
"""Bounds of the requested rate [N m/s] and of the forces [N] that are observed."""
HEADROOM = 2.0
"""Largest pressure that is observed, over the highest supply pressure: a vane that is turned compresses its gas."""

Observations = np.ndarray[Any, np.dtype[np.float32]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What environments are made with beside their task; ``PneumaticEnv`` says what each is."""

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
        _check_word("actions", self.actions, (CONTINUOUS, ON_OFF))
        _check_word("observations", self.observations, (PHYSICAL, SCALED))
        if not (isinstance(self.frame_skip, int) and self.frame_skip >= 1):
            raise ScenarioError(f"frame_skip = {self.frame_skip!r}: must be a whole number of samples, at least 1")


def _check_word(name: str, word: Any, allowed: tuple[str, str]) -> None:
    if word not in allowed:
        hint = nearest_name(word, allowed)
        raise ScenarioError(f"{name} = {word!r}: must be '{allowed[0]}' or '{allowed[1]}'{hint}")


def settings_of(arguments: Mapping[str, Any]) -> Settings:
    """Return settings by name; ScenarioError for a name that is none."""
    names = [field.name for field in fields(Settings)]
    for name in arguments:
        if name not in names:
            hint = nearest_name(name, names)
            raise ScenarioError(f"an environment has no argument '{name}'{hint}; it has {', '.join(names)}")
    return Settings(**arguments)


def _torque_episodes(file: str | Path, words: Sequence[str], varied: Ranges, settings: Settings) -> ScenarioEpisodes:
    chosen = _scenario(file, words, settings.duration)
    if chosen.controlled != TORQUE:
        raise ScenarioError(
            f"{chosen.name}: reference.of = '{chosen.controlled}': the task 'torque' follows a torque; take "
            "another scenario, or the task 'angle'"
        )
    return scenario_episodes(chosen, settings.randomise, varied, settings.targets)


def _angle_episodes(file: str | Path, words: Sequence[str], varied: Ranges, settings: Settings) -> ScenarioEpisodes:
    chosen = _scenario(file, words, settings.duration)
    return scenario_episodes(chosen, settings.randomise, varied, settings.targets)


def _scenario(file: str | Path, words: Sequence[str], duration: float | None) -> Scenario:
    own = () if duration is None else (f"run.duration={float(duration)!r} s",)
    return load_scenario(file, over(words, own, ScenarioError))


def _walk_episodes(file: str | Path, words: Sequence[str], varied: Ranges, settings: Settings) -> WalkEpisodes:
    if varied:
        raise ScenarioError(f"vary: {', '.join(varied)}: a walk draws wearers and gaits, and no numbers")
    walk, duration = load_walk(file, words), settings.duration
    seconds = lasting(walk, (WALKING_TIME if duration is None else duration) / 60.0).run.duration
    return walk_episodes(walk, settings.randomise, seconds)


_EPISODES: Mapping[str, Callable[[str | Path, Sequence[str], Ranges, Settings], ScenarioEpisodes | WalkEpisodes]] = {
    "torque": _torque_episodes,
    "angle": _angle_episodes,
    "walk": _walk_episodes,
}
"""What the episodes of each task are drawn from."""


class World:
    """What one environment and many have in common: episodes, spaces, and lanes for as many as are asked for."""

    def __init__(self, task: str, settings: Settings) -> None:
        self.settings = settings
        self.task = TASKS[task]
        usual, flaws = DEFAULTS[task]
        is_usual = settings.scenario is None
        file = usual if settings.scenario is None else settings.scenario
        words = over(flaws if is_usual else (), settings.overrides, ScenarioError)
        varied = VARIED.get(task, {}) if settings.vary is None and is_usual else settings.vary or {}
        self.episodes = _EPISODES[task](file, words, varied, settings)
        bounds = observed_bounds(self.task, self.episodes.base.device)
        self.judging = Judging(
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

    def __reduce__(self) -> "tuple[type[World], tuple[str, Settings]]":
        """Pickle by what it was made of: programs and what they are compiled to are found again."""
        return World, (self.task.name, self.settings)

    def __copy__(self) -> "World":
        """Return this world itself: nothing in it changes from step to step."""
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> "World":
        """Return this world itself: an environment copies its spaces, with their generators, on its own."""
        return self

    def lanes(self, count: int) -> Environments:
        """Return lanes for some environments."""
        return Environments(self.episodes.program, self.episodes.clock, self.task, count, self.judging)

    def begin(
        self, lanes: Environments, places: Places, generators: Sequence[np.random.Generator]
    ) -> tuple[Seen, Floats]:
        """Draw and begin episodes of some environments; return what is seen of all, and what was drawn."""
        columns, drawn = self.episodes.draw(generators)
        return self._shown(lanes.begin(places, columns)), drawn

    def take(self, lanes: Environments, actions: Any) -> Seen:
        """Return what follows from actions that are held for ``frame_skip`` samples, or to the end of an episode.

        Rewards are added up. SimulationError for an action that is no finite number.
        """
        taken = lanes.actions
        if self.is_continuous:
            taken[:] = np.reshape(actions, taken.shape)
        else:
            # Vent valve first: where there is none, the last column is the command, which the next line sets.
            taken[:, -1] = 0.0
            taken[:, 0] = np.subtract(actions, 1)
        if not np.isfinite(taken).all():
            bad = int(np.flatnonzero(~np.isfinite(taken).all(axis=1))[0])
            raise SimulationError(f"the action of environment {bad} is {taken[bad]}; it must be finite")
        seen = lanes.step()
        for _ in range(self.settings.frame_skip - 1):
            seen = seen.then(lanes.step())
        return self._shown(seen)

    def _shown(self, seen: Seen) -> Seen:
        if self.is_scaled:
            seen.observations[:] = np.clip((seen.observations - self._middle) / self._half, -1.0, 1.0)
        return seen


def observed_bounds(task: Task, device: Device) -> Floats:
    """Lowest and highest value (2, observed) of each observed number, in the units of the task's view."""
    pressure = HEADROOM * max(device.supply.pressure, device.supply.dorsiflexion_pressure)
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
    names = [path.rpartition(".")[2] for path in task.observed_paths]
    # Rounded as the space has them, so that what is cut off at a bound lies within it.
    return np.array([known[name] for name in names], dtype=np.float32).T.astype(np.float64, order="C")


class PneumaticEnv(gymnasium.Env[Observations, Any]):
    """One device that an agent commands, one step every sample period of its scenario or walk.

    ``task`` is 'torque', 'angle' or 'walk'; ``scenario`` the name or file of a scenario, or of a walk, and
    ``overrides`` change it: of the task's own, with late, noisy sensors with steps, unless one is given. ``actions``
    are 'continuous', a command from -1 to 1 (and on a leg that walks one above 0 for the vent valve), or 'on_off', 0
    to 2 for commands of -1, 0 and 1. ``randomise`` draws each episode: what the parameter set has an interval for,
    what ``vary`` gives lowest and highest values for, by path, the seed of the noise, an angle in ``targets``; or the
    wearer and the gait of a walk. ``duration`` of an episode [s]. The reward of a sample is
    -(error_weight error^2 period + gas_weight gas), in N m or rad, s and g. An action is held for ``frame_skip``
    samples, whose rewards are added up. ``observations`` are 'physical', or 'scaled' between -1 and 1. With
    ``render_mode`` 'rgb_array' an episode can be shown as a picture. ``plugins`` are modules of your own, files or
    names, whose objects files may name. ScenarioError or ParameterError for bad input.
    """

    metadata: dict[str, Any] = {"render_modes": [PICTURE], "render_fps": 25}  # noqa: RUF012 - Gymnasium's own declaration

    def __init__(self, task: str, render_mode: str | None = None, **settings: Any) -> None:
        if render_mode not in (None, PICTURE):
            raise ScenarioError(f"render_mode = {render_mode!r}: must be '{PICTURE}' or None")
        self.world = World(task, settings_of(settings))
        self.observation_space, self.action_space = self.world.observation_space, self.world.action_space
        self.render_mode = render_mode
        self._drawn: Floats | None = None
        self._lanes = self.world.lanes(1)
        self._period = 0.0
        self._trail: list[tuple[float, float, float]] = []

    def __getstate__(self) -> dict[str, Any]:
        """Return what a pickle keeps: the world as it was made, and the state of its lane."""
        return {**vars(self), "_lanes": self._lanes.state()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Go on from a state: with the lane itself in a copy, from what it held in a pickle."""
        self.__dict__.update(state)
        if isinstance(self._lanes, Mapping):
            held, self._lanes = self._lanes, self.world.lanes(1)
            self._lanes.resume(held)

    def reset(
        self,
        *,
        seed: int | None = None,
        options: dict[str, Any] | None = None,  # noqa: ARG002 - Gymnasium's own signature
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin an episode; return what is observed at its start, and nothing else. There are no ``options``."""
        super().reset(seed=seed)
        seen, drawn = self.world.begin(self._lanes, np.zeros(1, dtype=np.intp), [self.np_random])
        self._drawn = drawn[:, 0]
        self._trail = []
        if self.render_mode is not None:
            self._period = self.episode().controller.period * self.world.settings.frame_skip
            self._remember(float(seen.errors[0]))
        return seen.observations[0], {}

    def step(self, action: Any) -> tuple[Observations, float, bool, bool, dict[str, Any]]:
        """Return observation, reward, whether the run failed, whether it is over, error and gas [kg] after an action.

        SimulationError for one that is not finite.
        """
        seen = self.world.take(self._lanes, action)
        info = {"error": float(seen.errors[0]), "supplied_mass": float(seen.supplied[0])}
        if self.render_mode is not None:
            self._remember(info["error"])
        return (
            seen.observations[0],
            float(seen.rewards[0]),
            bool(seen.terminated[0]),
            bool(seen.truncated[0]),
            info,
        )

    def render(self) -> Any:
        """Return the episode so far as a picture (height, width, 3) of bytes; None without a render mode."""
        if self.render_mode is None:
            return None
        if not self._trail:
            raise SimulationError("there is no episode yet: call reset")
        return picture(self._trail, self.world.task.unit, self._period)

    def _remember(self, error: float) -> None:
        """Keep what a picture shows: time [s], angle [rad] and error."""
        self._trail.append((len(self._trail) * self._period, self.numbers()["state.angle"], error))

    def episode(self) -> Any:
        """Return the scenario of this episode with the numbers that were drawn, or the walk before anything is drawn.

        SimulationError before the first ``reset``.
        """
        if self._drawn is None:
            raise SimulationError("there is no episode yet: call reset")
        return self.world.episodes.shown(self._drawn)

    def numbers(self) -> dict[str, float]:
        """Return the true state in SI units, by path such as ``state.angle`` [rad]."""
        return self._lanes.numbers(0)


class PneumaticVectorEnv(VectorEnv[Observations, Any, Any]):
    """Many such devices on the lanes of one program; each goes as it would alone with its seed.

    Takes the arguments of ``PneumaticEnv``; ``autoreset_mode`` is one of Gymnasium's, or its name.
    """

    def __init__(
        self,
        num_envs: int,
        task: str,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **settings: Any,
    ) -> None:
        self.world = World(task, settings_of(settings))
        self.num_envs = num_envs
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self.autoreset_mode}
        self.single_observation_space, self.single_action_space = (
            self.world.observation_space,
            self.world.action_space,
        )
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._lanes = self.world.lanes(num_envs)
        self._generators: list[np.random.Generator | None] = [None] * num_envs
        self._ended = np.zeros(num_envs, dtype=np.bool_)
        self._last: Observations = np.zeros(self.observation_space.shape, dtype=np.float32)

    def __getstate__(self) -> dict[str, Any]:
        """Return what a pickle keeps: the world as it was made, and the state of its lanes."""
        return {**vars(self), "_lanes": self._lanes.state()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Go on from a state, on lanes of its own."""
        self.__dict__.update(state)
        if isinstance(self._lanes, Mapping):
            held, self._lanes = self._lanes, self.world.lanes(self.num_envs)
            self._lanes.resume(held)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin episodes of all, or of those that are true in ``options["reset_mask"]`` (environments,).

        A number as ``seed`` seeds the first one; the others count up from it.
        """
        mask = (options or {}).get("reset_mask", np.ones(self.num_envs, dtype=np.bool_))
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (self.num_envs,):
            raise ScenarioError(f"reset_mask must be {self.num_envs} truth values in an array")
        seeds = [seed + number for number in range(self.num_envs)] if isinstance(seed, int) else seed
        if seeds is not None and len(seeds) != self.num_envs:
            raise ScenarioError(f"{len(seeds)} seeds for {self.num_envs} environments; give one for each, or a number")
        places = np.flatnonzero(mask)
        for number in places.tolist():
            own = None if seeds is None else seeds[number]
            if own is not None or self._generators[number] is None:
                self._generators[number] = seeding.np_random(own)[0]
        observations = self._begin(places).observations
        if places.size < self.num_envs:
            observations = np.where(mask[:, None], observations, self._last)
        self._last = observations
        self._ended[places] = False
        return observations.copy(), {}

    def step(self, actions: Any) -> tuple[Observations, Floats, Flags, Flags, dict[str, Any]]:
        """Return observations, rewards, which runs failed, which are over, errors and gas [kg] after actions.

        SimulationError for one that is not finite, and without autoreset for environments that have to be reset.
        """
        before = self._ended
        if self.autoreset_mode is AutoresetMode.DISABLED and before.any():
            raise SimulationError(f"environment {int(np.flatnonzero(before)[0])} has ended: reset it by its mask")
        seen = self.world.take(self._lanes, actions)
        self._ended = seen.terminated | seen.truncated
        infos: dict[str, Any] = {}
        reset = np.zeros(self.num_envs, dtype=np.bool_)
        if self.autoreset_mode is AutoresetMode.NEXT_STEP and before.any():
            reset = before
            # A step that resets ignores its action in Gymnasium's mode: it has no reward and ends nothing.
            for values in (seen.rewards, seen.terminated, seen.truncated):
                values[reset] = 0
            self._ended = self._ended & ~reset
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._ended.any():
            reset = self._ended
            # What environments that begin again at once showed at their end.
            last = np.full(self.num_envs, None, dtype=object)
            for number in np.flatnonzero(reset):
                # A copy, because the observations of the new episode overwrite this row below.
                last[number] = seen.observations[number].copy()
            info = _masked({"error": seen.errors, "supplied_mass": seen.supplied}, reset)
            infos |= {"final_obs": last, "_final_obs": reset.copy(), "final_info": info, "_final_info": reset.copy()}
        if reset.any():
            begun = self._begin(np.flatnonzero(reset))
            seen.observations[reset] = begun.observations[reset]
        infos |= _masked({"error": seen.errors, "supplied_mass": seen.supplied}, ~reset)
        self._last = seen.observations
        return seen.observations.copy(), seen.rewards, seen.terminated, seen.truncated, infos

    def numbers(self, place: int) -> dict[str, float]:
        """Return the true state of one environment in SI units, by path such as ``state.angle`` [rad]."""
        return self._lanes.numbers(place)

    def _begin(self, places: Places) -> Seen:
        drawn = [self._generators[number] for number in places]
        return self.world.begin(self._lanes, places, [generator for generator in drawn if generator is not None])[0]


def _masked(values: Mapping[str, Floats], there: Flags) -> dict[str, Any]:
    """Return numbers (environments,) with the mask of those that have them, as Gymnasium has infos."""
    if not there.any():
        return {}
    kept = {name: np.where(there, column, 0.0) for name, column in values.items()}
    return kept | {f"_{name}": there.copy() for name in values}
