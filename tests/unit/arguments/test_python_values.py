"""Values that Python programs hand in: masked arrays, times, enumerations, tables, proxies, changed scenarios."""

import enum
import itertools
import math
import tomllib
from dataclasses import replace
from importlib.resources import files
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo import ArgumentError, Channel, DataError, ScenarioError
from ppafo.arguments.values import taken_document, taken_overrides, taken_text

TASK = "torque-task-proportional"
MASKED = np.ma.array([3.0, 4.0], mask=[True, False])


class Word(str, enum.Enum):  # noqa: UP042  # its str() is not its text, as in many programs
    PRESSURE = "supply.pressure"
    SIXTY = "60 psi_g"
    TASK = "torque-task-proportional"


class Shouting(str):
    def __str__(self) -> str:
        return self.upper()


def document() -> dict[str, Any]:
    return tomllib.loads((files("ppafo") / "scenarios" / f"{TASK}.toml").read_text("utf-8"))


def test_an_enumeration_of_texts_and_any_other_subclass_count_as_their_text() -> None:
    assert taken_overrides({Word.PRESSURE: Word.SIXTY}) == ("supply.pressure=60 psi_g",)
    assert taken_overrides([Shouting("a.b=2 mm")]) == ("a.b=2 mm",)
    assert type(taken_text(Word.TASK)) is str
    assert ppafo.load_scenario(Word.TASK, {Word.PRESSURE: Shouting("60 psi_g")}) == ppafo.load_scenario(
        TASK, ["supply.pressure=60 psi_g"]
    )
    content = {**document(), "name": Word.TASK}
    assert ppafo.scenario_from_dict(content).name == TASK


@pytest.mark.parametrize("number", [np.ma.masked, MASKED[0], np.ma.array(3.0, mask=True), np.timedelta64(3)])
def test_a_masked_number_and_a_time_of_numpy_are_no_number(number: Any) -> None:
    with pytest.raises(ArgumentError, match=r"^overrides: run\.duration = .*: must be a finite number in SI units"):
        ppafo.load_scenario(TASK, {"run.duration": number})
    with pytest.raises(ArgumentError, match=r"^seed="):
        ppafo.load_study("torque-task-uncertainty", seed=number)


@pytest.mark.parametrize(
    "overrides",
    [
        MappingProxyType({"run": MappingProxyType({"duration": "1 s"})}),
        (text for text in ["run.duration=1 s"]),
        map(str, ["run.duration=1 s"]),
        {"run.duration=1 s": None}.keys(),
        np.array(["run.duration=1 s"]),
    ],
)
def test_a_proxy_and_a_generator_are_overrides_as_a_dictionary_and_a_list_are(overrides: Any) -> None:
    assert ppafo.load_scenario(TASK, overrides) == ppafo.load_scenario(TASK, ["run.duration=1 s"])


def test_a_document_that_holds_itself_comes_to_an_end() -> None:
    endless: dict[str, Any] = document()
    endless["run"] = endless
    with pytest.raises(ScenarioError, match="deep"):
        ppafo.scenario_from_dict(endless)
    assert taken_document({"x": list(itertools.islice(itertools.repeat(1), 2))}) == {"x": [1, 1]}


@pytest.mark.parametrize("number", [math.nan, math.inf, 0, -1.0, "1 s", None, True, np.ma.masked, np.timedelta64(3)])
def test_a_number_of_a_changed_scenario_is_checked_as_one_of_a_file(number: Any) -> None:
    scenario = ppafo.load_scenario(TASK)
    with pytest.raises(ScenarioError, match=r"run\.duration = .*: must be more than 0 s and at most 1e\+06 s"):
        ppafo.simulate(replace(scenario, run=replace(scenario.run, duration=number)))


def test_a_masked_value_of_a_channel_is_none() -> None:
    assert np.isnan(Channel(MASKED, "rad").values).tolist() == [True, False]
    with pytest.raises(DataError, match="channel 'angle' is nan at sample 1"):
        ppafo.Recording("x", np.array([0.0, 1.0]), {"angle": Channel(MASKED, "rad")})
    for values in (np.array([1, 2], dtype="m8[s]"), np.array([1j, 2.0]), np.array(["1", "2"]), (x for x in [1.0])):
        with pytest.raises(DataError, match="the values of a channel must be "):
            Channel(values, "rad")  # type: ignore[arg-type]
