import math
from pathlib import Path
from typing import Any

import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.trajectory import Experiment, fit
from ppafo.identification.trajectory.section import trajectory_from_dict
from ppafo.storage.comma_separated import write_csv


@pytest.fixture
def content(tmp_path: Path, experiment: Experiment) -> dict[str, Any]:
    """A section of a problem file and, in a folder, the recording that it names."""
    write_csv(tmp_path / "step.csv", experiment.recording)
    return {
        "parameters": [
            {"path": "foot_plate.inertia", "start": "10 g m^2", "high": "20 g m^2"},
            {"path": "initial.pressure_2", "start": "50 psi_g", "recordings": ["step"]},
            {"path": "valve.discharge_coefficient", "prior": {"mean": "0.113", "relative": 0.1}},
        ],
        "experiments": [
            {
                "label": "step",
                "scenario": "step-response",
                "overrides": ["motion.kind=free"],
                "recording": "step.csv",
                "noise": {"angle": "0.1 deg", "pressure_1": "500 Pa_d"},
            }
        ],
    }


def test_a_section_becomes_a_problem_in_si_units(content: dict[str, Any], tmp_path: Path) -> None:
    problem = trajectory_from_dict(content, tmp_path)
    inertia, pressure, flow = problem.parameters
    assert (inertia.start, inertia.high) == (pytest.approx(0.010), pytest.approx(0.020))
    assert pressure.start == pytest.approx(101325.0 + 50.0 * 6894.757, rel=1e-6)
    assert flow.prior is not None
    assert flow.prior.standard_deviation == pytest.approx(0.0113)
    assert problem.experiments[0].noise["angle"] == pytest.approx(math.radians(0.1))


def test_a_problem_from_a_file_can_be_fitted_and_names_file_and_hash(content: dict[str, Any], tmp_path: Path) -> None:
    found = fit(trajectory_from_dict(content, tmp_path))
    inertia = found.estimate("foot_plate.inertia")
    assert inertia.value == pytest.approx(0.0084, rel=0.02)
    (source,) = inertia.recordings
    name, _, digest = source.partition(" sha256:")
    assert name == "step.csv"
    assert len(digest) == 64


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parameter": []}, "unknown key 'parameter'"),
        ({"loss": "cubic"}, "loss = 'cubic' is not allowed"),
        ({"parameters": [{"path": "foot_plate.inertia", "start": "10 kg"}]}, "'10 kg'"),
        ({"parameters": [{"path": "foot_plate.inertial"}]}, "did you mean"),
        ({"parameters": [{"path": "supply.pressure", "low": "50 psi"}]}, "low = '50 psi'"),
    ],
)
def test_a_mistake_in_a_section_is_named(
    content: dict[str, Any], tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    with pytest.raises(IdentificationError, match=message):
        trajectory_from_dict({**content, **change}, tmp_path, "problem.toml")
