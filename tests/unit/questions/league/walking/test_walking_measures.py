"""What the league says of a walk, from courses made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from ppafo.control.walking.assistance import TorqueProfile, profile_torque
from ppafo.model.contact import SWING, TOE
from ppafo.model.gait import GaitTiming
from ppafo.model.valves.kind import VENT
from ppafo.questions.league.walking.measures import MEASURES, Course, last_strides, measures, switchings
from ppafo.walking.events import EVENTS

PROFILE = TorqueProfile(5.0, 0.5, 0.2, 0.1)
TIMING = GaitTiming(1.0, 0.0, 0.4, 0.6, 0.7, 0.9, 0.0)
SAMPLES = 100
STRIDES = 5


def walked() -> Course:
    """Five strides of a hundred samples and the beginning of a sixth, with the wanted torque and a healthy ankle."""
    turns = np.arange(STRIDES * SAMPLES + 2) / SAMPLES
    phase = turns % 1.0
    angle = 1.6 + 0.1 * np.sin(2.0 * np.pi * phase)
    wanted = np.array([profile_torque(PROFILE, value) for value in phase])
    nothing = np.zeros_like(phase)
    return Course(
        phase=phase,
        contact=np.where(phase > TIMING.toe_off, SWING, TOE),
        angle=angle,
        healthy_angle=angle,
        torque=wanted,
        command=nothing,
        toe_height=nothing + 0.02,
        gas=3.0e-4 * turns,
        slap_rates=-6.0 * np.floor(turns),
        landings=np.floor(turns),
        toe_landings=nothing,
        push_off_work=1.5 * turns,
        vented=nothing,
    )


def measured(course: Course) -> dict[str, float]:
    return measures(course, PROFILE, TIMING, last_strides(course.phase))


def with_events(course: Course, late: int) -> Course:
    """The course with its events known so many samples late."""
    places = dict(zip(EVENTS, (0, 10, 40, 60), strict=True))
    true = {name: place + SAMPLES * np.arange(STRIDES) for name, place in places.items()}
    return replace(course, true_events=true, known_events={name: found + late for name, found in true.items()})


def test_events_that_are_known_late_are_an_error_of_that_time_and_no_events_are_none() -> None:
    found = measured(with_events(walked(), 3))
    assert found["event_error"] == pytest.approx(0.03)
    assert found["strike_error"] == pytest.approx(0.03)
    assert "event_error" not in measured(walked())


def test_only_whole_strides_of_the_second_half_count() -> None:
    strides = last_strides(walked().phase)
    assert [(stride.start, stride.stop) for stride in strides] == [(300, 400), (400, 500)]
    assert last_strides(np.linspace(0.0, 0.9, 10)) == []


def test_every_measure_is_there_and_a_perfect_walk_has_no_errors() -> None:
    found = measured(with_events(walked(), 0))
    assert set(found) == set(MEASURES)
    assert found["torque_error"] == pytest.approx(0.0, abs=1e-4)
    assert found["swing_error"] == 0.0
    assert found["gas"] == pytest.approx(3.0e-4)
    assert found["push_off_work"] == pytest.approx(1.5)
    assert found["slap_rate"] == pytest.approx(-6.0)
    assert (found["toes_clear"], found["toe_strikes"], found["safe_state"]) == (1.0, 0.0, 0.0)


def test_torque_counts_in_push_off_and_the_angle_in_the_swing() -> None:
    course = walked()
    pushes = (course.phase > 0.299) & (course.phase < 0.601)
    off = replace(course, torque=course.torque + np.where(pushes, 0.5, 40.0))
    assert measured(off)["torque_error"] == pytest.approx(0.5, abs=1e-3)
    swings = course.phase > TIMING.toe_off
    bent = replace(course, angle=course.angle + np.where(swings, 0.2, 3.0))
    assert measured(bent)["swing_error"] == pytest.approx(0.2)


def test_a_torque_that_comes_late_has_that_lag_and_no_error_but_it() -> None:
    course = walked()
    late = np.array([profile_torque(PROFILE, value - 0.03) for value in course.phase])
    found = measured(replace(course, torque=late + 0.2))
    assert found["torque_lag"] == pytest.approx(0.03, abs=1e-9)
    assert found["lagged_error"] == pytest.approx(0.2, abs=2e-3)
    assert found["torque_error"] > 0.5


def test_torque_in_mid_stance_is_resistance() -> None:
    course = walked()
    free = (course.phase > 0.199) & (course.phase < 0.3)
    found = measured(replace(course, torque=course.torque + np.where(free, -0.7, 0.0)))
    assert found["mid_stance_torque"] == pytest.approx(0.7)
    assert measured(course)["mid_stance_torque"] == 0.0


def test_a_push_off_that_would_outlast_the_stance_is_judged_up_to_toe_off() -> None:
    course = walked()
    late = PROFILE._replace(peak_time=0.58)
    wanted = np.array([profile_torque(late, value) if value <= 0.6 else -3.0 for value in course.phase])
    found = measures(replace(course, torque=wanted), late, TIMING, last_strides(course.phase))
    assert found["torque_error"] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(
    ("strike", "clear", "begins"),
    [(300, 1.0, 0.5), (400, 0.5, 0.5), (500, 0.5, 0.0)],
)
def test_a_strike_of_the_toes_ends_the_swing_before_it_and_begins_the_stride_after_it(
    strike: int, clear: float, begins: float
) -> None:
    course = walked()
    struck = np.where(np.arange(course.phase.size) >= strike, 1.0, 0.0)
    found = measured(replace(course, toe_landings=struck))
    assert (found["toes_clear"], found["toe_strikes"]) == (clear, begins)


def test_toes_are_judged_by_their_lowest_in_mid_swing() -> None:
    course = walked()
    height = course.toe_height.copy()
    height[300 + 80], height[400 + 65] = -0.01, -0.5
    found = measured(replace(course, toe_height=height))
    assert found["toe_height"] == pytest.approx(0.5 * (-0.01 + 0.02))
    assert found["toes_clear"] == 0.5


def test_a_command_of_zero_between_two_ways_is_no_switching_but_venting_is() -> None:
    assert switchings(np.array([1.0, 0.0, 0.4, 0.0, -0.2, -1.0])) == 1.0
    assert switchings(np.array([1.0, VENT, 1.0])) == 2.0
    assert switchings(np.zeros(5)) == 0.0
    course = walked()
    found = measured(replace(course, command=np.where(course.phase < 0.5, 1.0, -1.0)))
    assert found["switchings"] == pytest.approx(1.5)


def test_a_controller_that_vented_for_good_is_seen() -> None:
    course = walked()
    assert measured(replace(course, vented=np.where(np.arange(course.phase.size) > 450, 1.0, 0.0)))["safe_state"] == 1.0
