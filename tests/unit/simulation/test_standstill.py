"""A loop that does not move at all says so, and with what it would."""

import numpy as np

from ppafo.running import simulate
from ppafo.simulation.tracking.case import level_text

HELD = ["motion.kind=free", "motion.angle=75 deg", "reference.level=4 N m"]
"""Free joint that the torque task presses with 4 N m."""


def test_a_free_joint_that_friction_holds_for_the_whole_run_is_said_to_stand_still() -> None:
    held = simulate("torque-task-proportional", [*HELD, "friction.static_torque=20 N m"])
    assert np.ptp(held.recording["angle"]) == 0.0
    assert held.tracking.sentence.startswith("the torque follows its reference")
    unusual, said = sorted(held.warnings, reverse=True)
    assert unusual.startswith("unusual device")
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
