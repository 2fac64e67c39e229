"""The next experiment: what is drawn, what is chosen, what is promised, and what comes out as files."""

import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.errors import DataError
from ppafo.identification.problem import load_problem
from ppafo.identification.trajectory.next_experiment import (
    NextExperiments,
    Promise,
    Proposal,
    draw_proposals,
    harmful_sizes,
    promised_by,
)
from ppafo.identification.trajectory.tolerances import Ability, tolerances_of
from ppafo.questions.identify.plan import (
    Plan,
    PlantedDevice,
    bench_file,
    plan_figure,
    plan_section,
    planted_device,
    rig_requests,
)
from ppafo.questions.identify.solve import identify
from ppafo.rig.experiments import record, write_rig_recording
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import FreeMotion

CAN = Ability(
    supply_pressure=(2.5e5, 6.0e5),
    load=(-2.0, 2.0),
    command=(-0.8, 0.8),
    torque=(0.5, 3.0),
    frequency=(0.5, 5.0),
    angle=(math.radians(40.0), math.radians(100.0)),
    duration=(0.2, 0.4),
    interval=1.0e-3,
)


def test_every_proposal_is_a_scenario_within_what_the_bench_can_do() -> None:
    proposals = draw_proposals(CAN, 30, np.random.default_rng(3))
    for one in proposals:
        scenario = load_scenario(one.scenario, one.overrides)
        assert isinstance(scenario.motion, FreeMotion)
        assert 2.4999e5 <= scenario.device.supply.pressure <= 6.0001e5
        assert 2.4999e5 <= scenario.device.supply.dorsiflexion_pressure <= 6.0001e5
        assert abs(scenario.motion.external_torque) <= 2.0
        assert math.radians(39.9) <= scenario.motion.angle <= math.radians(100.1)
        assert 0.1999 <= scenario.duration <= 0.4001
        assert one.follows_command == (scenario.control.kind == "pid")
    assert {one.scenario for one in proposals} == {"step-response", "torque-task-proportional"}


def test_without_a_torque_controller_the_command_is_constant() -> None:
    proposals = draw_proposals(dataclass_without_torque(), 10, np.random.default_rng(3))
    assert {one.scenario for one in proposals} == {"step-response"}


def dataclass_without_torque() -> Ability:
    return Ability(**{name: getattr(CAN, name) for name in Ability.__dataclass_fields__} | {"torque": None})


PLAN = Plan(
    NextExperiments(
        (
            Proposal("next-1", "step-response", ("motion.kind=free", "controller.command=0.3"), follows_command=False),
            Proposal("next-2", "torque-task-proportional", ("motion.kind=free",), follows_command=True),
        ),
        (Promise("foot_plate.inertia", "", 0.05, 0.001, 0.002),),
        (Promise("spool_play", "0.5 %", 0.0, 30.0, 12.0),),
        20,
        3,
    ),
    "problem.toml",
    "fitted.toml",
    None,
    "1 kHz",
)


def test_the_bench_file_is_the_end_of_a_problem() -> None:
    found = tomllib.loads(bench_file(PLAN))["trajectory"]["experiments"]
    assert [one["recording"] for one in found] == ["next-1/step-response.csv", "next-2/torque-task.csv"]
    assert found[0]["overrides"] == ["motion.kind=free", "controller.command=0.3"]
    assert [one.get("inputs") for one in found] == [None, ["command"]]


def test_the_rig_records_on_the_device_of_earlier_recordings_and_else_on_the_set_beside_the_requests(
    tmp_path: Path,
) -> None:
    """All recordings of a problem are of one device, as far as the rig knows it."""
    assert '--device "$(dirname "$0")/fitted.toml"' in rig_requests(PLAN)
    changes = ("motion.kind=free", "run.duration=0.1 s", "foot_plate.inertia=10 g m^2")
    write_rig_recording(tmp_path / "there", record("step-response", "ideal-laboratory", 1, overrides=changes))
    recording = tmp_path / "there" / "step-response.csv"
    planted = planted_device([recording])
    assert planted == PlantedDevice("ppafo2011", ("foot_plate.inertia=10 g m^2",))
    first = rig_requests(replace(PLAN, planted=planted)).splitlines()[3]
    assert "--device ppafo2011 " in first
    assert '--set "foot_plate.inertia=10 g m^2"' in first
    (tmp_path / "measured.csv").write_text("time [s],angle [rad]\n")
    assert planted_device([recording, tmp_path / "measured.csv"]) is None
    notes = tmp_path / "there" / "rig.json"
    for damaged in ("null", "[1]", '{"format": "another"}'):
        notes.write_text(damaged)
        assert planted_device([recording]) is None
    for damaged in ("[]", '{"step-response.csv": 3}', '{"step-response.csv": {"overrides": []}}'):
        notes.write_text(f'{{"format": "ppafo rig", "recordings": {damaged}}}')
        with pytest.raises(DataError, match=r"does not state how 'step-response\.csv' was recorded"):
            planted_device([recording])


def test_the_section_and_the_figure_show_now_chosen_and_at_random() -> None:
    table = plan_section(PLAN).table
    assert table is not None
    assert table.rows[0] == ("foot_plate.inertia", "5 %", "0.1 %", "0.2 %")
    assert table.rows[1] == ("play of the spool, 0.5 %", "0.0 SE", "30.0 SE", "12.0 SE")
    left, right = plan_figure(PLAN).axes
    assert [line.get_label() for line in left.lines] == ["now", "three at random", "chosen"]
    assert right.get_yticklabels()[0].get_text() == "play of the spool"


PROBLEM = """schema_version = 1
name = "fitted"
device.set = "ppafo2011"
[[trajectory.parameters]]
path = "foot_plate.inertia"
[[trajectory.parameters]]
path = "friction.static_torque"
[[trajectory.experiments]]
label = "there"
recording = "there/step-response.csv"
scenario = "step-response"
overrides = ["motion.kind=free", "run.duration=0.3 s"]
"""
BENCH = """[bench]
supply = "1 psi_d"
[bench.can]
supply_pressure = ["20 psi_g", "80 psi_g"]
load = ["-2 N m", "2 N m"]
torque = ["0.5 N m", "4 N m"]
angle = ["40 deg", "110 deg"]
duration = ["0.3 s", "0.4 s"]
candidates = 16
"""


def test_next_needs_to_know_what_the_bench_can_do(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "problem.toml").write_text(PROBLEM)
    assert main(["identify", str(tmp_path / "problem.toml"), "--next"]) == 2
    assert capsys.readouterr().err == (
        "ppafo: problem.toml: --next needs a table [bench.can], which says what the bench can do\n"
    )


@pytest.mark.long
@pytest.mark.thorough
def test_play_that_a_step_cannot_show_is_promised_to_show_and_the_rig_records_what_was_chosen(tmp_path: Path) -> None:
    (tmp_path / "problem.toml").write_text(PROBLEM + BENCH)
    device = ("motion.kind=free",)
    write_rig_recording(
        tmp_path / "there", record("step-response", "ideal-laboratory", 1, overrides=(*device, "run.duration=0.3 s"))
    )
    found = identify(tmp_path / "problem.toml", following=1)
    assert found.trajectory is not None
    assert "play of the spool: invisible in these recordings" in found.trajectory.unseen
    plan = found.plan
    assert plan is not None
    (chosen,) = plan.following.chosen
    play = next(one for one in plan.following.visibility if one.name == "spool_play")
    assert play.now < 0.1
    assert play.after > 3.0
    for width in plan.following.widths:
        assert width.after < 0.5 * width.now
    # The same experiment promises the same where it is given and not drawn.
    bench = load_problem(tmp_path / "problem.toml").bench
    assert bench is not None
    again = promised_by(
        found.trajectory.fit,
        tolerances_of(bench, "problem.toml"),
        plan.following.chosen,
        harmful_sizes(found.trajectory.fit),
        load_scenario,
    )
    assert again is not None
    assert again[0] == pytest.approx([one.after for one in plan.following.widths], rel=0.02)
    # The request to the rig and the bench file are ready: record, append, fit.
    line = rig_requests(plan).splitlines()[-1]
    changes = tuple(re.findall(r'--set "([^"]*)"', line))
    made = record(chosen.rig_experiment, "ideal-laboratory", 1, overrides=changes)
    assert made.recording.kind == "synthetic"
    write_rig_recording(tmp_path / chosen.label, made)
    (tmp_path / "second.toml").write_text(PROBLEM + bench_file(plan) + BENCH)
    assert len(load_problem(tmp_path / "second.toml").trajectory.experiments) == 2  # type: ignore[union-attr]
    second = identify(tmp_path / "second.toml")
    for before, after, width in zip(found.estimates[:2], second.estimates[:2], plan.following.widths, strict=True):
        assert after.half_width < before.half_width
        # The promise takes every effect for unknown, the fit takes none.
        assert after.relative_half_width < 1.3 * width.after
        truth = {"foot_plate.inertia": 0.0084, "friction.static_torque": 0.45}[after.path]
        assert abs(after.value - truth) < 2.0 * after.half_width
    assert second.trajectory is not None
    assert second.trajectory.fit.misfit == ""
    # With play on the bench the same recording names it.
    play = "rig.valve.hysteresis=0.01"
    write_rig_recording(
        tmp_path / chosen.label, record(chosen.rig_experiment, "ideal-laboratory", 1, overrides=(*changes, play))
    )
    third = identify(tmp_path / "second.toml")
    assert third.trajectory is not None
    assert third.trajectory.fit.misfit.startswith("the spool seems to have a play of")
