"""Torque laws and profiles: commands in closed form, what model-based laws believe, a profile that follows a table."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ppafo
from ppafo.control.catalog import CONTROLLERS
from ppafo.control.controllers.damped_proportional import KNOTS, learnt_command
from ppafo.control.controllers.model_based import (
    NOMINAL_QUANTITIES,
    NominalChambers,
    TorqueRates,
    ellipse_flow,
    opening_for_rate,
    torque_rates,
)
from ppafo.control.controllers.switching import (
    OnOffDeadZoneParameters,
    OnOffDeadZoneState,
    SlidingModeParameters,
    SlidingModeState,
)
from ppafo.control.profiles import NEVER, TABLE, TabulatedProfile, table_bounds, table_value
from ppafo.engine.rows import rebuilt
from ppafo.model.orifice import iso6358_flow_function
from ppafo.model.sensors import Measurement
from ppafo.parameters.plant import plant_parameters
from ppafo.simulation.loading import load_scenario

PERIOD = 1.0e-3
WITHIN_REACH = ["reference.level=4 N m", "controller.rate=1 kHz"]


def seen(torque: float) -> Measurement:
    """A measurement with a torque [N m]."""
    return Measurement(1.309, 1.01325e5 + max(torque, 0.0) / 1.451e-5, 1.01325e5 + max(-torque, 0.0) / 1.451e-5, torque)


@cache
def on_the_paper_device(kind: str) -> dict[str, float]:
    """Settings [SI] of a controller on the paper's device, with the gains of its torque task where it has such."""
    return dict(load_scenario("torque-task-proportional", [f"controller.kind={kind}"]).controller.settings)


def parameters(kind: str, **changed: float) -> Any:
    """Parameters of a controller on the paper's device, some of them changed."""
    chosen = CONTROLLERS[kind]
    settings = on_the_paper_device(kind) | changed
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
    chosen = SlidingModeParameters(5.0, 0.5, 1.0, 0.0)
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


def test_a_law_without_an_integral_gain_has_no_integral_to_wind_up() -> None:
    gains = {"proportional_gain": 0.3, "integral_gain": 0.0, "derivative_gain": 0.0, "anti_windup": 80.0}
    clipped = commands("pid", [-30.0, -30.0, -30.0, 1.0], **gains)
    assert clipped == [1.0, 1.0, 1.0, commands("pid", [1.0], **gains)[0]]


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
    # Without the belief the law would follow the device; it keeps that of the paper's valve here.
    conductance = f"controller.valve_conductance={NOMINAL.valve_conductance!r} kg/(s Pa)"
    changed = [*task, "valve.area=9 mm^2", conductance]
    wrong = ppafo.simulate("torque-task-proportional", changed).metrics["rms_error"].value
    assert 2.0 * right < wrong < 0.1


def test_anti_windup_brings_the_torque_down_in_time() -> None:
    with_it = ppafo.simulate("torque-task-anti-windup").recording
    without = ppafo.simulate("torque-task-anti-windup", ["controller.anti_windup=0 1/s"]).recording
    late = (with_it.time > 2.5) & (with_it.time < 3.5)
    errors = [float(np.sqrt(np.mean((run["reference"] - run["torque"])[late] ** 2))) for run in (with_it, without)]
    assert errors[0] < 0.5 * errors[1]


NOMINAL = NominalChambers(*(on_the_paper_device("pid_feedforward")[item.name] for item in NOMINAL_QUANTITIES))
PRESSURES = st.floats(1.02e5, 4.4e5)
"""Between the atmosphere and the supply."""


@pytest.mark.parametrize(
    "changes",
    [[], ["gas.species=air", "gas.temperature=40 degC", "valve.area=3 mm^2", "actuator.dead_volume_2=9 cm^3"]],
    ids=["paper", "another"],
)
def test_a_law_with_a_model_believes_the_device_that_it_runs_on(changes: list[str]) -> None:
    task = load_scenario("torque-task-proportional", ["controller.kind=feedback_linearisation", *changes])
    plant = plant_parameters(task.device)
    believed = {item.name: task.controller.settings[item.name] for item in NOMINAL_QUANTITIES}
    assert believed.pop("dead_band") == task.device.valve.settings["dead_band"]
    assert believed.pop("critical_ratio") == pytest.approx(plant.valve_curve.critical_ratio)
    assert believed == pytest.approx({name: getattr(plant, name) for name in believed})


@given(PRESSURES, PRESSURES)
def test_flow_is_the_ellipse_of_the_standard_and_changes_sign_with_the_sides(first: float, second: float) -> None:
    upstream, downstream = max(first, second), min(first, second)
    expected = 1.0e-8 * upstream * iso6358_flow_function(downstream / upstream, 0.5)
    assert abs(ellipse_flow(first, second, 1.0e-8, 0.5)) == pytest.approx(expected, abs=1e-12)
    assert ellipse_flow(first, second, 1.0e-8, 0.5) == -ellipse_flow(second, first, 1.0e-8, 0.5) or first == second


@given(PRESSURES, PRESSURES, st.floats(0.4, 2.2), st.floats(-3.0, 3.0), st.floats(-200.0, 200.0))
def test_the_opening_gives_the_rate_that_was_wanted_where_the_valve_can(
    first: float, second: float, angle: float, velocity: float, wanted: float
) -> None:
    rates = torque_rates(NOMINAL, angle, velocity, first, second)
    opening = opening_for_rate(rates, wanted)
    gain = rates.rising if opening >= 0.0 else rates.falling
    if abs(opening) < 1.0:
        assert rates.closed + gain * opening == pytest.approx(wanted, abs=1e-6)
    else:
        assert (wanted - rates.closed - gain * opening) * opening > -1e-6


def test_a_valve_that_changes_nothing_is_opened_fully_and_not_divided_by_zero() -> None:
    assert opening_for_rate(TorqueRates(0.0, 0.0, 0.0), 1.0) == 1.0
    assert opening_for_rate(TorqueRates(0.0, 0.0, 0.0), -1.0) == -1.0


@pytest.mark.parametrize("command", [0.3, -0.3])
def test_the_believed_rate_is_that_of_the_engine(command: float) -> None:
    task = ["controller.kind=constant", f"controller.command={command}", "run.duration=0.02 s"]
    task += ["initial.pressure_1=20 psi_g", "initial.pressure_2=10 psi_g"]
    run = ppafo.simulate("torque-task-proportional", task).recording
    rates = torque_rates(NOMINAL, float(run["angle"][5]), 0.0, float(run["pressure_1"][5]), float(run["pressure_2"][5]))
    believed = rates.closed + command * (rates.rising if command > 0.0 else rates.falling)
    measured = (run["torque"][6] - run["torque"][4]) / (run.time[6] - run.time[4])
    assert believed == pytest.approx(measured, rel=0.02)
    assert believed * command > 0.0


def test_a_vane_that_turns_changes_the_torque_of_closed_chambers_against_the_motion() -> None:
    turning = torque_rates(NOMINAL, 1.3, 1.0, 2.0e5, 2.0e5)
    constant, growth = NOMINAL.torque_constant, NOMINAL.displacement_per_radian
    volume_1 = NOMINAL.dead_volume_1 + growth * (1.3 - 0.34906585)
    volume_2 = NOMINAL.dead_volume_2 + growth * (2.26892803 - 1.3)
    expected = -constant * growth * 2.0e5 * (1.0 / volume_1 + 1.0 / volume_2)
    assert turning.closed == pytest.approx(expected, rel=1e-6)


TIMES = (0.0, 0.15, 0.35, 0.5, 0.62, 0.7)
VALUES = (0.5, 0.6, 3.0, 6.0, -3.0, 0.0)
TABLE_PERIOD = 1.1


def table(times: tuple[float, ...] = TIMES, values: tuple[float, ...] = VALUES, level: float = 0.0) -> TabulatedProfile:
    settings = {item.name: item.default or 0.0 for item in TABLE.quantities} | {"period": TABLE_PERIOD, "level": level}
    settings |= {f"time_{number:02d}": time for number, time in enumerate(times, 1) if number > 1}
    settings |= {f"value_{number:02d}": value for number, value in enumerate(values, 1)}
    return rebuilt(TabulatedProfile, settings.values())


def test_the_value_lies_on_straight_lines_between_the_knots_and_repeats() -> None:
    profile = table(level=2.0)
    times = np.linspace(0.0, 4.9 * TABLE_PERIOD, 4321)
    expected = 2.0 + np.interp(np.mod(times, TABLE_PERIOD), (*TIMES, TABLE_PERIOD), (*VALUES, VALUES[0]))
    found = [table_value(profile, time)[0] for time in times.tolist()]
    assert np.max(np.abs(np.array(found) - expected)) < 1e-9


def test_the_rate_is_that_of_the_line_which_begins_at_a_knot() -> None:
    assert table_value(table(), 0.35)[1] == pytest.approx((6.0 - 3.0) / 0.15)
    assert table_value(table(), 1.0)[1] == pytest.approx(0.5 / 0.4)


def test_knots_that_never_come_count_neither_in_the_value_nor_in_the_bounds() -> None:
    whole = table()
    assert whole.knots[18].time == NEVER
    knots = (*whole.knots[:18], whole.knots[18]._replace(value=99.0), *whole.knots[19:])
    profile = whole._replace(knots=knots)
    assert table_bounds(profile) == (-3.0, 6.0)
    assert max(table_value(profile, 0.01 * step)[0] for step in range(300)) <= 6.0
