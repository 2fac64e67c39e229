"""The section [trajectory] of a problem file, from recordings to the new set."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ppafo.analyses.identify import Identification, finding_of, identify
from ppafo.cli.main import main
from ppafo.errors import PpafoError
from ppafo.identification.source import UsedRecording, double_use
from ppafo.parameters.device import Orifice
from ppafo.parameters.loading import load_device, parameter_set_toml, parse_parameter_set
from ppafo.report.finding import text_of
from ppafo.rig.experiments import record
from ppafo.running import simulate
from ppafo.signals.recording import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.storage import write_csv

HEAD = 'schema_version = 1\nname = "fitted"\ndevice.set = "ppafo2011"\n'
NOISE = {"angle": 0.0017, "pressure_1": 500.0, "pressure_2": 500.0, "supply_pressure": 300.0}
PLANTED = ("foot_plate.inertia=10 g m^2", "valve.discharge_coefficient=0.13", "run.duration=0.35 s")
PARAMETERS = """
[[trajectory.parameters]]
path = "foot_plate.inertia"
low = "2 g m^2"
high = "50 g m^2"
[[trajectory.parameters]]
path = "valve.discharge_coefficient"
"""
STEP = """
[[trajectory.experiments]]
label = "step"
recording = "step.csv"
scenario = "step-response"
"""
REPLAYED = """
[[trajectory.experiments]]
label = "replayed"
recording = "task.csv"
initial_state = "fitted"
"""
SLOW = """
[[trajectory.candidates]]
label = "slow"
scenario = "step-response"
overrides = ["controller.command=0.2"]
"""
STATIC = '[[procedure]]\nkind = "static-torque"\nrecordings = ["static.csv"]\n'
DECAY = '[[procedure]]\nkind = "free-decay"\nrecordings = ["decay.csv"]\ninertia = "10 g m^2"\n'
FIT = f"[trajectory]\n{PARAMETERS}{STEP}"

Solve = Callable[[str], Identification]


def noisy(recording: Recording, seed: int) -> Recording:
    random = np.random.default_rng(seed)
    channels = {
        name: Channel(channel.values + NOISE.get(name, 0.0) * random.standard_normal(len(recording)), channel.unit)
        for name, channel in recording.channels.items()
        if name in (*NOISE, "command")
    }
    return Recording(f"synthetic {recording.label}", recording.time, channels, kind="synthetic")


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with recordings of a device whose inertia and valve are not those of the set."""
    folder = tmp_path_factory.mktemp("laboratory")
    task = simulate(
        load_scenario("torque-task-proportional", [*PLANTED, "motion.kind=free", "motion.angle=60 deg"])
    ).recording
    supply = load_scenario("torque-task-proportional").device.supply.pressure
    task = task.with_channel("supply_pressure", np.full(len(task), supply), "Pa")
    write_csv(folder / "step.csv", noisy(simulate(load_scenario("step-response", PLANTED)).recording, 1))
    write_csv(folder / "task.csv", noisy(task, 2))
    write_csv(folder / "static.csv", record("static-torque", "ideal-laboratory", 1).recording)
    write_csv(folder / "decay.csv", record("free-decay", "ideal-laboratory", 1).recording)
    return folder


@pytest.fixture(scope="module")
def solve(laboratory: Path) -> Solve:
    """Solves a problem in that folder."""

    def solved(text: str) -> Identification:
        path = laboratory / "problem.toml"
        path.write_text(HEAD + text)
        return identify(path).found

    return solved


@pytest.fixture(scope="module")
def both(solve: Solve) -> Identification:
    """A step response beside a recording that has no scenario, with all that can be asked for."""
    return solve(f"[trajectory]\n{PARAMETERS}{STEP}time_offset = '5 ms'\n{REPLAYED}{SLOW}")


@pytest.mark.short
def test_planted_values_are_found_from_a_scenario_and_from_a_recording_without_one(both: Identification) -> None:
    assert both.trajectory is not None
    truth = {"foot_plate.inertia": 0.010, "valves.proportional.discharge_coefficient": 0.13}
    for estimate in both.trajectory.estimates:
        if estimate.path in truth:
            assert estimate.verdict == "identified"
            # Three standard errors: 3/1.96 half widths.
            assert abs(estimate.value - truth[estimate.path]) < 3.0 / 1.96 * estimate.wider_half_width
    assert both.is_good
    assert both.trajectory.remarks == ()


def test_a_remark_that_prevents_a_pass_is_the_last_line(both: Identification) -> None:
    assert both.trajectory is not None
    assert "exit code 1" not in text_of(finding_of(both))
    told = finding_of(replace(both, trajectory=replace(both.trajectory, faults=("the search stopped",))))
    assert not told.passed
    assert text_of(told).splitlines()[-1] == "not passed (exit code 1): the search stopped"


def test_tolerances_are_listed_with_what_they_widen_and_do_not_get_into_the_set(both: Identification) -> None:
    assert both.trajectory is not None
    assert {estimate.path for estimate in both.estimates} == {
        "foot_plate.inertia",
        "valves.proportional.discharge_coefficient",
    }
    assert set(both.new_set.written) == {estimate.path for estimate in both.estimates}
    known = {one.name: one for one in both.trajectory.known}
    assert {
        "recording.time_offset of step",
        "initial.pressure_1 of replayed",
        "recording.zero_of_pressure_1",
        "recording.zero_of_supply_pressure of replayed",
        "actuator.torque_constant",
        "gas.temperature",
    } <= set(known)
    assert known["actuator.torque_constant"].widens == "foot_plate.inertia"
    assert known["actuator.torque_constant"].share > 0.3


def test_the_new_set_says_where_its_values_come_from_and_reads_back(both: Identification) -> None:
    new = both.new_set.parameter_set
    entry = new.numbers["foot_plate.inertia"]
    assert (entry.origin, entry.unit) == ("identified", "g m^2")
    first, second = entry.source.split("; ")
    assert first.startswith("step.csv sha256:")
    assert second.startswith("task.csv sha256:")
    assert entry.note is not None
    assert "95% interval" in entry.note
    assert parse_parameter_set(parameter_set_toml(new).encode(), "fitted.toml") == new


def test_the_document_has_all_that_the_fit_says(both: Identification) -> None:
    document = json.loads(json.dumps(both.json_document()))["trajectory"]
    assert document["recordings_are"] == "synthetic"
    assert [item["inputs"] for item in document["recordings"]] == [[], ["command", "supply_pressure"]]
    assert np.array(document["covariance"]).shape == (2, 2)
    assert len(document["channels"]) == 6
    assert document["next_experiments"][0]["label"] == "slow"
    assert document["next_experiments"][0]["gain"] > 0.0
    assert document["conflict"] is None
    assert len(document["tolerances"]) > 15


def test_the_table_shows_units_of_the_set_tolerances_and_the_next_experiment(both: Identification) -> None:
    text = text_of(finding_of(both))
    assert "trajectory (synthetic): 2 numbers fitted to 2 recordings" in text
    assert "foot_plate.inertia: variance from actuator.torque_constant" in text
    number = r"([\d.]+) \+- ([\d.]+) cm\^3"
    told = re.search(
        rf"tolerance: actuator\.torque_constant: prior {number} \(the set states none\), fitted {number}", text
    )
    assert told is not None
    stated, error, fitted, smaller = map(float, told.groups())
    assert (stated, error) == (14.51, 0.17)
    assert smaller < error
    assert abs(fitted - stated) < 2.0 * error
    assert "g m^2" in text
    assert "next experiment 1: slow: gain" in text


def test_what_the_new_set_keeps_beside_values_fitted_with_it_is_said(both: Identification) -> None:
    assert both.trajectory is not None
    assert "keeps its own" not in text_of(finding_of(both))
    fit, (inertia, *_) = both.trajectory, both.trajectory.estimates
    assert inertia.path == "foot_plate.inertia"
    estimates = (replace(inertia, verdict="not identifiable"), *fit.estimates[1:])
    written = replace(both.new_set, written=both.new_set.written[1:])
    trajectory = replace(both.trajectory, estimates=estimates)
    inconsistent = finding_of(replace(both, trajectory=trajectory, new_set=written))
    said = "not passed (exit code 1): the new set keeps its own foot_plate.inertia, with which its other values were"
    assert said in text_of(inconsistent)
    assert finding_of(both).passed
    # Also of the figures, which are drawn later.
    assert finding_of(both).units == both.shown
    assert not inconsistent.passed


def test_the_fit_starts_from_what_the_bench_found_and_keeps_the_rest_of_it(solve: Solve) -> None:
    outcome = solve(STATIC + FIT)
    assert outcome.trajectory is not None
    held, static = {one.name: one for one in outcome.trajectory.known}, outcome.results[0]
    for path in ("actuator.torque_constant", "friction.static_torque"):
        # A set has three digits of half the interval.
        half = static[path].wider_half_width
        assert held[path].before == pytest.approx(static[path].value, abs=5e-3 * half)
        assert held[path].before_error == pytest.approx(half / 1.96, rel=5e-3)
    started = solve(f"{STATIC}{FIT}[[trajectory.parameters]]\npath = 'friction.static_torque'\n").trajectory
    assert started is not None
    friction = next(one for one in started.fit.numbers if one.path == "friction.static_torque")
    known = static["friction.static_torque"]
    assert friction.start == pytest.approx(known.value, abs=5e-3 * known.wider_half_width)


def test_a_value_that_both_found_is_that_of_the_fit_in_the_new_set(solve: Solve) -> None:
    outcome = solve(f"{STATIC}{FIT}[[trajectory.parameters]]\npath = 'actuator.torque_constant'\n")
    assert outcome.new_set.parameter_set.numbers["actuator.torque_constant"].source.startswith("step.csv")


def test_a_value_that_the_fit_cannot_tell_leaves_what_the_bench_found(solve: Solve) -> None:
    outcome = solve(f"{STATIC}{FIT}[[trajectory.parameters]]\npath = 'friction.static_torque'\n")
    assert outcome.trajectory is not None
    assert outcome.trajectory["friction.static_torque"].verdict == "not identifiable"
    assert outcome.new_set.parameter_set.numbers["friction.static_torque"].source.startswith("static.csv")


def test_the_interval_of_the_bench_can_be_the_prior_of_the_fit(solve: Solve) -> None:
    prior = "[[trajectory.parameters]]\npath = 'friction.static_torque'\nprior = 'bench'\n"
    outcome = solve(STATIC + FIT + prior)
    assert outcome.trajectory is not None
    known = outcome.results[0]["friction.static_torque"]
    given = next(one for one in outcome.trajectory.fit.numbers if one.path == "friction.static_torque")
    assert given.start == known.value
    assert given.deviation == pytest.approx(known.wider_half_width / 1.96, rel=1e-2)
    with pytest.raises(PpafoError, match="prior = 'bench': no procedure identifies it"):
        solve(FIT + prior)


def test_a_fit_that_contradicts_the_bench_says_so(solve: Solve) -> None:
    damping = "[[trajectory.parameters]]\npath = 'friction.viscous_damping'\n"
    outcome = solve(DECAY + FIT + damping)
    assert outcome.trajectory is not None
    bench = outcome.results[0]["friction.viscous_damping"]
    truth = load_scenario("step-response").device.friction.viscous_damping
    assert not bench.low <= truth <= bench.high
    assert any(
        "friction.viscous_damping: fitted " in remark and ", bench procedure " in remark
        for remark in outcome.trajectory.remarks
    )


def test_a_scenario_file_beside_the_problem_and_a_column_map_are_found(solve: Solve, laboratory: Path) -> None:
    scenario = 'schema_version = 1\nname = "own"\ndevice.set = "ppafo2011-printed"\n'
    scenario += 'device.overrides = ["supply.pressure=55 psi_g", "supply.dorsiflexion_pressure=55 psi_g"]\n'
    scenario += (
        'run = { duration = "0.35 s", output_interval = "1 ms" }\n'
        'motion = { kind = "leg", angle = "20 deg", shank = { kind = "constant", level = "0 deg" } }\n'
    )
    scenario += 'initial = { pressure_2 = "dorsiflexion_supply" }\n'
    scenario += 'controller = { kind = "constant", command = 1, rate = "1 kHz" }\n'
    (laboratory / "own.toml").write_text(scenario)
    table = np.loadtxt(laboratory / "step.csv", delimiter=",", skiprows=2)
    header = (laboratory / "step.csv").read_text().splitlines()[1].split(",")
    columns = [
        next(index for index, name in enumerate(header) if name.startswith(f"{one} "))
        for one in ("time", "angle", "pressure_1", "pressure_2")
    ]
    np.savetxt(laboratory / "logger.txt", table[:, columns], fmt="%.9g", delimiter=";")
    mapped = """
[columns.logger]
delimiter = "semicolon"
header = false
[columns.logger.channels]
time = { column = 1, unit = "s" }
angle = { column = 2, unit = "rad" }
pressure_1 = { column = 3, unit = "Pa_a" }
pressure_2 = { column = 4, unit = "Pa_a" }
"""
    changed = FIT.replace("step.csv", "logger.txt").replace('"step-response"', '"own.toml"\ncolumns = "logger"')
    outcome = solve(changed + mapped)
    assert outcome.trajectory is not None
    assert outcome.trajectory.scenarios[0].device.name == "ppafo2011"
    inertia = outcome.trajectory["foot_plate.inertia"]
    assert inertia.low <= 0.010 <= inertia.high


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "problem.toml: has neither a [[procedure]] nor a [trajectory]"),
        (FIT.replace("foot_plate.inertia", "foot_plate.inertial"), "did you mean 'foot_plate.inertia'"),
        (FIT.replace("2 g m^2", "2 g m"), "parameter 'foot_plate.inertia': low = '2 g m': unit 'g m' does not fit"),
        (
            FIT.replace("2 g m^2", "70 g m^2"),
            "problem.toml: trajectory: foot_plate.inertia: low = 0.07 must be below high = 0.05",
        ),
        (f"{FIT}inputs = ['external_torque']\n", "has no channel 'external_torque'"),
        (f"{FIT}channels = ['torque']\n", "trajectory.experiments.1.channels.1 = 'torque'"),
        (
            f"{FIT}overrides = ['valve.discharge_coefficient=0.2']\n",
            "'step': overrides: valve.discharge_coefficient is ",
        ),
        (
            f"{FIT}prior = {{ mean = '0.3', relative = 0.1 }}\nhigh = '0.2'\n".replace(STEP, "") + STEP,
            "the mean of its",
        ),
        (f"{FIT}time_offset = '0 s'\n", "trajectory.experiments.1.time_offset = '0 s': must be more than 0 s"),
        (f"{FIT}time_offset = '5 mm'\n", "time_offset = '5 mm': unit 'mm' does not fit"),
        (f"{FIT}step = '1 min'\n", "step = '1 min': must be at least 1.66667e-08 min and at most"),
        (f"{FIT}start = '9 s'\n", "has 0 samples from the start at 9 s on"),
        (FIT + STEP.replace("step.csv", "task.csv"), "experiment 'step' is given twice"),
        (f"{FIT}{REPLAYED}inputs = ['supply_pressure']\n", "has no scenario, so inputs must have 'command'"),
        (
            f"{FIT}{REPLAYED}".replace("task.csv", "decay.csv"),
            "experiment 'replayed': has no scenario, so its recording needs a channel 'command'; available: angle",
        ),
        (
            FIT.replace("step.csv", "decay.csv"),
            "has no channel 'pressure_1'; available: angle",
        ),
        (f"{FIT}{SLOW}interval = '0 s'\n", "interval = '0 s': must be at least 1e-06 s"),
        (f"{FIT}{SLOW}interval = '9 s'\n", "candidate 'slow': interval = 9 s must be at most"),
        (f"{FIT}{SLOW.replace('slow', 'step')}", "candidate 'step': another experiment or candidate has this label"),
        (FIT.replace("50 g m^2", "2 g m^2"), "foot_plate.inertia: low = 0.002 must be below high = 0.002"),
        (f"[trajectory]\nexperiments = []\n{PARAMETERS}", "problem.toml: line 5: trajectory.experiments"),
    ],
)
def test_a_mistake_is_one_line_that_says_where(solve: Solve, text: str, message: str) -> None:
    with pytest.raises(PpafoError) as caught:
        solve(text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_command_says_what_it_does_and_writes_nothing_for_bad_input(
    laboratory: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (laboratory / "problem.toml").write_text(HEAD + FIT)
    assert main(["identify", str(laboratory / "problem.toml"), "--out", str(tmp_path / "made")]) == 0
    assert "trajectory fit: " in capsys.readouterr().err
    assert (tmp_path / "made" / "trajectory-fit-step.svg").is_file()
    (laboratory / "problem.toml").write_text(HEAD + FIT.replace("foot_plate", "footplate"))
    assert main(["identify", str(laboratory / "problem.toml"), "--out", str(tmp_path / "none")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "none").exists()


TANK = """
[[trajectory.experiments]]
label = "tank"
recording = "tank.csv"
volume = "60 cm^3"
"""
ONE_NUMBER = '[trajectory]\nparameters = [{ path = "valve.discharge_coefficient", start = "0.10" }]\n'


def tank(folder: Path, command: float) -> None:
    """A tank of 60 cm^3 behind the valve, by the textbook formulas with small steps of time; no angle, no chamber 2."""
    device = load_device("ppafo2011")
    gas, orifice, ratio = device.gas, device.valve.orifice, device.gas.heat_capacity_ratio
    assert isinstance(orifice, Orifice)
    product, room = gas.specific_gas_constant * gas.temperature, device.supply.atmospheric_pressure
    step, pressure, values = 1.0e-5, 1.2e5 if command > 0.0 else 4.2e5, []
    for number in range(40_001):
        if number % 100 == 0:
            values.append(pressure)
        high, low = (device.supply.pressure, pressure) if command > 0.0 else (pressure, room)
        r = max(low / high, (2 / (ratio + 1)) ** (ratio / (ratio - 1)))
        psi = np.sqrt(max(0.0, 2 * ratio / (ratio - 1) * (r ** (2 / ratio) - r ** ((ratio + 1) / ratio))))
        flow = 0.13 * orifice.area * abs(command) * high / np.sqrt(product) * psi
        pressure += np.sign(command) * step * flow * product / 60e-6
    samples = np.array(values) + np.random.default_rng(1).normal(0.0, 300.0, len(values))
    channels = {"pressure_1": Channel(samples, "Pa"), "command": Channel(np.full(len(values), command), "-")}
    write_csv(folder / "tank.csv", Recording("tank", 1.0e-3 * np.arange(len(values)), channels, "synthetic"))


@pytest.mark.parametrize("command", [0.3, -0.3])
def test_a_fixed_volume_filled_or_vented_through_the_valve_gives_its_coefficient(
    solve: Solve, laboratory: Path, command: float
) -> None:
    tank(laboratory, command)
    outcome = solve(f"{ONE_NUMBER}{TANK}")
    assert outcome.trajectory is not None
    (found,) = outcome.trajectory.estimates
    assert found.value == pytest.approx(0.13, rel=3e-3)
    assert [channel.channel for channel in outcome.trajectory.channels] == ["pressure_1"]


def test_a_held_vane_is_fitted_in_its_pressures(solve: Solve, laboratory: Path) -> None:
    overrides = ["run.duration=0.4 s", "valve.discharge_coefficient=0.13", "motion.kind=locked", "motion.angle=75 deg"]
    scenario = load_scenario("step-response", overrides)
    clean = simulate(scenario).recording
    supply = np.full(len(clean), scenario.device.supply.pressure)
    held = noisy(clean.with_channel("supply_pressure", supply, "Pa"), 3)
    kept = {name: held.channels[name] for name in ("pressure_1", "pressure_2", "command", "supply_pressure")}
    write_csv(laboratory / "held.csv", Recording("held", held.time, kept, "synthetic"))
    text = TANK.replace("tank", "held").replace('volume = "60 cm^3"', 'locked = "75 deg"')
    outcome = solve(f"{ONE_NUMBER}{text}")
    assert outcome.trajectory is not None
    (found,) = outcome.trajectory.estimates
    assert found.low < 0.13 < found.high
    assert found.value == pytest.approx(0.13, rel=0.01)
    assert [channel.channel for channel in outcome.trajectory.channels] == ["pressure_1", "pressure_2"]


@pytest.mark.parametrize("prior", ['prior = "bench"', 'start = "0.025 N m s/rad"'])
@pytest.mark.parametrize("name", ["decay.csv", "copied.csv"])
def test_a_recording_of_a_bench_procedure_that_is_fitted_too_is_refused(
    solve: Solve, laboratory: Path, prior: str, name: str
) -> None:
    text = f'[trajectory]\nparameters = [{{ path = "friction.viscous_damping", {prior} }}]\n'
    text += STEP.replace("step.csv", name) + "channels = ['angle']\n"
    if name == "copied.csv":
        # Another file, with the same numbers: a comment changes its hash and not theirs.
        (laboratory / name).write_text(f"# a copy\n{(laboratory / 'decay.csv').read_text()}")
    told = rf"free-decay \(decay\.csv sha256:.*'step' \({name} sha256:.*are the same recording.*would count twice"
    with pytest.raises(PpafoError, match=told):
        solve(f"{DECAY}{text}")


def test_other_times_of_a_recording_of_a_bench_procedure_may_be_fitted() -> None:
    recording = Recording("decay", np.arange(10.0), {"angle": Channel(np.arange(10.0), "rad")})
    bench = UsedRecording("procedure", "decay.csv", recording, last=4.0)
    fitted = UsedRecording("experiment", "copy.csv", recording, frozenset({"angle"}), 4.0, 9.0)
    assert double_use([bench, fitted]) == ""
    assert "would count twice" in double_use([bench, replace(fitted, first=3.0)])
