"""The messages while models are compiled, and several at once."""

import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest

from ppafo.engine import loading
from ppafo.engine.cache import announcing
from ppafo.engine.cache.announcing import (
    SECONDS_FILE,
    announce,
    compile_side_by_side,
    estimate_seconds,
    processor_seconds,
)
from ppafo.engine.cache.making import load_all
from ppafo.engine.cache.programs import load_generated
from ppafo.engine.cache.tidying import list_programs
from ppafo.engine.compilers import Effort
from ppafo.engine.lanes import Batch, effort_for
from ppafo.errors import ProgramError
from ppafo.golden_bits import plain_batch
from tests.compilers_here import ScriptCompiler

QUICK = "answer = {}\n"


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(announcing, "QUIET", 0.05)


def test_nothing_is_said_of_what_is_quick(caplog: pytest.LogCaptureFixture) -> None:
    with announce(12.0, "kept"):
        pass
    time.sleep(0.1)
    assert caplog.messages == []


def test_what_takes_longer_is_said_while_it_runs_and_about_how_long(caplog: pytest.LogCaptureFixture) -> None:
    with announce(12.3, "kept in a folder"):
        time.sleep(0.2)
        assert caplog.messages == ["ppafo: compiling a model for this computer, about 12 s ..."]
    assert len(caplog.messages) == 2
    assert caplog.messages[1].startswith("ppafo: compiled in 0.")
    assert caplog.messages[1].endswith(" s and kept in a folder")


def test_what_fails_is_no_longer_announced(caplog: pytest.LogCaptureFixture) -> None:
    with pytest.raises(KeyboardInterrupt), announce(12.0, "kept"):
        raise KeyboardInterrupt
    time.sleep(0.1)
    assert caplog.messages == []


def test_the_time_expected_is_that_of_what_this_computer_has_compiled_by_length(tmp_path: Path) -> None:
    for name, seconds in (("a", "2.0"), ("b", "4.0"), ("c", "40.0"), ("d", "words")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "program.py").write_text("x" * 100)
        (tmp_path / name / "seconds.txt").write_text(seconds)
    (tmp_path / "e").mkdir()
    assert estimate_seconds("y" * 200, sorted(tmp_path.iterdir()), 2.5e-4) == pytest.approx(8.0)
    assert 5.0 < estimate_seconds("y" * 40_000, [], 2.5e-4) < 20.0


def test_the_time_expected_is_that_of_the_program_with_the_most_lines_in_common(tmp_path: Path) -> None:
    bladder, vane = ["step", "volume of a table"], ["step", "torque"]
    for name, lines, seconds in (("a", bladder, "20.0"), ("b", vane, "2.0"), ("c", vane, "2.0")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "program.py").write_text("\n".join(lines))
        (tmp_path / name / "seconds.txt").write_text(seconds)
    kept = sorted(tmp_path.iterdir())
    assert estimate_seconds("\n".join(bladder), kept, 1.0) == pytest.approx(20.0)
    assert estimate_seconds("\n".join(vane), kept, 1.0) == pytest.approx(2.0)


def test_models_that_are_needed_together_are_compiled_side_by_side_with_one_message(
    fresh_cache: Path, caplog: pytest.LogCaptureFixture
) -> None:
    compiler, together = ScriptCompiler(), threading.Barrier(2, timeout=60.0)
    sources = [QUICK.format(number) for number in (time.time(), 2.5, 3.5)]
    load_generated(sources[1], compiler)
    loaded = []

    def load(source: str, _effort: Effort) -> ModuleType:
        with announce(1.0, "kept"):
            together.wait()
            time.sleep(0.2)
        loaded.append(source)
        return load_generated(source, compiler)

    load_all([(source, Effort.FULL) for source in (*sources, sources[0])], compiler, load)
    assert set(loaded) == {sources[0], sources[2]}
    assert [message.partition(", about")[0] for message in caplog.messages[:1]] == [
        "ppafo: compiling 2 models for this computer"
    ]
    assert len(caplog.messages) == 2
    kept = [item.path / "seconds.txt" for item in list_programs(fresh_cache)]
    assert len(kept) == 3
    assert all(float(file.read_text()) >= 0.0 for file in kept)


def test_a_model_that_cannot_be_compiled_beside_others_is_an_error() -> None:
    def fail() -> None:
        raise ProgramError("no")

    with pytest.raises(ProgramError, match="no"):
        compile_side_by_side([fail, lambda: None], 1.0, "not kept")


def test_a_quick_program_is_made_only_where_the_full_one_is_not_kept(
    fresh_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loading, "compilers_to_try", lambda: (ScriptCompiler(),))
    first, second = (QUICK.format(time.time() + number) for number in range(2))

    def made() -> list[str]:
        return sorted(kept.path.name.split("_")[2] for kept in list_programs(fresh_cache))

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


@pytest.mark.parametrize(
    ("seconds", "program"),
    [(b"1.0", ""), (b"", "x"), (b"nan", "x"), (b"inf", "x"), (b"-3", "x"), (b"0.00", "x"), (b"\xff\x00", "x")],
)
def test_a_damaged_file_in_the_cache_does_not_stop_an_estimate(seconds: bytes, program: str, tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / SECONDS_FILE).write_bytes(seconds)
    (tmp_path / "one" / "program.py").write_text(program)
    assert estimate_seconds("y" * 1000, [tmp_path / "one"], 1.0e-3) == pytest.approx(1.0)


@pytest.mark.skipif(sys.platform == "win32", reason="processes have no children's time here")
def test_time_in_which_others_use_the_processor_is_none_of_a_compilation() -> None:
    before = processor_seconds()
    time.sleep(0.3)
    assert processor_seconds() - before < 0.1
    compiler = [sys.executable, "-c", "while __import__('time').process_time() < 0.2: pass"]
    subprocess.run(compiler, check=True)
    assert processor_seconds() - before > 0.15
