"""Gymnasium environments of the device: single environment, and vector of environments."""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ppafo.engine.lanes import Floats
from ppafo.errors import ScenarioError, SimulationError
from ppafo.gym.lanes import BatchStep, Flags, Places
from ppafo.gym.pictures import EpisodeFrame, picture
from ppafo.gym.world import World, settings_of

Observations = np.ndarray[Any, np.dtype[np.float32]]
PICTURE = "rgb_array"
"""Render mode of Gymnasium for pictures."""


def _state_of(environment: Any) -> dict[str, Any]:
    """Return the state of an environment for copies and pickle: task and settings, and the episodes."""
    return {**vars(environment), "_lanes": environment._lanes.state()}


def _resume(environment: Any, state: dict[str, Any]) -> None:
    """Restore the state of a copy or a pickle, in new lanes."""
    lane_state: Mapping[str, Any] = state["_lanes"]
    lanes = state["world"].lanes(len(lane_state["actions"]))
    lanes.resume(lane_state)
    vars(environment).update(state, _lanes=lanes)


class PneumaticEnv(gymnasium.Env[Observations, Any]):
    """Single environment: device commanded by an agent, with a step per sample period of its scenario or walk.

    ``task`` is 'torque', 'angle' or 'walk'. ``scenario`` is the name or file of a scenario or walk, changed by
    ``overrides``; by default the task's own, with delayed, noisy and quantised sensors. ``actions`` are 'continuous', a
    command from -1 to 1 (on a leg that walks with a second number, positive to open the vent valve), or 'on_off', 0 to
    2 for commands of -1, 0 and 1. ``randomise`` draws each episode: numbers with an interval in the parameter set,
    numbers with lowest and highest values in ``vary`` (by path), the seed of the noise and an angle in ``targets``; in
    a walk the wearer and the gait. ``duration`` is the length of an episode [s]. The reward of a sample is
    -(error_weight error^2 period + gas_weight gas), with the error in N m or rad, the period in s and the gas in g. An
    action applies to ``frame_skip`` samples, whose rewards are added up. ``observations`` are 'physical', or 'scaled'
    to -1 to 1; ``observed`` has the names of their numbers. With ``render_mode`` 'rgb_array' an episode can be
    rendered as a picture. ``plugins`` are modules of your own, files or names, whose objects files may name. Raises
    ScenarioError or ParameterError for bad input.
    """

    metadata: dict[str, Any] = {"render_modes": [PICTURE], "render_fps": 25}  # noqa: RUF012 - Gymnasium's own declaration

    def __init__(self, task: str, render_mode: str | None = None, **settings: Any) -> None:
        if render_mode not in (None, PICTURE):
            raise ScenarioError(f"render_mode = {render_mode!r}: must be '{PICTURE}' or None")
        self.world = World(task, settings_of(settings))
        self.observation_space, self.action_space = self.world.observation_space, self.world.action_space
        self.observed, self.render_mode = self.world.observed, render_mode
        self._drawn: Floats | None = None
        self._lanes = self.world.lanes(1)
        self._period = 0.0
        self._frames: list[EpisodeFrame] = []

    __getstate__, __setstate__ = _state_of, _resume

    def reset(
        self,
        *,
        seed: int | None = None,
        options: dict[str, Any] | None = None,  # noqa: ARG002 - Gymnasium's own signature
    ) -> tuple[Observations, dict[str, Any]]:
        """Start an episode. Returns its first observation and an empty info; there are no ``options``."""
        super().reset(seed=seed)
        start, drawn = self.world.begin(self._lanes, np.zeros(1, dtype=np.intp), [self.np_random])
        self._drawn = drawn[:, 0]
        self._frames = []
        if self.render_mode is not None:
            self._period = self.episode().controller.period * self.world.settings.frame_skip
            self._remember(float(start.errors[0]))
        return start.observations[0], {}

    def step(self, action: Any) -> tuple[Observations, float, bool, bool, dict[str, Any]]:
        """Apply an action; return observation, reward, terminated (failed), truncated (ended), error and gas [kg].

        Raises SimulationError for an action that is not finite.
        """
        result = self.world.act(self._lanes, action)
        info = {"error": float(result.errors[0]), "supplied_mass": float(result.supplied[0])}
        if self.render_mode is not None:
            self._remember(info["error"])
        return (
            result.observations[0],
            float(result.rewards[0]),
            bool(result.terminated[0]),
            bool(result.truncated[0]),
            info,
        )

    def render(self) -> Any:
        """Return the episode so far as a picture (height, width, 3) of bytes; None without a render mode."""
        if self.render_mode is None:
            return None
        if not self._frames:
            raise SimulationError("no episode has started; call reset() first")
        return picture(self._frames, self.world.task.unit, self._period, self.world.episodes.base.device)

    def _remember(self, error: float) -> None:
        self._frames.append(EpisodeFrame(len(self._frames) * self._period, self.numbers()["state.angle"], error))

    def episode(self) -> Any:
        """Return the scenario of this episode with the drawn numbers; for a walk the walk before any draw.

        Raises SimulationError before the first ``reset``.
        """
        if self._drawn is None:
            raise SimulationError("no episode has started; call reset() first")
        return self.world.episodes.shown(self._drawn)

    def numbers(self) -> dict[str, float]:
        """Return the true state in SI units, by path such as ``state.angle`` [rad]."""
        return self._lanes.numbers(0)


class PneumaticVectorEnv(VectorEnv[Observations, Any, Any]):
    """Vector environment: devices stepped together by one program, each equal to a single environment with its seed.

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
        self.single_observation_space = self.world.observation_space
        self.single_action_space, self.observed = self.world.action_space, self.world.observed
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._lanes = self.world.lanes(num_envs)
        self._generators: list[np.random.Generator | None] = [None] * num_envs
        self._ended = np.zeros(num_envs, dtype=np.bool_)
        self._last: Observations = np.zeros(self.observation_space.shape, dtype=np.float32)

    __getstate__, __setstate__ = _state_of, _resume

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Start episodes of all environments, or of those marked in ``options["reset_mask"]`` (environments,).

        A number as ``seed`` is the seed of the first environment; the others get the following numbers.
        """
        mask = (options or {}).get("reset_mask", np.ones(self.num_envs, dtype=np.bool_))
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (self.num_envs,):
            raise ScenarioError(f"reset_mask: must be an array of {self.num_envs} booleans")
        seeds = [seed + number for number in range(self.num_envs)] if isinstance(seed, int) else seed
        if seeds is not None and len(seeds) != self.num_envs:
            raise ScenarioError(
                f"seed: {len(seeds)} seeds for {self.num_envs} environments; give one seed for "
                "each environment, or a single number"
            )
        places = np.flatnonzero(mask)
        for number in places.tolist():
            seed_of_environment = None if seeds is None else seeds[number]
            if seed_of_environment is not None or self._generators[number] is None:
                self._generators[number] = seeding.np_random(seed_of_environment)[0]
        observations = self._begin(places).observations
        if places.size < self.num_envs:
            observations = np.where(mask[:, None], observations, self._last)
        self._last = observations
        self._ended[places] = False
        return observations.copy(), {}

    def step(self, actions: Any) -> tuple[Observations, Floats, Flags, Flags, dict[str, Any]]:
        """Apply actions; return observations, rewards, terminated (failed), truncated (ended), errors and gas [kg].

        Raises SimulationError for an action that is not finite, and without autoreset for an environment that has
        ended.
        """
        before = self._ended
        if self.autoreset_mode is AutoresetMode.DISABLED and before.any():
            raise SimulationError(f"environment {int(np.flatnonzero(before)[0])} has ended; reset it with reset_mask")
        result = self.world.act(self._lanes, actions)
        self._ended = result.terminated | result.truncated
        infos: dict[str, Any] = {}
        reset = np.zeros(self.num_envs, dtype=np.bool_)
        if self.autoreset_mode is AutoresetMode.NEXT_STEP and before.any():
            reset = before
            # A step that resets ignores its action in Gymnasium's mode: it has no reward and ends nothing.
            for values in (result.rewards, result.terminated, result.truncated):
                values[reset] = 0
            self._ended = self._ended & ~reset
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._ended.any():
            reset = self._ended
            # What environments that begin again at once showed at their end.
            final_observations = np.full(self.num_envs, None, dtype=object)
            for number in np.flatnonzero(reset):
                # A copy, because the observations of the new episode overwrite this row below.
                final_observations[number] = result.observations[number].copy()
            info = _masked({"error": result.errors, "supplied_mass": result.supplied}, reset)
            infos |= {"final_obs": final_observations, "_final_obs": reset.copy()}
            infos |= {"final_info": info, "_final_info": reset.copy()}
        if reset.any():
            start = self._begin(np.flatnonzero(reset))
            result.observations[reset] = start.observations[reset]
        infos |= _masked({"error": result.errors, "supplied_mass": result.supplied}, ~reset)
        self._last = result.observations
        return result.observations.copy(), result.rewards, result.terminated, result.truncated, infos

    def numbers(self, place: int) -> dict[str, float]:
        """Return the true state of an environment in SI units, by path such as ``state.angle`` [rad]."""
        return self._lanes.numbers(place)

    def _begin(self, places: Places) -> BatchStep:
        generators = [self._generators[number] for number in places]
        return self.world.begin(self._lanes, places, [each for each in generators if each is not None])[0]


def _masked(values: Mapping[str, Floats], is_present: Flags) -> dict[str, Any]:
    """Return values (environments,) with the mask of environments that have them, as Gymnasium infos."""
    if not is_present.any():
        return {}
    columns = {name: np.where(is_present, column, 0.0) for name, column in values.items()}
    return columns | {f"_{name}": is_present.copy() for name in values}
