"""The doors of Python: compiled code, an ensemble, a result that was stored and read again."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.control.catalog import CONTROLLERS
from ppafo.control.kind import ControllerKind
from ppafo.control.walking.catalog import PROPORTIONAL
from ppafo.engine.channels import TRACED
from ppafo.engine.loading import PYTHON
from ppafo.engine.rows import rebuilt
from ppafo.loading import load_scenario
from ppafo.measuring import evaluate
from ppafo.model.sensors import Measurement
from ppafo.running import simulate
from ppafo.simulation.ensemble import COMPLETED, offered, run_ensemble
from ppafo.simulation.scenario import Scenario
from ppafo.storage.reading import read_recording
from tests.doors.of_python import (
    answer_of,
    assert_near_metrics,
    assert_same_channels,
    compiled_result,
    parameter,
    parameters,
    python_answer,
    run_by,
    scenario_of,
)
from tests.doors.table import CASES, Case

VARIED = "supply.pressure"


@pytest.mark.parametrize("case", parameters())
def test_compiled_code_has_the_bits_of_python(case: Case) -> None:
    answer = python_answer(case)
    found = answer_of(compiled_result(case))
    assert found.ended == answer.ended
    assert found.time.tobytes() == answer.time.tobytes()
    assert list(found.channels) == list(answer.channels)
    assert_same_channels(found.channels, answer)
    assert found.metrics == answer.metrics


class OfKind:
    """A law of the catalogue as an object of Python."""

    def __init__(self, law: ControllerKind, scenario: Scenario) -> None:
        settings = scenario.controller.settings
        self.law = law
        self.period = scenario.controller.period
        self.parameters = rebuilt(law.parameters, (settings[item.name] for item in law.quantities))

    def reset(self) -> None:
        """Begin as the law does."""
        self.state = self.law.initial

    def update(self, time: float, reference: float, measurement: Any) -> float:
        """Command of the law [-]."""
        sample = Measurement(**{name: getattr(measurement, name) for name in Measurement._fields})
        command, self.state = self.law.update(self.parameters, self.state, reference, sample, self.period)
        return float(command)


@pytest.mark.parametrize(
    ("name", "law", "duration"),
    [("torque-task-proportional", CONTROLLERS["pid"], 0.5), ("proportional", PROPORTIONAL, 6.0)],
)
def test_an_object_of_python_is_told_what_its_law_is_told(name: str, law: ControllerKind, duration: float) -> None:
    """Of a vane and of a walk, in which it is reset and its chambers are vented as the law's are."""
    scenario = load_scenario(name, [f"run.duration={duration} s"])
    told = simulate(scenario.controlled_by(OfKind(law, scenario)))
    assert_same_channels({item: told[item] for item in told.recording.names}, answer_of(simulate(scenario)))
    assert "reference" in told.recording.names


def of_ensembles() -> list[Any]:
    """Every case; the short ones that walk are long here: their meters take Python ten times as long."""
    return [parameter(case, suite="long" if case.suite == "short" and case.walks else "") for case in CASES]


@pytest.mark.short
@pytest.mark.parametrize("case", of_ensembles())
def test_a_run_of_an_ensemble_has_the_bits_of_the_run_alone(case: Case) -> None:
    """Among others, of which one has another supply; those of short vanes are run by Python, which is quick enough."""
    answer = python_answer(case)
    scenario = scenario_of(case)
    # What follows torques is measured of a walk too, but is not among the metrics of one.
    metrics = [name for name in offered(scenario) if name in answer.metrics or not case.walks]
    bands = [name for name in TRACED if name in answer.channels]
    pressure = scenario.device.supply.pressure
    with run_by(PYTHON if case.suite == "short" and not case.walks else ""):
        # A run whose steps do not divide its output interval is recorded at the next multiple of them.
        every = float(answer.time[1])
        found = run_ensemble(scenario, {VARIED: np.array([1.01 * pressure, pressure])}, metrics, bands, every)
    assert found.status[1] == COMPLETED, found.reasons
    assert_same_channels({name: trace[:, 1] for name, trace in found.traces.items()}, answer)
    assert_near_metrics({name: float(values[1]) for name, values in found.metrics.items()}, answer)
    acts = any(found.traces[name][-1, 0] != found.traces[name][-1, 1] for name in bands)
    assert acts or answer.channels["supplied_mass"][-1] == 0.0, "the supply acts where gas is taken from it"


@pytest.mark.short
@pytest.mark.parametrize("case", parameters())
def test_a_result_that_was_stored_is_read_with_its_bits(case: Case, tmp_path: Path) -> None:
    answer = python_answer(case)
    folder = compiled_result(case).save(tmp_path / "result")
    for name in ("recording.nc", "recording.csv"):
        recording = read_recording(folder / name)
        assert recording.time.tobytes() == answer.time.tobytes()
        assert set(recording.names) == set(answer.channels)
        assert_same_channels({channel: recording[channel] for channel in recording.names}, answer)
    document = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    written = {name: metric["value"] for name, metric in document["metrics"].items()}
    assert written == {name: None if math.isnan(value) else value for name, value in answer.metrics.items()}
    measured = {name: metric.value for name, metric in evaluate(folder).items()}
    assert_near_metrics({name: measured[name] for name in measured if name in answer.metrics or not case.walks}, answer)
