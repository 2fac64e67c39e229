"""Verdicts on the whole reference: each rest and move is judged, with limits that do not jump."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest

import ppafo
from ppafo.cli.main import main
from ppafo.loading import load_scenario
from ppafo.metrics.metric import followed
from ppafo.metrics.settled import SettledPart
from ppafo.parameters.reach import torque_reach
from ppafo.simulation.numbers import with_numbers
from ppafo.simulation.simulate import simulate
from ppafo.simulation.tracking.rule import (
    ON_PURPOSE,
    excess_of_part,
    excess_of_walk,
    needed_metrics,
    part_limits,
    settled_parts,
    smallest_change,
    task_parts,
)
from ppafo.study.runs import run_judged

TASK = "torque-task-proportional"
SMALL_WAVE = [f"reference.{text}" for text in ("kind=sine", "level=3 N m", "amplitude=0.6 N m", "frequency=4 Hz")]
FOLLOWING = ["controller.proportional_gain=0.5 1/(N m)", "controller.integral_gain=5 1/(N m s)"]


def table(*knots: tuple[float, float], unit: str = "N m") -> list[str]:
    """Overrides of a reference that goes once through knots, times [s] and values, and stays at the last one."""
    first, *others = (*knots, (99.0, knots[-1][1]))
    named = [f"reference.value_01={first[1]} {unit}", "reference.period=100 s", "reference.kind=tabulated"]
    for number, (time, value) in enumerate(others, 2):
        named += [f"reference.time_{number:02}={time} s", f"reference.value_{number:02}={value} {unit}"]
    return [*named, f"reference.level=0 {unit}", "run.duration=2 s"]


PULSE = table((0.0, 0.0), (0.3, 4.0), (0.6, 4.0), (0.9, 0.0))
TRAPEZOID = table((0.0, 0.0), (0.4, 9.0), (1.0, 9.0), (1.3, 1.0))
TRIANGLES = table((0.0, 0.0), (0.2, 3.0), (0.4, 0.5), (0.6, 3.5), (0.8, 0.0))


@pytest.mark.parametrize(
    ("reference", "changes", "said"),
    [
        (PULSE, FOLLOWING, ""),
        (PULSE, ["valve.area=0.002 mm^2"], "the torque loop does not move: 0.000"),
        (TRAPEZOID, FOLLOWING, "from 0.7 s to 1 s the torque stays 4 N m below its reference (0.45 N m allowed)"),
        (TRIANGLES, FOLLOWING, ""),
        (table((0.0, 0.0), (0.5, 0.0)), FOLLOWING, ""),
        (TRIANGLES, ["valve.area=0.002 mm^2"], "the torque loop does not move: 0.000"),
        (
            TRIANGLES,
            ["controller.proportional_gain=0.02 1/(N m)"],
            "the torque stays 0.667 N m below its reference (0.175 N m",
        ),
    ],
)
def test_every_rest_and_move_is_judged_and_equally_in_runs_and_in_studies(
    reference: list[str], changes: list[str], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = load_scenario(TASK, [*reference, *changes])
    result = simulate(scenario)
    assert result.tracking.follows is (not said)
    assert result.tracking.sentence.startswith(said)
    columns = {"supply.pressure": np.full(1, scenario.device.supply.pressure)}
    rows = run_judged(scenario, needed_metrics(scenario), (), None, columns)
    assert (rows["follows"] == 1.0).tolist() == [not said]
    metered = settled_parts(scenario, rows, smallest_change(scenario))
    parts = task_parts(scenario, result.recording)
    monkeypatch.setenv("PPAFO_BACKEND", "python")
    assert repr(task_parts(scenario, result.recording)) == repr(parts)
    for recorded, counted in zip(parts, metered, strict=True):
        for name in ("rms_error", "mean_error", "error_range", "lag", "weight", "motion", "error_reversals", "rests"):
            assert getattr(counted, name) == pytest.approx(getattr(recorded, name), rel=1e-9, abs=1e-12, nan_ok=True), (
                name
            )


def test_no_limit_jumps_where_a_joint_begins_to_creep() -> None:
    creeping = ["motion.kind=prescribed", "motion.profile.kind=sine", "motion.profile.level=75 deg"]
    creeping += ["motion.profile.amplitude=0 deg", "motion.profile.frequency=0.5 Hz", "reference.level=3 N m"]
    base, limits = load_scenario(TASK, [*creeping, *FOLLOWING]), []
    for amplitude in np.linspace(-0.02, 0.02, 21):
        scenario = with_numbers(base, {"motion.profile.amplitude": float(amplitude)})
        limits.append(float(part_limits(task_parts(scenario, simulate(scenario).recording)[0], False).rms_error))
    assert limits[10] == pytest.approx(0.05 * 3.0, rel=1e-3)
    assert np.max(np.abs(np.diff(limits))) < 0.15 * limits[10]


def sine(amplitude: float, frequency: float) -> list[str]:
    """Overrides of a sine about 3 N m."""
    named = {"kind": "sine", "level": "3 N m", "amplitude": f"{amplitude} N m", "frequency": f"{frequency} Hz"}
    return [f"reference.{name}={value}" for name, value in named.items()]


@pytest.mark.parametrize(
    ("references", "largest"),
    [
        ([sine(0.01 * number, 2.0) for number in range(16)], 0.09),
        ([sine(0.6, 0.5 + 0.1 * number) for number in range(24)], 0.09),
        ([table((0.0, 0.0), (0.3, 3.0), (3.0, 3.0 - 0.02 * number)) for number in range(16)], 0.03),
    ],
    ids=["amplitude", "frequency", "slope"],
)
def test_limits_move_in_small_steps_with_amplitude_frequency_and_slope(
    references: list[list[str]], largest: float
) -> None:
    judged = [simulate(load_scenario(TASK, reference)).tracking for reference in references]
    limits = np.array([verdict.limit for verdict in judged if verdict.criterion == "RMS error"])
    assert limits.size == len(judged)
    assert np.max(np.abs(np.diff(np.log(limits)))) < largest


@pytest.mark.parametrize(
    ("ramp", "changes", "is_missed"),
    [
        (0.3, ["controller.proportional_gain=0.1 1/(N m)"], True),
        (0.2, ["controller.proportional_gain=0.2 1/(N m)"], False),
        # A pulse that is shorter than the rest before it leads back to the level of that; the loop oscillates.
        (0.1, ["controller.proportional_gain=3.92 1/(N m)", "sensors.delay=10 ms", "valve.delay=10 ms"], True),
        (0.1, ["controller.proportional_gain=1.35 1/(N m)", "sensors.delay=10 ms", "valve.delay=10 ms"], True),
    ],
)
def test_nothing_jumps_where_a_plateau_becomes_a_rest_and_a_missed_pulse_stays_missed(
    ramp: float, changes: list[str], is_missed: bool
) -> None:
    excesses = []
    for length in np.arange(0.09, 0.22, 0.002):
        knots = (
            (0.0, 1.0),
            (0.3, 1.0),
            (0.3 + ramp, 4.0),
            (0.3 + ramp + length, 4.0),
            (0.3 + 2.0 * ramp + length, 1.0),
        )
        scenario = load_scenario(TASK, [*table(*knots), *changes])
        # Before the last rest, which the pulse does not change.
        parts = task_parts(scenario, simulate(scenario).recording)[1:]
        excesses.append(max(float(np.nan_to_num(excess_of_part(part, False).largest)) for part in parts))
    assert not is_missed or min(excesses) > 1.0
    # Before the rest and the move around it shared, and their reversals: 0.3 to 1.7.
    assert np.max(np.abs(np.diff(np.log(excesses)))) < 0.25


def test_a_verdict_is_one_of_three_states_and_a_check_passes_only_where_it_follows_or_nothing_is_followed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cases: list[tuple[str, list[str], Any, str]] = [
        (TASK, [*FOLLOWING, "reference.level=4 N m"], True, ""),
        (TASK, ["controller.proportional_gain=0.01 1/(N m)", "reference.level=4 N m"], False, ""),
        (TASK, ["run.duration=0.3 s"], None, "too short"),
        ("step-response", [], None, "open loop"),
        # A wave within the dead band, whose parts have one sample.
        (TASK, ["valve.area=0.3 mm^2", *SMALL_WAVE], False, ""),
    ]
    for name, changes, follows, reason in cases:
        given = [text for change in changes for text in ("--set", change)]
        assert main(["simulate", name, *given, "--json", "--out", str(tmp_path / "run")]) == 0
        tracking = json.loads(capsys.readouterr().out)["tracking"]
        assert (tracking["follows"], tracking["reason"]) == (follows, reason)
        decided = tracking["number"], tracking["limit"]
        assert decided == (None, None) if reason == "open loop" else follows in (None, decided[0] <= decided[1])
        assert ppafo.simulate(name, changes).tracking.passes == (follows is True or reason == "open loop")


def test_a_walk_with_on_off_valves_is_judged_by_what_it_gives_in_push_off() -> None:
    given, lacking = (ppafo.simulate("solenoid", ["run.duration=6 s", *more]) for more in ([], ["valve.area=1 mm^2"]))
    assert given.tracking.sentence.startswith("the torque follows its reference; in push-off: missing peak torque 0.8")
    assert lacking.tracking.criterion == "missing peak torque"
    base = load_scenario("solenoid", ["run.duration=6 s"])
    columns = {"valve.area": np.array([12.6e-6, 1.0e-6])}
    assert run_judged(base, (), (), None, columns)["follows"].tolist() == [
        1,
        0,
    ]


def test_reach_counts_where_and_by_how_much_it_is_exceeded() -> None:
    base = load_scenario(TASK, [*PULSE, *FOLLOWING])
    reach = torque_reach(base.device, math.radians(75.0))[1]
    levels = reach * np.linspace(0.98, 1.08, 51)
    rows = run_judged(base, (), (), None, {f"reference.value_{number:02}": levels for number in (2, 3)})
    # A verdict flips where a twentieth of the level is missing on the hold, and nothing jumps before, the fall neither.
    assert rows["follows"].tolist() == (levels - reach < 0.05 * levels).tolist()
    assert np.max(np.abs(np.diff(rows["excess"]))) < 1.05 * 0.002 / 0.05


def test_a_walk_that_gives_more_than_it_is_asked_for_exceeds_and_does_not_miss() -> None:
    asked = SettledPart(wanted_change=8.0, rms_error=3.0, requested_peak=12.9, given_peak=19.7)
    assert excess_of_walk(asked, 0.0, 15.0) == pytest.approx(19.7 / (1.5 * 12.9))
    assert excess_of_walk(asked._replace(given_peak=13.0), 0.0, 15.0) < 1.0


def test_a_move_that_overshoots_within_its_limit_says_so() -> None:
    changes = ["kind=ramp_hold", "start_level=90 deg", "level=80 deg", "ramp_time=0.02 s"]
    result = ppafo.simulate("cylinder-servo", ["run.duration=2 s", *(f"reference.{each}" for each in changes)])
    beyond = math.radians(80.0) - float(np.min(result["angle"]))
    assert f"overshoots by {math.degrees(beyond):.3g} deg" in result.tracking.sentence


def test_every_door_has_the_same_three_states(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    grid: dict[str, Any] = {"path": "supply.pressure", "kind": "grid", "first": "50 psi_g", "last": "60 psi_g"}
    study = {
        "schema_version": 1,
        "name": "doors",
        "configurations": [{"name": "task", "scenario": TASK}],
        "vary": [{**grid, "count": 2}, {"path": "valve.area", "kind": "list", "values": ["0.3 mm^2", "10 mm^2"]}],
        "outputs": {"metrics": ["rms_error"]},
    }
    finding = ppafo.sweep(study, out=tmp_path / "doors")
    # A small valve misses the level at any pressure; 50 psi_g hold 5 of 6 N m.
    states = [(False, False), (False, True), (False, False), (True, False)]
    frame = pyarrow.parquet.read_table(tmp_path / "doors" / "runs" / "chunk-0000000.parquet").to_pandas()
    assert list(zip(frame["follows"], frame[ON_PURPOSE], strict=True)) == states
    assert [frame[name].dtype.kind for name in ("follows", ON_PURPOSE)] == ["b", "b"]
    said = "task: the reference is followed in 1 of 4 runs, not in 2; beyond reach on purpose: 1"
    counts = {"runs": 4, "follow": 1, "do_not_follow": 2, ON_PURPOSE: 1, "without_verdict": 0}
    assert json.loads((tmp_path / "doors" / "summary.json").read_text(encoding="utf-8"))["tracking"] == {"task": counts}
    assert finding.said[1] == said
    assert said in finding.parts[0].caption
    assert ppafo.load_study_results(tmp_path / "doors").said[1] == said
    for row, (follows, on_purpose) in zip(frame.to_dict("records"), states, strict=True):
        numbers = {path: row[path] for path in ("supply.pressure", "valve.area")}
        tracking = simulate(with_numbers(load_scenario(TASK), numbers)).tracking
        assert (tracking.follows, bool(tracking.accepted)) == (follows, on_purpose)
    assert main(["simulate", TASK, "--json", "--out", str(tmp_path / "run")]) == 0
    single = json.loads(capsys.readouterr().out)["tracking"]
    assert (single["follows"], single[ON_PURPOSE]) == states[1]
    tried = ppafo.find(TASK, vary="supply.pressure=50..60 psi_g", such_that="rms_error <= 5 N m", grid=3).found.tried
    assert [tried[name][end] for end in (0, -1) for name in ("follows", ON_PURPOSE)] == [*states[1], *states[3]]


def test_a_comparison_says_in_how_many_draws_each_configuration_follows() -> None:
    overrides = ["reference.level=4.9 N m", "reference.beyond_reach=at some supplies", "reference.ramp_time=2 s"]
    finding = ppafo.compare(study="torque-task-uncertainty", draws=32, overrides=overrides)
    (cases,) = finding.found.tasks.values()
    counts = {case.configuration: case.draws for case in cases}
    # The nominal device is one draw of many: its pair of valves oscillates, and follows in some of them.
    assert next(case.verdict for case in cases if case.configuration == "solenoid") == "oscillates"
    alone = counts["proportional"]
    assert (alone.follow, alone.do_not_follow, alone.beyond_reach_on_purpose) == (30, 0, 2)
    assert f"proportional: {counts['proportional'].sentence}" in str(finding)


def test_an_angle_that_is_stuck_on_its_way_out_and_back_does_not_follow() -> None:
    knots = table((0.0, 80.0), (0.3, 90.0), (0.8, 90.0), (1.1, 80.0), unit="deg")
    stuck = ["friction.static_torque=8 N m", "friction.dynamic_torque=7 N m", "motion.angle=80 deg"]
    result = simulate(load_scenario("cylinder-servo", [*knots, *stuck]))
    reference, angle = followed(result.recording)
    assert np.ptp(angle) < 1e-6 < np.ptp(reference)
    assert result.tracking.kind == "does not move"
