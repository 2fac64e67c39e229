"""Regulators and the lines behind them: droop, largest flow, mass, and a step that any droop may have."""

import math
from itertools import pairwise

import pytest

from ppafo.model.regulator import LineState, SupplyLines, line_pressures, regulated_mass, step_lines

GAS_PRODUCT = 56308.0
SET_1, SET_2 = 446.0e3, 300.0e3
LINES = SupplyLines(3.0e6, 10.0e-3, 10.0e-6, 30.0e6, 1.5e-3, 2.0e-6, 0.0)


def full(lines: SupplyLines, set_1: float = SET_1, set_2: float = SET_2) -> LineState:
    """Both lines at what their regulators are set to."""
    return LineState(set_1 * lines.volume_1 / GAS_PRODUCT, set_2 * lines.volume_2 / GAS_PRODUCT, 0.0)


def drawn(
    lines: SupplyLines, flow_1: float, flow_2: float, step: float, count: int, set_2: float = SET_2
) -> tuple[LineState, LineState]:
    """Lines before the last step and after it, under two steady draws [kg/s]."""
    before = after = full(lines, SET_1, set_2)
    for _ in range(count):
        before = after
        guess = step_lines(lines, SET_1, set_2, GAS_PRODUCT, before, step * flow_1, step * flow_2, 0.0, step)
        after = step_lines(
            lines, SET_1, set_2, GAS_PRODUCT, before, step * flow_1, step * flow_2, guess.inlet_rise, step
        ).after
    return before, after


@pytest.mark.parametrize("step", [1.0e-5, 1.0e-3, 0.1])
def test_a_steady_draw_lowers_each_line_by_its_droop_with_any_step(step: float) -> None:
    _, after = drawn(LINES, 2.0e-3, 0.5e-3, step, max(200, int(0.5 / step)))
    pressure_1, pressure_2 = line_pressures(LINES, GAS_PRODUCT, after)
    # The second regulator hangs behind the first, which therefore passes both draws.
    assert SET_1 - pressure_1 == pytest.approx(LINES.droop_1 * 2.5e-3, rel=1e-9)
    assert SET_2 - pressure_2 == pytest.approx(LINES.droop_2 * 0.5e-3, rel=1e-9)


def test_no_more_than_the_largest_flow_comes_through() -> None:
    step = 1.0e-4
    before, after = drawn(LINES, 15.0e-3, 0.0, step, 40)
    assert (after.regulated_mass - before.regulated_mass) / step == pytest.approx(LINES.largest_flow_1, rel=1e-12)
    assert line_pressures(LINES, GAS_PRODUCT, after)[0] < SET_1 - LINES.droop_1 * LINES.largest_flow_1


@pytest.mark.parametrize(
    ("fall", "flow"), [(-1.0e4, 0.0), (0.0, 0.0), (3.0e3, 1.0e-3), (30.0e3, 10.0e-3), (2.0e5, 10.0e-3)]
)
def test_the_flow_is_the_fall_over_the_droop_between_nothing_and_the_largest(fall: float, flow: float) -> None:
    # A short step passes what the flow at its beginning says.
    mass = regulated_mass(fall, 0.0, GAS_PRODUCT / 10.0e-6, 3.0e6, 10.0e-3, 0.0, 1.0e-9)
    assert mass == pytest.approx(flow * 1.0e-9, rel=1e-5)


def test_nothing_flows_back_through_a_regulator() -> None:
    state = LineState(1.2 * full(LINES).mass_1, 1.2 * full(LINES).mass_2, 0.0)
    after = step_lines(LINES, SET_1, SET_2, GAS_PRODUCT, state, -1.0e-7, -1.0e-8, 0.0, 1.0e-3).after
    assert after == LineState(state.mass_1 + 1.0e-7, state.mass_2 + 1.0e-8, 0.0)


def test_a_relieving_regulator_lets_gas_flow_back_at_its_droop_and_no_faster_than_forwards() -> None:
    given = (GAS_PRODUCT / 10.0e-6, 3.0e6, 10.0e-3, 1.0, 1.0e-9)
    for fall, flow in ((-3.0e3, -1.0e-3), (-2.0e5, -10.0e-3), (3.0e3, 1.0e-3)):
        assert regulated_mass(fall, 0.0, *given) == pytest.approx(flow * 1.0e-9, rel=1e-5)
    relieving, state = LINES._replace(relieving=1.0), full(LINES)
    for _ in range(400):
        state = step_lines(relieving, SET_1, SET_2, GAS_PRODUCT, state, -1.0e-6, -1.0e-7, 0.0, 1.0e-3).after
    assert state.regulated_mass == pytest.approx(-400 * 1.1e-6, rel=1e-2)
    assert line_pressures(LINES, GAS_PRODUCT, state)[0] == pytest.approx(SET_1 + 3.0e6 * 1.1e-3, rel=1e-3)


def test_a_step_of_no_length_changes_nothing() -> None:
    state = LineState(0.5 * full(LINES).mass_1, 0.5 * full(LINES).mass_2, 1.0e-3)
    assert step_lines(LINES, SET_1, SET_2, GAS_PRODUCT, state, 0.0, 0.0, 0.0, 0.0).after == state


@pytest.mark.parametrize("set_2", [SET_2, SET_1])
def test_what_comes_through_is_what_the_lines_gain_and_give(set_2: float) -> None:
    first, last = full(LINES, SET_1, set_2), drawn(LINES, 4.0e-3, 2.0e-3, 1.0e-3, 300, set_2)[1]
    gained = last.mass_1 - first.mass_1 + last.mass_2 - first.mass_2
    assert last.regulated_mass == pytest.approx(gained + 6.0e-3 * 0.3, rel=1e-12)


def test_a_regulator_without_droop_holds_its_line() -> None:
    stiff = LINES._replace(droop_1=1.0, droop_2=1.0)
    _, after = drawn(stiff, 4.0e-3, 1.0e-3, 1.0e-3, 50)
    assert line_pressures(stiff, GAS_PRODUCT, after) == pytest.approx((SET_1, SET_2), rel=1e-5)


@pytest.mark.parametrize("volume_2", [1.0e-6, 10.0e-6, 1.0e-3])
@pytest.mark.parametrize("droop_2", [1.0, 1.0e5, 1.0e8])
def test_two_lines_with_one_setting_settle_whatever_their_size(volume_2: float, droop_2: float) -> None:
    """The second regulator then stands open, and both lines are one room."""
    lines = LINES._replace(volume_2=volume_2, droop_2=droop_2, largest_flow_2=1.0)
    state = full(lines, SET_1, 0.7 * SET_1)
    pressures = []
    for _ in range(6000):
        guess = step_lines(lines, SET_1, SET_1, GAS_PRODUCT, state, 0.0, 0.0, 0.0, 1.0e-3)
        state = step_lines(lines, SET_1, SET_1, GAS_PRODUCT, state, 0.0, 0.0, guess.inlet_rise, 1.0e-3).after
        pressures.append(line_pressures(lines, GAS_PRODUCT, state))
    assert max(max(pair) for pair in pressures) <= SET_1 * (1.0 + 1.0e-9)
    assert math.isclose(pressures[-1][0], SET_1, rel_tol=1e-3)
    late = [pair[1] for pair in pressures[3000:]]
    assert all(after >= before - 1.0e-6 * SET_1 for before, after in pairwise(late))
