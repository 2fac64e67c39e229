"""Trials of a design: what runs come to, and which are none."""

import numpy as np

from ppafo.analyses.design.trials import OSCILLATES, run_trials
from ppafo.loading import load_scenario


def test_a_trial_whose_loop_oscillates_is_no_design_however_small_its_error_is() -> None:
    overrides = ["reference.level=4 N m", "run.duration=1 s", "reference.ramp_time=0.5 s", "valve.delay=10 ms"]
    scenario = load_scenario("torque-task-proportional", overrides)
    columns = {"controller.proportional_gain": np.array([0.02, 1.0, 8.0])}
    outcome = run_trials(scenario, columns, ("rms_error",), np.empty(0), 1)
    assert np.isfinite(outcome.metrics["rms_error"]).tolist() == [[True, True, False]]
    assert (outcome.runs, outcome.failed, outcome.reasons) == (3, 1, [OSCILLATES])
