"""A small study that has everything: two configurations, a grid, correlated distributions, bands, several chunks."""

import copy
from collections.abc import Callable
from typing import Any

import pytest

SMALL: dict[str, Any] = {
    "schema_version": 1,
    "name": "small",
    "runs_of_chunk": 5,
    "configurations": [
        {"name": "proportional", "scenario": "torque-task-proportional", "overrides": ["run.duration=0.2 s"]},
        {"name": "solenoid", "scenario": "torque-task-solenoid", "overrides": ["run.duration=0.2 s"]},
    ],
    "vary": [
        {"path": "reference.level", "kind": "list", "values": ["3 N m", "6 N m"]},
        {"path": "supply.pressure", "kind": "uniform", "minimum": "40 psi_g", "maximum": "60 psi_g"},
        {"path": "actuator.leak.area", "kind": "log_normal", "median": "0.3 mm^2", "factor": 1.2},
    ],
    "correlations": [{"between": ["supply.pressure", "actuator.leak.area"], "coefficient": -0.6}],
    "sample": {"method": "sobol", "runs": 8, "seed": 3},
    "outputs": {
        "metrics": ["rms_error", "gas_supplied"],
        "trajectories": ["torque"],
        "bands": ["torque", "pressure_1"],
        "every": "20 ms",
    },
}

Document = dict[str, Any]


@pytest.fixture(scope="session")
def small_study() -> Document:
    """The study as data, not to be changed."""
    return SMALL


@pytest.fixture
def small() -> Document:
    """The study as data, free to be changed."""
    return copy.deepcopy(SMALL)


@pytest.fixture
def varying(small: Document) -> Callable[..., Document]:
    """The study with other tables to vary, random draws and nothing but one metric kept."""

    def changed(*vary: Document, runs: int = 8, method: str = "random", seed: int = 3) -> Document:
        small["vary"] = list(vary)
        small["outputs"] = {"metrics": ["rms_error"]}
        small.pop("correlations", None)
        small["sample"] = {"method": method, "runs": runs, "seed": seed}
        return small

    return changed
