"""One pressure for both regulators in sweeps too, and ``same_as`` ties any two paths of a study."""

import copy
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.errors import StudyError
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.numbers import with_numbers
from ppafo.studies.loading import drawn_in, load_study
from ppafo.study.blocks import drawn_values, varied_columns

STUDY: dict[str, Any] = {
    "schema_version": 1,
    "name": "tied",
    "configurations": [{"name": "one", "scenario": "torque-task-proportional"}],
    "sample": {"method": "random", "runs": 8, "seed": 1},
    "vary": [
        {
            "path": "actuator.dead_volume_1",
            "kind": "log_normal",
            "median": "2 cm^3",
            "factor": 1.5,
        },
        {"path": "actuator.dead_volume_2", "same_as": "actuator.dead_volume_1"},
    ],
    "outputs": {"metrics": ["rms_error"]},
}


def study(**changes: Any) -> dict[str, Any]:
    """The study with some of its second table changed."""
    document = copy.deepcopy(STUDY)
    document["vary"][1] |= changes
    return document


def test_path_that_follows_another_has_its_values_in_every_run() -> None:
    loaded = load_study(STUDY)
    assert loaded.paths == ("actuator.dead_volume_1",)
    values = varied_columns(loaded, loaded.configurations[0], drawn_values(loaded, np.arange(8)))
    assert len(set(values["actuator.dead_volume_1"])) == 8
    assert np.array_equal(values["actuator.dead_volume_2"], values["actuator.dead_volume_1"])


def test_a_study_with_such_a_path_is_swept() -> None:
    results = ppafo.sweep(STUDY, draws=2).found
    assert results.varied == ("actuator.dead_volume_1",)
    assert results.summary["completed"] == 2


def test_path_follows_in_the_draws_of_analyses_too() -> None:
    _, _, uncertainty = drawn_in(STUDY, (), None)
    assert uncertainty.paths == ("actuator.dead_volume_1",)
    columns = uncertainty.random_columns(0, 5, 1)
    assert np.array_equal(columns["actuator.dead_volume_2"], columns["actuator.dead_volume_1"])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"same_as": "actuator.dead_volume_3"},
            "must be the path of another \\[\\[vary\\]\\] without same_as, did you mean 'actuator.dead_volume_1'",
        ),
        ({"path": "supply.pressure"}, "has the unit 'm\\^3', but 'supply.pressure' has 'Pa_a'"),
        ({"only": ["three"]}, "there is no configuration 'three'"),
    ],
)
def test_path_that_cannot_follow_is_refused_in_one_line(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(StudyError, match=message) as refused:
        load_study(study(**changes))
    assert len(str(refused.value).splitlines()) == 1


def test_column_of_the_supply_pressure_is_that_of_both_regulators() -> None:
    scenario = load_scenario("torque-task-proportional", ["run.duration=0.3 s", "reference.level=-3 N m"])
    pressures = np.array([4.0e5, 5.0e5])
    both = {"supply.pressure": pressures, "supply.dorsiflexion_pressure": pressures}
    apart = {"supply.pressure": pressures, "supply.dorsiflexion_pressure": np.full(2, 4.5e5)}
    one, two, other = (
        run_ensemble(scenario, columns, ["gas_supplied"]).metrics["gas_supplied"]
        for columns in ({"supply.pressure": pressures}, both, apart)
    )
    assert np.array_equal(one, two)
    assert not np.array_equal(one, other)


def test_second_pressure_that_is_apart_stays_where_it_is() -> None:
    scenario = load_scenario("step-response", ["supply.dorsiflexion_pressure=45 psi_g"])
    moved = with_numbers(scenario, {"supply.pressure": 5.0e5}).device.supply
    assert (moved.pressure, moved.dorsiflexion_pressure) == (5.0e5, scenario.device.supply.dorsiflexion_pressure)


def test_a_correlation_of_1_varies_two_numbers_by_one_factor() -> None:
    document = copy.deepcopy(STUDY)
    ranges = {"friction.static_torque": ("0.7 N m", "1.3 N m"), "friction.dynamic_torque": ("0.56 N m", "1.04 N m")}
    document["vary"] = [
        {"path": path, "kind": "uniform", "minimum": low, "maximum": high} for path, (low, high) in ranges.items()
    ]
    document["correlations"] = [{"between": list(ranges), "coefficient": 1.0}]
    loaded = load_study(document)
    static, dynamic = drawn_values(loaded, np.arange(8)).values()
    assert np.ptp(static) > 0.1
    # 0.56 / 0.7 and 1.04 / 1.3.
    assert dynamic / static == pytest.approx(np.full(8, 0.8), rel=1e-4)
