"""Each check of the audit, on sets other than the paper's: it fires where it should and is silent where it should."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from ppafo.errors import ParameterError
from ppafo.parameters import apply_overrides, build_device, list_sets, load_parameter_set
from ppafo.parameters.audit import AuditFinding, findings_of
from ppafo.parameters.loading import parameter_set_toml, parse_parameter_set

BASE = load_parameter_set("ppafo2011")
BLADDER = Path(__file__).parents[3] / "actuators" / "measured-bladder.toml"


def findings(*overrides: str) -> dict[str, AuditFinding]:
    return {finding.id: finding for finding in findings_of(apply_overrides(BASE, overrides))}


def _of_set(name: str, *overrides: str) -> dict[str, AuditFinding]:
    return {finding.id: finding for finding in findings_of(apply_overrides(load_parameter_set(name), overrides))}


def side(finding: AuditFinding, label: str) -> float:
    return next(side.value for side in finding.sides if side.label == label)


def test_the_reconciling_cd_a_gives_the_printed_flow() -> None:
    needed = side(findings()["flow-of-proportional"], "Cd A that gives the reported flow")
    assert needed == pytest.approx(1.196e-6, rel=1e-3)
    assert "flow-of-proportional" not in findings(f"valve.discharge_coefficient={needed / 31.6e-6:.6f}")


def test_a_flow_below_the_critical_ratio_uses_the_subsonic_formula() -> None:
    flow = findings("reported.valves.proportional.flow_pressure=5 psi_g")["flow-of-proportional"]
    assert 0.0 < side(flow, "Cd A C1 P") < 4.479e-3 * (101325 + 5 * 6894.757) / 446063


def test_the_form_of_iso_6358_is_checked_too() -> None:
    iso = ("valve.sonic_conductance=1 L/(s bar)", "valve.critical_ratio=0.4")
    flow = findings(*iso)["flow-of-proportional"]
    needed = side(flow, "sonic conductance that gives the reported flow")
    matched = findings(f"valve.sonic_conductance={needed!r} m^3/(s Pa)", "valve.critical_ratio=0.4")
    assert "flow-of-proportional" not in matched


def test_constants_of_another_gas_are_an_error() -> None:
    found = findings("gas.molar_mass=28 g/mol")
    assert found["gas-molar-mass"].severity == "error"
    assert found["choked-flow-constant"].severity == "error"
    assert found["critical-pressure-ratio"].severity == "note"


def test_a_gas_named_by_override_contradicts_the_printed_constants_but_not_itself() -> None:
    found = findings("gas.species=N2")
    assert "gas-molar-mass" not in found
    assert found["choked-flow-constant"].severity == "error"


def test_damping_and_friction_that_follow_from_inertia_are_no_finding() -> None:
    found = findings("foot_plate.inertia=84 g m^2")
    assert not {"damping-against-inertia", "dynamic-friction-against-inertia", "one-inertia-for-both"} & set(found)


def test_the_common_inertia_is_computed_from_the_values() -> None:
    found = findings(
        "foot_plate.inertia=1 kg m^2",
        "friction.viscous_damping=2 N m s/rad",
        "friction.dynamic_torque=0.4 N m",
        "reported.acceleration_over_velocity=-8 1/s",
        "reported.stopping_deceleration=1.6 rad/s^2",
    )
    assert side(found["one-inertia-for-both"], "reconciling inertia") == pytest.approx(0.25, rel=0.1)


def test_torque_constant_and_volume_that_agree_are_no_finding() -> None:
    assert "virtual-work" not in _of_set("ppafo2011-printed", "actuator.torque_constant=50 cm^3")
    assert "virtual-work" not in findings()
    assert "virtual-work" not in findings("actuator.torque_constant=20 cm^3"), "the displacement follows"
    stated = findings("actuator.displacement_per_radian=23.5 cm^3/rad")["virtual-work"]
    assert stated.severity == "warning"
    assert "the shaft gets 61.7 % of the work p dV of the gas" in stated.paragraph


def test_dead_volume_makes_the_volumes_positive() -> None:
    short = "actuator.dead_volume_2=2 cm^3"
    assert findings("reported.largest_angle=150 deg", short)["volume-2"].severity == "error"
    assert "volume-2" not in findings("reported.largest_angle=150 deg")


def test_chamber_1_is_checked_at_the_lower_end() -> None:
    finding = findings("reported.smallest_angle=0 deg", "actuator.dead_volume_1=2 cm^3")["volume-1"]
    assert side(finding, "V1 at the end of the range") == pytest.approx(2e-6 - 14.51e-6 * 20 / 57.29578, rel=1e-6)


def test_a_demand_above_the_ceiling_is_a_warning_with_the_pressure_that_is_needed() -> None:
    finding = findings("reported.demanded_torque=6 N m")["torque-ceiling"]
    assert finding.severity == "warning"
    assert "59.97 psi_g" in finding.paragraph


def test_a_regulator_that_can_be_set_above_its_supply_says_from_which_command_on() -> None:
    path, name = "valves.pressure_regulator.highest_pressure", "set-pressure-of-pressure_regulator"
    finding = _of_set("cylinder-lever", f"{path}=9 bar_g")[name]
    assert side(finding, "command that sets the supply pressure") == pytest.approx((5.0 - 0.05) / (9.0 - 0.05))
    assert name not in _of_set("cylinder-lever")


def test_static_friction_above_the_ceiling_is_an_error() -> None:
    assert findings("friction.static_torque=9 N m")["torque-ceiling"].severity == "error"


def test_the_ideal_gas_law_is_better_for_nitrogen_and_worse_at_high_pressure() -> None:
    assert "0.08" in findings("gas.species=N2")["ideal-gas"].title
    assert findings("supply.pressure=200 psi_g")["ideal-gas"].severity == "warning"


def test_an_accepted_error_is_a_warning_with_its_reason() -> None:
    finding = findings()["damping-against-inertia"]
    assert finding.severity == "warning"
    assert finding.accepted == BASE.accepted["damping-against-inertia"]


def test_the_reason_does_not_cover_a_value_that_was_overridden() -> None:
    finding = findings("foot_plate.inertia=9 g m^2")["damping-against-inertia"]
    assert (finding.severity, finding.accepted) == ("error", "")


def test_a_reason_for_nothing_is_a_warning() -> None:
    idle = findings_of(replace(BASE, accepted={**BASE.accepted, "volume-7": "because"}))
    assert [finding.severity for finding in idle if finding.id == "idle-acceptance"] == ["warning"]


def test_a_value_that_no_device_can_have_is_an_error() -> None:
    finding = findings("actuator.restitution=1.5")["range-of-actuator-restitution"]
    assert finding.severity == "error"
    assert "lower limit: 0; upper limit: 1" in finding.paragraph


def test_a_solenoid_without_an_opening_delay_is_named_and_one_with_it_is_not() -> None:
    finding = findings()["ideal-opening"]
    assert finding.severity == "warning"
    assert finding.title == "solenoid: no opening_delay, so that a coil opens its valve at once"
    assert "ideal-opening" not in findings("valves.solenoid.opening_delay=9 ms")


def test_a_set_with_almost_nothing_in_it_has_nothing_to_say_but_what_is_missing() -> None:
    [finding] = findings_of(replace(BASE, numbers={}, texts={}, accepted={}))
    assert (finding.id, finding.severity) == ("missing-values", "warning")
    with pytest.raises(ParameterError) as caught:
        build_device(replace(BASE, numbers={}, texts={}))
    refused = str(caught.value).partition("the device lacks ")[2].partition("; ")[0].split(", ")
    assert all(path in finding.paragraph for path in refused)
    assert "valves.solenoid.area" in finding.paragraph


def test_a_stated_efficiency_that_explains_the_volume_is_a_note_and_another_is_a_warning() -> None:
    closed = findings("actuator.displacement_per_radian=18.1 cm^3/rad", "reported.torque_efficiency=0.8")[
        "virtual-work"
    ]
    assert closed.severity == "note"
    assert side(closed, "torque constant over displacement per radian") == pytest.approx(0.8, rel=0.01)
    other = findings("actuator.displacement_per_radian=23.5 cm^3/rad", "reported.torque_efficiency=0.8")
    assert other["virtual-work"].severity == "warning"
    assert findings("actuator.displacement_per_radian=18.1 cm^3/rad")["virtual-work"].severity == "warning"
    assert "virtual-work" not in findings("actuator.displacement_per_radian=14.5 cm^3/rad")


def test_the_gas_of_one_filling_is_asked_of_the_whole_chamber() -> None:
    found = findings()["gas-of-one-filling"]
    assert found.severity == "note"
    assert side(found, "gas that fills chamber 1") == pytest.approx((36e-6 + 14.51e-6 * 0.9599) * 6.123, rel=0.01)
    short = "actuator.dead_volume_1=2 cm^3"
    assert findings(short)["gas-of-one-filling"].severity == "warning"
    assert findings(short, "actuator.displacement_per_radian=51 cm^3/rad")["gas-of-one-filling"].severity == "note"
    assert findings("actuator.dead_volume_1=60 cm^3")["gas-of-one-filling"].severity == "warning"


def test_published_torques_at_rest_speak_of_the_torque_constant() -> None:
    assert side(findings()["walking-torque"], "torque constant times pressure") == pytest.approx(9.0, rel=0.01)
    assert side(findings()["rated-torque"], "torque constant times pressure") == pytest.approx(12.0, rel=0.01)
    weak = findings("actuator.torque_constant=10 cm^3")
    assert {weak[name].severity for name in ("walking-torque", "rated-torque")} == {"warning"}
    small = findings("actuator.displacement_per_radian=14.5 cm^3/rad")
    assert {small[name].severity for name in ("walking-torque", "rated-torque")} == {"note"}


def test_a_torque_of_walking_has_to_come_within_a_push_off() -> None:
    name = "walking-torque-in-time-solenoid"
    assert findings()[name].severity == "warning"
    assert findings()["walking-torque-in-time-proportional"].severity == "note"
    small = findings("actuator.dead_volume_1=2 cm^3")[name]
    assert small.severity == "note"
    share = (2.0 + 14.51 * 1.5708) / (36.0 + 14.51 * 1.5708)
    assert side(small, "time to fill") == pytest.approx(side(findings()[name], "time to fill") * share, rel=0.01)


def test_choked_filling_takes_the_time_of_the_closed_formula() -> None:
    low = ("reported.walking_torque=3 N m", "actuator.dead_volume_1=2 cm^3")
    mass = 0.9 * 3.0 / 1.451e-5 * (2e-6 + 14.51e-6 * 1.5708) / (8.314 / 0.044 * 298.0)
    flow = 0.113 * 12.6e-6 * 0.002812 * (101325.0 + 90 * 6894.757)
    found = findings(*low)["walking-torque-in-time-solenoid"]
    assert side(found, "time to fill") == pytest.approx(mass / flow, rel=2e-3)


def test_a_vane_that_turns_further_than_its_actuator_is_a_warning() -> None:
    found = findings()["rotation"]
    assert [side.value for side in found.sides] == pytest.approx([math.radians(110.0), math.radians(90.0)])
    assert "rotation" not in findings("reported.largest_angle=110 deg")


def test_an_area_that_is_the_bore_of_a_tube_is_noted() -> None:
    found = findings()
    assert side(found["bore-of-solenoid"], "bore of 4 mm") == pytest.approx(12.566e-6, rel=1e-4)
    assert side(found["bore-of-proportional"], "bore of 1/4 inch") == pytest.approx(31.669e-6, rel=1e-4)
    assert "bore-of-proportional" not in findings("valve.area=30 mm^2")


def with_key(path: str, key: str) -> list[AuditFinding]:
    numbers = {**BASE.numbers, path: replace(BASE.numbers[path], key=key)}
    return [item for item in findings_of(replace(BASE, numbers=numbers)) if item.id.endswith("-against-statement")]


def test_a_value_with_the_key_of_a_statement_is_the_number_that_this_states() -> None:
    assert BASE.numbers["reported.walking_torque"].key == "jrrd-2011/peak_torque"
    assert with_key("reported.walking_torque", "jrrd-2011/torque_at_rest") == []
    assert with_key("reported.walking_torque_pressure", "jrrd-2011/torque_at_rest.pressure") == []
    (found,) = with_key("reported.walking_torque_pressure", "jmd-2016/rated_torque.pressure")
    assert "which has 120 psi_g" in found.paragraph


WITHOUT_A_FILE = ("Zillen 2021", "Nesler, Swift and Rouse")
"""Publications of which no statement is tested."""


@pytest.mark.parametrize("name", list_sets())
def test_every_published_number_of_a_shipped_set_names_its_statement(name: str) -> None:
    numbers = load_parameter_set(name).numbers
    unnamed = [
        path
        for path, entry in numbers.items()
        if entry.origin == "published" and not entry.key and not entry.source.startswith(WITHOUT_A_FILE)
    ]
    assert unnamed == []
    assert not [found for found in findings_of(load_parameter_set(name)) if found.id.endswith("-against-statement")]


@pytest.mark.parametrize(
    "key", ["jmd-2016/rated_torque", "jrrd-2011/torque_at_reste", "jrrd-2012/torque_at_rest", "jrrd"]
)
def test_a_key_of_another_number_or_of_none_is_an_error(key: str) -> None:
    (found,) = with_key("reported.walking_torque", key)
    assert (found.severity, found.id) == ("error", "reported-walking-torque-against-statement")
    assert f"'{key}'" in found.title


def test_a_copied_value_that_is_changed_is_cured_by_the_removal_of_the_key_line_that_the_audit_offers() -> None:
    copied = parameter_set_toml(BASE).replace("value = 50.0\n", "value = 60.0\n", 1)
    head, key, rest = copied.partition('key = "ppafo-2011/source_pressure"\n')
    errors = [
        [found for found in findings_of(parse_parameter_set(text.encode(), "own.toml")) if found.severity == "error"]
        for text in (copied, head + rest)
    ]
    assert key
    assert "delete the line 'key' of [supply.pressure]" in errors[0][0].paragraph
    assert (len(errors[0]), errors[1]) == (1, [])


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("ppafo2011", ("actuator.angle_min=140 deg",)),
        ("ppafo2011", ("friction.static_torque=0.001 N m",)),
        ("ppafo2011", ("supply.dorsiflexion_pressure=-0.5 bar_g", "supply.pressure=3 bar_g")),
        ("ppafo2011", ("supply.pressure=-0.5 bar_g", "supply.relieving=false")),
        ("cylinder-lever", ("actuator.rod_diameter=26 mm",)),
        ("cylinder-lever", ("actuator.lever_offset=60 deg",)),
        (str(BLADDER), ("actuator.angle_max=150 deg",)),
        (str(BLADDER), ("supply.pressure=9 bar_g",)),
        (str(BLADDER), ("supply.pressure=9 bar_g", "actuator.angle_max=150 deg")),
    ],
)
def test_the_audit_says_as_an_error_what_a_run_refuses(name: str, overrides: tuple[str, ...]) -> None:
    changed = apply_overrides(load_parameter_set(name), overrides)
    with pytest.raises(ParameterError) as refused:
        build_device(changed)
    said = [finding.paragraph for finding in findings_of(changed) if finding.severity == "error"]
    assert len(said) == len(overrides) - any("=-0.5" in override for override in overrides)
    assert str(refused.value).removeprefix(f"{changed.file}: ") in said[0]


def test_the_stroke_of_a_cylinder_between_its_stops_is_compared_with_a_data_sheet() -> None:
    found = _of_set("cylinder-lever")["stroke"]
    ends = [side(found, f"distance of the pins at the {stop} stop") for stop in ("lower", "upper")]
    # What is measured between the pins gives the offset, as the page on sets says: 25 and 200 mm from the joint.
    for apart, degrees in zip(ends, (20.0, 130.0), strict=True):
        between = math.acos((0.025**2 + 0.2**2 - apart**2) / (2.0 * 0.025 * 0.2))
        assert math.degrees(between) - degrees == pytest.approx(15.0)
    assert f"between the stops is {1e3 * (ends[1] - ends[0]):.4g} mm" in found.title
    assert "stroke" not in findings()
