import json

import numpy as np
import pytest

from benchmarks import single_run
from benchmarks.report import MISSING_EXTRA, BenchReport, Line, Machine, Target
from benchmarks.sampled_solvers import solve_by_samples
from benchmarks.single_run import COMPETITORS, lane_states, pressure_error
from benchmarks.task import ensemble, named_rows, torque_task, volumes_of
from benchmarks.timing import Timing
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


def test_the_pressure_error_sees_a_wrong_mass(short_run, reference):
    wrong = reference.copy()
    wrong[:, 2] *= 1.01
    assert pressure_error(short_run, wrong, reference) > 1e-3


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


def test_the_ratio_to_a_solver_is_its_time_over_ours():
    lanes, lsoda = Timing((0.002, 0.001)), Timing((0.5, 0.4))
    line = single_run._ratio_line(COMPETITORS[0], lanes, lsoda)
    assert line.value == pytest.approx(400.0)
    assert line.spread == pytest.approx((200.0, 500.0))
    assert line.met is True


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
