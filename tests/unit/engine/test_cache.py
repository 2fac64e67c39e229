"""The disk cache of compiled models: a second start hits it, changed physics misses it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.engine.program import Program
from ppafo.model.valves.proportional import IDEAL
from tests.composed_programs import lane_source

START = """
import sys, time
import ppafo
if len(sys.argv) > 1:
    import ppafo.model.plant as vane
    text = open(vane.__file__).read().replace("(pressure_1 - pressure_2)", "(pressure_1 - 0.5 * pressure_2)")
    path = sys.argv[1]
    open(path, "w").write(text)
    import importlib.util
    spec = importlib.util.spec_from_file_location("ppafo.model.plant", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["ppafo.model.plant"] = module
    spec.loader.exec_module(module)
result = ppafo.simulate("torque-task-proportional", ["run.duration=50 ms"])
print(float(result.recording["torque"][-1]))
"""


def files_of(cache: Path) -> dict[Path, bytes]:
    """All that is kept, byte by byte."""
    return {path: path.read_bytes() for path in cache.rglob("*") if path.is_file()}


def start(cache: Path, *arguments: str) -> tuple[float, bool]:
    """Last torque of a short run in a new process, and whether it compiled anything."""
    environment = {**os.environ, "PPAFO_CACHE_DIR": str(cache)}
    before = files_of(cache)
    done = subprocess.run(
        [sys.executable, "-c", START, *arguments], env=environment, capture_output=True, text=True, check=True
    )
    return float(done.stdout), files_of(cache) != before


def test_second_start_finds_the_compiled_model_and_changed_physics_does_not(tmp_path: Path) -> None:
    cache = tmp_path / "programs"
    first, compiled_first = start(cache)
    second, compiled_second = start(cache)
    changed, compiled_changed = start(cache, str(tmp_path / "vane.py"))
    assert compiled_first
    assert not compiled_second
    assert compiled_changed
    assert first == second
    assert changed != first


def program() -> Program:
    """A program as the torque task uses it."""
    return Program(IDEAL, PROFILES["ramp_hold"], CONTROLLERS["pid"], PROFILES["constant"], True, False)


def test_source_changes_with_a_number_deep_in_the_physics(monkeypatch: pytest.MonkeyPatch) -> None:
    from ppafo.engine.scheme import pneumatics

    before = lane_source(program())
    monkeypatch.setattr(pneumatics, "GAMMA", 0.3)
    assert lane_source(program()) != before
