"""Environment of Gymnasium: an agent commands the valve so that the device follows a torque.

    pip install gymnasium
    python torque_task.py

A step is one sample of the controller, 1 ms. The observation is what late, noisy and quantised sensors show: angle
[rad], absolute pressures [bar], torque [N m]; then the requested torque [N m] and the last command. The action is the
command, -1 to 1. The reward is minus the squared error of the shown torque [(N m)^2] times the period [s], minus the
gas [g]. Every episode draws level, supply, dead volume and noise.
"""

from typing import Any

import gymnasium
import numpy as np

import ppafo

SCENARIO = "torque-task-proportional"
SENSORS = {
    "sensors.delay": "3 ms",
    "sensors.angle_noise": "0.2 deg",
    "sensors.pressure_noise": "0.1 psi_d",
    "sensors.pressure_resolution": "0.05 psi_d",
}
DRAWN = {  # SI: N m, Pa absolute, m^3
    "reference.level": (1.0, 4.5),
    "supply.pressure": (4.2e5, 4.8e5),
    "actuator.dead_volume_1": (32.0e-6, 40.0e-6),
}
LOWEST = np.array([0.0, 0.0, 0.0, -30.0, -30.0, -1.0], dtype=np.float32)
HIGHEST = np.array([3.2, 10.0, 10.0, 30.0, 30.0, 1.0], dtype=np.float32)
BAR = 1.0e5
GRAM = 1.0e-3


class TorqueTask(gymnasium.Env[np.ndarray, np.ndarray]):
    """The device with an agent as its controller; ``run`` is the run of the present episode."""

    observation_space = gymnasium.spaces.Box(LOWEST, HIGHEST)
    action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))

    def __init__(self, duration: str = "1 s", error_weight: float = 1.0, gas_weight: float = 1.0) -> None:
        self.overrides = {"run.duration": duration, **SENSORS}
        self.error_weight = error_weight
        self.gas_weight = gas_weight

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode with numbers drawn by the generator of the environment."""
        super().reset(seed=seed)
        drawn: dict[str, Any] = {path: float(self.np_random.uniform(*ends)) for path, ends in DRAWN.items()}
        drawn["sensors.seed"] = int(self.np_random.integers(2**32))
        self.run = ppafo.start(SCENARIO, {**self.overrides, **drawn})
        return self._observed(0.0), drawn

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Apply a command for one sample; the info has the torque error [N m] and the gas since the start [kg]."""
        command = float(np.clip(action[0], -1.0, 1.0))
        gas = self.run.state.supplied_mass
        self.run.step(command)
        gas = self.run.state.supplied_mass - gas
        error = self.run.reference - self.run.measurement.torque
        reward = -(self.error_weight * error**2 * self.run.period + self.gas_weight * gas / GRAM)
        info = {"error": error, "supplied_mass": self.run.state.supplied_mass}
        return self._observed(command), reward, self.run.has_diverged, self.run.is_over, info

    def _observed(self, command: float) -> np.ndarray:
        angle, pressure_1, pressure_2, torque = self.run.measurement
        seen = [angle, pressure_1 / BAR, pressure_2 / BAR, torque, self.run.reference, command]
        return np.clip(np.nan_to_num(seen), LOWEST, HIGHEST).astype(np.float32)


gymnasium.register("ppafo/TorqueTask-v0", entry_point=TorqueTask)

if __name__ == "__main__":
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make("ppafo/TorqueTask-v0").unwrapped
    total = 0.0
    over = False
    check_env(env)
    observation, drawn = env.reset(seed=1)
    while not over:  # the law that an agent has to beat
        action = np.array([0.3 * (observation[4] - observation[3])], dtype=np.float32)
        observation, reward, failed, ended, info = env.step(action)
        total = total + reward
        over = failed or ended
    print(f"return {total:.3f} with {info['supplied_mass'] / GRAM:.3f} g of gas")
    print(env.run.result())  # as of `ppafo simulate`
