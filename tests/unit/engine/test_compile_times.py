"""The messages while models are compiled, and several at once."""

import threading
import time
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest

from ppafo.engine import cache, loading
from ppafo.engine.cache import announce, entries
from ppafo.engine.compilers import Effort
from ppafo.engine.lanes import Batch, effort_for
from ppafo.engine.loading import compile_together, load_generated
from ppafo.golden_bits import plain_batch
from tests.compilers_here import ScriptCompiler

QUICK = "answer = {}\n"


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "QUIET", 0.05)


def test_models_that_are_needed_together_are_compiled_side_by_side_with_one_message(
    fresh_cache: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    compiler, together = ScriptCompiler(), threading.Barrier(2, timeout=60.0)
    sources = [QUICK.format(number) for number in (time.time(), 2.5, 3.5)]
    load_generated(sources[1], compiler)
    loaded = []

    def load(source: str, _effort: Effort) -> ModuleType:
        with announce():
            together.wait()
            time.sleep(0.2)
        loaded.append(source)
        return load_generated(source, compiler)

    monkeypatch.setattr(loading, "compiled", load)
    compile_together([(source, Effort.FULL) for source in (*sources, sources[0])], compiler)
    assert set(loaded) == {sources[0], sources[2]}
    assert caplog.messages[:1] == ["ppafo: compiling 2 models for this computer ..."]
    assert len(caplog.messages) == 2
    assert len(entries(fresh_cache)) == 3


def test_a_quick_program_is_made_only_where_the_full_one_is_not_kept(
    fresh_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loading, "compilers_to_try", lambda: (ScriptCompiler(),))
    first, second = (QUICK.format(time.time() + number) for number in range(2))

    def made() -> list[str]:
        return sorted(kept.path.name.split("_")[2] for kept in entries(fresh_cache))

    loading.compiled(first, Effort.QUICK)
    assert made() == ["quick"]
    loading.compiled(second)
    loading.compiled(second, Effort.QUICK)
    assert made() == ["full", "quick"]


def test_some_runs_of_seconds_are_compiled_quickly_and_many_runs_are_not() -> None:
    batch = plain_batch("torque-task-proportional")

    def repeated(runs: int) -> Batch:
        return replace(batch, parameters=batch.parameters.repeat(runs, 1), states=batch.states.repeat(runs, 1))

    hours = replace(batch, clock=replace(batch.clock, step_count=10_000_000))
    efforts = [effort_for(each) for each in (batch, repeated(12), repeated(1000), hours)]
    assert efforts == [Effort.QUICK, Effort.QUICK, Effort.FULL, Effort.FULL]
