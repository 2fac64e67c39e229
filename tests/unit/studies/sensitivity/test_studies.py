"""Sensitivity over the distributions of a study file."""

import numpy as np
import pytest

from ppafo.errors import StudyError
from ppafo.studies.sensitivity import sensitivity

pytest.importorskip("SALib")

STUDY = "torque-task-uncertainty"


def test_what_matters_for_the_error_and_what_for_the_gas() -> None:
    found = sensitivity(
        STUDY, metrics=["rms_error", "gas_supplied"], samples=256, configuration="proportional", independent=True
    )
    error, gas = (dict(zip(found.paths, metric.indices.values["total"], strict=True)) for metric in found.metrics)
    assert {path for path, share in error.items() if share > 0.1} == {"supply.pressure", "actuator.torque_constant"}
    assert max(gas, key=lambda path: gas[path]) == "actuator.leak.area"
    assert np.sum(found.metrics[0].indices.values["first"]) == pytest.approx(1.0, abs=0.1)
    assert found.runs == 256 * 10


def test_mistakes_are_one_line() -> None:
    with pytest.raises(StudyError, match="no method 'sobl', did you mean 'sobol'"):
        sensitivity(STUDY, "sobl")
    with pytest.raises(StudyError, match="choose one: proportional, solenoid"):
        sensitivity(STUDY)
    with pytest.raises(StudyError, match="--independent"):
        sensitivity(STUDY, configuration="solenoid", samples=64)
    with pytest.raises(StudyError, match="no metric 'gas'; known are rms_error"):
        sensitivity(STUDY, metrics=["gas"], configuration="solenoid")
