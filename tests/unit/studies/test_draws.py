"""Draws, what comes of them, and their intervals."""

import math
from typing import Any

import numpy as np
import pytest

from ppafo.errors import StudyError
from ppafo.simulation.loading import load_scenario
from ppafo.studies.draws import uncertainty_of
from ppafo.studies.intervals import effective_sample_size, fraction_interval, replicates_interval
from ppafo.studies.limits import MetricLimit, check_metrics
from ppafo.studies.loading import drawn_in, load_study


def study(**changes: Any) -> dict[str, Any]:
    """A small study with two uncertain values in two configurations."""
    document: dict[str, Any] = {
        "schema_version": 1,
        "name": "small",
        "configurations": [
            {"name": "proportional", "scenario": "torque-task-proportional"},
            {"name": "solenoid", "scenario": "torque-task-solenoid"},
        ],
        "vary": [
            {"path": "supply.pressure", "kind": "normal", "mean": "50 psi_g", "standard_deviation": "2 psi_d"},
            {"path": "valve.area", "kind": "uniform", "minimum": "10 mm^2", "maximum": "12 mm^2"},
            {"path": "actuator.leak.area", "kind": "uniform", "minimum": "0.2 mm^2", "maximum": "0.4 mm^2"},
        ],
        "correlations": [
            {"between": ["supply.pressure", "valve.area"], "coefficient": 0.8},
            {"between": ["valve.area", "actuator.leak.area"], "coefficient": -0.5},
        ],
        "sample": {"method": "sobol", "runs": 64, "seed": 3},
        "outputs": {"metrics": ["rms_error"]},
    }
    return document | changes


def test_draws_in_pieces_are_those_of_the_whole() -> None:
    uncertainty = uncertainty_of(load_study(study()))
    whole = uncertainty.random_columns(0, 1000, 7)
    pieces = [uncertainty.random_columns(first, count, 7) for first, count in ((0, 300), (300, 450), (750, 250))]
    for path, values in whole.items():
        assert np.array_equal(values, np.concatenate([piece[path] for piece in pieces]))


def test_draws_have_the_distributions_and_the_correlation_of_the_study() -> None:
    columns = uncertainty_of(load_study(study())).random_columns(0, 20_000, 1)
    pressure, area = columns["supply.pressure"], columns["valve.area"]
    assert np.mean(pressure) == pytest.approx(101325.0 + 50 * 6894.757, rel=1e-3)
    assert np.std(pressure) == pytest.approx(2 * 6894.757, rel=0.02)
    assert (area.min() >= 10e-6, area.max() <= 12e-6) == (True, True)
    assert np.corrcoef(pressure, area)[0, 1] == pytest.approx(0.78, abs=0.02)  # 0.8 of the normal scores


def test_what_varies_in_one_configuration_only_keeps_the_correlation_among_the_rest() -> None:
    document = study()
    document["vary"][0]["only"] = ["solenoid"]
    _, _, uncertainty = drawn_in(document, (), "proportional")
    assert uncertainty.paths == ("valve.area", "actuator.leak.area")
    columns = uncertainty.random_columns(0, 20_000, 1)
    found = np.corrcoef(columns["valve.area"], columns["actuator.leak.area"])[0, 1]
    assert found == pytest.approx(
        6.0 / np.pi * np.arcsin(-0.5 / 2.0), abs=0.02
    )  # rank correlation, as both are uniform


def test_a_choice_of_configurations_is_not_made_in_silence() -> None:
    whole = load_study(study())
    with pytest.raises(StudyError, match="has several configurations; choose one: proportional, solenoid"):
        drawn_in(whole, (), None)
    with pytest.raises(StudyError, match="no configuration 'solenoids', did you mean 'solenoid'"):
        drawn_in(whole, (), "solenoids")


def test_the_interval_of_a_mean_is_the_one_of_student_over_replicates() -> None:
    from scipy import stats

    values = np.random.default_rng(1).normal(3.0, 2.0, 64)
    interval = replicates_interval(values, 4, 0.9)
    known = stats.ttest_1samp([values[number::4].mean() for number in range(4)], 0.0).confidence_interval(0.9)
    assert (interval.low, interval.high) == pytest.approx((known.low, known.high), rel=1e-12)
    assert interval.value == pytest.approx(values.mean())
    assert replicates_interval(values[:3], 4, 0.9).width == math.inf


def test_one_large_draw_carries_a_mean_alone_and_normal_draws_all_do() -> None:
    random = np.random.default_rng(1)
    assert effective_sample_size(np.array([0.0] * 499 + [1.0])) == pytest.approx(1.0, rel=0.01)
    assert effective_sample_size(random.normal(size=500)) == 500.0
    assert effective_sample_size(random.exponential(size=100_000)) == pytest.approx(25_000, rel=0.2)
    assert effective_sample_size(np.ones(7)) == 7.0


@pytest.mark.parametrize(("hits", "draws"), [(0, 40), (3, 40), (40, 40), (250, 1000)])
def test_the_interval_of_a_share_is_the_exact_one(hits: int, draws: int) -> None:
    from scipy import stats

    interval = fraction_interval(hits, draws, 0.95)
    known = stats.binomtest(hits, draws).proportion_ci(0.95, "exact")
    assert (interval.low, interval.high) == pytest.approx((known.low, known.high), abs=1e-12)


def test_a_limit_is_kept_at_itself_and_never_without_a_value() -> None:
    most, least = MetricLimit("rms_error", 0.5, True, "0.5 N m"), MetricLimit("rms_error", 0.5, False, "0.5 N m")
    values = np.array([0.4, 0.5, 0.6, np.nan])
    assert most.is_kept(values).tolist() == [True, True, False, False]
    assert least.is_kept(values).tolist() == [False, True, True, False]
    assert (most.words, least.words) == ("at most 0.5 N m", "at least 0.5 N m")


def test_what_is_drawn_in_a_configuration_has_the_noise_and_can_leave_correlations_out() -> None:
    study, base, uncertainty = drawn_in("torque-task-uncertainty", (), "proportional")
    assert (study.name, base.name) == ("torque-task-uncertainty", "proportional")
    assert uncertainty.scores is not None
    assert drawn_in(study, (), "proportional", independent=True)[2].scores is None


def test_metrics_are_checked_before_anything_runs() -> None:
    closed, opened = load_scenario("torque-task-proportional"), load_scenario("step-response")
    for names, scenario in ((["rms_eror"], closed), (["rms_error"], opened), (["peak_error", "peak_error"], closed)):
        with pytest.raises(StudyError, match=r"did you mean|no reference|named twice"):
            check_metrics(names, scenario)
