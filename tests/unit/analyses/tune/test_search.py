"""The search and its judging, on functions whose best points are known."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ppafo.analyses.tuning import (
    INFEASIBLE,
    UNUSABLE,
    ObjectiveTerm,
    Problem,
    Robust,
    SearchEffort,
    agreement,
    judge,
    search,
)
from ppafo.simulation.loading import load_scenario
from ppafo.studies.distributions import Distribution, Floats
from ppafo.studies.draws import Uncertainty
from ppafo.studies.limits import MetricLimit
from ppafo.studies.study import RandomValue
from ppafo.studies.varying import distribution_in, varied_path
from ppafo.study.runs import Rows

EFFORT = SearchEffort(starts=3, generations=200, candidates_per_gain=12, seed=4)
SCALES = {"rms_error": 2.0, "gas_supplied": 1.0}


def problem(**changes: Any) -> Problem:
    """A problem with one goal and one constraint; what is searched does not matter here."""
    given: dict[str, Any] = {
        "name": "trial",
        "description": "",
        "scenario": load_scenario("torque-task-proportional"),
        "searched": (),
        "goals": (ObjectiveTerm("rms_error"),),
        "constraints": (MetricLimit("gas_supplied", 0.5, True, "500 g"),),
        "effort": EFFORT,
    }
    return Problem(**(given | changes))


def runs(error: list[list[float]], gas: list[list[float]], failed: list[list[bool]] | None = None) -> Rows:
    """Runs of candidates (rows) over draws (columns)."""
    unusable = np.zeros(np.shape(error), bool) if failed is None else np.array(failed)
    judged = {"judged_rms_error": np.array(error), "judged_gas_supplied": np.array(gas)}
    return judged | {"unusable": unusable, "off": np.zeros(np.shape(error))}


def bowl(best: Floats) -> Any:
    """A function with its least value 0 at a point, and many shallow valleys around it."""

    def costs(shares: Floats) -> Floats:
        away = shares - best
        return np.asarray(np.sum(10.0 * away**2 + 0.3 * (1.0 - np.cos(20.0 * away)), axis=1))

    return costs


def test_the_least_of_many_valleys_is_found_from_every_start() -> None:
    best = np.array([0.31, 0.72, 0.08])
    starts = search(bowl(best), [0.9, 0.9, 0.9], EFFORT)
    assert len(starts) == 3
    for start in starts:
        assert start.fractions == pytest.approx(best, abs=5e-3)
        assert list(start.generations) == sorted(start.generations, reverse=True)
        assert start.is_settled
    assert [start.cost for start in starts] == sorted(start.cost for start in starts)
    assert agreement(starts) < 0.01


def test_a_search_is_the_same_every_time_for_a_seed_and_another_for_another() -> None:
    costs = bowl(np.array([0.5, 0.5]))
    one, other = (search(costs, [0.1, 0.1], EFFORT) for _ in range(2))
    assert one == other
    assert one != search(costs, [0.1, 0.1], SearchEffort(starts=3, generations=200, candidates_per_gain=12, seed=5))


def test_the_values_before_are_among_the_candidates_so_that_nothing_is_lost() -> None:
    needle = np.array([0.123456, 0.654321])

    def costs(shares: Floats) -> Floats:
        return np.where(np.all(np.abs(shares - needle) < 1e-9, axis=1), 0.0, 1.0 + shares[:, 0])

    assert (
        search(costs, needle.tolist(), SearchEffort(starts=1, generations=3, candidates_per_gain=5, seed=1))[0].cost
        == 0.0
    )
    assert (
        search(costs, [1.5, 0.5], SearchEffort(starts=1, generations=3, candidates_per_gain=5, seed=1))[0].cost >= 1.0
    )


def test_two_minima_that_are_as_good_are_told_apart() -> None:
    def costs(shares: Floats) -> Floats:
        return np.asarray(1.0 + np.minimum((shares[:, 0] - 0.1) ** 2, (shares[:, 0] - 0.9) ** 2))

    starts = search(costs, [0.5], SearchEffort(starts=12, generations=100, candidates_per_gain=8, seed=1))
    assert agreement(starts) == pytest.approx(0.8, abs=0.02)


def test_a_flat_valley_that_is_not_along_an_axis_is_followed_to_its_end() -> None:
    """A few generations of Rosenbrock's valley end a hundredth above the least cost, which is 1."""

    def costs(shares: Floats) -> Floats:
        x, y = 4.0 * shares.T - 2.0
        return np.asarray(1.0 + 0.1 * (1.0 - x) ** 2 + 10.0 * (y - x**2) ** 2)

    for seed in range(3):
        (start,) = search(costs, [0.1, 0.9], SearchEffort(starts=1, generations=12, candidates_per_gain=6, seed=seed))
        assert start.cost == pytest.approx(1.0, abs=1e-3)


def test_feasible_comes_before_infeasible_and_both_before_failed() -> None:
    judged = judge(
        runs([[9.0], [0.1], [0.1], [0.2]], [[0.5], [0.6], [0.9], [0.1]], [[False], [False], [False], [True]]),
        problem(),
        SCALES,
    )
    assert ((judged["violation"] == 0.0) & (judged["without_value"] == 0.0)).tolist() == [True, False, False, False]
    assert judged["cost"][0] == 4.5
    assert judged["violation"][:3] == pytest.approx([0.0, 0.2, 0.8])
    assert judged["cost"][0] < INFEASIBLE < judged["cost"][1] < judged["cost"][2] < UNUSABLE < judged["cost"][3]


def test_a_loop_that_does_not_follow_is_behind_those_that_do_however_little_it_costs() -> None:
    tried = runs([[9.0], [0.1], [0.2]], [[0.5], [0.1], [0.1]])
    judged = judge(tried | {"off": np.array([[0.0], [0.2], [1.5]])}, problem(), SCALES)
    assert judged["cost"][0] == 4.5
    assert judged["cost"][0] < INFEASIBLE < judged["cost"][1] < judged["cost"][2] < UNUSABLE


def test_a_run_without_the_metric_counts_as_failed() -> None:
    judged = judge(runs([[np.nan, 1.0]], [[0.1, 0.1]]), problem(), SCALES)
    assert judged["without_value"].tolist() == [0.5]
    assert np.isfinite(judged["cost"][0])


@pytest.mark.parametrize(("share", "deviations"), [(None, 2.0), (0.75, 0.0)])
def test_candidates_are_judged_by_their_bad_end(share: float | None, deviations: float) -> None:
    drawn = Uncertainty((RandomValue("x", Distribution("normal", (0.0, 1.0))),))
    measure = Robust("x", "quantile", share=share) if share else Robust("x", deviations=deviations)
    given = problem(uncertainty=drawn, draws=5, robust=measure)
    values = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    goals = (ObjectiveTerm("rms_error"), ObjectiveTerm("gas_supplied", -1.0))
    judged = judge(runs([values.tolist()], [values.tolist()]), replace(given, goals=goals, constraints=()), SCALES)
    high = 4.0 if share else 3.0 + 2.0 * np.std(values, ddof=1)
    low = 2.0 if share else 3.0 - 2.0 * np.std(values, ddof=1)
    assert judged["objective"][0] == pytest.approx(high / 2.0 - low)


def test_a_place_in_logarithmic_bounds_is_a_fraction() -> None:
    scenario = load_scenario("torque-task-proportional")
    place = varied_path("controller.proportional_gain", scenario)
    ends = {"kind": "log_uniform", "minimum": "0.01 1/(N m)", "maximum": "1 1/(N m)"}
    between = distribution_in(ends, place)
    assert between.values(np.array([0.0, 0.5, 1.0])) == pytest.approx([0.01, 0.1, 1.0])
    assert between.fraction(0.1) == pytest.approx(0.5)
    assert between.fraction(2.0) > 1.0
