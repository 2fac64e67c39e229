"""The disk cache of compiled models: a second start hits it, changed physics misses it."""

import math
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.engine.cache.programs import load_generated
from ppafo.engine.entries import INLINE
from ppafo.engine.program import Program
from ppafo.engine.source_text import SourceCollector
from ppafo.engine.step import isothermal
from ppafo.errors import SimulationError
from ppafo.model import orifice
from ppafo.model.valves.proportional import IDEAL
from tests.compilers_here import ScriptCompiler
from tests.composed_programs import lane_source
from tests.reference.reference_slopes import right_hand_side_source

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


def test_threads_that_load_one_module_at_once_all_get_the_whole_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PPAFO_CACHE_DIR", str(tmp_path))
    source = "import time\ntime.sleep(0.2)\nlast_line = 1\n"
    with ThreadPoolExecutor(4) as pool:
        modules = list(pool.map(lambda _: load_generated(source, ScriptCompiler()), range(4)))
        assert [module.last_line for module in modules] == [1] * 4
    assert len({id(module) for module in modules}) == 1
    del sys.modules[modules[0].__name__]


def program() -> Program:
    """A program as the torque task uses it."""
    return Program(IDEAL, PROFILES["ramp_hold"], CONTROLLERS["pid"], PROFILES["constant"], True, False, isothermal)


def test_source_of_a_program_is_the_same_every_time() -> None:
    assert lane_source(program()) == lane_source(program())
    assert right_hand_side_source(program()) == right_hand_side_source(program())


def test_source_changes_with_a_number_deep_in_the_physics(monkeypatch: pytest.MonkeyPatch) -> None:
    from ppafo.engine.scheme import pneumatics

    before = lane_source(program())
    monkeypatch.setattr(pneumatics, "GAMMA", 0.3)
    assert lane_source(program()) != before


def test_generated_source_stands_alone() -> None:
    source = lane_source(program())
    assert "import ppafo" not in source
    assert "from ppafo" not in source


def uses_a_list(value: float) -> float:
    """Cannot be compiled: the global is no number."""
    return value + sum(NUMBERS)


NUMBERS = [1.0, 2.0]


def test_function_that_cannot_be_compiled_is_refused_by_name() -> None:
    with pytest.raises(SimulationError, match=r"uses_a_list.*NUMBERS"):
        SourceCollector(INLINE).add(uses_a_list)


def test_function_without_source_is_refused() -> None:
    with pytest.raises(SimulationError, match="source text is not available"):
        SourceCollector(INLINE).add(math.sqrt)


def test_collector_puts_callees_before_callers() -> None:
    collector = SourceCollector(INLINE)
    collector.add(orifice.orifice_flow)
    names = list(collector.definitions)
    assert names.index("model_orifice_fitted_flow_function") < names.index("model_orifice_orifice_flow")
