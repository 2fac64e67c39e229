"""The plugin of MuJoCo: bits of the lanes on the angle that the joint took, restored states, work, refusals."""

import copy
import ctypes
import json
import math
import os
import re
import runpy
import shutil
import subprocess
import threading
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.engine.lanes import StepInputs, replay
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import batch_of
from ppafo.errors import ParameterError, ScenarioError
from ppafo.exports.fmu import compiler_for, host_platform
from ppafo.exports.mujoco import Headers, attributes_of, installed_headers, plugin_files, plugin_library
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.simulation.recorded import held_vane, with_prescribed_angle
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, Scenario, Sensors

mujoco: Any = pytest.importorskip("mujoco", reason="MuJoCo is not installed (pip install 'ppafo[mujoco]')")
pytestmark = pytest.mark.skipif(host_platform() != "linux64", reason="plugins are run in the tests on linux64 alone")
STEPS = 600
STEP = 2.0e-3
LEG = """<mujoco><compiler angle="radian"/><option timestep="{step}"><flag warmstart="disable"/></option>
<worldbody><body name="foot">
<joint name="ankle" type="hinge" axis="0 1 0" range="-1.2 0.69" limited="true"/>
<geom type="box" pos="0.06 0 -0.06" size="0.12 0.04 0.02" mass="1"/></body></worldbody></mujoco>"""
WINDOWS_MUJOCO = "PPAFO_WINDOWS_MUJOCO"
"""The environment variable that names a folder with an unpacked wheel of MuJoCo for Windows."""
ROWS = {"mass_1": "state.mass_1", "mass_2": "state.mass_2", "supplied_mass": "state.supplied_mass"}


@dataclass(frozen=True)
class Folder:
    """A folder that was written, its scenario, and the plugin that was loaded from it."""

    path: Path
    scenario: Scenario
    plugin: Any


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo writes its warnings into a file where it is."""
    monkeypatch.chdir(tmp_path)


def written(path: Path, name: str, overrides: tuple[str, ...] = ()) -> Folder:
    """Write and load the plugin of a scenario."""
    from ppafo.worlds.mujoco import load_plugin

    words = [word for item in overrides for word in ("--set", item)]
    assert main(["export", "mujoco", name, "--out", str(path), *words]) == 0
    return Folder(path, load_scenario(name, overrides), load_plugin(path))


@pytest.fixture(scope="module")
def proportional(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    """A plugin with a slow valve: its commands come late, and it needs finer steps than MuJoCo's."""
    return written(tmp_path_factory.mktemp("slow") / "plugin", "torque-task-slow-valve")


@pytest.fixture(scope="module")
def solenoid(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    """One with valves that are on or off; its volumes are those that its torque wants."""
    same = ("actuator.volume_per_angle=14.51 cm^3/rad",)
    return written(tmp_path_factory.mktemp("pair") / "plugin", "torque-task-solenoid", same)


def spec_of(folder: Folder, **given: Any) -> Any:
    """A foot on a hinge with the device."""
    from ppafo.worlds.mujoco import add_device

    spec = mujoco.MjSpec.from_string(LEG.format(step=STEP))
    add_device(spec, folder.plugin, "device", joint="ankle", **given)
    return spec


def model_of(folder: Folder, **given: Any) -> Any:
    """A foot on a hinge with the device, compiled."""
    return spec_of(folder, **given).compile()


def driven(model: Any, data: Any, commands: np.ndarray, folder: Folder) -> tuple[np.ndarray, np.ndarray]:
    """Angles of the device before each step and after the last one, and its outputs after each."""
    angles, found, count = [], [], len(folder.plugin.outputs)
    low, high = folder.plugin.joint["lowest_angle"], folder.plugin.joint["highest_angle"]
    for command in commands:
        angles.append(math.pi / 2 + data.qpos[0])
        data.ctrl[0] = command
        mujoco.mj_step(model, data)
        found.append(data.plugin_state[:count].copy())
    return np.clip([*angles, math.pi / 2 + data.qpos[0]], low, high), np.array(found)


def commands_of(folder: Folder) -> np.ndarray:
    """Commands that hold for some steps each, drawn once."""
    drawn = np.repeat(np.random.default_rng(3).uniform(-1.0, 1.0, STEPS // 100), 100)
    return np.round(drawn) if folder.scenario.device.valve.kind != "proportional" else drawn


def check_against_lanes(folder: Folder, angles: np.ndarray, commands: np.ndarray, found: np.ndarray) -> None:
    """Check that the lanes have the same gas, bit by bit, on the angles that a joint took under some commands."""
    parts = math.ceil(STEP / folder.plugin.attributes["run.step"] - 1e-9)
    step = STEP / parts
    chosen = replace(
        folder.scenario,
        motion=held_vane(angles[0]),
        duration=STEPS * STEP,
        time_step=step,
        output_interval=step,
        control=Control(PYTHON_CONTROLLER, {}, step),
        sensors=Sensors(),
    )
    run = with_prescribed_angle(plan_run(chosen), angles[0])
    assert (run.step, run.step_count) == (step, STEPS * parts)
    times = np.arange(STEPS + 1) * parts * step
    path = {"path.start": times[:-1], "path.level": angles[:-1], "path.rate": np.diff(angles) / np.diff(times)}
    inputs = StepInputs(np.repeat(commands, parts), {key: np.repeat(item, parts) for key, item in path.items()})
    record = replay(batch_of(run), inputs).record[parts::parts, :, 0]
    rows, names = row_numbers(run.program.state_rows()), list(folder.plugin.outputs)
    for output, row in ROWS.items():
        assert np.array_equal(found[:, names.index(output)], record[:, rows[row]]), output


@pytest.mark.parametrize("name", ["proportional", "solenoid"])
def test_the_lanes_have_the_same_bits_on_the_angle_that_the_joint_took(
    name: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PPAFO_BACKEND", "c")
    folder = request.getfixturevalue(name)
    model, commands = model_of(folder), commands_of(folder)
    data = mujoco.MjData(model)
    data.qpos[0] = -0.2
    angles, found = driven(model, data, commands, folder)
    assert np.ptp(angles) > 0.5
    check_against_lanes(folder, angles, commands, found)


@pytest.mark.parametrize("name", ["proportional", "solenoid"])
def test_a_library_for_windows_has_the_bits_of_the_lanes(
    name: str, request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not (named := os.environ.get(WINDOWS_MUJOCO)):
        pytest.skip(f"{WINDOWS_MUJOCO} names no unpacked wheel of MuJoCo for Windows")
    unpacked = Path(named).absolute()
    if shutil.which("wine") is None:
        pytest.skip("wine is not on this machine")
    pytest.importorskip("ziglang", reason="needs the extra 'native'")
    monkeypatch.setenv("PPAFO_BACKEND", "c")
    folder = request.getfixturevalue(name)
    headers = Headers(unpacked / "mujoco" / "include", mujoco.__version__)
    for file, content in plugin_files(folder.scenario, ["win64"], headers).items():
        (tmp_path / Path(file).name).write_bytes(content)
    (tmp_path / "model.xml").write_text(spec_of(folder).to_xml(), encoding="utf-8")
    driver, library = tmp_path / "drive.exe", next(tmp_path.glob("*.dll"))
    written = ["-I", str(headers.include), str(Path(__file__).parent / "drive_plugin.c"), "-o", str(driver)]
    subprocess.run([*compiler_for("win64"), *written], check=True)
    given = [unpacked / "mujoco" / "mujoco.dll", library, tmp_path / "model.xml", "-0.2", len(folder.plugin.outputs)]
    commands = commands_of(folder)
    done = subprocess.run(
        ["wine", str(driver), *map(str, given)],
        input="".join(f"{float(command).hex()}\n" for command in commands),
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "WINEDEBUG": "-all"},
    )
    rows = [[float.fromhex(word) for word in line.split()] for line in done.stdout.splitlines()]
    low, high = folder.plugin.joint["lowest_angle"], folder.plugin.joint["highest_angle"]
    angles = np.clip(math.pi / 2 + np.array([row[0] for row in rows]), low, high)
    assert np.ptp(angles) > 0.5
    check_against_lanes(folder, angles, commands, np.array([row[1:] for row in rows[:-1]]))


@pytest.mark.parametrize("name", ["proportional", "solenoid"])
def test_a_restored_state_goes_on_with_the_same_bits(name: str, request: pytest.FixtureRequest) -> None:
    folder = request.getfixturevalue(name)
    model, commands = model_of(folder), commands_of(folder)
    data, other = mujoco.MjData(model), mujoco.MjData(model)
    driven(model, data, commands[:311], folder)
    kept = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, kept, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    mujoco.mj_setState(model, other, kept, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    outcomes = [driven(model, item, commands[311:], folder) for item in (data, other)]
    assert all(np.array_equal(*pair) for pair in zip(*outcomes, strict=True))


def test_copied_data_go_on_alone_with_the_same_bits(proportional: Folder) -> None:
    model, commands = model_of(proportional), commands_of(proportional)
    data = mujoco.MjData(model)
    driven(model, data, commands[:200], proportional)
    copied = copy.copy(data)
    first = driven(model, data, commands[200:], proportional)
    del data
    assert all(
        np.array_equal(*pair) for pair in zip(first, driven(model, copied, commands[200:], proportional), strict=True)
    )


def test_work_into_the_joint_is_that_of_the_gas(solenoid: Folder) -> None:
    model = model_of(solenoid)
    data = mujoco.MjData(model)
    names = list(solenoid.plugin.outputs)
    commands = np.repeat(np.tile([1.0, -1.0], 6), 60)
    into_joint, difference, turned = 0.0, [0.0], []
    for command in commands:
        data.ctrl[0] = command
        before, rate = data.qpos[0], data.qvel[0]
        mujoco.mj_step(model, data)
        turned.append(data.qpos[0] - before)
        into_joint += data.qfrc_actuator[0] * 0.5 * STEP * (rate + data.qvel[0])
        difference.append(data.plugin_state[names.index("pressure_1")] - data.plugin_state[names.index("pressure_2")])
    mean = 0.5 * (np.array(difference)[1:] + np.array(difference)[:-1])
    of_gas = float((mean * turned).sum()) * solenoid.scenario.device.actuator.volume_per_angle
    assert of_gas > 1.0
    assert into_joint == pytest.approx(of_gas, rel=0.01)


@pytest.mark.parametrize("integrator", ["EULER", "RK4", "IMPLICIT", "IMPLICITFAST"])
def test_shut_chambers_are_a_spring_that_keeps_its_energy(integrator: str, proportional: Folder) -> None:
    shut = {"actuator.leak.area": 0.0, "initial.pressure_1": 4.0e5, "initial.pressure_2": 3.5e5}
    model = model_of(proportional, settings=shut)
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    model.opt.gravity[:] = model.dof_damping[:] = model.dof_frictionloss[:] = 0.0
    data = mujoco.MjData(model)
    swings = driven(model, data, np.zeros(800), proportional)[0]
    assert np.ptp(swings[:200]) > 0.1
    assert np.ptp(swings[-200:]) == pytest.approx(np.ptp(swings[:200]), rel=0.01)


def test_a_joint_that_counts_the_other_way_round_moves_the_other_way(solenoid: Folder) -> None:
    from ppafo.worlds.mujoco import outputs_of

    ends = []
    for gear in (1.0, -1.0):
        model = model_of(solenoid, gear=gear, neutral=math.pi / 2)
        model.opt.gravity[:] = 0.0
        data = mujoco.MjData(model)
        data.ctrl[0] = 1.0
        mujoco.mj_step(model, data, 20)
        ends.append(float(data.qpos[0]))
        assert outputs_of(model, data, solenoid.plugin, "device")["torque"] > 0.5
        mujoco.mj_forward(model, data)
        assert data.sensor("device").data[2] == outputs_of(model, data, solenoid.plugin, "device")["pressure_1"]
    assert ends[0] > 0.01
    assert ends[1] == pytest.approx(-ends[0], rel=1e-9)


def test_the_example_of_the_folder_runs_and_is_reset(solenoid: Folder) -> None:
    model = mujoco.MjModel.from_xml_path(str(solenoid.path / "example.xml"))
    data = mujoco.MjData(model)
    first = data.plugin_state.copy()
    data.ctrl[0] = 1.0
    mujoco.mj_step(model, data, 300)
    assert data.sensor("device").data[2] > 3.0e5
    mujoco.mj_resetData(model, data)
    assert np.array_equal(data.plugin_state, first)


def test_settings_of_mujoco_for_its_actuators_are_heeded(proportional: Folder) -> None:
    place = list(proportional.plugin.outputs).index("command")

    def after_ten(model: Any, command: float = 1.0) -> tuple[float, float]:
        data = mujoco.MjData(model)
        data.ctrl[0] = command
        mujoco.mj_step(model, data, 10)
        return float(data.plugin_state[place]), float(data.qfrc_actuator[0])

    model = model_of(proportional)
    assert after_ten(model, math.inf)[0] == 0.0
    model.actuator_ctrlrange[0] = 0.1, 0.25
    assert [after_ten(model, command)[0] for command in (1.0, -1.0)] == [0.25, 0.1]
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL
    assert after_ten(model)[0] == 1.0
    assert after_ten(model)[1] > 0.0
    model.opt.disableactuator = 1 << int(model.actuator_group[0])
    assert after_ten(model) == (0.0, 0.0)
    model.opt.disableactuator = 0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    assert after_ten(model) == (0.0, 0.0)


def test_a_command_that_is_no_number_is_none_and_an_angle_beyond_the_stops_is_a_stop(solenoid: Folder) -> None:
    model = model_of(solenoid)
    data = mujoco.MjData(model)
    data.qpos[0] = 9.0
    data.ctrl[0] = math.nan
    mujoco.mj_step(model, data)
    assert data.plugin_state[0] == solenoid.plugin.joint["highest_angle"]
    assert list(solenoid.plugin.outputs)[5] == "command"
    assert data.plugin_state[5] == 0.0


def test_a_finer_step_of_mujoco_is_taken_between_two_runs(solenoid: Folder) -> None:
    model = model_of(solenoid)
    data = mujoco.MjData(model)
    data.ctrl[0] = 1.0
    mujoco.mj_step(model, data, 100)
    high = data.plugin_state[2]
    assert high > 3.0e5
    model.opt.timestep = 1.0e-4
    data.ctrl[0] = -1.0
    mujoco.mj_step(model, data, 600)
    # The pair switches at most every 50 ms of a time that went on.
    assert data.plugin_state[2] < 0.8 * high


def test_a_coarser_step_soon_after_the_beginning_keeps_the_gas(solenoid: Folder) -> None:
    model = model_of(solenoid)
    model.opt.timestep = 1.0e-4
    data = mujoco.MjData(model)
    data.ctrl[0] = 1.0
    mujoco.mj_step(model, data, 4)
    place = list(solenoid.plugin.outputs).index("supplied_mass")
    supplied = data.plugin_state[place]
    assert supplied > 0.0
    model.opt.timestep = 1.0e-3
    data.ctrl[0] = 0.0
    mujoco.mj_step(model, data)
    assert data.plugin_state[place] >= supplied


def test_a_state_that_was_saved_at_another_step_keeps_its_time(solenoid: Folder) -> None:
    model = model_of(solenoid)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 500)
    saved = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_INTEGRATION))
    mujoco.mj_getState(model, data, saved, mujoco.mjtState.mjSTATE_INTEGRATION)
    model.opt.timestep = 1.0e-4
    mujoco.mj_step(model, data, 10)
    mujoco.mj_setState(model, data, saved, mujoco.mjtState.mjSTATE_INTEGRATION)
    mujoco.mj_step(model, data)
    steps_done = data.plugin_state[len(solenoid.plugin.outputs)]
    assert steps_done * 1.0e-4 == pytest.approx(500 * STEP + 1.0e-4, abs=1.0e-9)


@pytest.mark.parametrize("step", [0.0, -1.0e-3, 1.0e-9])
def test_a_timestep_that_cannot_be_is_refused_as_such(step: float, solenoid: Folder) -> None:
    model = model_of(solenoid)
    data = mujoco.MjData(model)
    model.opt.timestep = step
    for _ in range(2):
        with pytest.raises(mujoco.FatalError, match=f"a timestep of {step:g} s is out of range"):
            mujoco.mj_step(model, data)


def test_white_space_about_a_number_is_none_of_it(solenoid: Folder) -> None:
    text = (solenoid.path / "example.xml").read_text()
    spaced = re.sub(r'(key="supply.pressure" value=")[^"]*', r"\1 &#9;4.0e5&#9;&#10; ", text)
    assert spaced != text
    data = mujoco.MjData(mujoco.MjModel.from_xml_string(spaced))
    assert data.plugin_state[0] > 0.0


def test_a_valve_with_a_delay_keeps_the_step_that_its_model_was_compiled_with(proportional: Folder) -> None:
    model = model_of(proportional)
    data = mujoco.MjData(model)
    model.opt.timestep = 1.0e-4
    with pytest.raises(mujoco.FatalError, match="the delay of the valve is counted in timesteps"):
        mujoco.mj_step(model, data)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"supply.pressure": -5.0}, "supply.pressure is out of range"),
        ({"supply.pressure": math.nan}, "supply.pressure is not a number"),
        ({"run.step": 0.0}, "run.step must be above 0"),
        ({"run.step": 1e-30}, "run.step is out of range"),
        ({"valve.switching_interval": 9e9}, "valve.switching_interval is out of range"),
    ],
)
def test_numbers_that_cannot_be_are_refused_by_name(settings: dict[str, float], said: str, solenoid: Folder) -> None:
    with pytest.raises((ValueError, mujoco.FatalError), match=said):
        model_of(solenoid, settings=settings)


def test_stops_may_leave_out_the_angle_that_the_export_had(solenoid: Folder) -> None:
    model = model_of(solenoid, settings={"actuator.angle_min": 1.7})
    assert mujoco.MjData(model).plugin_state[0] == 1.7


def test_the_page_of_a_folder_says_what_its_valve_does_and_its_snippet_runs(
    solenoid: Folder, proportional: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (solenoid.path / "README.md").read_text()
    assert "0 neither: both chambers vent" in page
    assert "at 0 both chambers are shut" in (proportional.path / "README.md").read_text()
    monkeypatch.chdir(solenoid.path)
    names: dict[str, Any] = {}
    exec(page.split("```python\n")[1].split("```")[0], names)
    assert names["data"].sensor("device").data[2] > 2.0e5


def test_what_cannot_be_put_at_a_joint_is_refused(solenoid: Folder, tmp_path: Path) -> None:
    from ppafo.worlds.mujoco import add_device, load_plugin, outputs_of

    spec = mujoco.MjSpec.from_string(LEG.format(step=STEP))
    for words, said in (
        ({"joint": "ankel"}, "no joint 'ankel', did you mean 'ankle'"),
        ({"joint": "ankle", "gear": 2.0}, "must be 1 or -1"),
        ({"joint": "ankle", "settings": {"supply.presure": 1.0}}, "did you mean 'supply.pressure'"),
        ({"joint": "ankle", "gear": "-1"}, "gear '-1': must be 1 or -1"),
        ({"joint": "ankle", "settings": {"supply.pressure": "4.5 bar"}}, "supply.pressure '4.5 bar': must be a number"),
        ({"joint": "ankle", "settings": {"supply.pressure": None}}, "supply.pressure None: must be a number"),
    ):
        with pytest.raises(ScenarioError, match=said):
            add_device(spec, solenoid.plugin, "device", **words)
    model = model_of(solenoid)
    with pytest.raises(ScenarioError, match="did you mean 'device'"):
        outputs_of(model, mujoco.MjData(model), solenoid.plugin, "devise")
    with pytest.raises(ScenarioError, match="no folder of 'ppafo export mujoco'"):
        load_plugin(tmp_path)
    (tmp_path / "device.json").write_text(
        (solenoid.path / "device.json").read_text().replace(f'"mujoco": "{mujoco.__version__}"', '"mujoco": "3.0.0"')
    )
    with pytest.raises(ScenarioError, match=r"built for MuJoCo 3\.0\.0"):
        load_plugin(tmp_path)


def test_a_folder_that_is_damaged_is_refused_with_its_cause(solenoid: Folder, tmp_path: Path) -> None:
    from ppafo.worlds.mujoco import load_plugin

    numbers = json.loads((solenoid.path / "device.json").read_text())
    library = (solenoid.path / numbers["libraries"]["linux64"]).read_bytes()
    own, name = {"linux64": "a.so"}, numbers["plugin"]
    elsewhere = b"\x7fELF" + bytes(60) + name.encode() + b"\0ppafo_plugin_identity\0"
    for place, (changed, content, said) in enumerate(
        (
            ({"libraries": ["a.so"]}, library, "device.json cannot be read"),
            ({"libraries": {"linux64": 3}}, library, "device.json cannot be read"),
            ({"plugin": 3}, library, "device.json cannot be read"),
            ({"plugin": f"{name}_other"}, library, "or not of plugin"),
            ({"identity": ""}, library, "a process takes one plugin of a name"),
            ({}, b"damaged", r"a\.so is damaged"),
            ({}, library[: len(library) // 2], r"a\.so is damaged"),
            ({}, elsewhere, "Error loading .* run 'ppafo export mujoco' again"),
            ({}, library, "a process takes one plugin of a name"),
        )
    ):
        folder = tmp_path / str(place)
        folder.mkdir()
        (folder / "device.json").write_text(json.dumps({**numbers, "libraries": own, **changed}))
        (folder / "a.so").write_bytes(content)
        with pytest.raises(ScenarioError, match=said):
            load_plugin(folder)
    # An error of MuJoCo that leaves the loader of the system by a jump lets no other thread load anything any more.
    other = threading.Thread(target=ctypes.CDLL, args=(None,), daemon=True)
    other.start()
    other.join(10.0)
    assert not other.is_alive()


def test_the_example_tells_what_an_ideal_motor_hides(
    proportional: Folder, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    script = resources.files("ppafo") / "examples" / "mujoco" / "push_off.py"
    monkeypatch.setattr("sys.argv", ["push_off.py", str(proportional.path)])
    runpy.run_path(str(script))
    ideal, gas = capsys.readouterr().out.splitlines()
    assert "error 0.00 N m (root mean square), 0 ms late, gas 0.000 g" in ideal
    late, grams = re.search(r"(\d+) ms late, gas (\S+) g", gas).groups()  # type: ignore[union-attr]
    assert int(late) > 5
    assert float(grams) > 0.1


def test_a_joint_that_is_no_hinge_is_refused_by_the_plugin(solenoid: Folder) -> None:
    text = (solenoid.path / "example.xml").read_text().replace('type="hinge"', 'type="slide"')
    with pytest.raises(ValueError, match="must drive a hinge joint"):
        mujoco.MjModel.from_xml_string(text)


def test_a_platform_that_is_none_is_refused() -> None:
    with pytest.raises(ScenarioError, match="platform 'linux65' is not known, did you mean 'linux64'"):
        plugin_files(load_scenario("step-response"), ["linux65"], installed_headers())


def test_a_computer_without_a_library_of_its_own_is_told_of_platforms() -> None:
    with pytest.raises(ScenarioError, match="--platforms linux64 or win64"):
        plugin_files(load_scenario("torque-task-solenoid"), [], installed_headers())


def test_an_actuator_that_is_no_vane_is_refused() -> None:
    muscles = resources.files("ppafo") / "examples" / "actuators" / "torque-task-muscles.toml"
    with pytest.raises(ParameterError, match="a plugin of MuJoCo is made for a vane"):
        plugin_library(load_scenario(Path(str(muscles))))


def test_friction_is_the_joints_and_no_attribute() -> None:
    paths = [item.path for item in attributes_of(plugin_library(load_scenario("step-response")))]
    assert "valve.area" in paths
    assert not [path for path in paths if path.startswith(("friction", "foot_plate", "run.duration"))]
