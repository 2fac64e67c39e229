"""Shared set-up: scenarios of the paper, and one cache folder for compiled models."""

import dataclasses
import os
import pickle
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from ppafo import plugins
from ppafo.analyses.reproduce.paper import Reproduction, reproduce_paper
from ppafo.engine import cache
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.scenario import Scenario

pytest_plugins = ("tests.costs", "tests.built_once", "tests.quickly_compiled", "tests.repeatable")


def pytest_configure() -> None:
    """Let no model be watched by coverage while it is compiled."""
    cache.execute = _unwatched(cache.execute)


def _unwatched(run: Callable[..., ModuleType]) -> Callable[..., ModuleType]:
    """A function without the tracer of coverage: the compiler would take half as long again, and is not ours."""

    def call(*arguments: Any) -> ModuleType:
        tracer = sys.gettrace()
        sys.settrace(None)
        try:
            return run(*arguments)
        finally:
            sys.settrace(tracer)

    return call


@pytest.fixture(autouse=True)
def own_plugins(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the plug-ins that a test names, also for its child processes, to that test."""
    monkeypatch.setattr(plugins, "_named", dict(plugins._named))
    monkeypatch.setenv(plugins.VARIABLE, os.environ.get(plugins.VARIABLE, ""))


@pytest.fixture
def step_response() -> Scenario:
    """The step response of figure 7."""
    return load_scenario("step-response")


@pytest.fixture
def torque_task() -> Callable[[str], Scenario]:
    """The torque task of figure 8, by valve."""
    return lambda valve: load_scenario(f"torque-task-{valve}")


@pytest.fixture
def shorter() -> Callable[[Scenario, float], Scenario]:
    """A scenario that ends earlier [s]."""
    return lambda scenario, duration: dataclasses.replace(
        scenario, run=dataclasses.replace(scenario.run, duration=duration)
    )


@pytest.fixture(scope="session")
def reproduction() -> Reproduction:
    """The paper's experiments, run once in a session, whichever process needs them first."""
    from tests.built_once import once  # a plugin, which pytest loads first

    run = once(("the paper's experiments",), lambda: pickle.dumps(reproduce_paper()))
    found: Reproduction = pickle.loads(run.read_bytes())
    return found


@pytest.fixture
def fresh_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder for compiled models."""
    monkeypatch.setenv("PPAFO_CACHE_DIR", str(tmp_path / "programs"))
    return tmp_path / "programs"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real measurements, beside the repository or where PPAFO_SHARED_DATA says."""
    beside = Path(__file__).parents[2] / "shared" / "data"
    folder = Path(os.environ.get("PPAFO_SHARED_DATA", beside))
    if not folder.is_dir():
        pytest.skip("the real measurements are not here: no ../shared/data, and PPAFO_SHARED_DATA names no folder")
    return folder
