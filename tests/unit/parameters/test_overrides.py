"""Overrides by dotted path."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.errors import ArgumentError, ParameterError
from ppafo.parameters import apply_overrides, load_device, load_parameter_set
from ppafo.parameters.device import Orifice
from ppafo.parameters.overrides import over
from ppafo.parameters.parameter_set import number_in_si

COMPLETED = load_parameter_set("ppafo2011")
PATHS = sorted(COMPLETED.numbers)


def problem_of(override: str) -> str:
    with pytest.raises(ParameterError) as caught:
        apply_overrides(COMPLETED, [override])
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_valve_means_the_valve_that_is_chosen() -> None:
    device = load_device("ppafo2011", valve="solenoid", overrides=("valve.area=5mm^2",))
    assert device.valve.orifice == Orifice(5e-6, 0.113)


def test_a_valve_by_name_is_changed_whichever_is_chosen() -> None:
    changed = apply_overrides(COMPLETED, ["valves.solenoid.area=5mm^2"], valve="proportional").numbers
    assert changed["valves.solenoid.area"].value == 5.0
    assert changed["valves.proportional.area"].value == 31.6


def test_an_override_stays_visible_and_tells_what_it_replaced() -> None:
    entry = apply_overrides(COMPLETED, ["valve.area=12.6mm^2"]).numbers["valves.proportional.area"]
    assert (entry.origin, entry.source) == ("assumed", "override")
    assert "31.6 mm^2 (published: " in entry.note


@pytest.mark.parametrize("other", ["valve.area=2mm^2", "valve.area=1mm^2", "valves.proportional.area=2mm^2"])
def test_a_value_that_is_given_twice_is_refused_with_both_overrides(other: str) -> None:
    for words in (["valve.area=1mm^2", other], [other, "valve.area=1mm^2"]):
        with pytest.raises(ParameterError, match="set the same value; remove one of them") as caught:
            apply_overrides(COMPLETED, words)
        assert all(f"'{word}'" in str(caught.value) for word in words)


def test_a_later_layer_replaces_values_and_forms_of_an_earlier_one() -> None:
    earlier = (
        "valve.area=1mm^2",
        "valve.discharge_coefficient=0.6",
        "supply.pressure=40 psi_g",
        "controller.rate=1 kHz",
    )
    later = ("valves.solenoid.critical_ratio=0.3", "valve.sonic_conductance=1 L/(s bar)", "controller.period=2 ms")
    assert over(earlier, later, valve="solenoid") == ("supply.pressure=40 psi_g", *later)


def test_a_value_that_the_set_lacks_can_be_given() -> None:
    printed = apply_overrides(load_parameter_set("ppafo2011-printed"), ["actuator.dead_volume_1=8cm^3"])
    assert number_in_si(printed, "actuator.dead_volume_1") == 8e-6


@pytest.mark.parametrize(
    ("override", "told"),
    [
        (
            "valve.aera=1mm^2",
            "override 'valve.aera=1mm^2': ppafo2011 has no value 'valve.aera', did you mean 'valve.area'",
        ),
        ("actuator.stroke=80mm", "has no value 'actuator.stroke'; 'actuator' has torque_constant, "),
        ("valve.area=3mm", "override 'valve.area=3mm': unit 'mm' does not fit"),
    ],
)
def test_a_message_names_the_path_that_was_typed_and_no_other(override: str, told: str) -> None:
    assert told in problem_of(override)
    assert "valves." not in problem_of(override)


def test_damping_may_leave_out_the_radian_as_the_paper_does() -> None:
    for text in ("32 g m^2/s", "0.032 N m s/rad", "0.032 N m s"):
        assert (
            number_in_si(apply_overrides(COMPLETED, [f"friction.viscous_damping={text}"]), "friction.viscous_damping")
            == 0.032
        )


def test_another_gas_brings_its_own_constants() -> None:
    gas = load_device("ppafo2011", overrides=("gas.species=N2",)).gas
    assert (gas.species, gas.molar_mass, gas.heat_capacity_ratio) == ("N2", 0.028013, 1.401)


@pytest.mark.parametrize("text", ["gas.molar_mass=28 g/mol", "gas.heat_capacity_ratio=1.39"])
def test_a_number_of_a_gas_that_is_given_counts_before_and_after_the_gas(text: str) -> None:
    before, after = (
        load_device("ppafo2011", overrides=words).gas for words in ((text, "gas.species=N2"), ("gas.species=N2", text))
    )
    assert before == after
    plain = load_device("ppafo2011", overrides=("gas.species=N2",)).gas
    assert after != plain
    assert (after.species, before.molar_mass) in (("N2", 0.028), ("N2", plain.molar_mass))


def test_one_form_of_an_orifice_replaces_the_other() -> None:
    iso = apply_overrides(COMPLETED, ["valve.sonic_conductance=1 L/(s bar)", "valve.critical_ratio=0.3"])
    assert "valves.proportional.area" not in iso.numbers
    assert "valves.solenoid.area" in iso.numbers
    back = apply_overrides(iso, ["valve.area=1mm^2", "valve.discharge_coefficient=0.6"])
    assert "valves.proportional.sonic_conductance" not in back.numbers


@given(path=st.sampled_from(PATHS), factor=st.floats(0.1, 10.0))
def test_an_override_reads_back_as_the_value_that_was_given(path: str, factor: float) -> None:
    entry = COMPLETED.numbers[path]
    value = entry.value * factor
    changed = apply_overrides(COMPLETED, [f"{path}={value!r} {entry.unit}"])
    assert (changed.numbers[path].value, changed.numbers[path].unit) == (value, entry.unit)
    both = {path, "supply.dorsiflexion_pressure"} if path == "supply.pressure" else {path}
    assert {key for key in PATHS if changed.numbers[key] != COMPLETED.numbers[key]} == both


@given(path=st.sampled_from(PATHS), text=st.text(max_size=30))
def test_any_override_text_is_taken_or_refused_cleanly(path: str, text: str) -> None:
    try:
        apply_overrides(COMPLETED, [f"{path}={text}"])
    except (ParameterError, ArgumentError) as error:
        assert "\n" not in str(error)
