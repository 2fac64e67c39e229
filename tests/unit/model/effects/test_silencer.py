"""A silencer behind the valve, against two restrictions whose pressure between them is found by bisection."""

from types import SimpleNamespace

import pytest

from ppafo.model.effects.silencer import EFFECT, SilencerSettings, behind_silencer, prepare
from ppafo.model.orifice import iso6358_flow_function

CRITICAL = 0.5
ATMOSPHERE = 1.0e5
AIR = SimpleNamespace(gas=SimpleNamespace(specific_gas_constant=287.1, temperature=293.15))


def through_both(upstream: float, valve: float, silencer: float) -> float:
    """Flow [kg/s] through two restrictions in a row: bisection on the pressure [Pa] between them."""

    def passed(high: float, low: float, conductance: float) -> float:
        return conductance * high * iso6358_flow_function(low / high, CRITICAL)

    low, high = ATMOSPHERE, upstream
    for _ in range(200):
        between = 0.5 * (low + high)
        low, high = (
            (between, high)
            if passed(upstream, between, valve) > passed(between, ATMOSPHERE, silencer)
            else (
                low,
                between,
            )
        )
    return passed(0.5 * (low + high), ATMOSPHERE, silencer)


@pytest.mark.parametrize("times", [1.0, 3.0, 10.0])
@pytest.mark.parametrize(("ratio", "low", "high"), [(1.001, -2e-3, 2e-3), (1.2, -0.05, 0.05), (6.0, -0.13, 1e-9)])
def test_the_closed_form_is_exact_near_equal_pressures_and_low_where_it_chokes(
    times: float, ratio: float, low: float, high: float
) -> None:
    valve, upstream = 1.0e-8, ratio * ATMOSPHERE
    row = EFFECT.parameters(1.0 / (times * valve) ** 2)
    closed = behind_silencer(valve, row) * upstream * iso6358_flow_function(1.0 / ratio, CRITICAL)
    error = closed / through_both(upstream, valve, times * valve) - 1.0
    assert low <= error <= high


def test_a_sonic_conductance_counts_air_as_iso_8778_has_it() -> None:
    row = prepare(SilencerSettings(1.0e-8), AIR)
    assert row.resistance**-0.5 == pytest.approx(1.0e-8 * 1.185, rel=2e-3)


def test_a_shut_valve_stays_shut() -> None:
    assert behind_silencer(0.0, EFFECT.parameters(1.0e16)) == 0.0
