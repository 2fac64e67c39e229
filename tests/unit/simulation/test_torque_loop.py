"""Gains that nobody gives follow the device: the rule itself, and every door through which a setting comes."""

import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from ppafo.control.torque_loop import TorqueLoop, proportional_gain
from ppafo.loading import load_scenario
from ppafo.parameters.plant import plant_parameters
from ppafo.parameters.reach import torque_reach
from ppafo.running import simulate
from ppafo.simulation.gains import gains_of
from ppafo.simulation.numbers import moving_together, with_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.walking import load_walk

SMALL_AIR = (
    *("gas.species=air", "actuator.torque_constant=9 cm^3", "actuator.displacement_per_radian=9 cm^3/rad"),
    *("actuator.dead_volume_1=4 cm^3", "actuator.dead_volume_2=6 cm^3", "supply.pressure=80 psi_g"),
    *("supply.dorsiflexion_pressure=30 psi_g", "valve.delay=7 ms"),
)
LAWS = {
    "event_proportional": "torque_gain",
    "pid": "proportional_gain",
    "pid_feedforward": "proportional_gain",
    "damped_proportional": "proportional_gain",
}


def by_hand(scenario: Scenario) -> TorqueLoop:
    """R [N m/s] and theta [s] of a vane with a proportional valve, from the words of the rule."""
    actuator, plant = scenario.device.actuator, plant_parameters(scenario.device)
    flow = plant.valve_conductance * plant.gas_product
    volume_1 = actuator.dead_volume_1 + actuator.displacement_per_radian * (0.5 * math.pi - actuator.angle_min)
    volume_2 = actuator.dead_volume_2 + actuator.displacement_per_radian * (actuator.angle_max - 0.5 * math.pi)
    rate = (
        actuator.torque_constant * flow * max(plant.supply_pressure / volume_1, plant.dorsiflexion_pressure / volume_2)
    )
    theta = scenario.device.valve.settings["delay"] + 1.5 * scenario.controller.period
    return TorqueLoop(rate, theta, rate)


@pytest.mark.parametrize("changes", [(), SMALL_AIR], ids=["paper", "small, air"])
@pytest.mark.parametrize("law", LAWS)
def test_every_torque_law_has_half_the_gain_at_which_the_dead_time_moves_it_by_what_it_sees(
    law: str, changes: tuple[str, ...]
) -> None:
    walked = load_walk("proportional", [f"controller.kind={law}", *changes])
    loop = by_hand(walked)
    assert getattr(walked.controller, LAWS[law]) == pytest.approx(0.5 / (loop.rate * loop.dead_time), rel=1e-9)


def test_the_other_words_for_the_same_bandwidth() -> None:
    sliding = load_walk("proportional", ["controller.kind=sliding_mode", *SMALL_AIR])
    rate, theta, *_ = by_hand(sliding)
    assert (sliding.controller.reaching_command, sliding.controller.boundary_layer) == pytest.approx(
        (1.0, 2.0 * rate * theta)
    )
    assert sliding.controller.surface_slope == pytest.approx(0.125 / theta)
    inverted = load_walk("proportional", ["controller.kind=feedback_linearisation", *SMALL_AIR])
    assert inverted.controller.convergence_rate == pytest.approx(0.5 / theta)
    zone = load_walk("proportional", ["controller.kind=on_off_dead_zone", "valve.dead_band=0.1", *SMALL_AIR])
    assert zone.controller.opening == pytest.approx(0.1 + 0.9 * min(0.77, zone.controller.dead_zone / (rate * theta)))
    assert load_walk("proportional", ["controller.kind=on_off_dead_zone"]).controller.opening == 0.77


def test_a_dead_zone_that_nobody_gives_is_a_share_of_what_the_device_reaches() -> None:
    zone = "controller.kind=on_off_dead_zone"
    paper = load_scenario("torque-task-solenoid", [zone])
    weak = with_numbers(paper, {"supply.pressure": 3.0e5, "supply.dorsiflexion_pressure": 2.0e5})
    for scenario in (paper, weak):
        _, reach = torque_reach(scenario.device, 1.3)
        zones = scenario.controller.dead_zone, scenario.controller.release
        assert zones == pytest.approx((0.042 * reach, 0.0062 * reach), rel=1e-9)
    assert paper.controller.dead_zone == pytest.approx(0.21, rel=1e-3)
    other = paper.device.supply.dorsiflexion_pressure
    turned = with_numbers(paper, {"supply.pressure": 1.5e5, "supply.dorsiflexion_pressure": other})
    assert turned.controller.dead_zone == paper.controller.dead_zone, "chamber 2 reaches as far as before"
    pressure = load_scenario("pressure-loop", [zone])
    supply = pressure.device.supply
    assert pressure.controller.dead_zone == pytest.approx(0.042 * (supply.pressure - supply.atmospheric_pressure))
    given = load_scenario("torque-task-solenoid", [zone, "controller.dead_zone=0.4 N m", "supply.pressure=70 psi_g"])
    assert given.controller.dead_zone == 0.4


def test_a_walk_asks_for_no_more_torque_than_its_device_reaches() -> None:
    """The paper's walks state 5 N m; one that does not has what its own actuator gives."""
    pair = ("controller.kind=event_on_off", "device.valve=solenoid")
    cylinder = ("controller.kind=pid", "device.valve=proportional", "device.set=cylinder-lever")
    for changes in (pair, (*pair, *SMALL_AIR[:-1]), cylinder):
        mine = load_walk("off", changes)
        _, reach = torque_reach(mine.device, 0.5 * math.pi)
        assert mine.controller.settings["largest_torque"] == pytest.approx(reach, rel=1e-6)
    assert {load_walk(name).controller.settings["largest_torque"] for name in ("proportional", "solenoid")} == {5.0}


def test_a_gain_is_the_same_through_every_door() -> None:
    walk = load_walk("proportional", ["controller.kind=pid"])
    small = load_walk("proportional", ["controller.kind=pid", "valve.delay=5 ms", "supply.pressure=70 psi_g"])
    pressure, delay = small.device.supply.pressure, 5.0e-3
    given = {"valve.delay": delay, "supply.pressure": pressure}
    moved = with_numbers(walk, given)
    assert moved.controller.proportional_gain == small.controller.proportional_gain
    assert moved.controller.integral_gain == small.controller.integral_gain
    columns = moving_together(walk, {"valve.delay": np.array([0.0, delay]), "supply.pressure": np.full(2, pressure)})
    assert columns["controller.proportional_gain"][1] == small.controller.proportional_gain
    assert columns["controller.proportional_gain"][0] > columns["controller.proportional_gain"][1]


def test_a_gain_that_is_given_stays_and_its_integral_goes_with_it() -> None:
    walk = load_walk("proportional", ["controller.kind=pid", "controller.proportional_gain=0.5"])
    slow = with_numbers(walk, {"valve.delay": 5.0e-3})
    assert slow.controller.proportional_gain == walk.controller.proportional_gain == 0.5
    assert walk.controller.integral_gain == pytest.approx(0.5 / (8.0 * 1.5e-3))
    assert slow.controller.integral_gain == pytest.approx(0.5 / (8.0 * 6.5e-3))


def test_late_sensors_are_dead_time_too() -> None:
    late = load_walk("proportional", ["controller.kind=pid", "sensors.pressure_bandwidth=100 Hz"])
    at_once = load_walk("proportional", ["controller.kind=pid"])
    lag = 1.0 / (2.0 * math.pi * 100.0)
    ratio = at_once.controller.proportional_gain / late.controller.proportional_gain
    assert ratio == pytest.approx((1.5e-3 + lag) / 1.5e-3)


def test_no_flow_leaves_a_gain_that_is_finite() -> None:
    assert proportional_gain(TorqueLoop(0.0, 1.5e-3, 0.0)) == 5.0e5


@pytest.mark.parametrize("file", ["torque-task-cylinder.toml", "torque-task-measured-bladder.toml"])
def test_another_actuator_has_gains_of_its_own_and_follows_its_torque(file: str, tmp_path: Path) -> None:
    path = Path(shutil.copytree("tests/actuators", tmp_path / "actuators")) / file
    given = ("proportional_gain", "integral_gain", "derivative_gain", '"controller.')
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(line for line in lines if not line.startswith(given)), encoding="utf-8")
    task = load_scenario(str(path))
    result = simulate(task)
    assert result.metrics["final_error"].value < 0.02
    assert np.abs(np.diff(result.recording["command"][-500:])).max() < 0.5


TABLE_OF_ANGLES = ("level=70 deg", "period=1 s", "value_01=-45 deg", "time_02=0.5 s", "value_02=10 deg")
SINE_OF_ANGLES = ("level=52.5 deg", "amplitude=27.5 deg")
RAMP_OF_ANGLES = ("start_level=80 deg", "level=25 deg")


@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        ("sine", SINE_OF_ANGLES),
        ("ramp_hold", RAMP_OF_ANGLES),
        ("tabulated", TABLE_OF_ANGLES),
        ("smooth", TABLE_OF_ANGLES),
    ],
)
def test_gains_of_a_torque_on_a_moving_joint_are_those_of_the_worst_place_of_its_way(
    kind: str, settings: tuple[str, ...]
) -> None:
    law = "controller.kind=sliding_mode"
    profile = (f"motion.profile.{text}" for text in (f"kind={kind}", *settings))
    moving = load_scenario("torque-task-proportional", [law, "motion.kind=prescribed", *profile])
    ends = [
        load_scenario("torque-task-proportional", [law, f"motion.angle={angle} deg"]).controller.boundary_layer
        for angle in (25.0, 80.0)
    ]
    assert ends[0] > 1.2 * ends[1]
    assert moving.controller.boundary_layer == pytest.approx(ends[0], rel=1e-9)
    higher = with_numbers(moving, {"motion.profile.level": float(moving.motion.profile.level) + 0.1})
    assert higher.controller.boundary_layer < ends[0], "it follows what moves the joint"


@pytest.mark.parametrize("kind", ["tabulated", "smooth"])
def test_gains_of_an_angle_on_a_table_are_those_of_a_ramp_between_its_ends(kind: str) -> None:
    table, ramp = (
        load_scenario("cylinder-servo", [f"reference.{text}" for text in (f"kind={kind}", *settings)]).controller
        for kind, settings in ((kind, TABLE_OF_ANGLES), ("ramp_hold", RAMP_OF_ANGLES))
    )
    assert table.settings == pytest.approx(ramp.settings)
    assert table.settings != load_scenario("cylinder-servo").controller.settings


def test_gains_say_that_they_do_not_know_a_load_which_may_move_the_joint() -> None:
    load = ("controller.kind=sliding_mode", "effects.joint_load.stiffness=2 N m/rad")
    free = load_scenario("torque-task-proportional", [*load, "motion.kind=free", "motion.angle=75 deg"])
    locked, worn = load_scenario("torque-task-proportional", load), load_walk("proportional", load[1:])
    said = [gains_of(item) for item in (free, locked, worn)]
    assert [gains is not None and gains.unknown_loads for gains in said] == [
        ("effects.joint_load",),
        (),
        ("effects.joint_load",),
    ]
