"""The walking task and who takes part: the same for all, and what does not fit is refused in one line."""

import pytest

from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.errors import ScenarioError
from ppafo.questions.league.standing import WALKING_ENTRANTS
from ppafo.questions.league.walking.task import walking_task
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import law_of


def test_every_walking_controller_of_the_catalogue_takes_part_under_a_name_of_its_own() -> None:
    assert {entrant.kind for entrant in WALKING_ENTRANTS} == set(WALKING_CONTROLLERS)
    names = [entrant.name for entrant in WALKING_ENTRANTS]
    assert len(set(names)) == len(names)
    assert all(entrant.source and entrant.found for entrant in WALKING_ENTRANTS)
    assert {entrant.valve for entrant in WALKING_ENTRANTS} == {"proportional", "solenoid"}


def test_every_entrant_is_told_the_same_torque_on_its_own_valve() -> None:
    task = walking_task(overrides=["desired.peak_torque=4 N m", "wearer.body_mass=90 kg"])
    assert task.profile.peak_torque == 4.0
    for entrant in WALKING_ENTRANTS:
        configuration = task.configuration(entrant.kind, entrant.valve)
        assert configuration.control.kind == entrant.kind
        assert configuration.device.valve.kind == entrant.valve
        assert walk_of(configuration).wearer.body_mass == 90.0
        if "peak_torque" in configuration.control.settings:
            told = tuple(configuration.control.settings[name] for name in task.profile._fields)
            assert told == pytest.approx(tuple(task.profile), rel=1e-12)


def test_what_the_controllers_are_told_does_not_move_what_is_judged() -> None:
    task = walking_task(overrides=["controller.peak_time=0.5", "controller.peak_torque=3 N m"])
    assert task.profile == walking_task().profile
    assert (task.told.peak_time, task.told.peak_torque) == (0.5, 3.0)
    assert task.configuration("event_pid", "proportional").control.settings["peak_time"] == 0.5
    moved = walking_task(overrides=["desired.peak_time=0.5"])
    assert moved.profile == moved.told
    assert moved.profile.peak_time == 0.5


def test_a_timing_is_that_of_all_that_keep_time_and_an_entrant_may_have_its_own() -> None:
    task = walking_task(overrides=["timing.kind=fractional"])
    kinds = ("event_pid", "event_on_off", "off")
    clocks = [getattr(law_of(task.configuration(kind, "proportional")).initial, "clock", None) for kind in kinds]
    assert [type(clock).__name__ for clock in clocks] == ["GaitClock", "GaitClock", "NoneType"]
    timed = {entrant.name: entrant.overrides for entrant in WALKING_ENTRANTS if entrant.overrides}
    assert timed["event_on_off-solenoid-estimated"] == ("timing.kind=estimated",)
    assert len(timed) == 4


def test_a_task_of_another_file_keeps_its_wearer_and_its_thresholds() -> None:
    task = walking_task("solenoid", ["controller.load_threshold=70 N"])
    configuration = task.configuration("event_proportional", "proportional")
    assert configuration.control.settings["load_threshold"] == 70.0
    assert configuration.device.valve.kind == "proportional"


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("controller.kind=off", "has its own"),
        ("device.valve=solenoid", "has its own"),
        ("controller.torque_gain=2", "not all controllers have 'torque_gain'"),
        ("controller.peak_torqe=2 N m", "did you mean 'peak_torque'"),
        ("desired.peak_torque=0 N m", "a desired torque"),
        ("desired.peak_time=0.8", "too late for a push-off"),
        ("desired.peak_tim=0.5", "did you mean 'peak_time'"),
    ],
)
def test_what_is_not_for_all_is_refused(override: str, said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        walking_task(overrides=[override])


@pytest.mark.parametrize("minutes", [0.0, 0.05, 2.0, float("nan")])
def test_a_walk_too_short_to_learn_from_or_too_long_to_record_is_refused(minutes: float) -> None:
    with pytest.raises(ScenarioError, match=r"0\.1 to 1 minutes"):
        walking_task(minutes=minutes)
