"""What is zero within the accuracy of a run is shown as 0, wherever a number is shown."""

import pytest

from ppafo.metrics import Metric
from ppafo.report.kind import ConfidenceInterval, Kind, metric_change, metric_text, metrics_lines, of_metric
from ppafo.simulation.check import ErrorEstimate
from ppafo.units.shown import shown_in

ROUNDING = {
    "kg": (-6.505e-19, "0 g"),
    "N m": (2.665e-15, "0 N m"),
    "rad": (-1.0e-16, "0 deg"),
    "J/kg": (3.0e-14, "0 J/kg"),
    "J": (-0.0, "0 J"),
}


@pytest.mark.parametrize("unit", ROUNDING)
def test_a_metric_that_is_rounding_is_0(unit: str) -> None:
    value, text = ROUNDING[unit]
    assert metric_text(value, unit) == text
    assert metrics_lines({"it": Metric(value, unit, "what it is")}) == [f"it  {text}  what it is"]


def test_a_metric_that_is_small_is_not_0() -> None:
    assert metric_text(2.5e-8, "kg") == "2.5e-05 g"
    assert metric_text(-1.0e-6, "N m") == "-1e-06 N m"


def test_a_pressure_at_the_atmosphere_is_0_in_the_units_of_a_set() -> None:
    with shown_in({"Pa_a": "bar_g", "Pa_d": "bar_d"}):
        assert metric_text(101325.0 + 6.6e-7, "Pa_a") == "0 bar_g"
        assert metric_change(6.6378e-7, "Pa_d") == (0.0, "bar")
        assert Kind("", "Pa_a", "pressure").shown(101326.0) == pytest.approx(1.0e-5)


def test_zero_has_neither_sign_nor_exponent() -> None:
    kind = of_metric("gas_supplied", "+.3g")
    assert kind.change_interval(ConfidenceInterval(1.0e-18, -1.0e-18, 0.0)) == "0 [0, 0]"
    assert ErrorEstimate(0.0, 0.3, {}).sentence.startswith(
        "Estimated error of the time steps: at most 0 deg and 4.4e-05 psi"
    )
