"""Values that Python programs hand in: masked arrays, times, enumerations, tables, proxies, changed scenarios."""

import enum
import tomllib
from importlib.resources import files
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

import ppafo
from ppafo import ArgumentError
from ppafo.arguments.values import taken_overrides, taken_text

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
