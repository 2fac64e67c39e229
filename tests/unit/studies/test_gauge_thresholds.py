"""Thresholds in gauge pressure count from the atmosphere of the scenario, wherever a question takes one."""

from typing import Any

import pytest

import ppafo
from ppafo.errors import StudyError
from ppafo.questions.find import solve as find_module
from ppafo.questions.montecarlo import solve as montecarlo_module
from ppafo.questions.montecarlo.statistic import Statistic, parse_statistic
from ppafo.simulation.loading import load_scenario
from ppafo.studies.outcomes import atmosphere_of, level_of

TASK, METRIC, ATMOSPHERE = "torque-task-proportional", "largest_pressure", "supply.atmospheric_pressure"
HIGH_UP = (f"{ATMOSPHERE}=80 kPa_a", "supply.pressure=400 kPa_a")
REFUSED = rf"50 kPa_g'.*: a gauge pressure counts from {ATMOSPHERE}, which varies here; give an absolute pressure"


def study(path: str, minimum: str, maximum: str) -> dict[str, Any]:
    """A study high above the sea in which one path is drawn."""
    overrides = [text for text in HIGH_UP if not text.startswith(path)]
    return {
        "schema_version": 1,
        "name": "high-up",
        "configurations": [{"name": "high-up", "scenario": TASK, "overrides": overrides}],
        "sample": {"method": "random", "runs": 8, "seed": 1},
        "vary": [{"path": path, "kind": "uniform", "minimum": minimum, "maximum": maximum}],
        "outputs": {"metrics": [METRIC]},
    }


def tuning(path: str, minimum: str, maximum: str) -> dict[str, Any]:
    """A tuning high above the sea that searches one path under a limit on the pressure."""
    return {
        "schema_version": 1,
        "name": "high-up",
        "scenario": TASK,
        "overrides": list(HIGH_UP),
        "search": [{"path": path, "minimum": minimum, "maximum": maximum}],
        "objective": [{"metric": "rms_error"}],
        "constraints": [{"metric": METRIC, "at_most": "50 kPa_g"}],
    }


def test_a_level_counts_from_the_atmosphere_that_it_is_given_and_an_absolute_one_from_none() -> None:
    assert level_of("50 kPa_g", METRIC, "limit", 80.0e3) == pytest.approx(130.0e3)
    assert level_of("130 kPa_a", METRIC, "limit", None) == pytest.approx(130.0e3)
    assert level_of("3 N m", "rms_error", "limit", None) == 3.0
    scenario = load_scenario(TASK, HIGH_UP)
    assert atmosphere_of(scenario, ["supply.pressure"]) == pytest.approx(80.0e3)
    assert atmosphere_of(scenario, [ATMOSPHERE]) is None
    with pytest.raises(StudyError, match=f"'{REFUSED}"):
        level_of("50 kPa_g", METRIC, "'50 kPa_g'", None)


def test_a_condition_of_find_counts_from_the_atmosphere_of_the_scenario(monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    limits: list[float] = []
    monkeypatch.setattr(
        find_module, "_Search", lambda _path, condition, *_: limits.append(condition.limit) or stopped()
    )
    with pytest.raises(KeyboardInterrupt):
        ppafo.find(TASK, "supply.pressure=200..300 kPa_a", f"{METRIC} <= 50 kPa_g", overrides=HIGH_UP)
    assert limits == [pytest.approx(130.0e3)]
    with pytest.raises(StudyError, match=REFUSED):
        ppafo.find(TASK, f"{ATMOSPHERE}=70..90 kPa_a", f"{METRIC} <= 50 kPa_g", overrides=HIGH_UP)


def test_a_probability_counts_from_the_atmosphere_of_the_scenario(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Statistic] = []
    monkeypatch.setattr(montecarlo_module, "draw_until", lambda *given: asked.append(given[3]))
    ppafo.monte_carlo(study("supply.pressure", "300 kPa_a", "400 kPa_a"), METRIC, "probability above 50 kPa_g")
    assert asked == [parse_statistic("probability above 50 kPa_g", METRIC, 80.0e3)]
    with pytest.raises(StudyError, match=REFUSED):
        ppafo.monte_carlo(study(ATMOSPHERE, "70 kPa_a", "90 kPa_a"), METRIC, "probability above 50 kPa_g")


def test_a_constraint_of_a_tuning_counts_from_the_atmosphere_of_the_scenario() -> None:
    (constraint,) = ppafo.load_tuning(tuning("supply.pressure", "200 kPa_a", "400 kPa_a")).constraints
    assert constraint.limit == pytest.approx(130.0e3)
    with pytest.raises(StudyError, match=REFUSED):
        ppafo.load_tuning(tuning(ATMOSPHERE, "70 kPa_a", "90 kPa_a"))
