"""A loop that does not move at all says so, and with what it would."""

import numpy as np
import pytest

from ppafo.loading import load_scenario
from ppafo.running import simulate
from ppafo.simulation.tracking.remedies import level_text


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
    assert verdict.fails
    assert said in verdict.sentence


HELD = ["motion.kind=free", "motion.angle=75 deg", "reference.level=4 N m"]
"""Free joint that the torque task presses with 4 N m."""


def test_a_free_joint_that_friction_holds_for_the_whole_run_is_said_to_stand_still() -> None:
    held = simulate("torque-task-proportional", [*HELD, "friction.static_torque=20 N m"])
    assert np.ptp(held.recording["angle"]) == 0.0
    assert held.tracking.sentence.startswith("the torque follows its reference")
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
