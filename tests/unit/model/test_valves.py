"""The valves' own dynamics, against closed forms."""

import cmath
import math
import random

import pytest

from ppafo.engine.scheme.motion import until_jump
from ppafo.model.valves import proportional, solenoid

SPOOL = proportional.ProportionalSettings(
    dead_band=0.0, delay=0.0, spool_frequency=50.0, spool_damping_ratio=0.5, slew_limit=0.0
)
PAIR = solenoid.TimedSolenoid(opening_delay=0.003, closing_delay=0.005, switching_interval=0.05)


def closed_spool_step(angular: float, damping_ratio: float, step: float) -> tuple[complex, ...]:
    """The numbers of ``SpoolStep`` from the eigenvalues of the spool, with x'/w instead of x'; not near damping 1."""
    root = cmath.sqrt(damping_ratio * damping_ratio - 1.0)
    # The smaller eigenvalue from the product of both, because their sum loses it.
    fast = (-damping_ratio - root) * angular * step
    slow = (angular * step) ** 2 / fast

    def of_matrix(at_slow: complex, at_fast: complex) -> tuple[complex, complex]:
        by_rate = angular * step * (at_slow - at_fast) / (slow - fast)
        return (slow * at_fast - fast * at_slow) / (slow - fast), by_rate

    def mean(eigenvalue: complex) -> complex:
        return (cmath.exp(eigenvalue) - 1.0) / eigenvalue

    by_opening, by_rate = of_matrix(cmath.exp(slow), cmath.exp(fast))
    rate_by_rate = by_opening - 2.0 * damping_ratio * by_rate
    return by_opening, by_rate, -by_rate, rate_by_rate, *of_matrix(mean(slow), mean(fast))


@pytest.mark.parametrize("decade", [-2, -1, 0, 1, 2, 3, 5])
def test_spool_step_is_the_closed_form_for_any_frequency_damping_and_length(decade: int) -> None:
    draw = random.Random(decade)
    for _ in range(200):
        angular, angle = 2.0 * math.pi * 10.0 ** draw.uniform(-1.0, 3.3), 10.0 ** (decade + draw.random())
        damping = draw.choice([draw.uniform(0.05, 0.98), draw.uniform(1.02, 5.0)])
        found = proportional.spool_step(angular, damping, angle / angular)
        by_opening, by_rate, rate_by_opening, rate_by_rate, mean_by_opening, mean_by_rate = found
        scaled = (by_opening, by_rate * angular, rate_by_opening / angular, rate_by_rate)
        expected = closed_spool_step(angular, damping, angle / angular)
        assert [*scaled, mean_by_opening, mean_by_rate * angular] == pytest.approx(
            [number.real for number in expected], rel=0.0, abs=1e-12 if decade < 2 else 1e-11
        )


def test_slew_limit_bounds_the_rate_of_the_opening() -> None:
    valve = proportional.prepare_moving(SPOOL._replace(spool_frequency=0.0, slew_limit=20.0))
    state = proportional.SpoolState()
    for _ in range(25):
        _, state = proportional.advance_moving(valve, state, 0.6, 0.0, 1e-3)
    assert state.opening == pytest.approx(0.5)


def run_pair(
    settings: solenoid.TimedSolenoid, command_at: dict[float, float], until: float
) -> list[tuple[float, str, float]]:
    """Switchings (time, valve, position) of a pair whose command changes at given times."""
    valve = solenoid.prepare_timed(settings)
    state, command, time, seen = solenoid.PairState(), 0.0, 0.0, []
    while time < until:
        command = command_at.get(round(time, 6), command)
        before = state
        state = solenoid.settle_timed(valve, state, command, time)
        for name, old, new in (("A", before.coil_a, state.coil_a), ("B", before.coil_b, state.coil_b)):
            if old.position != new.position:
                seen.append((time, name, new.position))
        waiting = [moment for moment in command_at if moment > time]
        time = min([solenoid.next_timed_event(valve, state, command, time), until, *waiting])
    return seen


def test_opening_and_closing_take_their_delays() -> None:
    assert run_pair(PAIR, {0.0: 1.0, 0.1: 0.0}, 0.2) == [
        (pytest.approx(0.003), "A", 1.0),
        (pytest.approx(0.105), "A", 0.0),
    ]


def test_coil_accepts_a_second_order_only_after_the_switching_interval() -> None:
    assert run_pair(PAIR, {0.0: 1.0, 0.01: 0.0}, 0.2)[-1] == (pytest.approx(0.055), "A", 0.0)


def test_pulse_shorter_than_the_opening_delay_never_reaches_the_flow() -> None:
    settings = PAIR._replace(switching_interval=0.0)
    assert run_pair(settings, {0.0: 1.0, 0.002: 0.0}, 0.2) == []


def parts_of_a_step(settings: solenoid.TimedSolenoid, command: float, step: float) -> list[float]:
    """Lengths of the parts of a step that begins with a pair energised for chamber 1 long ago."""
    valve = solenoid.prepare_timed(settings)
    state = solenoid.settle_timed(valve, solenoid.PairState(), 1.0, 0.0)
    state = solenoid.settle_timed(valve, state, 1.0, 0.5)
    time, remaining, lengths = 1.0, step, []
    while remaining > 0.0:
        settled = solenoid.settle_timed(valve, state, command, time)
        length = until_jump(solenoid.next_timed_event(valve, settled, command, time) - time, remaining)
        _, state = solenoid.advance_timed(valve, state, command, time, length)
        lengths.append(length)
        time, remaining = time + length, 0.0 if length == remaining else remaining - length
    return lengths


def test_step_is_cut_at_every_switching_inside_it() -> None:
    settings = solenoid.TimedSolenoid(opening_delay=0.0003, closing_delay=0.0007, switching_interval=0.0)
    assert parts_of_a_step(settings, -1.0, 1e-3) == pytest.approx([0.0003, 0.0004, 0.0003])
