"""The ground before a wearer and pushes on the trunk: heights without gaps, normals, and impulses."""

import math
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import ScenarioError
from ppafo.walking import load_walk
from ppafo.wearer.model.way import LEVEL, NOT_PUSHED, PIECES, Push, footing, next_push, push_now
from ppafo.wearer.way import EDGE, Stretch, met_by, way_of

START = Stretch("walk", 0.0, {"distance": 4.0, "slope": 0.0})
UP = Stretch("walk", 4.0, {"distance": 2.0, "slope": 0.08})
STEP = Stretch("step", 6.0, {"height": -0.03})
ON = Stretch("walk", 6.0 + EDGE, {"distance": 2.0, "slope": -0.02})


def test_the_ground_rises_by_its_slopes_and_steps_and_has_no_gap() -> None:
    way = way_of((START, UP, STEP, ON))
    places = np.arange(-2.0, 9.0, 1e-4)
    heights = np.array([footing(way, x).height for x in places.tolist()])
    known = [0.0, 0.0, 0.0, 0.16, 0.13, 0.13 - 0.02 * 2.0]
    assert np.interp(places, [-2.0, 0.0, 4.0, 6.0, 6.0 + EDGE, 8.0 + EDGE], known)[places < 8.0] == pytest.approx(
        heights[places < 8.0], abs=1e-12
    )
    assert np.abs(np.diff(heights)).max() < 1e-4 * 0.03 / EDGE * 1.001


def test_sine_and_cosine_are_those_of_the_slope_under_a_place() -> None:
    way = way_of((START, UP, STEP, ON))
    for x, slope in ((1.0, 0.0), (5.0, 0.08), (6.005, -0.03 / EDGE), (7.0, -0.02)):
        under = footing(way, x)
        assert (under.sine, under.cosine) == pytest.approx(
            (math.sin(math.atan(slope)), math.cos(math.atan(slope))), rel=1e-14
        )


def test_behind_a_step_the_ground_goes_on_with_the_slope_before_it() -> None:
    way = way_of((START, UP, STEP))
    assert footing(way, 7.0).height == pytest.approx(0.16 - 0.03 + 0.08 * (1.0 - EDGE), abs=1e-12)


def test_a_push_begins_once_where_the_hip_comes_to_its_place_and_has_its_impulse_at_any_step() -> None:
    way = LEVEL._replace(pushes=(Push(0.5, -80.0, 0.15), *LEVEL.pushes[1:]))
    for step in (1e-3, 1e-4, 0.7e-4):
        pushed, impulse, x = NOT_PUSHED, 0.0, 0.0
        for number in range(round(1.0 / step)):
            impulse += step * push_now(pushed, step)
            assert (push_now(pushed, step) == 0.0) or 0.5 <= x < 0.7
            # To and fro: the place is passed several times.
            x = number * step + 0.02 * math.sin(60.0 * number * step)
            pushed = next_push(way, pushed, x, step)
        assert impulse == pytest.approx(-80.0 * 0.15, rel=1e-9)


def test_where_somebody_fell_is_said_of_what_was_met_last() -> None:
    push = Stretch("push", 9.0, {"force": -50.0, "duration": 0.1})
    way = (START, UP, STEP, ON, push)
    assert met_by(way, 3.0) == ""
    assert met_by(way, 3.5) == "on the slope of +8 %"
    assert met_by(way, 5.0) == "on the slope of +8 %"
    assert met_by((START, UP, STEP), 6.2) == "on the step of -3 cm"
    assert met_by((START, UP, STEP), 8.0) == "2.0 m after the step of -3 cm"
    assert met_by(way, 8.9) == "on the slope of -2 %"
    assert met_by(way, 10.0) == "1.0 m after the push of -50 N for 0.1 s"


def test_a_way_of_more_pieces_than_there_are_is_refused() -> None:
    steps = [Stretch("step", 4.0 + number, {"height": 0.02}) for number in range(PIECES)]
    with pytest.raises(ScenarioError, match=f"the ground has {2 * PIECES + 1} pieces, {PIECES} at most"):
        way_of((START, *steps))


def test_a_task_sequence_of_too_many_pieces_is_refused_by_the_name_of_its_file(tmp_path: Path) -> None:
    step = '[[segment]]\nkind = "walk"\ndistance = "3 m"\n[[segment]]\nkind = "step"\nheight = "1 cm"\n'
    (tmp_path / "stairway.toml").write_text(f'schema_version = 1\nname = "stairway"\n{PIECES * step}')
    with pytest.raises(ScenarioError, match=r"stairway\.toml: the ground has \d+ pieces"):
        load_walk("reacting", task_sequence=tmp_path / "stairway.toml")
