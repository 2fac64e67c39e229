"""What the page on walking says of analyses is found, and each point of a study is the single walk of its settings."""

import re
from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.analyses.find import find
from ppafo.loading import load_scenario
from ppafo.simulation.ensemble import run_ensemble
from ppafo.studies.loading import load_study
from ppafo.walking import walk

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "walk.md").read_text(encoding="utf-8")


def test_the_pressure_of_the_page_lifts_the_foot_as_the_walk_alone_says() -> None:
    given = ["run.duration=20 s"]
    found = find(
        "proportional",
        vary="supply.dorsiflexion_pressure=20..48 psi_g",
        such_that="toe_clearance >= -18 mm",
        highest=False,
        grid=16,
        overrides=given,
    ).found
    assert found.value is not None
    shown = re.search(r"dorsiflexion_pressure = ([\d.]+) psi_g", PAGE)
    assert shown is not None
    assert (found.value - 101325.0) / 6894.757 == pytest.approx(float(shown[1]), abs=1.0e-3)
    alone = walk("proportional", overrides=[*given, f"supply.dorsiflexion_pressure={found.value!r} Pa_a"])
    assert alone.metrics["toe_clearance"].value == pytest.approx(found.metric_at_value, rel=1.0e-12)


def test_a_point_of_the_sweep_is_the_single_walk() -> None:
    study = load_study("gas-of-a-stride")
    (axis,) = study.axes
    assert [item.name for item in study.configurations] == ["solenoid", "proportional"]
    level = axis.values[3]
    for item in study.configurations:
        columns = {axis.path: np.array([level])}
        found = run_ensemble(item.scenario, columns, study.outputs.metrics)
        alone = walk(item.scenario.name, overrides=["run.duration=20 s", f"{axis.path}={level!r} Pa_a"])
        for name in study.outputs.metrics:
            assert found.metrics[name][0] == pytest.approx(alone.metrics[name].value, rel=1.0e-12), name


def test_simulate_and_compare_take_a_walk() -> None:
    scenario = load_scenario("proportional", ["run.duration=8 s"])
    result = ppafo.simulate(scenario)
    alone = walk(scenario)
    assert result.metrics["gas"].value == alone.metrics["gas"].value
    assert {"gas_supplied", "largest_pressure"} <= set(result.metrics)
    assert "rms_error" not in result.metrics
