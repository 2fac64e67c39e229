"""A neuromuscular gait model under the device: body and gas step by step, falls, columns, and what refuses one."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.analyses.endurance.answer import Endurance
from ppafo.analyses.endurance.question import bottle as endurance
from ppafo.analyses.walk.question import walk_with_and_without
from ppafo.cli.main import main
from ppafo.engine.lanes import BatchResult, run_batch, write_source
from ppafo.engine.rows import leaf_paths, numbers, rebuild, row_numbers
from ppafo.engine.run import Run, batch_of
from ppafo.engine.scheme.pneumatics import HeldChambers, held_chambers
from ppafo.errors import DataError, PpafoError, ScenarioError
from ppafo.metrics import METRICS
from ppafo.metrics.metric import REACTS
from ppafo.model.plant import PlantState
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.ensemble.running import lacking
from ppafo.simulation.recorded import start_of
from ppafo.simulation.scenario import Scenario
from ppafo.storage.opensim import opensim_recording
from ppafo.translation.native import translated_text
from ppafo.validation.measured import check_recording
from ppafo.validation.replay import Replay, replay_recording
from ppafo.walking import load_walk, walk, walk_population
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.planning import plan_walk
from ppafo.walking.walk import with_device_off
from ppafo.wearer import scheme as reacting
from ppafo.wearer.model.nerves import Nerves
from ppafo.wearer.model.walker import Walker
from ppafo.wearer.recording import toe_heights
from ppafo.wearer.settings import wearer_of_walk

WALK, STEP = "reacting", 1.0e-4
WEAK = "wearer.tibialis_strength=0.1"
METERS = [name for name, kind in METRICS.items() if REACTS in kind.needs]


class Alternating:
    """Fills one chamber for 0.2 s and then the other, whatever the foot does."""

    def reset(self) -> None:
        pass

    def update(self, time: float, _reference: float, _measurement: Any) -> float:
        return 1.0 if int(time / 0.2) % 2 == 0 else -1.0


def every_step(scenario: Scenario, seconds: float) -> tuple[Run, BatchResult]:
    """A run that records every step."""
    before = with_duration(scenario, seconds)
    run = plan_walk(replace(before, run=replace(before.run, output_interval=STEP)))
    return run, run_batch(batch_of(run))


def test_each_step_of_the_lanes_is_the_step_of_plain_python_to_the_bit() -> None:
    run, result = every_step(load_walk(WALK, [WEAK, "wearer.push=60 N", "wearer.push_from=1 cm"]), 0.05)
    walk = run.walk
    assert isinstance(walk, reacting.ReactingWalk)
    rows = row_numbers(run.program.state_rows())

    def group(kind: Any, name: str, sample: int) -> Any:
        return rebuild(kind, [result.record[sample, rows[path], 0] for path in leaf_paths(kind, name)])

    sampled = 0
    for sample in range(499):
        state: PlantState = group(PlantState, "state", sample)
        held: HeldChambers = held_chambers(run.plant, state.angle)
        before = group(reacting.ReactingState, "walk", sample)
        reflexes, nerves = group(reacting.Reflexes, "reflexes", sample), group(Nerves, "nerves", sample)
        assist, walker = reacting.assist_of(run.plant, walk.share, state, held), group(Walker, "walker", sample)
        reflexes = reacting.next_reflexes(walk.body, nerves, reflexes, walker) if reflexes.due else reflexes
        body = reacting.next_body(walk.body, walker, reflexes, before, assist, run.step)
        assert numbers(body.after) == numbers(group(Walker, "walker", sample + 1)), sample
        after: PlantState = group(PlantState, "state", sample + 1)
        pose, rates = body.after.pose, body.after.rates
        ankle = reacting.ankle_of(run.plant, pose.left, rates.left, pose.lean, rates.lean, before.fall_time)
        assert (ankle.angle, ankle.rate) == (after.angle, after.angular_velocity)
        later = reacting.waiting_reflexes(reflexes, before.fall_time, run.step)
        assert numbers(later) == numbers(group(reacting.Reflexes, "reflexes", sample + 1))
        if body.due:
            passed_on = reacting.next_nerves(nerves, body.left_felt, body.right_felt, body.balance)
            assert numbers(passed_on) == numbers(group(Nerves, "nerves", sample + 1))
            sampled += 1
    assert sampled == 50, "the nerves are sampled every millisecond"


def test_the_gas_is_that_of_a_vane_which_is_led_along_the_same_ankle() -> None:
    scenario = load_walk(WALK, ["wearer.start_speed=1.2 m/s"])
    before = with_duration(scenario.controlled_by(Alternating()), 1.0)
    played = walk(replace(before, run=replace(before.run, output_interval=STEP)))
    recording = played.recording
    assert recording["angle"].max() - recording["angle"].min() > 0.3, "the foot moves"
    measured = check_recording(recording, scenario.device, "walk")
    start = start_of(recording, scenario.device, {}, "walk", {})
    found = replay_recording(Replay(measured, scenario.device, start, "measured", 0.0)).recording
    for chamber in ("pressure_1", "pressure_2"):
        again = np.interp(recording.time, found.time, found[chamber])
        away = np.abs(again - recording[chamber])
        assert float(away.max()) < 0.01 * float(np.ptp(recording[chamber])), chamber


@pytest.mark.long
def test_faults_and_a_shut_off_valve_are_translated_to_c_as_well() -> None:
    faults = [f"faults.{part}.{item}" for part in ("valve_1", "heel") for item in ("kind=stuck", "time=4 s")]
    walk = load_walk(WALK, [*faults, "faults.heel.reading=0 N", "shut_off.area=10 mm^2"])
    assert "walker_" in translated_text(write_source(plan_walk(walk).program)[1])


@pytest.mark.long
def test_rows_of_an_ensemble_are_single_walks_to_the_bit() -> None:
    scenario = with_duration(load_walk(WALK), 6.0)
    strength, speed = np.array([0.2, 0.1, 0.5, 0.9, 1.0]), np.array([1.2, 1.3, 1.3, 1.4, 1.2])
    columns = {"wearer.tibialis_strength": strength, "wearer.start_speed": speed}
    columns |= {"wearer.slope": np.array([0.0, 0.0, -0.05, 0.03, 0.0]), "wearer.push": np.array([0, 0, 0, 0, 90.0])}
    together = run_ensemble(scenario, columns, [*METERS, "gas", "strides"])
    for row in range(strength.size):
        own = {path: values[row : row + 1] for path, values in columns.items()}
        alone = run_ensemble(scenario, own, [*METERS, "gas", "strides"])
        for name, values in together.metrics.items():
            np.testing.assert_array_equal(values[row : row + 1], alone.metrics[name], name)
    single = ppafo.simulate(WALK, ["run.duration=6 s", WEAK]).metrics
    for name in (*METERS, "gas", "strides"):
        value = together.metrics[name][1]
        assert (name not in single) if np.isnan(value) else single[name].value == pytest.approx(value, rel=1e-9), name


FALLS = ("wearer.tibialis_strength=0.02", "supply.dorsiflexion_pressure=6 psi_g", "run.duration=8 s")
STUDY = f"""
schema_version = 1
name = "falls"
[[configurations]]
name = "weak"
scenario = "reacting"
overrides = {json.dumps(FALLS)}
[[vary]]
path = "wearer.start_speed"
kind = "list"
values = ["1.3 m/s"]
[outputs]
metrics = "all"
trajectories = ["pressure_1"]
every = "5 ms"
"""


@pytest.mark.long
def test_a_study_counts_nothing_that_comes_after_a_fall_as_a_single_walk_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "falls.toml").write_text(STUDY)
    assert main(["sweep", str(tmp_path / "falls.toml"), "--out", str(tmp_path / "study")]) == 0
    capsys.readouterr()
    changes = [word for change in (*FALLS, "wearer.start_speed=1.3 m/s") for word in ("--set", change)]
    assert main(["simulate", WALK, *changes, "--out", str(tmp_path / "single"), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    single = {name: item["value"] for name, item in printed["metrics"].items()}
    assert printed["status"]["message"] == f"completed: the wearer fell at t = {single['fall_time']:.4g} s"
    assert single["walked_time"] < 6.0
    study = ppafo.load_study_results(tmp_path / "study").found
    row = study.table()
    assert {name: float(row[name][0]) for name in single} == pytest.approx(single, rel=1e-9)
    assert {"gas_supplied", "gas_vented", "work_per_gas"} < set(single)
    pressure, alone = (
        study.trajectories("pressure_1")[0],
        ppafo.read_result(tmp_path / "single").recording["pressure_1"],
    )
    np.testing.assert_array_equal(pressure[: len(alone)], alone.astype(np.float32))
    assert np.isnan(pressure[len(alone) :]).all(), "nothing is kept after the fall"


@pytest.mark.long
def test_a_walk_on_a_bottle_ends_with_the_fall_and_strides_are_those_of_the_wearer(tmp_path: Path) -> None:
    early = [*FALLS[:2], "wearer.soleus_strength=0.3", "run.duration=6 s", "bottle.name=paper-co2-9oz"]
    pair = walk_with_and_without(load_walk(WALK, early))
    worn, bare = pair.found.comparison.with_device, pair.found.comparison.without_device
    assert worn.supply is not None
    assert worn.metrics["fall_time"].value < worn.supply.ending.time < worn.metrics["fall_time"].value + 0.2 < 5.0
    assert worn.supply.ending.message.startswith("the wearer fell, and 25")
    assert bare.status.message.startswith("completed: the wearer fell"), "as long a walk, whoever fell in the other"
    life = endurance(
        walk(load_walk(WALK), minutes=0.1), overrides=["bottle.gas_mass=6 g", "bottle.volume=30 cm^3"]
    ).found
    assert isinstance(life, Endurance)
    assert life.draw.stride_time == pytest.approx(walk(load_walk(WALK), minutes=0.1).metrics["stride_time"].value)
    (tmp_path / "walk.json").write_text(json.dumps({"format": pair.to_dict()["format"]}))
    with pytest.raises(DataError, match="is the walk of a neuromuscular gait model: walk on the bottle"):
        endurance(tmp_path)


@pytest.mark.long
def test_a_weak_tibialis_falls_without_the_device_and_walks_on_with_it() -> None:
    pair = walk_with_and_without(load_walk(WALK, [WEAK]), minutes=0.25)
    worn, bare = pair.found.comparison.with_device, pair.found.comparison.without_device
    assert worn.metrics["stays_up"].value == 1.0
    assert worn.metrics["lowest_toes"].value > 0.0
    assert bare.metrics["stays_up"].value == 0.0
    fall = bare.metrics["fall_time"].value
    assert bare.recording.time[-1] <= fall < bare.recording.time[-1] + 0.01, "the recording ends with the fall"
    assert f"fell at t = {fall:.4g} s" in bare.status.message
    assert pair.passed
    assert "unadapted" in str(pair.parts)


@pytest.mark.long
def test_a_healthy_wearer_walks_at_the_published_speed_with_the_device_off() -> None:
    found = walk(with_duration(load_walk(WALK, ["controller.kind=off"]), 20.0))
    assert found.metrics["stays_up"].value == 1.0
    assert 1.2 < found.metrics["walking_speed"].value < 1.5
    assert found.metrics["total_gas"].value == 0.0
    weight = 80.0 * 9.81
    both = found.recording["ground_force"] + found.recording["other_ground_force"]
    assert float(both.mean()) == pytest.approx(weight, rel=0.02), "the ground carries the body, on average"


@pytest.mark.long
def test_half_the_step_gives_the_same_mean_stride() -> None:
    off = with_duration(load_walk(WALK, ["controller.kind=off"]), 20.0)
    speeds = [
        walk(replace(off, run=replace(off.run, step=step))).metrics["walking_speed"].value
        for step in (STEP, 0.5 * STEP)
    ]
    assert speeds[0] == pytest.approx(speeds[1], rel=0.01)


@pytest.mark.long
def test_a_gain_of_one_leg_is_a_setting_and_a_column() -> None:
    scenario = load_walk(WALK, ["wearer.left_soleus_force=1.1", "run.duration=6 s"])
    found = run_ensemble(scenario, {"wearer.left_soleus_force": np.array([1.1, 1.2])}, ["walking_speed"])
    speeds = found.metrics["walking_speed"]
    assert speeds[0] != speeds[1]
    assert speeds[0] == pytest.approx(ppafo.simulate(scenario).metrics["walking_speed"].value, rel=1e-9)


def test_the_same_wearer_with_the_device_off_takes_columns_as_well() -> None:
    off = with_device_off(with_duration(load_walk(WALK), 1.0))
    found = run_ensemble(off, {"wearer.start_speed": np.array([1.2, 1.4])}, ["walked_time"]).metrics
    assert found["walked_time"].tolist() == pytest.approx([1.0, 1.0])


@pytest.mark.long
def test_the_answer_says_on_which_slope_a_wearer_falls_and_what_was_walked_before() -> None:
    answer = walk_with_and_without(load_walk(WALK, ["wearer.slope=0.2", "controller.kind=off"]), minutes=0.15)
    assert "with the device: the wearer falls on the slope of +20 % at" in str(answer.parts)
    assert "level ground" in str(answer.parts)
    assert not answer.passed


def test_toes_are_over_the_ground_below_them() -> None:
    """As the lanes find it: the lowest of a swing is what the recording has."""
    _, result = every_step(load_walk(WALK, ["controller.kind=off"]), 0.01)
    level = plan_walk(load_walk(WALK)).walk
    sloped = plan_walk(load_walk(WALK, ["wearer.slope=0.1", "wearer.ground_from=1 m"])).walk
    assert isinstance(level, reacting.ReactingWalk)
    assert isinstance(sloped, reacting.ReactingWalk)
    rows = row_numbers(plan_walk(load_walk(WALK)).program.state_rows())
    record = {path: result.record[:3, row, 0] for path, row in rows.items() if path.startswith("walker.pose")}
    record["walker.pose.x"] = np.array([0.0, 3.0, 5.0])
    away = toe_heights(level.body, record) - toe_heights(sloped.body, record)
    assert away[0] == 0.0
    assert np.diff(away)[1] == pytest.approx(0.2, abs=1e-3)


def test_a_ratio_changes_a_gain_of_both_legs() -> None:
    wearer = wearer_of_walk(walk_of(load_walk(WALK, ["wearer.soleus_force_ratio=1.1", "wearer.left_soleus_force=1.0"])))
    row, plain = wearer.row(), wearer.body
    assert row.left_gains == plain.left_gains._replace(soleus_force=1.1)
    assert row.right_gains == plain.right_gains._replace(soleus_force=1.1 * plain.right_gains.soleus_force)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"motion": {"kind": "walk"}, "wearer": {"tibialis_strength": 0.3}}, "unknown key 'wearer.tibialis_strength'"),
        (
            {"wearer": {"reacts": "geyer-herr"}},
            'wearer.reacts = \'geyer-herr\': is now motion.kind = "react" and wearer.name = "geyer-herr"',
        ),
        ({"task_sequence": "stairs"}, "segment 1 (stand): a neuromuscular gait model walks on"),
        (
            {"task_sequence": "ramp-and-kerb", "wearer": {"name": "geyer-herr", "slope": 0.01}},
            "wearer.slope = 0.01: does not go with task sequence 'ramp-and-kerb'",
        ),
        (
            {"task_sequence": "ramp-and-kerb", "motion": {"kind": "walk"}, "wearer": {}},
            "segment 1 (walk): distance is for a neuromuscular gait model",
        ),
        ({"gait": "falisse2019-subject1"}, "does not go with motion.kind = 'react' yet"),
        ({"wearer": {"name": "geyer-herr", "body_mass": "70 kg"}}, "unknown key 'wearer.body_mass'"),
        ({"wearer": {"name": "geyer-her"}}, "did you mean 'geyer-herr'"),
        ({"wearer": {"name": "geyer-herr", "device_on": "both"}}, "unknown key 'wearer.device_on'; allowed here: "),
        ({"run": {"step": "0.2 ms"}}, "at most 0.0001 s (largest step; 0.1 ms unless given)"),
    ],
)
def test_what_a_file_cannot_say_is_one_line(changes: dict[str, Any], words: str) -> None:
    content: dict[str, Any] = {
        "schema_version": 1,
        "name": "mine",
        "motion": {"kind": "react"},
        "wearer": {"name": "geyer-herr"},
        "device": {"set": "ppafo2011", "valve": "solenoid"},
        "controller": {"kind": "event_on_off"},
        **changes,
    }
    with pytest.raises(PpafoError) as caught:
        plan_walk(ppafo.scenario_from_dict(content))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_gait_of_an_option_is_refused_as_one_of_the_file_is() -> None:
    with pytest.raises(ScenarioError, match=r"gait 'falisse2019-subject1' does not go with motion.kind = 'react' yet"):
        load_walk(WALK, gait="falisse2019-subject1")


def test_what_needs_a_prescribed_gait_refuses_in_one_line() -> None:
    scenario, line = load_walk(WALK), "needs a prescribed gait, and motion.kind = 'react' has none"
    with pytest.raises(ScenarioError, match=line):
        walk_population(scenario, minutes=0.1, wearers=8)
    assert "lowest_toes is over the ground" in lacking(scenario, METRICS["toe_clearance"])
    assert "it needs a neuromuscular gait model (motion.kind = 'react')" in lacking(
        load_walk("solenoid"), METRICS["fall_time"]
    )
    with pytest.raises(DataError, match="a neuromuscular gait model walks on two legs"):
        opensim_recording(walk(load_walk(WALK, ["run.duration=6 s"])).recording)


def test_a_wearer_file_beside_the_walk_is_found(tmp_path: Path) -> None:
    shipped = Path(ppafo.__file__).parent
    text = (shipped / "wearer" / "files" / "geyer-herr.toml").read_text()
    (tmp_path / "me.toml").write_text(text.replace('"geyer-herr"', '"me"', 1))
    walked = (shipped / "walking" / "configurations" / "reacting.toml").read_text()
    (tmp_path / "mine.toml").write_text(walked.replace('"healthy-128"', '"me.toml"'))
    found = load_walk(tmp_path / "mine.toml")
    assert "me" in found.motion.label
