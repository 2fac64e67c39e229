"""Reuse of the exhaust: the reservoir's limits, mass balance, and that it settles where the closed form says."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.model.exhaust_reuse import (
    ReuseCycle,
    equalised_pressure,
    reuse_balance,
    reuse_cycle,
    steady_reservoir_pressure,
)

OUTSIDE = 101325.0
CYCLE = ReuseCycle(
    exhaust_pressure=OUTSIDE + 345e3,
    fill_pressure=OUTSIDE + 345e3,
    atmospheric_pressure=OUTSIDE,
    exhaust_volume=80e-6,
    fill_volume=40e-6,
    reservoir_volume=50e-6,
    gas_product=56300.0,
)
NEEDED = 345e3 * 40e-6 / 56300.0


def settled(cycle: ReuseCycle, turns: int = 5000) -> float:
    """The pressure of a reservoir after many cycles from atmospheric pressure, one after the other."""
    pressure = cycle.atmospheric_pressure
    for _ in range(turns):
        pressure = reuse_cycle(cycle, pressure)[1]
    return pressure


def test_joined_volumes_keep_their_gas() -> None:
    assert equalised_pressure(3e5, 2e-5, 1e5, 2e-5) == pytest.approx(2e5)
    assert equalised_pressure(3e5, 2e-5, 1e5, 0.0) == 3e5


def test_nothing_is_saved_without_a_reservoir_and_little_with_a_tiny_one() -> None:
    assert reuse_balance(CYCLE._replace(reservoir_volume=0.0)).returned_mass == 0.0
    tiny = reuse_balance(CYCLE._replace(reservoir_volume=1e-12)).returned_mass
    assert 0.0 < tiny < 1e-6 * NEEDED


def test_a_very_large_reservoir_settles_where_the_two_chambers_would_meet_directly() -> None:
    large = CYCLE._replace(reservoir_volume=1e3)
    meeting = equalised_pressure(CYCLE.exhaust_pressure, 80e-6, OUTSIDE, 40e-6)
    assert steady_reservoir_pressure(large) == pytest.approx(meeting, rel=1e-6)
    assert reuse_balance(large).returned_mass == pytest.approx((meeting - OUTSIDE) * 40e-6 / 56300.0, rel=1e-6)


def test_nothing_is_saved_where_the_exhaust_has_the_pressure_of_the_atmosphere() -> None:
    balance = reuse_balance(CYCLE._replace(exhaust_pressure=OUTSIDE))
    assert balance.returned_mass == balance.caught_mass == 0.0
    assert balance.topped_up_mass == pytest.approx(NEEDED)


def test_nothing_is_needed_where_dorsiflexion_has_the_pressure_of_the_atmosphere() -> None:
    balance = reuse_balance(CYCLE._replace(fill_pressure=OUTSIDE))
    assert balance.returned_mass == balance.topped_up_mass == 0.0


def test_equal_chambers_at_equal_pressures_save_half_of_the_filling_at_the_very_most() -> None:
    equal = CYCLE._replace(exhaust_volume=40e-6, reservoir_volume=1e3)
    assert reuse_balance(equal).returned_mass == pytest.approx(0.5 * NEEDED, rel=1e-6)


def test_low_dorsiflexion_pressure_is_met_in_full_and_the_reservoir_stays_above_it() -> None:
    low = CYCLE._replace(fill_pressure=OUTSIDE + 50e3, reservoir_volume=200e-6)
    balance = reuse_balance(low)
    assert balance.topped_up_mass == 0.0
    assert balance.returned_mass == pytest.approx(50e3 * 40e-6 / 56300.0)
    assert balance.pressure_before > low.fill_pressure


@given(
    exhaust=st.floats(0.0, 8e5),
    fill=st.floats(0.0, 8e5),
    exhaust_volume=st.floats(1e-6, 1e-3),
    fill_volume=st.floats(1e-6, 1e-3),
    reservoir=st.floats(1e-6, 1e-3),
)
def test_a_settled_reservoir_gives_back_what_it_catches_and_no_more_than_there_is(
    exhaust: float, fill: float, exhaust_volume: float, fill_volume: float, reservoir: float
) -> None:
    cycle = ReuseCycle(OUTSIDE + exhaust, OUTSIDE + fill, OUTSIDE, exhaust_volume, fill_volume, reservoir, 56300.0)
    balance, left = reuse_cycle(cycle, steady_reservoir_pressure(cycle))
    tolerance = 1e-9 * max(balance.exhausted_mass, fill * fill_volume / 56300.0, 1e-9)
    assert left == pytest.approx(balance.pressure_before, rel=1e-9)
    assert balance.caught_mass == pytest.approx(balance.returned_mass, abs=tolerance)
    assert -tolerance <= balance.returned_mass <= balance.exhausted_mass + tolerance
    assert balance.returned_mass + balance.topped_up_mass == pytest.approx(fill * fill_volume / 56300.0, abs=tolerance)


@pytest.mark.parametrize("fill", [345e3, 120e3, 30e3])
@pytest.mark.parametrize("reservoir", [5e-6, 50e-6, 500e-6])
def test_many_cycles_lead_to_the_closed_form(fill: float, reservoir: float) -> None:
    cycle = CYCLE._replace(fill_pressure=OUTSIDE + fill, reservoir_volume=reservoir)
    assert settled(cycle) == pytest.approx(steady_reservoir_pressure(cycle), rel=1e-9)


def test_a_larger_reservoir_saves_more() -> None:
    saved = [
        reuse_balance(CYCLE._replace(reservoir_volume=volume)).returned_mass for volume in (1e-6, 1e-5, 1e-4, 1e-3)
    ]
    assert saved == sorted(saved)
    assert math.isfinite(saved[-1])
