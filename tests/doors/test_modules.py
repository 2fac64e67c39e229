"""The module of the page, under node: every sample of every channel, alone and as a run of an ensemble."""

import shutil
from typing import Any

import numpy as np
import pytest

from ppafo.page.wasm import module_of
from tests.doors.of_python import assert_near_metrics, assert_same_channels, parameter, python_answer, scenario_of
from tests.doors.table import EXPORTED, SHORT, Case
from tests.modules_under_node import COMPLETED, assert_alike, driven

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node on this machine")


def of_modules() -> list[Any]:
    """Every shipped program, and the richest cases, which wait for seconds until theirs is built."""
    cases = [case for case in EXPORTED if case.is_shipped or case in SHORT]
    return [parameter(case, suite="" if case.is_shipped else "long") for case in cases]


@pytest.mark.short
@pytest.mark.parametrize("case", of_modules())
def test_a_module_of_the_page_has_the_bits_of_python(case: Case) -> None:
    answer, module = python_answer(case), module_of(scenario_of(case))
    settings = np.array([[item["value"] for item in module.description["settings"]]])
    given = driven(module, settings)
    assert_alike(given)
    (ran,) = given.runs
    assert (ran.checked, ran.status, ran.good) == (-1, COMPLETED, len(answer.time))
    columns = {item["name"]: column for item, column in zip(module.description["channels"], ran.columns, strict=True)}
    assert columns.pop("time").tobytes() == answer.time.tobytes()
    assert_same_channels(columns, answer)
    names = [item["name"] for item in module.description["metrics"]]
    assert_near_metrics(dict(zip(names, ran.metrics.tolist(), strict=True)), answer)
