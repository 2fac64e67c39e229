"""Tunings of the torque task, from a file to lines to paste."""

import re
from functools import cache, partial
from typing import Any

import jsonschema
import pytest

import ppafo
from ppafo.analyses.tune import tune
from ppafo.analyses.tuning import Tuned, json_schema, list_tunings, load_tuning
from ppafo.errors import StudyError
from ppafo.simulation.tracking.rule import task_parts

DOCUMENT: dict[str, Any] = {
    "schema_version": 1,
    "name": "trial",
    "scenario": "torque-task-proportional",
    "overrides": ["reference.level=4 N m", "run.duration=1 s", "reference.ramp_time=0.5 s"],
    "search": [
        {"path": "controller.proportional_gain", "minimum": "0.05 1/(N m)", "maximum": "1 1/(N m)"},
        {
            "path": "controller.integral_gain",
            "minimum": "0.01 1/(N m s)",
            "maximum": "2 1/(N m s)",
            "spacing": "logarithmic",
        },
    ],
    "objective": [{"metric": "rms_error"}],
    "effort": {"starts": 2, "generations": 8, "candidates_per_gain": 5},
}


changed, LOW = partial(dict, DOCUMENT), {"metric": "rms_error"}


def test_gains_are_found_that_are_better_and_can_be_pasted() -> None:
    lines: list[str] = []
    finding = tune(DOCUMENT, progress=lambda progress: lines.append(progress.line()))
    # A start may converge early: the total of its runs is an upper bound.
    assert lines
    assert all(re.match(r"tuning, [\d,]+ of at most [\d,]+ runs", line) for line in lines)
    tuning = finding.found
    assert tuning.before.objective == pytest.approx(1.0)
    assert tuning.after.objective < 0.5
    pasted = ppafo.simulate("torque-task-proportional", [*DOCUMENT["overrides"], *tuning.lines])
    assert pasted.metrics["rms_error"].value == pytest.approx(tuning.after.values["rms_error"], rel=1e-9)
    assert tuning.before.result.metrics["rms_error"].value == pytest.approx(tuning.before.values["rms_error"], rel=1e-9)
    assert tuning.bounds_reached["controller.proportional_gain"] == "maximum"  # no delay: any gain is taken
    assert tune(DOCUMENT).found.lines == tuning.lines
    assert len(finding.plot("search").axes) == 2


def test_a_constraint_is_kept_or_said_to_be_out_of_reach() -> None:
    free = tune(DOCUMENT).found
    least = free.before.result.metrics["peak_error"].value * 0.8
    kept = tune(
        changed(
            objective=[{"metric": "gas_supplied"}], constraints=[{"metric": "peak_error", "at_most": f"{least} N m"}]
        )
    ).found
    assert kept.after.is_feasible
    assert kept.after.values["peak_error"] <= least
    assert not kept.before.is_feasible
    never = tune(changed(constraints=[{"metric": "gas_supplied", "at_most": "0.001 g"}]))
    assert never.found.after.violation > 1.0
    assert len(never.plot("search").axes) == 1


def test_a_robust_tuning_judges_every_candidate_over_the_same_draws() -> None:
    robust = {"study": "torque-task-uncertainty", "measure": "quantile", "share": 0.9, "draws": 16}
    tuning = tune(changed(robust=robust, effort={"starts": 1, "generations": 3, "candidates_per_gain": 4})).found
    assert tuning.after.objective < tuning.before.objective
    assert tuning.after.fresh["rms_error"] < tuning.before.fresh["rms_error"]
    assert tuning.before.values["rms_error"] > tuning.before.result.metrics["rms_error"].value
    assert tuning.before.fresh["rms_error"] == pytest.approx(tuning.before.values["rms_error"], rel=0.2)


CEILING = "the reference requires more torque than the actuator gives"


@cache
def held_by(level: str, share: float) -> Tuned:
    """A robust tuning that asks an uncertain device to hold a torque."""
    robust = {"study": "torque-task-uncertainty", "measure": "quantile", "share": share, "draws": 16}
    return tune(
        changed(
            overrides=[f"reference.level={level}", "run.duration=1 s", "reference.ramp_time=0.5 s"],
            constraints=[{"metric": "rms_error_hold", "at_most": "0.1 N m"}],
            robust=robust,
            effort={"starts": 1, "generations": 5, "candidates_per_gain": 4},
        )
    ).found


def test_a_goal_above_the_ceiling_of_some_draws_is_missed_and_the_ceiling_is_named() -> None:
    never, always = held_by("5 N m", 0.9), held_by("3.5 N m", 0.9)
    assert not never.after.is_feasible
    assert 0.3 < never.after.beyond_reach < 0.7
    assert CEILING in never.verdict
    assert always.after.is_feasible
    assert always.after.beyond_reach == 0.0
    assert CEILING not in always.verdict


def test_noise_is_drawn_for_every_candidate_alike_and_judged_on_fresh_draws() -> None:
    overrides = [*DOCUMENT["overrides"], "sensors.pressure_noise=3 kPa_d"]
    quick = {"starts": 1, "generations": 1, "candidates_per_gain": 4}
    one, other = (tune(changed(overrides=[*overrides, f"sensors.seed={seed}"], effort=quick)).found for seed in (1, 2))
    assert one.after.values == other.after.values, "the seed of the scenario does not decide"
    assert one.after.values["rms_error"] != one.after.result.metrics["rms_error"].value
    assert one.after.fresh["rms_error"] == pytest.approx(one.after.values["rms_error"], rel=0.1)
    with pytest.raises(StudyError, match="all candidates use the same noise"):
        load_tuning(changed(search=[{"path": "sensors.seed", "minimum": 1, "maximum": 5}]))


def test_the_tunings_of_the_package_load_and_fit_the_published_schema() -> None:
    import tomllib
    from importlib import resources

    folder = resources.files("ppafo") / "analyses" / "tunings"
    assert list_tunings() == ("pid-gains", "pid-gains-robust", "push-off")
    for name in list_tunings():
        assert load_tuning(name).name == name
        jsonschema.validate(tomllib.loads((folder / f"{name}.toml").read_text()), json_schema())


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"search": [DOCUMENT["search"][0]] * 2}, "'controller.proportional_gain' appears in two [[search]] tables"),
        ({"search": [DOCUMENT["search"][0] | {"minimum": "2 1/(N m)"}]}, "must be less than maximum"),
        (
            {"search": [DOCUMENT["search"][0] | {"minimum": "0 1/(N m)", "spacing": "logarithmic"}]},
            "minimum = '0 1/(N m)' must be above 0",
        ),
        ({"search": [DOCUMENT["search"][0] | {"maximum": "1e9 1/(N m)"}]}, "at most 1e+06 1/(N m)"),
        (
            {
                "search": [
                    {"path": "valve.sonic_conductance", "minimum": "1e-9 m^3/(s Pa)", "maximum": "2e-9 m^3/(s Pa)"}
                ]
            },
            "has no value for 'valve.sonic_conductance'; set it in the scenario or by an override",
        ),
        ({"objective": [{"metric": "rms_error", "weight": 0.0}]}, "weight = 0 has no effect"),
        ({"objective": [{"metric": "rms_error", "scale": "2 g"}]}, "objective 'rms_error': scale = '2 g'"),
        ({"constraints": [LOW]}, "has neither of at_most and at_least; give one of them"),
        ({"constraints": [LOW | {"at_most": "1 N m"}, LOW | {"at_least": "2 N m"}]}, "is above at_most = '1 N m'"),
        (
            {
                "robust": {"study": "torque-task-uncertainty"},
                "search": [{"path": "supply.pressure", "minimum": "40 psi_g", "maximum": "60 psi_g"}],
            },
            "draws 'supply.pressure', which is also searched",
        ),
    ],
)
def test_a_file_that_makes_no_sense_is_one_line(changes: dict[str, Any], text: str) -> None:
    with pytest.raises(StudyError) as caught:
        load_tuning(changed(**changes))
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_goal_that_is_zero_before_needs_a_scale() -> None:
    document = changed(objective=[{"metric": "mechanical_work"}])
    with pytest.raises(StudyError, match="'mechanical_work' is 0 before tuning, which cannot be its scale; set"):
        tune(document)


def test_gains_with_which_the_loop_oscillates_are_not_recommended_however_they_score() -> None:
    late = [*DOCUMENT["overrides"], "valve.delay=10 ms"]
    highest = ppafo.simulate("torque-task-proportional", [*late, "controller.proportional_gain=8 1/(N m)"])
    assert highest.tracking.fails
    # What is asked for is a large error: the one of the highest gains is larger than any of a loop at rest.
    tuned = tune(
        changed(
            overrides=late,
            search=[{"path": "controller.proportional_gain", "minimum": "0.1 1/(N m)", "maximum": "8 1/(N m)"}],
            objective=[{"metric": "rms_error", "weight": -1.0}],
            effort={"starts": 1, "generations": 4, "candidates_per_gain": 8},
        )
    ).found
    verdict = tuned.after.result.tracking
    assert verdict.kind != "oscillates"
    assert tuned.after.values["rms_error"] < highest.metrics["rms_error"].value
    assert tuned.after.gains["controller.proportional_gain"] < 1.0


def test_gains_with_which_the_loop_rests_beside_its_reference_are_not_recommended_however_little_gas_they_need() -> (
    None
):
    tuning = changed(
        search=[{"path": "controller.proportional_gain", "minimum": "0.001 1/(N m)", "maximum": "1 1/(N m)"}],
        overrides=[*DOCUMENT["overrides"], "controller.integral_gain=0 1/(N m s)"],
        objective=[{"metric": "gas_supplied"}],
    )
    finding = tune(tuning)
    lazy = ppafo.simulate("torque-task-proportional", [*tuning["overrides"], "controller.proportional_gain=0.01"])
    assert lazy.tracking.fails
    assert lazy.metrics["gas_supplied"].value < finding.found.after.values["gas_supplied"]
    assert finding.found.after.result.tracking.follows
    assert "the loop follows its reference, with the previous gains it did not" in finding.found.verdict
    never = tune(tuning | {"search": [tuning["search"][0] | {"maximum": "0.01 1/(N m)"}]})
    assert not never.passed
    assert "no gains within the bounds let the loop follow its reference" in never.found.verdict


def test_the_metric_that_is_printed_is_the_metric_and_what_is_judged_stands_apart() -> None:
    late = [*DOCUMENT["overrides"], "valve.delay=10 ms", "controller.proportional_gain=4 1/(N m)"]
    quick = {"starts": 1, "generations": 1, "candidates_per_gain": 4}
    before = tune(changed(overrides=late, objective=[{"metric": "final_error"}], effort=quick)).found.before
    settled = task_parts(before.result.scenario, before.result.recording)[0]
    assert settled.error_reversals > 4
    assert before.values["final_error"] == pytest.approx(before.metrics["final_error"].value, rel=1e-9)
    assert before.judged["final_error"] == pytest.approx(settled.rms_error, rel=1e-6)
    assert before.judged["final_error"] > before.values["final_error"]
