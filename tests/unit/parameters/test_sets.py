"""The parameter sets that come with the package."""

import pytest

from ppafo.parameters import ParameterSet, load_device, load_parameter_set

COMPLETED = load_parameter_set("ppafo2011")
CONSISTENT = load_parameter_set("ppafo2011-consistent")
PRINTED = load_parameter_set("ppafo2011-printed")

VOLUMES = {f"actuator.{name}" for name in ("volume_per_angle", "dead_volume_1", "dead_volume_2")}
FINISHED = pytest.mark.parametrize("parameters", [COMPLETED, CONSISTENT], ids=lambda item: item.name)


def test_the_printed_set_holds_nothing_that_was_assumed() -> None:
    assert {entry.origin for entry in PRINTED.numbers.values()} <= {"published", "derived"}


@FINISHED
def test_every_value_that_is_not_published_gives_its_reason(parameters: ParameterSet) -> None:
    silent = [path for path, entry in parameters.numbers.items() if entry.origin != "published" and not entry.note]
    assert silent == []


@FINISHED
def test_every_published_value_is_as_printed_up_to_its_unit(parameters: ParameterSet) -> None:
    for path, entry in parameters.numbers.items():
        if entry.origin == "published":
            printed = PRINTED.numbers[path]
            assert (entry.value, entry.unit) == (printed.value, printed.unit), path


def test_the_consistent_set_differs_in_its_volumes_alone_and_says_what_they_rest_on() -> None:
    differing = {path for path in COMPLETED.numbers if COMPLETED.numbers[path].value != CONSISTENT.numbers[path].value}
    assert differing == VOLUMES
    assert set(CONSISTENT.numbers) - set(COMPLETED.numbers) == {"reported.torque_efficiency"}
    assert {CONSISTENT.numbers[path].origin for path in VOLUMES} == {"derived"}
    assert all(CONSISTENT.numbers[path].uncertainty for path in VOLUMES)


def test_energy_closes_in_the_consistent_set_and_its_chambers_keep_a_volume() -> None:
    actuator = load_device("ppafo2011-consistent").actuator
    efficiency = CONSISTENT.numbers["reported.torque_efficiency"].value
    assert actuator.torque_constant / actuator.volume_per_angle == pytest.approx(efficiency, rel=0.01)
    assert min(actuator.dead_volume_1, actuator.dead_volume_2) > 0.0


def test_every_accepted_contradiction_gives_a_reason() -> None:
    assert all(len(reason) > 40 for reason in COMPLETED.accepted.values())


def test_a_set_is_shown_in_two_lines() -> None:
    count = len(COMPLETED.numbers) + len(COMPLETED.texts)
    assert repr(COMPLETED).splitlines() == [
        f"ParameterSet 'ppafo2011': {COMPLETED.title}",
        f"  {count} values; valves: proportional (proportional), solenoid (solenoid), "
        "solenoid_recycling (solenoid_recycling)",
    ]
