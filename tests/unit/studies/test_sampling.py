"""Draws: the right distributions, the right correlation, and the same draw wherever it is asked for."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from ppafo.studies.distributions import Distribution
from ppafo.studies.draws import cholesky_factor, permute, uniform_numbers
from ppafo.studies.loading import load_study
from ppafo.studies.study import SamplingPlan
from ppafo.study.blocks import drawn_values

SHARES = np.linspace(1e-6, 1.0 - 1e-6, 201)
METHODS = ("random", "latin_hypercube", "sobol")


@pytest.mark.parametrize(
    ("distribution", "expected"),
    [
        (Distribution("uniform", (2.0, 5.0)), lambda stats: stats.uniform(2.0, 3.0)),
        (Distribution("log_uniform", (0.1, 7.0)), lambda stats: stats.loguniform(0.1, 7.0)),
        (Distribution("normal", (-3.0, 0.5)), lambda stats: stats.norm(-3.0, 0.5)),
        (Distribution("truncated_normal", (1.0, 2.0, -0.5, 4.0)), lambda stats: stats.truncnorm(-0.75, 1.5, 1.0, 2.0)),
        (Distribution("truncated_normal", (1.0, 2.0, 15.0, 17.0)), lambda stats: stats.truncnorm(7.0, 8.0, 1.0, 2.0)),
        (
            Distribution("truncated_normal", (1.0, 2.0, -15.0, -13.0)),
            lambda stats: stats.truncnorm(-8.0, -7.0, 1.0, 2.0),
        ),
        (Distribution("log_normal", (3.0, 1.3)), lambda stats: stats.lognorm(np.log(1.3), scale=3.0)),
        (Distribution("triangular", (1.0, 2.0, 5.0)), lambda stats: stats.triang(0.25, 1.0, 4.0)),
        (Distribution("triangular", (1.0, 5.0, 5.0)), lambda stats: stats.triang(1.0, 1.0, 4.0)),
    ],
)
def test_distributions_are_the_inverses_of_those_of_scipy(
    distribution: Distribution, expected: Callable[[Any], Any]
) -> None:
    from scipy import stats

    np.testing.assert_allclose(distribution.values(SHARES), expected(stats).ppf(SHARES), rtol=1e-9)


def test_a_choice_gives_every_value_its_share() -> None:
    values = Distribution("choice", ((7.0, 8.0, 9.0), (0.2, 0.2, 1.0))).values((np.arange(1000) + 0.5) / 1000)
    assert [int(np.count_nonzero(values == item)) for item in (7.0, 8.0, 9.0)] == [200, 0, 800]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("dimensions", [1, 4, 9])
def test_a_draw_is_the_same_from_wherever_it_is_asked_for(method: Any, dimensions: int) -> None:
    sample = SamplingPlan(method, 1000, 5)
    whole = uniform_numbers(sample, dimensions, 0, 1000)
    assert whole.shape == (1000, dimensions)
    assert whole.min() > 0.0
    assert whole.max() < 1.0
    for first, count in ((990, 10), (3, 500), (0, 1), (503, 7)):
        np.testing.assert_array_equal(uniform_numbers(sample, dimensions, first, count), whole[first : first + count])


def test_random_numbers_are_uniform_and_independent() -> None:
    from scipy import stats

    uniform = uniform_numbers(SamplingPlan("random", 20_000, 11), 5, 0, 20_000)
    for column in uniform.T:
        assert stats.kstest(column, "uniform").pvalue > 1e-4
    assert np.abs(np.corrcoef(uniform.T) - np.eye(5)).max() < 0.03
    assert abs(np.corrcoef(uniform[:-1, 0], uniform[1:, 0])[0, 1]) < 0.03


@pytest.mark.parametrize("runs", [1, 2, 7, 100, 1023])
def test_a_latin_hypercube_has_one_draw_in_every_stratum_of_every_dimension(runs: int) -> None:
    uniform = uniform_numbers(SamplingPlan("latin_hypercube", runs, 4), 6, 0, runs)
    strata = np.sort(np.floor(uniform * runs).astype(int), axis=0)
    np.testing.assert_array_equal(strata, np.tile(np.arange(runs)[:, None], 6))
    if runs > 500:
        assert np.abs(np.corrcoef(uniform.T) - np.eye(6)).max() < 0.15


def test_sobol_numbers_are_those_of_scipy_and_fill_space_better_than_random_ones() -> None:
    from scipy import stats

    sobol = uniform_numbers(SamplingPlan("sobol", 512, 3), 4, 0, 512)
    expected = stats.qmc.Sobol(4, scramble=True, bits=32, rng=np.random.default_rng(3)).random(512)
    np.testing.assert_allclose(sobol, expected, atol=2.0**-32)
    assert stats.qmc.discrepancy(sobol) < 0.2 * stats.qmc.discrepancy(
        uniform_numbers(SamplingPlan("random", 512, 3), 4, 0, 512)
    )


@pytest.mark.parametrize("size", [1, 2, 3, 64, 1000, 4097])
def test_the_permutation_gives_every_place_once_and_depends_on_seed_and_stream(size: int) -> None:
    numbers = np.arange(size, dtype=np.uint64)
    places = permute(numbers, size, 7, 0)
    assert sorted(places.tolist()) == list(range(size))
    if size >= 64:
        assert places.tolist() != permute(numbers, size, 8, 0).tolist()
        assert places.tolist() != permute(numbers, size, 7, 1).tolist()


def gathered(document: Any, cuts: Sequence[int]) -> dict[str, Any]:
    """The values of one configuration's runs, asked for in pieces that end at the cuts."""
    study = load_study(document)
    edges = [0, *cuts, study.runs_of_configuration]
    pieces = [drawn_values(study, np.arange(first, last)) for first, last in pairwise(edges)]
    return {path: np.concatenate([piece[path] for piece in pieces]) for path in study.paths}


@pytest.mark.parametrize("method", METHODS)
def test_values_of_a_run_do_not_depend_on_the_chunk(small: Any, method: str) -> None:
    small["sample"] = {"method": method, "runs": 80_000, "seed": 1}
    whole, pieces = gathered(small, []), gathered(small, [17, 79_999, 80_003, 159_000])
    for path, column in whole.items():
        np.testing.assert_array_equal(pieces[path], column)


def test_the_whole_sample_is_taken_at_every_point_of_the_grid(small: Any) -> None:
    values = gathered(small, [])
    assert values["reference.level"].tolist() == [3.0] * 8 + [6.0] * 8
    for path in ("supply.pressure", "actuator.leak.area"):
        assert len(set(values[path][:8].tolist())) == 8
        assert values[path][:8].tolist() == values[path][8:].tolist()


def test_the_last_axis_of_a_grid_runs_fastest(small: Any) -> None:
    small["vary"] = [
        {"path": "reference.level", "kind": "grid", "first": "1 N m", "last": "3 N m", "count": 3},
        {
            "path": "valve.area",
            "kind": "grid",
            "first": "1 mm^2",
            "last": "100 mm^2",
            "count": 3,
            "spacing": "logarithmic",
        },
    ]
    del small["sample"], small["correlations"]
    values = gathered(small, [4])
    assert values["reference.level"].tolist() == [1.0] * 3 + [2.0] * 3 + [3.0] * 3
    np.testing.assert_allclose(values["valve.area"], [1e-6, 1e-5, 1e-4] * 3, rtol=1e-12)


def test_units_are_converted_once_and_pressures_count_from_the_atmosphere(varying: Callable[..., Any]) -> None:
    study = load_study(
        varying(
            {"path": "supply.pressure", "kind": "normal", "mean": "50 psi_g", "standard_deviation": "2 psi_d"},
            {"path": "motion.angle", "kind": "uniform", "minimum": "60 deg", "maximum": "90 deg"},
            runs=4000,
        )
    )
    values = drawn_values(study, np.arange(4000))
    assert np.mean(values["supply.pressure"]) == pytest.approx(101325.0 + 50 * 6894.757, rel=1e-3)
    assert np.std(values["supply.pressure"]) == pytest.approx(2 * 6894.757, rel=0.05)
    assert np.rad2deg(values["motion.angle"].min()) == pytest.approx(60.0, abs=0.1)
    assert study.units["supply.pressure"] == "Pa_a"


@pytest.mark.parametrize("method", METHODS)
def test_correlations_are_those_of_the_normal_scores(small: Any, method: str) -> None:
    from scipy import stats

    small["sample"] = {"method": method, "runs": 20_000, "seed": 9}
    values = gathered(small, [])
    uniform = (values["supply.pressure"][:20_000] - values["supply.pressure"].min()) / np.ptp(values["supply.pressure"])
    scores = stats.norm.ppf(np.clip(uniform, 1e-6, 1.0 - 1e-6)), np.log(values["actuator.leak.area"][:20_000])
    assert np.corrcoef(*scores)[0, 1] == pytest.approx(-0.6, abs=0.02)
    assert stats.kstest(uniform, "uniform").pvalue > 1e-4


def test_scores_that_follow_from_others_but_for_rounding_have_no_factor() -> None:
    nearly = np.array([[1.0, 1.0 - 1e-15], [1.0 - 1e-15, 1.0]])
    assert np.isfinite(np.linalg.cholesky(nearly)).all()
    assert cholesky_factor(nearly) is None
    assert cholesky_factor(np.array([[1.0, 1.0 - 1e-9], [1.0 - 1e-9, 1.0]])) is not None
