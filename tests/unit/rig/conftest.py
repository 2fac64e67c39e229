"""Presets without sensors' faults, and the true states behind a recording."""

from collections.abc import Callable

import pytest

from ppafo.rig.preset import Preset, load_preset
from ppafo.rig.setup import ExperimentRequest
from ppafo.rig.solution import RigRun
from ppafo.rig.transient import rig_run
from ppafo.simulation.loading import load_scenario


@pytest.fixture(scope="session")
def perfect() -> Preset:
    """The ideal laboratory without noise, offset and rounding."""
    preset = load_preset("ideal-laboratory")
    for path in preset.values:
        if path.rpartition(".")[2] in {"noise", "offset", "resolution"}:
            preset = preset.with_value(path, 0.0, "a test")
    return preset


@pytest.fixture
def on_the_rig() -> Callable[[str, Preset], RigRun]:
    """A scenario of the package on the rig, to be looked into."""

    def made(scenario: str, preset: Preset) -> RigRun:
        return rig_run(load_scenario(scenario), ExperimentRequest(preset, 1, "ppafo2011", None, ()), 1000.0)

    return made
