"""Any torque law walks under its own name: no module, no line of the catalogue."""

import pytest

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.walking.catalog import WALKING_CONTROLLERS, walking_controllers
from ppafo.errors import ScenarioError
from ppafo.model.helping import MID_STANCE, PUSH_OFF
from ppafo.model.valves.kind import VENT
from ppafo.walking import load_walk, walk
from ppafo.walking.planning import law_of

LAWS = sorted(
    name for name, law in CONTROLLERS.items() if name != "constant" and law.plan is None and "torque" in law.controls
)
NEW = sorted(name for name in LAWS if walking_controllers()[name] not in WALKING_CONTROLLERS.values())


@pytest.mark.parametrize("law", LAWS)
def test_every_torque_law_is_named_in_a_walk_file_by_its_own_name(law: str) -> None:
    configuration = load_walk("proportional", [f"controller.kind={law}"])
    for item in CONTROLLERS[law].quantities:
        assert item.name in configuration.controller.settings
    assert configuration.controller.peak_torque == 5.0


@pytest.mark.parametrize("name", ["event_pid", "event_feedback_linearisation", "event_on_off_dead_zone"])
def test_a_law_of_walking_is_the_same_under_both_names(name: str) -> None:
    old = load_walk("proportional", [f"controller.kind={name}"])
    new = load_walk("proportional", [f"controller.kind={name.removeprefix('event_')}"])
    assert law_of(new) is law_of(old)
    assert new.controller.settings == old.controller.settings


def test_a_law_that_no_line_names_walks_with_gains_of_the_device_too() -> None:
    assert NEW == ["damped_proportional", "on_off"]
    walked = load_walk("proportional", ["controller.kind=damped_proportional"])
    listed = load_walk("proportional", ["controller.kind=pid"])
    assert walked.controller.proportional_gain == listed.controller.proportional_gain


def test_a_constant_command_does_not_walk_and_the_answer_names_what_does() -> None:
    with pytest.raises(ScenarioError, match=r"'constant' is not known.*on_off.*pid") as caught:
        load_walk("proportional", ["controller.kind=constant"])
    assert "\n" not in str(caught.value)


def test_the_law_of_the_paper_walks_and_follows_the_torque_of_its_phases() -> None:
    result = walk(load_walk("solenoid", ["controller.kind=on_off"]), minutes=0.1)
    assert result.status.is_completed
    phase, command = result.recording["controller_phase"], result.recording["command"]
    assert set(command[phase == MID_STANCE]) == {VENT}
    assert set(command[phase == PUSH_OFF]) <= {-1.0, 1.0, VENT}
    assert result.metrics["net_push_off_work"].value > 0.5
