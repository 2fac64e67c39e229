"""A device in OpenSim: its torque there, its gas under OpenSim's ankle, and muscles by OpenSim's own tools."""

import multiprocessing
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.errors import DataError, ParameterError, SimulationError
from tests.unit.worlds import opensim_process as apart

needs_opensim = pytest.mark.skipif(find_spec("opensim") is None, reason="needs the extra 'opensim' (Python up to 3.13)")
Run = Callable[..., Any]


@pytest.fixture(scope="module")
def run() -> Iterator[Run]:
    """Calls a function in a process that has OpenSim and no CasADi."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        yield lambda function, *given: pool.submit(function, *given).result()


@pytest.fixture
def run_alone() -> Iterator[Run]:
    """The same in a process of its own."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        yield lambda function, *given: pool.submit(function, *given).result()


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.fixture(scope="module")
def replayed(run: Run, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A shipped walk whose ankle OpenSim leads."""
    found: dict[str, Any] = run(apart.replay, "solenoid", tmp_path_factory.mktemp("replay"))
    return found


@needs_opensim
def test_an_actuator_that_is_no_vane_is_refused(run: Run) -> None:
    muscles = Path(str(files("ppafo") / "examples" / "actuators" / "torque-task-muscles.toml"))
    with pytest.raises(ParameterError, match="co-simulation in OpenSim is made for a vane, and 'muscle-pair'"):
        run(apart.device_of, muscles)


@needs_opensim
def test_gas_with_an_energy_balance_begins_at_rest_at_any_angle(run: Run) -> None:
    pressures = np.array(run(apart.warm_at_rest, 1.2))
    assert pressures == pytest.approx(np.full_like(pressures, pressures[0, 0]), rel=1.0e-6)


@needs_opensim
def test_a_run_that_failed_with_finite_numbers_says_so(run: Run) -> None:
    with pytest.raises(SimulationError, match="the simulation diverged at 0 s"):
        run(apart.failed)


@needs_opensim
def test_a_plate_has_the_inertia_and_weight_of_its_set_whatever_its_lever(run: Run) -> None:
    assert run(apart.heavy_plate) == pytest.approx((0.0084, 1.0), rel=1.0e-12)


@needs_opensim
def test_the_joint_torque_of_a_shipped_walk_is_within_a_percent(replayed: dict[str, Any]) -> None:
    found = replayed
    gas, torque = found["gas"], found["torque"]
    assert np.abs(torque).max() > 4.0
    assert rms(gas - torque) < 1.0e-3 * rms(torque)
    assert np.abs(gas - torque).max() < 1.0e-2 * np.abs(torque).max()
    assert found["supplied"][0] == pytest.approx(found["supplied"][1], rel=1.0e-3)
    # OpenSim's own inverse dynamics of leg, plate and actuator leaves what the wearer gives: T_ex, all terms of it.
    moment, external = found["moment"][50:], found["external"][50:]
    assert rms(moment - external) < 1.0e-2 * rms(external)
    assert rms(found["gas"][50:] - external) > 5.0e-2 * rms(external)


@needs_opensim
def test_the_actuator_gives_what_is_exchanged_half_a_step_ahead(replayed: dict[str, Any]) -> None:
    acts, samples = replayed["acts"], replayed["samples"]
    assert acts[2:] == pytest.approx(1.5 * samples[1:-1] - 0.5 * samples[:-2], abs=1.0e-12)


@needs_opensim
def test_a_free_foot_swings_as_without_opensim(run: Run) -> None:
    coarse, fine = (run(apart.swing, period) for period in (2.0e-3, 1.0e-3))
    errors = [float(np.abs(here - there).max()) for here, there in (coarse, fine)]
    assert np.ptp(fine[1]) > np.radians(30.0)
    assert errors[1] < np.radians(0.1)
    assert errors[1] < 0.5 * errors[0]


@needs_opensim
def test_an_ankle_beyond_the_stops_is_an_error_with_time_and_angle(run: Run) -> None:
    with pytest.raises(SimulationError, match=r"solenoid: at 0\.\d+ s the ankle goes to -\S+ deg, beyond the stops"):
        run(apart.beyond_the_stops)


@needs_opensim
@pytest.mark.parametrize("command", [np.nan, np.inf, -np.inf, 5.0, 1.2, 1.5, 1.99, -1.01])
def test_what_is_no_command_is_refused_before_opensim_goes_on(run: Run, command: float) -> None:
    assert run(apart.command_after_a_step, command) == 0.0


@needs_opensim
@pytest.mark.parametrize("command", [-1.0, 1.0, 2.0])
def test_commands_reach_from_vent_to_full(run: Run, command: float) -> None:
    assert run(apart.command_after_a_step, command) == pytest.approx(1.0e-3)


@needs_opensim
@pytest.mark.parametrize("angle", [np.nan, 9.0, -np.inf])
def test_a_device_begins_between_its_stops(run: Run, angle: float) -> None:
    with pytest.raises(SimulationError, match=r"solenoid: at 0 s the ankle goes to \S+ deg, beyond the stops"):
        run(apart.begun_at, angle)


@needs_opensim
def test_a_co_simulation_begins_anew(run: Run) -> None:
    first, second, (taken, supplied, used) = run(apart.anew)
    assert first == second
    assert (taken, supplied) == (0, 0.0)
    assert used > 0.0


@needs_opensim
def test_muscles_and_device_come_to_the_moment_of_inverse_dynamics(run: Run, tmp_path: Path) -> None:
    found = run(apart.muscles, tmp_path)
    assert found["moment"]["without"] - found["moment"]["with"] == pytest.approx(found["device"], abs=1.0e-4)
    assert found["moment"]["without"][0] == pytest.approx(-apart.FORCE * apart.LEVER, rel=0.2)
    for way, forces in found["forces"].items():
        given = sum(forces[name] * found["arms"][name] for name in forces) + found["reserve"][way]
        assert given == pytest.approx(found["moment"][way], abs=0.02 * apart.FORCE * apart.LEVER)
    spared = found["forces"]["without"]["soleus_r"] - found["forces"]["with"]["soleus_r"]
    assert spared == pytest.approx(found["device"] / found["arms"]["soleus_r"], rel=0.1)
    assert "soleus_r" in found["said"]
    assert (tmp_path / "figure.png").stat().st_size > 10_000


@needs_opensim
@pytest.mark.parametrize(
    ("what", "said"),
    [
        ("no-model", "no.osim: there is no such file; give a model of OpenSim"),
        ("broken-model", "broken.osim: "),
        ("other-model", "other.osim: "),
        ("motion", "shank.sto: has no column 'ankle_angle_r'"),
        ("loads", "no.xml: there is no such file; give external loads"),
        ("loads-body", "has no body 'foot', did you mean 'foot_r'?"),
        ("loads-table", "there is no data file"),
        ("coordinate", "has no coordinate 'ankle_angle', did you mean 'ankle_angle_r'?"),
        ("no-muscle", "no muscle crosses 'shank_angle'"),
        ("late", "goes from 0 to 0.5 s, and the torque from 0.1 to 4 s"),
    ],
)
def test_files_that_do_not_fit_are_refused_in_one_line(run: Run, tmp_path: Path, what: str, said: str) -> None:
    with pytest.raises(DataError) as error:
        run(apart.refused, what, tmp_path)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@needs_opensim
def test_the_script_puts_the_same_torque_into_a_model_in_both_forms(run: Run, tmp_path: Path) -> None:
    rows = run(apart.with_script, tmp_path)
    assert np.ptp(rows[:, 1]) > 1.0
    # OpenSim writes six digits into a model.
    assert rows[:, 0] == pytest.approx(rows[:, 1], rel=1.0e-5)
    assert rows[:, 2] == pytest.approx(rows[:, 3], rel=1.0e-6)


@needs_opensim
@pytest.mark.parametrize(
    ("first", "second", "codes"),
    [
        ([], [], [0, 2]),
        (["--as-load"], ["--as-load"], [0, 2]),
        (["--as-load"], [], [0, 2]),
        (["--coordinate", "slide"], [], [2, 2]),
    ],
)
def test_the_script_puts_one_device_on_an_angle(
    run: Run, tmp_path: Path, first: list[str], second: list[str], codes: list[int]
) -> None:
    assert run(apart.script_twice, tmp_path, first, second) == codes
    assert not (tmp_path / "two.osim").exists()


@needs_opensim
@pytest.mark.parametrize(
    ("coordinates", "said"),
    [
        (("ankle_angle_r", "ankle_angle_r"), "leg: has a device at 'ankle_angle_r' already (ankle_angle_r_device)"),
        (("slide", "slide"), "leg: 'slide' is no angle about one axis"),
    ],
)
def test_a_model_takes_one_device_at_an_angle(run: Run, coordinates: tuple[str, str], said: str) -> None:
    with pytest.raises(DataError) as error:
        run(apart.two_devices, *coordinates)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@needs_opensim
@pytest.mark.parametrize("content", ["", "<OpenSimDocument", "<?xml version='1.0'?><a/>", None])
def test_the_script_says_in_one_line_what_is_wrong_with_a_model(tmp_path: Path, content: str | None) -> None:
    (tmp_path / "torque.sto").write_text(apart.TORQUE, encoding="utf-8")
    if content is not None:
        (tmp_path / "leg.osim").write_text(content, encoding="utf-8")
    before = set(tmp_path.iterdir())
    script = Path(apart.ppafo.__file__).parent / "exports" / "opensim" / "add_device.py"
    words = [sys.executable, script, "leg.osim", "--torque", "torque.sto", "--out", "with.osim"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert done.stderr.startswith("add_device: leg.osim: ")
    assert "std::exception" not in done.stderr
    assert ".cpp" not in done.stderr
    assert set(tmp_path.iterdir()) == before


@needs_opensim
def test_the_example_without_a_model_runs(tmp_path: Path) -> None:
    script = Path(apart.ppafo.__file__).parent / "examples" / "opensim" / "co_simulation.py"
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    rows = [line for line in done.stdout.splitlines() if "ankle" in line]
    assert len(rows) == 8
    assert list(tmp_path.iterdir()) == []


@needs_opensim
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["co_simulation.py", "leg.osim", "no.mot"], "co_simulation: leg.osim: there is no such file"),
        (["co_simulation.py", "leg.osim"], "a model wants a motion"),
        (["ankle_muscles.py"], "the following arguments are required: model, motion, forces"),
        (["ankle_muscles.py", "leg.osim", "no.mot", "no.mot"], "ankle_muscles: out/mine/mine.toml: cannot be read"),
    ],
)
def test_an_example_without_its_files_says_so(tmp_path: Path, words: list[str], said: str) -> None:
    script = Path(apart.ppafo.__file__).parent / "examples" / "opensim" / words[0]
    done = subprocess.run(
        [sys.executable, script, *words[1:]], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


@needs_opensim
@pytest.mark.skipif(find_spec("casadi") is None, reason="needs the extra 'control'")
@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        ("casadi", "opensim", "ImportError: ppafo.worlds.opensim: casadi is loaded in this process"),
        ("opensim", "casadi", "SimulationError: opensim is loaded in this process"),
    ],
)
def test_casadi_and_opensim_are_kept_apart(run_alone: Run, first: str, second: str, said: str) -> None:
    line = run_alone(apart.meet, first, second)
    assert line.startswith(said)
    assert "process of its own" in line
