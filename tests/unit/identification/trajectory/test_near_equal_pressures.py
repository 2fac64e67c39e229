"""A recording within some hundred pascals is fitted by the law of the flow where its experiment asks for that."""

import math
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

import ppafo

NUMBER, GAS, ATMOSPHERE = 1.3, 8.314462618 / 0.044, 101325.0
TEMPERATURE, AREA, VOLUME = 298.0, 31.6e-6, 36.0e-6 + 14.51e-6 * math.radians(55.0)
TRUTH = 0.1243
SCENARIO = """
[initial]
pressure_1 = "600 Pa_g"
pressure_2 = "supply"
[controller]
kind = "constant"
rate = "1 kHz"
command = "-1"
"""
PROBLEM = """
schema_version = 1
name = "blow-down"
device.set = "ppafo2011"
[trajectory]
[[trajectory.parameters]]
path = "valve.discharge_coefficient"
[[trajectory.experiments]]
label = "down-to-rest"
recording = "blow.csv"
scenario = "blow.toml"
overrides = ["actuator.leak.area=0 mm^2"{more}]
[bench]
supply = "0 psi_d"
zero_of_pressure = "0 psi_d"
gain = "0 %"
"""


def outflow(pressure: float) -> float:
    """Flow [kg/s] through the open valve into the room, equations (6) and (7); never choked here."""
    ratio = ATMOSPHERE / pressure
    terms = ratio ** (2.0 / NUMBER) - ratio ** ((NUMBER + 1.0) / NUMBER)
    factor = math.sqrt(2.0 * NUMBER / ((NUMBER - 1.0) * GAS * TEMPERATURE) * max(terms, 0.0))
    return TRUTH * AREA * pressure * factor


def recorded_blow_down(noise: np.random.Generator) -> str:
    """A chamber of one volume and temperature, 600 Pa above the room, emptied until it is at rest."""
    lines, pressure, step = ["time [s],pressure_1 [Pa_a],pressure_2 [Pa_a],angle [deg],command [1]"], 101925.0, 2.0e-5
    for number in range(10_001):
        if number % 50 == 0:
            sensed, other, angle = noise.normal((pressure, ATMOSPHERE + 344737.86, 75.0), (2.0, 2.0, 0.01))
            lines.append(f"{step * number:.4f},{sensed:.9g},{other:.9g},{angle:.6f},-1")
        middle = max(ATMOSPHERE, pressure - 0.5 * step * outflow(pressure) * GAS * TEMPERATURE / VOLUME)
        pressure = max(ATMOSPHERE, pressure - step * outflow(middle) * GAS * TEMPERATURE / VOLUME)
    return "\n".join([*lines, ""])


def fitted(folder: Path, more: str) -> tuple[float, float, float]:
    shipped = resources.files("ppafo").joinpath("scenarios/torque-task-proportional.toml").read_text(encoding="utf-8")
    head = shipped[: shipped.index("[initial]")].replace('duration = "3 s"', 'duration = "0.2 s"')
    (folder / "blow.toml").write_text(head + SCENARIO, encoding="utf-8")
    (folder / "blow.csv").write_text(recorded_blow_down(np.random.default_rng(1)), encoding="utf-8")
    (folder / "problem.toml").write_text(PROBLEM.format(more=more), encoding="utf-8")
    (estimate,) = ppafo.identify(folder / "problem.toml").found.estimates
    return estimate.value, estimate.low, estimate.high


def test_the_coefficient_of_a_blow_down_to_rest_is_the_true_one(tmp_path: Path) -> None:
    value, low, high = fitted(tmp_path, ', "flow.linear_ratio=0.9999"')
    assert value == pytest.approx(TRUTH, rel=0.07)
    assert low < TRUTH < high
