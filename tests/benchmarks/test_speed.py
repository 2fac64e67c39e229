import json

import pytest

from benchmarks.report import MISSING_EXTRA, BenchReport, Line, Machine, Target
from benchmarks.sampled_solvers import solve_by_samples
from benchmarks.single_run import COMPETITORS, lane_states, pressure_error
from benchmarks.task import torque_task
from tests.reference.reference_solver import solve_reference

MACHINE = Machine("a processor", "an OS", 2, True, "3.11.0", {"numpy": "2.0", "scikit-sundae": None})
SHORT = 0.3


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
