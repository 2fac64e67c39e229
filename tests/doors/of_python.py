"""The reference of every door: the functions of the step run by Python itself, and how close a door must come to it."""

import contextlib
import functools
import math
import os
import pickle
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ppafo.engine.loading import BACKEND_VARIABLE, PYTHON
from ppafo.running import simulate
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result
from tests.built_once import once
from tests.doors.table import CASES, Case

Floats = NDArray[np.float64]

NEAR = 1.0e-12
"""Largest relative difference of a metric: a door may add up in another order."""
ALLOWED_AT_ZERO = 1.0e-15
"""Largest difference [SI] of a metric that is nothing but rounding."""


def parameter(case: Case, *more: Any, suite: str = "") -> Any:
    """A case, and what else a test of it is given, with the marks of its suite or of another one."""
    name = ", ".join([case.name, *map(str, more)])
    return pytest.param(case, *more, id=name, marks=getattr(pytest.mark, suite or case.suite))


def parameters(cases: Sequence[Case] = CASES) -> list[Any]:
    """Cases as parameters of a test, with the marks of their suites."""
    return list(map(parameter, cases))


@dataclass(frozen=True)
class Answer:
    """What Python says of a case: how the run ended, times [s], channels and metrics, in SI."""

    ended: str
    time: Floats
    channels: Mapping[str, Floats]
    metrics: Mapping[str, float]


def answer_of(result: Result) -> Answer:
    """The same of any result."""
    recording = result.recording
    channels = {name: recording[name] for name in recording.names}
    metrics = {name: metric.value for name, metric in result.metrics.items()}
    return Answer(result.status.kind, recording.time, channels, metrics)


@contextlib.contextmanager
def run_by(backend: str) -> Iterator[None]:
    """Let a backend run the lanes: ``PYTHON``, or an empty text for the compiler of this computer."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(BACKEND_VARIABLE, backend)
        yield


@functools.cache
def scenario_of(case: Case) -> Scenario:
    """The scenario of a case."""
    return case.load()


@functools.cache
def python_answer(case: Case) -> Answer:
    """The answer of Python, found once in a session."""

    def found() -> bytes:
        with run_by(PYTHON):
            return pickle.dumps(answer_of(simulate(scenario_of(case))))

    answer: Answer = pickle.loads(once(("answer of Python", case), found).read_bytes())
    assert answer.ended == "completed", case
    assert len(answer.time) > 1
    return answer


@functools.cache
def compiled_result(case: Case) -> Result:
    """The result of compiled code."""
    with run_by(""):
        return simulate(scenario_of(case))


def assert_same_channels(found: Mapping[str, Floats], answer: Answer, but: Sequence[str] = ()) -> None:
    """Every channel that Python has too has its bits at every sample; some at least are there."""
    shared = [name for name in found if name in answer.channels and name not in but]
    assert len(shared) >= 5, shared
    differ = {
        name: float(np.abs(found[name] - answer.channels[name]).max())
        if len(found[name]) == len(answer.time)
        else f"{len(found[name])} samples for {len(answer.time)}"
        for name in shared
        if np.asarray(found[name]).tobytes() != answer.channels[name].tobytes()
    }
    assert not differ, differ


def assert_near_metrics(found: Mapping[str, float], answer: Answer) -> None:
    """Every metric that Python has too is near; NaN stands for one that a run has not."""
    shared = {name: value for name, value in found.items() if name in answer.metrics}
    differ = {
        name: (value, answer.metrics[name])
        for name, value in shared.items()
        if not math.isclose(value, answer.metrics[name], rel_tol=NEAR, abs_tol=ALLOWED_AT_ZERO)
    }
    assert not differ, differ
    made_up = {name: value for name, value in found.items() if name not in shared and not math.isnan(value)}
    assert not made_up, f"Python has no such metric: {made_up}"
    assert len(shared) >= 3


def environment() -> dict[str, str]:
    """The surroundings of a program that is run: any fault that a sanitizer finds ends it."""
    return {**os.environ, "ASAN_OPTIONS": "detect_leaks=1", "UBSAN_OPTIONS": "halt_on_error=1"}
