"""How the claims of the paper are judged, and how overrides reach the experiments."""

import dataclasses
from dataclasses import replace

import pytest

from ppafo.analyses.reproduce import paper as study
from ppafo.analyses.reproduce.claims import Claim, count_sentence, verdict_counts
from ppafo.analyses.reproduce.paper import (
    REPORTED_SET,
    Reproduction,
    SyntheticEvidence,
    arithmetic_claims,
    phased_runs,
    readings_of_u,
    reproduce_paper,
)
from ppafo.analyses.reproduce.question import reproduce
from ppafo.errors import SimulationError
from ppafo.parameters import ParameterSet, load_parameter_set
from ppafo.parameters.publications.publication import paper_entries
from ppafo.simulation.simulate import Result, Status


def printed_with(**values: float) -> ParameterSet:
    """The printed set with some numbers exchanged, each in its printed unit; ``__`` stands for a dot."""
    printed = load_parameter_set(REPORTED_SET)
    numbers = dict(printed.numbers)
    for name, value in values.items():
        path = name.replace("__", ".")
        numbers[path] = replace(numbers[path], value=value)
    return dataclasses.replace(printed, numbers=numbers)


def arithmetic(**values: float) -> dict[str, Claim]:
    return {claim.entry.id: claim for claim in arithmetic_claims(printed_with(**values))}


def test_sixteen_rows_have_five_verdicts(reproduction: Reproduction) -> None:
    counts = verdict_counts(reproduction.claims)
    assert tuple(counts.values()) == (2, 3, 6, 0, 4, 1)
    assert reproduction.json_document()["counts"] == counts
    assert count_sentence(reproduction.claims).startswith("16 claims: 2 consistent, 3 inconsistent as reported, 6 met")


def test_every_statement_that_needs_a_measurement_is_in_the_one_row_that_is_not_testable(
    reproduction: Reproduction,
) -> None:
    (row,) = (claim for claim in reproduction.claims if claim.verdict == "not_testable")
    untold = [entry for entry in paper_entries().values() if entry.not_testable]
    # But for this row, and the one of a claim that no control is searched for.
    assert row.entry.words == f"{len(untold) - 2} statements"
    assert (row.value, row.found) == (None, "")


def test_no_claim_rests_on_a_synthetic_measurement(reproduction: Reproduction) -> None:
    assert not any("synthetic" in text for claim in reproduction.claims for text in claim.assumptions)


@pytest.fixture(scope="module")
def changed() -> Reproduction:
    """The experiments with other values of task, device, valve, controller and gas than the paper's."""
    task, room = "reference.level=4 N m", "supply.atmospheric_pressure=100 kPa_a"
    own = ("valves.solenoid.area=31.6 mm^2", "controller.proportional_gain=0.2 1/(N m)", "gas.species=air")
    return reproduce_paper([task, room, *own])


def test_overrides_reach_the_rig_s_torque_task_but_not_the_identification(
    reproduction: Reproduction, changed: Reproduction
) -> None:
    assert isinstance(changed.synthetic, SyntheticEvidence)
    assert isinstance(reproduction.synthetic, SyntheticEvidence)
    assert changed.synthetic.proportional["reference"].max() == pytest.approx(4.0)
    before, after = (run.decay["friction.viscous_damping"].value for run in (reproduction.synthetic, changed.synthetic))
    assert after == before


def test_a_constant_that_does_not_follow_from_the_gas_is_inconsistent() -> None:
    assert arithmetic()["orifice_constants"].verdict == "consistent"
    for changed in ({"reported__choked_flow_constant": 0.00283}, {"gas__heat_capacity_ratio": 1.4}):
        assert arithmetic(**changed)["orifice_constants"].verdict == "inconsistent_as_reported"


def test_damping_and_friction_hold_with_ten_times_the_inertia_and_not_with_one_of_them_mended() -> None:
    assert arithmetic()["damping_and_friction"].verdict == "inconsistent_as_reported"
    assert arithmetic(friction__viscous_damping=3.4)["damping_and_friction"].verdict == "inconsistent_as_reported"
    assert arithmetic(foot_plate__inertia=84.0)["damping_and_friction"].verdict == "consistent"


def test_one_discharge_coefficient_is_consistent_where_both_valves_have_one_area() -> None:
    assert arithmetic(valves__solenoid__discharge_coefficient=0.095)["discharge_coefficient"].verdict != "consistent"
    same = {"valves__proportional__area": 12.6}
    both = {f"valves__{valve}__discharge_coefficient": 0.095 for valve in ("solenoid", "proportional")}
    claim = arithmetic(**same, **both)["discharge_coefficient"]
    assert claim.verdict == "consistent"
    assert any("atmospheric_pressure" in assumption for assumption in claim.assumptions)


def test_the_last_phase_with_valve_a_first_is_the_run_as_its_scenario_has_it(reproduction: Reproduction) -> None:
    errors, gas = phased_runs(reproduction.solenoid)
    assert errors.size == 40
    assert errors[19] == pytest.approx(reproduction.solenoid.metrics["rms_error"].value, rel=1e-5)
    assert gas[19] == pytest.approx(1e3 * reproduction.solenoid.metrics["gas_supplied"].value, rel=1e-5)
    assert errors[39] > 1.05 * errors[19], "valve B first costs one switching more"


def test_what_u_is_decides_about_the_error_and_not_about_the_saving(reproduction: Reproduction) -> None:
    opening, five, ten = readings_of_u(reproduction.solenoid, reproduction.proportional)
    assert (round(opening.error), round(five.error), round(ten.error)) == (15, -27, -73)
    assert [round(row.error_within_reach) for row in (opening, five, ten)] == [84, 37, 7]
    assert all(64.0 < row.gas < 66.5 for row in (opening, five, ten))
    assert readings_of_u(reproduction.step, reproduction.proportional) == ()


def test_a_claim_is_missed_only_outside_its_window(reproduction: Reproduction) -> None:
    claim = next(claim for claim in reproduction.claims if claim.entry.id == "co2_solenoid")
    assert claim.limits == (1.0, 1.2)
    values = {1.0: False, 1.2: False, 0.99: True, 1.21: True, None: True}
    for value, is_missed in values.items():
        assert dataclasses.replace(claim, value=value).is_missed is is_missed
    half = replace(claim.entry, at_most=None)
    assert dataclasses.replace(claim, value=2.0, entry=half).is_missed is False


def test_simulated_claims_name_every_assumption_of_scenario_and_set(reproduction: Reproduction) -> None:
    claim = next(claim for claim in reproduction.claims if claim.entry.id == "co2_saving")
    named = {text.partition(" = ")[0] for text in claim.assumptions}
    for run in (reproduction.solenoid, reproduction.proportional):
        assert {item.path for item in run.scenario.assumptions} <= named
    assert {"actuator.dead_volume_1", "valves.solenoid.discharge_coefficient"} <= named
    assert all(": " in text for text in claim.assumptions)


def test_an_override_of_the_device_reaches_all_experiments_and_is_listed(changed: Reproduction) -> None:
    for run in (changed.step, changed.solenoid, changed.proportional):
        assert run.scenario.device.supply.atmospheric_pressure == pytest.approx(1.0e5)
    listed = next(value for value in changed.assumed if value.path == "supply.atmospheric_pressure")
    assert listed.value == "100 kPa_a"
    assert listed.reason.startswith("set for this run")


def test_an_override_of_a_scenario_reaches_those_that_have_the_value(changed: Reproduction) -> None:
    assert changed.proportional.scenario.controller.proportional_gain == pytest.approx(0.2)
    given = [text for run in (changed.step, changed.solenoid) for text in run.scenario.origin.overrides]
    assert not any("proportional_gain" in text for text in given)


def test_overrides_leave_the_paper_s_own_arithmetic_alone(reproduction: Reproduction, changed: Reproduction) -> None:
    before, after = ({claim.entry.id: claim.found for claim in run.claims} for run in (reproduction, changed))
    assert after["swept_volume"] == before["swept_volume"]
    assert after["co2_solenoid"] != before["co2_solenoid"]


def test_a_window_that_is_missed_leaves_the_claim_undetermined(changed: Reproduction) -> None:
    assert "co2_solenoid" in {claim.entry.id for claim in changed.missed}
    assert {claim.verdict for claim in changed.missed} == {"undetermined"}


def test_a_run_that_diverges_stops_the_reproduction_with_its_name(
    reproduction: Reproduction, monkeypatch: pytest.MonkeyPatch
) -> None:
    def diverged(scenario: object) -> Result:
        return dataclasses.replace(reproduction.step, status=Status("diverged", 0.1, "diverged at t = 0.1 s"))

    monkeypatch.setattr(study, "simulate", diverged)
    with pytest.raises(SimulationError, match="step-response' failed: diverged at t"):
        reproduce()
