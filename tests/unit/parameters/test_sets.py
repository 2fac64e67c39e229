"""The parameter sets that come with the package."""

from ppafo.parameters import load_parameter_set

COMPLETED = load_parameter_set("ppafo2011")
PRINTED = load_parameter_set("ppafo2011-printed")

VOLUMES = {f"actuator.{name}" for name in ("dead_volume_1", "dead_volume_2")}


def test_every_value_that_is_not_published_gives_its_reason() -> None:
    silent = [path for path, entry in COMPLETED.numbers.items() if entry.origin != "published" and not entry.note]
    assert silent == []


def test_every_published_value_is_as_printed_up_to_its_unit() -> None:
    for path, entry in COMPLETED.numbers.items():
        if entry.origin == "published":
            printed = PRINTED.numbers[path]
            assert (entry.value, entry.unit) == (printed.value, printed.unit), path


def test_the_volumes_of_the_completed_set_are_fitted_and_have_an_uncertainty_and_the_printed_one_is_kept() -> None:
    assert {COMPLETED.numbers[path].origin for path in VOLUMES} == {"derived"}
    assert all(COMPLETED.numbers[path].uncertainty for path in VOLUMES)
    assert PRINTED.numbers["actuator.displacement_per_radian"].value == 51.0
