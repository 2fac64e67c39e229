"""A design study on the lanes: what it says of a design is what the design does, and bad files are one line."""

import re
import tomllib
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from ppafo.analyses.design.front.answer import Design, finding_of, front_table
from ppafo.analyses.design.front.search import Candidates
from ppafo.analyses.design.front.solve import Evaluation, design_columns, noise_streams
from ppafo.analyses.design.loading import json_schema, load_design
from ppafo.analyses.design.question import design
from ppafo.errors import PpafoError, StudyError
from ppafo.report.finding import text_of
from ppafo.running import simulate
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.numbers import with_numbers

SHIPPED = Path(__file__).parents[5] / "src" / "ppafo" / "analyses" / "design" / "library" / "torque-task.toml"
FILE = """
schema_version = 1
name = "small"

[[task]]
name = "first"
weight = 3.0
scenarios = { proportional = "torque-task-proportional" }
overrides = ["run.duration=0.4 s", "reference.ramp_time=0.2 s", "reference.level=4 N m"]

[[task]]
name = "second"
scenarios = { proportional = "torque-task-proportional" }
overrides = ["run.duration=0.2 s", "reference.ramp_time=0.1 s", "reference.level=2 N m"]

[parts]
valves = ["enfield-ls-v05s"]
actuators = ["smc-crb2bw40-90d", "smc-crb2bw30-90d"]
bottle = "pipeline-jacpac-9oz"
other_mass = "1.9 kg"

[variables."supply.pressure"]
lowest = "30 psi_g"
highest = "90 psi_g"

[variables."actuator.size"]
lowest = "0.5"
highest = "2"
scale = "log"

[variables."actuator.dead_volume"]
lowest = "1 cm^3"
highest = "5 cm^3"

[variables."controller.rate"]
values = ["200 Hz", "1 kHz"]

[constraints.rms_error]
most = "1.5 N m"

[search]
screening = 64
population = 16
generations = 2
seed = 7
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("design")
    (place / "small.toml").write_text(FILE)
    return place


@pytest.fixture(scope="module")
def study(folder: Path) -> Design:
    return design(folder / "small.toml").found


def test_the_shipped_design_keeps_its_published_schema_and_loads() -> None:
    jsonschema.validate(tomllib.loads(SHIPPED.read_text(encoding="utf-8")), json_schema())
    problem = load_design("torque-task")
    assert len(problem.combinations) == 10
    assert {variable.path: variable.kinds for variable in problem.variables}["controller.integral_gain"] == (
        "proportional",
    )


def test_a_design_does_what_the_table_says_when_it_is_simulated_alone(study: Design) -> None:
    point, tasks = study.front[0], study.problem.tasks
    size = point.numbers["actuator.size"]
    numbers = point.valve.model_numbers | {
        "actuator.torque_constant": size * point.actuator.values["torque_constant"],
        "actuator.displacement_per_radian": size * point.actuator.values["displacement_per_radian"],
        "actuator.dead_volume_1": point.numbers["actuator.dead_volume"],
        "actuator.dead_volume_2": point.numbers["actuator.dead_volume"],
        "supply.pressure": point.numbers["supply.pressure"],
        "supply.dorsiflexion_pressure": point.numbers["supply.pressure"],
    }
    errors, gases = [], []
    for task in tasks:
        scenario = with_numbers(task.scenarios["proportional"], numbers)
        rate = f"controller.rate={point.numbers['controller.rate']} Hz"
        retimed = load_design_scenario(task.name, rate)
        result = simulate(with_numbers(retimed, numbers))
        assert scenario.reference == retimed.reference
        errors.append(result.metrics["rms_error"].value)
        gases.append(result.metrics["gas_supplied"].value)
        assert point.tasks[task.name] == pytest.approx((errors[-1], gases[-1]), rel=1e-9)
    assert point.error == pytest.approx(0.75 * errors[0] + 0.25 * errors[1], rel=1e-9)
    assert point.gas == pytest.approx(0.75 * gases[0] + 0.25 * gases[1], rel=1e-9)
    assert point.mass == pytest.approx(0.300 + size * point.actuator.values["mass"] + 0.707 + 1.9)


def test_the_suggestion_is_run_once_more_in_each_task_and_comes_to_what_the_front_says(study: Design) -> None:
    point = study.front[study.knee]
    assert [rerun.task for rerun in study.suggested] == [task.name for task in study.problem.tasks]
    for rerun in study.suggested:
        error, gas = point.tasks[rerun.task]
        assert rerun.result.metrics["rms_error"].value == pytest.approx(error, rel=1e-4)
        assert rerun.result.metrics["gas_supplied"].value == pytest.approx(gas, rel=1e-4)
        assert rerun.command in text_of(finding_of(study))


def load_design_scenario(task: str, rate: str):  # type: ignore[no-untyped-def]
    from ppafo.simulation.loading import load_scenario

    table = next(item for item in tomllib.loads(FILE)["task"] if item["name"] == task)
    return load_scenario("torque-task-proportional", [*table["overrides"], rate])


def test_no_design_of_the_front_beats_another_and_all_keep_the_constraint(study: Design) -> None:
    table = np.array([point.objectives for point in study.front])
    for point in table:
        assert not np.any(np.all(table <= point, axis=1) & np.any(table < point, axis=1))
    assert all(error <= 1.5 for point in study.front for error, _ in point.tasks.values())
    assert [point.error for point in study.front] == sorted(point.error for point in study.front)


def test_the_same_seed_gives_the_same_designs(study: Design, folder: Path) -> None:
    again = design(load_design(folder / "small.toml"), threads=1).found
    assert [point.objectives for point in again.front] == [point.objectives for point in study.front]
    assert study.designs == 64 + 2 * 16


NOISY = (
    FILE.replace('[variables."controller.rate"]\nvalues = ["200 Hz", "1 kHz"]\n', "")
    .replace('reference.level=4 N m"]', 'reference.level=4 N m", "sensors.pressure_noise=1 kPa_d"]')
    .replace('"1.5 N m"', '"2.5 N m"')
)


def test_a_noisy_design_is_worth_its_mean_over_noise_that_the_search_never_met(folder: Path) -> None:
    (folder / "noisy.toml").write_text(NOISY)
    (folder / "seed.toml").write_text(NOISY.replace("1 kPa_d", '1 kPa_d", "sensors.seed=9'))
    study, other = design(folder / "noisy.toml").found, design(folder / "seed.toml").found
    # The seed of the scenario is one realisation of many: it decides nothing.
    assert [point.objectives for point in other.front] == [point.objectives for point in study.front]
    point, fresh = study.front[0], noise_streams(study.problem, 16, 64)
    assert not set(fresh) & set(noise_streams(study.problem, 0, 16))
    size, pressure = point.numbers["actuator.size"], point.numbers["supply.pressure"]
    numbers = point.valve.model_numbers | {
        "actuator.torque_constant": size * point.actuator.values["torque_constant"],
        "actuator.displacement_per_radian": size * point.actuator.values["displacement_per_radian"],
        "actuator.dead_volume_1": point.numbers["actuator.dead_volume"],
        "actuator.dead_volume_2": point.numbers["actuator.dead_volume"],
        "supply.pressure": pressure,
        "supply.dorsiflexion_pressure": pressure,
    }
    columns = {path: np.full(64, number) for path, number in numbers.items()} | {"sensors.seed": fresh}
    error = np.zeros(64)
    for task in study.problem.tasks:
        error += task.weight * run_ensemble(task.scenarios["proportional"], columns, ["rms_error"]).metrics["rms_error"]
    assert point.error == pytest.approx(error.mean(), rel=1e-9)
    assert point.spread is not None
    assert point.spread[0] == pytest.approx(error.std(ddof=1), rel=1e-6)
    assert point.spread[0] > 0.0
    assert study.streams == 64
    text = front_table(study).splitlines()[0]
    assert "error from noise [N m]" in text
    assert any("noise streams" in remark for remark in finding_of(study).parts[2].remarks)


def test_without_noise_there_is_one_run_of_each_design_and_no_word_of_noise(study: Design) -> None:
    assert study.streams == 0
    assert all(point.spread is None for point in study.front)
    assert "noise" not in front_table(study)


def test_noise_cannot_be_searched(folder: Path) -> None:
    (folder / "searched.toml").write_text(f'{NOISY}\n[variables."sensors.seed"]\nlowest = "1"\nhighest = "9"\n')
    with pytest.raises(StudyError, match="every design meets the same noise"):
        load_design(folder / "searched.toml")


def test_a_part_without_dynamics_on_its_data_sheet_is_ideal(folder: Path) -> None:
    problem = load_design(folder / "small.toml")
    candidates = Candidates(np.array([0, 1]), np.full((2, 4), 0.5))
    scenario = problem.tasks[0].scenarios["proportional"]
    columns = design_columns(problem, scenario, candidates)
    assert columns["valve.spool_frequency"].tolist() == [0.0, 0.0]
    assert columns["actuator.torque_constant"].tolist() == pytest.approx([1.451e-5, 7.4e-6])
    supply = with_numbers(scenario, {"supply.pressure": columns["supply.pressure"]}).device.supply
    assert np.array_equal(supply.dorsiflexion_pressure, columns["supply.pressure"])


def test_pressures_above_what_parts_are_made_for_break_a_constraint(folder: Path) -> None:
    text = FILE.replace('"smc-crb2bw40-90d", "smc-crb2bw30-90d"', '"parker-prn30d-90-45"').replace(
        "90 psi_g", "200 psi_g"
    )
    # At such pressures the loop oscillates with the paper's derivative gain.
    text = text.replace('"reference.level', '"controller.derivative_gain=0 s/(N m)", "reference.level')
    (folder / "rated.toml").write_text(text)
    evaluation = Evaluation(load_design(folder / "rated.toml"))
    places = np.full((2, 4), 0.5)
    places[:, 0] = [(110.0 - 30.0) / 170.0, (130.0 - 30.0) / 170.0]
    worth = evaluation(Candidates(np.zeros(2, dtype=np.int64), places))
    assert worth.violation[0] == 0.0
    assert worth.violation[1] == pytest.approx((130.0 - 120.0) / (120.0 + 14.6959), rel=1e-3)


def test_a_failed_run_is_counted_and_is_no_design(folder: Path) -> None:
    late = '[variables."sensors.delay"]\nvalues = ["0 s", "0.3 s"]\n\n'
    (folder / "failing.toml").write_text(FILE.replace("[constraints", late + "[constraints", 1))
    found = design(folder / "failing.toml").found
    assert 0 < found.failed < found.runs
    assert any("sensors.delay" in reason for reason in found.failures)
    assert {point.numbers["sensors.delay"] for point in found.front} == {0.0}


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("enfield-ls-v05s", "enfield-ls-v5s", "valves has no part 'enfield-ls-v5s', did you mean 'enfield-ls-v05s'?"),
        ("enfield-ls-v05s", "festo-vovg-5v-pair", "task 'first' has no scenario for solenoid valves"),
        (
            '{ proportional = "torque-task-proportional" }\noverrides = ["run.duration=0.4',
            '{ proportional = "torque-task-solenoid" }\noverrides = ["run.duration=0.4',
            "scenario 'torque-task-solenoid' has a solenoid valve, not a proportional one",
        ),
        (
            '"torque-task-proportional" }\noverrides = ["run.duration=0.4 s", "reference.ramp_time=0.2 s", '
            '"reference.level=4 N m"]',
            '"step-response" }',
            "scenario 'step-response' follows no reference",
        ),
        ('name = "second"', 'name = "first"', "two tasks are named 'first'"),
        (
            "supply.pressure",
            "supply.presure",
            "no scenario of the tasks has such a value, did you mean 'supply.pressure'?",
        ),
        ("actuator.size", "actuator.torque_constant", "vary 'actuator.size' instead"),
        ("actuator.dead_volume", "valve.sonic_conductance", "gives its orifice in the other form"),
        (
            'values = ["200 Hz", "1 kHz"]',
            'lowest = "200 Hz"\nhighest = "1 kHz"',
            "is a time or rate of the run; list the values",
        ),
        ('lowest = "30 psi_g"', 'lowest = "95 psi_g"', "lowest = '95 psi_g' must be below highest = '90 psi_g'"),
        ('lowest = "30 psi_g"', 'lowest = "30 psi"', "'psi' does not say which pressure"),
        ('lowest = "1 cm^3"\n', "", "give either lowest and highest, or values"),
        ("[constraints.rms_error]", "[constraints.rms_eror]", "there is no such metric, did you mean 'rms_error'?"),
        ('most = "1.5 N m"', "", "has no limit; give least, most or both"),
        ('most = "1.5 N m"', 'most = "1 N m"\nleast = "2 N m"', "no design can satisfy both"),
        ('other_mass = "1.9 kg"', 'other_mass = "1.9"', "parts.other_mass = '1.9'"),
        ('name = "small"', 'name = "small"\nerror = "gas_supplied"', "error = 'gas_supplied' is not an error in N m"),
        ("screening = 64", "screening = 1", "search.screening = 1: must be greater than or equal to 16"),
    ],
)
def test_every_mistake_in_a_file_is_one_line(tmp_path: Path, before: str, after: str, message: str) -> None:
    assert before in FILE
    path = tmp_path / "wrong.toml"
    path.write_text(FILE.replace(before, after, 1))
    with pytest.raises(PpafoError, match=re.escape(message)) as caught:
        load_design(path)
    assert "\n" not in str(caught.value)


def test_a_limit_in_gauge_pressure_counts_from_the_atmosphere_of_the_tasks(tmp_path: Path) -> None:
    path, high = tmp_path / "high.toml", '"supply.atmospheric_pressure=83 kPa_a", '
    limited = FILE.replace("[search]", '[constraints.largest_pressure]\nmost = "40 psi_g"\n\n[search]')
    path.write_text(limited.replace("overrides = [", f"overrides = [{high}"))
    assert load_design(path).constraints[-1].most == pytest.approx(83e3 + 40.0 * 6894.757293168361)
    searched = '[variables."supply.atmospheric_pressure"]\nlowest = "80 kPa_a"\nhighest = "101 kPa_a"\n\n[search]'
    for ambiguous in (
        limited.replace("overrides = [", f"overrides = [{high}", 1),
        limited.replace("[search]", searched),
    ):
        path.write_text(ambiguous)
        with pytest.raises(PpafoError, match="most = '40 psi_g': the designs have several atmospheres"):
            load_design(path)
    path.write_text(ambiguous.replace("40 psi_g", "350 kPa_a"))
    assert load_design(path).constraints[-1].most == 350e3


def test_a_file_without_a_profile_and_without_tasks_says_what_to_write(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('schema_version = 1\nname = "mine"\n')
    with pytest.raises(
        PpafoError, match=r"write a table \[profile\] with time and torque or recording, or tables \[\[task"
    ):
        load_design(tmp_path / "mine.toml")


def test_a_design_is_drawn_and_told_as_data_like_any_answer(study: Design) -> None:
    figure = finding_of(study).plot()
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes]
    parts = {part.title for point in study.front for part in (point.valve, point.actuator)}
    assert {text.get_text() for text in figure.legends[0].get_texts()} == {*parts, "suggested"}
    assert labels[0] == ("Error (N m)", "Gas per task (g)")
    assert labels[1] == ("Error (N m)", "Mass (g)")
    assert finding_of(study).to_dict()["suggested"] == study.knee


def test_a_seed_stands_in_for_that_of_the_file(folder: Path) -> None:
    assert load_design(folder / "small.toml", seed=7).search.seed == 7
    with pytest.raises(PpafoError, match="seed=-1: must be a whole number, 0 or more"):
        load_design(folder / "small.toml", seed=-1)
    with pytest.raises(PpafoError, match="seed = 4294967296: must be a whole number from 0 to 4294967295"):
        load_design(folder / "small.toml", seed=2**32)


def test_constraints_that_nothing_keeps_are_said_in_one_line(folder: Path) -> None:
    (folder / "never.toml").write_text(
        FILE.replace("1.5 N m", "1e-6 N m").replace("generations = 2", "generations = 0")
    )
    with pytest.raises(PpafoError, match=r"none of 64 designs satisfies the constraints \(rms_error\)"):
        design(folder / "never.toml")
