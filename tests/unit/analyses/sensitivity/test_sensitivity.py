"""Sensitivity: indices of known functions, and of a study."""

import itertools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from ppafo.analyses.sensitivity import METHODS, Influences, analyse, sensitivity
from ppafo.errors import StudyError
from ppafo.studies.distributions import Distribution, Floats
from ppafo.studies.draws import Uncertainty
from ppafo.studies.study import RandomValue
from tests.model_runs import model_runs

METRIC = "rms_error"
A, B = 7.0, 0.1
Model = Callable[[Mapping[str, Floats]], Mapping[str, Floats]]
ANGLES = Uncertainty(
    tuple(RandomValue(name, Distribution("uniform", (-math.pi, math.pi))) for name in ("x1", "x2", "x3"))
)


def analysed(model: Model, uncertainty: Uncertainty, method: str, samples: int, **more: Any) -> Influences:
    """What comes of a formula in place of a simulation."""
    return analyse(model_runs(model, [METRIC]), uncertainty, METHODS[method], samples, metrics=[METRIC], **more)


def ishigami(columns: Mapping[str, Floats]) -> dict[str, Floats]:
    """Ishigami and Homma (1990)."""
    first, second, third = (columns[name] for name in ("x1", "x2", "x3"))
    values = np.sin(first) + A * np.sin(second) ** 2 + B * third**4 * np.sin(first)
    return {METRIC: values}


def known_indices() -> tuple[Floats, Floats]:
    """First-order and total indices of the Ishigami function in closed form."""
    alone = 0.5 * (1.0 + B * math.pi**4 / 5.0) ** 2
    with_third = B**2 * math.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    total = alone + A**2 / 8.0 + with_third
    first = np.array([alone, A**2 / 8.0, 0.0]) / total
    return first, first + np.array([with_third, 0.0, with_third]) / total


def failing(model: Model, rows: Floats) -> Model:
    """The model, of which some runs fail, counted from the first call."""
    made = 0

    def run(columns: Mapping[str, Floats]) -> dict[str, Floats]:
        nonlocal made
        values = model(columns)[METRIC]
        made += values.size
        return {METRIC: np.where(np.isin(np.arange(made - values.size, made), rows), np.nan, values)}

    return run


def test_sobol_indices_of_ishigami_come_out_and_settle() -> None:
    found = analysed(ishigami, ANGLES, "sobol", 4096).metrics[0]
    first, total = known_indices()
    assert found.indices.values["first"] == pytest.approx(first, abs=0.02)
    assert found.indices.values["total"] == pytest.approx(total, abs=0.02)
    for name, known in (("first", first), ("total", total)):
        assert np.all(np.abs(found.indices.values[name] - known) <= found.indices.bands[name])
    sizes = [each.blocks for each in found.settling]
    assert sizes == [128, 256, 512, 1024, 2048, 4096]
    widths = np.array([each.bands["total"] for each in found.settling])
    assert np.all(widths[-1] < 0.35 * widths[0])


def test_the_result_is_the_same_every_time() -> None:
    one, other = (analysed(ishigami, ANGLES, "sobol", 256, seed=5) for _ in range(2))
    assert np.array_equal(one.metrics[0].indices.values["total"], other.metrics[0].indices.values["total"])
    assert np.array_equal(one.metrics[0].indices.bands["total"], other.metrics[0].indices.bands["total"])


@pytest.mark.parametrize("method", METHODS)
def test_a_failed_run_takes_its_whole_block_with_it(method: str) -> None:
    rows = METHODS[method].block_rows(3)
    broken = np.array([0, 5 * rows + 1, 5 * rows + 2, 127 * rows + rows - 1])
    found = analysed(failing(ishigami, broken), ANGLES, method, 128)
    assert (found.failed, found.metrics[0].runs_without_value) == (4, 4)
    assert found.metrics[0].settling[-1].used == 125
    whole, ranks = analysed(ishigami, ANGLES, method, 128).metrics[0], {"sobol": "total"}.get(method, method)
    expected = pytest.approx(whole.indices.values[ranks], rel=0.2, abs=0.05)
    assert found.metrics[0].indices.values[ranks] == expected


def test_a_sample_with_hardly_a_whole_block_says_nothing() -> None:
    rows = METHODS["sobol"].block_rows(3)
    model = failing(ishigami, np.arange(62) * rows)
    with pytest.raises(StudyError, match=r"only 2 of 64 base points have 'rms_error' in all their runs"):
        analysed(model, ANGLES, "sobol", 64, maximum_failed=0.5)


@pytest.mark.parametrize("blocks", [256, 1024])
def test_the_bands_of_sobol_hold_and_are_not_far_too_wide(blocks: int) -> None:
    first, total = known_indices()
    found = [analysed(ishigami, ANGLES, "sobol", blocks, seed=seed) for seed in range(1, 61)]
    for name, known in (("first", first), ("total", total)):
        values = np.array([item.metrics[0].indices.values[name] for item in found])
        bands = np.array([item.metrics[0].indices.bands[name] for item in found])
        assert np.mean(np.abs(values - known) <= bands) >= 0.92
        assert np.all(np.mean(bands, axis=0) / (1.96 * np.std(values, axis=0)) < 1.6)


def linear_in(slopes: Mapping[str, float]) -> Model:
    """A sum of slopes times values."""

    def run(columns: Mapping[str, Floats]) -> dict[str, Floats]:
        values = sum((slope * columns[name] for name, slope in slopes.items()), 0.0 * columns["x1"])
        return {METRIC: values}

    return run


@pytest.mark.parametrize("method", METHODS)
def test_the_change_of_ishigami_is_the_known_one_and_its_band_holds(method: str) -> None:
    known = np.array([2.0 * math.sin(0.9 * math.pi) * (1.0 + B * math.pi**4 / 5.0), 0.0, 0.0])
    found = [analysed(ishigami, ANGLES, method, 512, seed=seed) for seed in range(1, 41)]
    away = np.array([np.array(item.metrics[0].change_from_5_to_95_percent) - known for item in found])
    bands = np.array([item.metrics[0].band_of_change for item in found])
    assert np.mean(np.abs(away) <= bands) >= 0.9
    assert np.all(np.mean(bands, axis=0) < 2.0)
    assert np.mean(away, axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=0.1)


def test_the_change_of_a_linear_function_is_slope_times_distance_of_the_ends_whatever_the_distribution() -> None:
    mixed = Uncertainty(
        (
            RandomValue("x1", Distribution("normal", (0.0, 2.0))),
            RandomValue("x2", Distribution("choice", ((3.0, 4.0), (0.5, 1.0)))),
            RandomValue("x3", Distribution("choice", ((0.0, 1.0), (0.97, 1.0)))),
            RandomValue("x4", Distribution("log_normal", (1.0, 2.0))),
        )
    )
    model = linear_in({"x1": 1.0, "x2": -5.0, "x3": 2.0, "x4": 1.0})
    found = analysed(model, mixed, "sobol", 4096).metrics[0]
    normal = 1.6448536269514722
    known = [2.0 * 2.0 * normal, -5.0, 0.0, 2.0**normal - 2.0**-normal]
    assert found.change_from_5_to_95_percent == pytest.approx(known, abs=0.06)
    assert np.all(np.array(found.band_of_change) < 0.1)


def test_a_correlated_value_goes_along_in_the_change() -> None:
    # x2 does nothing by itself; where it is high, x1 is.
    drawn = (
        RandomValue("x1", Distribution("normal", (0.0, 1.0))),
        RandomValue("x2", Distribution("normal", (5.0, 3.0))),
    )
    together = Uncertainty(drawn, ((1.0, 0.0), (-0.8, 0.6)))
    found = analysed(linear_in({"x1": 2.0}), together, "shapley", 4096).metrics[0]
    whole = 2.0 * 2.0 * 1.6448536269514722
    assert found.change_from_5_to_95_percent == pytest.approx([whole, -0.8 * whole], abs=0.15)


def shapley_of_linear(slopes: Floats, covariance: Floats) -> Floats:
    """Shapley effects of a linear function of normal values, by the variance that every subset leaves."""
    count = slopes.size

    def explained(some: tuple[int, ...]) -> float:
        rest = [item for item in range(count) if item not in some]
        inside, across = covariance[np.ix_(some, some)], covariance[np.ix_(rest, some)]
        left = covariance[np.ix_(rest, rest)] - (across @ np.linalg.solve(inside, across.T) if some else 0.0)
        return float(slopes @ covariance @ slopes - slopes[rest] @ left @ slopes[rest])

    effects = np.zeros(count)
    for order in itertools.permutations(range(count)):
        for place, item in enumerate(order):
            effects[item] += explained(order[: place + 1]) - explained(order[:place])
    return effects / effects.sum()


def test_shapley_effects_of_correlated_values_are_the_known_ones_and_their_bands_hold() -> None:
    correlation = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, -0.3], [0.0, -0.3, 1.0]])
    slopes, sizes = np.array([1.0, 0.5, 2.0]), np.array([1.0, 2.0, 0.5])
    truth = shapley_of_linear(slopes, correlation * np.outer(sizes, sizes))
    factor = tuple(tuple(row) for row in np.linalg.cholesky(correlation).tolist())
    names = ("x1", "x2", "x3")
    drawn = tuple(
        RandomValue(name, Distribution("normal", (3.0, size))) for name, size in zip(names, sizes.tolist(), strict=True)
    )
    model = linear_in(dict(zip(names, slopes.tolist(), strict=True)))
    held = []
    for seed in range(1, 41):
        found = analysed(model, Uncertainty(drawn, factor), "shapley", 1024, seed=seed).metrics[0].indices
        assert np.sum(found.values["shapley"]) == pytest.approx(1.0)
        held.append(np.abs(found.values["shapley"] - truth) <= found.bands["shapley"])
        assert np.all(found.bands["shapley"] < 0.1)
    assert np.mean(held) >= 0.9


def test_a_metric_that_nothing_influences_is_named_and_leaves_the_others() -> None:
    runs = model_runs(lambda columns: {METRIC: columns["x1"], "final_error": 0.0 * columns["x1"] + 2.0}, [METRIC])
    found = analyse(runs, ANGLES, METHODS["sobol"], 64, metrics=(METRIC, "final_error"))
    assert ([metric.metric for metric in found.metrics], found.constant) == ([METRIC], {"final_error": 2.0})


STUDY = "torque-task-uncertainty"


def test_what_matters_for_the_error_and_what_for_the_gas() -> None:
    found = sensitivity(
        STUDY, metrics=["rms_error", "gas_supplied"], samples=256, configuration="proportional", independent=True
    ).found
    error, gas = (dict(zip(found.paths, metric.indices.values["total"], strict=True)) for metric in found.metrics)
    assert {path for path, share in error.items() if share > 0.1} == {"supply.pressure", "actuator.torque_constant"}
    assert max(gas, key=lambda path: gas[path]) == "actuator.leak.area"
    change = dict(zip(found.paths, found.metrics[1].change_from_5_to_95_percent, strict=True))
    assert change["actuator.leak.area"] > 0.0 > change["gas.temperature"]
    assert np.sum(found.metrics[0].indices.values["first"]) == pytest.approx(1.0, abs=0.1)
    assert found.runs == 256 * 9


def test_the_study_of_the_package_with_its_correlation_gets_shapley_effects() -> None:
    found = sensitivity(STUDY, metrics=["gas_supplied"], samples=512, configuration="proportional").found
    effects = dict(zip(found.paths, found.metrics[0].indices.values["shapley"], strict=True))
    assert found.method == "shapley"
    assert sum(effects.values()) == pytest.approx(1.0)
    assert max(effects, key=lambda path: effects[path]) == "actuator.leak.area"


def test_noise_of_the_sensors_is_one_of_the_values_and_has_no_ends() -> None:
    noisy = ["run.duration=0.3 s", "sensors.pressure_noise=5 kPa_d"]
    finding = sensitivity(
        STUDY,
        method="sobol",
        metrics=["rms_error"],
        samples=64,
        configuration="proportional",
        overrides=noisy,
        independent=True,
        maximum_failed=0.0,
    )
    found = finding.found
    (metric,) = found.metrics
    total = dict(zip(found.paths, metric.indices.values["total"], strict=True))
    assert total["sensors.seed"] > 0.05
    assert found.runs == 64 * 10
    change = metric.change_from_5_to_95_percent
    assert [path for path, each in zip(found.paths, change, strict=True) if math.isnan(each)] == ["sensors.seed"]
