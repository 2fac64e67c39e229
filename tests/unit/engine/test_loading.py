"""Which compiler makes a model: the first that works, and one line about each that does not."""

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from ppafo.engine import loading
from ppafo.engine.cache import entries
from ppafo.engine.compilers import OFFERED
from ppafo.engine.loading import BACKEND_VARIABLE, compilers_to_try
from ppafo.errors import SimulationError
from ppafo.translation import compiling, native
from tests.interpreted import load_source

HEADER = "import math\n\n\n"
ADVANCE = '@entry("void(float64[:, ::1])")\ndef advance(x):\n    x[0, 0] = '
WITHOUT_HEADERS = "#!/bin/sh\necho 'program.c:1:10: fatal error: math.h: No such file or directory' >&2\nexit 1\n"
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")
on_unix = pytest.mark.skipif(sys.platform == "win32", reason="the compilers that fail are shell scripts")


@pytest.fixture(autouse=True)
def _no_choice_yet(fresh_cache: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Nothing is chosen, kept or known to fail."""
    monkeypatch.delenv(BACKEND_VARIABLE, raising=False)
    monkeypatch.setattr(loading, "_FAILED", set())
    forget()
    yield
    forget()


def forget() -> None:
    """As in a new process, but for what is known to fail."""
    loading._compilers.cache_clear()
    loading._load_by.cache_clear()
    native._file_identity.cache_clear()
    for name in [item for item in sys.modules if item.startswith("ppafo_")]:
        del sys.modules[name]


def text(value: str) -> str:
    return f"{HEADER}{ADVANCE}{value}\n"


def chosen() -> str:
    """What is tried first."""
    return next((compiler.name for compiler in compilers_to_try()), "python")


def result_of(source: str) -> float:
    x = np.array([[2.0]])
    load_source(source).advance(x)
    return float(x[0, 0])


def compiler_that_fails(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A compiler of this name that finds no headers, the first on the path."""
    folder.mkdir(exist_ok=True)
    file = folder / name
    file.write_text(WITHOUT_HEADERS, encoding="utf-8")
    file.chmod(0o755)
    monkeypatch.setenv("PATH", str(folder), prepend=":")
    forget()
    return file


def only(names: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the computer have only these compilers."""
    monkeypatch.setattr("ppafo.engine.loading.OFFERED", {name: OFFERED[name] for name in names})
    forget()


def test_a_computer_without_a_compiler_of_c_lets_python_run_the_models_and_says_so_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(native, "_command", lambda _: ())
    loading._say_slow.cache_clear()
    assert compilers_to_try() == ()
    assert [result_of(text(f"x[0, 0] + {added}")) for added in (1.5, 2.5)] == [3.5, 4.5]
    (said,) = caplog.messages
    assert "no working C compiler was found; install gcc or clang" in said


@on_unix
@needs_gcc
def test_a_compiler_without_headers_is_reported_once_and_the_next_one_compiles(
    fresh_cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    real = str(shutil.which("gcc"))
    only(("clang", "gcc"), monkeypatch)
    compiler_that_fails("clang", tmp_path / "bin", monkeypatch)
    monkeypatch.setattr(native, "_command", lambda name: (str(tmp_path / "bin" / name) if name == "clang" else real,))
    assert result_of(text("x[0, 0] * 3.0")) == 6.0
    (said,) = caplog.messages
    assert "models are compiled by gcc instead" in said
    assert chosen() == "gcc"
    caplog.clear()
    assert result_of(text("x[0, 0] * 4.0")) == 8.0
    assert caplog.messages == []
    assert {path.name.split("_")[1] for path, _, _ in entries(fresh_cache) if path.name.startswith("ppafo_")} == {"gcc"}


@on_unix
@needs_gcc
def test_a_compiler_that_never_ends_is_stopped_with_what_it_started_and_the_next_one_compiles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    only(("gcc",), monkeypatch)
    started = tmp_path / "started"
    compiler_that_fails("gcc", tmp_path / "bin", monkeypatch).write_text(
        f"#!/bin/sh\nsleep 600 &\necho $! > {started}\nwait\n", encoding="utf-8"
    )
    monkeypatch.setattr(compiling, "LONGEST_COMPILING", 0.5)
    assert result_of(text("x[0, 0] + 0.75")) == 2.75
    assert "gcc did not finish within 0.5 s and was stopped" in caplog.messages[0]
    # Whoever takes over what has lost its parent may not ask how it ended: then it is dead and still there.
    state = Path(f"/proc/{started.read_text(encoding='utf-8').strip()}/stat")
    assert not state.exists() or state.read_text(encoding="utf-8").rpartition(")")[2].split()[0] in "ZX"


@on_unix
@needs_gcc
@pytest.mark.usefixtures("fully_compiled")
@pytest.mark.parametrize("flag", ["-ffp-contract=fast", "-funsafe-math-optimizations"])
def test_a_compiler_that_is_set_to_join_or_reorder_operations_is_left_out(
    flag: str, fresh_cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    if "contract" in flag and " fma " not in native.described_processor():
        pytest.skip("this processor has no instruction that joins a product and a sum")
    real = shutil.which("gcc")
    only(("gcc",), monkeypatch)
    wrapper = compiler_that_fails("gcc", tmp_path / "bin", monkeypatch)
    wrapper.write_text(f'#!/bin/sh\nexec {real} "$@" {flag}\n', encoding="utf-8")
    assert result_of(text("x[0, 0] + 0.125")) == 2.125
    assert "the compiler fuses or reorders sums and products" in caplog.messages[0]
    smallest = np.nextafter(0.0, 1.0)
    assert smallest / 2.0 == 0.0 < smallest  # its start-up code would have flushed small numbers to zero
    assert float(np.float64(2.0**-1022) / 2.0) > 0.0


@needs_gcc
def test_a_law_that_has_no_c_is_run_by_python_with_one_line(caplog: pytest.LogCaptureFixture) -> None:
    source = text("math.sin(x[0, 0])")
    assert [result_of(source), result_of(source)] == [np.sin(2.0)] * 2
    (said,) = caplog.messages
    assert said.endswith("'math.sin' is not supported: Python runs the model, some hundred times slower than compiled")


@on_unix
def test_a_named_compiler_that_fails_is_an_error_and_no_other_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler_that_fails("gcc", tmp_path / "bin", monkeypatch)
    monkeypatch.setenv(BACKEND_VARIABLE, "gcc")
    with pytest.raises(SimulationError, match=r"math\.h.*; PPAFO_BACKEND=python needs no compiler"):
        load_source(text("x[0, 0] - 2.0"))
