"""Integer controllers: their products and gains, and how near they are to the float forms."""

import random
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.torque_loop import beyond_dead_band
from ppafo.engine.rows import leaves, rebuilt
from ppafo.model.sensors import Measurement
from ppafo.processor.controller import FIXED_LAWS
from ppafo.processor.fixed_point import (
    FRACTION_BITS,
    LARGEST_FRACTION,
    ConverterCounts,
    ConverterLimits,
    beyond_band,
    converter_of,
    count_of,
    fraction_of,
    gain_of,
    read,
    shifted,
)
from ppafo.processor.torque_laws.law import FixedLaw
from ppafo.processor.torque_laws.pid import FULL, PID, largest_pid

TORQUE_CONSTANT = 1.451e-5
PERIOD = 1.0e-3
BITS, RANGE = 12.0, 1.0e6
STEPS, LIMITS = converter_of(BITS, RANGE, TORQUE_CONSTANT)
WIDEST = 2**30
"""Size of the largest value that ``fraction_of`` takes without leaving 32 bits."""


PAPER = {"proportional_gain": 0.095, "integral_gain": 0.25, "derivative_gain": 0.006, "opening": 0.12} | {
    "converter_range": RANGE
}
"""Gains of the paper's torque task, an opening, and the range of the converter."""


def parameters(law: FixedLaw, **changed: float) -> Any:
    """Parameters of a law for the lanes: the paper's gains, and defaults, where nothing else is given."""
    known = {item.name: float(item.default or 0.0) for item in law.kind.quantities}
    every = {name: PAPER.get(name, number) for name, number in known.items()} | changed
    assert law.kind.plan is not None
    numbers, problems = law.kind.plan(every, PERIOD, TORQUE_CONSTANT, (0.0, 0.0))
    assert not any(is_bad for is_bad, _ in problems)
    return rebuilt(law.kind.parameters, numbers.values())


def seen(torque: float) -> Measurement:
    """A measurement of some torque [N m], at pressures in the middle of the converter's range."""
    half = 0.5 * torque / TORQUE_CONSTANT
    return Measurement(0.0, 4.0e5 + half, 4.0e5 - half, torque)


@given(st.integers(-WIDEST, WIDEST), st.integers(0, LARGEST_FRACTION))
def test_a_product_is_at_most_one_below_the_exact_one(value: int, fraction: int) -> None:
    exact = value * fraction / 2**FRACTION_BITS
    assert exact - 1.0 <= fraction_of(value, fraction) <= exact


@given(st.integers(-FULL, FULL), st.floats(0.0, 0.99))
def test_a_dead_band_is_passed_on_whole_numbers_as_on_floats(opening: int, dead_band: float) -> None:
    found = beyond_band(opening, round(dead_band * 2**FRACTION_BITS), FULL)
    assert found == pytest.approx(FULL * beyond_dead_band(opening / FULL, dead_band), abs=3.0)
    assert beyond_band(opening, 0, FULL) == opening
    assert abs(beyond_band(FULL, round(dead_band * 2**FRACTION_BITS), FULL)) == FULL


@given(st.integers(-WIDEST, WIDEST), st.integers(0, 30))
def test_a_shift_divides_and_rounds_down(value: int, places: int) -> None:
    assert shifted(value, places) == value // 2**places


@given(st.floats(2.0**-15, float(LARGEST_FRACTION)))
def test_a_gain_has_fifteen_bits(factor: float) -> None:
    fraction, places = gain_of(factor)
    assert fraction <= LARGEST_FRACTION
    assert fraction / 2.0**places == pytest.approx(factor, rel=2.0**-14)


def test_the_converter_rounds_and_stays_in_its_range() -> None:
    assert [count_of(value, 2.0, 255.0) for value in (-1.0, 0.9, 1.0, 300.0, 1.0e9)] == [0, 0, 1, 150, 255]
    shown = read(STEPS, ConverterLimits(*map(int, LIMITS)), 0.0, Measurement(0.0, RANGE, 0.0, 0.0))
    assert shown == ConverterCounts(reference=2048, pressure_1=4095, pressure_2=0)


@pytest.mark.parametrize("law", FIXED_LAWS.values(), ids=list(FIXED_LAWS))
def test_what_defaults_come_to_lies_within_what_is_declared(law: FixedLaw) -> None:
    for item, number in zip(law.kind.plan.quantities, leaves(parameters(law)), strict=True):
        assert item.minimum <= number <= item.maximum
    assert CONTROLLERS[law.kind.name] is law.kind


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"dead_band": 0.3},
        {"derivative_filter": 5.0e-3, "anti_windup": 10.0, "proportional_gain": 0.5, "integral_gain": 2.0},
    ],
    ids=["paper", "dead band", "filter and anti-windup"],
)
def test_pid_on_whole_numbers_follows_the_float_form(settings: dict[str, float]) -> None:
    law, float_law = PID, CONTROLLERS["pid"]
    fixed, fixed_state = parameters(law, **settings), law.kind.initial
    values = {item.name: PAPER.get(item.name, item.default or 0.0) for item in float_law.quantities} | settings
    floats, state = rebuilt(float_law.parameters, values.values()), float_law.initial
    torque, largest, clipped = 0.0, 0.0, 0
    draw = random.Random(4)
    for sample in range(4000):
        reference = 2.5 + 2.0 * ((sample // 500) % 2)
        command, state = float_law.update(floats, state, reference, seen(torque), PERIOD)
        found, fixed_state = law.kind.update(fixed, fixed_state, reference, seen(torque), PERIOD)
        clipped += abs(command) == 1.0
        if sample % 500:
            largest = max(largest, abs(found - command))
        # Whole counts of torque, so that the slope of both is the same.
        torque += STEPS.torque_step * 2 * draw.choice((-1, 0, 1, 1 if torque < reference else -1))
    assert largest < 0.02
    assert not settings or clipped


def test_on_off_switches_where_the_float_form_does() -> None:
    law = FIXED_LAWS["on_off_fixed_point"]
    for torque in (-1.0, 1.9, 2.1, 4.0):
        found, _ = law.kind.update(parameters(law), law.kind.initial, 2.0, seen(torque), PERIOD)
        assert found == CONTROLLERS["on_off"].update((), (), 2.0, seen(torque), PERIOD)[0]


def test_a_dead_zone_has_hysteresis_and_an_opening() -> None:
    law = FIXED_LAWS["on_off_dead_zone_fixed_point"]
    given_numbers = parameters(law, dead_zone=0.5, release=0.1, opening=0.25)
    state, found = law.kind.initial, []
    for torque in (1.7, 1.4, 1.7, 1.95, 2.4, 2.6, 2.05):
        command, state = law.kind.update(given_numbers, state, 2.0, seen(torque), PERIOD)
        found.append(command)
    assert found == [0.0, 0.25, 0.25, 0.0, 0.0, -0.25, 0.0]


@pytest.mark.parametrize("law", FIXED_LAWS.values(), ids=list(FIXED_LAWS))
@pytest.mark.parametrize(
    "broken",
    [
        ConverterCounts(2500, 0, 700),
        ConverterCounts(2500, 4095, 700),
        ConverterCounts(0, 900, 700),
        ConverterCounts(2500, 900, 4095),
    ],
)
def test_a_reading_at_an_end_of_its_range_commands_nothing_for_good(law: FixedLaw, broken: ConverterCounts) -> None:
    whole = [int(number) for number in leaves(parameters(law))[2:]]
    own = law.numbers(ConverterLimits(*whole[:2]), *whole[2:])
    state: Any = SimpleNamespace(**{name: int(value) for name, value in law.kind.initial._asdict().items()})
    sound = ConverterCounts(3500, 900, 700)
    before, state = law.sample(own, state, sound)
    assert before != 0
    for readings in (broken, sound, sound):
        command, state = law.sample(own, state, readings)
        assert command == 0


def test_a_gain_beyond_its_number_is_told_from_one_within() -> None:
    settings = {item.name: PAPER.get(item.name, item.default or 0.0) for item in CONTROLLERS["pid"].quantities}
    assert largest_pid(settings, PERIOD, STEPS.torque_step) < 1.0
    assert largest_pid(settings | {"derivative_gain": 10.0}, PERIOD, STEPS.torque_step) > 1.0
    assert largest_pid(settings | {"anti_windup": 1001.0}, PERIOD, STEPS.torque_step) > 1.0
