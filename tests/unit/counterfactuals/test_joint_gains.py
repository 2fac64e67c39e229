"""Default gains on devices that differ from the believed one, and all gains chosen together."""

import numpy as np

from ppafo import load_scenario, simulate
from ppafo.counterfactuals.joint_gains import joint_gains
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.numbers import number_at

RAISED = [
    "motion.external_torque=1.5 N m",
    "motion.angle=60 deg",
    "reference.kind=ramp_hold",
    "reference.start_level=60 deg",
    "reference.level=90 deg",
    "reference.ramp_time=0.3 s",
]
"""A weight of a quarter of the torque, lifted from empty chambers."""
DEVICES = {
    "foot_plate.inertia": [1.0, 0.7, 1.5, 1.0, 1.0, 1.0],
    "supply.pressure": [1.0, 1.0, 1.0, 0.93, 1.0, 1.0],
    "friction.dynamic_torque": [1.0, 1.0, 1.0, 1.0, 0.7, 1.4],
    "friction.static_torque": [1.0, 1.0, 1.0, 1.0, 1.0, 1.4],
}


def test_default_gains_lift_a_weight_from_empty_chambers_with_a_device_that_is_not_the_believed_one() -> None:
    scenario = load_scenario("cylinder-servo", [*RAISED, "reference.ramp_start=1 s"])
    known = {path: np.full(6, number_at(scenario, path)) for path in scenario.links if path.startswith("controller.")}
    columns = {path: number_at(scenario, path) * np.array(sizes) for path, sizes in DEVICES.items()}
    result = run_ensemble(scenario, {**known, **columns}, (), ["angle"], every=0.01)
    at_rest = np.rad2deg(result.traces["angle"][result.times > 2.0])
    assert np.abs(at_rest - 90.0).max() < 1.0
    assert np.ptp(at_rest, axis=0).max() < 1.0


def test_gains_chosen_together_follow_where_the_default_ones_do_not() -> None:
    late = [*RAISED, "reference.ramp_start=0.3 s", "valve.delay=10 ms", "sensors.delay=0 s"]
    scenario = load_scenario("cylinder-servo", late)
    assert not simulate(scenario).tracking.follows
    together = joint_gains(scenario)
    assert together is not None
    change, excess = together
    assert excess <= 1.0
    assert sorted(change.numbers) == [
        f"controller.{name}" for name in ("angle_damping", "angle_stiffness", "load_time", "torque_gain")
    ]
    again = simulate("cylinder-servo", [*late, *(f"{path}={number} SI" for path, number in change.numbers.items())])
    assert again.tracking.follows


def test_only_the_searched_gains_are_chosen_and_a_law_without_gains_has_none() -> None:
    scenario = load_scenario("cylinder-servo")
    together = joint_gains(scenario, ["controller.torque_gain"])
    assert together is not None
    change, excess = together
    assert sorted(change.numbers) == ["controller.torque_gain"]
    assert excess <= 1.0
    assert joint_gains(load_scenario("torque-task-solenoid", ["controller.kind=on_off"])) is None
