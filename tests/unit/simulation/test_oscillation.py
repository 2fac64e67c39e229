"""A run says which gains are in force, and first of all that its torque loop oscillates."""

import json
from pathlib import Path

import numpy as np
import pytest

from ppafo.cli.main import main
from ppafo.counterfactuals import verdict_of
from ppafo.loading import load_scenario
from ppafo.running import simulate
from ppafo.simulation.ensemble import run_ensemble
from ppafo.simulation.gains import gains_of
from ppafo.simulation.tracking import most_reversals
from ppafo.walking import load_walk, walk

FAST = ["controller.proportional_gain=60 1/(N m)", "controller.derivative_gain=0.05 s/(N m)", "valve.delay=5 ms"]
TASK = "torque-task-proportional"


def test_given_gains_and_computed_ones_are_told_apart() -> None:
    found = gains_of(load_walk("proportional", ["controller.torque_gain=2 1/(N m)"]))
    assert found is not None
    assert [(item.name, item.computed) for item in found.gains] == [
        ("torque_gain", False),
        ("torque_integral_gain", True),
    ]
    assert found.dead_time == 1.5e-3
    assert found.sentence.startswith("gains: torque_gain 2 1/(N m) (given); torque_integral_gain 167 ")
    assert gains_of(load_scenario("step-response")) is None


def test_a_verdict_names_the_gain_that_mends_the_loop_and_it_does() -> None:
    result = simulate(TASK, FAST)
    verdict = result.tracking
    assert (
        verdict.number == result.metrics["command_reversals"].value / result.recording.duration > verdict.limit == 10.0
    )
    assert " command reversals a second of the whole run (10 allowed)" in verdict.sentence
    mended = verdict_of(result).mended
    assert not any(text.startswith(("valve.", "sensors.")) for text in mended)
    again = simulate(TASK, [*(text for text in FAST if text.partition("=")[0] not in str(mended)), *mended])
    # 6 N m lie beyond reach on purpose.
    assert again.tracking.kind == "does not follow"
    assert not again.tracking.is_useless
    assert again.metrics["rms_error"].value < result.metrics["rms_error"].value


def test_a_law_that_only_switches_may_turn_as_often_as_it_likes() -> None:
    result = simulate(TASK, ["controller.kind=on_off"])
    assert result.metrics["command_reversals"].value > 100.0
    assert result.tracking.fails
    assert not result.tracking.is_useless
    assert most_reversals(result.scenario) == float("inf")


def test_simulate_says_it_before_the_numbers_in_text_page_and_data_and_a_check_ends_with_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["simulate", TASK, *(word for text in FAST for word in ("--set", text)), "--out", str(tmp_path / "run")]
    assert main(words) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("the torque loop oscillates: ")
    order = ("the torque loop oscillates: ", "rms_error ", "Estimated error ", "gains: ", "written: ")
    at = [next(row for row, line in enumerate(lines) if line.startswith(words)) for words in order]
    assert at == sorted(at)
    assert "oscillates: " in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert main([*words, "--check", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["tracking"]["per"] == "second"


def test_a_walk_says_it_and_meters_count_what_its_recording_shows() -> None:
    gain = "controller.torque_gain"
    base = load_walk("proportional", ["run.duration=8 s"])
    together = run_ensemble(
        base, {gain: np.array([4.0, 40.0])}, ["command_reversals", "torque_error", "peak_torque"]
    ).metrics
    for run, value in enumerate((4.0, 40.0)):
        alone = walk(load_walk("proportional", ["run.duration=8 s", f"{gain}={value} 1/(N m)"]))
        for name, metered in together.items():
            assert metered[run] == pytest.approx(alone.metrics[name].value, rel=1e-9)
        assert (alone.tracking.fails) == (value > 10.0)
    verdict = alone.tracking
    assert verdict.fails
    assert " a stride of the whole run (" in verdict.found
    assert verdict_of(alone).mended[0].startswith("controller.torque_gain=")
