"""Results handed on: pickled, copied, in the units that are asked for, and in a notebook."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest

import ppafo
import ppafo.gym
from ppafo.errors import DataError, UnitError

TASK = "torque-task-proportional"
MADE: dict[str, Callable[[], Any]] = {
    "simulate": lambda: ppafo.simulate(TASK),
    "walk": lambda: ppafo.walk("solenoid", minutes=0.1),
    "parts": ppafo.parts,
    "bottle": lambda: ppafo.bottle(gas_per_stride="0.3 g"),
    "compare": lambda: ppafo.compare([TASK, "torque-task-solenoid"]),
    "find": lambda: ppafo.find(TASK, vary="supply.pressure=20..90 psi_g", such_that="rms_error <= 0.5 N m", grid=3),
    "linearise": lambda: ppafo.linearise(TASK, overrides={"reference.level": 3.0}),
    "sweep": lambda: ppafo.sweep("torque-task-uncertainty", draws=4),
    "estimate": lambda: ppafo.estimate(
        "torque-task-uncertainty", metric="rms_error", configuration="solenoid", draws=256
    ),
    "sensitivity": lambda: ppafo.sensitivity(
        "torque-task-uncertainty", configuration="solenoid", samples=64, metrics="rms_error"
    ),
}
COPIES: dict[str, Callable[[Any], Any]] = {
    "pickled": lambda result: pickle.loads(pickle.dumps(result)),
    "copied": copy.copy,
    "copied deeply": copy.deepcopy,
}


@pytest.mark.parametrize("name", MADE)
def test_a_result_can_be_pickled_and_copied_and_still_prints_and_draws_itself(name: str) -> None:
    result = MADE[name]()
    for make in COPIES.values():
        other = make(result)
        assert str(other) == str(result)
        if getattr(other, "figures", None) != {}:
            assert other.plot().axes


@pytest.mark.parametrize("name", ["ppafo/TorqueTask-v0", "ppafo/StepAngle-v0"])
def test_a_copy_of_an_environment_goes_on_by_itself(name: str) -> None:
    env = gymnasium.make(name)
    env.reset(seed=1)
    action = env.action_space.sample()
    env.step(action)
    others = [copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    planned = [[other.step(action)[0] for _ in range(3)] for other in others]
    done = [env.step(action)[0] for _ in range(3)]
    for foreseen in planned:
        np.testing.assert_array_equal(foreseen, done)


def test_a_channel_is_given_in_si_and_in_the_unit_that_is_asked() -> None:
    result = ppafo.simulate(TASK, {"supply.atmospheric_pressure": 90.0e3})
    pressure = result.recording["pressure_1"]
    np.testing.assert_array_equal(result["pressure_1"], pressure)
    np.testing.assert_allclose(result["pressure_1", "kPa_g"], 1e-3 * (pressure - 90.0e3), rtol=1e-9, atol=1e-6)
    data = result.dataset(units={"pressure_1": "kPa_g", "angle": "deg"})
    assert data["pressure_1"].attrs["units"] == "kPa_g"
    assert data["pressure_2"].attrs["units"] == "Pa"
    table = result.to_dataframe(units={"angle": "deg"})
    assert table["angle"].iloc[0] == pytest.approx(75.0)
    assert table.index.name == "time"
    with pytest.raises(UnitError, match="channel 'angle' in 'psi_g'"):
        _ = result["angle", "psi_g"]
    with pytest.raises(DataError, match="no channel 'torqe', did you mean 'torque'"):
        _ = result["torqe"]


def test_a_metric_is_a_number_and_channels_are_completed() -> None:
    result = ppafo.simulate(TASK)
    assert float(result.metrics["rms_error"]) == result.metrics["rms_error"].value
    assert np.sqrt(result.metrics["rms_error"]) > 0.0
    assert "torque" in result._ipython_key_completions_()
    assert "torque" in result.recording._ipython_key_completions_()


def test_a_notebook_shows_table_and_figure_without_a_word_of_its_own() -> None:
    shown = ppafo.simulate(TASK)._repr_html_()
    assert "RMS error" in shown
    assert "<img" in shown
    assert vars(ppafo.simulate(TASK).plot())["_repr_png_"]().startswith(b"\x89PNG")
