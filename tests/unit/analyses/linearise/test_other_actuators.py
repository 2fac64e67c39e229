"""Linear models of actuators that are no vane: rates against a recording, slopes against rates."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from ppafo.analyses.linearise.model import linear_model, model_at, plant_of, values_after, valve_states
from ppafo.loading import load_scenario
from ppafo.running import simulate
from ppafo.simulation.plan import plan_run

ACTUATORS = Path(__file__).parents[3] / "actuators"
WARM = (
    *("gas_model.kind=thermal", "gas_model.heat_transfer_coefficient=50 W/(m^2 K)"),
    "gas_model.wall_area_per_volume=300 1/m",
)
FINE = ("run.step=0.1 ms", "run.output_interval=0.1 ms", "run.tolerance=1e-5")
AT = 0.05
CASES: dict[str, tuple[str, Sequence[str]]] = {
    "cylinder": ("step-response-cylinder", ()),
    "cylinder, warm": ("step-response-cylinder", WARM),
    "bladder": ("step-response-measured-bladder", ("motion.angle=60 deg",)),
    "bladder, warm": ("step-response-measured-bladder", ("motion.angle=60 deg", *WARM)),
}


@pytest.mark.parametrize("case", CASES)
def test_the_rates_of_a_linear_model_are_the_slopes_of_the_recording(case: str) -> None:
    name, overrides = CASES[case]
    scenario = load_scenario(ACTUATORS / f"{name}.toml", [*overrides, *FINE, "run.duration=0.1 s"])
    model, recording = linear_model(scenario, AT), simulate(scenario).recording
    sample = int(np.argmin(np.abs(recording.time - AT)))
    for place, variable in enumerate(model.states):
        if variable not in recording.names:
            continue
        series = recording[variable]
        slope = (series[sample + 1] - series[sample - 1]) / (recording.time[sample + 1] - recording.time[sample - 1])
        size = max(abs(slope), 1e-2 * float(np.ptp(series)) / AT)
        assert model.rates[place] == pytest.approx(slope, abs=5.0e-3 * size), variable
        assert model.values[variable] == pytest.approx(series[sample], rel=1e-6), variable
    assert model.values["torque"] == pytest.approx(recording["torque"][sample], rel=1e-6)


@pytest.mark.parametrize("case", CASES)
def test_the_columns_of_a_linear_model_are_differences_of_its_rates(case: str) -> None:
    name, overrides = CASES[case]
    scenario = load_scenario(ACTUATORS / f"{name}.toml", [*overrides, "run.duration=0.1 s"])
    model, run = linear_model(scenario, AT), plan_run(scenario)
    values = {name: model.values[name] for name in (*model.states, *model.inputs)}
    way = float(np.sign(values["angular_velocity"])) if "angular_velocity" in values else 0.0
    known = {"external_torque": 0.0, "angular_velocity": 0.0, "angle": run.initial.angle, **values}
    known = {**dict.fromkeys(valve_states(run.program), 0.0), **known}
    # An actuator with one chamber has one supply and one pressure; nothing passes its other port.
    room = scenario.device.supply.atmospheric_pressure
    gas = {"pressure_2": room, "temperature_2": scenario.device.gas.temperature}
    known = {"dorsiflexion_pressure": room, **gas, **known}
    plant = plant_of(run, way, known)
    for column, variable in enumerate(model.states):
        step = 1.0e-6 * max(abs(values[variable]), 1.0)
        more, less = (plant.at({**known, variable: values[variable] + sign * step})[0] for sign in (1, -1))
        difference = np.array([(more[name] - less[name]) / (2.0 * step) for name in model.states])
        scale = np.max(np.abs(difference)) + 1e-9
        assert model.A[:, column] == pytest.approx(difference, abs=1e-4 * scale), variable


def test_a_load_has_the_slopes_of_its_formula_on_every_actuator() -> None:
    load = ("effects.joint_load.drag=0.05 N m s^2/rad^2", "effects.joint_load.stiffness=8 N m/rad")
    for case in ("cylinder", "bladder"):
        name, overrides = CASES[case]
        texts = [*overrides, "run.duration=0.1 s"]
        plain = load_scenario(ACTUATORS / f"{name}.toml", texts)
        loaded = load_scenario(ACTUATORS / f"{name}.toml", [*texts, *load])
        point = values_after(plain, run := plan_run(plain), round(AT / plain.run.step))
        without, model = (model_at(scenario, plan_run(scenario), point, AT) for scenario in (plain, loaded))
        inertia, rate = run.plant.inertia, point["angular_velocity"]
        row, by_angle = model.states.index("angular_velocity"), model.states.index("angle")
        more = (model.A - without.A)[row]
        assert more[by_angle] == pytest.approx(-8.0 / inertia, rel=1e-4), case
        assert more[row] == pytest.approx(-2.0 * 0.05 * abs(rate) / inertia, rel=1e-4), case


def test_the_linear_model_of_one_chamber_has_one_pressure() -> None:
    scenario = load_scenario(ACTUATORS / "torque-task-measured-bladder.toml")
    model = linear_model(scenario, "equilibrium")
    assert model.states == ("pressure_1",)
    assert "dorsiflexion_pressure" not in model.inputs
    assert not [name for name in model.sides if "chamber 2" in name or "leak" in name]
    assert model.sides["ankle"] == "locked"
