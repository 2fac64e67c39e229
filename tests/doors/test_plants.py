"""The plant alone, as a unit in FMPy: under the inputs that a closed loop recorded it moves as it did in there."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ppafo.exports.fmu.interface import plant_alone
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.running import simulate
from scripts.instances import Instance
from tests.doors.of_python import (
    Floats,
    answer_of,
    assert_same_channels,
    parameters,
    run_by,
    scenario_of,
)
from tests.doors.table import GROUPS, SHORT, Case

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (pip install -e .[dev])")
pytestmark = [
    pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine"),
    pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone"),
]


def replayed(file: str, time: Floats, channels: dict[str, Floats]) -> dict[str, Floats]:
    """Outputs of a plant at samples, from each of which to the next it has the inputs that a recording has there."""
    variables = fmpy.read_model_description(file).modelVariables
    inputs = [item.name for item in variables if item.causality == "input" and item.name in channels]
    names = [item.name for item in variables if item.causality == "output"]
    instance = Instance(file, {name: float(channels[name][0]) for name in inputs})
    rows = []
    for number in range(len(time)):
        if number:
            instance.go_to(float(time[number]))
        rows.append([instance.get(name) for name in names])
        for name in inputs:
            instance.set(name, float(channels[name][number]))
    instance.close()
    assert "command" in inputs
    return dict(zip(names, np.array(rows).T, strict=True))


@pytest.mark.short
@pytest.mark.usefixtures("quick_units")
@pytest.mark.parametrize("case", parameters((*SHORT, *GROUPS)))
def test_a_plant_under_recorded_inputs_has_the_bits_of_the_loop(case: Case, tmp_path: Path) -> None:
    scenario = scenario_of(case)
    plant = plant_alone(scenario)
    with run_by(""):
        answer = answer_of(simulate(replace(scenario, run=replace(scenario.run, output_interval=plant.step))))
    ((name, content),) = functional_unit(plant, 2, ["linux64"]).items()
    (tmp_path / name).write_bytes(content)
    found = replayed(str(tmp_path / name), answer.time, dict(answer.channels))
    assert_same_channels(found, answer)
