"""A recording whose step comes in its middle, by a simulator that holds the command: the right model explains it."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.analyses.identify import identify
from ppafo.analyses.validate import validate
from ppafo.signals import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.storage import write_csv
from tests.reference.bench import bench

AT_STEP = 0.1
THERE = ("supply.pressure=55 psi_g", "supply.dorsiflexion_pressure=55 psi_g")
BACK = (
    "supply.pressure=40 psi_g",
    "supply.dorsiflexion_pressure=40 psi_g",
    "motion.angle=130 deg",
    "initial.pressure_1=40 psi_g",
    "initial.pressure_2=atmosphere",
)
TRUTH = {
    "valves.proportional.discharge_coefficient": 0.113,
    "actuator.leak.area": 3.0e-7,
    "friction.viscous_damping": 0.032,
    "friction.static_torque": 0.45,
    "foot_plate.inertia": 0.0084,
}
PROBLEM = """
schema_version = 1
name = "held"
device.set = "ppafo2011"
[[trajectory.parameters]]
path = "valve.discharge_coefficient"
start = "0.1"
[[trajectory.parameters]]
path = "actuator.leak.area"
[[trajectory.parameters]]
path = "friction.viscous_damping"
[[trajectory.parameters]]
path = "friction.static_torque"
[[trajectory.parameters]]
path = "foot_plate.inertia"
[[trajectory.experiments]]
label = "there"
recording = "there.csv"
[[trajectory.experiments]]
label = "back"
recording = "back.csv"
"""


def record(path: Path, overrides: tuple[str, ...], command: float, seed: int) -> None:
    """One chamber leaks into the other for 0.1 s, then the valve opens; noise of sensors upon it."""
    scenario = load_scenario("step-response", ("motion.kind=free", *overrides))
    times = np.arange(501) * 1e-3
    random = np.random.default_rng(seed)
    columns = bench(scenario, [(0.0, 0.0), (AT_STEP, command)], times)
    names = (("angle", 9e-4, "rad"), ("pressure_1", 300.0, "Pa"), ("pressure_2", 300.0, "Pa"))
    channels = {
        name: Channel(values + deviation * random.standard_normal(times.size), unit)
        for values, (name, deviation, unit) in zip(columns, names, strict=True)
    }
    channels["command"] = Channel(np.where(times > AT_STEP - 1e-9, command, 0.0), "-")
    channels["supply_pressure"] = Channel(np.full(times.size, scenario.device.supply.pressure), "Pa")
    write_csv(path, Recording(path.stem, times, channels))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A step there and one back, each inside its recording."""
    home = tmp_path_factory.mktemp("held")
    record(home / "there.csv", THERE, 1.0, 0)
    record(home / "back.csv", BACK, -1.0, 1)
    return home


def test_the_right_model_is_no_misfit_where_its_step_lies_inside_the_recording(folder: Path) -> None:
    (folder / "problem.toml").write_text(PROBLEM)
    outcome = identify(folder / "problem.toml").found.trajectory
    assert outcome is not None
    assert outcome.conflict == ""
    for path, truth in TRUTH.items():
        found = outcome[path]
        assert found.verdict == "identified"
        # With a start taken from the samples at rest as exactly known, separate fits lowered the misfit by 97 of 5.
        assert abs(found.value - truth) < found.high - found.low


def test_the_right_model_has_no_delay_where_its_step_lies_inside_the_recording(folder: Path) -> None:
    (agreement,) = validate("ppafo2011", [folder / "there.csv"], overrides=THERE).found.recordings
    assert agreement.delay == pytest.approx(0.0, abs=1.5e-4)
    assert max(channel.fraction for channel in agreement.channels) < 0.005
