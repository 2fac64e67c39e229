"""Gas with an energy balance: against closed forms, against the isothermal gas, and against the reference solver."""

import dataclasses

import numpy as np
import pytest

from ppafo.engine.lanes import run_batch
from ppafo.engine.run import batch_of
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import GasModel, PrescribedMotion, ProfileChoice, Scenario
from tests.reference.reference_solver import chamber_pressures_of, compare_with_reference, plant_states

LARGEST_ANGLE = 2.0e-4
LARGEST_PRESSURE = 1.0e-3
LARGEST_RMS = 1.0e-4

WALLS_PER_VOLUME = 300.0
NO_LEAK = "actuator.leak.area=1e-9 mm^2"
RATIO = 1.3
ENERGIES = ("supplied_enthalpy", "wall_heat")


def with_walls(scenario: Scenario, coefficient: float) -> Scenario:
    return dataclasses.replace(scenario, gas_model=GasModel(coefficient, WALLS_PER_VOLUME))


def assert_within_limits(scenario: Scenario, what: str) -> None:
    agreement = compare_with_reference(plan_run(scenario))
    assert agreement.angle <= LARGEST_ANGLE, (what, agreement)
    assert agreement.worst_pressure <= LARGEST_PRESSURE, (what, agreement)
    assert agreement.worst_rms <= LARGEST_RMS, (what, agreement)


def held_and_open(command: float, pressure: float) -> Scenario:
    """Chamber 1 of a held vane, filled or emptied through the fully open valve; no wall gives heat."""
    start = f"{pressure} Pa_a"
    scenario = load_scenario(
        "torque-task-proportional", (NO_LEAK, f"initial.pressure_1={start}", f"initial.pressure_2={start}")
    )
    control = dataclasses.replace(scenario.controller, kind="constant", settings={"command": command})
    return with_walls(
        dataclasses.replace(scenario, controller=control, run=dataclasses.replace(scenario.run, duration=0.2)), 0.0
    )


def test_adiabatic_filling_adds_the_enthalpy_of_the_source() -> None:
    recording = simulate(held_and_open(1.0, 110_000.0)).recording
    content = recording["mass_1"] * recording["temperature_1"] / 298.0
    gained = recording["mass_1"] - recording["mass_1"][0]
    assert gained[-1] > 2.0 * recording["mass_1"][0]
    np.testing.assert_allclose(content - content[0], RATIO * gained, rtol=1e-9, atol=1e-15)
    assert recording["temperature_1"][-1] > 330.0


def test_adiabatic_emptying_follows_the_isentrope() -> None:
    recording = simulate(held_and_open(-1.0, 400_000.0)).recording
    left = recording["mass_1"] / recording["mass_1"][0]
    assert left[-1] < 0.5
    np.testing.assert_allclose(recording["pressure_1"] / 400_000.0, left**RATIO, rtol=2e-6)
    np.testing.assert_allclose(recording["temperature_1"] / 298.0, left ** (RATIO - 1.0), rtol=2e-6)


def compressed(step: float) -> float:
    """Largest relative departure from the isentrope of a closed chamber while the vane is swung, in steps [s]."""
    scenario = load_scenario("torque-task-proportional", (NO_LEAK,))
    swing = ProfileChoice("sine", {"level": 1.3, "amplitude": 0.6, "frequency": 2.0, "phase": 0.0})
    shut = dataclasses.replace(scenario.controller, kind="constant", settings={"command": 0.0}, period=step)
    planned = plan_run(with_walls(dataclasses.replace(scenario, motion=PrescribedMotion(swing), controller=shut), 0.0))
    counts = {"steps_per_sample": 1, "step_count": round(1.0 / step), "record_every": 1}
    run = dataclasses.replace(planned, step=step, tolerance=1e9, **counts)
    states = plant_states(run, run_batch(batch_of(run)))
    pressure, _ = chamber_pressures_of(run, states)
    volume = run.plant.dead_volume_1 + run.plant.displacement_per_radian * (states[:, 0] - run.plant.angle_min)
    return float(np.abs(pressure * volume**RATIO / (pressure[0] * volume[0] ** RATIO) - 1.0).max())


def test_adiabatic_compression_follows_the_isentrope_with_order_two() -> None:
    coarse = compressed(2.0e-3)
    fine = compressed(1.0e-3)
    assert fine < 2.0e-4
    assert 3.5 < coarse / fine < 4.5


@pytest.mark.parametrize("name", ["step-response", "torque-task-proportional", "torque-task-solenoid"])
def test_warm_walls_make_the_gas_isothermal(name: str) -> None:
    loaded = load_scenario(name)
    scenario = dataclasses.replace(loaded, run=dataclasses.replace(loaded.run, duration=0.5))
    isothermal = simulate(scenario).recording

    def difference(coefficient: float) -> float:
        thermal = simulate(with_walls(scenario, coefficient)).recording
        return float(
            max(
                np.abs(np.interp(isothermal.time, thermal.time, thermal[channel]) - isothermal[channel]).max()
                for channel in ("pressure_1", "pressure_2")
            )
        )

    far = difference(0.0)
    near = difference(1.0e6)
    nearest = difference(1.0e8)
    assert nearest < 20.0 < 0.01 * far
    assert nearest < near < far


@pytest.mark.parametrize("coefficient", [0.0, 1.0e4])
@pytest.mark.parametrize("name", ["step-response", "torque-task-proportional", "torque-task-solenoid"])
def test_energy_balance_is_within_the_limits(name: str, coefficient: float) -> None:
    scenario = with_walls(load_scenario(name), coefficient)
    assert_within_limits(scenario, f"{name}, {coefficient:g} W/(m^2 K)")


def test_gas_is_neither_made_nor_lost() -> None:
    result = simulate(with_walls(load_scenario("step-response"), 80.0))
    assert abs(result.metrics["gas_imbalance"].value) < 1e-12 * result.metrics["gas_supplied"].value


@pytest.mark.parametrize("name", ["step-response", "torque-task-proportional", "torque-task-solenoid"])
def test_energy_balance_closes_with_what_was_supplied_vented_warmed_and_worked(name: str) -> None:
    result = simulate(with_walls(load_scenario(name), 50.0))
    record = result.recording
    gained = {channel: float(record[channel][-1] - record[channel][0]) for channel in ENERGIES}
    assert abs(result.metrics["energy_imbalance"].value) < 1e-5 * gained["supplied_enthalpy"]
    # Both ways counted: over a step response the walls give about as much as they take.
    assert np.abs(np.diff(record["wall_heat"])).sum() > 1e-2 * gained["supplied_enthalpy"]
    # Gas from the supply is at the reference temperature: it brings c_p T.
    per_mass = RATIO / (RATIO - 1.0) * plan_run(result.scenario).plant.gas_product
    assert gained["supplied_enthalpy"] == pytest.approx(per_mass * result.metrics["gas_supplied"].value, rel=1e-9)


def test_work_of_the_gas_is_pressure_times_change_of_volume() -> None:
    fine = load_scenario("step-response", ("run.step=0.05 ms", "run.output_interval=0.05 ms"))
    record = simulate(with_walls(fine, 50.0)).recording
    per_angle = load_scenario("step-response").device.actuator.displacement_per_radian
    work = per_angle * np.trapezoid(record["pressure_1"] - record["pressure_2"], record["angle"])
    assert record["gas_work"][-1] == pytest.approx(float(work), rel=1e-3)
