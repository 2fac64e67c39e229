"""How the claims of the paper are judged, and how overrides reach the experiments."""

import dataclasses
import json
import math

import pytest

from ppafo.errors import PpafoError, SimulationError
from ppafo.parameters.audit.evidence import Evidence
from ppafo.questions.reproduce import solve as study
from ppafo.questions.reproduce.answer import PROPORTIONAL, SOLENOID, STEP, Reproduction
from ppafo.questions.reproduce.bench import SyntheticEvidence, bench_study, measured_claims
from ppafo.questions.reproduce.claim import (
    VERDICTS,
    Claim,
    Printed,
    arithmetic_claims,
    count_sentence,
    load_printed,
    verdict_counts,
)
from ppafo.questions.reproduce.solve import EXPERIMENTS, ORDER, reproduce
from ppafo.questions.reproduce.torque_task import torque_task_observations
from ppafo.simulation.simulate import Result, Status

SYNTHETIC = {
    "k_actuator",
    "static_friction",
    "leak_area",
    "step_rms_position",
    "step_rms_pressure_1",
    "step_rms_pressure_2",
    "step_rms_pressure_difference",
    "step_error_correlation",
}


def printed_with(**values: float) -> Printed:
    """The printed set with some numbers exchanged, each in its printed unit; ``__`` stands for a dot."""
    printed = load_printed()
    numbers = dict(printed.parameter_set.numbers)
    for name, value in values.items():
        path = name.replace("__", ".")
        numbers[path] = numbers[path].model_copy(update={"value": value})
    changed = dataclasses.replace(printed.parameter_set, numbers=numbers)
    return Printed(changed, Evidence(changed, changed.declarations()))


def arithmetic(**values: float) -> dict[str, Claim]:
    return {claim.id: claim for claim in arithmetic_claims(printed_with(**values))}


def test_every_claim_is_there_once_in_the_order_of_the_paper(reproduction: Reproduction) -> None:
    assert tuple(claim.id for claim in reproduction.claims) == ORDER


def test_a_claim_as_a_document_is_plain_data_with_all_that_a_reader_needs(reproduction: Reproduction) -> None:
    document = json.loads(json.dumps([claim.document() for claim in reproduction.claims], allow_nan=False))
    needed = {"id", "statement", "paper", "value", "unit", "verdict", "assumptions", "source"}
    assert all(needed <= set(claim) for claim in document)
    assert all(claim["verdict"] in VERDICTS and claim["source"] and claim["statement"] for claim in document)


def test_what_a_synthetic_measurement_tests_says_so_and_is_never_plainly_reproduced(reproduction: Reproduction) -> None:
    tested = [claim for claim in reproduction.claims if claim.is_synthetic]
    assert {claim.id for claim in tested} == SYNTHETIC
    for claim in tested:
        assert claim.verdict in ("shown_on_synthetic", "contradicted")
        assert "synthetic" in claim.verdict_words
        assert "synthetic: it shows that the procedure works, not that the paper's device" in claim.note
        assert any("virtual rig" in assumption for assumption in claim.assumptions)
        assert claim.document()["synthetic"] is True


def test_claims_shown_on_synthetic_data_are_counted_apart_from_those_that_are_reproduced(
    reproduction: Reproduction,
) -> None:
    counts = verdict_counts(reproduction.claims)
    assert (counts["shown_on_synthetic"], counts["reproduced_with_assumptions"]) == (7, 5)
    assert reproduction.to_dict()["counts"] == counts
    assert "5 reproduced with assumptions, 7 shown on synthetic data" in count_sentence(reproduction.claims)
    claim = next(claim for claim in reproduction.claims if claim.is_synthetic)
    with pytest.raises(ValueError, match="does not match synthetic"):
        dataclasses.replace(claim, verdict="reproduced_with_assumptions")


def test_every_planted_value_comes_back_from_the_rig_with_the_paper_s_physics() -> None:
    values = bench_study().values
    assert len(values) == 7
    for value in values:
        assert value.ideal.low <= value.planted <= value.ideal.high, value.path
        assert value.ideal.value == pytest.approx(value.planted, rel=2e-3)


def test_the_realistic_bench_misleads_the_static_friction_as_it_grows_with_pressure() -> None:
    value = bench_study()["friction.static_torque"]
    assert value.realistic.low > value.planted
    with pytest.raises(KeyError):
        bench_study()["supply.pressure"]


def test_an_interval_beside_the_planted_value_contradicts_the_claim(reproduction: Reproduction) -> None:
    evidence = reproduction.synthetic
    assert isinstance(evidence, SyntheticEvidence)
    values = tuple(
        dataclasses.replace(value, ideal=dataclasses.replace(value.ideal, value=0.5, low=0.49, high=0.51))
        if value.path == "friction.static_torque"
        else value
        for value in evidence.bench.values
    )
    wrong = dataclasses.replace(evidence, bench=dataclasses.replace(evidence.bench, values=values))
    judged = {claim.id: claim for claim in measured_claims(load_printed(), wrong, ())}
    assert judged["static_friction"].verdict == "contradicted"
    assert "does not hold it" in judged["static_friction"].note
    assert judged["k_actuator"].verdict == "shown_on_synthetic"
    assert judged["static_friction"].verdict_words == "contradicted, synthetic"


def test_an_error_beyond_a_tenth_of_the_full_range_contradicts_the_claim(reproduction: Reproduction) -> None:
    evidence = reproduction.synthetic
    assert isinstance(evidence, SyntheticEvidence)
    for degrees, verdict in ((10.9, "shown_on_synthetic"), (11.1, "contradicted")):
        channels = tuple(
            dataclasses.replace(channel, rms=math.radians(degrees)) if channel.channel == "angle" else channel
            for channel in evidence.step.channels
        )
        changed = dataclasses.replace(evidence, step=dataclasses.replace(evidence.step, channels=channels))
        judged = {claim.id: claim for claim in measured_claims(load_printed(), changed, ())}
        assert judged["step_rms_position"].verdict == verdict
        assert judged["step_rms_position"].value == pytest.approx(degrees)


def test_what_the_rig_records_is_marked_synthetic(reproduction: Reproduction) -> None:
    evidence = reproduction.synthetic
    assert isinstance(evidence, SyntheticEvidence)
    recordings = (evidence.solenoid, evidence.proportional, evidence.step.measured)
    assert {recording.kind for recording in recordings} == {"synthetic"}
    assert {evidence.bench.torque.kind, evidence.bench.decay.kind} == {"synthetic"}


def test_overrides_reach_the_rig_s_torque_task_but_not_the_identification(reproduction: Reproduction) -> None:
    changed = reproduce(["reference.level=4 N m"])
    assert isinstance(changed.synthetic, SyntheticEvidence)
    assert isinstance(reproduction.synthetic, SyntheticEvidence)
    assert changed.synthetic.proportional["reference"].max() == pytest.approx(4.0)
    before, after = (
        [value.realistic.value for value in run.bench.values] for run in (reproduction.synthetic, changed.synthetic)
    )
    assert after == before


def test_the_counts_of_the_verdicts_add_up(reproduction: Reproduction) -> None:
    assert sum(verdict_counts(reproduction.claims).values()) == len(ORDER)


def test_a_constant_that_does_not_follow_from_the_gas_is_contradicted() -> None:
    assert arithmetic()["c1"].verdict == "reproduced"
    assert arithmetic(reported__choked_flow_constant=0.00283)["c1"].verdict == "contradicted"
    assert arithmetic(gas__heat_capacity_ratio=1.4)["critical_pressure_ratio"].verdict == "contradicted"


def test_damping_and_friction_hold_with_ten_times_the_inertia() -> None:
    assert arithmetic()["rotary_damping"].verdict == "contradicted"
    mended = arithmetic(foot_plate__inertia=84.0)
    assert mended["rotary_damping"].verdict == mended["dynamic_friction"].verdict == "reproduced"
    assert mended["rotary_damping"].value == pytest.approx(33.6)


def test_a_discharge_coefficient_that_gives_the_printed_flow_holds_with_an_assumption() -> None:
    claim = arithmetic(valves__solenoid__discharge_coefficient=0.095)["discharge_coefficient_solenoid"]
    assert claim.verdict == "reproduced_with_assumptions"
    assert any("atmospheric_pressure" in assumption for assumption in claim.assumptions)


def test_a_claim_is_missed_only_outside_its_window(reproduction: Reproduction) -> None:
    claim = next(claim for claim in reproduction.claims if claim.id == "co2_solenoid")
    assert claim.window == (1.0, 1.2)
    values = {1.0: False, 1.2: False, 0.99: True, 1.21: True, None: True}
    for value, is_missed in values.items():
        assert dataclasses.replace(claim, value=value).is_missed is is_missed
    assert dataclasses.replace(claim, value=2.0, window=None).is_missed is False


def test_simulated_claims_name_every_assumption_of_scenario_and_set(reproduction: Reproduction) -> None:
    claim = next(claim for claim in reproduction.claims if claim.id == "co2_saving")
    named = {text.partition(" = ")[0] for text in claim.assumptions}
    for run in (reproduction.solenoid, reproduction.proportional):
        assert {item.path for item in run.scenario.assumptions} <= named
    assert {"actuator.dead_volume_1", "valves.solenoid.discharge_coefficient"} <= named
    assert all(": " in text for text in claim.assumptions)


def test_what_a_held_vane_does_not_use_is_no_assumption_of_the_torque_task(reproduction: Reproduction) -> None:
    users = {value.path: value.used_by for value in reproduction.assumed}
    assert users["actuator.restitution"] == (STEP,)
    assert users["actuator.dead_volume_1"] == EXPERIMENTS


def test_what_the_file_of_an_experiment_sets_is_no_assumption(reproduction: Reproduction) -> None:
    assert "supply.pressure" not in {value.path for value in reproduction.assumed}


def test_an_override_of_the_device_reaches_all_experiments_and_is_listed() -> None:
    changed = reproduce(["supply.atmospheric_pressure=100 kPa_a"])
    for run in (changed.step, changed.solenoid, changed.proportional):
        assert run.scenario.device.supply.atmospheric_pressure == pytest.approx(1.0e5)
    listed = next(value for value in changed.assumed if value.path == "supply.atmospheric_pressure")
    assert listed.value == "100 kPa_a"
    assert listed.reason.startswith("set for this run")


def test_an_override_of_a_scenario_reaches_those_that_have_the_value() -> None:
    changed = reproduce(["controller.proportional_gain=0.2 1/(N m)"])
    assert changed.proportional.scenario.control.settings["proportional_gain"] == pytest.approx(0.2)
    assert changed.step.scenario.origin.overrides == changed.solenoid.scenario.origin.overrides == ()


def test_an_override_that_nothing_knows_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(PpafoError, match=r"did you mean 'supply\.pressure'"):
        reproduce(["supply.presure=60 psi_g"])


def test_overrides_leave_the_paper_s_own_arithmetic_alone(reproduction: Reproduction) -> None:
    changed = reproduce(["gas.species=air"])
    before, after = ({claim.id: claim.value for claim in run.claims} for run in (reproduction, changed))
    assert after["c1"] == before["c1"]
    assert after["co2_solenoid"] != before["co2_solenoid"]


def test_a_window_that_is_missed_contradicts_the_claim() -> None:
    changed = reproduce(["valves.solenoid.area=31.6 mm^2"])
    assert "co2_solenoid" in {claim.id for claim in changed.missed}
    assert {claim.verdict for claim in changed.missed} == {"contradicted"}


@pytest.mark.thorough
def test_a_task_without_a_ramp_has_nothing_to_oscillate_on() -> None:
    changed = reproduce(["reference.kind=constant", "reference.level=3 N m"])
    told = {item.id: item for item in changed.torque_observations}
    assert told["solenoid_oscillates_on_ramp"].holds is False
    assert "no ramp" in told["solenoid_oscillates_on_ramp"].evidence


def test_a_restless_hold_is_not_called_quiet(reproduction: Reproduction) -> None:
    metrics = dict(reproduction.solenoid.metrics)
    metrics["oscillations_hold"] = dataclasses.replace(metrics["oscillations_hold"], value=7.0)
    restless = dataclasses.replace(reproduction.solenoid, metrics=metrics)
    told = {item.id: item for item in torque_task_observations(restless, reproduction.proportional)}
    assert told["solenoid_quiet_on_hold"].holds is False
    assert told["solenoid_quiet_on_hold"].evidence == "7 torque reversals on the hold"


def test_a_run_that_diverges_stops_the_reproduction_with_its_name(
    reproduction: Reproduction, monkeypatch: pytest.MonkeyPatch
) -> None:
    def diverged(scenario: object) -> Result:
        return dataclasses.replace(reproduction.step, status=Status("diverged", 0.1, "diverged at t = 0.1 s"))

    monkeypatch.setattr(study, "simulate", diverged)
    with pytest.raises(SimulationError, match="step-response: diverged at t"):
        reproduce()


@pytest.mark.thorough
def test_every_experiment_is_told_of_before_it_runs() -> None:
    heard: list[str] = []
    reproduce(progress=lambda progress: heard.append(progress.activity))
    assert [name for name in (STEP, SOLENOID, PROPORTIONAL) if not any(name in text for text in heard)] == []
