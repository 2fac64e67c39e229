"""Scenarios with regulators and lines: file, balances, an ODE solver, ensembles, the limit of an ideal supply."""

import numpy as np
import pytest

from ppafo.errors import ScenarioError
from ppafo.metrics import evaluate
from ppafo.model.orifice import orifice_flow
from ppafo.model.plant import chamber_volumes
from ppafo.model.regulator import SupplyLines
from ppafo.parameters.overrides import over
from ppafo.running import simulate
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import scenario_document

LINES = ("supply_line.plantarflexion.droop=3e6 Pa s/kg",)
WARM = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=50 W/(m^2 K)",
    "gas_model.wall_area_per_volume=100 1/m",
)
SHORT = ("run.duration=0.5 s",)


def test_a_scenario_takes_the_section_of_a_walk_file_and_lists_what_it_leaves_to_the_package() -> None:
    scenario = load_scenario("torque-task-proportional", LINES)
    assert scenario.supply_lines == SupplyLines(3.0e6, 0.01, 1.0e-5, 6.7e7, 1.5e-3, 2.0e-6, 0.0)
    assumed = {item.path: item for item in scenario.assumptions}
    assert "supply_line.plantarflexion.droop" not in assumed
    assert assumed["supply_line.dorsiflexion.volume"].note.startswith("assumed: ")
    assert load_scenario("torque-task-proportional").supply_lines is None
    assert scenario_document(scenario)["supply_line"]["plantarflexion"]["droop"] == 3.0e6
    assert scenario_document(load_scenario("torque-task-proportional"))["supply_line"] is None


@pytest.mark.parametrize(
    ("override", "line"),
    [
        ("supply_line.knee.droop=3 Pa s/kg", "no value 'supply_line.knee.droop', did you mean"),
        ("supply_line.plantarflexion.droop=0 Pa s/kg", "must be at least 1 Pa s/kg"),
        ("supply.dorsiflexion_pressure=60 psi_g", "the first regulator feeds the second"),
    ],
)
def test_a_mistake_is_named_in_one_line(override: str, line: str) -> None:
    with pytest.raises(ScenarioError, match=line) as caught:
        load_scenario("torque-task-proportional", over(LINES, [override]))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["torque-task-proportional", "torque-task-solenoid"])
@pytest.mark.parametrize("gas", [(), WARM], ids=["isothermal", "thermal"])
def test_a_task_behind_lines_keeps_mass_and_energy(name: str, gas: tuple[str, ...]) -> None:
    result = simulate(name, [*SHORT, *LINES, *gas])
    recording, run = result.recording, plan_run(result.scenario)
    assert result.status.is_completed
    supplied = float(np.ptp(recording["supplied_mass"]))
    assert supplied > 1e-4
    assert abs(evaluate(recording)["gas_imbalance"].value) < 1e-12 * supplied
    lines = run.lines
    assert lines is not None
    in_lines = recording["line_pressure_1"] * lines.parameters.volume_1 / run.plant.gas_product
    in_lines = in_lines + recording["line_pressure_2"] * lines.parameters.volume_2 / run.plant.gas_product
    left = in_lines - in_lines[0] + recording["supplied_mass"] - recording["regulated_mass"]
    assert np.abs(left).max() < 1e-11 * in_lines[0]
    assert (np.diff(recording["regulated_mass"]) >= 0.0).all()
    assert recording["line_pressure_1"].min() < result.scenario.device.supply.pressure - 500.0
    if gas:
        assert abs(evaluate(recording)["energy_imbalance"].value) < 1e-9 * float(recording["supplied_enthalpy"][-1])


def test_a_filling_behind_lines_is_that_of_an_ode_solver() -> None:
    from scipy.integrate import solve_ivp

    given = ["controller.kind=constant", "controller.command=1", "run.duration=0.2 s", *LINES]
    result = simulate("torque-task-proportional", given)
    run, time = plan_run(result.scenario), result.recording.time
    plant, lines = run.plant, run.lines
    assert lines is not None
    volume_1, volume_2 = chamber_volumes(plant, run.initial.angle)
    fed = lines.parameters

    def rates(_time: float, y: np.ndarray) -> list[float]:
        chamber_1, chamber_2 = y[0] * plant.gas_product / volume_1, y[1] * plant.gas_product / volume_2
        line = y[2] * plant.gas_product / fed.volume_1
        into = orifice_flow(line, chamber_1, plant.valve_conductance, 1.0, plant.valve_curve)[0]
        out = orifice_flow(chamber_2, plant.atmospheric_pressure, plant.valve_conductance, 1.0, plant.valve_curve)[0]
        leak = orifice_flow(chamber_1, chamber_2, plant.leak_conductance, 1.0, plant.leak_curve)[0]
        bottle = min(max((plant.supply_pressure - line) / fed.droop_1, 0.0), fed.largest_flow_1)
        return [into - leak, leak - out, bottle - into]

    start = [run.initial.mass_1, run.initial.mass_2, lines.initial.mass_1]
    exact = solve_ivp(rates, (0.0, time[-1]), start, "Radau", time, rtol=1e-10, atol=1e-15, max_step=1e-3)
    pressures = exact.y * plant.gas_product / np.array([[volume_1], [volume_2], [fed.volume_1]])
    found = np.array([result.recording[name] for name in ("pressure_1", "pressure_2", "line_pressure_1")])
    assert np.abs(found - pressures).max() < 1e-3 * (plant.supply_pressure - plant.atmospheric_pressure)


def test_an_ensemble_over_the_droop_is_its_runs_to_the_last_bit_and_refuses_a_second_regulator_above_the_first() -> (
    None
):
    base = load_scenario("torque-task-proportional", [*SHORT, *LINES])
    droops, second = np.array([3.0e6, 3.0e7, 3.0e6]), np.array([4.0e5, 4.0e5, 9.0e5])
    columns = {"supply_line.plantarflexion.droop": droops, "supply.dorsiflexion_pressure": second}
    ensemble = run_ensemble(base, columns, ("gas_supplied", "gas_imbalance"))
    for run in range(2):
        overrides = [
            f"supply_line.plantarflexion.droop={float(droops[run])!r} Pa s/kg",
            "supply.dorsiflexion_pressure=4e5 Pa_a",
        ]
        alone = simulate("torque-task-proportional", over([*SHORT, *LINES], overrides))
        assert ensemble.metrics["gas_supplied"][run] == alone.metrics["gas_supplied"].value
    assert np.isnan(ensemble.metrics["gas_supplied"][2])
    with pytest.raises(ScenarioError, match=r"'supply_line.*droop' is not a number that can vary"):
        run_ensemble(
            load_scenario("torque-task-proportional"), {"supply_line.plantarflexion.droop": droops}, ("gas_supplied",)
        )
