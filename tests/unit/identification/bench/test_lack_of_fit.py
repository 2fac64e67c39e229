"""Intervals where a law misses the readings: wider where it does, as narrow as before where it does not."""

import math

import numpy as np
import pytest
from ppafo.identification.bench.curve_fit import CurveFit, fit_curve, jackknife, lack_of_fit
from ppafo.identification.bench.flow_laws import GasAt

from ppafo.identification.bench.result import Evidence, Number
from ppafo.identification.bench.static_torque import labels_of, regress

TIME = np.linspace(0.0, 1.0, 400)


def line(values: np.ndarray, along: tuple[np.ndarray, ...] = ()) -> CurveFit:
    """A straight line fitted to values over time."""
    start, wide = np.zeros(2), np.full(2, 1e3)
    return fit_curve(lambda item: values - item[0] - item[1] * TIME, start, -wide, wide, 0.95, along)


def noise(seed: int, count: int = 400) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, 0.1, count)


def test_white_noise_is_hardly_ever_said_to_miss() -> None:
    seen = sum(lack_of_fit(noise(seed), 2, 0.95).is_seen for seed in range(400))
    assert seen <= 12


def test_noise_that_is_larger_in_some_places_is_hardly_ever_said_to_miss() -> None:
    scale = np.where(TIME > 0.95, 1.0, 0.05)
    seen = sum(lack_of_fit(scale * noise(seed), 2, 0.95, (TIME,)).is_seen for seed in range(200))
    assert seen <= 8


def test_a_slow_misfit_below_the_noise_is_seen() -> None:
    found = lack_of_fit(noise(1) + 0.05 * np.sin(4.0 * np.pi * TIME), 2, 0.95)
    assert found.is_seen
    assert found.freedom == len(found.blocks) - 2
    assert sorted(np.concatenate(found.blocks)) == list(range(400))


def test_a_misfit_over_another_variable_is_seen_only_along_it() -> None:
    shuffled = np.random.default_rng(5).permutation(400)
    over_pressure = noise(2) + 0.1 * np.sin(4.0 * np.pi * TIME)[shuffled]
    assert not lack_of_fit(over_pressure, 2, 0.95).is_seen
    assert lack_of_fit(over_pressure, 2, 0.95, (TIME[shuffled],)).is_seen


def test_a_law_that_holds_keeps_the_intervals_of_the_scatter() -> None:
    fit = line(2.0 + 3.0 * TIME + noise(3))
    assert fit.widened.tolist() == [1.0, 1.0]


def test_intervals_cover_the_slope_that_a_slow_error_hides() -> None:
    plain, covered = 0, 0
    for seed in range(100):
        draw = np.random.default_rng(seed)
        slow = np.convolve(draw.normal(0.0, 1.0, 480), np.ones(80) / 80.0, "valid")[:400]
        fit = line(2.0 + 3.0 * TIME + noise(seed + 1000) + slow)
        covered += abs(fit.values[1] - 3.0) <= fit.half_widths[1]
        plain += abs(fit.values[1] - 3.0) <= fit.half_widths[1] / fit.widened[1]
    assert plain <= 50
    assert covered >= 85


def test_the_jackknife_of_a_mean_is_its_standard_error() -> None:
    values = np.array([1.0, 2.0, 4.0, 7.0])
    without = [np.array([np.delete(values, index).mean()]) for index in range(4)]
    assert jackknife(without, 0.95)[0] == pytest.approx(3.1824 * values.std(ddof=1) / 2.0, rel=1e-4)


@pytest.mark.parametrize("count", [3, 10, 15])
def test_few_readings_cannot_show_a_lack_of_fit(count: int) -> None:
    assert not lack_of_fit(np.linspace(-1.0, 1.0, count), 2, 0.95).is_seen


def test_a_fit_without_any_error_is_no_lack_of_fit() -> None:
    assert not lack_of_fit(np.zeros(100), 2, 0.95).is_seen


def test_a_regression_says_by_how_much_cells_that_miss_the_line_widen_it() -> None:
    levels = np.repeat(np.arange(8), 40)
    design = np.stack([levels.astype(float), np.ones(320)], axis=1)
    cells, clusters = labels_of([levels]), np.zeros(320, dtype=np.int64)
    straight = regress(design, 2.0 * levels + noise(4, 320), clusters, cells, 0.95)
    bent = regress(design, 2.0 * levels + 0.1 * levels**2 + noise(4, 320), clusters, cells, 0.95)
    assert straight.widened.tolist() == [1.0, 1.0]
    assert bent.widened.min() > 3.0


NUMBER = Number("actuator.torque_constant", "m^3", 2.0, 0.3, "why", widened=2.5)


def test_calibration_adds_to_what_a_gain_touches_and_to_nothing_else() -> None:
    evidence = Evidence(("a.csv",), 0.9, 0.2)
    assert evidence.with_calibration(NUMBER).half_width == pytest.approx(math.hypot(0.3, 0.4))
    assert evidence.without_calibration(NUMBER).half_width == pytest.approx(0.3)
    assert "20.00% for the calibration of the sensors" in evidence.calibration_text
    assert "does not include" in Evidence(("a.csv",)).calibration_text


def test_a_widened_interval_is_told_beside_the_verdict() -> None:
    estimate = Evidence(("a.csv",)).without_calibration(NUMBER)
    assert estimate.verdict_in_words == "holds for this model only, widened 2.5 times (lack of fit)"
    assert estimate.is_usable
    assert not estimate.is_identified
    assert Evidence(("a.csv",)).without_calibration(Number("a.b", "", 2.0, 0.3, "why")).verdict_in_words == "identified"


def test_a_number_that_holds_under_one_condition_is_not_identified_and_says_where_it_holds() -> None:
    estimate = Evidence(("a.csv",)).without_calibration(Number("a.b", "", 2.0, 0.3, "why", condition="at 430 kPa"))
    assert estimate.verdict_in_words == "holds for this model only, at 430 kPa"


def test_a_number_that_the_fit_holds_at_zero_is_at_its_bound() -> None:
    estimate = Evidence(("a.csv",)).at_or_above_zero(Number("a.b", "", 0.0, 0.3, "why"))
    assert (estimate.verdict, estimate.low, estimate.high) == ("at its bound", 0.0, 0.3)


def test_a_temperature_that_is_not_known_well_counts_half() -> None:
    gas = GasAt(0.044, 1.3, 300.0, 6.0)
    assert gas.flow_uncertainty() == pytest.approx(0.01)
    assert gas.flow_uncertainty(0.02) == pytest.approx(math.hypot(0.01, 0.02))
    assert gas.temperature_text == "Gas at 300 K, known to 6 K"
    assert GasAt(0.044, 1.3, 300.0).temperature_text == "Gas at 300 K, taken as exact"
