import argparse
import json
import time
from dataclasses import replace

import numpy as np
import pytest

from benchmarks import __main__ as command
from benchmarks import single_run, start_up, study
from benchmarks.ensemble import _metrics_line, _scaling_line
from benchmarks.ensemble_worker import Order, metrics_of
from benchmarks.report import MISSING_EXTRA, BenchReport, Line, Machine, Target, describe_machine, number_text
from benchmarks.sampled_solvers import solve_by_samples
from benchmarks.single_run import COMPETITORS, lane_states, measure_single_run, pressure_error
from benchmarks.task import ensemble, named_rows, torque_task, volumes_of
from benchmarks.timing import Timing, run_python, time_in_turn
from ppafo.metrics import gas, switching, tracking
from tests.reference.reference_solver import solve_reference

MACHINE = Machine("a processor", "an OS", 2, True, "3.11.0", {"numpy": "2.0", "scikit-sundae": None})
SHORT = 0.3


def silent(_message):
    pass


def report_of(*lines):
    return BenchReport(MACHINE, {"name": "test"}, lines)


@pytest.fixture(scope="module")
def short_run():
    return torque_task(SHORT)


@pytest.fixture(scope="module")
def reference(short_run):
    return solve_reference(short_run).states


@pytest.mark.parametrize(
    ("solver", "largest"), [("lsoda", 1e-3), ("lsoda_tight", 1e-5), ("cvode", 1e-3), ("cvode_tight", 1e-5)]
)
def test_every_general_purpose_solver_solves_the_same_closed_loop(short_run, reference, solver, largest):
    competitor = next(item for item in COMPETITORS if item.id == solver)
    states = solve_by_samples(short_run, competitor.make(short_run, competitor.tolerance))
    assert states.shape == reference.shape
    assert pressure_error(short_run, states, reference) < largest


def test_the_lanes_solve_the_same_closed_loop(short_run, reference):
    assert pressure_error(short_run, lane_states(short_run), reference) < 1e-4


def test_the_pressure_error_sees_a_wrong_mass(short_run, reference):
    wrong = reference.copy()
    wrong[:, 2] *= 1.01
    assert pressure_error(short_run, wrong, reference) > 1e-3


def test_the_task_has_a_sample_every_millisecond_for_the_asked_duration():
    run = torque_task(0.25)
    assert (run.period, run.step_count // run.steps_per_sample) == (pytest.approx(1e-3), 250)


def test_all_runs_of_the_ensemble_differ_and_the_next_one_is_the_same():
    first, again = ensemble(16, 0.01), ensemble(16, 0.01)
    rows = named_rows(first.program.parameter_rows(), first.parameters)
    for name in ("plant.valve_conductance", "plant.dead_volume_1", "plant.supply_pressure", "reference.level"):
        assert np.unique(rows[name]).size == 16
    assert np.array_equal(first.parameters, again.parameters)
    assert np.array_equal(first.states, again.states)


def test_all_runs_of_the_ensemble_start_at_atmospheric_pressure():
    batch = ensemble(8, 0.01)
    rows = named_rows(batch.program.parameter_rows(), batch.parameters)
    start = named_rows(batch.program.state_rows(), batch.states)
    for name, volume in zip(("mass_1", "mass_2"), volumes_of(batch), strict=True):
        pressure = start[f"state.{name}"] * rows["plant.gas_product"] / volume
        assert np.allclose(pressure, rows["plant.atmospheric_pressure"], rtol=1e-12)


def test_an_order_to_a_worker_survives_the_way_there():
    order = Order(64, 0.5, 3, (0, 1), (1, 2))
    assert Order.read(order.text()) == order


def test_a_solver_that_is_not_installed_is_not_measured_and_no_error(monkeypatch):
    absent = tuple(replace(competitor, is_installed=lambda: False) for competitor in COMPETITORS)
    monkeypatch.setattr(single_run, "COMPETITORS", absent)
    monkeypatch.setattr(single_run, "has_cvode", lambda: False)
    lines = {line.id: line for line in measure_single_run(0.02, 1, silent)}
    assert lines["single_run_time"].value > 0.0
    assert lines["single_run_against_lsoda"].value is None
    assert lines["single_run_against_lsoda"].note == MISSING_EXTRA
    assert lines["single_run_error_lanes"].note == MISSING_EXTRA


def test_the_ratio_to_a_solver_is_its_time_over_ours():
    lanes, lsoda = Timing((0.002, 0.001)), Timing((0.5, 0.4))
    line = single_run._ratio_line(COMPETITORS[0], lanes, lsoda)
    assert line.value == pytest.approx(400.0)
    assert line.spread == pytest.approx((200.0, 500.0))
    assert line.met is True


def test_scaling_is_the_best_of_one_thread_over_the_best_of_two():
    timings = {"lanes 1": Timing((4.0, 2.0)), "lanes 2": Timing((1.25, 3.0))}
    assert _scaling_line(timings).value == pytest.approx(1.6)
    assert _scaling_line(timings).met is False


def test_speed_with_metrics_is_the_time_without_over_the_time_with():
    timings = {"lanes 2": Timing((1.0, 0.9)), "lanes with metrics 2": Timing((1.0, 1.5))}
    line = _metrics_line("id", "two threads", timings, 2)
    assert line.value == pytest.approx(0.9)
    assert line.spread == pytest.approx((0.6, 1.0))
    assert line.met is True


def test_the_metrics_that_are_timed_are_those_of_the_single_runs():
    timed = metrics_of(ensemble(3, 0.5), 1)()
    names = {kind.name for kind in (*tracking.METRICS, *gas.METRICS, *switching.METRICS)}
    assert set(timed) == names
    assert all(values.shape == (3,) for values in timed.values())
    assert np.isfinite(timed["rms_error"]).all()
    assert np.unique(timed["gas_supplied"]).size == 3


def test_a_command_that_fails_at_the_start_is_not_measured(monkeypatch):
    monkeypatch.setattr(start_up, "ENTRY", ("-c", "import sys; sys.exit('no such thing')"))
    lines = start_up.measure_start_up(1, 1, silent)
    assert [line.value for line in lines] == [None] * 5
    assert "no such thing" in lines[0].note


def test_the_help_of_the_command_line_is_timed(monkeypatch):
    monkeypatch.setattr(start_up, "SCENARIO", "there-is-no-such-scenario")
    help_line, *simulations = start_up.measure_start_up(1, 2, silent)
    assert help_line.value > 0.0
    assert [line.value for line in simulations] == [None] * 4


def test_the_first_output_of_a_child_is_timed_apart_from_its_end():
    late = "import time; print(1, flush=True); time.sleep(1.0); print(2)"
    start = time.perf_counter()
    outcome = run_python(["-c", late], {})
    assert outcome.output == "1\n2\n"
    assert 0.0 < outcome.first < time.perf_counter() - start - 0.9


def test_a_child_reports_its_exit_code_output_and_last_complaint():
    outcome = run_python(
        ["-c", "import sys, os; print(os.environ['PPAFO_TEST']); sys.stderr.write('a\\nb\\n'); sys.exit(3)"],
        {"PPAFO_TEST": "here"},
    )
    assert (outcome.code, outcome.output, outcome.complaint) == (3, "here\n", "b")


def test_contenders_are_timed_in_turn():
    order = []
    timings = time_in_turn({"a": lambda: order.append("a"), "b": lambda: order.append("b")}, 2)
    assert order == ["a", "b", "b", "a"]
    assert len(timings["a"].seconds) == 2


@pytest.mark.parametrize(
    ("at_least", "value", "met"), [(True, 100.0, True), (True, 99.9, False), (False, 0.3, True), (False, 0.4, False)]
)
def test_a_target_is_a_limit_from_below_or_above(at_least, value, met):
    limit = 100.0 if at_least else 0.4
    assert Line("x", "g", "w", value, "", Target(limit, at_least)).met is met


def test_a_line_without_value_or_target_is_neither_met_nor_missed():
    assert Line("x", "g", "w", None, "", Target(1.0, True)).met is None
    assert Line("x", "g", "w", 3.0, "").met is None


def test_the_report_counts_its_targets_and_is_valid_json():
    lines = (
        Line("good", "g", "good one", 12.0, "s", Target(10.0, True), (11.0, 12.0)),
        Line("bad", "g", "bad one", 2.0, "s", Target(10.0, True)),
        Line("gone", "h", "absent one", None, "s", Target(10.0, True), note=MISSING_EXTRA),
        Line("free", "h", "free one", 5.0, ""),
    )
    document = json.loads(json.dumps(report_of(*lines).document(), allow_nan=False))
    assert document["targets"] == {"met": 1, "missed": 1, "not_measured": 1}
    assert [line["met"] for line in document["lines"]] == [True, False, None, None]
    assert document["machine"]["packages"]["scikit-sundae"] is None


def test_the_text_shows_value_target_and_verdict_of_every_line():
    text = report_of(
        Line("bad", "A group", "bad one", 2.0, "s", Target(10.0, True), (1.5, 2.0), "because"),
        Line("gone", "A group", "absent one", None, "s", Target(10.0, False), note=MISSING_EXTRA),
    ).text()
    assert "AVX-512" in text
    bad = next(line for line in text.splitlines() if line.strip().startswith("bad one "))
    assert all(part in bad for part in ("2 s", "1.5 to 2", ">= 10", "NO"))
    assert "bad one: because" in text
    absent = next(line for line in text.splitlines() if "absent one" in line)
    assert MISSING_EXTRA in absent
    assert "targets: 0 met, 1 missed, 1 not measured" in text


def test_every_row_of_the_markdown_has_the_columns_of_its_head():
    markdown = report_of(
        Line("a", "One", "first", 2.0, "s", Target(10.0, True), note="n"),
        Line("b", "Two", "second", None, "", note=MISSING_EXTRA),
    ).markdown()
    rows = [line for line in markdown.splitlines() if line.startswith("|")]
    assert len(rows) == 6
    assert {row.count("|") for row in rows} == {6}
    assert "## One" in markdown
    assert "- first: n" in markdown


@pytest.mark.parametrize(
    ("value", "text"), [(123456.0, "123,000"), (1.805, "1.8"), (0.028, "0.028"), (2.7e-14, "2.7e-14"), (0.0, "0")]
)
def test_numbers_have_three_digits_at_most(value, text):
    assert number_text(value) == text


def test_the_machine_says_its_cores_and_versions():
    machine = describe_machine()
    assert machine.cores >= 1
    assert machine.packages["numpy"] == np.__version__


def parsed(**changes):
    given = {"command": "bench", "quick": True, "check": False, "json": False, "out": None} | changes
    return argparse.Namespace(**given)


@pytest.fixture
def missed_target(monkeypatch):
    report = report_of(Line("bad", "g", "bad one", 2.0, "s", Target(10.0, True)))
    sizes = []

    def measure(size, say):
        say("something")
        sizes.append(size)
        return report

    monkeypatch.setattr(study, "measure_speed", measure)
    return sizes


def test_a_missed_target_is_an_error_only_where_a_check_is_asked_for(missed_target, capsys):
    assert command.run(parsed()) == 0
    assert command.run(parsed(check=True)) == 1
    assert "something" in capsys.readouterr().err


def test_quick_chooses_the_small_size(missed_target):
    command.run(parsed())
    command.run(parsed(quick=False))
    assert missed_target == [study.QUICK, study.FULL]


def test_the_result_folder_has_text_markdown_and_json(missed_target, tmp_path, capsys):
    command.run(parsed(out=tmp_path / "here", json=True))
    assert {path.name for path in (tmp_path / "here").iterdir()} == {
        "bench.txt",
        "bench.md",
        "bench.json",
        "ppafo.json",
    }
    written = json.loads((tmp_path / "here" / "bench.json").read_text(encoding="utf-8"))
    assert json.loads(capsys.readouterr().out) == written
