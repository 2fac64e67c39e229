"""An orifice and a laminar gap side by side, and flow near equal pressures; formulas and solver are SciPy's and own."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ppafo.identification.bench.flow import GasAt
from ppafo.identification.source import RecordingSource
from ppafo.signals import Channel, Recording
from tests.unit.identification.planted import open_valve_flow, vane_leak

K, R, T, ROOM = 1.4, 8.314462618 / 0.02897, 293.15, 101325.0
AIR = GasAt(0.02897, K, T)
Mix = tuple[float, float]
"""Cd A [m^2], and the coefficient of the gap [kg/(s Pa^2)]."""


def through(mix: Mix, first: float, second: float) -> float:
    """Mass flow from first to second [kg/s], of which first is the higher pressure; no straight line anywhere."""
    ratio = max(second / first, (2.0 / (K + 1.0)) ** (K / (K - 1.0)))
    shape = math.sqrt(2.0 * K / (K - 1.0) / (R * T) * max(ratio ** (2.0 / K) - ratio ** ((K + 1.0) / K), 0.0))
    return mix[0] * first * shape + mix[1] * (first**2 - second**2)


def recording(**channels: tuple[np.ndarray, str]) -> tuple[RecordingSource]:
    (first, _), *_ = channels.values()
    made = {name: Channel(np.asarray(values), unit) for name, (values, unit) in channels.items()}
    return (RecordingSource(Recording("made", 0.05 * np.arange(len(first)), made, "synthetic")),)


def steady(mix: Mix, random: np.random.Generator) -> tuple[RecordingSource]:
    first, second = np.linspace(1.2e5, 6.0e5, 40), np.full(40, ROOM)
    flow = np.array([through(mix, *pair) for pair in zip(first, second, strict=True)])
    flow = flow + 0.003 * flow.max() * random.standard_normal(40)
    return recording(pressure_1=(first, "Pa"), pressure_2=(second, "Pa"), mass_flow=(flow, "kg/s"))


def closed(mix: Mix, random: np.random.Generator) -> tuple[RecordingSource]:
    """Two chambers of 60 and 45 cm^3, twenty seconds at 20 Hz, isothermal."""
    one, other = R * T / 60.0e-6, R * T / 45.0e-6

    def rates(_: float, pressures: np.ndarray) -> list[float]:
        flow = math.copysign(through(mix, max(pressures), min(pressures)), pressures[0] - pressures[1])
        return [-one * flow, other * flow]

    found = solve_ivp(rates, (0.0, 20.0), [5.0e5, ROOM], t_eval=0.05 * np.arange(400), rtol=1e-9, atol=1e-3)
    first, second = found.y + 150.0 * random.standard_normal((2, 400))
    return recording(pressure_1=(first, "Pa"), pressure_2=(second, "Pa"))


def of_steady(sources: tuple[RecordingSource, ...], law: str) -> object:
    return vane_leak(sources, AIR, law=law)


def of_closed(sources: tuple[RecordingSource, ...], law: str) -> object:
    return vane_leak(sources, AIR, 60.0e-6, 45.0e-6, law=law)


# As large as each other at 5 bar, one alone, the other alone.
MIXES = ((0.8e-8, 0.32e-16), (1.6e-8, 0.0), (0.0, 0.64e-16))


@pytest.mark.parametrize("mix", MIXES)
@pytest.mark.parametrize(("make", "solve"), [(steady, of_steady), (closed, of_closed)])
def test_both_laws_hold_where_either_alone_or_both_flow(
    make: Callable[..., tuple[RecordingSource]], solve: Callable[..., object], mix: Mix
) -> None:
    found = solve(make(mix, np.random.default_rng(640)), "both")
    for path, truth in zip(("vane_leak.effective_area", "effects.laminar_leak.coefficient"), mix, strict=True):
        estimate = found[path]  # type: ignore[index]
        assert estimate.low <= truth <= estimate.high, estimate
        assert estimate.is_identified, estimate
        if estimate.low == 0.0:
            assert (estimate.value, "none" in estimate.explanation) == (0.0, True)
    assert not found.conflict  # type: ignore[attr-defined]


def test_an_orifice_alone_is_flagged_where_a_gap_is_beside_it_and_the_advice_is_their_sum() -> None:
    found = vane_leak(steady(MIXES[0], np.random.default_rng(641)), AIR)
    assert not found["vane_leak.effective_area"].is_identified
    assert found.conflict


@pytest.mark.parametrize("lowest", [10.0, 110.0])
@pytest.mark.parametrize("law", ["orifice", "both"])
def test_readings_near_equal_pressures_are_of_the_opening_and_not_of_a_straight_line(lowest: float, law: str) -> None:
    """Cd 0.6424 of 31.6 mm^2 within two kilopascals, where the engine would take a straight line below 101 Pa."""
    difference, random = np.arange(lowest, 2000.0, 10.0), np.random.default_rng(642)
    flow = np.array([through((0.6424 * 31.6e-6, 0.0), ROOM + one, ROOM) for one in difference])
    flow += 0.005 * flow.max() * random.standard_normal(len(flow))
    pressures = ROOM + difference, np.full(len(flow), ROOM)
    sources = recording(
        upstream_pressure=(pressures[0], "Pa"), downstream_pressure=(pressures[1], "Pa"), mass_flow=(flow, "kg/s")
    )
    found = open_valve_flow(sources, AIR, law, 31.6e-6)
    estimate = found["valves.proportional.discharge_coefficient"]
    assert estimate.low <= 0.6424 <= estimate.high
    assert estimate.is_identified
