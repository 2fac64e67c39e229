"""Orifice, ISO 6358, laminar gap and their sum as a leak: which law is found; formulas are own, the solver SciPy's."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ppafo.identification.bench.flow import GasAt
from ppafo.identification.bench.law import BenchResult
from ppafo.identification.source import RecordingSource
from ppafo.signals import Channel, Recording
from tests.unit.identification.planted import vane_leak

K, R, T, ROOM = 1.4, 8.314462618 / 0.02897, 293.15, 101325.0
AIR = GasAt(0.02897, K, T)
VOLUMES = 60.0e-6, 45.0e-6
C, B = "actuator.leak.sonic_conductance", "actuator.leak.critical_ratio"
AREA, GAP = "vane_leak.effective_area", "effects.laminar_leak.coefficient"
Leak = Callable[[float, float], float]
"""Mass flow [kg/s] from the higher to the lower pressure [Pa]."""


def sharp(area: float, first: float, second: float) -> float:
    ratio = max(second / first, (2.0 / (K + 1.0)) ** (K / (K - 1.0)))
    return (
        area * first * math.sqrt(2.0 * K / (K - 1.0) / (R * T) * max(ratio ** (2.0 / K) - ratio ** (1.0 + 1.0 / K), 0))
    )


def standard(conductance: float, critical: float, first: float, second: float) -> float:
    beyond = max(second / first - critical, 0.0) / (1.0 - critical)
    return conductance * 1.185 * first * math.sqrt(max(1.0 - beyond**2, 0.0))


def mixed(area: float, coefficient: float, first: float, second: float) -> float:
    return sharp(area, first, second) + coefficient * (first**2 - second**2)


def recording(rate: float, **channels: tuple[np.ndarray, str]) -> tuple[RecordingSource]:
    (first, _), *_ = channels.values()
    made = {name: Channel(np.asarray(values), unit) for name, (values, unit) in channels.items()}
    return (RecordingSource(Recording("made", np.arange(len(first)) / rate, made, "synthetic")),)


def closed(leak: Leak, noise: float = 150.0, start: float = 5.0e5) -> tuple[RecordingSource]:
    """Two chambers, twenty seconds at 20 Hz, isothermal."""

    def rates(_: float, pressures: np.ndarray) -> list[float]:
        flow = math.copysign(leak(max(pressures), min(pressures)), pressures[0] - pressures[1])
        return [-R * T / VOLUMES[0] * flow, R * T / VOLUMES[1] * flow]

    found = solve_ivp(rates, (0.0, 20.0), [start, ROOM], t_eval=0.05 * np.arange(400), rtol=1e-9, atol=1e-3)
    first, second = found.y + noise * np.random.default_rng(7).standard_normal((2, 400))
    return recording(20.0, pressure_1=(first, "Pa"), pressure_2=(second, "Pa"))


def steady(leak: Leak, noise: float = 0.003) -> tuple[RecordingSource]:
    first, second = np.linspace(1.2e5, 6.0e5, 40), np.full(40, ROOM)
    flow = np.array([leak(*pair) for pair in zip(first, second, strict=True)])
    flow = flow + noise * flow.max() * np.random.default_rng(7).standard_normal(40)
    return recording(20.0, pressure_1=(first, "Pa"), pressure_2=(second, "Pa"), mass_flow=(flow, "kg/s"))


def solved(sources: tuple[RecordingSource], law: str, critical_ratio: float | None = None) -> BenchResult:
    volumes = () if "mass_flow" in sources[0].recording else VOLUMES
    return vane_leak(sources, AIR, *volumes, law=law, critical_ratio=critical_ratio)


def check(result: BenchResult, **truth: float) -> None:
    for path, value in truth.items():
        estimate = result[path]
        assert estimate.is_identified, estimate
        assert estimate.low <= value <= estimate.high, estimate


@pytest.mark.parametrize("make", [closed, steady])
@pytest.mark.parametrize("critical", [0.2, 0.4])
def test_a_leak_of_the_standard_is_no_gap_and_the_law_that_is_named_gives_its_two_numbers(
    make: Callable[[Leak], tuple[RecordingSource]], critical: float
) -> None:
    sources = make(partial(standard, 3.5e-11, critical))
    wrong = solved(sources, "both")
    assert wrong.conflict.startswith("law = 'iso6358' (sonic_conductance = 0.003")
    assert not any(estimate.is_identified for estimate in wrong.estimates)
    right = solved(sources, "iso6358")
    check(right, **{C: 3.5e-11, B: critical})
    assert (right.conflict, right.remarks) == ("", ())
    # With the critical ratio of the set, the orifice explains the readings and no gap is left.
    with_ratio = solved(sources, "both", critical)
    assert (with_ratio[GAP].low, with_ratio.conflict, with_ratio.remarks) == (0.0, "", ())
    assert with_ratio[C].is_identified
    assert solved(sources, "orifice", 0.8).conflict


@pytest.mark.parametrize("make", [closed, steady])
@pytest.mark.parametrize("mix", [(0.8e-8, 0.32e-16), (1.4e-8, 0.1e-16)])
def test_a_gap_beside_an_orifice_is_a_gap_and_the_standard_is_sent_to_it(
    make: Callable[[Leak], tuple[RecordingSource]], mix: tuple[float, float]
) -> None:
    sources = make(partial(mixed, *mix))
    right = solved(sources, "both")
    check(right, **{AREA: mix[0], GAP: mix[1]})
    assert (right.conflict, right.remarks) == ("", ())
    wrong = solved(sources, "iso6358")
    assert wrong.conflict.startswith("law = 'both'")
    assert not any(estimate.is_identified for estimate in wrong.estimates)


@pytest.mark.parametrize("make", [closed, steady])
def test_a_gap_alone_is_one(make: Callable[[Leak], tuple[RecordingSource]]) -> None:
    sources = make(partial(mixed, 0.0, 0.64e-16))
    right = solved(sources, "both")
    check(right, **{GAP: 0.64e-16})
    assert (right[AREA].low, right.conflict, right.remarks) == (0.0, "", ())
    assert solved(sources, "iso6358").conflict.startswith("law = 'both'")


@pytest.mark.parametrize("make", [closed, steady])
def test_a_sharp_orifice_has_no_gap_and_either_law_describes_it(
    make: Callable[[Leak], tuple[RecordingSource]],
) -> None:
    sources = make(partial(sharp, 1.6e-8))
    found = solved(sources, "both")
    check(found, **{AREA: 1.6e-8})
    assert found[GAP].low == 0.0
    assert found.conflict == ""
    assert "do not tell law = 'both' from law = 'iso6358' (sonic_conductance = 0.003" in found.remarks[0]
    # Critical ratio of an ellipse that is nearest to the curve of a nozzle.
    assert solved(sources, "iso6358")[B].value == pytest.approx(0.52, abs=0.04)


@pytest.mark.parametrize("law", ["both", "iso6358"])
def test_readings_that_do_not_tell_the_laws_apart_identify_no_gap(law: str) -> None:
    found = solved(closed(partial(standard, 3.5e-11, 0.4), noise=1500.0), law)
    assert found.conflict == ""
    assert f"do not tell law = '{law}' from law = " in found.remarks[0]
    assert {estimate.verdict for estimate in found.estimates} == {"holds for this model only"}


def test_the_standard_over_an_unknown_volume_has_no_place_in_a_set() -> None:
    found = vane_leak(closed(partial(standard, 3.5e-11, 0.4)), AIR, law="iso6358")
    check(found, **{"vane_leak.sonic_conductance_over_volume": 3.5e-11 / VOLUMES[0], "vane_leak.critical_ratio": 0.4})
