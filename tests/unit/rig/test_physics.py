"""The rig against closed forms, balances and the plain model."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ppafo.model.effects.spool_play import spool_position
from ppafo.rig import record
from ppafo.rig.dynamics import RigState
from ppafo.rig.preset import Preset, load_preset
from ppafo.rig.solution import RigRun, RigSolution, solve_rig
from ppafo.running import simulate

OnTheRig = Callable[[str, Preset], RigRun]
Numbers = np.ndarray[tuple[int], np.dtype[np.float64]]
RANGES = {"angle": np.deg2rad(110.0), "pressure_1": 379e3, "pressure_2": 379e3}
K = 1.3


def of(solution: RigSolution, name: str) -> Numbers:
    return solution.states[:, RigState._fields.index(name)]


def temperature(given: RigRun, solution: RigSolution, chamber: int) -> Numbers:
    return of(solution, f"energy_{chamber}") / of(solution, f"mass_{chamber}") / given.physics.heat_capacity


def charged(given: RigRun, coefficient: float, rest: float) -> tuple[float, float]:
    """Final temperature and pressure of a fixed chamber 1 with a rest of gas that the open valve fills; no leak."""
    start = given.initial
    empty = start._replace(mass_1=rest * start.mass_1, energy_1=rest * start.energy_1)
    run = replace(given.run, leak_orifice=given.run.leak_orifice._replace(conductance=0.0))
    physics = given.physics._replace(heat_transfer_coefficient=coefficient)
    run = replace(run, plant=run.plant._replace(static_torque=1e4))
    filled = replace(given, run=run, initial=empty, physics=physics)
    solution = solve_rig(filled)
    return float(temperature(filled, solution, 1)[-1]), float(solution.pressures[-1, 0])


def test_with_all_extras_off_the_step_response_is_that_of_the_model(perfect: Preset) -> None:
    made = record("step-response", perfect)
    model = simulate("step-response").recording
    impacts = made.truth["settings"]["impacts"]
    assert len(impacts) == 1, "the gas of chamber 2 does not throw the foot off its stop"
    away = np.all(np.abs(model.time - np.array(impacts)[:, None]) > 5e-3, axis=0)
    for name, full in RANGES.items():
        assert np.abs(made.recording[name] - model[name])[away].max() < 1e-3 * full, name


@pytest.mark.parametrize("valve", ["proportional", "solenoid"])
def test_with_all_extras_off_the_torque_task_is_that_of_the_model(perfect: Preset, valve: str) -> None:
    made = record("torque-task", perfect, valve=valve, overrides=["run.duration=0.5 s"]).recording
    model = simulate(f"torque-task-{valve}", ["run.duration=0.5 s"]).recording
    for name in ("pressure_1", "pressure_2"):
        assert np.abs(made[name] - model[name]).max() < 1e-3 * 345e3
    assert made["reference"].tolist() == pytest.approx(model["reference"].tolist())


def test_less_heat_transfer_leads_further_from_the_model(perfect: Preset) -> None:
    model = simulate("step-response").recording

    def distance(coefficient: float) -> float:
        preset = perfect.with_value("gas.heat_transfer_coefficient", coefficient, "a test")
        return float(np.abs(record("step-response", preset).recording["pressure_1"] - model["pressure_1"]).mean())

    distances = [distance(coefficient) for coefficient in (1e7, 1e5, 1e3)]
    assert distances == sorted(distances)
    assert distances[2] > 10.0 * distances[0]


def test_adiabatic_charging_of_an_empty_volume_heats_the_gas_by_the_ratio_of_heat_capacities(
    perfect: Preset, on_the_rig: OnTheRig
) -> None:
    given = on_the_rig("step-response", perfect)
    warm, pressure = charged(given, 0.0, 1e-6)
    assert warm == pytest.approx(K * given.physics.supply_temperature, rel=1e-4)
    assert pressure == pytest.approx(given.run.plant.supply_pressure, rel=1e-3)


def test_isothermal_charging_keeps_the_temperature(perfect: Preset, on_the_rig: OnTheRig) -> None:
    given = on_the_rig("step-response", perfect)
    assert charged(given, 1e6, 0.05)[0] == pytest.approx(given.physics.wall_temperature, rel=1e-4)


def test_closed_chambers_follow_the_adiabate_as_the_vane_moves(perfect: Preset, on_the_rig: OnTheRig) -> None:
    given = on_the_rig("step-response", perfect)
    run = replace(given.run, leak_orifice=given.run.leak_orifice._replace(conductance=0.0))
    physics = given.physics._replace(heat_transfer_coefficient=0.0, ports_open=0.0)
    thrown = given.initial._replace(angle=1.0, angular_velocity=20.0)
    closed = replace(given, run=run, physics=physics, initial=thrown)
    solution = solve_rig(closed)
    plant = run.plant
    angle = of(solution, "angle")
    volume = plant.dead_volume_2 + plant.displacement_per_radian * (plant.angle_max - angle)
    assert np.ptp(volume) > 1e-6
    product = solution.pressures[:, 1] * volume**K
    assert np.abs(product / product[0] - 1.0).max() < 1e-6


@pytest.mark.parametrize("preset", ["ideal-laboratory", "paper-bench", "worn-seals"])
def test_mass_and_energy_balance_close(preset: str, on_the_rig: OnTheRig) -> None:
    given = on_the_rig("step-response", load_preset(preset))
    solution = solve_rig(given)
    places = ("1", "2")
    mass = sum(of(solution, f"mass_{place}") + of(solution, f"line_mass_{place}") for place in places)
    energy = sum(of(solution, f"energy_{place}") + of(solution, f"line_energy_{place}") for place in places)
    net = of(solution, "supplied_mass") - of(solution, "vented_mass")
    assert np.abs(mass - mass[0] - net).max() < 1e-9 * mass[0]
    gained = of(solution, "enthalpy_in") - of(solution, "work_done") + of(solution, "heat_in")
    assert np.abs(energy - energy[0] - gained).max() < 1e-9 * energy[0]
    assert min(np.ptp(of(solution, name)) for name in ("supplied_mass", "vented_mass")) > 0.1 * mass[0]
    assert np.abs(of(solution, "work_done")).max() > 1e-3 * energy[0]


def test_heat_through_the_walls_of_isothermal_chambers_is_work_less_what_flowing_gas_brings(
    perfect: Preset, on_the_rig: OnTheRig
) -> None:
    given = on_the_rig("step-response", perfect)
    solution = solve_rig(given)
    # Each kilogram brings c_p T and keeps c_v T, so R T of it and the work have to go through the wall.
    flowed = given.physics.gas_constant * 298.0 * (of(solution, "supplied_mass") - of(solution, "vented_mass"))
    expected = of(solution, "work_done") - flowed
    assert of(solution, "heat_in") == pytest.approx(expected, abs=1e-3 * np.abs(expected).max())


def test_friction_grows_with_pressure_where_the_preset_says_so(perfect: Preset) -> None:
    gripping = perfect.with_value("friction.static_per_pressure", 5e-6, "a test")
    free, held = (record("step-response", preset).truth["settings"]["breakaways"] for preset in (perfect, gripping))
    assert held[0] > free[0] + 1e-4


def test_a_line_delays_and_slows_the_vane(perfect: Preset) -> None:
    tight = perfect.with_value("leak.conductance_factor", 0.0, "a test")
    lines = tight
    for path, value in (("volume", 1.5e-6), ("area", 8e-6), ("discharge_coefficient", 0.6), ("delay", 3e-3)):
        lines = lines.with_value(f"line.{path}", value, "a test")
    short, long = (record("step-response", preset).recording for preset in (tight, lines))
    first = [int(np.argmax(np.abs(item["pressure_1"] - 101325.0) > 1.0)) for item in (short, long)]
    assert first == [1, 4]
    assert np.argmax(long["angle"] > 2.0) > np.argmax(short["angle"] > 2.0) + 5


def test_a_supply_with_droop_falls_while_gas_flows_and_recovers(perfect: Preset) -> None:
    soft = perfect.with_value("supply.droop", 3e6, "a test").with_value("supply.recovery_time", 0.01, "a test")
    stiff, shown = (record("step-response", preset).recording["supply_pressure"] for preset in (perfect, soft))
    assert np.ptp(stiff) == 0.0
    # The choked flow at 55 psi_g is 4.8 g/s, which would let it fall by 14 kPa if it lasted.
    assert 10e3 < (stiff - shown).max() < 14.5e3
    assert shown[0] == stiff[0]
    assert stiff[-1] - shown[-1] < 3e3


def test_a_slow_sensor_shows_what_was_one_time_constant_ago_on_a_steady_ramp(perfect: Preset) -> None:
    slow = perfect.with_value("pressure_sensor.bandwidth", 100.0, "a test")
    fast, late = (record("vane-leak", preset, overrides=["run.duration=2 s"]).recording for preset in (perfect, slow))
    lag = 1.0 / (2.0 * np.pi * 100.0)
    rate = np.gradient(fast["pressure_1"], fast.time)
    expected = fast["pressure_1"] - lag * rate
    assert np.abs(late["pressure_1"] - expected)[5:-1].max() < 0.05 * np.abs(lag * rate).max()


@pytest.mark.parametrize(("position", "command", "expected"), [(0.0, 0.05, 0.0), (0.0, 1.0, 1.0), (1.0, 0.95, 1.0)])
def test_play_swallows_small_reversals_and_still_reaches_full_opening(
    position: float, command: float, expected: float
) -> None:
    assert spool_position(position, command, 0.1) == pytest.approx(expected)


def test_a_real_gas_takes_two_percent_more_to_fill_a_chamber(perfect: Preset, on_the_rig: OnTheRig) -> None:
    real = perfect.with_value("gas.real_gas_share", 1.0, "a test")
    masses = [of(solve_rig(on_the_rig("step-response", preset)), "mass_1")[-1] for preset in (perfect, real)]
    assert masses[1] / masses[0] == pytest.approx(1.025, abs=0.002)
