"""The load of the page is one function: it is the same in every way in which a device runs."""

import importlib
import importlib.util
import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from ppafo.analyses.linearise.question import linearise
from ppafo.errors import ScenarioError
from ppafo.exports.fmu.interface import closed_loop
from ppafo.exports.fmu.platforms import host_platform
from ppafo.exports.fmu.unit import functional_unit
from ppafo.model.catalog import EFFECTS
from ppafo.running import gains, simulate
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.walking import load_walk
from ppafo.walking.planning import plan_walk
from ppafo.walking.walk import walk
from tests.page_code import block_with, write_package
from tests.reference.reference_solver import compare_with_reference

PAGE = "how-to/load.md"
FREE = ("motion.kind=free", "run.duration=0.1 s")
FAN, OWN = (f"effects.{name}.drag=0.05 N m s^2/rad^2" for name in ("fan", "joint_load"))
SPRING = "effects.joint_load.stiffness=5 N m/rad"


@pytest.fixture(autouse=True)
def _installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The package of the page, as an installer leaves it."""
    module, entry_points = block_with(PAGE, "LOAD = Effect"), block_with(PAGE, "ppafo.effects")
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


def test_a_linear_model_damps_by_the_slope_of_the_drag() -> None:
    without, model = (linearise("step-response", at=0.05, overrides=(*FREE, *more)).found for more in ((), (FAN,)))
    names = [state.name for state in model.states]
    row = names.index("angular_velocity")
    speed = model.states[row].value
    assert speed > 1.0
    inertia = load_scenario("step-response", FREE).device.foot_plate.inertia
    assert model.a[row, row] - without.a[row, row] == pytest.approx(-2.0 * 0.05 * speed / inertia, rel=1e-3)


@pytest.mark.long
@pytest.mark.skipif(
    importlib.util.find_spec("fmpy") is None or host_platform() != "linux64", reason="needs FMPy on linux64"
)
def test_a_unit_has_the_load_with_the_bits_of_python(tmp_path: Path) -> None:
    fmpy = importlib.import_module("fmpy")
    scenario = load_scenario("step-response", (*FREE, FAN))
    ((file, content),) = functional_unit(closed_loop(scenario), 2, ["linux64"]).items()
    (tmp_path / file).write_bytes(content)
    moved = simulate(load_scenario("step-response", (*FREE, FAN.replace("0.05", "0.25"))))
    given = {"stop_time": scenario.run.duration, "step_size": scenario.run.output_interval}
    table = fmpy.simulate_fmu(str(tmp_path / file), start_values={"effects.fan.drag": 0.25}, **given)
    np.testing.assert_array_equal(table["angle"], moved.recording["angle"])


def test_a_load_that_is_too_stiff_for_the_steps_of_a_walk_is_refused_with_a_step_that_does() -> None:
    stiff = FAN.replace("0.05", "10")
    remedy = (
        r"effects\.fan: a drag of .* N m s/rad at 5 rad/s needs steps of at most .* ms, .*: set run\.step = 0\.18 ms"
    )
    with pytest.raises(ScenarioError, match=remedy):
        plan_walk(load_walk("solenoid", (stiff,)))
    assert plan_walk(load_walk("solenoid", (stiff, "run.step=0.18 ms"))).step < 0.181e-3


@pytest.mark.long
def test_a_walk_is_slowed_by_the_drag_and_does_the_same_with_shorter_steps() -> None:
    drag = FAN.replace("0.05", "1")
    runs = [walk(load_walk("solenoid", more), minutes=0.1) for more in ((), (drag,), (drag, "run.step=0.2 ms"))]
    without, slowed, finer = (run.recording for run in runs)
    assert np.abs(slowed["angular_velocity"]).max() < 0.8 * np.abs(without["angular_velocity"]).max()
    assert np.sqrt(np.mean((slowed["angle"] - finer["angle"]) ** 2)) < math.radians(0.2)


def test_gains_that_are_computed_for_an_angle_say_that_they_do_not_know_it() -> None:
    for more, knows in (((), True), ((FAN,), False)):
        found = gains(load_scenario("swing-foot-angle", more))
        assert found is not None
        assert found.sentence.endswith("; the load of effects.fan is not included") is not knows
