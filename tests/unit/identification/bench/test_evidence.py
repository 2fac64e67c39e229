"""What goes into an interval besides the scatter, and what is said of it."""

import math

import pytest

from ppafo.identification.bench.flow_laws import GasAt
from ppafo.identification.bench.result import Evidence, Number

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
