"""Environments of Gymnasium: spaces, seeds, the bits of a simulation, and many beside one."""

import math
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.engine.loading import BACKEND_VARIABLE
from ppafo.engine.scheme.actuators import VANE_FUNCTIONS
from ppafo.errors import ScenarioError, SimulationError
from ppafo.model.catalog import ACTUATORS
from ppafo.model.sensors import Measurement, measure
from ppafo.parameters.plant import plant_parameters

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode, SyncVectorEnv  # noqa: E402

import ppafo.gym  # noqa: E402
from ppafo.gym.environments import PneumaticEnv, PneumaticVectorEnv  # noqa: E402
from ppafo.gym.tasks import BAR, TASKS, finite, reward_of, within  # noqa: E402
from tests.compilers_here import compilers_here  # noqa: E402

TORQUE, ANGLE, WALK = TASK_NAMES = tuple(ppafo.gym.TASKS)
SHORT = {TORQUE: 0.02, ANGLE: 0.02, WALK: 6.0}
CHANNELS = ("angle", "mass_1", "mass_2", "supplied_mass", "vented_mass", "leaked_mass")


def one(name: str, **settings: Any) -> PneumaticEnv:
    """An environment without Gymnasium's wrappers."""
    made: PneumaticEnv = gymnasium.make(name, **settings).unwrapped
    return made


class Replayed:
    """A controller that gives commands in order, and keeps what it was shown."""

    def __init__(self, commands: list[float]) -> None:
        self.commands, self.seen = commands, list[Measurement]()

    def reset(self) -> None:
        self.seen.clear()

    def update(self, time: float, reference: float, measurement: Measurement) -> float:
        self.seen.append(measurement)
        return self.commands[len(self.seen) - 1]


def play(env: PneumaticEnv, commands: list[float], seed: int = 3) -> tuple[list[Any], list[dict[str, float]], float]:
    """Observations, states and the return of an episode."""
    observations, states, total = [env.reset(seed=seed)[0]], [env.numbers()], 0.0
    for command in commands:
        observation, reward, terminated, truncated, _ = env.step(np.float32([command]))
        observations.append(observation)
        states.append(env.numbers())
        total += reward
        assert not terminated
        assert truncated == (len(observations) == len(commands) + 1)
    return observations, states, total


def drawn_commands(count: int) -> list[float]:
    """Commands as an agent gives them, in 32 bits."""
    return np.random.default_rng(1).uniform(-1.0, 1.0, count).astype(np.float32).tolist()


def test_an_episode_is_there_after_a_reset() -> None:
    env = one(TORQUE, duration=np.float64(0.01))
    with pytest.raises(SimulationError, match="call reset"):
        env.episode()


def test_what_is_not_finite_counts_as_nothing() -> None:
    assert [finite(value) for value in (-2.5, math.nan, math.inf, -math.inf)] == [-2.5, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("name", TASK_NAMES)
def test_gymnasium_finds_nothing_to_warn_of(name: str) -> None:
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        check_env(one(name, duration=SHORT[name]))
    assert [str(item.message) for item in found] == []


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        (TORQUE, {}),
        (TORQUE, {"randomise": False}),
        (TORQUE, {"overrides": ["valve.delay=2.4 ms", "sensors.delay=1.3 ms"]}),
        (ANGLE, {}),
    ],
)
def test_replayed_commands_have_the_bits_of_simulate(name: str, settings: dict[str, Any]) -> None:
    env = one(name, duration=0.2, **settings)
    commands = drawn_commands(200)
    observations, states, _ = play(env, commands)
    told = Replayed(commands)
    recording = ppafo.simulate(env.episode().controlled_by(told)).recording
    for channel in CHANNELS:
        assert [state[f"state.{channel}"] for state in states] == recording[channel].tolist()
    shown = [(item.angle, item.pressure_1 / BAR, item.pressure_2 / BAR, item.torque) for item in told.seen]
    assert np.array_equal(np.array(observations)[:-1, :4], np.array(shown, dtype=np.float32))


def test_numbers_to_vary_are_refused_where_nothing_is_drawn() -> None:
    with pytest.raises(ppafo.ScenarioError, match="vary: has no effect with randomise = False"):
        one(TORQUE, randomise=False, vary={"valve.area": ("10 mm^2", "12 mm^2")})


def test_a_constant_policy_has_the_trace_of_a_constant_controller() -> None:
    env = one(ANGLE, duration=0.2, randomise=False)
    _, states, _ = play(env, [1.0] * 200)
    recording = ppafo.simulate("step-response", env.episode().origin.overrides).recording
    for channel in CHANNELS:
        assert [state[f"state.{channel}"] for state in states] == recording[channel].tolist()


def test_the_return_is_that_of_error_and_gas() -> None:
    env = one(TORQUE, duration=0.1, error_weight=2.0, gas_weight=3.0)
    env.reset(seed=1)
    infos = [(reward, info) for _, reward, _, _, info in (env.step(np.float32([0.5])) for _ in range(100))]
    squared = sum(info["error"] ** 2 for _, info in infos)
    gas = infos[-1][1]["supplied_mass"]
    assert sum(reward for reward, _ in infos) == pytest.approx(-(2.0 * 1e-3 * squared + 3.0 * 1e3 * gas), rel=1e-12)
    assert gas > 0.0


def test_another_seed_draws_another_episode_and_the_same_the_same() -> None:
    env = one(TORQUE, duration=0.02)
    commands = drawn_commands(20)
    first, second, third = (play(env, commands, seed) for seed in (1, 1, 2))
    assert np.array_equal(first[0], second[0])
    assert not np.array_equal(first[0], third[0])
    scenario = env.episode()
    half = 3.7e-6
    assert abs(scenario.device.actuator.dead_volume_1 - 36.0e-6) <= half
    assert 1.0 <= scenario.reference.level <= 4.5


def vector(name: str, mode: AutoresetMode, count: int = 3, **settings: Any) -> PneumaticVectorEnv:
    made: PneumaticVectorEnv = gymnasium.make_vec(name, num_envs=count, autoreset_mode=mode, **settings)
    return made


def assert_same(found: Any, wanted: Any) -> None:
    """Equal arrays, also in tuples and dictionaries, to the last bit."""
    if isinstance(wanted, tuple):
        for one_found, one_wanted in zip(found, wanted, strict=True):
            assert_same(one_found, one_wanted)
    elif isinstance(wanted, dict):
        assert found.keys() == wanted.keys()
        for key, value in wanted.items():
            assert_same(found[key], value)
    elif isinstance(wanted, np.ndarray) and wanted.dtype == object:
        for one_found, one_wanted in zip(found, wanted, strict=True):
            assert (one_found is None) == (one_wanted is None)
            assert one_found is None or np.array_equal(one_found, one_wanted)
    else:
        assert np.array_equal(found, wanted)


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize(("name", "count"), [(TORQUE, 34), (ANGLE, 3)])
def test_many_are_as_each_would_be_alone(name: str, count: int, mode: AutoresetMode) -> None:
    settings: dict[str, Any] = {"duration": 0.02, "actions": "on_off" if name == ANGLE else "continuous"}
    many = vector(name, mode, count, **settings)
    alone = SyncVectorEnv([lambda: one(name, **settings)] * count, autoreset_mode=mode)
    assert many.action_space == alone.action_space
    assert many.observation_space == alone.observation_space
    assert_same(many.reset(seed=7), alone.reset(seed=7))
    many.action_space.seed(1)
    for step in range(30):
        actions = many.action_space.sample()
        found, wanted = many.step(actions), alone.step(actions)
        assert_same(found, wanted)
        ended = wanted[2] | wanted[3]
        if mode is AutoresetMode.DISABLED and (ended.any() or step == 9):
            # In the middle of an episode some begin anew, so that lanes of a block are at different times from then on.
            mask = ended if step != 9 else np.arange(count) % 2 == 0
            both = [env.reset(options={"reset_mask": mask.copy()}) for env in (many, alone)]
            assert_same(*both)


@pytest.mark.parametrize("name", TASK_NAMES)
def test_every_compiler_gives_the_same_bits(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found = {}
    for compiler in compilers_here():
        monkeypatch.setenv(BACKEND_VARIABLE, compiler)
        many = vector(name, AutoresetMode.NEXT_STEP, 35)
        many.action_space.seed(1)
        shown = [many.reset(seed=7)[0].tobytes()]
        for _ in range(300):
            observations, rewards, terminated, truncated, _ = many.step(many.action_space.sample())
            shown += [values.tobytes() for values in (observations, rewards, terminated, truncated)]
        found[compiler] = shown
    assert len(set(shown)) > 600
    assert all(other == shown for other in found.values())


@pytest.mark.parametrize("name", TASK_NAMES)
def test_python_without_a_compiler_gives_the_same_bits(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: dict[str, list[bytes]] = {"": [], "python": []}
    for backend, found in shown.items():
        monkeypatch.setenv(BACKEND_VARIABLE, backend)
        many = vector(name, AutoresetMode.NEXT_STEP, 2)
        many.action_space.seed(1)
        found.append(many.reset(seed=7)[0].tobytes())
        for _ in range(6):
            observations, rewards, *_ended = many.step(many.action_space.sample())
            found += [observations.tobytes(), rewards.tobytes()]
    assert len(set(shown["python"])) > 10
    assert shown["python"] == shown[""]


def test_replayed_commands_of_a_law_have_the_bits_of_its_walk_and_its_sensors_are_late() -> None:
    recording = ppafo.walk("proportional", minutes=0.1).recording
    commands = recording["command"][:700]
    env = one(WALK, randomise=False)
    observations, states = [env.reset(seed=1)[0]], [env.numbers()]
    for command in commands:
        vents = command > 1.5
        observations.append(env.step([0.0 if vents else command, 1.0 if vents else -1.0])[0])
        states.append(env.numbers())
    for channel in ("angle", "supplied_mass", "vented_mass"):
        assert [state[f"state.{channel}"] for state in states] == recording[channel][:701].tolist()
    assert max(recording["torque"][:701]) > 3.0
    late = 3
    sensors, plant = env.episode().sensors, plant_parameters(env.episode().device)
    pressures = recording["pressure_1"], recording["pressure_2"]
    for sample in (late, 400, 700):
        then = sample - late
        seen = measure(
            sensors, recording["angle"][then], *(item[then] for item in pressures), plant, then, parts=VANE_FUNCTIONS
        )
        shown = (seen.angle, seen.pressure_1 / BAR, seen.pressure_2 / BAR, seen.torque)
        assert np.array_equal(observations[sample][:4], np.array(shown, dtype=np.float32))


def test_wearers_are_drawn_and_their_late_sensors_are_those_of_one_alone() -> None:
    many = vector(WALK, AutoresetMode.NEXT_STEP, 2)
    alone = one(WALK)
    found, _ = many.reset(seed=4)
    wanted, _ = alone.reset(seed=5)
    actions = np.random.default_rng(1).uniform(-1.0, 1.0, (200, 2, 2)).astype(np.float32)
    for action in actions:
        assert np.array_equal(found[1], wanted)
        found, wanted = many.step(action)[0], alone.step(action[1])[0]
    first, second = (many.numbers(place)["walk.now.phase"] for place in range(2))
    assert first != second


def test_a_run_that_fails_ends_its_episode_and_shows_numbers_in_bounds() -> None:
    env = one(ANGLE, duration=0.2, randomise=False)
    env.reset(seed=1)
    env._lanes._states[0, env._lanes.rows["state.mass_1"], 0] = -1.0
    observation, _, terminated, _, _ = env.step(np.float32([1.0]))
    assert terminated
    assert env.observation_space.contains(observation)


def test_what_is_no_number_is_cut_off_at_the_lowest() -> None:
    assert [within(value, -1.0, 2.0) for value in (float("nan"), -5.0, 0.5, 9.0)] == [-1.0, -1.0, 0.5, 2.0]
    assert reward_of(2.0, 1.0e-3, 1.0, 3.0, 0.5) == pytest.approx(-5.0)
    assert set(TASKS) == {"torque", "angle", "walk"}


@pytest.mark.parametrize(
    ("name", "settings", "line"),
    [
        (TORQUE, {"actions": "onoff"}, "'continuous' or 'on_off', did you mean 'on_off'?"),
        (TORQUE, {"vary": {"valve.aera": ("1 mm^2", "2 mm^2")}}, "did you mean 'valve.area'?"),
        (TORQUE, {"vary": {"valve.area": ("2 mm^2", "1 mm^2")}}, "the first value must be below the second"),
        (TORQUE, {"vary": {"valve.area": (1.0, 2.0)}}, "has no unit"),
        (TORQUE, {"overrides": ["run.output_interval=1.5 ms"]}, "must be a multiple of run.step"),
        (WALK, {"vary": {"valve.area": ("1 mm^2", "2 mm^2")}}, "a walk varies only wearer and gait"),
        (
            WALK,
            {"scenario": "off"},
            "an environment needs a torque profile, which controller.kind = 'off' does not have",
        ),
        (TORQUE, {"observations": "scale"}, "'physical' or 'scaled', did you mean 'scaled'?"),
        (TORQUE, {"frame_skip": 0}, "frame_skip = 0: must be a whole number of at least 1"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(name: str, settings: dict[str, Any], line: str) -> None:
    with pytest.raises(ppafo.PpafoError, match=line.replace("?", r"\?")) as refused:
        one(name, **settings)
    assert "\n" not in str(refused.value)


def test_an_action_is_held_for_the_samples_of_a_frame_and_the_last_frame_ends_with_the_episode() -> None:
    held, each = one(TORQUE, duration=0.022, frame_skip=4), one(TORQUE, duration=0.022)
    for env in (held, each):
        env.reset(seed=5)
    for action in np.random.default_rng(2).uniform(-1.0, 1.0, (5, 1)).astype(np.float32):
        found = held.step(action)
        single = [each.step(action) for _ in range(4)]
        assert found[1] == pytest.approx(sum(step[1] for step in single), rel=1e-12)
        assert found[0].tolist() == single[-1][0].tolist()
        assert found[2:] == single[-1][2:]
    found, single = held.step(action), [each.step(action) for _ in range(2)]
    assert found[3] is single[-1][3] is True
    assert found[0].tolist() == single[-1][0].tolist()
    assert found[1] == pytest.approx(sum(step[1] for step in single), rel=1e-12)


def test_scaled_observations_are_the_physical_ones_between_their_bounds() -> None:
    scaled, plain = one(TORQUE, duration=0.02, observations="scaled"), one(TORQUE, duration=0.02)
    many = vector(TORQUE, AutoresetMode.DISABLED, 2, duration=0.02, observations="scaled")
    seen, whole, first = scaled.reset(seed=5)[0], plain.reset(seed=5)[0], many.reset(seed=5)[0]
    assert np.array_equal(first[0], seen)
    low, high = plain.observation_space.low, plain.observation_space.high
    assert seen == pytest.approx(2.0 * (whole - low) / (high - low) - 1.0, abs=1e-6)
    assert scaled.observation_space == gymnasium.spaces.Box(-1.0, 1.0, whole.shape, np.float32)


@pytest.mark.parametrize("name", [TORQUE, ANGLE])
def test_an_episode_has_a_picture(name: str) -> None:
    env = one(name, duration=0.02, render_mode="rgb_array")
    with pytest.raises(SimulationError, match="call reset"):
        env.render()
    env.reset(seed=1)
    first = env.render()
    for _ in range(20):
        env.step(np.float32([1.0]))
    last = env.render()
    assert first.shape == last.shape == (360, 640, 3)
    assert first.dtype == np.uint8
    assert (first != last).any()
    assert one(name, duration=0.02).render() is None


def test_an_action_that_is_no_number_is_refused() -> None:
    env = one(TORQUE, duration=0.02)
    env.reset(seed=1)
    with pytest.raises(SimulationError, match="must be finite"):
        env.step(np.float32([np.nan]))


def test_seeds_and_masks_of_another_length_are_refused() -> None:
    many = vector(TORQUE, AutoresetMode.DISABLED, 2, duration=0.02)
    with pytest.raises(ScenarioError, match="3 seeds for 2"):
        many.reset(seed=[1, 2, 3])
    with pytest.raises(ScenarioError, match="reset_mask: must be an array of 2"):
        many.reset(options={"reset_mask": [True, False]})


def test_an_environment_of_another_actuator_shows_the_torque_of_its_kind() -> None:
    file = Path(__file__).parents[2] / "actuators" / "torque-task-cylinder.toml"
    env = one(TORQUE, scenario=str(file), randomise=False)
    observation, _ = env.reset(seed=1)
    for _ in range(30):
        observation, *_ = env.step([0.5])
    numbers, device = env.numbers(), env.episode().device
    kind, plant = ACTUATORS[device.actuator.kind].model, plant_parameters(device)
    angle = numbers["state.angle"]
    pressures = kind.pressures(plant, angle, numbers["state.mass_1"], numbers["state.mass_2"])
    torque = kind.torque(plant, angle, *pressures)
    assert abs(torque) > 0.5
    assert observation[3] == pytest.approx(torque, rel=1e-5)


def test_one_chamber_is_observed_without_a_second_pressure() -> None:
    file = Path(__file__).parents[2] / "actuators" / "torque-task-measured-bladder.toml"
    settings = {"scenario": str(file), "duration": 0.02}
    env, scaled = one(TORQUE, **settings), one(TORQUE, observations="scaled", **settings)
    assert env.observed == ("angle", "pressure_1", "torque", "requested", "requested_rate", "command")
    check_env(env)
    observation, _ = env.reset(seed=1)
    assert observation.shape == env.observation_space.shape == (6,)
    assert observation[env.observed.index("pressure_1")] == pytest.approx(1.01325)
    assert observation[env.observed.index("torque")] == pytest.approx(-1.178097, rel=1e-6)
    many = vector(TORQUE, AutoresetMode.DISABLED, 2, **settings)
    assert many.observed == env.observed
    assert np.array_equal(many.reset(seed=1)[0][0], observation)
    assert scaled.reset(seed=1)[0].shape == (6,)


def test_the_atmosphere_lies_within_the_observed_pressures_of_a_vacuum() -> None:
    vacuum = ["supply.pressure=0.3 bar_a", "supply.dorsiflexion_pressure=0.3 bar_a", "initial.pressure_1=atmosphere"]
    env = one(TORQUE, overrides=[*vacuum, "initial.pressure_2=atmosphere"], randomise=False, duration=0.02)
    assert env.reset(seed=1)[0][1] == pytest.approx(1.01325, abs=0.02)


def test_the_page_lists_what_is_observed_with_its_bounds() -> None:
    page = (Path(__file__).parents[3] / "docs" / "how-to" / "export.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`[^|]*`) \| (-?[\d.]+) to ([\d.]+)( [^|]*|) \|$", page, re.MULTILINE)
    listed = {name: (float(low), float(high)) for names, low, high, _ in rows for name in re.findall(r"`(\w+)`", names)}
    seen = set()
    for name in TASK_NAMES:
        env = one(name)
        bounds = zip(env.observation_space.low.tolist(), env.observation_space.high.tolist(), strict=True)
        found = dict(zip(env.observed, bounds, strict=True))
        device = env.world.episodes.base.device
        twice = 2.0 * max(device.supply.pressure, device.supply.dorsiflexion_pressure)
        of_device = {
            "pressure_1": (0.0, twice / BAR),
            "torque": np.array([-1.0, 1.0]) * device.actuator.torque_constant * twice,
        }
        of_device["pressure_2"], of_device["requested"] = of_device["pressure_1"], of_device["torque"]
        of_device |= {"requested": listed["angle"]} if name == ANGLE else {}
        for entry, ends in found.items():
            assert ends == pytest.approx(of_device.get(entry, listed.get(entry)), rel=1e-4), entry
        seen |= set(found)
    assert seen == set(listed) | set(of_device)
