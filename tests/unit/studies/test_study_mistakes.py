"""Study files that cannot be meant as they stand: one line each that names the key and what is allowed."""

from collections.abc import Callable
from typing import Any

import pytest

from ppafo.errors import StudyError
from ppafo.studies.loading import list_studies, load_study

AREA = {"path": "valve.area", "kind": "uniform", "minimum": "10 mm^2", "maximum": "12 mm^2"}
LEAK = AREA | {"path": "actuator.leak.area"}
CD = {"path": "valve.discharge_coefficient", "kind": "uniform", "minimum": 0.1, "maximum": 0.2}
CONTRADICTIONS = [
    ({"kind": "uniform", "minimum": "12 mm^2", "maximum": "10 mm^2"}, "minimum = '12 mm^2' must be less than maximum"),
    ({"kind": "log_uniform", "minimum": "0 mm^2", "maximum": "10 mm^2"}, "must be above 0"),
    (
        {"kind": "uniform", "minimum": "-1 mm^2", "maximum": "1 mm^2"},
        "minimum = '-1 mm^2': valve.area must be at least",
    ),
    ({"kind": "uniform", "minimum": "1 mm", "maximum": "2 mm^2"}, "minimum = '1 mm': unit 'mm' does not fit"),
    ({"kind": "uniform", "minimum": "1 mm^2", "maximum": "wide"}, "maximum = 'wide': 'wide' does not start with a"),
    ({"kind": "normal", "mean": "10 mm^2", "standard_deviation": "-1 mm^2"}, "standard_deviation = '-1 mm^2' must be"),
    ({"kind": "triangular", "minimum": "1 mm^2", "mode": "9 mm^2", "maximum": "3 mm^2"}, "mode = '9 mm^2' must lie"),
    ({"kind": "choice", "values": ["1 mm^2", "2 mm^2"], "weights": [1.0]}, "weights has 1 numbers, values has 2"),
    ({"kind": "choice", "values": ["1 mm^2", "2 mm^2"], "weights": [2.0, -1.0]}, "must be at least 0"),
    (
        {"kind": "grid", "first": "0 mm^2", "last": "1 mm^2", "count": 3, "spacing": "logarithmic"},
        "needs first and last above 0",
    ),
    ({"kind": "grid", "first": "1 mm^2", "last": "2 mm^2", "count": 1}, "count = 1"),
    ({"kind": "unifrom", "minimum": "1 mm^2", "maximum": "2 mm^2"}, "did you mean 'uniform'?"),
    (
        {"path": "supply.pressure", "kind": "normal", "mean": "50 psi_g", "standard_deviation": "2 psi_g"},
        "a pressure difference is needed",
    ),
    (AREA | {"path": "valve.aera"}, "did you mean 'valve.area'?"),
    (AREA | {"path": "controller.kind"}, "has no numeric value 'controller.kind'"),
]


def refused(document: Any) -> str:
    """The message of the error, which has one line and names the study."""
    with pytest.raises(StudyError) as caught:
        load_study(document)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("study")
    return message


@pytest.mark.parametrize(("table", "expected"), CONTRADICTIONS)
def test_contradictory_tables_are_refused(varying: Callable[..., Any], table: Any, expected: str) -> None:
    assert expected in refused(varying({"path": "valve.area", **table}))


def test_a_path_must_exist_in_every_configuration_that_varies_it(varying: Callable[..., Any]) -> None:
    gain = {"path": "controller.proportional_gain", "kind": "list", "values": ["0.1 1/(N m)"]}
    document = varying(gain, CD)
    assert "scenario 'torque-task-solenoid' has no numeric value 'controller.proportional_gain'" in refused(document)
    document["vary"][0]["only"] = ["proportional"]
    assert load_study(document).only == {"controller.proportional_gain": ("proportional",)}
    document["vary"][0]["only"] = ["proportinal"]
    assert "did you mean 'proportional'?" in refused(document)


def test_a_path_is_varied_once(varying: Callable[..., Any]) -> None:
    assert "'valve.area' is varied twice" in refused(varying(AREA, CD, AREA))


def test_a_study_that_varies_nothing_is_refused_unless_it_compares(small: Any) -> None:
    for key in ("vary", "correlations", "sample"):
        del small[key]
    assert load_study(small).runs == 2
    del small["configurations"][1]
    assert "varies nothing" in refused(small)


@pytest.mark.parametrize(
    ("outputs", "expected"),
    [
        ({"metrics": ["rms_eror"]}, "there is no metric 'rms_eror', did you mean 'rms_error'?"),
        ({"metrics": ["rms_error", "rms_error"]}, "'rms_error' is named twice"),
        ({"bands": ["torque"], "every": "1 s"}, "at most run.duration = 0.2 s"),
        ({"bands": ["torque"], "every": "1 mm"}, "outputs.every = '1 mm'"),
    ],
)
def test_unknown_outputs_are_refused_with_the_nearest(small: Any, outputs: Any, expected: str) -> None:
    small["outputs"] = outputs
    assert expected in refused(small)


def test_the_duration_varies_only_where_nothing_is_kept_over_time(small: Any) -> None:
    small["vary"].append({"path": "run.duration", "kind": "list", "values": ["0.1 s", "0.2 s"]})
    assert "'run.duration' cannot vary with trajectories or bands" in refused(small)
    small["outputs"] = {"metrics": ["rms_error"]}
    assert "'run.duration=0.2 s' is set and 'run.duration' is varied" in refused(small)
    for table in small["configurations"]:
        table["overrides"] = [text for text in table["overrides"] if not text.startswith("run.duration")]
    assert load_study(small).runs == 64


def test_metrics_of_tracking_need_a_reference(varying: Callable[..., Any]) -> None:
    document = varying(AREA)
    document["configurations"] = [{"name": "step", "scenario": "step-response"}]
    assert "'rms_error': the controller has no reference" in refused(document)
    document["outputs"] = {"metrics": "all"}
    assert "rms_error" not in load_study(document).outputs.metrics
    assert "gas_supplied" in load_study(document).outputs.metrics


def test_correlations_that_cannot_hold_at_once_are_refused(varying: Callable[..., Any]) -> None:
    document = varying(AREA, LEAK, CD)
    pairs = [("valve.area", "actuator.leak.area", 0.6), ("valve.area", CD["path"], 0.6)]
    document["correlations"] = [{"between": [one, other], "coefficient": value} for one, other, value in pairs]
    assert load_study(document).scores is not None
    document["correlations"].append({"between": ["actuator.leak.area", CD["path"]], "coefficient": -0.9})
    assert "not positive definite (valve.area with actuator.leak.area: 0.6" in refused(document)


@pytest.mark.parametrize(
    ("between", "coefficient", "expected"),
    [
        (["valve.area", "valve.area"], 0.5, "must name two different paths"),
        (["valve.area", "actuator.leak.area"], 1.1, "at least -1 and at most 1"),
        (["valve.area", "reference.level"], 0.5, "'reference.level' has no distribution"),
    ],
)
def test_single_correlations_are_checked(
    varying: Callable[..., Any], between: list[str], coefficient: float, expected: str
) -> None:
    document = varying(AREA, LEAK, {"path": "reference.level", "kind": "list", "values": ["5 N m"]})
    document["correlations"] = [{"between": between, "coefficient": coefficient}]
    assert expected in refused(document)


@pytest.mark.parametrize("name", list_studies())
def test_studies_of_the_package_load_under_their_own_name(name: str) -> None:
    study = load_study(name)
    assert study.name == name
    assert study.description
    assert study.runs >= 30
