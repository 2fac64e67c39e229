"""What a set changes of its parent: numbers in SI, kinds, and units that did not fit."""

from dataclasses import replace

from ppafo.parameters import apply_overrides, load_parameter_set
from ppafo.parameters.audit.changes import changes

PARENT = load_parameter_set("ppafo2011")


def test_a_value_in_another_unit_is_no_change_and_one_with_another_number_is() -> None:
    same = apply_overrides(PARENT, ["actuator.dead_volume_1=36000 mm^3", "gas.temperature=24.85 degC"])
    assert changes(same, PARENT) == []
    (change,) = changes(apply_overrides(PARENT, ["actuator.dead_volume_1=36001 mm^3"]), PARENT)
    assert (change.path, change.before, change.after) == ("actuator.dead_volume_1", "36 cm^3", "36001 mm^3")


def test_a_valve_of_another_kind_is_a_change() -> None:
    other = replace(PARENT, valve_kinds={**PARENT.valve_kinds, "solenoid": "proportional"})
    assert [(change.path, change.before, change.after) for change in changes(other, PARENT)] == [
        ("valves.solenoid.kind", "solenoid", "proportional")
    ]


def test_the_mending_of_a_unit_that_does_not_fit_is_a_change() -> None:
    found = {change.path: change for change in changes(PARENT, load_parameter_set("ppafo2011-printed"))}
    mended = found["valves.solenoid.discharge_coefficient"]
    assert (mended.before, mended.after) == ("0.113 s/m", "0.113")
