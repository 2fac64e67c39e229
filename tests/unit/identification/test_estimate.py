"""An estimate keeps its promises."""

import math

import pytest

from ppafo.errors import IdentificationError
from ppafo.identification.estimate import Estimate
from ppafo.identification.new_set import with_estimates
from ppafo.parameters import apply_overrides, build_device, load_parameter_set
from ppafo.units import to_si


def estimate(value: float, low: float, high: float, verdict: str = "identified") -> Estimate:
    return Estimate("a.b", value, "m", low, high, verdict, "why", ("file sha256:0",))  # type: ignore[arg-type]


def test_half_widths_follow_from_the_interval() -> None:
    assert estimate(2.0, 1.0, 3.0).relative_half_width == 0.5
    assert math.isinf(estimate(0.0, -1.0, 1.0).relative_half_width)


def test_an_identified_value_outside_its_interval_is_refused() -> None:
    with pytest.raises(IdentificationError, match="must lie inside its interval"):
        estimate(4.0, 1.0, 3.0)


def test_a_value_that_could_not_be_told_may_be_no_number() -> None:
    nothing = estimate(math.nan, math.nan, math.nan, "law does not describe the data")
    assert not nothing.is_usable


def test_an_unknown_verdict_is_refused() -> None:
    with pytest.raises(IdentificationError, match="'fine' is not a verdict"):
        estimate(2.0, 1.0, 3.0, "fine")


@pytest.mark.parametrize(("apart", "second"), [([], 60.0), (["supply.dorsiflexion_pressure=45 psi_g"], 45.0)])
def test_fitted_supply_pressure_is_that_of_both_regulators_unless_they_are_apart(
    apart: list[str], second: float
) -> None:
    fitted, low, high = (to_si(number, "psi_g", "Pa_a") for number in (60.0, 59.0, 61.0))
    estimate = Estimate("supply.pressure", fitted, "Pa", low, high, "identified", "Fitted.", ("bench.csv",))
    before = apply_overrides(load_parameter_set("ppafo2011"), apart)
    supply = build_device(with_estimates(before, [estimate]).parameter_set).supply
    assert supply.pressure == pytest.approx(fitted, rel=1e-12)
    assert supply.dorsiflexion_pressure == pytest.approx(to_si(second, "psi_g", "Pa_a"), rel=1e-12)


def test_a_set_states_the_half_width_for_its_own_confidence() -> None:
    wide = Estimate(
        "foot_plate.inertia", 0.01, "kg m^2", 0.009, 0.011, "identified", "Why.", ("a.csv",), confidence=0.99
    )
    entry = with_estimates(load_parameter_set("ppafo2011"), [wide]).parameter_set.numbers["foot_plate.inertia"]
    assert entry.uncertainty == pytest.approx(0.1 * entry.value * 1.959964 / 2.575829, rel=1e-6)
    assert "99% interval" in entry.note
