"""A loop that does not move at all says so, and with what it would."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.cli.main import main
from ppafo.loading import load_scenario
from ppafo.remedy_trials import tried
from ppafo.running import simulate
from ppafo.simulation.gains import remark_on_following_gains
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.tracking.remedies import level_text

SERVO = ("cylinder-servo", ("run.duration=1 s",))
STUCK = ("friction.static_torque=2 N m", "friction.dynamic_torque=1 N m")
LEARNS_NOTHING = ("controller.static_torque=0 N m", "controller.load_time=0 s", "controller.friction_torque=0 N m")


def servo(*overrides: str) -> Scenario:
    return load_scenario(SERVO[0], (*SERVO[1], *overrides))


def test_a_joint_that_friction_holds_is_named_with_a_stiffness_that_moves_it() -> None:
    weak = ("controller.angle_stiffness=4 N m/rad", *LEARNS_NOTHING)
    verdict = simulate(servo(*STUCK, *weak)).tracking
    assert verdict is not None
    assert verdict.moved == 0.0
    assert verdict.sentence.startswith("the angle loop does not move: 0 of the requested 10 deg; static friction holds")
    assert "with 2 N m, but the controller requests only" in verdict.sentence
    mended = tried(servo(*STUCK, *weak), verdict)
    assert mended is not None
    assert re.match(r"controller.angle_stiffness=\S+ N m/rad", mended.mended[0])


def test_loops_that_move_and_those_that_want_nothing_are_left_alone() -> None:
    assert simulate(servo()).tracking is None
    still = servo("reference.amplitude=0 deg", "reference.level=70 deg", "motion.angle=70 deg")
    assert simulate(still).tracking is None
    assert simulate("step-response").tracking is None


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        (("controller.proportional_gain=0 1/Pa", "controller.integral_gain=0 1/(Pa s)"), "the command stays 0"),
        (
            (
                "controller.proportional_gain=1e-8 1/Pa",
                "controller.integral_gain=0 1/(Pa s)",
                "valve.dead_band=0.05",
            ),
            "opens the valve beyond `valve.dead_band = 0.05`; to try, the more promising one first: overrides=[",
        ),
    ],
    ids=["no gain", "dead band"],
)
def test_a_pressure_that_stays_where_it_is_is_named_with_what_keeps_it(overrides: tuple[str, ...], said: str) -> None:
    verdict = simulate(load_scenario("pressure-loop", (*overrides, "actuator.leak.area=0 mm^2"))).tracking
    assert verdict is not None
    assert said in verdict.sentence


def test_simulate_says_it_before_the_gains_and_a_check_ends_with_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [
        word for text in (*STUCK, *LEARNS_NOTHING, "controller.angle_stiffness=4 N m/rad") for word in ("--set", text)
    ]
    folder = ["--set", "run.duration=0.5 s", "--out", str(tmp_path / "out")]
    assert main(["simulate", "cylinder-servo", *given, *folder, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)["tracking"]["sentence"]
    assert main(["simulate", "cylinder-servo", *given, *folder, "--check"]) == 1
    assert capsys.readouterr().out.splitlines()[1] == said


HELD = ["motion.kind=free", "motion.angle=75 deg", "reference.level=4 N m"]
"""Free joint that the torque task presses with 4 N m."""


def test_a_free_joint_that_friction_holds_for_the_whole_run_is_said_to_stand_still() -> None:
    held = simulate("torque-task-proportional", [*HELD, "friction.static_torque=20 N m"])
    assert np.ptp(held.recording["angle"]) == 0.0
    assert held.following.startswith("the torque follows its reference")
    (said,) = held.warnings
    # The largest torque of the run, which is above the reference of 4 N m.
    most = level_text("N m", held.metrics["peak_torque"].value)
    holds = (
        f"the joint does not move: static friction of 20 N m exceeds the largest torque of actuator and load, {most}"
    )
    assert said.startswith(f"{holds}; not tried: reduce ")
    # As advised: a locked joint is meant to stand still, and one with less friction moves.
    assert not simulate("torque-task-proportional", ["reference.level=4 N m"]).warnings
    free = simulate("torque-task-proportional", [*HELD, "friction.static_torque=1 N m"])
    assert np.ptp(free.recording["angle"]) > 0.01
    assert "does not move" not in " ".join(free.warnings)


def test_friction_is_not_to_be_reduced_where_nothing_turns_the_joint_or_the_reference_is_beyond_reach() -> None:
    friction = "friction.static_torque=20 N m"
    shut = simulate("torque-task-proportional", [*HELD, friction, "controller.kind=constant", "controller.command=0"])
    assert shut.recording["torque"].max() == 0.0
    assert "does not move" not in " ".join(shut.warnings)
    # The paper's actuator gives 5 N m; the reference, not the friction, is at fault.
    beyond = simulate("torque-task-proportional", [*HELD[:-1], friction, "reference.level=9 N m"])
    (still,) = [said for said in beyond.warnings if "does not move" in said]
    assert still.endswith("static friction of 20 N m exceeds the largest torque of actuator and load, 5 N m")
    assert any("actuator gives at most 5 N m" in said for said in beyond.warnings)


def test_a_search_says_of_the_value_that_it_found_that_the_joint_stands_still_and_that_gains_follow_it() -> None:
    base = load_scenario("torque-task-proportional", HELD)
    found = ppafo.find(base, vary="friction.static_torque=10..20 N m", such_that="follows", highest=True, grid=3)
    assert found.found.value == pytest.approx(20.0)
    (at,) = [said for said in found.found.remarks if said.startswith("at 20 N m ")]
    assert "; the joint does not move: static friction of 20 N m exceeds " in at
    # The law of the torque knows nothing of the friction; the cascade of an angle does.
    assert "recomputed" not in str(found)
    learns = ppafo.find(
        servo(), vary="friction.static_torque=0.5..1 N m", such_that="peak_torque <= 100 N m", highest=True, grid=3
    )
    remark = remark_on_following_gains(servo(), ["friction.static_torque"])
    assert "static_torque" in remark
    assert remark in learns.found.remarks
    assert remark in str(learns)
