import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.source import Source
from ppafo.identification.trajectory import Experiment, fit
from ppafo.identification.trajectory.section import (
    ExperimentSection,
    Setting,
    TrajectorySection,
    trajectory_from_dict,
    trajectory_problem,
)
from ppafo.identification.trajectory.tolerances import Tolerances
from ppafo.parameters.loading import load_parameter_set
from ppafo.signals import Channel, Recording
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


BOTH = ["initial.pressure_1", "initial.pressure_2"]


@pytest.mark.parametrize(
    ("said", "tolerances", "fitted"),
    [
        ({}, Tolerances(), BOTH),
        ({"start": "48 ms"}, Tolerances(), BOTH),
        # One sample before the first command, or none.
        ({"start": "49 ms"}, Tolerances(), []),
        ({"start": "50 ms"}, Tolerances(), []),
        ({"channels": ("angle", "pressure_2")}, Tolerances(), ["initial.pressure_2"]),
        ({"held": "75 deg"}, Tolerances(), BOTH),
        ({"volume": "60 cm^3"}, Tolerances(), ["initial.pressure_1"]),
        ({"initial_state": "recording"}, Tolerances(), []),
        ({"initial_state": "fitted", "start": "50 ms"}, Tolerances(), BOTH),
        # A limit that the bench states for its starts is not replaced.
        ({}, Tolerances(start_of_pressure=2.0e3), BOTH),
    ],
)
def test_without_a_scenario_pressures_are_fitted_where_samples_precede_the_first_command(
    tmp_path: Path, said: dict[str, Any], tolerances: Tolerances, fitted: list[str]
) -> None:
    time = np.arange(200) * 1e-3
    noisy = np.random.default_rng(1).standard_normal((3, time.size))
    channels = {
        "angle": Channel(0.6 + 1e-3 * noisy[0], "rad"),
        "pressure_1": Channel(1.1e5 + 300.0 * noisy[1], "Pa"),
        "pressure_2": Channel(4.8e5 + 300.0 * noisy[2], "Pa"),
        "command": Channel(np.where(time > 0.0495, 1.0, 0.0), "-"),
    }
    recording = Recording("step", time, channels)
    section = TrajectorySection.model_validate(
        {
            "parameters": [{"path": "valve.discharge_coefficient"}],
            "experiments": [{"label": "step", "recording": "step.csv", **said}],
        }
    )

    def read(_: ExperimentSection) -> Source:
        return Source(recording, "step.csv")

    setting = Setting(read, tmp_path, "problem.toml", load_parameter_set("ppafo2011"), tolerances=tolerances)
    added = trajectory_problem(section, setting).parameters[1:]
    assert [one.path for one in added] == fitted
    assert all(one.is_tolerance == (tolerances.start_of_pressure > 0.0) for one in added)
    own = section.parameters[0].model_copy(update={"path": "initial.pressure_2"})
    alone = section.model_copy(update={"parameters": (own,)})
    paths = [one.path for one in trajectory_problem(alone, setting).parameters]
    assert sorted(paths) == sorted({*fitted, "initial.pressure_2"})
