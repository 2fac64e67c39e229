"""Actuators that are no vane: the lanes against the reference solver."""

from pathlib import Path

import pytest

from ppafo import load_scenario
from ppafo.simulation.plan import plan_run
from tests.reference.reference_solver import compare_with_reference

EXAMPLE = Path(__file__).parents[1] / "actuators"


@pytest.mark.parametrize("kind", ["cylinder", "measured-bladder"])
def test_a_step_response_agrees_with_the_reference_solver(kind: str) -> None:
    run = plan_run(load_scenario(EXAMPLE / f"step-response-{kind}.toml", ["run.duration=0.3 s"]))
    found = compare_with_reference(run)
    assert found.angle < 2e-4
    assert found.worst_pressure < 1e-3
    assert found.supplied < 1e-4
