"""Whether a run determines its metrics: shipped scenarios do, a chaotic loop does not, and a check says so."""

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest

from ppafo.cli.main import main
from ppafo.errors import SimulationError
from ppafo.model.sensors import Measurement
from ppafo.running import simulate
from ppafo.simulation.check import FINER, MOVED_MEASUREMENT, MOVED_START, Check, ErrorEstimate, NumberCheck
from ppafo.simulation.loading import list_scenarios
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Status

CHAOTIC = (
    "motion.kind=free",
    "motion.angle=40 deg",
    "actuator.displacement_per_radian=51 cm^3/rad",
    "actuator.dead_volume_1=0.5 cm^3",
    "actuator.dead_volume_2=1.1 cm^3",
    "sensors.angle_resolution=0.1 deg",
    "sensors.pressure_resolution=0.05 psi_d",
    "run.duration=0.6 s",
)
"""A free vane in a torque loop with next to no gas behind it and coarse sensors."""


NO_ERROR = ErrorEstimate(0.0, 0.0, {})


class Threshold:
    """Full pressure on one side or the other, by a measurement and a level."""

    def __init__(self, reading: Callable[[Measurement], float], level: float) -> None:
        self.reading, self.level = reading, level

    def reset(self) -> None:
        pass

    def update(self, time: float, reference: float, measurement: Measurement) -> float:
        return 0.5 if self.reading(measurement) > self.level else -0.5


class Unforgetting:
    """Remembers the last run."""

    def __init__(self, command: float) -> None:
        self.command = command

    def reset(self) -> None:
        pass

    def update(self, time: float, reference: float, measurement: Measurement) -> float:
        self.command = min(1.0, self.command + 1e-3)
        return self.command


@pytest.fixture(scope="module")
def chaotic() -> Check:
    return simulate("torque-task-proportional", CHAOTIC).check()


BEGIN_IN_A_TIE = {"torque-task-solenoid"}
"""Scenarios whose first sample has exactly the torque or angle that is wanted: which side the valve opens is a tie."""


@pytest.mark.parametrize("name", list_scenarios())
def test_every_metric_of_a_scenario_of_the_package_can_be_repeated_unless_it_begins_in_a_tie(name: str) -> None:
    result = simulate(name)
    check = result.check()
    lost = [row for row in (*check.metrics, *check.courses) if not row.is_determined]
    assert all(row.changed_by == {MOVED_START} for row in lost)
    assert bool(lost) == (name in BEGIN_IN_A_TIE), check.sentence
    assert check.sentence.startswith("Numerically sensitive: " if lost else "All metrics are repeatable")
    assert [row.name for row in check.metrics] == list(result.metrics)
    assert [row.value for row in check.metrics] == [metric.value for metric in result.metrics.values()]
    assert check.failed == ()


def test_a_loop_that_begins_in_a_tie_is_told_from_one_that_does_not() -> None:
    tied = simulate("torque-task-solenoid").check()
    assert {"rms_error", "gas_supplied", "pressures over time"} <= {
        row.name for row in (*tied.metrics, *tied.courses) if not row.is_determined
    }
    assert tied.parts_at is not None
    assert tied.parts_at < 0.01
    # From 1 psi on one side the first decision is no tie.
    firm = simulate("torque-task-solenoid", ["initial.pressure_1=1 psi_g"]).check()
    assert firm.is_determined, firm.sentence


def test_a_chaotic_loop_is_found_with_the_time_at_which_its_runs_part(chaotic: Check) -> None:
    assert not chaotic.is_determined
    assert {"rms_error", "switchings"} <= {row.name for row in chaotic.metrics if not row.is_determined}
    assert list(chaotic.metrics[0].changes) == [FINER, MOVED_START, MOVED_MEASUREMENT]
    assert MOVED_MEASUREMENT in chaotic.metrics[0].changed_by
    assert chaotic.parts_at is not None
    assert 0.0 < chaotic.parts_at < 0.6
    assert chaotic.sentence.startswith("Numerically sensitive: rms_error")
    assert f"separate at t = {chaotic.parts_at:.4g} s" in chaotic.sentence


def test_what_only_the_error_changes_is_told_from_what_nobody_could_measure() -> None:
    moved = NumberCheck("switchings", "-", 7.0, 7e-3, {FINER: 1.0, MOVED_START: -2.0}, 7e-3)
    inexact = NumberCheck("rms_error", "N m", 1.0, 1e-3, {FINER: -2e-3, MOVED_START: 1e-9}, 1e-3)
    firm = NumberCheck("peak_error", "N m", 1.0, 1e-3, {FINER: 1e-3, MOVED_START: 1e-9}, 1e-3)
    gone = NumberCheck("gas_per_work", "kg/J", math.nan, 1e-3, {FINER: 0.0, MOVED_START: math.inf}, 1e-3)
    assert (moved.changed_by, gone.changed_by) == ({FINER, MOVED_START}, {MOVED_START})
    assert inexact.changed_by == {FINER}
    sentence = Check("loop", (moved, inexact, firm), (), NO_ERROR, None, ()).sentence
    assert sentence.startswith("Numerically sensitive: switchings: changed by moving a start by 1e-07 of its range")
    assert (
        "Also: rms_error: changed by finer steps with a sixteenth of the error. Set a smaller run.tolerance" in sentence
    )
    assert "peak_error" not in sentence
    assert Check("loop", (firm,), (), NO_ERROR, None, ()).is_determined
    diverged = Check("loop", (firm,), (), NO_ERROR, 0.1, (MOVED_START,))
    assert not diverged.is_determined
    # A count of events is said to be sensitive, and fails no check.
    counted = Check("loop", (moved, firm), (), NO_ERROR, None, ())
    assert [check.passes for check in (counted, diverged)] == [True, False]
    assert not Check("loop", (inexact,), (), NO_ERROR, None, ()).passes
    assert "completion: the run with start moved diverged." in diverged.sentence
    assert diverged.sentence.endswith(" The runs separate at t = 0.1 s.")


def test_a_decision_by_a_hair_of_the_start_is_found(torque_task: Callable[[str], Scenario]) -> None:
    atmosphere = torque_task("proportional").device.supply.atmospheric_pressure
    controller = Threshold(lambda seen: seen.pressure_1, atmosphere * (1.0 + 0.5e-7))
    before = torque_task("proportional")
    once = dataclasses.replace(before, run=dataclasses.replace(before.run, duration=0.05))
    slow = dataclasses.replace(once, controller=dataclasses.replace(once.controller, period=0.05))
    check = simulate(slow.controlled_by(controller)).check()
    lost = next(row for row in check.metrics if row.name == "rms_error")
    assert lost.changed_by == {MOVED_START}
    assert "moving a start by 1e-07 of its range" in check.sentence
    assert "finer steps" not in check.sentence


def test_a_controller_that_gives_another_run_each_time_is_refused(torque_task: Callable[[str], Scenario]) -> None:
    before = torque_task("proportional")
    scenario = dataclasses.replace(before, run=dataclasses.replace(before.run, duration=0.05))
    result = simulate(scenario.controlled_by(Unforgetting(0.0)))
    with pytest.raises(
        SimulationError, match=r"Unforgetting gives different results in equal runs.* reset\(\) must restore"
    ):
        result.check()


def test_a_run_that_diverged_is_not_checked(step_response: Scenario) -> None:
    result = dataclasses.replace(simulate(step_response), status=Status("diverged", 0.01, "diverged at t = 0.01 s"))
    with pytest.raises(SimulationError, match="step-response: the run diverged"):
        result.check()


def test_the_command_ends_with_1_where_the_run_does_not_determine_its_metrics(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changes = [word for change in CHAOTIC for word in ("--set", change)]
    assert main(["simulate", "torque-task-proportional", *changes, "--check", "--out", str(tmp_path)]) == 1
    printed = capsys.readouterr().out
    assert "Numerically sensitive: rms_error" in printed
    assert printed.splitlines()[-1].endswith("check.json)")
    assert json.loads((tmp_path / "check.json").read_text())["is_determined"] is False
