"""Events of a stride: when they happen, when a controller knows of them, and the error between both."""

import numpy as np
import pytest

from ppafo.model.contact import FLAT, HEEL, SWING, TOE
from ppafo.walking.stride_events import EVENTS, event_errors, known_events, true_events


def test_events_begin_where_the_foot_changes_how_it_stands() -> None:
    contact = np.repeat([SWING, HEEL, FLAT, TOE, SWING, HEEL], 10)
    assert {name: found.tolist() for name, found in true_events(contact).items()} == {
        "heel strike": [10, 50],
        "toes on": [20],
        "heel off": [30],
        "toes off": [40],
    }


def test_a_controller_without_a_clock_knows_what_its_switches_show_and_one_with_a_clock_what_that_has_passed() -> None:
    heel = np.repeat([0.0, 1.0, 1.0, 0.0, 0.0], 10)
    toe = np.repeat([0.0, 0.0, 1.0, 1.0, 0.0], 10)
    record = {
        "controller_state.phase.phase": np.repeat([0.0, 1.0, 2.0, 3.0, 0.0], 10),
        "controller_state.phase.heel.loaded": heel,
        "controller_state.phase.toe.loaded": toe,
    }
    assert {name: found.tolist() for name, found in known_events(record).items()} == dict(
        zip(EVENTS, ([10], [20], [30], [40]), strict=True)
    )
    clock = {"controller_state.clock.clock.event": np.repeat([3.0, 0.0, 1.0, 2.0, 3.0], 7)}
    assert [found.tolist() for found in known_events(record | clock).values()] == [[7], [14], [21], [28]]
    assert known_events({"walk.contact": heel}) == {}


def test_errors_are_those_of_the_nearest_known_event_and_what_is_far_is_missed_or_false() -> None:
    true, known = np.array([100, 1100, 2100, 3100]), np.array([90, 1125, 2600, 3103, 3110])
    found = event_errors(true, known, 1.0e-3, 1.0)
    assert found.errors == pytest.approx([-0.010, 0.025, 0.003])
    assert (found.missed, found.false) == (1, 2)
    assert found.rms == pytest.approx(np.sqrt(np.mean(np.array([-0.010, 0.025, 0.003]) ** 2)))
    nothing = event_errors(np.array([], dtype=np.intp), known, 1.0e-3, 1.0)
    assert (nothing.errors.size, nothing.missed, nothing.false) == (0, 0, 5)
    assert np.isnan(nothing.rms)
