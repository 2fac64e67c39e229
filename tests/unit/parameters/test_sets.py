"""The parameter sets that come with the package."""

from ppafo.parameters import load_parameter_set

COMPLETED = load_parameter_set("ppafo2011")
PRINTED = load_parameter_set("ppafo2011-printed")


def test_the_printed_set_holds_nothing_that_was_assumed() -> None:
    assert {entry.origin for entry in PRINTED.numbers.values()} <= {"published", "derived"}


def test_every_value_that_is_not_published_gives_its_reason() -> None:
    silent = [path for path, entry in COMPLETED.numbers.items() if entry.origin != "published" and not entry.note]
    assert silent == []


def test_every_published_value_is_as_printed_up_to_its_unit() -> None:
    for path, entry in COMPLETED.numbers.items():
        if entry.origin == "published":
            printed = PRINTED.numbers[path]
            assert (entry.value, entry.unit) == (printed.value, printed.unit), path


def test_every_accepted_contradiction_gives_a_reason() -> None:
    assert all(len(reason) > 40 for reason in COMPLETED.accepted.values())


def test_a_set_is_shown_in_two_lines() -> None:
    count = len(COMPLETED.numbers) + len(COMPLETED.texts)
    assert repr(COMPLETED).splitlines() == [
        f"ParameterSet 'ppafo2011': {COMPLETED.title}",
        f"  {count} values; valves: proportional (proportional), solenoid (solenoid)",
    ]
