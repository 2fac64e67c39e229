"""PPO of stable-baselines3 learns to follow a torque; a curve of how well it does, beside a PID controller.

    pip install 'ppafo[gym]' stable-baselines3
    python learn_with_ppo.py

writes ``ppo.png`` and ``ppo.csv``. Everything is simulated.
"""

import argparse
import csv
import time
from pathlib import Path

import gymnasium
import matplotlib.pyplot as plt
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv

import ppafo

TASK = "ppafo.worlds.gym:ppafo/TorqueTask-v0"
"""The module before the colon is imported by ``gymnasium.make`` itself."""
SETTINGS = {"frame_skip": 10, "observations": "scaled", "duration": 2.0, "gas_weight": 0.2}
"""A decision every 10 ms, numbers between -1 and 1, episodes of 2 s, gas that counts a fifth."""
PROPORTIONAL, INTEGRAL, DERIVATIVE = 0.095, 0.25, 0.006
"""The paper's gains [1/(N m), 1/(N m s), s/(N m)]; equation (13)."""
JUDGED = range(1000, 1020)
"""Random seeds of the episodes by which an agent is judged; it never trains on them."""


def rms_error(agent: PPO) -> float:
    """Return the mean over the judged episodes of the RMS error [N m]."""
    env = gymnasium.make(TASK, **SETTINGS)
    found = []
    for seed in JUDGED:
        observation, _ = env.reset(seed=seed)
        errors, is_over = [], False
        while not is_over:
            action, _ = agent.predict(observation, deterministic=True)
            observation, _, terminated, truncated, info = env.step(action)
            errors.append(info["error"])
            is_over = terminated or truncated
        found.append(np.sqrt(np.mean(np.square(errors))))
    return float(np.mean(found))


class Pid:
    """A PID controller with the paper's gains, which decides every 1 ms on the same late and noisy sensors."""

    def reset(self) -> None:
        """Forget what was."""
        self.integral, self.before = 0.0, None

    def update(self, _time: float, reference: float, measurement: ppafo.Measurement) -> float:
        """Return the command for a requested torque [N m]."""
        error = reference - measurement.torque
        self.integral += error * 1.0e-3
        rate = 0.0 if self.before is None else (error - self.before) / 1.0e-3
        self.before = error
        return float(np.clip(PROPORTIONAL * error + INTEGRAL * self.integral + DERIVATIVE * rate, -1.0, 1.0))


def rms_error_of_pid() -> float:
    """Return the same of a PID controller."""
    env = gymnasium.make(TASK, **SETTINGS)
    found = []
    for seed in JUDGED:
        env.reset(seed=seed)
        result = ppafo.simulate(env.unwrapped.episode().controlled_by(Pid()))
        errors = (result.recording["reference"] - result.recording["torque"])[10::10]
        found.append(np.sqrt(np.mean(np.square(errors))))
    return float(np.mean(found))


def main(steps: int, blocks: int, seed: int) -> None:
    """Train in blocks of steps, and write after each how well the agent does by then."""
    torch.set_num_threads(1)
    pid = rms_error_of_pid()
    print(f"PID controller with the paper's gains: {pid:.3f} N m")
    agent = PPO(
        "MlpPolicy",
        DummyVecEnv([lambda: gymnasium.make(TASK, **SETTINGS)] * 16),
        n_steps=200,
        batch_size=800,
        gamma=0.98,
        learning_rate=1e-3,
        seed=seed,
        device="cpu",
    )
    begun, rows = time.perf_counter(), [(0, 0.0, rms_error(agent))]
    for block in range(1, blocks + 1):
        agent.learn(steps // blocks, reset_num_timesteps=False)
        rows.append((block * (steps // blocks), time.perf_counter() - begun, rms_error(agent)))
        print("{:7d} steps, {:5.0f} s, RMS error {:.3f} N m".format(*rows[-1]), flush=True)
    with Path("ppo.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([("steps", "time [s]", "rms_error [N m]"), *rows])
    figure, axes = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
    counts, _, errors = np.array(rows).T
    axes.semilogy(counts / 1000, errors, "o-", color="#0072B2", label="PPO")
    axes.axhline(pid, color="#6e6e6e", linestyle="--", label="PID controller with the paper's gains")
    ticks = (0.1, 0.2, 0.5, 1.0, 2.0)
    axes.set_yticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.set_xlabel("Decisions (thousands)")
    axes.set_ylabel("RMS error (N m)")
    axes.set_title("Following a torque on random devices (simulated)", loc="left")
    axes.legend(frameon=False)
    figure.savefig("ppo.png", dpi=150)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=160_000, help="decisions to train on (default: 160000)")
    parser.add_argument("--blocks", type=int, default=10, help="how often the agent is judged (default: 10)")
    parser.add_argument("--seed", type=int, default=1, help="random seed (default: 1)")
    main(**vars(parser.parse_args()))
