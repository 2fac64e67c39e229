"""The load of the page is one function: it is the same in every way in which a device runs."""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import ScenarioError
from ppafo.model.catalog import EFFECTS
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.walking import load_walk
from tests.page_code import block_with, write_package
from tests.reference.reference_solver import compare_with_reference

PAGE = "how-to/load.md"
FREE = ("motion.kind=free", "run.duration=0.1 s")
FAN, OWN = (f"effects.{name}.drag=0.05 N m s^2/rad^2" for name in ("fan", "joint_load"))
SPRING = "effects.joint_load.stiffness=5 N m/rad"


@pytest.fixture(autouse=True)
def _installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The package of the page, as an installer leaves it."""
    module = block_with(PAGE, "LOAD = Effect")
    entry_points = block_with(PAGE, "ppafo.effects")
    write_package(tmp_path / "site", "my_loads.fan", module, entry_points)
    monkeypatch.syspath_prepend(tmp_path / "site")
    yield
    EFFECTS.pop("fan", None)
    for name in [name for name in sys.modules if name.split(".")[0] == "my_loads"]:
        del sys.modules[name]


@pytest.mark.parametrize("backend", ["", "python"])
def test_the_function_of_the_page_is_the_shipped_drag_beside_a_spring(
    backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", backend)
    angles = [simulate(load_scenario("step-response", (*FREE, SPRING, drag))).recording["angle"] for drag in (FAN, OWN)]
    np.testing.assert_allclose(angles[0], angles[1], rtol=0.0, atol=1.0e-13)
    without = simulate(load_scenario("step-response", (*FREE, SPRING))).recording["angle"]
    assert np.abs(angles[0] - without).max() > 0.01


def test_the_reference_solver_has_the_same_load() -> None:
    agreement = compare_with_reference(plan_run(load_scenario("step-response", (*FREE, SPRING, FAN))))
    assert agreement.angle < 2e-4
    assert agreement.worst_pressure < 1e-3


def test_a_load_that_is_too_stiff_for_the_steps_of_a_walk_is_refused_with_a_step_that_does() -> None:
    stiff = FAN.replace("0.05", "10")
    remedy = (
        r"effects\.fan: a drag of .* N m s/rad at 5 rad/s needs steps of at most .* ms, .*: set run\.step = 0\.18 ms"
    )
    with pytest.raises(ScenarioError, match=remedy):
        plan_run(load_walk("solenoid", (stiff,)))
    assert plan_run(load_walk("solenoid", (stiff, "run.step=0.18 ms"))).step < 0.181e-3
