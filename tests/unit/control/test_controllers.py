"""Each law does what its source says: closed forms, limiting cases, and short runs on the engine."""

from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.controllers.damped_proportional import KNOTS, learnt_command
from ppafo.control.controllers.on_off_dead_zone import OnOffDeadZoneParameters, OnOffDeadZoneState
from ppafo.control.controllers.sliding_mode import SlidingModeParameters, SlidingModeState
from ppafo.engine.rows import rebuilt
from ppafo.model.sensors import Measurement

PERIOD = 1.0e-3
WITHIN_REACH = ["reference.level=4 N m", "controller.rate=1 kHz"]


def seen(torque: float) -> Measurement:
    """A measurement with a torque [N m]."""
    return Measurement(1.309, 1.01325e5 + max(torque, 0.0) / 1.451e-5, 1.01325e5 + max(-torque, 0.0) / 1.451e-5, torque)


def parameters(kind: str, **changed: float) -> Any:
    """Parameters of a controller at their defaults, some of them changed."""
    chosen = CONTROLLERS[kind]
    settings = {item.name: item.default for item in chosen.quantities} | changed
    return rebuilt(chosen.parameters, settings.values())


def commands(kind: str, torques: list[float], reference: float = 2.0, **changed: float) -> list[float]:
    """Commands of a controller that sees these torques [N m], one a millisecond."""
    chosen, state, given = CONTROLLERS[kind], CONTROLLERS[kind].initial, []
    for torque in torques:
        command, state = chosen.update(parameters(kind, **changed), state, reference, seen(torque), PERIOD)
        given.append(command)
    return given


def test_without_a_dead_zone_it_is_the_on_off_rule() -> None:
    torques = [0.0, 1.9, 2.1, 5.0, 1.0, -3.0]
    assert commands("on_off_dead_zone", torques, dead_zone=0.0, release=0.0, opening=1.0) == commands("on_off", torques)


def test_a_valve_that_is_open_closes_at_the_release_and_not_at_the_dead_zone() -> None:
    chosen = OnOffDeadZoneParameters(0.3, 0.1, 0.5)
    update = CONTROLLERS["on_off_dead_zone"].update
    closed, opened = OnOffDeadZoneState(0.0), OnOffDeadZoneState(1.0)
    assert update(chosen, closed, 2.0, seen(1.8), PERIOD) == (0.0, closed)
    assert update(chosen, opened, 2.0, seen(1.8), PERIOD) == (0.5, opened)
    assert update(chosen, opened, 2.0, seen(1.95), PERIOD) == (0.0, closed)
    assert update(chosen, opened, 2.0, seen(2.4), PERIOD) == (-0.5, OnOffDeadZoneState(-1.0))


def test_a_release_above_the_dead_zone_is_none() -> None:
    torques = [0.0, 1.75, 1.5, 2.25, 2.5]
    wide = commands("on_off_dead_zone", torques, dead_zone=0.2, release=9.0)
    assert wide == commands("on_off_dead_zone", torques, dead_zone=0.2, release=0.2)


def test_a_thin_boundary_layer_is_a_switch_and_a_wide_one_is_proportional() -> None:
    torques = [0.0, 1.9, 2.1, 5.0]
    thin = commands("sliding_mode", torques, surface_slope=0.0, boundary_layer=1e-6, reaching_command=1.0)
    assert thin == [1.0, 1.0, -1.0, -1.0]
    wide = commands("sliding_mode", torques, surface_slope=0.0, boundary_layer=10.0, reaching_command=0.8)
    assert wide == pytest.approx([0.8 * (2.0 - torque) / 10.0 for torque in torques])


def test_the_integral_of_the_sliding_surface_stands_still_outside_the_layer() -> None:
    update = CONTROLLERS["sliding_mode"].update
    chosen = SlidingModeParameters(5.0, 0.5, 1.0)
    assert update(chosen, SlidingModeState(0.01), 2.0, seen(0.0), PERIOD) == (1.0, SlidingModeState(0.01))
    command, state = update(chosen, SlidingModeState(0.01), 2.0, seen(1.9), PERIOD)
    assert state.integral == pytest.approx(0.01 + 0.1 * PERIOD)
    assert command == pytest.approx((0.1 + 5.0 * state.integral) / 0.5)


def test_damping_works_against_the_torque_s_own_rate_and_gives_no_kick_at_a_step_of_the_reference() -> None:
    gains = {"proportional_gain": 0.1, "damping": 0.01, "damping_filter": 0.0}
    rising = commands("damped_proportional", [1.0, 1.1], **gains)
    assert rising == pytest.approx([0.1, 0.1 * 0.9 - 0.01 * 0.1 / PERIOD])
    still = CONTROLLERS["damped_proportional"]
    _, state = still.update(parameters("damped_proportional", **gains), still.initial, 0.0, seen(1.0), PERIOD)
    command, _ = still.update(parameters("damped_proportional", **gains), state, 3.0, seen(1.0), PERIOD)
    assert command == pytest.approx(0.1 * 2.0)


def test_the_learnt_table_is_straight_between_its_knots_and_holds_the_last_one() -> None:
    table = {f"knot_{number}": 0.01 * number * number for number in range(KNOTS)}
    chosen = parameters("damped_proportional", knot_spacing=0.1, **table)
    times = np.array([0.0, 0.05, 0.1, 1.234, 2.999, 3.0, 7.0])
    expected = np.interp(times, 0.1 * np.arange(KNOTS), list(table.values()))
    assert [learnt_command(chosen, float(time)) for time in times] == pytest.approx(expected)


def test_without_its_feedforward_it_is_the_pid_of_the_catalogue() -> None:
    torques = [0.0, 0.5, 1.5, 2.5, 8.0, -30.0]
    gains = {"proportional_gain": 0.3, "integral_gain": 4.0, "derivative_gain": 1e-3, "derivative_filter": 2e-3}
    gains |= {"anti_windup": 5.0}
    assert commands("pid_feedforward", torques, feedforward=0.0, **gains) == commands("pid", torques, **gains)


def test_the_feedforward_alone_nearly_follows_the_ramp() -> None:
    none = ["proportional_gain=0 1/(N m)", "integral_gain=0 1/(N m s)", "derivative_gain=0 s/(N m)"]
    task = [*WITHIN_REACH, "controller.kind=pid_feedforward", *(f"controller.{gain}" for gain in none)]
    with_it, without = (
        ppafo.simulate("torque-task-proportional", [*task, "run.duration=1 s", f"controller.feedforward={weight}"])
        for weight in (1, 0)
    )
    assert with_it.metrics["rms_error"].value < 0.1 * without.metrics["rms_error"].value


@pytest.mark.parametrize("rate", [10.0, 40.0])
def test_an_inverted_chamber_lets_the_error_decay_at_the_chosen_rate(rate: float) -> None:
    task = ["controller.kind=feedback_linearisation", f"controller.convergence_rate={rate} 1/s", "run.duration=0.1 s"]
    task += ["reference.kind=constant", "reference.level=0.5 N m"]
    run = ppafo.simulate("torque-task-proportional", task).recording
    error = run["reference"] - run["torque"]
    assert error == pytest.approx(0.5 * np.exp(-rate * run.time), abs=0.02)


def test_a_wrong_belief_costs_accuracy_but_not_stability() -> None:
    task = [*WITHIN_REACH, "controller.kind=feedback_linearisation"]
    right = ppafo.simulate("torque-task-proportional", task).metrics["rms_error"].value
    wrong = ppafo.simulate("torque-task-proportional", [*task, "valve.area=15 mm^2"]).metrics["rms_error"].value
    assert right < 0.001 < wrong < 0.1


def test_anti_windup_brings_the_torque_down_in_time() -> None:
    with_it = ppafo.simulate("torque-task-anti-windup").recording
    without = ppafo.simulate("torque-task-anti-windup", ["controller.anti_windup=0 1/s"]).recording
    late = (with_it.time > 2.5) & (with_it.time < 3.5)
    errors = [float(np.sqrt(np.mean((run["reference"] - run["torque"])[late] ** 2))) for run in (with_it, without)]
    assert errors[0] < 0.5 * errors[1]


@pytest.mark.parametrize("kind", ["on_off_dead_zone", "on_off"])
def test_on_off_laws_run_on_the_solenoid_pair(kind: str) -> None:
    run = ppafo.simulate("torque-task-solenoid", [f"controller.kind={kind}", "run.duration=0.5 s"])
    assert run.status.is_completed
    assert run.recording["torque"].max() > 0.5
