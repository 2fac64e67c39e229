"""Sensitivity over the distributions of a study file."""

from importlib.util import find_spec

import numpy as np
import pytest

from ppafo.errors import StudyError
from ppafo.questions.sensitivity.answer import remarks
from ppafo.questions.sensitivity.solve import sensitivity

pytestmark = pytest.mark.skipif(not find_spec("SALib"), reason="needs the extra 'studies'")

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


def test_few_base_points_are_not_taken_for_interactions() -> None:
    found = sensitivity(STUDY, metrics=["gas_supplied"], samples=64, configuration="proportional", independent=True)
    (metric,) = found.metrics
    # The indices happen to sum to more than 1, of which no rest can be left.
    assert np.sum(metric.indices.values["first"]) > 1.0
    assert "interactions, if any, are within this error" in remarks(found, metric)[-1]


def test_the_study_of_the_package_with_its_correlation_gets_shapley_effects() -> None:
    found = sensitivity(STUDY, metrics=["gas_supplied"], samples=512, configuration="proportional")
    effects = dict(zip(found.paths, found.metrics[0].indices.values["shapley"], strict=True))
    assert found.method.name == "shapley"
    assert sum(effects.values()) == pytest.approx(1.0)
    assert max(effects, key=lambda path: effects[path]) == "actuator.leak.area"


@pytest.mark.parametrize("method", ["sobol", "morris"])
def test_noise_of_the_sensors_is_one_of_the_values_or_held_along_a_trajectory(method: str) -> None:
    noisy = ["run.duration=0.3 s", "sensors.pressure_noise=5 kPa_d"]
    found = sensitivity(
        STUDY, method, ["rms_error"], 64, "proportional", overrides=noisy, independent=True, maximum_failed=0.0
    )
    if method == "morris":
        assert "sensors.seed" not in found.paths
        assert found.metrics[0].indices.values["mean_effect"].size == 8
        return
    total = dict(zip(found.paths, found.metrics[0].indices.values["total"], strict=True))
    assert total["sensors.seed"] > 0.05
    assert found.runs == 64 * 11


def test_mistakes_are_one_line() -> None:
    with pytest.raises(StudyError, match="no method 'sobl', did you mean 'sobol'"):
        sensitivity(STUDY, "sobl")
    with pytest.raises(StudyError, match="choose one: proportional, solenoid"):
        sensitivity(STUDY)
    with pytest.raises(StudyError, match=r"--method shapley.*--independent"):
        sensitivity(STUDY, "sobol", configuration="solenoid", samples=64)
    with pytest.raises(StudyError, match="no metric 'gas'; available: rms_error"):
        sensitivity(STUDY, metrics=["gas"], configuration="solenoid")
