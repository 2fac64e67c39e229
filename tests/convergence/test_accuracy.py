"""The lanes at steps of 1 ms against the reference solver: the limits that the package promises."""

import dataclasses
from collections.abc import Callable

import pytest

from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario
from tests.convergence.draws import random_scenario
from tests.reference.reference_solver import Agreement, compare_with_reference

LARGEST_ANGLE = 2.0e-4
LARGEST_PRESSURE = 1.0e-3
LARGEST_RMS = 1.0e-4
SEEDS = range(25)


def assert_within_limits(agreement: Agreement, what: str) -> None:
    assert agreement.angle <= LARGEST_ANGLE, (what, agreement)
    assert agreement.worst_pressure <= LARGEST_PRESSURE, (what, agreement)
    assert agreement.worst_rms <= LARGEST_RMS, (what, agreement)


def test_step_response_is_within_the_limits(step_response: Scenario) -> None:
    agreement = compare_with_reference(plan_run(step_response))
    assert agreement.impacts, "the vane must reach its stop"
    assert_within_limits(agreement, "step response")


@pytest.mark.parametrize("valve", ["proportional", "solenoid"])
def test_torque_task_is_within_the_limits(torque_task: Callable[[str], Scenario], valve: str) -> None:
    assert_within_limits(compare_with_reference(plan_run(torque_task(valve))), valve)


def test_valve_open_by_a_tenth_is_within_the_limits(step_response: Scenario) -> None:
    control = dataclasses.replace(step_response.controller, settings={"command": 0.1})
    scenario = dataclasses.replace(
        step_response, controller=control, run=dataclasses.replace(step_response.run, duration=3.0)
    )
    assert_within_limits(compare_with_reference(plan_run(scenario)), "10 % opening")


@pytest.mark.parametrize("name", ["step-response", "torque-task-proportional"])
def test_dead_volume_of_one_cubic_centimetre_is_within_the_limits(name: str) -> None:
    overrides = ("actuator.dead_volume_1=1cm^3", "actuator.dead_volume_2=1cm^3")
    assert_within_limits(compare_with_reference(plan_run(load_scenario(name, overrides))), name)


@pytest.mark.parametrize(
    ("interval", "opening", "closing", "rate"),
    [
        ("50.2 ms", "0.2 ms", "0.5 ms", "20 Hz"),
        ("50.1 ms", "0.1 ms", "0.8 ms", "20 Hz"),
        ("0.3 ms", "0.2 ms", "0.5 ms", "100 Hz"),
    ],
)
def test_several_switchings_inside_one_step_are_within_the_limits(
    interval: str, opening: str, closing: str, rate: str
) -> None:
    delays = [f"valve.opening_delay={opening}", f"valve.closing_delay={closing}"]
    overrides = [*delays, f"valve.switching_interval={interval}", f"controller.rate={rate}"]
    agreement = compare_with_reference(plan_run(load_scenario("torque-task-solenoid", overrides)))
    assert_within_limits(agreement, f"{interval} {opening} {closing} {rate}")


def test_random_devices_are_within_the_limits() -> None:
    for seed in SEEDS:
        assert_within_limits(compare_with_reference(plan_run(random_scenario(seed))), f"seed {seed}")
