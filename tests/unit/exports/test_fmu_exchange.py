"""The plant for model exchange: FMPy and its CVODE integrate it from event to event as the reference solver does."""

import ctypes
import importlib
import math
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.engine.reference.solver import load_right_hand_side, solve_reference
from ppafo.engine.run import Run
from ppafo.exports.fmu import functional_unit, host_platform, plant_in_time
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from scripts.instances import begin

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed (pip install -e .[dev])")
pytestmark = pytest.mark.skipif(host_platform() != "linux64", reason="units are run in the tests on linux64 alone")
FREE = ("motion.kind=free",)
WARM = (
    "gas_model.kind=thermal",
    "gas_model.heat_transfer_coefficient=60 W/(m^2 K)",
    "gas_model.wall_area_per_volume=100 1/m",
)
DROOP = "supply_line.plantarflexion.droop=3e6 Pa s/kg"
REBOUND = "actuator.restitution=0.5"
SLOW = "valve.opening_delay=5 ms"
CASES = {
    "impacts on the stops": ("torque-task-solenoid", FREE),
    "rebounds, late coils": ("torque-task-solenoid", (*FREE, REBOUND, SLOW)),
    "a stick and a slip every millisecond, warm gas": (
        "torque-task-proportional",
        (*FREE, *WARM, "run.duration=1.5 s"),
    ),
    "a spool with a dead time, held": ("torque-task-slow-valve", ()),
    "a spool with play, ice": (
        "torque-task-proportional",
        (
            *FREE,
            "device.set=ppafo2011-consistent",
            "effects.spool_play.width=0.05",
            "effects.ice.blockage_per_gas=2000 1/kg",
        ),
    ),
    "gas that is not ideal": ("torque-task-solenoid", (*FREE, SLOW, "effects.second_virial.share=1")),
    "a third valve between the chambers": (
        "torque-task-solenoid",
        (*FREE, "device.valve=solenoid_recycling", "valve.joining_time=20 ms", "valve.opening_delay=8 ms"),
    ),
    "air muscles": ("torque-task-slow-valve", (*FREE, "device.set=muscle-pair")),
    "a foot on a shank that moves": ("swing-foot", ()),
}
SHORT = ("impacts on the stops",)
STATES = ("angle", "angular_velocity", "content_1", "content_2", "supplied_mass", "vented_mass", "leaked_mass")


def written(folder: Path, name: str, overrides: tuple[str, ...]) -> str:
    """Write the unit of a plant; its path."""
    ((file, content),) = functional_unit(plant_in_time(load_scenario(name, overrides)), 2, ["linux64"]).items()
    (folder / file).write_bytes(content)
    return str(folder / file)


def integrated(unit: str, run: Run, times: np.ndarray, commands: np.ndarray, tolerance: float) -> np.ndarray:
    """What FMPy finds at the record times of a run under its commands, which change where the controller decides."""
    every = round(run.period / (times[1] - times[0]))
    given = [(number * run.period, command) for number, command in enumerate(commands[::every])]
    names = [item.name for item in fmpy.read_model_description(unit).modelVariables if item.causality == "output"]
    shown = [f"state.{name}" for name in STATES[0 if run.program.angle is None else 2 :]]
    found = fmpy.simulate_fmu(
        unit,
        fmi_type="ModelExchange",
        stop_time=float(times[-1]),
        output_interval=float(times[1] - times[0]),
        relative_tolerance=tolerance,
        input=np.array(given, dtype=[("time", float), ("command", float)]),
        output=[*names, *shown],
        record_events=False,
    )
    assert np.abs(found["time"] - times).max() < 1e-9
    return found


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=[] if case in SHORT else [pytest.mark.long]) for case in CASES]
)
def test_the_cvode_of_fmpy_finds_what_the_reference_solver_finds(case: str, tmp_path: Path) -> None:
    name, overrides = CASES[case]
    run = plan_run(load_scenario(name, overrides))
    wanted = solve_reference(run)
    found = integrated(written(tmp_path, name, overrides), run, wanted.times, wanted.commands, 1e-9)
    for place in range(7) if run.program.angle is None else range(2, 7):
        course = wanted.states[:, place]
        # Rates differ for as long as two solvers place an impact apart, and the leak adds up differences of pressures.
        share = {"angular_velocity": math.inf, "leaked_mass": 1e-4}.get(STATES[place], 5e-6)
        assert np.abs(found[f"state.{STATES[place]}"] - course).max() <= share * np.ptp(course), STATES[place]
    angles = wanted.states[:, 0]
    pressures = [
        run.program.actuator.pressures(run.plant, angle, *gas)
        for angle, gas in zip(angles, wanted.states[:, 2:4], strict=True)
    ]
    for number in (1, 2):
        assert np.abs(found[f"pressure_{number}"] - np.array(pressures)[:, number - 1]).max() <= 5.0
    if case in ("impacts on the stops", "rebounds, late coils"):
        assert len(wanted.impacts) >= 3
    if case.startswith("a stick and a slip"):
        assert len(wanted.breakaways) > 30


@pytest.fixture(scope="module")
def moved(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A vane whose ankle another model moves."""
    return written(tmp_path_factory.mktemp("moved"), "torque-task-slow-valve", ())


@pytest.fixture(scope="module")
def free(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A free vane that is at rest on a stop."""
    return written(tmp_path_factory.mktemp("free"), "torque-task-solenoid", FREE)


class Model:
    """An instance under way, whose tool is the test."""

    def __init__(self, unit: str) -> None:
        self.described = fmpy.read_model_description(unit)
        self.own = fmpy.instantiate_fmu(fmpy.extract(unit), self.described, fmi_type="ModelExchange")
        self.numbers = {item.name: item.valueReference for item in self.described.modelVariables}
        begin(self.own)

    def set(self, **given: float) -> None:
        """Set variables in SI units."""
        self.own.setReal([self.numbers[name] for name in given], list(given.values()))

    def get(self, name: str) -> float:
        """A variable in SI units."""
        return float(self.own.getReal([self.numbers[name]])[0])

    def event(self) -> tuple[bool, float]:
        """Handle an event; whether a next one is known, and when [s]."""
        self.own.enterEventMode()
        found = self.own.newDiscreteStates()
        self.own.enterContinuousTimeMode()
        return found[4], found[5]

    def vector(self, function: str, count: int, given: Sequence[float] = ()) -> list[float]:
        """What a function on a vector writes there, or does with what is given."""
        values = (ctypes.c_double * count)(*given)
        getattr(self.own, function)(values, count)
        return list(values)


def test_slopes_of_an_ankle_that_another_model_moves_are_those_of_the_reference_solver(moved: str) -> None:
    run = plan_run(load_scenario("torque-task-slow-valve"))
    wanted = load_right_hand_side(run)
    model = Model(moved)
    angle = float(run.program.angle.value(run.path, 0.0)[0])
    model.set(angle=angle, angular_velocity=0.0, command=1.0)
    model.own.exitInitializationMode()
    model.event()
    count = len(wanted.y) - 2
    given = [4e-5, 2e-5, 1e-6, 2e-6, 3e-7, 0.4, 3.0, 0.2]
    assert count == len(given) == sum(item.derivative is not None for item in model.described.modelVariables)
    model.vector("setContinuousStates", count, given)
    wanted.y[:] = [angle, 0.0, *given]
    # The command is still on its way.
    wanted.fill(0.0, 0.0, 0.0)
    assert model.vector("getDerivatives", count) == pytest.approx(wanted.slopes[2:].tolist(), rel=1e-12)
    at_rest = model.get("torque"), model.get("der(state.content_1)")
    model.set(angle=angle + 0.1)
    assert model.get("torque") < at_rest[0]
    assert model.get("der(state.content_1)") > at_rest[1]


def test_a_command_reaches_the_valve_after_its_dead_time_which_is_an_event(moved: str) -> None:
    delay = load_scenario("torque-task-slow-valve").device.valve.settings["delay"]
    model = Model(moved)
    model.set(command=1.0)
    model.own.exitInitializationMode()
    is_known, moment = model.event()
    assert (is_known, moment) == (True, pytest.approx(delay))
    at_rest = model.get("der(state.valve.rate)")
    model.own.setTime(moment)
    assert model.get("der(state.valve.rate)") == at_rest == 0.0
    assert model.event()[0] is False
    assert model.get("der(state.valve.rate)") > 0.0


def test_an_indicator_falls_below_0_where_the_vane_breaks_away_and_the_event_lets_it_slide(free: str) -> None:
    model = Model(free)
    model.own.exitInitializationMode()
    model.event()
    assert min(model.vector("getEventIndicators", 2)) > 0.0
    model.set(external_torque=-50.0)
    assert min(model.vector("getEventIndicators", 2)) < 0.0
    assert model.get("der(state.angular_velocity)") == 0.0
    model.event()
    assert min(model.vector("getEventIndicators", 2)) > 0.0
    assert model.get("der(state.angular_velocity)") > 0.0


def test_a_restored_state_has_the_same_slopes_and_one_that_was_changed_is_refused(moved: str) -> None:
    model = Model(moved)
    model.set(command=1.0)
    model.own.exitInitializationMode()
    model.event()
    model.own.setTime(0.5)
    model.event()
    state = model.own.getFMUstate()
    kept = bytes(model.own.serializeFMUstate(state))
    slopes = model.vector("getDerivatives", 8)
    other = Model(moved)
    other.own.setFMUstate(other.own.deSerializeFMUstate(kept))
    assert other.vector("getDerivatives", 8) == slopes
    changed = bytes([*kept[:400], kept[400] ^ 1, *kept[401:]])
    with pytest.raises(Exception, match="DeSerialize"):
        other.own.deSerializeFMUstate(changed)


@pytest.mark.parametrize("name", ["free", "moved"])
def test_fmpy_and_the_toolbox_find_no_fault(name: str, request: pytest.FixtureRequest) -> None:
    unit = request.getfixturevalue(name)
    assert importlib.import_module("fmpy.validation").validate_fmu(unit) == []
    pytest.importorskip("fmu_manipulation_toolbox", reason="fmu-manipulation-toolbox is not installed")
    command = [sys.executable, "-m", "fmu_manipulation_toolbox", "-input", unit, "-check"]
    assert subprocess.run(command, capture_output=True, check=False).returncode == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("torque-task-proportional",), "add --interface plant"),
        (("torque-task-proportional", "--interface", "plant", "--fmi", "3"), "model exchange is written as FMI 2.0"),
        (("proportional", "--interface", "plant"), "not on a walking leg"),
        (("torque-task-proportional", "--interface", "plant", "--set", DROOP), "omit the section"),
    ],
)
def test_what_has_no_model_exchange_is_refused_in_one_line(
    words: tuple[str, ...], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "fmu", *words, "--kind", "model-exchange", "--out", str(tmp_path / "unit")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "unit").exists()
