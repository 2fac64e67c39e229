"""What the paper's own numbers do: each contradiction is found by the audit from the reported values alone."""

import pytest

from ppafo.parameters import load_parameter_set
from ppafo.parameters.audit import AuditFinding, findings_of

FOUND = {finding.id: finding for finding in findings_of(load_parameter_set("ppafo2011-printed"))}


def side(finding: AuditFinding, label: str) -> float:
    return next(side.value for side in finding.sides if side.label == label)


@pytest.mark.parametrize(
    ("identifier", "expected", "tolerance"),
    [
        ("choked-flow-constant", 0.002812, 1e-6),
        ("subsonic-flow-constant", 0.012406, 1e-6),
        ("critical-pressure-ratio", 1.8324, 5e-5),
    ],
)
def test_the_constants_of_orifice_flow_reproduce(identifier: str, expected: float, tolerance: float) -> None:
    assert FOUND[identifier].severity == "note"
    assert side(FOUND[identifier], "from the gas data") == pytest.approx(expected, abs=tolerance)


def test_the_discharge_coefficient_is_printed_with_a_unit_that_it_cannot_have() -> None:
    finding = FOUND["dimensions"]
    assert finding.severity == "error"
    assert {value.path for value in finding.values} == {
        "valves.proportional.discharge_coefficient",
        "valves.solenoid.discharge_coefficient",
    }
    assert {value.unit for value in finding.values} == {"s/m"}


@pytest.mark.parametrize(("valve", "flow"), [("solenoid", 1.79e-3), ("proportional", 4.48e-3)])
def test_the_printed_flow_does_not_follow_from_either_valve(valve: str, flow: float) -> None:
    finding = FOUND[f"flow-of-{valve}"]
    assert finding.severity == "error"
    assert side(finding, "reported flow") == pytest.approx(1.5e-3)
    assert side(finding, "Cd A C1 P") == pytest.approx(flow, rel=3e-3)
    assert side(finding, "Cd A that gives the reported flow") == pytest.approx(1.196e-6, rel=1e-3)


def test_one_coefficient_cannot_give_one_flow_through_both_areas() -> None:
    finding = FOUND["one-coefficient-proportional-solenoid"]
    assert finding.severity == "error"
    assert side(finding, "ratio of the areas") == pytest.approx(31.6 / 12.6)
    assert side(finding, "ratio of the reported flows") == pytest.approx(1.0)


def test_damping_is_ten_times_inertia_times_the_decay() -> None:
    finding = FOUND["damping-against-inertia"]
    assert finding.severity == "error"
    assert side(finding, "inertia times ratio") == pytest.approx(3.36e-3)
    assert side(finding, "reported damping") == pytest.approx(32e-3)


def test_dynamic_friction_is_ten_times_inertia_times_the_deceleration() -> None:
    finding = FOUND["dynamic-friction-against-inertia"]
    assert finding.severity == "error"
    assert side(finding, "inertia times ratio") == pytest.approx(0.0011, rel=0.01)
    assert side(finding, "reported dynamic friction") == pytest.approx(0.011)


def test_both_agree_with_an_inertia_of_84() -> None:
    assert side(FOUND["one-inertia-for-both"], "reconciling inertia") == pytest.approx(84e-3)


def test_the_printed_ratio_of_the_free_decay_is_upside_down() -> None:
    finding = FOUND["velocity-over-acceleration-upside-down"]
    assert finding.severity == "error"
    assert [(value.value, value.unit) for value in finding.values] == [(-0.4, "1/s")]


def test_the_torque_ceiling_is_5_newton_metres_at_50_psig_and_5_5_at_55() -> None:
    finding = FOUND["torque-ceiling"]
    assert side(finding, "ceiling at supply.pressure") == pytest.approx(5.0, abs=0.01)
    assert side(finding, "ceiling at reported.other_supply_pressure") == pytest.approx(5.5, abs=0.01)
    assert "0.100 N m/psi" in finding.paragraph


def test_virtual_work_demands_a_torque_constant_equal_to_the_displacement_per_radian() -> None:
    finding = FOUND["virtual-work"]
    assert finding.severity == "warning"
    assert side(finding, "displacement per radian") / side(finding, "torque constant") == pytest.approx(3.5, abs=0.02)


def test_the_gas_use_needs_more_than_the_torque_constant_sweeps_and_lines_have_a_part_of_it() -> None:
    finding = FOUND["virtual-work"]
    assert side(finding, "volume that the gas use needs") == pytest.approx(65e-6, abs=0.5e-6)
    assert side(finding, "gas that fills a volume from atmosphere to supply") == pytest.approx(6.12, abs=0.005)
    assert "Lines and clearance contain a part" in finding.paragraph


def test_the_volume_of_chamber_2_is_negative_within_figure_7() -> None:
    finding = FOUND["volume-2"]
    assert finding.severity == "error"
    assert side(finding, "V2 at the end of the range") == pytest.approx(-35.6e-6, abs=0.05e-6)
    assert side(finding, "part of the range with no volume") == pytest.approx(40.0 / 110.0)


def test_the_ideal_gas_law_under_counts_by_2_3_percent() -> None:
    finding = FOUND["ideal-gas"]
    assert finding.severity == "note"
    assert 1.0 / side(finding, "real-gas factor, real") - 1.0 == pytest.approx(0.023, abs=0.0005)


def test_the_printed_exponent_of_c1_does_not_give_the_printed_c1() -> None:
    finding = FOUND["choked-flow-exponent"]
    assert finding.severity == "error"
    assert side(finding, "C1 with the reported exponent") == pytest.approx(0.003182, rel=1e-3)
    assert side(finding, "C1 with (k+1)/(k-1)") == pytest.approx(0.002812, rel=1e-3)


def test_nothing_else_is_called_an_error() -> None:
    errors = {name for name, finding in FOUND.items() if finding.severity == "error"}
    assert errors == {
        "dimensions",
        "velocity-over-acceleration-upside-down",
        "choked-flow-exponent",
        "flow-of-proportional",
        "flow-of-solenoid",
        "one-coefficient-proportional-solenoid",
        "damping-against-inertia",
        "dynamic-friction-against-inertia",
        "volume-2",
    }


def test_the_completed_set_has_no_error_and_gives_a_reason_for_each_that_it_keeps() -> None:
    completed = load_parameter_set("ppafo2011")
    found = findings_of(completed)
    assert [finding.id for finding in found if finding.severity == "error"] == []
    assert {finding.id for finding in found if finding.accepted} == set(completed.accepted)
