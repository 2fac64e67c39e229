"""Heel strikes and toe-offs in a vertical force: hysteresis, debounce, and what is cut at the ends."""

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait.recorded.footfalls import strides_from_force, strides_from_shank
from ppafo.gait.recorded.signal import Signal
from ppafo.signals.recording import Floats

RATE = 1000.0
STRIKES, STANCE = (0.5, 1.5, 2.6, 3.6), 0.6


def force(*contacts: tuple[float, float], level: float = 1.0, end: float = 4.0) -> Signal:
    """A force that is there during some contacts and nowhere else."""
    time = np.arange(0.0, end, 1.0 / RATE)
    values = np.zeros(time.size)
    for first, last in contacts:
        values[(time >= first) & (time < last)] = level
    return Signal("plate.csv", time, values)


def plain() -> list[tuple[float, float]]:
    return [(strike, strike + STANCE) for strike in STRIKES]


def test_every_heel_strike_and_toe_off_is_found_to_a_sample() -> None:
    found = strides_from_force(force(*plain()))
    assert [item.start for item in found] == pytest.approx(STRIKES[:3], abs=1.1 / RATE)
    assert [item.toe_off for item in found] == pytest.approx(
        [strike + STANCE for strike in STRIKES[:3]], abs=1.1 / RATE
    )
    assert [item.end for item in found] == pytest.approx(STRIKES[1:], abs=1.1 / RATE)
    assert found[0].stance_share == pytest.approx(0.6, abs=0.003)


def test_a_crossing_between_two_samples_is_interpolated() -> None:
    time = np.arange(0.0, 4.0, 0.1)
    values = np.interp(time, *_ramps())
    found = strides_from_force(Signal("plate.csv", time, values))
    assert found[0].start == pytest.approx(0.515, abs=1e-9)


def _ramps() -> tuple[Floats, Floats]:
    """A force that grows from 0 at 0.5 s to 1 at 0.8 s, twice."""
    times, values = [0.0], [0.0]
    for start in (0.5, 1.5, 2.5):
        times += [start, start + 0.3, start + 0.5, start + 0.6]
        values += [0.0, 1.0, 1.0, 0.0]
    return np.array([*times, 4.0]), np.array([*values, 0.0])


def test_noise_between_the_thresholds_makes_no_event() -> None:
    quiet = force(*plain())
    noise = 0.04 + 0.009 * np.sin(2.0 * np.pi * 90.0 * quiet.time)
    noisy = Signal(
        quiet.file, quiet.time, np.where(quiet.values > 0.0, quiet.values, noise * (quiet.time % 0.3 < 0.05))
    )
    assert len(strides_from_force(noisy)) == 3


def test_a_short_touch_in_swing_and_a_short_break_in_stance_are_no_events() -> None:
    touched = [*plain(), (1.25, 1.30)]
    assert [item.start for item in strides_from_force(force(*touched))] == pytest.approx(STRIKES[:3], abs=0.002)
    broken = [(0.5, 0.7), (0.75, 1.1), *plain()[1:]]
    assert [item.start for item in strides_from_force(force(*broken))] == pytest.approx(STRIKES[:3], abs=0.002)


def test_a_contact_that_the_record_cuts_gives_no_heel_strike() -> None:
    found = strides_from_force(force((0.0, 0.3), *plain(), end=3.9))
    assert [item.start for item in found] == pytest.approx(STRIKES[:3], abs=0.002)


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_a_force_that_never_changes_has_no_strides(level: float) -> None:
    assert strides_from_force(force((0.0, 9.0), level=level)) == []


def test_a_shank_that_does_not_lean_back_has_no_toe_off() -> None:
    time = np.arange(0.0, 5.0, 0.01)
    shank = Signal("ik.mot", time, np.radians(10.0 + 15.0 * np.cos(2.0 * np.pi * time)))
    with pytest.raises(
        DataError, match=r"ik.mot: no toe-off was found: .*, the shank does not lean forward far enough"
    ):
        strides_from_shank(shank)
