"""A recording whose step comes in its middle, by a simulator that holds the command: the right model explains it."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.questions.identify.solve import identify
from ppafo.questions.validate.solve import validate
from ppafo.signals import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.storage import write_csv
from tests.judge.bench import bench

AT_STEP = 0.1
SUPPLIES = ("supply.pressure=55 psi_g", "supply.dorsiflexion_pressure=55 psi_g")
TRUTH = {
    "valves.proportional.discharge_coefficient": 0.113,
    "actuator.leak.area": 3.0e-7,
    "friction.viscous_damping": 0.032,
    "foot_plate.inertia": 0.0084,
}
PROBLEM = """
schema_version = 1
name = "held"
device.set = "ppafo2011"
device.overrides = ["supply.pressure=55 psi_g", "supply.dorsiflexion_pressure=55 psi_g"]
[[trajectory.parameters]]
path = "valve.discharge_coefficient"
start = "0.1"
[[trajectory.parameters]]
path = "actuator.leak.area"
[[trajectory.parameters]]
path = "friction.viscous_damping"
[[trajectory.parameters]]
path = "foot_plate.inertia"
[[trajectory.experiments]]
label = "step"
recording = "step.csv"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Chamber 2 leaks into chamber 1 for 0.1 s, then the valve opens; noise of sensors upon it."""
    home = tmp_path_factory.mktemp("held")
    scenario = load_scenario("step-response", ("motion.kind=free",))
    times = np.arange(501) * 1e-3
    random = np.random.default_rng(0)
    columns = bench(scenario, [(0.0, 0.0), (AT_STEP, 1.0)], times)
    names = (("angle", 1.7e-3, "rad"), ("pressure_1", 500.0, "Pa"), ("pressure_2", 500.0, "Pa"))
    channels = {
        name: Channel(values + deviation * random.standard_normal(times.size), unit)
        for values, (name, deviation, unit) in zip(columns, names, strict=True)
    }
    channels["command"] = Channel(np.where(times > AT_STEP - 1e-9, 1.0, 0.0), "-")
    write_csv(home / "step.csv", Recording("step", times, channels))
    return home


@pytest.mark.parametrize("start", ["", 'initial_state = "fitted"\n'])
def test_the_right_model_is_no_misfit_where_its_step_lies_inside_the_recording(folder: Path, start: str) -> None:
    (folder / "problem.toml").write_text(PROBLEM + start)
    outcome = identify(folder / "problem.toml").trajectory
    assert outcome is not None
    assert outcome.fit.misfit == ""
    for path, truth in TRUTH.items():
        found = outcome.fit.estimate(path)
        assert found.verdict == "identified"
        # A start that is taken for exactly known shifts the others a little; one that is fitted does not.
        assert found.value == pytest.approx(truth, rel=0.015)
        assert not start or abs(found.value - truth) < found.high - found.low


def test_the_right_model_has_no_delay_where_its_step_lies_inside_the_recording(folder: Path) -> None:
    (agreement,) = validate("ppafo2011", [folder / "step.csv"], overrides=SUPPLIES).recordings
    assert agreement.delay.value == pytest.approx(0.0, abs=1.5e-4)
    assert max(channel.fraction for channel in agreement.channels) < 0.005
