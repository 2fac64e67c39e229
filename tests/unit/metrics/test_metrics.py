"""Metrics."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.metrics import METRICS, evaluate
from ppafo.metrics.metric import hold
from ppafo.metrics.switching import reversals
from ppafo.model.valves.kind import VENT
from ppafo.signals import CHANNELS, Channel, Recording

TIME = np.linspace(0.0, 3.0, 3001)
RAMP = np.minimum(6.0 * TIME, 6.0)


def recording(**channels: np.ndarray) -> Recording:
    made = {name: Channel(values, CHANNELS[name].unit) for name, values in channels.items()}
    return Recording("made", TIME, made)


def value(name: str, **channels: np.ndarray) -> float:
    return evaluate(recording(**channels))[name].value


def test_every_metric_needs_channels_that_exist_and_says_what_it_is() -> None:
    for name, kind in METRICS.items():
        assert name == kind.name
        assert kind.summary
        # What is counted while a walk goes on needs the walk, not channels.
        assert kind.channels or kind.needs
        assert set(kind.channels) <= set(CHANNELS)


def test_metrics_whose_channels_are_missing_are_left_out() -> None:
    assert set(evaluate(recording(command=np.ones(3001)))) == {"switchings", "command_reversals"}


def test_a_reversal_goes_from_beyond_half_open_one_way_to_beyond_half_open_the_other() -> None:
    command = np.zeros(3001)
    for first, level in ((0, 1.0), (100, 0.3), (200, -0.6), (300, 0.4), (400, -1.0), (500, 0.51), (600, 0.0)):
        command[first:] = level
    assert value("command_reversals", command=command) == 2.0


def test_a_task_that_begins_and_a_valve_that_vents_begin_anew() -> None:
    command, phase = np.ones(3001), np.full(3001, 3.0)
    command[1000:] = -1.0
    assert value("command_reversals", command=command, controller_phase=phase) == 1.0
    assert value("command_reversals", command=command, controller_phase=np.where(command > 0.0, 3.0, 4.0)) == 0.0
    command[990:1000] = VENT
    assert value("command_reversals", command=command, controller_phase=phase) == 0.0


def test_the_peak_torque_is_the_largest_in_either_direction() -> None:
    assert value("peak_torque", torque=np.linspace(-3.0, 2.0, 3001)) == 3.0


def test_a_constant_error_is_its_own_rms_error_on_ramp_and_hold() -> None:
    metrics = evaluate(recording(reference=RAMP, torque=RAMP - 0.5))
    for name in ("rms_error", "rms_error_ramp", "rms_error_hold", "peak_error"):
        assert metrics[name].value == pytest.approx(0.5)
        assert metrics[name].unit == "N m"


def test_the_rms_error_does_not_depend_on_how_densely_a_part_is_sampled() -> None:
    sparse = recording(reference=RAMP, torque=0.9 * RAMP)
    crowded = sparse.resample(np.concatenate([TIME[:1000], np.linspace(1.0, 1.2, 5000), TIME[1201:]]))
    assert evaluate(crowded)["rms_error"].value == pytest.approx(evaluate(sparse)["rms_error"].value, rel=1e-5)


def test_ramp_and_hold_part_where_the_reference_reaches_the_level_it_keeps() -> None:
    torque = np.where(TIME < 1.0, RAMP - 2.0, RAMP - 1.0)
    assert hold(recording(reference=RAMP)) == slice(1000, None)
    assert value("rms_error_hold", reference=RAMP, torque=torque) == pytest.approx(1.0)
    assert value("rms_error_ramp", reference=RAMP, torque=torque) == pytest.approx(2.0, rel=1e-3)


def test_a_reference_that_never_rests_has_neither_ramp_nor_hold() -> None:
    metrics = evaluate(recording(reference=np.sin(TIME), torque=np.zeros(3001)))
    assert "rms_error" in metrics
    assert not {"rms_error_ramp", "rms_error_hold", "oscillations_ramp", "oscillations_hold"} & set(metrics)


def test_a_constant_reference_has_a_hold_but_no_ramp() -> None:
    metrics = evaluate(recording(reference=np.full(3001, 2.0), torque=np.zeros(3001)))
    assert metrics["rms_error_hold"].value == pytest.approx(2.0)
    assert "rms_error_ramp" not in metrics


def test_gas_is_counted_from_the_first_sample() -> None:
    supplied = 1e-3 + 2e-4 * TIME
    assert value("gas_supplied", supplied_mass=supplied) == pytest.approx(6e-4)
    assert evaluate(recording(supplied_mass=supplied))["gas_supplied"].unit == "kg"


def test_gas_that_appears_from_nowhere_shows_as_imbalance() -> None:
    flows = {"supplied_mass": 3e-4 * TIME, "vented_mass": 1e-4 * TIME, "mass_2": np.full(3001, 1e-4)}
    assert value("gas_imbalance", mass_1=2e-4 * TIME, **flows) == pytest.approx(0.0, abs=1e-18)
    assert value("gas_imbalance", mass_1=2.1e-4 * TIME, **flows) == pytest.approx(-3e-5)


def test_the_largest_pressure_is_looked_for_in_both_chambers() -> None:
    assert value("largest_pressure", pressure_1=1e5 + TIME, pressure_2=4e5 - TIME) == 4e5


def test_the_lowest_temperature_is_looked_for_in_both_chambers_and_needs_an_energy_balance() -> None:
    assert value("lowest_temperature", temperature_1=290.0 + TIME, temperature_2=293.0 - 2.0 * TIME) == 287.0
    assert value("lowest_temperature", temperature_1=290.0 + TIME, temperature_2=293.0 - 0.5 * TIME) == 290.0
    assert "lowest_temperature" not in evaluate(recording(pressure_1=TIME, pressure_2=TIME))


def test_the_final_error_is_that_of_the_last_sample_without_its_sign() -> None:
    error = np.where(TIME < 2.9, 5.0, 0.25)
    assert value("final_error", reference=RAMP, torque=RAMP - error) == 0.25
    assert value("final_error", reference=RAMP, torque=RAMP + error) == 0.25
    assert "final_error" not in evaluate(recording(torque=RAMP))


def test_work_is_torque_over_angle_and_is_positive_where_the_actuator_drives() -> None:
    angle = 0.2 + 0.5 * TIME
    assert value("mechanical_work", angle=angle, torque=np.full(3001, 4.0)) == pytest.approx(6.0)
    assert value("mechanical_work", angle=angle, torque=np.full(3001, -4.0)) == pytest.approx(-6.0)


def test_work_per_gas_is_left_out_where_no_gas_was_taken() -> None:
    motion = {"angle": TIME, "torque": np.full(3001, 2.0)}
    assert value("work_per_gas", supplied_mass=1e-3 * TIME, **motion) == pytest.approx(2000.0)
    assert "work_per_gas" not in evaluate(recording(supplied_mass=np.zeros(3001), **motion))


def test_each_valve_that_a_command_switches_on_or_off_is_counted() -> None:
    command = np.zeros(3001)
    command[:1000], command[2000:] = 1.0, -1.0
    assert value("switchings", command=command) == 2.0
    assert value("switchings", command=np.sign(np.cos(2.0 * math.pi * TIME))) == 2 * 6.0
    on_or_off = np.where(np.arange(3001) // 15 % 2, 0.0, 1.0)
    assert value("switchings", command=on_or_off) == 200.0


def test_oscillation_on_the_ramp_is_counted_there_and_not_on_the_hold() -> None:
    wave = np.where(TIME < 1.0, np.arcsin(np.sin(2.0 * math.pi * 5.0 * TIME)), 0.0)
    metrics = evaluate(recording(reference=RAMP, torque=RAMP + wave))
    assert metrics["oscillations_ramp"].value == 10.0
    assert metrics["oscillations_hold"].value == 0.0


def test_noise_below_the_threshold_is_no_oscillation() -> None:
    noise = 0.05 * np.random.default_rng(1).uniform(-1.0, 1.0, 3001)
    metrics = evaluate(recording(reference=RAMP, torque=RAMP + noise))
    assert metrics["oscillations_ramp"].value == 0.0
    assert metrics["oscillations_hold"].value == 0.0


def test_oscillation_needs_a_reference_to_be_measured_against() -> None:
    still = evaluate(recording(reference=np.zeros(3001), torque=np.sin(9.0 * TIME)))
    assert "oscillations_hold" not in still


@given(st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=60), st.floats(0.1, 3.0))
def test_reversals_do_not_depend_on_sign_or_level_and_never_grow_with_the_threshold(
    values: list[float], swing: float
) -> None:
    signal = np.round(np.array(values), 6)
    count = reversals(signal, swing)
    assert reversals(-signal, swing) == count
    assert reversals(np.sort(signal), swing) == 0
    assert reversals(signal, 2.0 * swing) <= count


def test_departure_and_arrival_are_at_one_percent_of_the_move_from_either_end() -> None:
    angle = np.clip(TIME - 1.0, 0.0, 1.0) * 2.0 + 0.3
    metrics = evaluate(recording(angle=angle))
    assert metrics["departure_time"].value == pytest.approx(1.01)
    assert metrics["arrival_time"].value == pytest.approx(1.99)
    assert metrics["angle_range"].value == pytest.approx(2.0)


def test_a_move_that_comes_back_neither_departs_nor_arrives() -> None:
    there_and_back = 0.3 + np.sin(np.pi * TIME / TIME[-1]) + 0.01 * TIME / TIME[-1]
    assert not {"departure_time", "arrival_time"} & set(evaluate(recording(angle=there_and_back)))


def test_the_largest_speed_counts_either_way() -> None:
    assert value("largest_speed", angular_velocity=-3.0 + TIME) == 3.0
