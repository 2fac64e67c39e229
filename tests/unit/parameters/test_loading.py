"""Parameter sets from names and files, and every mistake that a file can have."""

import re
from importlib import resources
from pathlib import Path

import pytest

from ppafo.errors import ParameterError
from ppafo.parameters import list_sets, load_device, load_parameter_set
from ppafo.parameters.loading import parameter_set_toml, parse_parameter_set

SMALL = """
schema_version = 1
name = "bench"
title = "A bench"
default_valve = "main"

[actuator.torque_constant]
value = 14
unit = "cm^3"
origin = "identified"
source = "recording 7"
uncertainty = 0.5

[valves.main]
kind = "proportional"
area = { value = 12.6, unit = "mm^2", origin = "datasheet", source = "page 2" }
"""


def problem_of(text: str) -> str:
    with pytest.raises(ParameterError) as caught:
        parse_parameter_set(text.encode(), "bench.toml")
    message = str(caught.value)
    assert re.match(r"(\d things are wrong: \(1\) )?bench\.toml: ", message)
    assert "\n" not in message
    return message


def changed(old: str, new: str) -> str:
    assert old in SMALL
    return SMALL.replace(old, new)


@pytest.mark.parametrize("name", list_sets())
def test_every_set_of_the_package_loads_under_its_own_name(name: str) -> None:
    assert load_parameter_set(name).name == name


def test_values_keep_their_provenance() -> None:
    entry = parse_parameter_set(SMALL.encode(), "bench.toml").numbers["actuator.torque_constant"]
    assert (entry.value, entry.unit, entry.origin, entry.source) == (14.0, "cm^3", "identified", "recording 7")
    assert entry.uncertainty == 0.5


@pytest.mark.parametrize("name", ["mhj.10", "MHJ 10", "", "Ventil-größer"])
def test_a_name_of_a_valve_that_no_path_can_hold_is_refused(name: str) -> None:
    said = f"the name {name!r} must consist of letters, digits, '-' and '_'"
    assert f"valves: {said}" in problem_of(changed("[valves.main]", f'[valves."{name}"]'))
    reported = '{ value = 1, unit = "g", origin = "publication", source = "page 2" }'
    report = f'\n[reported.valves."{name}"]\nsingle_fill_gas = {reported}\n'
    assert f"reported.valves: {said}" in problem_of(SMALL + report)


def test_a_name_of_a_valve_may_have_capitals() -> None:
    text = changed('"main"', '"MHJ_10-b"').replace("[valves.main]", "[valves.MHJ_10-b]")
    before = parse_parameter_set(text.encode(), "bench.toml")
    assert parse_parameter_set(parameter_set_toml(before).encode(), before.file) == before


AREA = 'area = { value = 12.6, unit = "mm^2", origin = "datasheet", source = "page 2" }'
NUMBER = '{ value = 1, unit = "g/s", origin = "assumed", source = "x" }'


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "bench"', 'name = "bench"\nname = "bench"', "line 4"),
        ('"bench"', '"My Bench"', "name = 'My Bench' must consist of lower-case letters"),
        ("schema_version = 1", "schema_version = 2", "schema_version"),
        ("schema_version = 1", f"a = {'[' * 20000}", "nested too deeply"),
        ("schema_version = 1", "friction = 3\nschema_version = 1", "friction = 3 must be a table, [friction]"),
        (
            "schema_version = 1",
            "schema_version = 1\nstatic_torque = 1",
            "unknown key 'static_torque', which is a key of [friction]; allowed here: ",
        ),
        ("[actuator.", "[actuatr.", "'actuatr', did you mean 'actuator'"),
        (
            "torque_constant]",
            "torque_constnt]",
            "unknown key 'actuator.torque_constnt', did you mean 'torque_constant'?",
        ),
        ("torque_constant]", "torque_constnt]", "displacement_per_radian"),
        (
            '"identified"',
            '"identifed"',
            "torque_constant.origin = 'identifed' is not allowed, did you mean 'identified'?",
        ),
        ('source = "recording 7"', "", "'actuator.torque_constant.source' is missing"),
        ("uncertainty = 0.5", "uncertainty = -0.5", "uncertainty = -0.5"),
        ('"cm^3"', '"cmm^3"', "actuator.torque_constant.unit: 'cmm' is not a known unit, did you mean"),
        ('unit = "mm^2"', 'unti = "mm^2"', "'valves.main.area.unti', did you mean 'unit'"),
        (AREA, "area = 12.6", "valves.main.area = 12.6 must be a table"),
        (AREA, f"{AREA}\nswitching_interval = {NUMBER}", "unknown key 'valves.main.switching_interval'"),
        (AREA, f"{AREA}\nswitching_interval = {NUMBER}", "spool_frequency"),
        (AREA, f"{AREA}\n[friction]\nstatic_torque = 3", "must be a table with the keys value, unit, origin, source"),
        (AREA, f"{AREA}\n[reported.valves.mian]\nmass_flow = {NUMBER}", "no valve 'mian', did you mean 'main'"),
        ('kind = "proportional"', "", "'valves.main.kind' is missing"),
        (
            'kind = "proportional"',
            'kind = "proportionl"',
            "valves.main.kind = 'proportionl' is not known, did you mean 'proportional'?",
        ),
        ('"main"', '"mian"', "there is no valve 'mian', did you mean 'main'?"),
    ],
)
def test_a_mistake_in_a_file_names_its_key_what_is_allowed_and_the_nearest(old: str, new: str, said: str) -> None:
    assert said in problem_of(changed(old, new))


@pytest.mark.parametrize("value", ["true", '"14"', "[14]", "nan", "inf", "1979-05-27"])
def test_a_value_that_is_no_finite_number_is_refused(value: str) -> None:
    assert "actuator.torque_constant.value = " in problem_of(changed("value = 14", f"value = {value}"))


def test_a_wrong_dimension_is_kept_for_the_audit_and_refused_for_a_device(tmp_path: Path) -> None:
    text = (resources.files("ppafo.parameters") / "sets" / "ppafo2011.toml").read_text(encoding="utf-8")
    file = tmp_path / "wrong.toml"
    file.write_text(text.replace('value = 31.6\nunit = "mm^2"', 'value = 31.6\nunit = "mm"'))
    load_parameter_set(file)
    with pytest.raises(ParameterError, match=r"wrong.toml: valves.proportional.area = 31.6 mm: unit 'mm' does not fit"):
        load_device(file)
