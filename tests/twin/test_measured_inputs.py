"""A regulator that gives way under load: the simulated bench, in shorter steps, records it, and the fit follows."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.analyses.identify import identify
from ppafo.identification.trajectory.fitting import TrajectoryFit
from ppafo.rig.experiments import record
from ppafo.storage import write_csv

DROOPING = (
    "supply_line.plantarflexion.droop=2e7 Pa s/kg",
    "run.duration=0.4 s",
    "valve.discharge_coefficient=0.12",
)
HEAD = """
schema_version = 1
name = "drooping"
device.set = "ppafo2011"
[[trajectory.parameters]]
path = "valve.discharge_coefficient"
[[trajectory.parameters]]
path = "friction.viscous_damping"
[[trajectory.experiments]]
label = "step"
recording = "step.csv"
scenario = "step-response"
step = "0.1 ms"
"""
TRUTH = {"valves.proportional.discharge_coefficient": 0.12, "friction.viscous_damping": 0.032}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the recording."""
    home = tmp_path_factory.mktemp("drooping")
    write_csv(home / "step.csv", record("step-response", "ideal-laboratory", 3, overrides=DROOPING).recording)
    return home


def fitted(folder: Path, more: str) -> TrajectoryFit:
    (folder / "problem.toml").write_text(f"{HEAD}{more}")
    outcome = identify(folder / "problem.toml").found.trajectory
    assert outcome is not None
    return outcome


def test_true_values_are_found_where_the_run_follows_the_recorded_supply(folder: Path) -> None:
    found = fitted(folder, 'inputs = ["supply_pressure"]\n')
    supply = found.problem.experiments[0].recording["supply_pressure"]
    assert np.ptp(supply) > 3.0e4
    for path, true in TRUTH.items():
        assert found[path].value == pytest.approx(true, rel=5e-3), path
    assert max(channel.rms / channel.span for channel in found.channels) < 2e-3


def test_a_supply_taken_as_constant_within_its_tolerance_is_found_as_misfit(folder: Path) -> None:
    found = fitted(folder, "")
    assert found.conflict
    assert {estimate.verdict for estimate in found.estimates} == {"holds for this model only"}
