"""Linear models of actuators that are no vane: rates against a recording, slopes against rates."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("casadi")
from ppafo.analyses.linearise.plant import plant_of
from ppafo.analyses.linearise.solve import linear_model
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
        if variable.name not in recording.names:
            continue
        series = recording[variable.name]
        slope = (series[sample + 1] - series[sample - 1]) / (recording.time[sample + 1] - recording.time[sample - 1])
        size = max(abs(slope), 1e-2 * float(np.ptp(series)) / AT)
        assert model.rates[place] == pytest.approx(slope, abs=5.0e-3 * size), variable.name
        assert variable.value == pytest.approx(series[sample], rel=1e-6), variable.name
    torque = next(variable for variable in model.outputs if variable.name == "torque")
    assert torque.value == pytest.approx(recording["torque"][sample], rel=1e-6)


@pytest.mark.parametrize("case", CASES)
def test_the_columns_of_a_linear_model_are_differences_of_its_rates(case: str) -> None:
    name, overrides = CASES[case]
    scenario = load_scenario(ACTUATORS / f"{name}.toml", [*overrides, "run.duration=0.1 s"])
    model, run = linear_model(scenario, AT), plan_run(scenario)
    values = {variable.name: variable.value for variable in (*model.states, *model.inputs)}
    way = float(np.sign(values["angular_velocity"])) if "angular_velocity" in values else 0.0
    plant = plant_of(dataclasses.replace(run), way)
    known = {name: values.get(name, 0.0) for name in plant.symbols} | {"angle": values.get("angle", run.initial.angle)}
    import casadi

    function = plant.function([casadi.vertcat(*plant.rates.values())])
    for column, variable in enumerate(model.states):
        step = 1.0e-6 * max(abs(variable.value), 1.0)
        more, less = (
            np.array(function({**known, variable.name: variable.value + way * step})[0]).ravel() for way in (1, -1)
        )
        difference = (more - less) / (2.0 * step)
        scale = np.max(np.abs(difference)) + 1e-9
        assert model.a[:, column] == pytest.approx(difference, abs=1e-4 * scale), variable.name
