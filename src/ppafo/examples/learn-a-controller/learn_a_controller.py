"""Learn a controller where a tuned PID is not best, and put it into the league beside the others.

The task: follow a torque while the wearer moves the ankle, through a slow spool with a dead band, with sensors that are
10 ms late; gas counts as much as error. An evolution strategy trains the weights of a small net
(``learnt_policy.py``) on many environments at once; the PID controller gets as many runs to find its gains.

    pip install 'ppafo[gym]'
    python learn_a_controller.py

Everything is drawn from one seed: the same numbers come out each time. The results go to ``out/learn-a-controller``.
"""

# %% The task, and what it is allowed to cost
import json
import time
from pathlib import Path

import gymnasium
import learnt_policy
import numpy as np

import ppafo
import ppafo.worlds.gym
from ppafo.model.sensors import Measurement
from ppafo.questions.league.standing import ENTRANTS, Entrant

SCENARIO = "torque-task-moving-ankle"
HARDWARE = [
    "valve.spool_frequency=20 Hz",
    "valve.spool_damping_ratio=0.7",
    "valve.dead_band=0.05",
    "valve.delay=2 ms",
    "sensors.delay=10 ms",
    "sensors.pressure_noise=0.1 psi_d",
    "sensors.angle_noise=0.2 deg",
]
SEED = 1
GENERATIONS = 60
PAIRS = 48  # of candidates to either side of the mean
EPISODES = 4  # of each candidate, the same for all of a generation
SECONDS = 2.5  # of an episode
PID_DRAWS = 200  # of gains, in each of four rounds
DRAWS = 100  # of devices and noise in the league
STEP, RATE = 0.08, 0.05  # of the search: spread of the candidates, and how far the mean moves

folder = Path("out") / "learn-a-controller"
folder.mkdir(parents=True, exist_ok=True)


# %% Many environments: each candidate gets the same episodes
def environments(count: int, seconds: float) -> gymnasium.vector.VectorEnv:
    """Return environments of the task, with targets between 1.5 and 4 N m."""
    return gymnasium.make_vec(
        "ppafo/TorqueTask-v0",
        num_envs=count,
        scenario=SCENARIO,
        overrides=HARDWARE,
        vary={"reference.level": ("1.5 N m", "4 N m")},
        duration=seconds,
        autoreset_mode="Disabled",
    )


def costs(env: gymnasium.vector.VectorEnv, candidates: np.ndarray, seeds: list[int]) -> np.ndarray:
    """Return the cost of each candidate (candidates,), mean over its episodes: less the return."""
    weights = np.repeat(candidates, len(seeds), axis=0).T.copy()
    seen, _ = env.reset(seed=seeds * len(candidates))
    state = learnt_policy.PolicyState(*np.zeros((5, env.num_envs)))
    total, ended = np.zeros(env.num_envs), np.zeros(env.num_envs, dtype=bool)
    while not ended.any():
        angle, pressure_1, pressure_2, torque, reference, _, _ = seen.astype(float).T
        shown = Measurement(angle=angle, pressure_1=1.0e5 * pressure_1, pressure_2=1.0e5 * pressure_2, torque=torque)
        values, state = learnt_policy.inputs_of(state, reference, shown, 1.0e-3)
        command = np.clip(learnt_policy.output_of(weights, values), -1.0, 1.0)
        state = state._replace(command=command)
        seen, reward, terminated, truncated, _ = env.step(command[:, None])
        total -= reward
        ended = terminated | truncated
    return total.reshape(len(candidates), len(seeds)).mean(axis=1)


# %% The search: candidates to both sides of the mean, weighed by their rank (Salimans et al. 2017, Adam)
def train() -> tuple[np.ndarray, list[float]]:
    """Return the weights that were found, and the mean cost of each generation."""
    random = np.random.default_rng(SEED)
    env = environments(2 * PAIRS * EPISODES, SECONDS)
    mean = np.zeros(learnt_policy.WEIGHTS)
    mean[: learnt_policy.HIDDEN * (learnt_policy.INPUTS + 2)] = 0.3 * random.standard_normal(66)
    mean[learnt_policy.INPUTS + 1 : 66 : learnt_policy.INPUTS + 2] = 0.0  # no unit counts at first
    mean[66:69] = 0.4, 0.1, 0.1  # a weak PI controller to begin with
    slope, power, history = np.zeros_like(mean), np.zeros_like(mean), []
    for generation in range(GENERATIONS):
        drawn = random.standard_normal((PAIRS, mean.size))
        both = np.concatenate([drawn, -drawn])
        found = costs(env, mean + STEP * both, random.integers(0, 2**31, EPISODES).tolist())
        rank = np.argsort(np.argsort(found)) / (found.size - 1) - 0.5
        gradient = rank @ both / (found.size * STEP)
        slope, power = 0.9 * slope + 0.1 * gradient, 0.99 * power + 0.01 * gradient**2
        scaled = slope / (1.0 - 0.9 ** (generation + 1)), power / (1.0 - 0.99 ** (generation + 1))
        left = 1.0 - 0.8 * generation / GENERATIONS
        mean = mean - RATE * left * scaled[0] / (np.sqrt(scaled[1]) + 1.0e-8)
        history.append(float(found.mean()))
        print(f"generation {generation + 1:3d}: cost {history[-1]:.3f}, best {found.min():.3f}", flush=True)
    return mean, history


# %% A PID controller that is tuned for the same cost: drawn gains, then gains around the best
PID = {
    "proportional_gain": (0.02, 2.0, "1/(N m)"),
    "integral_gain": (0.02, 20.0, "1/(N m s)"),
    "derivative_gain": (0.0002, 0.02, "s/(N m)"),
    "derivative_filter": (0.001, 0.05, "s"),
    "anti_windup": (0.1, 20.0, "1/s"),
}


def cost_of(result: ppafo.Result) -> float:
    """Return what the return of an episode has: squared error over time, and gas in g."""
    error, gas = (result.metrics[name].value for name in ("rms_error", "gas_supplied"))
    return error**2 * float(result.recording.time[-1]) + 1.0e3 * gas


def tuned_pid() -> tuple[str, ...]:
    """Return the overrides of the PID controller with the lowest cost of four rounds of draws."""
    random = np.random.default_rng(SEED)
    centre, best = np.full(len(PID), 0.5), (np.inf, ())
    for spread, end in ((0.5, 1.0), (0.15, 1.0), (0.1, 1.5), (0.05, 1.5)):  # later ones may go beyond the ranges
        places = np.clip(centre + spread * random.uniform(-1.0, 1.0, (PID_DRAWS, len(PID))), 0.0, end)
        words = [
            tuple(
                f"controller.{name}={low * (high / low) ** place:.4g} {unit}"
                for place, (name, (low, high, unit)) in zip(row, PID.items(), strict=True)
            )
            for row in places.tolist()
        ]
        found = ppafo.simulate_many([ppafo.load_scenario(SCENARIO, [*HARDWARE, *item]) for item in words])
        judged = [cost_of(result) for result in found]
        lowest = int(np.argmin(judged))
        if judged[lowest] < best[0]:
            best, centre = (judged[lowest], words[lowest]), places[lowest]
    return best[1]


# %% The league: the laws of the catalogue, that PID controller and the net
def entrant(name: str, kind: str, settings: tuple[str, ...], found: str) -> Entrant:
    """Return a law of a continuous command as the league takes it."""
    own = (f"controller.kind={kind}", "device.valve=proportional", "controller.rate=1 kHz")
    return Entrant(name, kind, "proportional", (*own, *settings), found)


def play(weights: np.ndarray) -> ppafo.League:
    """Return the league of the task on its own device and on random ones."""
    net = tuple(f"controller.weight_{number}={value!r}" for number, value in enumerate(weights.tolist()))
    mine = (
        entrant("learnt_policy", "learnt_policy:KIND", net, f"{GENERATIONS} generations, seed {SEED}"),
        entrant("pid-for-this", "pid", tuned_pid(), f"{4 * PID_DRAWS} draws of gains, seed {SEED}"),
    )
    others = tuple(item for item in ENTRANTS if item.valve == "proportional" and not item.learns)
    return ppafo.league(SCENARIO, HARDWARE, draws=DRAWS, entrants=(*others, *mine))


def table(league: ppafo.League) -> list[dict[str, float | str]]:
    """Return name, RMS error [N m], gas [g] and cost of each entrant, and the errors that its draws have, by cost."""
    rows = []
    for item in league.standings:
        error, gas = item.measures["rms_error"], 1.0e3 * item.measures["gas_supplied"]
        drawn = item.robustness
        errors = (
            {} if drawn is None else {f"{share:.0%}": drawn.not_exceeded("rms_error", share) for share in (0.5, 0.95)}
        )
        rows.append({"name": item.entrant.name, "cost": 5.0 * error**2 + gas, "rms_error": error, "gas": gas, **errors})
    return sorted(rows, key=lambda row: row["cost"])


if __name__ == "__main__":
    kept = folder / "weights.txt"
    began = time.perf_counter()
    weights, history = train()
    print(f"trained in {time.perf_counter() - began:.0f} s")
    np.savetxt(kept, weights)
    rows = table(play(weights))
    for row in rows:
        print("  ".join(f"{value:>22}" if isinstance(value, str) else f"{value:8.4f}" for value in row.values()))
    written = {"history": history, "weights": weights.tolist(), "standings": rows}
    (folder / "learnt.json").write_text(json.dumps(written, indent=1), encoding="utf-8")
    print(f"written: {folder}")
